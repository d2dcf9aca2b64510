// Boulders of single frames of the sample, with the true poses: what is seen, where it lies, what goes on.
#include "localizer/boulder_observer.hpp"

#include <cstring>

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
};

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
  }
  t.short_m /= t.on_rocks;
  print_message("%d sightings, %d on rocks, %.3f m short of them; %d of %d go on\n", t.sightings, t.on_rocks,
                t.short_m, t.matched, t.could_match);
  return t;
}

void test_boulders_lie_on_rocks(void**) {
  const Tally t = tally({});
  assert_at_least(t.sightings, kSanitized ? 15 : 100);
  assert_at_least(t.on_rocks, 0.85 * t.sightings);
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
      cmocka_unit_test(test_boulders_lie_on_rocks),
      cmocka_unit_test(test_votes_name_the_same_boulder),
      cmocka_unit_test(test_an_abandoned_frame_is_passed_over),
      cmocka_unit_test(test_statuses),
      cmocka_unit_test(test_slices_give_the_same),
  };
  return cmocka_run_group_tests_name("integration/boulder_observer", tests, open_sample, nullptr);
}
