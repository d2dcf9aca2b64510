// The way of each kind, slip, and the rover on the ground.
#include "sim/traverse.hpp"

#include <algorithm>

#include "core/trig.hpp"
#include "dataset/dataset.hpp"
#include "dataset/trajectory.hpp"
#include "support/cmocka.hpp"
#include "support/data.hpp"

using namespace cairn;
using namespace cairn::ground;
using namespace cairn::ground::sim;

namespace {

using Path = std::vector<PathPoint>;

Scene scene_of(TraverseKind kind, double length_m) {
  Scene scene;
  scene.traverse.kind = kind;
  scene.traverse.length_m = length_m;
  return scene;
}

/// Starts at the origin, so that the way can be told in numbers.
Scene at_origin(TraverseKind kind, double length_m, double step_m) {
  Scene scene = scene_of(kind, length_m);
  scene.traverse.start_x_m = 0.0;
  scene.traverse.start_y_m = 0.0;
  scene.traverse.step_m = step_m;
  return scene;
}

double distance(const PathPoint& a, const PathPoint& b) { return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m); }

void assert_at(const PathPoint& p, double x_m, double y_m, double yaw_deg) {
  assert_near(p.x_m, x_m, 1.0e-9);
  assert_near(p.y_m, y_m, 1.0e-9);
  assert_near(wrap_angle(p.yaw_rad - yaw_deg * kRadPerDeg), 0.0, 1.0e-9);
}

/// What holds for every kind without slip: steps of `step_m` at most, turns of turn_step_deg at most where it
/// stands, arcs that add up.
void assert_sound(const Path& path, const Traverse& t) {
  assert_true(path[0].arc_m == 0.0);
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double step_m = distance(path[i], path[i - 1]);
    const double arc_m = path[i].arc_m - path[i - 1].arc_m;
    const double turn_rad = std::fabs(wrap_angle(path[i].yaw_rad - path[i - 1].yaw_rad));
    assert_at_least(arc_m, 0.0);
    assert_at_most(arc_m, t.step_m + 1.0e-9);
    assert_at_most(step_m, arc_m + 1.0e-9);
    assert_at_least(step_m, 0.99 * arc_m - 1.0e-9);
    if (arc_m < 1.0e-9) assert_at_most(turn_rad, t.turn_step_deg * kRadPerDeg + 1.0e-9);
    assert_at_most(std::fabs(path[i].yaw_rad), kPi);
  }
}

void test_the_papers_s(void**) {
  const Scene scene;
  static Path path;
  path = plan(scene);
  assert_int_equal(path.size(), 1667);
  assert_sound(path, scene.traverse);
  assert_near(path.back().arc_m, 1666 * 0.06, 1.0e-9);
  double low_x = 1.0e9, high_x = -1.0e9, low_y = 1.0e9, high_y = -1.0e9;
  for (const PathPoint& p : path) {
    low_x = std::min(low_x, p.x_m);
    high_x = std::max(high_x, p.x_m);
    low_y = std::min(low_y, p.y_m);
    high_y = std::max(high_y, p.y_m);
  }
  // Centred in 0 .. 76.8, -76.8 .. 0, four metres and more from the edge.
  assert_near(low_x + high_x, 76.8, 1.0e-6);
  assert_near(low_y + high_y, -76.8, 1.0e-6);
  assert_at_least(low_x, 4.0);
  assert_at_least(low_y, -72.8);
  // Half circles: four radii high, out and back in heading.
  assert_near(high_y - low_y, 4.0 * 50.0 / kPi, 0.01);
  assert_near(path[833].yaw_rad, 833 * 0.06 / (50.0 / kPi), 1.0e-9);
  assert_near(path.back().yaw_rad, (100.0 - 1666 * 0.06) / (50.0 / kPi), 1.0e-9);
}

void test_frames_of_a_length(void**) {
  const struct {
    double length_m;
    double step_m;
    std::size_t frames;
  } cases[] = {{100.0, 0.06, 1667}, {12.0, 0.06, 201}, {0.3, 0.1, 4},
               {0.05, 0.06, 1},     {0.06, 0.06, 2},   {30.0, 0.3, 101}};
  for (const auto& c : cases) {
    Scene scene = scene_of(TraverseKind::kStraight, c.length_m);
    scene.traverse.step_m = c.step_m;
    assert_int_equal(plan(scene).size(), c.frames);
  }
}

void test_straight(void**) {
  Scene scene = at_origin(TraverseKind::kStraight, 3.0, 0.5);
  scene.traverse.start_x_m = 10.0;
  scene.traverse.start_y_m = -20.0;
  scene.traverse.start_heading_deg = 90.0;
  static Path path;
  path = plan(scene);
  assert_int_equal(path.size(), 7);
  assert_sound(path, scene.traverse);
  for (int i = 0; i < 7; ++i) assert_at(path[static_cast<std::size_t>(i)], 10.0, -20.0 + 0.5 * i, 90.0);
}

void test_arc_to_either_side(void**) {
  // A quarter of a circle where no radius is given.
  static Path path;
  path = plan(at_origin(TraverseKind::kArc, 20.0, 0.1));
  const double radius_m = 40.0 / kPi;
  assert_at(path.back(), radius_m, radius_m, 90.0);
  for (const PathPoint& p : path) assert_near(std::hypot(p.x_m, p.y_m - radius_m), radius_m, 1.0e-9);
  Scene right = at_origin(TraverseKind::kArc, 5.0 * kPi, 0.05 * kPi);
  right.traverse.radius_m = -10.0;
  path = plan(right);
  assert_at(path.back(), 10.0, -10.0, -90.0);
  assert_sound(path, right.traverse);
}

void test_s_either_way(void**) {
  Scene scene = at_origin(TraverseKind::kS, 10.0 * kPi, 0.1 * kPi);
  scene.traverse.radius_m = 10.0;  // two quarters
  static Path path;
  path = plan(scene);
  assert_at(path[50], 10.0, 10.0, 90.0);
  assert_at(path.back(), 20.0, 20.0, 0.0);
  scene.traverse.radius_m = -10.0;
  path = plan(scene);
  assert_at(path[50], 10.0, -10.0, -90.0);
  assert_at(path.back(), 20.0, -20.0, 0.0);
}

void test_zigzag(void**) {
  Scene scene = at_origin(TraverseKind::kZigzag, 5.0, 0.3);
  scene.traverse.leg_m = 2.0;
  scene.traverse.zigzag_deg = 30.0;
  scene.traverse.turn_step_deg = 1.75;
  static Path path;
  path = plan(scene);
  assert_sound(path, scene.traverse);
  const double c = std::cos(30.0 * kRadPerDeg);
  assert_at(path[0], 0.0, 0.0, 30.0);
  // A leg has six whole steps and the rest to the corner; 60 degrees are 35 turns of 1.71.
  assert_at(path[7], 2.0 * c, 1.0, 30.0);
  assert_at(path[8], 2.0 * c, 1.0, 30.0 - 60.0 / 35.0);
  assert_at(path[42], 2.0 * c, 1.0, -30.0);
  assert_near(path[43].arc_m, 2.3, 1.0e-9);
  assert_at(path[49], 4.0 * c, 0.0, -30.0);
  // The last leg is what remains: 1 m, of which 0.9 m are whole steps.
  assert_int_equal(path.size(), 50 + 35 + 3);
  assert_at(path.back(), 4.9 * c, 0.45, 30.0);
}

void test_stop_and_go(void**) {
  Scene scene = scene_of(TraverseKind::kStopAndGo, 20.0);
  scene.traverse.stop_every_m = 6.0;
  scene.traverse.stop_frames = 4;
  scene.traverse.step_m = 0.25;
  static Path path;
  path = plan(scene);
  Scene way = scene;
  way.traverse.kind = TraverseKind::kS;
  static Path moving;
  moving = plan(way);
  assert_int_equal(path.size(), moving.size() + 3 * 4);
  assert_sound(path, scene.traverse);
  // Without the standing frames it is the S.
  std::size_t next = 0;
  int standing = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (i > 0 && path[i].arc_m == path[i - 1].arc_m) {
      assert_true(path[i].x_m == path[i - 1].x_m && path[i].yaw_rad == path[i - 1].yaw_rad);
      assert_near(std::fmod(path[i].arc_m + 1.0e-6, 6.0), 0.0, 0.01);
      ++standing;
      continue;
    }
    assert_near(distance(path[i], moving[next]), 0.0, 1.0e-9);
    ++next;
  }
  assert_int_equal(standing, 12);
}

void test_point_turn(void**) {
  Scene scene = at_origin(TraverseKind::kPointTurn, 2.0, 0.1);
  scene.traverse.turn_deg = -90.0;
  static Path path;
  path = plan(scene);
  assert_sound(path, scene.traverse);
  assert_int_equal(path.size(), 1 + 10 + 45 + 10);
  for (std::size_t i = 10; i <= 55; ++i) {
    assert_at(path[i], 1.0, 0.0, -2.0 * static_cast<double>(i - 10));
    assert_near(path[i].arc_m, 1.0, 1.0e-9);
  }
  assert_at(path.back(), 1.0, -1.0, -90.0);
  // Once round on the spot.
  scene.traverse.length_m = 0.0;
  scene.traverse.turn_deg = 360.0;
  path = plan(scene);
  assert_int_equal(path.size(), 181);
  assert_sound(path, scene.traverse);
  assert_at(path[90], 0.0, 0.0, 180.0);
  assert_at(path.back(), 0.0, 0.0, 0.0);
}

void test_waypoints(void**) {
  Scene scene;
  scene.traverse.kind = TraverseKind::kWaypoints;
  scene.traverse.step_m = 0.5;
  scene.traverse.waypoints_map_m = {Vec2(1.0, 1.0), Vec2(2.0, 1.0), Vec2(3.0, 1.0), Vec2(3.0, 3.2),
                                    Vec2(3.0, 1.2)};
  static Path path;
  path = plan(scene);
  assert_sound(path, scene.traverse);
  assert_at(path[0], 1.0, 1.0, 0.0);
  assert_at(path[4], 3.0, 1.0, 0.0);  // no turn between the first two legs
  assert_at(path[4 + 45], 3.0, 1.0, 90.0);
  assert_at(path[4 + 45 + 5], 3.0, 3.2, 90.0);  // 0.2 m from the step before
  assert_at(path[4 + 45 + 5 + 90], 3.0, 3.2, 270.0);
  assert_at(path.back(), 3.0, 1.2, -90.0);
  assert_int_equal(path.size(), 1 + 4 + 45 + 5 + 90 + 4);
}

void test_centred_in_any_site(void**) {
  for (const TraverseKind kind : {TraverseKind::kS, TraverseKind::kStraight, TraverseKind::kArc,
                                  TraverseKind::kZigzag, TraverseKind::kPointTurn}) {
    for (const double heading_deg : {0.0, 37.0, -120.0}) {
      Scene scene = scene_of(kind, 30.0);
      scene.site.origin_x_m = 1000.0;
      scene.site.origin_y_m = 500.0;
      scene.site.width_m = 60.0;
      scene.site.height_m = 80.0;
      scene.traverse.start_heading_deg = heading_deg;
      const Path path = plan(scene);
      const auto by_x = std::minmax_element(
          path.begin(), path.end(), [](const PathPoint& a, const PathPoint& b) { return a.x_m < b.x_m; });
      const auto by_y = std::minmax_element(
          path.begin(), path.end(), [](const PathPoint& a, const PathPoint& b) { return a.y_m < b.y_m; });
      assert_near(by_x.first->x_m + by_x.second->x_m, 2.0 * 1030.0, 1.0e-6);
      assert_near(by_y.first->y_m + by_y.second->y_m, 2.0 * 540.0, 1.0e-6);
    }
  }
}

void test_slip(void**) {
  Scene scene = at_origin(TraverseKind::kStraight, 100.0, 0.05);
  scene.traverse.slip = 0.1;
  static Path path;
  path = plan(scene);
  assert_int_equal(path.size(), 2001);
  // Mean 0.1, uniform in 0 .. 0.2: standard deviation of the mean of 2000 is 0.0013.
  assert_near(path.back().x_m, 90.0, 0.5);
  assert_near(path.back().y_m, 0.0, 1.0e-9);
  assert_near(path.back().arc_m, path.back().x_m, 1.0e-9);
  for (std::size_t i = 1; i < path.size(); ++i) {
    assert_at_least(path[i].x_m - path[i - 1].x_m, 0.8 * 0.05 - 1.0e-9);
    assert_at_most(path[i].x_m - path[i - 1].x_m, 0.05 + 1.0e-9);
  }
  scene.traverse.slip = 0.0;
  scene.traverse.slip_sideways = 0.2;
  path = plan(scene);
  double sum2 = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double aside_m = path[i].y_m - path[i - 1].y_m;
    assert_at_most(std::fabs(aside_m), 0.2 * 0.05 + 1.0e-9);
    sum2 += aside_m * aside_m;
  }
  assert_near(path.back().x_m, 100.0, 1.0e-6);
  assert_near(std::sqrt(sum2 / 2000.0), 0.01 / std::sqrt(3.0), 0.0002);
  assert_at_least(path.back().arc_m, 100.01);
  // From the seed, and from nothing else.
  static Path again;
  again = plan(scene);
  assert_true(again.back().y_m == path.back().y_m);
  scene.seed = 2;
  again = plan(scene);
  assert_true(again.back().y_m != path.back().y_m);
}

void test_standing_does_not_slip(void**) {
  Scene scene = scene_of(TraverseKind::kStopAndGo, 20.0);
  scene.traverse.slip = 0.3;
  scene.traverse.slip_sideways = 0.3;
  static Path path;
  path = plan(scene);
  int standing = 0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    if (path[i].arc_m != path[i - 1].arc_m) continue;
    assert_true(distance(path[i], path[i - 1]) < 1.0e-12);
    ++standing;
  }
  assert_int_equal(standing, 30);  // 5, 10 and 15 m as commanded
}

void test_settles_on_a_slope(void**) {
  const double slope_x = 0.12;
  const double slope_y = -0.07;
  const auto ground = [=](double x, double y) { return 1.5 + slope_x * x + slope_y * y; };
  for (int yaw_deg = -180; yaw_deg <= 180; yaw_deg += 15) {
    const PathPoint at{3.0, -4.0, yaw_deg * kRadPerDeg, 0.0};
    const Pose3 pose = settle(at, ground);
    assert_near(pose.t.x(), 3.0, 1.0e-12);
    assert_near(pose.t.y(), -4.0, 1.0e-12);
    assert_near(pose.t.z(), 1.5 + 0.36 + 0.28, 1.0e-12);
    // Body z is the plane's normal; body x has the yaw's azimuth.
    const Vec3 normal = Vec3(-slope_x, -slope_y, 1.0).normalized();
    const Vec3 up = pose.q * Vec3(0.0, 0.0, 1.0);
    const Vec3 forward = pose.q * Vec3(1.0, 0.0, 0.0);
    assert_near((up - normal).norm(), 0.0, 1.0e-12);
    assert_near(wrap_angle(std::atan2(forward.y(), forward.x()) - at.yaw_rad), 0.0, 1.0e-12);
    assert_true(is_valid(pose));
  }
  // Signs: uphill ahead is negative pitch, left side up is positive roll.
  const Attitude ahead =
      attitude_of(settle({0.0, 0.0, 0.0, 0.0}, [](double x, double) { return 0.1 * x; }).q);
  assert_near(ahead.pitch_rad, -std::atan(0.1), 1.0e-12);
  assert_near(ahead.roll_rad, 0.0, 1.0e-12);
  const Attitude left = attitude_of(settle({0.0, 0.0, 0.0, 0.0}, [](double, double y) { return 0.1 * y; }).q);
  assert_near(left.roll_rad, std::atan(0.1), 1.0e-12);
}

void test_settles_on_rough_ground(void**) {
  // One wheel (front left) on a stone of 0.12 m: least squares over six wheels.
  const auto stone = [](double x, double y) { return x > 0.4 && y > 0.3 ? 0.12 : 0.0; };
  const Pose3 pose = settle({0.0, 0.0, 0.0, 0.0}, stone);
  assert_near(pose.t.z(), 0.02, 1.0e-12);
  const Attitude attitude = attitude_of(pose.q);
  assert_near(attitude.pitch_rad, -std::atan(0.5 * 0.12 / (4.0 * 0.25)), 1.0e-9);
  assert_near(std::tan(attitude.roll_rad), 0.4 * 0.12 / (6.0 * 0.16) / std::hypot(1.0, 0.06), 1.0e-9);
  // A ridge along the way that all wheels straddle moves nothing.
  const Pose3 level =
      settle({0.0, 0.0, 0.0, 0.0}, [](double, double y) { return std::fabs(y) < 0.3 ? 1.0 : 0.0; });
  assert_near(level.t.z(), 0.0, 1.0e-12);
}

void test_camera_sits_as_in_the_independent_set(void**) {
  static std::string folder;
  folder = test::find_data("rendered_dev");
  SKIP_WITHOUT(folder, "rendered_dev");
  static Dataset set;
  set = Dataset::open(folder);
  const StereoRig rig = stereo_rig(Rig{});
  assert_near(rig.fx_px, set.rig().fx_px, 1.0e-9);
  assert_near(rig.cx_px, set.rig().cx_px, 1.0e-9);
  assert_near(rig.baseline_m, set.rig().baseline_m, 1.0e-12);
  for (std::size_t i = 0; i < set.frames().size(); ++i) {
    const Pose3 expected = *set.truth_cam(i);
    const Pose3 got = *set.truth_rover(i) * rig.T_rover_cam;
    assert_at_most((got.t - expected.t).norm(), 2.0e-6);
    assert_at_most(quat_log(got.q.conjugate() * expected.q).norm(), 2.0e-6);
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_the_papers_s),
      cmocka_unit_test(test_frames_of_a_length),
      cmocka_unit_test(test_straight),
      cmocka_unit_test(test_arc_to_either_side),
      cmocka_unit_test(test_s_either_way),
      cmocka_unit_test(test_zigzag),
      cmocka_unit_test(test_stop_and_go),
      cmocka_unit_test(test_point_turn),
      cmocka_unit_test(test_waypoints),
      cmocka_unit_test(test_centred_in_any_site),
      cmocka_unit_test(test_slip),
      cmocka_unit_test(test_standing_does_not_slip),
      cmocka_unit_test(test_settles_on_a_slope),
      cmocka_unit_test(test_settles_on_rough_ground),
      cmocka_unit_test(test_camera_sits_as_in_the_independent_set),
  };
  return cmocka_run_group_tests_name("ground_tools/sim/traverse", tests, nullptr, nullptr);
}
