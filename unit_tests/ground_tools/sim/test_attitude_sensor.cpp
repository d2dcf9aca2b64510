// Readings of the simulated accelerometer and sun sensor: where they are taken, and how far they are off.
#include "sim/attitude_sensor.hpp"

#include <cmath>

#include "core/trig.hpp"
#include "geometry/pose3.hpp"
#include "ground_tools/program.hpp"
#include "replay/attitude_file.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;
using namespace cairn::ground::sim;

namespace {

const test::Scratch scratch;

/// A way over waves of the ground; a reading every 0.3 m.
struct Way {
  explicit Way(Scene of) : scene(std::move(of)), path(plan(scene)) {}
  Pose3 T_map_rover(std::size_t frame) const {
    return settle(path[frame],
                  [](double x_m, double y_m) { return 0.3 * std::sin(x_m) * std::cos(0.7 * y_m); });
  }
  std::vector<AttitudeReading> readings() const {
    return read_attitude_sensors(scene, path, [this](std::size_t i) { return T_map_rover(i); });
  }

  Scene scene;
  std::vector<PathPoint> path;
};

Scene scene_of(TraverseKind kind, double length_m, std::uint64_t seed) {
  Scene scene;
  scene.seed = seed;
  scene.traverse.kind = kind;
  scene.traverse.length_m = length_m;
  scene.attitude.every_m = 0.3;
  return scene;
}

/// Errors of a reading in degrees: about the rover's forward and left axes, and of the heading.
Vec3 error_deg(const Way& way, const AttitudeReading& r) {
  const Pose3 T = way.T_map_rover(r.frame);
  const Vec3 up = T.q.conjugate() * Vec3(0.0, 0.0, 1.0);
  // exp(turn) up is up + turn x up, and up is nearly z: (turn_y, -turn_x, 0).
  const Vec3 off = r.up_rover - up;
  return Vec3(-off.y(), off.x(), wrap_angle(r.yaw_rad - attitude_of(T.q).yaw_rad)) * kDegPerRad;
}

void test_none_without_sensors(void**) {
  Scene scene = scene_of(TraverseKind::kStraight, 2.0, 1);
  scene.attitude.every_m = 0.0;
  assert_true(Way(scene).readings().empty());
}

void test_where_readings_are_taken(void**) {
  const Way straight(scene_of(TraverseKind::kStraight, 3.0, 1));
  const std::vector<AttitudeReading> readings = straight.readings();
  assert_int_equal(readings.size(), 10);
  for (std::size_t i = 0; i < readings.size(); ++i)
    assert_int_equal(readings[i].frame, 5 * (i + 1));  // of 0.06 m

  Scene scene = scene_of(TraverseKind::kStopAndGo, 3.0, 1);
  scene.traverse.stop_every_m = 1.0;
  scene.traverse.stop_frames = 4;
  const Way stops(scene);
  const std::vector<AttitudeReading> standing = stops.readings();
  assert_int_equal(standing.size(), 3 - 1 + (stops.path.back().arc_m >= 3.0 - 1e-9 ? 1 : 0));
  for (const AttitudeReading& r : standing)
    assert_true(stops.path[r.frame].arc_m == stops.path[r.frame - 1].arc_m);
}

// 400 readings: noise as asked (5 % is a sigma and a half of such a number's), and none of it common; then a
// bias that all of a drive share and drives don't, of the size asked over 30 drives.
void test_noise_and_bias(void**) {
  Scene scene = scene_of(TraverseKind::kS, 60.0, 3);
  scene.attitude.every_m = 0.06;
  scene.attitude.heading_noise_deg = 0.5;
  {
    const Way way(scene);
    Vec3 sum = Vec3::Zero(), squares = Vec3::Zero();
    const std::vector<AttitudeReading> readings = way.readings();
    const double n = static_cast<double>(readings.size());
    assert_at_least(n, 400.0);
    for (const AttitudeReading& r : readings) {
      const Vec3 e = error_deg(way, r);
      sum += e;
      squares += e.cwiseProduct(e);
    }
    const Vec3 noise(0.2, 0.2, 0.5);
    for (int k = 0; k < 3; ++k) {
      assert_near(std::sqrt(squares[k] / n), noise[k], 0.08 * noise[k]);
      assert_at_most(std::fabs(sum[k] / n), 4.0 * noise[k] / std::sqrt(n));
    }
  }
  scene.traverse.length_m = 1.0;
  scene.attitude.every_m = 0.9;
  scene.attitude.gravity_noise_deg = scene.attitude.heading_noise_deg = 0.01;
  scene.attitude.gravity_bias_deg = scene.attitude.heading_bias_deg = 1.0;
  assert_near(told_sigma(scene.attitude).gravity_rad * kDegPerRad, std::hypot(1.0, 0.01), 1e-12);
  Vec3 squares = Vec3::Zero();
  for (scene.seed = 1; scene.seed <= 30; ++scene.seed) {
    const Way way(scene);
    const Vec3 e = error_deg(way, way.readings().front());
    squares += e.cwiseProduct(e);
  }
  for (int k = 0; k < 3; ++k) assert_in_range(std::lround(100.0 * std::sqrt(squares[k] / 30.0)), 60, 140);
}

void test_table_reads_back(void**) {
  const Way way(scene_of(TraverseKind::kStraight, 3.0, 1));
  const std::vector<AttitudeReading> readings = way.readings();
  const AttitudeTable table =
      read_attitudes(scratch.file("attitude.csv", attitude_text(way.scene.attitude, readings)));
  assert_int_equal(table.size(), readings.size());
  const AttitudeSigma sigma = told_sigma(way.scene.attitude);
  for (const AttitudeReading& r : readings) {
    const app::MeasuredAttitude& a = table.at(static_cast<std::uint32_t>(r.frame));
    for (std::size_t k = 0; k < 3; ++k) assert_near(a.up_rover[k], r.up_rover[static_cast<int>(k)], 1e-9);
    assert_near(a.yaw_rad, r.yaw_rad, 1e-8);
    assert_near(a.sigma_tilt_rad, sigma.gravity_rad, 1e-8);
    assert_near(a.sigma_yaw_rad, sigma.heading_rad, 1e-8);
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_none_without_sensors),
      cmocka_unit_test(test_where_readings_are_taken),
      cmocka_unit_test(test_noise_and_bias),
      cmocka_unit_test(test_table_reads_back),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
