// The sun's direction: as text, on the map and in the pixel grid.
#include "ortho/sun.hpp"

#include <cmath>

#include "base/tool_error.hpp"
#include "core/trig.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

bool refused(const char* text) {
  try {
    (void)parse_sun(text, "--sun");
  } catch (const ToolError& e) {
    const std::string line = e.what();
    return line.find("--sun") == 0 && line.find('\n') == std::string::npos;
  }
  return false;
}

void test_text(void**) {
  const Sun sun = parse_sun("45,135");
  assert_near(sun.elevation_rad, kPi / 4, 1e-12);
  assert_near(sun.azimuth_rad, 0.75 * kPi, 1e-12);
  assert_near(parse_sun(" 12.5 , -90 ").azimuth_rad, 1.5 * kPi, 1e-12);
  assert_near(parse_sun("90,360").azimuth_rad, 0.0, 0.0);
  assert_near(parse_sun("+1,+359.5").azimuth_rad, 359.5 * kRadPerDeg, 1e-12);
  assert_string_equal(to_text(parse_sun("55.25,250")).c_str(), "55.25,250");
  for (const char* bad :
       {"", "45", "45;135", "45,", ",135", "45,135,3", "forty,135", "45 135", "nan,10", "10,inf", "0,10",
        "0.999,10", "90.001,10", "-5,10", "45,361", "45,-360.5", "4 5,10"}) {
    assert_true(refused(bad));
  }
}

// North up: east is right, north is up, whatever the pixel's size.
void test_directions(void**) {
  GeoTransform geo;
  geo.c[1] = 0.25;
  geo.c[5] = -0.25;
  const struct {
    const char* sun;
    double u, v;
  } cases[] = {{"30,0", 0, -1},
               {"30,90", 1, 0},
               {"30,180", 0, 1},
               {"30,270", -1, 0},
               {"30,135", std::sqrt(0.5), std::sqrt(0.5)}};
  for (const auto& c : cases) {
    const Vec2 px = sun_direction_px(parse_sun(c.sun), geo);
    assert_near(px.x(), c.u, 1e-12);
    assert_near(px.y(), c.v, 1e-12);
  }
  assert_near(sun_direction_map(parse_sun("30,90")).x(), 1.0, 1e-12);
}

// A step in the grid, taken to the map by the geo-transform itself, leads to the sun: rotated,
// sheared and oblong pixels.
void test_any_grid(void**) {
  const double grids[][4] = {{0.3, 0.4, 0.4, -0.3}, {0.2, 0.0, 0.0, 0.5}, {1.0, 0.3, -0.2, -2.0}};
  for (const auto& g : grids) {
    GeoTransform geo;
    geo.c[1] = g[0];
    geo.c[2] = g[1];
    geo.c[4] = g[2];
    geo.c[5] = g[3];
    for (double azimuth_rad = 0.1; azimuth_rad < 6.2; azimuth_rad += 0.7) {
      const Sun sun{0.5, azimuth_rad};
      const Vec2 px = sun_direction_px(sun, geo);
      assert_near(px.norm(), 1.0, 1e-12);
      const Vec2 map = geo.to_map(px.x(), px.y()) - geo.to_map(0.0, 0.0);
      assert_near(map.x() / map.norm(), std::sin(azimuth_rad), 1e-12);
      assert_near(map.y() / map.norm(), std::cos(azimuth_rad), 1e-12);
    }
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_text), cmocka_unit_test(test_directions),
                              cmocka_unit_test(test_any_grid)};
  return cmocka_run_group_tests_name("ground_tools/ortho/sun", tests, nullptr, nullptr);
}
