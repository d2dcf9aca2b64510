// Boulders of single frames of the sample, with the true poses: what is seen, where it lies, what goes on.
#include "localizer/boulder_observer.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "integration/replay.hpp"

using namespace cairn;
using namespace cairn::test;

namespace {

ground::Dataset data;
StereoRig rig;
BoulderObserver observer;
Pair pair;

/// Level ground under the rover, as the disparity plane that VO would fit: n . p = height, d = f b / z.
Vec3 level_ground() {
  const Quat q_cam_rover = rig.T_rover_cam.q.conjugate();
  const Vec3 n = (q_cam_rover * Vec3(0.0, 0.0, -1.0)) * (rig.fx_px * rig.baseline_m / rig.T_rover_cam.t.z());
  const double a = n.x() / rig.fx_px;
  const double b = n.y() / rig.fy_px;
  return {a, b, n.z() - a * rig.cx_px - b * rig.cy_px};
}

Pose3 pose(std::size_t frame) { return *data.truth_cam(frame); }

ObserveStatus start(std::size_t frame) {
  load(data.frames()[frame], pair);
  return observer.start(pair.left.view(), pair.right.view(), level_ground(), pose(frame));
}

ObserveStatus observe(std::size_t frame) {
  assert_status(start(frame), ObserveStatus::kRunning);
  WorkBudget all = WorkBudget::unlimited();
  assert_status(observer.step(all), Progress::kDone);
  return observer.status();
}

/// Distance to the nearest rock and how much nearer to the camera than the rock the sighting lies.
struct Nearest {
  double distance_m = 1.0e9;
  double short_m = 0.0;
};

Nearest nearest_rock(const BoulderSighting& s, const Pose3& T_map_cam) {
  Nearest best;
  const Vec2 p(s.p_site_m.x(), s.p_site_m.y());
  const Vec2 along = (p - Vec2(T_map_cam.t.x(), T_map_cam.t.y())).normalized();
  for (const ground::TruthRock& rock : data.truth_rocks()) {
    const double distance = (rock.p_map_m - p).norm();
    if (distance >= best.distance_m) continue;
    best.distance_m = distance;
    best.short_m = along.dot(rock.p_map_m - p);
  }
  return best;
}

struct Tally {
  int sightings = 0;
  int on_rocks = 0;
  int matched = 0;
  int could_match = 0;
  double short_m = 0.0;  ///< mean over those on rocks
  int rocks = 0;         ///< of 0.1 m and more, whole in the image, within 2.5 m over ground
  int found = 0;         ///< of these
};

bool is_whole_in_view(const ground::TruthRock& rock, const Pose3& T_map_cam) {
  const Vec3 p_map(rock.p_map_m.x(), rock.p_map_m.y(), rock.z_ground_map_m + 0.5 * rock.height_m);
  const Vec3 p_cam = T_map_cam.inverse() * p_map;
  const Vec3 away = p_map - T_map_cam.t;
  if (rock.diameter_m < 0.10 || p_cam.z() < 0.2 || std::hypot(away.x(), away.y()) > 2.5) return false;
  const StereoPixel at = project(rig, p_cam);
  const double half_px = 0.5 * rock.diameter_m * rig.fx_px / p_cam.z();
  return at.u_left >= half_px && at.u_left <= rig.width_px - half_px && at.v_left >= half_px &&
         at.v_left <= rig.height_px - half_px;
}

void count_rocks(const Pose3& T_map_cam, Tally& t) {
  for (const ground::TruthRock& rock : data.truth_rocks()) {
    if (!is_whole_in_view(rock, T_map_cam)) continue;
    ++t.rocks;
    for (const BoulderSighting& s : observer.result()) {
      const Vec2 p(s.p_site_m.x(), s.p_site_m.y());
      if ((rock.p_map_m - p).norm() > std::max(0.10, 0.5 * rock.diameter_m)) continue;
      ++t.found;
      break;
    }
  }
}

Tally tally(const BoulderParams& params) {
  Tally t;
  observer.init(params, rig);
  for (std::size_t i = 10; i < (kSanitized ? 13U : 30U); ++i) {
    assert_status(observe(i), ObserveStatus::kBoulders);
    for (const BoulderSighting& s : observer.result()) {
      t.could_match += i > 10 ? 1 : 0;
      t.matched += s.previous != 0 ? 1 : 0;
      if (s.diameter_m < static_cast<float>(cfg::kMission.boulder_min_diameter_m)) continue;
      const Nearest n = nearest_rock(s, pose(i));
      ++t.sightings;
      if (n.distance_m > 0.10) continue;
      ++t.on_rocks;
      t.short_m += n.short_m;
    }
    count_rocks(pose(i), t);
  }
  t.short_m /= t.on_rocks;
  print_message("%d sightings, %d on rocks, %.3f m short of them; %d of %d rocks; %d of %d go on\n",
                t.sightings, t.on_rocks, t.short_m, t.found, t.rocks, t.matched, t.could_match);
  return t;
}

/// Nothing of the rover itself is a boulder, and what is seen beside it is as without it.
void test_own_hardware(void**) {
  const int from = rig.height_px / 2;
  BoulderParams params;
  observer.init(params, rig);
  assert_status(observe(10), ObserveStatus::kBoulders);
  std::size_t beside = 0;
  for (const SurfacePoint& p : observer.surface()) beside += p.v < from ? 1 : 0;
  params.own.cover({0, from, rig.width_px, rig.height_px});
  observer.init(params, rig);
  const ObserveStatus status = observe(10);
  assert_true(status == ObserveStatus::kBoulders || status == ObserveStatus::kNoBoulders);
  for (const SurfacePoint& p : observer.surface()) assert_true(p.v < from);
  assert_int_equal(observer.surface().size(), beside);
  assert_true(beside > 0);
  params.own.cover({0, 0, rig.width_px, rig.height_px});
  observer.init(params, rig);
  assert_status(observe(10), ObserveStatus::kNoPoints);
}

/// A right image that lies 3 px lower and 6 px to the right, and is told so: the ground is where it was.
void test_right_image_with_an_offset(void**) {
  observer.init({}, rig);
  assert_status(observe(10), ObserveStatus::kBoulders);
  static SurfacePoints level;
  level = observer.surface();
  static std::uint8_t pixels[cfg::kImageWidth * cfg::kImageHeight] = {};
  const ImageU8 right = pair.right.view();
  const int width = right.width;
  for (int v = 3; v < right.height; ++v) std::memcpy(pixels + v * width + 6, right.row(v - 3), width - 6);
  const ImageU8 moved = packed_view<const std::uint8_t>(pixels, width, right.height);
  observer.init({}, rig);
  assert_status(observer.start(pair.left.view(), moved, level_ground(), pose(10), {3.2, 6.0}),
                ObserveStatus::kRunning);
  WorkBudget all = WorkBudget::unlimited();
  assert_status(observer.step(all), Progress::kDone);
  std::size_t same = 0;
  for (const SurfacePoint& p : observer.surface()) {
    for (const SurfacePoint& q : level) {
      if (p.u == q.u && p.v == q.v) same += (p.p_site_m - q.p_site_m).norm() < 1e-6 ? 1U : 0U;
    }
  }
  assert_at_least(observer.surface().size(), 0.95 * level.size());
  assert_at_least(same, 0.95 * level.size());
}

void test_boulders_lie_on_rocks(void**) {
  const Tally t = tally({});
  assert_at_least(t.sightings, kSanitized ? 15 : 100);
  assert_at_least(t.on_rocks, 0.85 * t.sightings);
  assert_at_least(t.found, 0.75 * t.rocks);
  assert_at_least(t.matched, 0.7 * t.could_match);
  BoulderParams mean;
  mean.centre = BoulderCentre::kMean;
  const Tally m = tally(mean);
  assert_at_least(m.short_m, t.short_m + 0.01);  // the mean lies on the side that faces the camera
}

/// What goes on is the same boulder: it lies where it was.
void test_votes_name_the_same_boulder(void**) {
  observer.init({}, rig);
  static BoulderSightings last;
  assert_status(observe(20), ObserveStatus::kBoulders);
  for (const BoulderSighting& s : observer.result()) assert_int_equal(s.previous, 0);
  last = observer.result();
  assert_status(observe(21), ObserveStatus::kBoulders);
  int matched = 0;
  int stayed = 0;
  for (const BoulderSighting& s : observer.result()) {
    if (s.previous == 0) continue;
    ++matched;
    assert_true(s.previous <= last.size());
    stayed += (last[s.previous - 1U].p_site_m - s.p_site_m).norm() < 0.15 ? 1 : 0;
  }
  assert_int_equal(matched, observer.counts().matched);
  assert_at_least(matched, 4);
  assert_at_least(stayed, 0.8 * matched);
}

/// The rover turned on the spot, so that no axis of `site` is special.
Pose3 turned(std::size_t frame, double yaw_rad) {
  return Pose3{quat_from_attitude({yaw_rad, 0.0, 0.0}), Vec3(3.0, -2.0, 0.5)} * pose(frame);
}

ObserveStatus observe_turned(std::size_t frame, double yaw_rad) {
  load(data.frames()[frame], pair);
  assert_status(observer.start(pair.left.view(), pair.right.view(), level_ground(), turned(frame, yaw_rad)),
                ObserveStatus::kRunning);
  WorkBudget all = WorkBudget::unlimited();
  assert_status(observer.step(all), Progress::kDone);
  return observer.status();
}

/// Each point is seen where it was probed, within the range, and none on the rover itself. A share of its
/// disparity is uncertain, and so that share of its height below the camera.
void test_points_of_the_surface(void**) {
  BoulderParams params;
  params.max_range_m = 2.5;
  params.own.cover({0, rig.height_px * 3 / 4, rig.width_px / 2, rig.height_px});
  observer.init(params, rig);
  for (const double yaw_rad : {0.7, 2.3}) {
    assert_status(observe_turned(20, yaw_rad), ObserveStatus::kBoulders);
    const Pose3 T_site_cam = turned(20, yaw_rad);
    const Pose3 T_cam_site = T_site_cam.inverse();
    assert_at_least(observer.surface().size(), 500);
    for (const SurfacePoint& s : observer.surface()) {
      const Vec3 p_cam = T_cam_site * s.p_site_m;
      const StereoPixel px = project(rig, p_cam);
      assert_near(px.u_left, s.u - 0.5, 1e-6);
      assert_near(px.v_left, s.v - 0.5, 1e-6);
      assert_false(params.own.covers(s.u - 0.5, s.v - 0.5));
      const Vec3 ray = s.p_site_m - T_site_cam.t;
      assert_at_most(std::hypot(ray.x(), ray.y()), params.max_range_m);
      const double per_px = p_cam.z() / (rig.fx_px * rig.baseline_m);
      const double sigma_m = params.probe_sigma_px * std::fabs(ray.z()) * per_px;
      assert_near(s.sigma_height_m, sigma_m, 1e-5 * sigma_m);
    }
  }
}

/// Against its own points: a disc as wide as they are seen, half a probe more on either side, behind the
/// nearest of them and in the middle across.
void check_sighting(std::size_t index, const Vec3& camera, const BoulderParams& params) {
  const BoulderSighting& s = observer.result()[index];
  std::vector<Vec3> points;
  bool labelled = false;
  Vec3 mean(0.0, 0.0, 0.0);
  for (const SurfacePoint& p : observer.surface()) {
    if (!p.raised || observer.sighting_of(p) != index + 1) continue;
    points.push_back(p.p_site_m);
    mean += p.p_site_m;
    labelled = labelled || p.label != 0;
  }
  assert_true(labelled);
  assert_int_equal(points.size(), s.points);
  assert_at_least(points.size(), params.min_points);
  mean /= static_cast<double>(points.size());
  const Vec2 sight(mean.x() - camera.x(), mean.y() - camera.y());
  const Vec2 ahead = sight.normalized();
  double nearest = 1e9;
  double least = 1e9;
  double most = -1e9;
  double square = 0.0;
  for (const Vec3& p : points) {
    const Vec2 d(p.x() - s.p_site_m.x(), p.y() - s.p_site_m.y());
    nearest = std::min(nearest, ahead.dot(d));
    const double across = ahead.x() * d.y() - ahead.y() * d.x();
    least = std::min(least, across);
    most = std::max(most, across);
    square += (p - mean).squaredNorm() / static_cast<double>(points.size());
  }
  const double probe_m = StereoProbeJob::kSpacing * std::max(sight.norm(), 0.3) / rig.fx_px;
  const auto width = static_cast<double>(s.diameter_m);
  assert_near(s.range_m, sight.norm(), 1e-5);
  assert_near(s.spread_m, std::sqrt(square), 1e-6);
  assert_near(width, most - least + probe_m, 1e-5);
  assert_near(nearest, -0.5 * width, 1e-6);
  assert_near(least + most, 0.0, 1e-6);
  assert_near(s.p_site_m.z(), mean.z(), 1e-9);
}

void test_a_sighting_against_its_points(void**) {
  const BoulderParams usual;
  BoulderParams crumbs;  // clusters of single points, so that some hold none of a region
  crumbs.clustering.cut_m = 0.01;
  crumbs.min_points = 1;
  for (const bool apart : {false, true}) {
    const BoulderParams& params = apart ? crumbs : usual;
    const double yaw_rad = apart ? 2.3 : 0.7;
    observer.init(params, rig);
    for (const std::size_t frame : {20U, 30U}) {
      assert_status(observe_turned(frame, yaw_rad), ObserveStatus::kBoulders);
      assert_int_equal(observer.counts().dropped_points, 0);
      for (std::size_t i = 0; i < observer.result().size(); ++i)
        check_sighting(i, turned(frame, yaw_rad).t, params);
    }
  }
}

/// Given up while sightings were there already: none are shown. After init() there is no frame to go on from.
void test_what_is_forgotten(void**) {
  observer.init({}, rig);
  assert_status(observe(20), ObserveStatus::kBoulders);
  assert_status(start(21), ObserveStatus::kRunning);
  while (observer.result().empty()) {
    WorkBudget one(1);
    assert_status(observer.step(one), Progress::kMore);
  }
  observer.abandon();
  assert_int_equal(observer.result().size(), 0);
  assert_int_equal(observer.counts().regions, 0);
  observer.init({}, rig);
  assert_status(observe(21), ObserveStatus::kBoulders);
  for (const BoulderSighting& s : observer.result()) assert_int_equal(s.previous, 0);
}

void test_an_abandoned_frame_is_passed_over(void**) {
  observer.init({}, rig);
  assert_status(observe(20), ObserveStatus::kBoulders);
  assert_status(start(40), ObserveStatus::kRunning);
  WorkBudget some(2'000'000);
  assert_status(observer.step(some), Progress::kMore);
  observer.abandon();
  assert_status(observer.status(), ObserveStatus::kIdle);
  assert_status(observe(21), ObserveStatus::kBoulders);
  assert_at_least(observer.counts().matched, 4);
}

void test_statuses(void**) {
  static BoulderObserver fresh;
  assert_status(fresh.status(), ObserveStatus::kIdle);
  WorkBudget all = WorkBudget::unlimited();
  assert_status(fresh.step(all), Progress::kDone);

  BoulderParams params;
  params.evidence.min_top_m = 10.0;
  observer.init(params, rig);
  assert_status(observe(20), ObserveStatus::kNoBoulders);
  assert_int_equal(observer.result().size(), 0);
  assert_at_least(observer.counts().regions, 5);
  assert_at_least(observer.counts().probes, 500);

  params = {};
  params.max_range_m = 0.0;
  observer.init(params, rig);
  assert_status(observe(20), ObserveStatus::kNoPoints);

  observer.init({}, rig);
  load(data.frames()[20], pair);
  const ImageU8 left = pair.left.view();
  const ImageU8 right = pair.right.view();
  const Vec3 plane = level_ground();
  ImageU8 smaller = left;
  smaller.width -= 2;
  assert_status(observer.start(smaller, right, plane, pose(20)), ObserveStatus::kBadInput);
  assert_status(observer.start(ImageU8{}, right, plane, pose(20)), ObserveStatus::kBadInput);
  assert_status(observer.start(left, ImageU8{}, plane, pose(20)), ObserveStatus::kBadInput);
  assert_status(observer.start(left, right, Vec3(0.0, NAN, 0.0), pose(20)), ObserveStatus::kBadInput);
  Pose3 bad = pose(20);
  bad.t.x() = NAN;
  assert_status(observer.start(left, right, plane, bad), ObserveStatus::kBadInput);
  assert_status(observer.step(all), Progress::kDone);
  assert_int_equal(observer.result().size(), 0);

  for (const std::uint8_t grey : {std::uint8_t{0}, std::uint8_t{255}}) {
    pair.left.pixels.assign(pair.left.pixels.size(), grey);
    assert_status(observer.start(pair.left.view(), right, plane, pose(20)), ObserveStatus::kRunning);
    assert_status(observer.step(all), Progress::kDone);
    assert_status(observer.status(), ObserveStatus::kNoRegions);
    assert_int_equal(observer.result().size(), 0);
  }
  assert_status(observe(21), ObserveStatus::kBoulders);
}

bool same(const BoulderSightings& a, const BoulderSightings& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::memcmp(a[i].p_site_m.data(), b[i].p_site_m.data(), 3 * sizeof(double)) != 0) return false;
    if (std::memcmp(&a[i].diameter_m, &b[i].diameter_m, sizeof(float)) != 0) return false;
    if (std::memcmp(&a[i].spread_m, &b[i].spread_m, sizeof(float)) != 0) return false;
    if (std::memcmp(&a[i].range_m, &b[i].range_m, sizeof(float)) != 0) return false;
    if (a[i].points != b[i].points || a[i].previous != b[i].previous) return false;
  }
  return true;
}

void test_slices_give_the_same(void**) {
  static BoulderSightings whole[2];
  observer.init({}, rig);
  for (std::size_t i = 0; i < 2; ++i) {
    assert_status(observe(20 + i), ObserveStatus::kBoulders);
    whole[i] = observer.result();
  }
  for (const std::uint32_t ops : {1U, 3001U, 700'001U}) {
    observer.init({}, rig);
    for (std::size_t i = 0; i < 2; ++i) {
      assert_status(start(20 + i), ObserveStatus::kRunning);
      int steps = 0;
      for (Progress progress = Progress::kMore; progress == Progress::kMore; ++steps) {
        WorkBudget budget(ops);
        progress = observer.step(budget);
      }
      assert_true(steps > 5);
      assert_true(same(observer.result(), whole[i]));
    }
  }
}

int open_sample(void**) {
  data = ground::Dataset::open(kSample);
  rig = rig_of(data);
  return 0;
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_right_image_with_an_offset),
      cmocka_unit_test(test_boulders_lie_on_rocks),
      cmocka_unit_test(test_own_hardware),
      cmocka_unit_test(test_votes_name_the_same_boulder),
      cmocka_unit_test(test_points_of_the_surface),
      cmocka_unit_test(test_a_sighting_against_its_points),
      cmocka_unit_test(test_what_is_forgotten),
      cmocka_unit_test(test_an_abandoned_frame_is_passed_over),
      cmocka_unit_test(test_statuses),
      cmocka_unit_test(test_slices_give_the_same),
  };
  return cmocka_run_group_tests_name("integration/boulder_observer", tests, open_sample, nullptr);
}
