// Boulders of few pixels are mapped where they stand, not shifted towards the sun: on rendered ground from
// seeds to which nothing was fitted, under a lower and a higher sun.
#include "detect/shadow_place.hpp"

#include <cmath>

#include "detect/shadow_detector.hpp"
#include "ground_tools/detect/shadow_fields.hpp"
#include "ground_tools/scratch.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

const test::Scratch scratch;

struct Shift {
  double mean_px = 0.0;  ///< towards the sun, of entries at a boulder of 2 to 4 px
  int entries = 0;
};

Shift shift_of(std::uint64_t seed, double elevation_deg) {
  test::ShadowField field = test::shadow_field(test::FieldKind::kCoarse, seed);
  field.name += fmt::format("-{}", elevation_deg);
  test::size_site(field.scene, 22.0);
  field.scene.craters.k = 0.0;
  field.scene.rocks.k = 0.3;
  field.scene.ortho_sun = {elevation_deg, 75.0};
  const test::RenderedField rendered = test::render(field, scratch.path("fields"));
  const test::Raster& raster = rendered.images[0];
  const ShadowView view = shadow_view(rendered.suns[0], raster.geo);
  const PixelRect all{0, 0, raster.width, raster.height};
  Shift out;
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
    out.mean_px += off.x() * view.towards_sun_px.x() - off.y() * view.towards_sun_px.y();
    ++out.entries;
  }
  out.mean_px /= out.entries;
  return out;
}

void test_small_boulders_are_not_shifted(void**) {
  for (const double elevation_deg : {24.0, 44.0}) {
    Shift all;
    for (const std::uint64_t seed : {9301U, 9302U}) {
      const Shift one = shift_of(seed, elevation_deg);
      all.mean_px += one.mean_px * one.entries;
      all.entries += one.entries;
    }
    all.mean_px /= all.entries;
    print_message("sun %.0f: %d boulders, %+.2f px towards the sun\n", elevation_deg, all.entries,
                  all.mean_px);
    assert_at_least(all.entries, 60);
    assert_at_most(std::fabs(all.mean_px), 0.25);
  }
}

/// Only outlines that may be too wide for their boulder; the more, the higher the sun.
void test_what_is_shifted(void**) {
  assert_true(shift_from_sun_px(1.1 * kLeastOutline_px, 2.0, 4.0, 0.7) == 0.0);
  double before = -1.0;
  for (const double tan_elevation : {0.3, 0.5, 0.7, 1.0, 1.5}) {
    const double reach = 2.0 * std::sqrt(1.0 + 0.81 / (tan_elevation * tan_elevation));  // of one body
    const double shift = shift_from_sun_px(kLeastOutline_px, 2.0, reach, tan_elevation);
    assert_at_least(shift, before + 1e-6);
    assert_at_least(shift, -0.2);
    assert_at_most(shift, 1.5);
    before = shift;
  }
  // Without a shadow to speak of it stays bounded.
  assert_at_most(shift_from_sun_px(kLeastOutline_px, 2.0, 2.0, 100.0), 1.5);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_small_boulders_are_not_shifted),
      cmocka_unit_test(test_what_is_shifted),
  };
  return cmocka_run_group_tests_name("ground_tools/shadow_place", tests, nullptr, nullptr);
}
