// North and scale of projections at a site, against what their formulas say.
#include "ortho/site_frame.hpp"

#include <cmath>

#include "core/trig.hpp"
#include "ortho/true_scale.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

SiteFrame frame_at(const std::string& system, double longitude_deg, double latitude_deg, const char* body) {
  const Places to_map(body, system);
  return site_frame(system, to_map({longitude_deg, latitude_deg})).value();
}

const char* const kEarth = "EPSG:4326";
const char* const kMars = "+proj=longlat +R=3396190";

void check_north(const SiteFrame& frame, double from_north_deg, double in_map_deg) {
  const double there = frame.azimuth_in_map(from_north_deg * kRadPerDeg);
  assert_near(wrap_angle(there - in_map_deg * kRadPerDeg) * kDegPerRad, 0.0, 2e-3);
  assert_near(wrap_angle(frame.azimuth_from_north(there) - from_north_deg * kRadPerDeg), 0.0, 1e-9);
}

void test_scale(void**) {
  // Equidistant cylindrical: cos(latitude) / cos(lat_ts) along x.
  const SiteFrame eqc = frame_at("+proj=eqc +lat_ts=55 +lon_0=180 +R=3396190", 170.0, 56.5, kMars);
  assert_near(eqc.ground_per_map().x(), std::cos(56.5 * kRadPerDeg) / std::cos(55.0 * kRadPerDeg), 1e-7);
  assert_near(eqc.ground_per_map().y(), 1.0, 1e-7);
  assert_near(scale_error(eqc), 0.0377, 1e-4);
  // Mercator of a sphere: 1 / cos(latitude), both ways.
  const SiteFrame mercator = frame_at("+proj=merc +R=3396190", 10.0, 60.0, kMars);
  assert_near(mercator.ground_per_map().x(), 0.5, 1e-7);
  assert_near(mercator.ground_per_map().y(), 0.5, 1e-7);
  // UTM: 0.9996 on its central meridian.
  const SiteFrame utm = frame_at("EPSG:32633", 15.0, 47.0, kEarth);
  assert_near(utm.ground_per_map().x(), 1.0 / 0.9996, 1e-7);
  assert_near(utm.ground_per_map().y(), 1.0 / 0.9996, 1e-7);
}

/// Off its central meridian the sinusoidal projection shears by sin(latitude) times the longitude: neither
/// axis has the most or the least scale, and the area stays.
void test_shear(void**) {
  const SiteFrame frame = frame_at("+proj=sinu +R=3396190", 14.0, 34.0, kMars);
  const double half = 0.5 * 14.0 * kRadPerDeg * std::sin(34.0 * kRadPerDeg);
  const double most = std::hypot(1.0, half) + half;
  assert_near(scale_limits(frame).x(), most, 1e-6);
  assert_near(scale_limits(frame).y(), 1.0 / most, 1e-6);
  assert_near(scale_error(frame), most - 1.0, 1e-6);
  // A shear that leaves the axes nearly as they are is told, too.
  const Places to_map(kMars, "+proj=sinu +R=3396190");
  const std::string words = scale_words("+proj=sinu +R=3396190", to_map({3.0, 25.0}));
  assert_true(words.find("between them") != std::string::npos);
}

void test_north(void**) {
  // Meridians converge by sin(latitude) times the longitude from the central one.
  const SiteFrame utm = frame_at("EPSG:32633", 17.0, 47.0, kEarth);
  check_north(utm, 135.0, 135.0 - 2.0 * std::sin(47.0 * kRadPerDeg));
  // Around the south pole by the longitude itself.
  const std::string south = "+proj=stere +lat_0=-90 +lon_0=0 +R=3396190";
  check_north(frame_at(south, 120.0, -88.0, kMars), 100.0, 220.0);
  check_north(frame_at(south, 0.0, -89.99999, kMars), 30.0, 30.0);
  // South-oriented axes (westing, southing): half a turn. No convergence on the central meridian.
  check_north(frame_at("EPSG:2053", 29.0, -26.0, kEarth), 30.0, 210.0);
  // None where meridians are lines of the map: to the bit.
  const SiteFrame eqc = frame_at("+proj=eqc +lat_ts=56 +R=3396190", 170.0, 56.02, kMars);
  assert_true(eqc.azimuth_in_map(1.25) == 1.25 && eqc.azimuth_from_north(1.25) == 1.25);
}

void test_local_reference(void**) {
  for (const char* system : {"+proj=merc +R=3396190", "+proj=eqc +lat_ts=0 +R=3396190",
                             "+proj=stere +lat_0=-90 +lon_0=0 +R=3396190"}) {
    const SiteFrame frame = frame_at(system, 77.13, -61.27, kMars);
    const std::string local = local_reference(system, frame);
    const SiteFrame there = frame_at(local, 77.13, -61.27, kMars);
    assert_near(scale_error(there), 0.0, 1e-5);
    check_north(there, 45.0, 45.0 - 0.03 * std::sin(-61.27 * kRadPerDeg));
    // A neighbour on the same tenth of a degree shares it.
    assert_string_equal(local_reference(system, frame_at(system, 77.08, -61.31, kMars)).c_str(),
                        local.c_str());
  }
}

void test_no_body(void**) {
  assert_false(site_frame("local", {0.0, 0.0}).has_value());
  assert_false(site_frame(static_cast<const OGRSpatialReference*>(nullptr), {0.0, 0.0}).has_value());
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_scale),           cmocka_unit_test(test_shear),   cmocka_unit_test(test_north),
      cmocka_unit_test(test_local_reference), cmocka_unit_test(test_no_body),
  };
  return cmocka_run_group_tests_name("ground_tools/ortho/site_frame", tests, nullptr, nullptr);
}
