// Poses: composition, inverse, attitude angles, exponential and logarithm.
#include "geometry/pose3.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

Pose3 sample_pose(int i) {
  return {quat_from_attitude({0.7 * i - 3.0, 0.31 * i - 1.4, 0.9 - 0.4 * i}),
          Vec3(0.3 * i, -1.0 - i, 2.0 + 0.1 * i)};
}

void test_neighbours_cancel(void**) {
  for (int i = 0; i < 10; ++i) {
    const Pose3 a = sample_pose(i);
    const Pose3 identity = a * a.inverse();
    assert_near(identity.t.norm(), 0.0, 1e-12);
    assert_near(quat_log(identity.q).norm(), 0.0, 1e-12);
    const Vec3 p(1.0, 2.0, -3.0);
    const Pose3 b = sample_pose(i + 3);
    assert_near(((a * b) * p - a * (b * p)).norm(), 0.0, 1e-12);
  }
}

void test_attitude_round_trip(void**) {
  for (int i = 0; i < 10; ++i) {
    const Attitude in{0.6 * i - 2.9, 0.3 * i - 1.4, 2.5 - 0.5 * i};
    const Attitude out = attitude_of(quat_from_attitude(in));
    assert_near(out.yaw_rad, in.yaw_rad, 1e-12);
    assert_near(out.pitch_rad, in.pitch_rad, 1e-12);
    assert_near(out.roll_rad, in.roll_rad, 1e-12);
  }
}

void test_exp_log(void**) {
  for (int i = 0; i < 12; ++i) {
    const Vec3 w = Vec3(0.3 * i, -0.2, 0.05 * i) * (i == 0 ? 1e-14 : 0.8);
    assert_near((quat_log(quat_exp(w)) - w).norm(), 0.0, 1e-12);
  }
}

void test_lift_and_planar(void**) {
  const Pose2 T_map_site{3.0, -2.0, 0.4};
  const Pose3 T_site_rover = {quat_from_attitude({1.2, 0.1, -0.2}), Vec3(1.0, 0.5, 0.2)};
  const Pose3 T_map_rover = lift(T_map_site) * T_site_rover;
  const Pose2 flat = planar(T_map_rover);
  assert_near(flat.yaw_rad, 1.6, 1e-12);
  const Attitude a = attitude_of(T_map_rover.q);
  assert_near(a.pitch_rad, 0.1, 1e-12);
  assert_near(a.roll_rad, -0.2, 1e-12);
  assert_near(T_map_rover.t.z(), 0.2, 1e-15);
  const Pose2 identity = T_map_site * T_map_site.inverse();
  assert_near(identity.x_m, 0.0, 1e-12);
  assert_near(identity.y_m, 0.0, 1e-12);
  assert_near(identity.yaw_rad, 0.0, 1e-12);
}

void test_validity(void**) {
  Pose3 pose;
  assert_true(is_valid(pose));
  pose.t.x() = NAN;
  assert_false(is_valid(pose));
  pose.t.x() = 0.0;
  pose.q.w() = 1.1;
  assert_false(is_valid(pose));
  pose.q.w() = NAN;
  assert_false(is_valid(pose));
  assert_false(is_finite(Pose2{0.0, INFINITY, 0.0}));
  assert_false(is_finite(Pose2{0.0, 0.0, NAN}));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_neighbours_cancel), cmocka_unit_test(test_attitude_round_trip),
      cmocka_unit_test(test_exp_log),           cmocka_unit_test(test_lift_and_planar),
      cmocka_unit_test(test_validity),
  };
  return cmocka_run_group_tests_name("geometry/pose", tests, nullptr, nullptr);
}
