// What a fix does to a drive, and what a drive leaves for a fix, as properties of the whole localizer on the
// sample: nothing outlives a new start, a turned start turns all, a late fix lands where it was taken.
#include "localizer/localizer.hpp"

#include <algorithm>
#include <cmath>

#include "integration/replay.hpp"
#include "support/noise.hpp"

using namespace cairn;
using namespace cairn::test;

namespace {

Localizer localizer;
MapFix alone;
ground::Dataset data;
FlightMap true_map;
FlightMap mirrored;

LocalizerParams eager() {
  LocalizerParams params;
  params.tracks.min_sightings = 1;
  return params;
}

void init(const LocalizerParams& params) {
  assert_status(localizer.init(params, rig_of(data)), LocalizerStatus::kReady);
  assert_status(localizer.set_trim({}), LocalizerStatus::kReady);
  localizer.set_map(true_map.map);
}

/// A start at a frame's true place, turned about itself and moved.
void start(std::size_t index, double sigma_m, double sigma_rad, double turn_rad = 0.0,
           const Vec2& off_m = Vec2(0.0, 0.0)) {
  Pose3 pose = *data.truth_rover(index);
  pose.t += Vec3(off_m.x(), off_m.y(), 0.0);
  pose.q = (lift({0.0, 0.0, turn_rad}).q * pose.q).normalized();
  assert_status(localizer.set_start(pose, sigma_m, sigma_rad), LocalizerStatus::kReady);
}

void run(std::size_t first, std::size_t end) {
  static Pair pair;
  for (std::size_t i = first; i < end; ++i) {
    load(data.frames()[i], pair);
    frame(localizer, pair);
  }
}

void take_fix() { static_cast<void>(fix(localizer)); }

Vec2 place() { return planar(localizer.T_map_rover()).translation(); }
double heading() { return planar(localizer.T_map_rover()).yaw_rad; }
double error_m(std::size_t index) {
  return (place() - planar(*data.truth_rover(index)).translation()).norm();
}
double yaw_error(std::size_t index) {
  return wrap_angle(heading() - planar(*data.truth_rover(index)).yaw_rad);
}

// ---- starts

struct Outcome {
  Pose3 pose, vo;
  double sigma_xy_m, sigma_yaw_rad, scale;
  FixRecord fix;
  Trust trust;
  std::size_t boulders;
  PoseSource source;
};

/// From a start in the middle of the drive on.
Outcome from_a_start() {
  start(12, 0.03, 0.01, 0.005, Vec2(0.02, -0.01));
  Outcome out;
  assert_status(localizer.last_fix().status, FixStatus::kNone);
  run(12, 16);
  take_fix();
  run(16, 18);
  take_fix();
  out.pose = localizer.T_map_rover();
  out.vo = localizer.vo_T_map_cam();
  out.sigma_xy_m = localizer.fusion().sigma_xy_m();
  out.sigma_yaw_rad = localizer.fusion().sigma_yaw_rad();
  out.scale = localizer.fusion().scale();
  out.fix = localizer.last_fix();
  out.trust = localizer.trust();
  out.boulders = localizer.local_map().size();
  out.source = localizer.pose_source();
  return out;
}

/// After a new start the drive before it might never have been: fixes, an open one, a hypothesis that is
/// carried along, doubts, pictures that froze.
void test_nothing_outlives_a_new_start(void**) {
  LocalizerParams params = eager();
  params.add_windows = true;
  init(params);
  const Outcome fresh = from_a_start();
  assert_status(fresh.trust, Trust::kConfirmed);
  for (int kind = 0; kind < 4; ++kind) {
    init(params);
    if (kind == 1) localizer.set_map(mirrored.map);
    start(0, 0.02, 0.004);
    run(0, 5);
    take_fix();
    if (kind == 1) localizer.set_map(true_map.map);
    if (kind == 2) {
      Pair pair;
      load(data.frames()[60], pair);
      Pose3 prior;
      prior.t.z() = -3.0;
      frame(localizer, pair, &prior);  // guessed, and far off
      assert_true(localizer.trust() != Trust::kConfirmed);
      localizer.miss(3, nullptr);
    }
    if (kind == 3) {
      run(5, 7);
      localizer.begin_fix();
      WorkBudget tiny(1);
      assert_status(localizer.step_fix(tiny), Progress::kMore);
    }
    const Outcome again = from_a_start();
    assert_memory_equal(&again.pose, &fresh.pose, sizeof fresh.pose);
    assert_memory_equal(&again.vo, &fresh.vo, sizeof fresh.vo);
    assert_true(again.sigma_xy_m == fresh.sigma_xy_m);
    assert_true(again.sigma_yaw_rad == fresh.sigma_yaw_rad);
    assert_true(again.scale == fresh.scale);
    assert_status(again.trust, fresh.trust);
    assert_status(again.fix.status, fresh.fix.status);
    assert_true(again.fix.log_ratio == fresh.fix.log_ratio);
    assert_true(again.fix.chi2 == fresh.fix.chi2);
    assert_int_equal(again.fix.windows, fresh.fix.windows);
    assert_int_equal(again.boulders, fresh.boulders);
    assert_status(again.source, fresh.source);
  }
}

/// A start that is turned turns the way and its covariance, and nothing else.
void test_a_turned_start_turns_all(void**) {
  LocalizerParams params;
  params.fusion.noise_xy_m = 0.0;  // what is left is VO's own, and the lever of the heading
  Mat3 straight = Mat3::Zero();
  Vec2 way(0.0, 0.0);
  for (const double turn : {0.0, 1.0, 2.5}) {
    init(params);
    start(0, 1.0e-4, 0.2, turn);
    const Vec2 from = place();
    run(0, 8);
    const Mat3 c = localizer.fusion().covariance();
    if (turn == 0.0) {
      straight = c;
      way = place() - from;
      const Vec2 along = way.normalized();
      const Vec2 across(-along.y(), along.x());
      const Mat2 xy = c.topLeftCorner<2, 2>();
      assert_near(std::sqrt(across.dot(Vec2(xy * across))), 0.2 * way.norm(), 0.05 * way.norm());
      assert_at_most(std::sqrt(along.dot(Vec2(xy * along))), 0.05 * way.norm());
      continue;
    }
    const Mat3 R = lift({0.0, 0.0, turn}).q.toRotationMatrix();
    const Mat3 turned = R * straight * R.transpose();
    for (int i = 0; i < 9; ++i) assert_near(c(i / 3, i % 3), turned(i / 3, i % 3), 1e-6 * straight.norm());
    assert_at_most((place() - from - Vec2((R * Vec3(way.x(), way.y(), 0.0)).head<2>())).norm(), 1e-6);
  }
}

/// One step alone, whose covariance is VO's: it turns with the rover.
void test_vo_errors_are_in_the_maps_axes(void**) {
  LocalizerParams params;
  params.fusion.noise_xy_m = params.fusion.noise_yaw_rad = params.fusion.noise_turn = 0.0;
  params.fusion.sigma_scale = params.fusion.sigma_turn_rad_per_m = 1.0e-9;
  Mat3 straight = Mat3::Zero();
  for (const double turn : {0.0, 0.5 * kPi}) {
    init(params);
    start(0, 1.0e-7, 1.0e-7, turn);
    run(0, 2);
    const Mat3 c = localizer.fusion().covariance();
    if (turn == 0.0) {
      straight = c;
      assert_true(std::fabs(straight(0, 0) - straight(1, 1)) >
                  0.1 * straight(0, 0));  // there is a difference
      continue;
    }
    assert_near(c(0, 0) / straight(1, 1), 1.0, 1e-3);
    assert_near(c(1, 1) / straight(0, 0), 1.0, 1e-3);
  }
}

/// What is turned on the way grows the heading's sigma, either way round.
void test_turns_cost_heading(void**) {
  LocalizerParams params;
  params.fusion.noise_turn = 1.0;
  params.fusion.noise_yaw_rad = 0.0;
  params.fusion.sigma_turn_rad_per_m = 1.0e-9;
  init(params);
  start(0, 0.02, 1.0e-4);
  run(0, 1);
  double turned = 0.0;
  for (std::size_t i = 1; i < 12; ++i) {
    const double before = heading();
    run(i, i + 1);
    turned += std::fabs(wrap_angle(heading() - before));
  }
  const double sigma = localizer.fusion().sigma_yaw_rad();
  assert_at_least(turned, 1e-4);
  assert_near(sigma * sigma / turned, 1.0, 0.2);
}

// ---- fixes

/// The heading is wrong from the start; a fix whose result comes twenty frames late puts right what it saw
/// then, and so the present.
void test_a_late_fix_lands_at_its_snapshot(void**) {
  init(eager());
  start(0, 0.02, 0.06, 0.08);
  run(0, 20);
  localizer.begin_fix();
  WorkBudget all = WorkBudget::unlimited();
  assert_status(localizer.step_fix(all), Progress::kDone);
  run(20, 45);
  assert_at_least(error_m(44), 0.08);
  const Pose2 before = planar(localizer.T_map_rover());
  localizer.apply_fix();
  const FixRecord& f = localizer.last_fix();
  assert_status(f.status, FixStatus::kApplied);
  assert_int_equal(f.frame, 20);
  assert_at_most(error_m(44), 0.04);
  assert_at_most(std::fabs(yaw_error(44)), 0.01);
  assert_near(f.correction.x_m, place().x() - before.x_m, 1e-12);
  assert_near(f.correction.y_m, place().y() - before.y_m, 1e-12);
}

/// A fix that tells of a VO which measures too long, in time and 25 frames late: the way driven since is put
/// right as well, and the pose comes out the same.
void test_late_or_in_time_is_the_same(void**) {
  Vec2 in_time(0.0, 0.0);
  double sigma_m = 0.0;
  for (const bool late : {false, true}) {
    init(eager());
    assert_status(localizer.set_trim({1.06, 0.0}), LocalizerStatus::kReady);
    start(0, 0.01, 0.004);
    run(0, 10);
    assert_status(fix(localizer), FixStatus::kApplied);
    run(10, 30);
    localizer.begin_fix();
    WorkBudget all = WorkBudget::unlimited();
    assert_status(localizer.step_fix(all), Progress::kDone);
    if (!late) localizer.apply_fix();
    const Vec2 then = place();
    run(30, 55);
    if (late) localizer.apply_fix();
    assert_status(localizer.last_fix().status, FixStatus::kApplied);
    const double way_m = (place() - then).norm();
    assert_at_least(-localizer.fusion().scale() * way_m, 0.008);  // what would be missed
    if (late) {
      assert_at_most((place() - in_time).norm(), 0.003);
      assert_near(localizer.fusion().sigma_xy_m(), sigma_m, 0.05 * sigma_m);
    }
    in_time = place();
    sigma_m = localizer.fusion().sigma_xy_m();
  }
}

/// The localizer asks for the fix of its own pose, covariance, pivot and odds: its record says what MapFix
/// says of them.
void test_the_fix_is_that_of_the_pose(void**) {
  const LocalizerParams params = eager();
  init(params);
  start(0, 0.1, 0.03, 0.02, Vec2(0.06, 0.05));
  run(0, 10);
  for (const bool confirmed : {false, true}) {
    const Pose2 T_map_site = localizer.T_map_site();
    const Vec2 pivot = T_map_site.inverse() * place();
    const Mat3 prior = localizer.fusion().covariance();
    assert_status(fix(localizer), FixStatus::kApplied);
    MapFixParams of_pose = params.map_fix;
    of_pose.search.verdict.prior_log_odds = confirmed ? params.track_log_odds : 0.0;
    assert_status(alone.start_tracked(of_pose, true_map.map, localizer.local_map(), T_map_site, pivot, prior),
                  MapFixStatus::kRunning);
    WorkBudget all = WorkBudget::unlimited();
    assert_status(alone.step(all), Progress::kDone);
    const FixRecord& f = localizer.last_fix();
    const MapFixResult& r = alone.result();
    assert_near(f.log_ratio, r.verdict.log_ratio, 1e-6);
    assert_near(f.second_log_ratio, r.verdict.second_log_ratio, 1e-6);
    assert_int_equal(f.hypotheses, r.hypotheses);
    assert_int_equal(f.map_boulders, r.map_boulders);
    assert_int_equal(f.pairs + f.gated, r.sightings);
    run(confirmed ? 13 : 10, confirmed ? 16 : 13);
  }
}

/// What a start claims is nothing that a fix has to agree with: from starts 0.4 m and a degree apart, claimed
/// good to 2 cm or to 20, the first fix leads to one pose and one sigma. Now and then a pair more or less is
/// found, which is worth a part of a sigma; of three places, the middle one tells.
void test_a_claim_neither_pulls_nor_sharpens(void**) {
  constexpr int kPlaces[] = {18, 22, 27};
  double off_sigmas[4][3];
  for (int p = 0; p < 3; ++p) {
    Vec2 first(0.0, 0.0);
    double sigma = 0.0;
    for (int n = 0; n < 4; ++n) {
      init(eager());
      const double off = n % 2 == 0 ? 0.2 : -0.2;
      start(0, n < 2 ? 0.02 : 0.2, n < 2 ? 0.004 : 0.03, 0.04 * off, Vec2(0.0, off));
      run(0, kPlaces[p]);
      assert_status(localizer.trust(), Trust::kClaimed);
      assert_status(fix(localizer), FixStatus::kApplied);
      assert_status(localizer.trust(), Trust::kConfirmed);
      if (n == 0) {
        first = place();
        sigma = localizer.fusion().sigma_xy_m();
      }
      off_sigmas[n][p] = (place() - first).norm() / sigma;
      assert_at_most(off_sigmas[n][p], 1.0);
      assert_near(localizer.fusion().sigma_xy_m() / sigma, 1.0, 0.1);
    }
  }
  for (auto& off : off_sigmas) {
    std::sort(off, off + 3);
    assert_at_most(off[1], 0.3);
  }
}

/// A second fix of the same boulders says hardly anything new.
void test_the_same_boulders_are_not_believed_twice(void**) {
  init(eager());
  start(0, 0.1, 0.03);
  run(0, 10);
  assert_status(fix(localizer), FixStatus::kApplied);
  const double once_xy = localizer.fusion().sigma_xy_m();
  const double once_yaw = localizer.fusion().sigma_yaw_rad();
  for (int n = 0; n < 3; ++n) assert_status(fix(localizer), FixStatus::kApplied);
  assert_at_least(localizer.fusion().sigma_xy_m(), 0.93 * once_xy);
  assert_at_least(localizer.fusion().sigma_yaw_rad(), 0.93 * once_yaw);
}

/// Odds are a confirmed track's: what only they make up for is declined of a start, and taken after a fix.
void test_odds_are_those_of_a_confirmed_track(void**) {
  LocalizerParams params = eager();
  init(params);
  start(0, 0.1, 0.03);
  run(0, 6);
  assert_status(fix(localizer), FixStatus::kApplied);
  VerdictParams& verdict = params.map_fix.search.verdict;
  verdict.ln_threshold = localizer.last_fix().log_ratio + verdict.calibration + 0.5 * params.track_log_odds;
  params.map_fix.search.scale_sigma = 0.0;
  init(params);
  start(0, 0.1, 0.03);
  run(0, 6);
  assert_status(fix(localizer), FixStatus::kTooLittleEvidence);
  run(6, 7);
  params.map_fix.search.verdict.ln_threshold -= params.track_log_odds;
  init(params);
  start(0, 0.1, 0.03);
  run(0, 6);
  assert_status(fix(localizer), FixStatus::kApplied);
}

/// A VO that measures too long: fixes tell, and from then on the steps are as long as they were.
void test_rates_act_on_the_pose(void**) {
  init(eager());
  assert_status(localizer.set_trim({1.03, 0.0}), LocalizerStatus::kReady);
  start(0, 0.02, 0.004);
  run(0, 30);
  take_fix();
  run(30, 60);
  take_fix();
  const double scale = localizer.fusion().scale();
  assert_at_most(scale, -0.005);
  const Vec2 from = place();
  const Vec3 vo_from = (localizer.vo_T_map_cam() * rig_of(data).T_rover_cam.inverse()).t;
  run(60, 75);
  const Vec3 vo_way = (localizer.vo_T_map_cam() * rig_of(data).T_rover_cam.inverse()).t - vo_from;
  const double ratio = (place() - from).norm() / std::hypot(vo_way.x(), vo_way.y());
  assert_near(ratio, 1.0 + scale, 0.003);
}

/// A map that comes while a fix runs: the fix is given up, counted and moves nothing.
void test_a_new_map_ends_an_open_fix(void**) {
  init(eager());
  start(0, 0.1, 0.03, 0.0, Vec2(0.05, 0.0));
  run(0, 6);
  localizer.begin_fix();
  WorkBudget all = WorkBudget::unlimited();
  assert_status(localizer.step_fix(all), Progress::kDone);
  const Pose3 before = localizer.T_map_rover();
  localizer.set_map(true_map.map);
  assert_status(localizer.last_fix().status, FixStatus::kLate);
  localizer.apply_fix();
  assert_near((localizer.T_map_rover().t - before.t).norm(), 0.0, 0.0);
  assert_int_equal(localizer.health().fixes[static_cast<int>(FixStatus::kLate)], 1);
  assert_status(fix(localizer), FixStatus::kApplied);
}

/// Boulders from before a step that may be far off are in no local map with those from after it.
void test_a_doubted_step_tears_the_local_map(void**) {
  LocalizerParams params;
  params.tracks.min_sightings = 2;
  for (const bool doubted : {false, true}) {
    init(params);
    start(0, 0.02, 0.004);
    run(0, 6);
    Pair pair;
    load(data.frames()[6], pair);
    Pose3 prior = data.truth_cam(5)->inverse() * *data.truth_cam(6);
    if (doubted) prior.t *= -3.0;
    frame(localizer, pair, &prior);
    assert_status(localizer.watch(), doubted ? WatchStatus::kContradicted : WatchStatus::kClear);
    localizer.begin_fix();
    assert_int_equal(localizer.local_map().empty(), doubted);  // none of them was seen twice since
    localizer.apply_fix();
  }
}

/// A slip that nothing tells of: what is in view lies aside of what the boulders before agree with. The
/// fix is not used, the pose stands, unconfirmed and as uncertain as after frames without VO, height and tilt
/// with it, and the next local map is of what is in view alone.
void test_a_slip_is_seen_in_what_is_in_view(void**) {
  static LocalMap before;
  static LocalMap after;
  static BoulderSightings in_view;
  for (const bool slipped : {false, true}) {
    init(eager());
    start(0, 0.02, 0.004);
    run(0, 20);
    localizer.tracks().build(before);
    frame(localizer, Pair());
    in_view.clear();
    for (const LocalBoulder& b : before) {
      BoulderSighting s;
      s.p_site_m =
          Vec3(b.p_site_m.x() + (slipped ? 0.61 : 0.0), b.p_site_m.y() + (slipped ? 0.37 : 0.0), 0.0);
      s.diameter_m = b.diameter_m;
      s.range_m = 2.0F;
      if (!in_view.push_back(s)) break;
    }
    localizer.tracks().start(in_view, localizer.frame());
    WorkBudget all = WorkBudget::unlimited();
    assert_status(localizer.tracks().step(all), Progress::kDone);
    const Pose3 pose = localizer.T_map_rover();
    assert_status(fix(localizer), slipped ? FixStatus::kInconsistent : FixStatus::kApplied);
    localizer.tracks().build(after);
    if (!slipped) {
      assert_at_most(localizer.fusion().sigma_xy_m(), 0.2);
      assert_at_most(localizer.tilt().sigma_tilt_rad(), 0.1);
      continue;
    }
    assert_near((localizer.T_map_rover().t - pose.t).norm(), 0.0, 0.0);
    assert_status(localizer.trust(), Trust::kUnconfirmed);
    assert_at_least(localizer.fusion().sigma_xy_m(), 1.0);
    assert_at_least(localizer.tilt().sigma_z_m(), 1.0);
    assert_at_least(localizer.tilt().sigma_tilt_rad(), 0.5);
    assert_true(!after.empty() && after.size() <= in_view.size());
    for (const LocalBoulder& b : after) assert_true(b.in_view);
  }
}

/// A slip shows at its frame, where boulders that were in view are aside of where they were and VO has few
/// inliers: the pose is doubted by as much as the steps hold that VO made one of, and boulders from before
/// are in no local map.
void test_a_slip_is_seen_at_once(void**) {
  static LocalMap before;
  static BoulderSightings aside;
  struct Case {
    bool slips;
    std::uint32_t missed;
  };
  for (const auto& [slips, missed] : {Case{false, 0}, Case{true, 0}, Case{true, 2}}) {
    init(eager());
    start(0, 0.02, 0.004);
    run(0, 20);
    assert_status(fix(localizer), FixStatus::kApplied);
    localizer.tracks().build(before);
    aside.clear();
    for (const LocalBoulder& b : before) {
      BoulderSighting s;
      s.p_site_m = Vec3(b.p_site_m.x() + (slips ? 0.61 : 0.0), b.p_site_m.y() + (slips ? 0.37 : 0.0), 0.0);
      s.diameter_m = b.diameter_m;
      s.range_m = 2.0F;
      if (!aside.push_back(s)) break;
    }
    localizer.tracks().forget_all();
    localizer.tracks().start(aside, localizer.frame());
    WorkBudget all = WorkBudget::unlimited();
    assert_status(localizer.tracks().step(all), Progress::kDone);
    aside.clear();  // so that no vote names them, as none does after a slip
    localizer.tracks().start(aside, localizer.frame());
    assert_status(localizer.tracks().step(all), Progress::kDone);
    localizer.miss(missed, nullptr);
    const std::size_t next = slips ? 27 : 20;  // what slips sees less of what it saw
    run(next, next + 1);
    assert_status(localizer.trust(), slips ? Trust::kUnconfirmed : Trust::kConfirmed);
    assert_status(localizer.pose_source(), slips ? PoseSource::kDoubted : PoseSource::kVo);
    assert_status(localizer.watch(), slips ? WatchStatus::kJumped : WatchStatus::kClear);
    assert_int_equal(localizer.health().watch[static_cast<int>(WatchStatus::kJumped)], slips ? 1 : 0);
    std::uint32_t watched = 0;
    for (const std::uint32_t n : localizer.health().watch) watched += n;
    assert_int_equal(watched, localizer.health().frames);
    localizer.tracks().build(before);
    if (slips) {
      assert_at_least(localizer.fusion().sigma_xy_m(), 0.3 * (missed + 1));
      assert_at_least(localizer.tilt().sigma_z_m(), 0.3 * (missed + 1));
      for (const LocalBoulder& b : before) assert_true(b.in_view);
    } else {
      assert_at_most(localizer.fusion().sigma_xy_m(), 0.1);
    }
    run(21 + missed, 46);
    assert_status(localizer.pose_source(), PoseSource::kVo);
    take_fix();
    if (missed == 0) assert_status(localizer.last_fix().status, FixStatus::kApplied);
    assert_status(localizer.trust(), localizer.last_fix().status == FixStatus::kApplied
                                         ? Trust::kConfirmed
                                         : Trust::kUnconfirmed);
    if (localizer.trust() == Trust::kConfirmed) assert_at_most(error_m(45), 0.1);
  }
}

// ---- claims

/// What the rover sees now is this, and nothing of before.
void see(const std::vector<Vec2>& places_site_m) {
  static BoulderSightings seen;
  seen.clear();
  for (const Vec2& p : places_site_m) {
    BoulderSighting s;
    s.p_site_m = Vec3(p.x(), p.y(), 0.0);
    s.diameter_m = 0.2F;
    s.range_m = 2.0F;
    assert_true(seen.push_back(s));
  }
  localizer.tracks().forget_all();
  localizer.tracks().start(seen, localizer.frame());
  WorkBudget all = WorkBudget::unlimited();
  assert_status(localizer.tracks().step(all), Progress::kDone);
}

/// Ground of 28 m about a place, boulders anywhere.
std::vector<ground::TableBoulder> anywhere(Random& random, const Vec2& about_m, double per_m2) {
  std::vector<ground::TableBoulder> out(static_cast<std::size_t>(per_m2 * 28.0 * 28.0));
  for (ground::TableBoulder& b : out) {
    b.p_map_m = about_m + Vec2(uniform(random, -14.0, 14.0), uniform(random, -14.0, 14.0));
    b.diameter_m = 0.2;
  }
  return out;
}

/// Of `count` within 4 m of a place, some of the map's, 0.03 m off, and others.
std::vector<Vec2> seen_about(Random& random, const std::vector<ground::TableBoulder>& map,
                             const Vec2& about_m, std::size_t of_map, std::size_t others) {
  std::vector<Vec2> out;
  for (const ground::TableBoulder& b : map) {
    if (out.size() == of_map) break;
    if ((b.p_map_m - about_m).norm() < 4.0)
      out.push_back(b.p_map_m + 0.03 * Vec2(normal(random), normal(random)));
  }
  for (std::size_t i = 0; i < others; ++i)
    out.push_back(about_m + Vec2(uniform(random, -4.0, 4.0), uniform(random, -4.0, 4.0)));
  return out;
}

/// A claim that is false does not last: on ground so dense that some boulders agree anywhere by chance, too,
/// it is no longer one after kFixes fixes, each of other boulders, and none of these is accepted. One that is
/// true is never taken for false.
void test_a_false_claim_is_refuted_on_dense_ground(void**) {
  constexpr int kFixes = 6;
  const int trials = kSanitized ? 1 : 6;
  for (int seed = 0; seed < trials; ++seed) {
    Random random(static_cast<std::uint64_t>(seed) + 1);
    const Vec2 start_m = planar(*data.truth_rover(0)).translation();
    const std::vector<ground::TableBoulder> rocks = anywhere(random, start_m, 4.0);
    FlightMap dense;
    assert_status(dense.make(rocks), MapStatus::kUsable);
    for (const bool honest : {false, true}) {
      init(eager());
      localizer.set_map(dense.map);
      start(0, 0.05, 0.01);
      run(0, 1);
      const Pose2 T_site_map = localizer.T_map_site().inverse();
      int fixes = 0;
      for (; fixes < kFixes && localizer.trust() == Trust::kClaimed; ++fixes) {
        std::vector<Vec2> seen = seen_about(random, rocks, place(), honest ? 8 : 0, honest ? 12 : 20);
        for (Vec2& p : seen) p = T_site_map * p;
        see(seen);
        take_fix();
      }
      const bool applied = localizer.last_fix().status == FixStatus::kApplied;
      if (honest) {
        assert_true(applied || localizer.trust() == Trust::kClaimed);
      } else {
        assert_true(!applied && localizer.trust() != Trust::kClaimed);
      }
    }
  }
}

/// And whatever the map's pixels: those so coarse that they hold few of the boulders seen are no excuse for a
/// claim that nothing supports.
void test_a_false_claim_is_refuted_on_coarse_maps(void**) {
  constexpr int kFixes = 6;
  Random random(7);
  const Vec2 start_m = planar(*data.truth_rover(0)).translation();
  const std::vector<ground::TableBoulder> rocks = anywhere(random, start_m, 1.0);
  for (const double pixel_m : {0.05, 0.1}) {  // boulders of 0.2 m: four pixels, two
    ground::CmapSource source;
    source.pixel_m = pixel_m;
    FlightMap map;
    map.bytes = ground::encode_cmap(rocks, ground::extent_of(rocks), 0.001, source);
    assert_status(map.validate(), MapStatus::kUsable);
    init(eager());
    localizer.set_map(map.map);
    start(0, 0.05, 0.01);
    run(0, 1);
    const Pose2 T_site_map = localizer.T_map_site().inverse();
    for (int k = 0; k < kFixes; ++k) {
      std::vector<Vec2> seen = seen_about(random, rocks, place(), 0, 20);
      for (Vec2& p : seen) p = T_site_map * p;
      see(seen);
      take_fix();
      assert_true(localizer.last_fix().status != FixStatus::kApplied);
    }
    assert_true(localizer.trust() != Trust::kClaimed);
  }
}

/// The rover may be anywhere on the ground of its map, at any heading, and sigma says so.
void assert_may_be_anywhere() {
  const PoseFusion& fusion = localizer.fusion();
  const Vec2 extent = localizer.map().extent_m();
  assert_at_least(3.0 * fusion.sigma_xy_m(), extent.norm());
  assert_at_least(3.0 * fusion.sigma_yaw_rad(), kPi);
  assert_at_least(localizer.last_fix().sigma_xy_m, extent.norm() / 3.0);
  assert_near(fusion.sigma_xy_m(), Localizer::kUnknownStart_m, 1.0);  // as one that is lost by command
}

/// From the fix on that refutes a pose, claimed or proven, no error is beyond three of the sigmas reported,
/// wherever the rover is; until a fix finds it, which is then weighed as if nothing had been known.
void test_what_is_refuted_may_be_anywhere(void**) {
  const int trials = kSanitized ? 1 : 4;
  for (int seed = 0; seed < trials; ++seed) {
    Random random(static_cast<std::uint64_t>(seed) + 501);
    const Vec2 truth_m = planar(*data.truth_rover(0)).translation();
    const std::vector<ground::TableBoulder> rocks = anywhere(random, truth_m, 1.0);
    FlightMap map;
    assert_status(map.make(rocks), MapStatus::kUsable);
    for (const bool proven : {false, true}) {
      init(eager());
      localizer.set_map(map.map);
      start(0, 0.05, 0.01);
      run(0, 1);
      const auto look = [&](std::size_t of_map, std::size_t others) {
        std::vector<Vec2> seen = seen_about(random, rocks, place(), of_map, others);
        const Pose2 T_site_map = localizer.T_map_site().inverse();
        for (Vec2& p : seen) p = T_site_map * p;
        see(seen);
        take_fix();
      };
      if (proven) look(24, 6);
      const Trust before = localizer.trust();
      assert_status(before, proven ? Trust::kConfirmed : Trust::kClaimed);
      for (int fixes = 0; fixes < 6 && localizer.trust() == before; ++fixes) {
        assert_at_most(localizer.fusion().sigma_xy_m(), 0.1);
        look(0, 20);
      }
      assert_status(localizer.trust(), Trust::kLost);
      assert_may_be_anywhere();
      run(1, 4);
      assert_may_be_anywhere();
      look(0, 20);
      assert_status(localizer.trust(), Trust::kLost);
      assert_may_be_anywhere();
      look(24, 6);
      assert_status(localizer.trust(), Trust::kConfirmed);
      assert_at_most(error_m(3), 0.1);
      assert_at_most(error_m(3), 3.0 * localizer.fusion().sigma_xy_m());
      assert_at_most(localizer.fusion().sigma_xy_m(), 0.1);
    }
  }
}

/// A claim speaks for itself alone: what lies beyond it and agrees there, short of a proof, does not keep it.
void test_what_agrees_beyond_a_claim_does_not_keep_it(void**) {
  LocalizerParams params = eager();
  params.map_fix.search.scale_sigma = 0.0;
  params.map_fix.search.verdict.ln_threshold = 100.0;  // no proof in all of this
  for (int seed = 0; seed < (kSanitized ? 1 : 4); ++seed) {
    Random random(static_cast<std::uint64_t>(seed) + 801);
    const Vec2 truth_m = planar(*data.truth_rover(0)).translation();
    const std::vector<ground::TableBoulder> rocks = anywhere(random, truth_m, 1.0);
    FlightMap map;
    assert_status(map.make(rocks), MapStatus::kUsable);
    for (const bool honest : {false, true}) {
      init(params);
      localizer.set_map(map.map);
      start(0, 0.05, 0.01, 0.0, honest ? Vec2(0.0, 0.0) : Vec2(0.55, -0.45));
      run(0, 1);
      const Pose2 T_site_truth = localizer.T_map_site().inverse() * planar(localizer.T_map_rover()) *
                                 planar(*data.truth_rover(0)).inverse();
      for (int fixes = 0; fixes < 12 && localizer.trust() == Trust::kClaimed; ++fixes) {
        std::vector<Vec2> seen = seen_about(random, rocks, truth_m, 16, 4);
        for (Vec2& p : seen) p = T_site_truth * p;
        see(seen);
        take_fix();
        assert_true(localizer.last_fix().status != FixStatus::kApplied);
      }
      assert_int_equal(localizer.trust() == Trust::kClaimed, honest);
    }
  }
}

/// The fix that refutes a claim finds the rover, with the boulders that refuted it; be the claim a few metres
/// off, or beyond the map's ground.
void test_what_refutes_a_claim_finds_the_rover(void**) {
  const int trials = kSanitized ? 1 : 4;
  for (int trial = 0; trial < 2 * trials; ++trial) {
    Random random(static_cast<std::uint64_t>(trial / 2) + 101);
    const double off_m = trial % 2 == 0 ? 5.0 : 60.0;
    const Vec2 truth_m = planar(*data.truth_rover(0)).translation();
    const std::vector<ground::TableBoulder> rocks = anywhere(random, truth_m, 1.0);
    FlightMap map;
    assert_status(map.make(rocks), MapStatus::kUsable);
    init(eager());
    localizer.set_map(map.map);
    start(0, 0.05, 0.01, kPi, Vec2(off_m, -3.0));
    run(0, 1);
    int fixes = 0;
    for (; fixes < 6 && localizer.trust() == Trust::kClaimed; ++fixes) {
      std::vector<Vec2> seen = seen_about(random, rocks, truth_m, 24, 6);
      const Pose2 T_site_truth = localizer.T_map_site().inverse() * planar(localizer.T_map_rover()) *
                                 planar(*data.truth_rover(0)).inverse();
      for (Vec2& p : seen) p = T_site_truth * p;
      see(seen);
      take_fix();
    }
    assert_status(localizer.trust(), Trust::kConfirmed);
    assert_status(localizer.last_fix().status, FixStatus::kApplied);
    assert_true(localizer.last_fix().lost);
    assert_at_most(error_m(0), 0.1);
    assert_at_most(std::fabs(yaw_error(0)), 0.03);
  }
}

int open_sample(void**) {
  data = ground::Dataset::open(kSample);
  std::vector<ground::TableBoulder> rocks = true_rocks(kSample);
  if (true_map.make(rocks) != MapStatus::kUsable) return 1;
  for (ground::TableBoulder& b : rocks) b.p_map_m.y() = 2.0 * data.truth_rover(0)->t.y() - b.p_map_m.y();
  return mirrored.make(rocks) == MapStatus::kUsable ? 0 : 1;
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_nothing_outlives_a_new_start),
      cmocka_unit_test(test_a_turned_start_turns_all),
      cmocka_unit_test(test_vo_errors_are_in_the_maps_axes),
      cmocka_unit_test(test_turns_cost_heading),
      cmocka_unit_test(test_a_late_fix_lands_at_its_snapshot),
      cmocka_unit_test(test_late_or_in_time_is_the_same),
      cmocka_unit_test(test_the_fix_is_that_of_the_pose),
      cmocka_unit_test(test_a_claim_neither_pulls_nor_sharpens),
      cmocka_unit_test(test_the_same_boulders_are_not_believed_twice),
      cmocka_unit_test(test_odds_are_those_of_a_confirmed_track),
      cmocka_unit_test(test_rates_act_on_the_pose),
      cmocka_unit_test(test_a_new_map_ends_an_open_fix),
      cmocka_unit_test(test_a_doubted_step_tears_the_local_map),
      cmocka_unit_test(test_a_slip_is_seen_in_what_is_in_view),
      cmocka_unit_test(test_a_slip_is_seen_at_once),
      cmocka_unit_test(test_a_false_claim_is_refuted_on_dense_ground),
      cmocka_unit_test(test_a_false_claim_is_refuted_on_coarse_maps),
      cmocka_unit_test(test_what_is_refuted_may_be_anywhere),
      cmocka_unit_test(test_what_agrees_beyond_a_claim_does_not_keep_it),
      cmocka_unit_test(test_what_refutes_a_claim_finds_the_rover),
  };
  return cmocka_run_group_tests_name("integration/fix_in_drive", tests, open_sample, nullptr);
}
