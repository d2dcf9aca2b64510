// The figures that the project promises of a whole drive which another renderer made, over three maps.
#include "ground_tools/raster_in_memory.hpp"
#include "integration/replay.hpp"
#include "support/data.hpp"

using namespace cairn;
using namespace cairn::ground;
using test::Raster;
using test::read_orthoimage;
using namespace cairn::test;

namespace {

Localizer localizer;

std::string folder;
Dataset data;
FlightMap map;

struct Bounds {
  double end_m;
  double largest_m;
};

test::Drive whole_drive(const StepTrim& trim) {
  localizer.set_map(map.map);
  assert_status(localizer.set_trim(trim), LocalizerStatus::kReady);
  return drive(localizer, {}, data, data.frames().size());
}

/// Plain, then with VO made worse by 2 % and 2.5 degrees.
void rendered(const Bounds& plain, const Bounds& worse) {
  const test::Drive a = whole_drive({});
  assert_int_equal(a.rounds, 13);
  assert_at_most(a.vo_end_m, 0.004 * a.path_m);
  assert_at_most(a.vo_end_deg, 0.6);
  print_message("of the local maps' boulders, %.3f lie at rocks\n", a.local.share());
  assert_at_least(a.local.share(), 0.8);
  assert_at_most(a.end_xy_m, plain.end_m);
  assert_at_most(a.largest_xy_m, plain.largest_m);
  const test::Drive b = whole_drive({1.02, 0.1 * kRadPerDeg});
  assert_at_least(b.vo_end_xy_m, 0.4);
  assert_at_most(b.end_xy_m, worse.end_m);
  assert_at_most(b.largest_xy_m, worse.largest_m);
  assert_at_most(std::fabs(b.end_yaw_deg), 0.5);
}

/// By shadows, as `cairn map build` does unless it is told otherwise.
void test_rendered_5mm_map(void**) {
  NEEDS_DATA(folder, "rendered_dev");
  data = Dataset::open(folder);
  static Raster raster;
  raster = read_orthoimage(folder + "/ortho_5mm.tif");
  assert_status(map.make(detect_boulders_by_shadow(raster, parse_sun("45,135"), {}), extent_of(raster)),
                MapStatus::kUsable);
  rendered({0.03, 0.04}, {0.03, 0.08});
}

/// By the paper's detector.
void test_rendered_10mm_map_of_another_sun(void**) {
  NEEDS_DATA(folder, "rendered_dev");
  data = Dataset::open(folder);
  static Raster raster;
  raster = read_orthoimage(folder + "/ortho_10mm_sun2.tif");
  assert_status(map.make(detect_boulders(raster, {}), extent_of(raster)), MapStatus::kUsable);
  rendered({0.12, 0.18}, {0.15, 0.25});
}

void test_rendered_true_rocks(void**) {
  NEEDS_DATA(folder, "rendered_dev");
  data = Dataset::open(folder);
  assert_status(map.make(true_rocks(folder)), MapStatus::kUsable);
  rendered({0.04, 0.08}, {0.06, 0.12});
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_rendered_5mm_map),
      cmocka_unit_test(test_rendered_10mm_map_of_another_sun),
      cmocka_unit_test(test_rendered_true_rocks),
  };
  return cmocka_run_group_tests_name("integration/rendered_drive", tests, nullptr, nullptr);
}
