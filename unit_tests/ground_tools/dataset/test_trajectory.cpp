// TUM files and errors against truth, with numbers worked out by hand.
#include "dataset/trajectory.hpp"

#include "ground_tools/scratch.hpp"

using namespace cairn;
using namespace cairn::ground;
using cairn::test::Scratch;

namespace {

const Scratch scratch;

Pose3 at(double x, double y, double z, double yaw_deg = 0.0, double pitch_deg = 0.0, double roll_deg = 0.0) {
  return {quat_from_attitude({yaw_deg * kRadPerDeg, pitch_deg * kRadPerDeg, roll_deg * kRadPerDeg}),
          Vec3(x, y, z)};
}

void test_tum_text(void**) {
  static std::string text;
  text = to_tum({{1.0, at(0.5, -2.0, 1.0 / 3.0)}, {2.5, {Quat(0.8, 0.0, 0.6, 0.0), Vec3(0.0, 0.0, 0.0)}}});
  assert_string_equal(
      text.c_str(),
      "# stamp tx ty tz qx qy qz qw\n"
      "1.000000000 0.500000000 -2.000000000 0.333333333 0.000000000 0.000000000 0.000000000 1.000000000\n"
      "2.500000000 0.000000000 0.000000000 0.000000000 0.000000000 0.600000000 0.000000000 0.800000000\n");
  static Trajectory back;
  back = read_tum(scratch.file("round.tum", text));
  assert_int_equal(back.size(), 2);
  assert_near(back[0].pose.t.z(), 1.0 / 3.0, 1e-9);
  assert_near(back[1].pose.q.y(), 0.6, 1e-12);
  assert_near(back[1].pose.q.w(), 0.8, 1e-12);
  assert_near(back[1].stamp_s, 2.5, 0.0);
}

void test_tum_refusals(void**) {
  assert_refused(read_tum(scratch.path("absent.tum")), "absent.tum: cannot be read");
  assert_refused(read_tum(scratch.file("short.tum", "0 1 2 3 0 0 0 1\n1 1 2 3 0 0 0\n")),
                 "short.tum:2: 7 numbers");
  assert_refused(read_tum(scratch.file("norm.tum", "# c\n0 1 2 3 0 0 0 0.9\n")),
                 "norm.tum:2: the quaternion's length");
  assert_refused(read_tum(scratch.file("order.tum", "1 1 2 3 0 0 0 1\n1 1 2 3 0 0 0 1\n")),
                 "order.tum:2: stamp 1");
  assert_refused(read_tum(scratch.file("inf.tum", "1 inf 2 3 0 0 0 1\n")), "inf.tum:1: 'inf'");
}

void test_find_stamp(void**) {
  static Trajectory line;
  line = {{1.0, at(0, 0, 0)}, {1.0008, at(0, 0, 0)}, {2.0, at(0, 0, 0)}};
  assert_ptr_equal(find_stamp(line, 1.0007), &line[1]);
  assert_ptr_equal(find_stamp(line, 1.0003), &line[0]);
  assert_ptr_equal(find_stamp(line, 2.0009), &line[2]);
  assert_null(find_stamp(line, 2.0011));
  assert_null(find_stamp(line, 0.5));
  assert_null(find_stamp({}, 0.5));
}

// The true path: 3 m east, 4 m north, 12 m up at once: 3 + 4 + 12 = 19 m. Errors: (0.3, 0.4, 0),
// then (0, -0.1, 1.2), 0.
void test_errors_by_hand(void**) {
  static Trajectory truth, estimate;
  truth = {{0.0, at(0, 0, 0)}, {1.0, at(3, 0, 0)}, {2.0, at(3, 4, 0, 90.0)}, {3.0, at(3, 4, 12)}};
  estimate = {
      {0.0, at(0, 0, 0)}, {1.0, at(3.3, 0.4, 0, 10.0)}, {2.0, at(3, 3.9, 1.2, 87.0)}, {7.0, at(99, 99, 99)}};
  static std::optional<TrajectoryErrors> errors;
  errors = compare(estimate, truth);
  assert_true(errors.has_value());
  assert_int_equal(errors->poses.size(), 3);  // no truth at 7 s, no estimate at 3 s
  assert_near(errors->path_m, 7.0, 1e-12);
  assert_near(errors->poses[1].distance_m, 3.0, 1e-12);
  assert_near(errors->end.stamp_s, 2.0, 0.0);
  assert_near(errors->end.xy_m, 0.1, 1e-12);
  assert_near(errors->end.xyz_m, std::sqrt(0.01 + 1.44), 1e-12);
  assert_near(errors->end.position_map_m.z(), 1.2, 1e-12);
  assert_near(errors->end.rotation_deg, 3.0, 1e-9);
  assert_near(errors->end.yaw_deg, -3.0, 1e-9);
  assert_near(errors->largest_xy.xy_m, 0.5, 1e-12);
  assert_near(errors->largest_xy.stamp_s, 1.0, 0.0);
  assert_near(errors->largest_xy.yaw_deg, 10.0, 1e-9);
  assert_near(errors->rms_xy_m, std::sqrt((0.25 + 0.01) / 3.0), 1e-12);
  assert_near(errors->percent_of_path(errors->end.xy_m), 100.0 * 0.1 / 7.0, 1e-12);
  assert_false(compare(estimate, {}).has_value());
  assert_false(compare({{5.0, at(0, 0, 0)}}, truth).has_value());
  assert_near(compare({{1.0, at(3, 0, 0)}}, truth)->percent_of_path(1.0), 0.0,
              0.0);  // no path, no percentage
}

// The same angle as the paper's formula, arccos((trace(R_est^-1 R_true) - 1) / 2), by Eigen and libm.
void test_rotation_is_the_papers(void**) {
  for (int i = 0; i < 20; ++i) {
    const Pose3 a = at(0, 0, 0, 17.0 * i, 4.0 * i - 40.0, 9.0 * i);
    const Pose3 b = at(0, 0, 0, 60.0 - 5.0 * i, 3.0 * i, 2.0 * i - 30.0);
    const Mat3 R = a.q.toRotationMatrix().inverse() * b.q.toRotationMatrix();
    const double expected = std::acos((R.trace() - 1.0) / 2.0) * kDegPerRad;
    static std::optional<TrajectoryErrors> errors;
    errors = compare({{0.0, a}}, {{0.0, b}});
    assert_near(errors->end.rotation_deg, expected, 1e-6);
  }
  // A turn about the map's vertical is yaw and nothing else, however the camera is tilted.
  const Pose3 camera = at(0, 0, 0, 30.0, 50.0, 80.0);
  const Pose3 turned = {lift({0.0, 0.0, 0.02}).q * camera.q, camera.t};
  assert_near(compare({{0.0, turned}}, {{0.0, camera}})->end.yaw_deg, 0.02 * kDegPerRad, 1e-9);
  assert_near(compare({{0.0, turned}}, {{0.0, camera}})->end.rotation_deg, 0.02 * kDegPerRad, 1e-9);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_tum_text),
      cmocka_unit_test(test_tum_refusals),
      cmocka_unit_test(test_find_stamp),
      cmocka_unit_test(test_errors_by_hand),
      cmocka_unit_test(test_rotation_is_the_papers),
  };
  return cmocka_run_group_tests_name("ground_tools/dataset/trajectory", tests, nullptr, nullptr);
}
