// The orbital detector on drawn ground: dark discs on sloping brightness, with noise.
#include "detect/map_build.hpp"

#include <algorithm>

#include "core/random.hpp"
#include "ground_tools/raster_in_memory.hpp"
#include "ground_tools/scratch.hpp"

using namespace cairn;
using namespace cairn::ground;
using test::Raster;

namespace {

constexpr double kSideM = 6.0;
Raster raster;
std::vector<TableBoulder> found;

/// Noise of about `sigma` on ground that brightens from west to east.
void draw_ground(double pixel_m, int sigma) {
  Random random(9);
  raster = Raster();
  raster.width = raster.height = static_cast<int>(std::lround(kSideM / pixel_m));
  const double geo[6] = {500.0, pixel_m, 0.0, 80.0, 0.0, -pixel_m};
  std::copy(geo, geo + 6, raster.geo.c);
  for (int y = 0; y < raster.height; ++y) {
    for (int x = 0; x < raster.width; ++x) {
      int noise = 0;
      for (int i = 0; i < 3; ++i)
        noise += static_cast<int>(random.below(2 * static_cast<unsigned>(sigma) + 1)) - sigma;
      raster.grey.push_back(static_cast<std::uint8_t>(120 + 60 * x / raster.width + noise));
    }
  }
}

/// A disc so many levels darker than the ground under it.
void draw_disc(const Vec2& p_map_m, double diameter_m, int darker = 80) {
  for (int y = 0; y < raster.height; ++y) {
    for (int x = 0; x < raster.width; ++x) {
      if ((raster.geo.to_map(x, y) - p_map_m).norm() > 0.5 * diameter_m) continue;
      std::uint8_t& pixel = raster.grey[static_cast<std::size_t>(y) * raster.width + x];
      pixel = static_cast<std::uint8_t>(std::clamp(pixel - darker, 0, 255));
    }
  }
}

const struct {
  Vec2 p_map_m;
  double diameter_m;
} kDiscs[] = {{Vec2(501.0, 79.0), 0.30},
              {Vec2(502.5, 76.2), 0.16},
              {Vec2(505.1, 75.3), 0.22},
              {Vec2(504.2, 78.4), 0.50}};

void test_discs_at_every_resolution(void**) {
  for (const double pixel_m : {0.005, 0.01, 0.02}) {
    draw_ground(pixel_m, 5);
    for (const auto& disc : kDiscs) draw_disc(disc.p_map_m, disc.diameter_m);
    found = detect_boulders(raster, {});
    assert_int_equal(found.size(), 4);
    for (const auto& disc : kDiscs) {
      const auto near = std::find_if(found.begin(), found.end(), [&](const TableBoulder& b) {
        return (b.p_map_m - disc.p_map_m).norm() < 0.2;
      });
      assert_true(near != found.end());
      assert_near((near->p_map_m - disc.p_map_m).norm(), 0.0, 0.25 * pixel_m + 0.001);
      assert_near(near->diameter_m, disc.diameter_m, pixel_m + 0.005);
      assert_near(near->area_m2, 0.7854 * near->diameter_m * near->diameter_m, 1e-4);
      assert_near(near->contrast, 80.0 / 255.0, 0.06);
      assert_near(near->elongation, 1.0, 0.12);
      assert_in_range(static_cast<int>(100.0 * near->confidence), 90, 100);  // as dark as a shadow gets
    }
  }
}

void test_ground_without_boulders(void**) {
  for (const double pixel_m : {0.005, 0.02, 0.25}) {
    draw_ground(pixel_m, 6);
    assert_int_equal(detect_boulders(raster, {}).size(), 0);
  }
}

void test_bright_rocks_do_not_move_the_threshold(void**) {
  draw_ground(0.01, 5);
  for (int i = 0; i < 16; ++i) draw_disc(Vec2(500.6 + 1.5 * (i % 4), 79.6 - 1.5 * (i / 4)), 0.3, -100);
  for (const auto& disc : kDiscs) draw_disc(disc.p_map_m, disc.diameter_m);
  draw_disc(Vec2(503.3, 77.3), 0.2, 12);  // a stain, well above the noise, far less dark than the shadows
  found = detect_boulders(raster, {});
  assert_int_equal(found.size(), 4);
}

void test_smallest_area(void**) {
  draw_ground(0.01, 5);
  for (const auto& disc : kDiscs) draw_disc(disc.p_map_m, disc.diameter_m);
  DetectorParams params;
  params.min_area_m2 = 0.05;  // more than the disc of 0.22 m, less than that of 0.30 m
  assert_int_equal(detect_boulders(raster, params).size(), 2);
  params.min_area_m2 = 0.0;
  params.min_area_px = 1000;  // 0.1 m2: the disc of 0.5 m alone
  assert_int_equal(detect_boulders(raster, params).size(), 1);
}

void test_no_data_is_no_boulder(void**) {
  draw_ground(0.01, 5);
  for (const auto& disc : kDiscs) draw_disc(disc.p_map_m, disc.diameter_m);
  raster.valid.assign(raster.grey.size(), 255);
  for (int y = 0; y < raster.height; ++y) {
    for (int x = 0; x < raster.width / 3; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * raster.width + x;
      raster.grey[i] = 0;
      raster.valid[i] = 0;
    }
  }
  assert_int_equal(detect_boulders(raster, {}).size(), 3);  // the first disc lies in the void
}

void test_images_smaller_than_any_window(void**) {
  draw_ground(0.01, 5);
  Raster tiny;
  tiny.width = 5;
  tiny.height = 3;
  tiny.geo = raster.geo;
  tiny.grey = {90, 91, 92, 93, 94, 95, 10, 97, 98, 99, 100, 101, 102, 103, 104};
  raster = tiny;
  assert_int_equal(detect_boulders(raster, {}).size(), 0);
}

void test_extent_and_progress(void**) {
  draw_ground(0.02, 5);
  const MapExtent e = extent_of(raster);
  assert_near(e.min_x_m, 500.0, 1e-9);
  assert_near(e.max_x_m, 506.0, 1e-9);
  assert_near(e.min_y_m, 74.0, 1e-9);
  assert_near(e.max_y_m, 80.0, 1e-9);
  static double last;
  last = 0.0;
  found = detect_boulders(raster, {}, [](double share) {
    assert_true(share >= last);
    last = share;
  });
  assert_near(last, 1.0, 1e-12);
}

void test_parameter_ranges(void**) {
  static DetectorParams params;
  check(params);
  params.background_m = 0.0;
  assert_refused((check(params), 0), "--background");
  params = DetectorParams();
  params.median_m = NAN;
  assert_refused((check(params), 0), "--median");
  params = DetectorParams();
  params.threshold_scale = -1.0;
  assert_refused((check(params), 0), "--threshold-scale");
  params = DetectorParams();
  params.min_area_px = 0;
  assert_refused((check(params), 0), "--min-area-px");
  params.min_area_px = 11;
  assert_true(to_text(params) != to_text(DetectorParams()));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_discs_at_every_resolution),
      cmocka_unit_test(test_ground_without_boulders),
      cmocka_unit_test(test_bright_rocks_do_not_move_the_threshold),
      cmocka_unit_test(test_smallest_area),
      cmocka_unit_test(test_no_data_is_no_boulder),
      cmocka_unit_test(test_images_smaller_than_any_window),
      cmocka_unit_test(test_extent_and_progress),
      cmocka_unit_test(test_parameter_ranges),
  };
  return cmocka_run_group_tests_name("ground_tools/detect/detector", tests, nullptr, nullptr);
}
