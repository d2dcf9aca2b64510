// Boulders of few pixels are mapped where they stand and as large as they are, not shifted towards the sun
// nor as wide as the least outline: on rendered ground from seeds to which nothing was fitted, under a lower
// sun and a higher one.
#include "detect/shadow_confidence.hpp"

#include <algorithm>
#include <cmath>

#include "detect/shadow_detector.hpp"
#include "ground_tools/detect/shadow_fields.hpp"
#include "ground_tools/scratch.hpp"
#include "support/cmocka.hpp"
#include "support/sanitized.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

const test::Scratch scratch;

/// Of entries at a boulder of 2 to 4 px.
struct Sums {
  double towards_px = 0.0;  ///< the sun, of the boulder
  double log_size = 0.0;    ///< of the entry over the boulder
  int entries = 0;
};

test::RenderedField field_of(std::uint64_t seed, double elevation_deg) {
  test::ShadowField field = test::shadow_field(test::FieldKind::kCoarse, seed);
  field.name += fmt::format("-{}", elevation_deg);
  test::size_site(field.scene, 22.0);
  field.scene.craters.k = 0.0;
  field.scene.rocks.k = 0.3;
  field.scene.ortho_sun = {elevation_deg, 75.0};
  return test::render(field, scratch.path("fields"));
}

Sums sums_of(std::uint64_t seed, double elevation_deg) {
  const test::RenderedField rendered = field_of(seed, elevation_deg);
  const test::Raster& raster = rendered.images[0];
  const ShadowView view = shadow_view(rendered.suns[0], raster.geo);
  const PixelRect all{0, 0, raster.width, raster.height};
  Sums out;
  for (const ShadowBoulder& b :
       detect_boulders_by_shadow({all, raster.grey_view(), raster.valid_view()}, all, view, ShadowParams())) {
    const Vec2 p = raster.geo.to_map(b.u_px, b.v_px);
    const TableBoulder* nearest = nullptr;
    for (const TableBoulder& rock : rendered.rocks) {
      if (rock.diameter_m < 2.0 * view.pixel_m || !test::is_at(p, rock, view.pixel_m)) continue;
      if (nearest == nullptr || (rock.p_map_m - p).norm() < (nearest->p_map_m - p).norm()) nearest = &rock;
    }
    if (nearest == nullptr || nearest->diameter_m > 4.0 * view.pixel_m) continue;
    const Vec2 off = (p - nearest->p_map_m) / view.pixel_m;
    out.towards_px += off.x() * view.towards_sun_px.x() - off.y() * view.towards_sun_px.y();
    out.log_size += std::log(b.diameter_px * view.pixel_m / nearest->diameter_m);
    ++out.entries;
  }
  return out;
}

void test_small_boulders_are_where_and_what_they_are(void**) {
  for (const double elevation_deg : {24.0, 44.0}) {
    Sums all;
    for (const std::uint64_t seed : {9301U, 9302U}) {
      const Sums one = sums_of(seed, elevation_deg);
      all.towards_px += one.towards_px;
      all.log_size += one.log_size;
      all.entries += one.entries;
      if (test::kSanitized) break;
    }
    const double shift_px = all.towards_px / all.entries;
    const double size = std::exp(all.log_size / all.entries);
    print_message("sun %.0f: %d boulders, %+.2f px towards the sun, diameters times %.2f\n", elevation_deg,
                  all.entries, shift_px, size);
    if (test::kSanitized) return;
    assert_at_least(all.entries, 60);
    assert_at_most(std::fabs(shift_px), 0.2);
    assert_at_most(std::fabs(size - 1.0), 0.15);
  }
}

/// Of boulders of 2.4 to 4.8 px (0.6 to 1.2 m at 25 cm), and entries.
struct Found {
  int rocks = 0, found = 0, entries = 0, right = 0;

  double recall() const { return static_cast<double>(found) / rocks; }
  double precision() const { return static_cast<double>(right) / entries; }
};

void add_found(const test::RenderedField& field, const ShadowParams& params, Found& out) {
  const test::Raster& raster = field.images[0];
  const double pixel_m = raster.geo.pixel_m();
  const PixelRect all{0, 0, raster.width, raster.height};
  std::vector<TableBoulder> map;
  for (const ShadowBoulder& b : detect_boulders_by_shadow({all, raster.grey_view(), raster.valid_view()}, all,
                                                          shadow_view(field.suns[0], raster.geo), params))
    map.push_back(table_boulder(b, raster.geo));
  for (const TableBoulder& rock : field.rocks) {
    const double wide_px = rock.diameter_m / pixel_m;
    if (wide_px < 2.4 || wide_px > 4.8 || !test::extent_of(raster).contains(rock.p_map_m, rock.diameter_m))
      continue;
    ++out.rocks;
    out.found += std::any_of(map.begin(), map.end(), [&](const TableBoulder& e) {
      return (e.p_map_m - rock.p_map_m).norm() <= std::max(pixel_m, 0.5 * rock.diameter_m);
    });
  }
  out.entries += static_cast<int>(map.size());
  out.right += static_cast<int>(std::count_if(map.begin(), map.end(), [&](const TableBoulder& e) {
    return test::is_boulder(e.p_map_m, e.diameter_m, pixel_m, field.rocks);
  }));
}

/// Where smaller boulders are asked for, they are found, and hardly less to be believed. Larger ones that are
/// asked for change nothing.
void test_smaller_ones_are_found_where_asked_for(void**) {
  Found usual, asked;
  for (const double elevation_deg : {24.0, 44.0}) {
    const test::RenderedField field = field_of(9301, elevation_deg);
    const double pixel_m = field.images[0].geo.pixel_m();
    add_found(field, ShadowParams(), usual);
    add_found(field, ShadowParams().with_boulders_of(2.0 * pixel_m, pixel_m), asked);
    const ShadowParams larger = ShadowParams().with_boulders_of(5.0 * pixel_m, pixel_m);
    assert_true(larger.min_diameter_px == 3.0 && larger.min_diameter_m == ShadowParams().min_diameter_m);
    if (test::kSanitized) break;
  }
  print_message("2.4 to 4.8 px: recall %.3f of %d, precision %.3f of %d; asked for %.3f, %.3f of %d\n",
                usual.recall(), usual.rocks, usual.precision(), usual.entries, asked.recall(),
                asked.precision(), asked.entries);
  assert_at_least(asked.recall(), usual.recall() + 0.1);
  assert_at_least(asked.precision(), 0.9);
}

/// Whatever a fit looks like, its body stays about its outline; and a wide outline is the body's.
void test_bodies_are_bounded(void**) {
  for (const double extreme : {-1e6, -1.0, 0.0, 1.0, 1e6}) {
    for (std::size_t i = 0; i < kShadowFeatures; ++i) {
      ShadowFeatures features = kShadowModel.middle;
      for (std::size_t k = i; k < kShadowFeatures; ++k) features[k] = extreme;
      for (const double half_width_px : {2.0, 4.0, kTrueOutline_px}) {
        const ShadowBody body = shadow_body(features, half_width_px);
        assert_at_most(std::fabs(body.towards_sun), half_width_px < kTrueOutline_px ? 0.9 : 0.0);
        assert_at_least(body.size, half_width_px < kTrueOutline_px ? 0.4 : 1.0);
        assert_at_most(body.size, half_width_px < kTrueOutline_px ? 1.5 : 1.0);
      }
    }
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_small_boulders_are_where_and_what_they_are),
      cmocka_unit_test(test_smaller_ones_are_found_where_asked_for),
      cmocka_unit_test(test_bodies_are_bounded),
  };
  return cmocka_run_group_tests_name("ground_tools/shadow_body", tests, nullptr, nullptr);
}
