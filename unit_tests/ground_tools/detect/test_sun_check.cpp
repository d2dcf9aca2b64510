// A sun given where the shadows point, seen by the image itself.
#include "detect/sun_check.hpp"

#include <algorithm>
#include <cmath>

#include "core/random.hpp"
#include "core/trig.hpp"
#include "ground_tools/detect/shadow_fields.hpp"
#include "ground_tools/raster_in_memory.hpp"
#include "ground_tools/scratch.hpp"
#include "support/cmocka.hpp"
#include "support/data.hpp"
#include "support/sanitized.hpp"

using namespace cairn;
using namespace cairn::ground;
using test::Raster;

namespace {

const test::Scratch scratch;
Raster raster;

constexpr int kSide = 400;

/// Ground with `count` boulders of 6 to 12 px, lit towards the sun, and their shadows. `lit`: grey of the
/// side towards the sun, `dim` of the other one; the ground's is 110 to 118, the shadows' 28 to 34.
void draw(int count, double azimuth_deg, std::uint8_t lit = 170, std::uint8_t dim = 60) {
  Random random(7);
  raster.width = kSide;
  raster.height = kSide;
  raster.geo.c[1] = 0.1;
  raster.geo.c[5] = -0.1;
  raster.grey.resize(static_cast<std::size_t>(kSide) * kSide);
  for (std::uint8_t& grey : raster.grey) grey = static_cast<std::uint8_t>(110 + random.below(9));
  const Vec2 towards = sun_direction_px({0.7, azimuth_deg * kRadPerDeg}, raster.geo);
  for (int i = 0; i < count; ++i) {
    const double u = 20.0 + random.below(kSide - 40);
    const double v = 20.0 + random.below(kSide - 40);
    const double radius = 3.0 + 0.01 * random.below(300);
    const auto from = [&](double at) { return std::max(0, static_cast<int>(at - 3.0 * radius)); };
    const auto to = [&](double at) { return std::min(kSide, static_cast<int>(at + 3.0 * radius) + 1); };
    for (int y = from(v); y < to(v); ++y) {
      for (int x = from(u); x < to(u); ++x) {
        const Vec2 off(x - u, y - v);
        const double along = off.dot(towards);
        const double across = off.x() * towards.y() - off.y() * towards.x();
        std::uint8_t& grey = raster.grey[static_cast<std::size_t>(y) * kSide + static_cast<std::size_t>(x)];
        if (std::fabs(across) < radius && along < 0.0 && along > -2.0 * radius)
          grey = static_cast<std::uint8_t>(28 + random.below(7));
        if (off.norm() < radius) grey = along > 0.0 ? lit : dim;
      }
    }
  }
}

SunCheck check_at(double azimuth_deg) {
  return check_sun(*test::view_of(raster)->reader(), test::view_of(raster)->facts(),
                   {0.7, azimuth_deg * kRadPerDeg}, 2);
}

void test_same_by_one_thread_and_two(void**) {
  draw(3, 0.0);
  const auto by = [](int threads) {
    return check_sun(*test::view_of(raster)->reader(), test::view_of(raster)->facts(), {0.7, 0.0}, threads);
  };
  const SunCheck one = by(1);
  const SunCheck two = by(2);
  assert_true(one.told.fits > 0);
  assert_int_equal(one.told.fits, two.told.fits);
  assert_int_equal(one.opposite.fits, two.opposite.fits);
  assert_true(one.told.sum == two.told.sum && one.opposite.sum == two.opposite.sum);
}

void test_both_ways(void**) {
  for (const double azimuth_deg : {0.0, 50.0, 135.0, 200.0, 275.0, 330.0}) {
    draw(40, azimuth_deg);
    assert_false(check_at(azimuth_deg).looks_reversed());
    assert_true(check_at(azimuth_deg + 180.0).looks_reversed());
    if (test::kSanitized) break;
  }
}

/// A strip across a collar fills no window by half, and is judged all the same.
void test_a_narrow_strip(void**) {
  for (const double azimuth_deg : {50.0, 135.0, 275.0}) {
    draw(90, azimuth_deg);
    raster.valid.assign(raster.grey.size(), 0);
    for (int y = 0; y < kSide; ++y) {
      for (int x = std::max(0, y - 80); x < std::min(kSide, y + 80); ++x)
        raster.valid[static_cast<std::size_t>(y) * kSide + static_cast<std::size_t>(x)] = 255;
    }
    assert_false(check_at(azimuth_deg).looks_reversed());
    assert_true(check_at(azimuth_deg + 180.0).looks_reversed());
    if (test::kSanitized) break;
  }
  raster.valid.clear();
}

void add(SunEvidence& to, const SunEvidence& one) {
  to.sum += one.sum;
  to.fits += one.fits;
}

void test_rocks_darker_than_the_ground(void**) {
  SunCheck all;  // one field alone is too poor to tell
  for (const double azimuth_deg : {0.0, 75.0, 160.0, 250.0}) {
    draw(60, azimuth_deg, 90, 70);
    assert_false(check_at(azimuth_deg).looks_reversed());
    const SunCheck reversed = check_at(azimuth_deg + 180.0);
    add(all.told, reversed.told);
    add(all.opposite, reversed.opposite);
    if (test::kSanitized) return;
  }
  assert_true(all.looks_reversed());
}

void test_no_boulders_no_opinion(void**) {
  draw(0, 0.0);
  for (const double azimuth_deg : {0.0, 90.0, 180.0, 270.0}) {
    assert_false(check_at(azimuth_deg).looks_reversed());
    if (test::kSanitized) break;
  }
  draw(3, 0.0);
  assert_false(check_at(0.0).looks_reversed());
}

/// Of one image, both ways.
void check_both_ways(const test::Raster& image, const Sun& sun, const std::string& name) {
  raster = image;
  const double azimuth_deg = sun.azimuth_rad * kDegPerRad;
  const auto seen = [&](double turned_deg) {
    return check_sun(*test::view_of(raster)->reader(), test::view_of(raster)->facts(),
                     {sun.elevation_rad, (azimuth_deg + turned_deg) * kRadPerDeg}, 2);
  };
  const SunCheck right = seen(0.0);
  const SunMargin over = margin(right.told, right.opposite);
  print_message("%s: %+.2f each, %+.1f together\n", name.c_str(), over.each, over.together);
  assert_false(right.looks_reversed());
  assert_true(seen(180.0).looks_reversed());
}

// A bowl looks like a dome under the opposite sun, and there are many more bowls here, or nothing else.
void test_ground_of_craters(void**) {
  for (const auto& [kind, seed, rocks_k] : {std::tuple{test::FieldKind::kCratered, 9611U, 0.0},
                                            {test::FieldKind::kCoarse, 9613U, 0.03},
                                            {test::FieldKind::kFresh, 9614U, 0.0},
                                            {test::FieldKind::kFresh, 9615U, 0.02}}) {
    test::ShadowField field = test::shadow_field(kind, seed);
    test::size_site(field.scene, 240.0 * field.pixels_m[0]);
    field.scene.craters.k = std::max(field.scene.craters.k, 150.0);
    field.scene.rocks.k = rocks_k;
    const test::RenderedField rendered = test::render(field, scratch.path("fields"));
    check_both_ways(rendered.images[0], rendered.suns[0], field.name);
    if (test::kSanitized) return;
  }
}

// The same, drawn by others: depths without texture, rims, and now and then a boulder.
void test_drawn_craters(void**) {
  for (const auto& [name, elevation_deg] : {std::pair{"site_el20", 20.0},
                                            {"site_el30", 30.0},
                                            {"site_el40", 40.0},
                                            {"mixed_el20", 20.0},
                                            {"mixed_el35", 35.0}}) {
    const std::string path =
        test::find_data(fmt::format("raster_cases/16_craters_no_boulders/{}.tif", name).c_str());
    SKIP_WITHOUT(path, "raster_cases");
    check_both_ways(test::read_orthoimage(path), {elevation_deg * kRadPerDeg, 290.0 * kRadPerDeg}, name);
    if (test::kSanitized) return;
  }
}

// A cube whose shadows are darker and whose lit sides are brighter than it can tell: they are no gaps.
void test_black_and_white_beyond_the_file(void**) {
  const std::string path = test::find_data("raster_cases/03_isis_saturated/site16.cub");
  SKIP_WITHOUT(path, "raster_cases");
  const auto source = open_orthoimage(path);
  const auto seen = [&](double azimuth_deg) {
    return check_sun(*source->reader(), source->facts(), {35.0 * kRadPerDeg, azimuth_deg * kRadPerDeg}, 2);
  };
  assert_false(seen(135.0).looks_reversed());
  assert_true(seen(315.0).looks_reversed());
}

// The direction comes out of the image, and how sure it is. On bare ground it is not.
void test_sun_by_the_image(void**) {
  const auto guess_of = [](double elevation_rad) {
    return guess_sun(*test::view_of(raster)->reader(), test::view_of(raster)->facts(), elevation_rad);
  };
  raster = test::read_orthoimage(CAIRN_SOURCE_DIR "/unit_tests/integration/sample/ortho_5mm.tif");
  const SunGuess guess = guess_of(0.7);
  print_message("%.1f degrees by %d fits\n", guess.sun.azimuth_rad * kDegPerRad, guess.best.fits);
  assert_near(wrap_angle(guess.sun.azimuth_rad - 135.0 * kRadPerDeg), 0.0, 10.0 * kRadPerDeg);
  assert_near(guess.sun.elevation_rad, 0.7, 0.0);
  // Discs with square shadows may be misread, but not surely.
  for (const double azimuth_deg : {20.0, 135.0, 250.0}) {
    draw(40, azimuth_deg);
    const SunGuess drawn = guess_of(0.7);
    const double off_rad = wrap_angle(drawn.sun.azimuth_rad - azimuth_deg * kRadPerDeg);
    assert_true(std::fabs(off_rad) <= 25.0 * kRadPerDeg || !drawn.is_sure());
    if (test::kSanitized) break;
  }
  draw(0, 0.0);
  assert_false(guess_of(0.0).is_sure());
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_both_ways),
      cmocka_unit_test(test_same_by_one_thread_and_two),
      cmocka_unit_test(test_a_narrow_strip),
      cmocka_unit_test(test_rocks_darker_than_the_ground),
      cmocka_unit_test(test_no_boulders_no_opinion),
      cmocka_unit_test(test_ground_of_craters),
      cmocka_unit_test(test_drawn_craters),
      cmocka_unit_test(test_black_and_white_beyond_the_file),
      cmocka_unit_test(test_sun_by_the_image),
  };
  return cmocka_run_group_tests_name("ground_tools/detect/sun_check", tests, nullptr, nullptr);
}
