// Forecasts: footprint, cases with known answers, covariances and probabilities against the flight module's
// own search, verdict and fusion, blind stretches.
#include "forecast/forecast.hpp"

#include <cmath>

#include "forecast/proof.hpp"
#include "localizer/landmarks.hpp"
#include "registration/pose_search.hpp"
#include "support/cmocka.hpp"
#include "support/noise.hpp"
#include "support/sanitized.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

PoseSearchJob job;
MapBoulders map_boulders;
LocalMap local_map;

std::vector<PathPoint> straight(double length_m) {
  return drive_over({Vec2(0.0, 0.0), Vec2(length_m, 0.0)}, 0.06, 2.0);
}

TableBoulder boulder(double x, double y, double diameter_m = 0.3, double confidence = 1.0) {
  TableBoulder b;
  b.p_map_m = Vec2(x, y);
  b.diameter_m = diameter_m;
  b.confidence = confidence;
  return b;
}

/// A field of boulders every `apart_m`, half of that off the way.
std::vector<TableBoulder> field(double from_x, double to_x, double apart_m) {
  std::vector<TableBoulder> all;
  for (double x = from_x; x < to_x; x += apart_m) {
    for (double y = -2.0 + 0.5 * apart_m; y < 2.0; y += apart_m) all.push_back(boulder(x, y));
  }
  return all;
}

/// All that is large is found and nothing else, and fixes are taken for what they are.
ForecastModel plain() {
  ForecastModel model = mission_model();
  model.detection = {1.0, 0.005, 20.0, 0.0};
  model.clutter_per_m2 = 0.0;
  model.sigma_common_m = 0.0;
  model.sigma_pair_m = model.evidence.sigma_pair_m;
  model.fusion.common_yaw_rad = 0.0;
  return model;
}

// ---- the ground that is swept -----------------------------------------------------------------------------

/// 0.7 m high, 39 degrees down, 52 degrees of view: level ground from 0.7 / tan(39 + 25.9) on, as far as
/// boulders are looked for. The left camera's mid-point sits over the rover's origin.
void test_what_is_in_view(void**) {
  const ForecastModel model = mission_model();
  const Sweep sweep(model.rig, model.max_range_m, model.tracks);
  const PathPoint at{10.0, 5.0, 0.5 * kPi, 0.0};
  const auto ahead = [&](double forward_m, double left_m) {
    return sweep.in_view(at, Vec2(10.0 - left_m, 5.0 + forward_m));
  };
  const double nearest_m = 0.7 / std::tan(39.0 * kRadPerDeg + std::atan(191.5 / 394.205430737));
  assert_false(ahead(nearest_m - 0.002, 0.0));
  assert_true(ahead(nearest_m + 0.002, 0.0));
  const double side_m = 0.06;  // the left camera stands so far left
  const double farthest_m = std::sqrt(9.0 - side_m * side_m);
  assert_true(ahead(farthest_m - 0.002, 0.0));
  assert_false(ahead(farthest_m + 0.002, 0.0));
  assert_false(ahead(-1.0, 0.0));
  // To the side: the half width at 1.5 m ahead is that of the right camera on the left and of the left one
  // on the right.
  const double depth_m = 1.5 * std::cos(39.0 * kRadPerDeg) + 0.7 * std::sin(39.0 * kRadPerDeg);
  const double half_m = depth_m * 255.5 / 394.205430737;
  assert_true(ahead(1.5, half_m - side_m - 0.005));
  assert_false(ahead(1.5, half_m - side_m + 0.005));
  assert_true(ahead(1.5, -half_m + side_m + 0.005));
  assert_false(ahead(1.5, -half_m + side_m - 0.005));
  // Whole: a tenth of a metre of it on each side, and its near rim.
  const auto whole = [&](double forward_m, double left_m) {
    return sweep.in_view(at, Vec2(10.0 - left_m, 5.0 + forward_m), 0.1);
  };
  assert_true(whole(1.5, 0.0));
  assert_true(whole(1.5, half_m - side_m - 0.12));
  assert_false(whole(1.5, half_m - side_m - 0.05));
  assert_false(whole(1.5, -half_m + side_m + 0.05));
  assert_false(whole(nearest_m + 0.09, 0.0));
  assert_true(whole(nearest_m + 0.11, 0.0));
}

void test_frames_of_the_window(void**) {
  const ForecastModel model = mission_model();
  const Sweep sweep(model.rig, model.max_range_m, model.tracks);
  const std::vector<PathPoint> drive = straight(20.0);
  // In view from 0.33 m to 3.0 m ahead: 44 or 45 steps of 0.06 m.
  const int whole = sweep.view_of(drive, 150, Vec2(drive[150].x_m, 0.0)).frames;
  assert_in_range(whole, 44, 45);
  assert_int_equal(sweep.view_of(drive, 150, Vec2(drive[150].x_m - 4.0, 0.0)).frames, 0);  // left the window
  assert_int_equal(sweep.first_of_window(drive, 150), 90);
  assert_int_equal(sweep.first_of_window(drive, 24), 0);
  // min_sightings: what comes into view two frames before the end is not in the footprint.
  const double edge_m = drive[150].x_m + std::sqrt(9.0 - 0.06 * 0.06);
  assert_true(sweep.in_footprint(drive, 150, Vec2(edge_m - 2.0 * 0.06 - 0.01, 0.0)));
  assert_false(sweep.in_footprint(drive, 150, Vec2(edge_m - 2.0 * 0.06 + 0.01, 0.0)));
  // The area by spots, and by the strip's width at the far end times its length, roughly.
  const double swept_m2 = 0.01 * static_cast<double>(sweep.spots(drive, 150, 0.1).size());
  assert_true(swept_m2 > 12.0 && swept_m2 < 22.0);
}

void test_fixes_follow_the_schedule(void**) {
  const std::vector<std::size_t> at = fix_frames(100);
  assert_int_equal(at.size(), 3);
  assert_int_equal(at[0], 24);
  assert_int_equal(at[2], 84);
  assert_int_equal(fix_frames(24).size(), 0);
  assert_int_equal(fix_frames(25).size(), 1);
}

// ---- known answers ----------------------------------------------------------------------------------------

void test_no_boulders_no_fix(void**) {
  const std::vector<PathPoint> drive = straight(12.0);
  const Forecast made = forecast(mission_model(), {}, drive);
  assert_int_equal(made.stations.size(), 6);
  for (const FixStation& s : made.stations) {
    assert_int_equal(s.boulders, 0);
    assert_near(s.applied, 0.0, 0.0);
    assert_near(s.right, 0.0, 0.0);
    assert_true(s.blind);
    assert_near(s.after.along_m, s.before.along_m, 1e-12);
  }
  assert_int_equal(made.blind.size(), 1);
  assert_near(made.blind[0].from_m, 0.0, 0.0);
  assert_near(made.blind[0].to_m, 12.0, 0.061);
  assert_near(made.blind[0].at_end.across_m, made.at_end.across_m, 0.0);
  assert_true(made.stations[5].before.across_m > made.stations[0].before.across_m);
}

void test_many_boulders_sure_fixes(void**) {
  ForecastModel model = mission_model();
  model.detection.spread = 0.0;  // of a drive like most
  const Forecast made = forecast(model, field(-4.0, 18.0, 0.4), straight(12.0));
  for (const FixStation& s : made.stations) {
    assert_at_least(s.applied, 0.99);
    assert_false(s.blind);
  }
  assert_int_equal(made.blind.size(), 0);
  assert_at_most(made.stations[5].after.along_m, 0.05);
}

void test_a_drive_without_a_fix_is_blind(void**) {
  const Forecast made = forecast(mission_model(), field(-4.0, 18.0, 0.4), straight(1.0));
  assert_int_equal(made.stations.size(), 0);
  assert_int_equal(made.blind.size(), 1);
  assert_near(made.blind[0].to_m, 1.0, 0.061);
}

/// Twelve boulders within a hand's breadth tell where the rover is, but hardly which way it looks.
void test_a_clump_is_weak(void**) {
  static std::vector<TableBoulder> clump;
  static std::vector<TableBoulder> spread;
  for (int i = 0; i < 12; ++i) {
    clump.push_back(boulder(2.5 + 0.1 * (i % 4), 0.1 * (i / 4)));
    spread.push_back(boulder(2.0 + 0.4 * (i % 4), 0.6 * (i / 4) - 0.6));
  }
  const FixStation weak = forecast(plain(), clump, straight(2.0)).stations.at(0);
  const FixStation strong = forecast(plain(), spread, straight(2.0)).stations.at(0);
  assert_int_equal(weak.boulders, 12);
  assert_int_equal(strong.boulders, 12);
  assert_at_most(weak.lever_m, 0.2);
  ForecastModel wide = plain();
  wide.sigma_start_yaw_rad = 1.0;
  wide.sigma_start_xy_m = 10.0;
  wide.verdict.ln_threshold = -1.0e3;  // whatever is found
  const FixStation loose = forecast(wide, clump, straight(2.0)).stations.at(0);
  const FixStation firm = forecast(wide, spread, straight(2.0)).stations.at(0);
  assert_at_least(loose.after.yaw_rad, 3.0 * firm.after.yaw_rad);
}

/// As many true boulders as the proof takes: fewer are declined, more are applied, surely found or not.
void test_too_few_boulders(void**) {
  ForecastModel model = plain();
  static std::vector<TableBoulder> all;
  all.clear();
  double before = 0.0;
  for (int n = 1; n <= 16; ++n) {
    all.push_back(boulder(1.6 + 0.37 * (n % 5), 0.31 * (n % 7) - 0.9));
    const FixStation s = forecast(model, all, straight(2.0)).stations.at(0);
    assert_int_equal(s.boulders, n);
    assert_near(s.found, n, 1e-6);
    if (n < 2) assert_near(s.applied, 0.0, 0.0);
    if (n < 2) continue;
    if (n < s.needed - 0.5) assert_at_most(s.applied, 0.9801);
    if (n > s.needed - 0.5) assert_at_least(s.applied, 0.9799);
    before = s.applied;
  }
  assert_at_least(before, 0.98);
  // Each found in one case of five: far too few.
  model.detection.most = 0.2;
  assert_at_most(forecast(model, all, straight(2.0)).stations.at(0).applied, 0.3);
  for (TableBoulder& b : all) b.confidence = 0.0;
  assert_near(forecast(model, all, straight(2.0)).stations.at(0).applied, 0.0, 0.0);
}

/// Who knows less of where the rover is needs more boulders; and so where there are more to be mistaken for.
void test_what_a_proof_takes(void**) {
  ForecastModel model = plain();
  const std::vector<TableBoulder> some = field(-4.0, 8.0, 1.0);
  const FixStation sure = forecast(model, some, straight(2.0)).stations.at(0);
  model.sigma_start_xy_m = 2.0;
  const FixStation unsure = forecast(model, some, straight(2.0)).stations.at(0);
  assert_true(unsure.needed > sure.needed + 1.0 && unsure.applied <= sure.applied);
  model = plain();
  model.clutter_per_m2 = 1.0;
  const FixStation cluttered = forecast(model, some, straight(2.0)).stations.at(0);
  assert_true(cluttered.needed > sure.needed + 0.5);
  const FixStation dense = forecast(plain(), field(-4.0, 8.0, 0.5), straight(2.0)).stations.at(0);
  assert_true(dense.per_m2 > 3.0 * sure.per_m2 && dense.needed > sure.needed + 1.0);
  // A track that a fix has confirmed needs fewer.
  const Forecast drive = forecast(plain(), field(-4.0, 18.0, 1.0), straight(10.0));
  assert_true(drive.stations.at(0).applied > 0.5 &&
              drive.stations.at(3).needed < drive.stations.at(0).needed);
}

/// The table that trials with a search gave: fewest true boulders for 98 % right at 1e-6, by boulders a
/// square metre, prior (sigma 0.1 m and 0.02 rad; within 1, 5, 20 m and 10 degrees) and 30, 50, 60 % clutter.
void test_against_the_table_of_trials(void**) {
  const struct {
    double per_m2;
    int fewest[4][3];
  } rows[] = {{0.01, {{3, 3, 4}, {4, 4, 5}, {5, 5, 6}, {5, 6, 6}}},
              {0.1, {{5, 6, 6}, {6, 7, 8}, {7, 7, 8}, {8, 9, 9}}},
              {0.3, {{6, 7, 7}, {8, 9, 10}, {9, 11, 11}, {10, 11, 12}}},
              {0.5, {{7, 9, 8}, {9, 11, 12}, {10, 12, 13}, {11, 13, 15}}},
              {1.0, {{9, 10, 12}, {12, 13, 15}, {13, 16, 17}, {14, 17, 18}}},
              {2.0, {{12, 14, 17}, {14, 18, 22}, {16, 22, 24}, {18, 22, 28}}},
              {4.0, {{17, 22, 26}, {22, 28, 34}, {24, 30, 38}, {26, 32, 40}}}};
  const double radius_m[] = {0.0, 1.0, 5.0, 20.0};
  const double clutter[] = {0.3, 0.5, 0.6};
  for (const auto& row : rows) {
    for (int prior = 0; prior < 4; ++prior) {
      for (int share = 0; share < 3; ++share) {
        int fewest = 0;
        for (int k = 2; k < 60 && fewest == 0; ++k) {
          ProofCase of;
          of.per_m2 = row.per_m2;
          of.sigma_m = of.error_m = 0.04;
          of.clutter = k * clutter[share] / (1.0 - clutter[share]);
          of.rms_radius_m = 4.0 * std::sqrt(0.5);
          of.log_volume = prior == 0 ? 1.5 * std::log(2.0 * kPi) + std::log(0.1 * 0.1 * 0.02)
                                     : std::log(kPi * std::pow(radius_m[prior], 2) * 20.0 * kRadPerDeg);
          if (Proof(of).passes(static_cast<std::size_t>(k), std::log(1.0e6)) >= 0.98) fewest = k;
        }
        if (std::abs(fewest - row.fewest[prior][share]) > 2)
          fail_msg("%g a m2, prior %d, clutter %g: %d, not %d", row.per_m2, prior, clutter[share], fewest,
                   row.fewest[prior][share]);
      }
    }
  }
}

void test_blind_in_between(void**) {
  static std::vector<TableBoulder> all;
  all = field(-1.0, 6.0, 0.4);
  for (const TableBoulder& b : field(16.0, 24.0, 0.4)) all.push_back(b);
  const std::vector<PathPoint> drive = straight(20.0);
  const Forecast made = forecast(mission_model(), all, drive);
  assert_int_equal(made.blind.size(), 1);
  const BlindStretch& b = made.blind[0];
  assert_true(b.from_m > 4.0 && b.from_m < 9.0);
  assert_true(b.to_m > 12.0 && b.to_m < 17.0);
  // From a station that is not blind to the next that is not.
  static bool first, last;
  first = last = false;
  for (const FixStation& s : made.stations) {
    const bool within = s.at.arc_m > b.from_m && s.at.arc_m < b.to_m;
    assert_true(s.blind == within);
    first = first || (s.frame == b.first_frame && !s.blind);
    if (s.frame == b.last_frame) {
      last = !s.blind;
      assert_near(b.at_end.across_m, s.before.across_m, 0.0);
    }
  }
  assert_true(first && last);
}

// ---- against the flight module ----------------------------------------------------------------------------

struct Searched {
  int tried = 0;
  int applied = 0;
  Vec2 squares = Vec2(0.0, 0.0);
  double yaw_squares = 0.0;
};

/// Draws what the model says is drawn, and lets the flight module's search and verdict decide.
Searched search_many(const ForecastModel& model, const std::vector<TableBoulder>& all,
                     const std::vector<PathPoint>& drive, const FixStation& s, int times) {
  Random random(7);
  Searched sum;
  const Sweep sweep(model.rig, model.max_range_m, model.tracks);
  const std::vector<Vec2> spots = sweep.spots(drive, s.frame, 0.25);
  const Pose2 truth{s.at.x_m, s.at.y_m, s.at.yaw_rad};
  constexpr double kWindow_m = 9.0;
  for (int i = 0; i < times; ++i) {
    map_boulders.clear();
    local_map.clear();
    const auto see = [&](const Vec2& p_map_m) {
      LocalBoulder b;
      b.p_site_m = truth.inverse() * p_map_m;
      assert_true(local_map.push_back(b));
    };
    for (const TableBoulder& b : all) {
      if ((b.p_map_m - truth.translation()).norm() <= kWindow_m)
        assert_true(map_boulders.push_back({b.p_map_m, 0.3F}));
      if (sweep.in_footprint(drive, s.frame, b.p_map_m) &&
          test::uniform(random, 0.0, 1.0) < model.detection(b.diameter_m))
        see(b.p_map_m + model.sigma_pair_m * Vec2(test::normal(random), test::normal(random)));
    }
    for (const Vec2& spot : spots) {
      if (test::uniform(random, 0.0, 1.0) < 0.0625 * model.clutter_per_m2)
        see(spot + 0.25 * Vec2(test::uniform(random, -0.5, 0.5), test::uniform(random, -0.5, 0.5)));
    }
    ++sum.tried;
    const Vec3 sigma(s.before.along_m, s.before.across_m, s.before.yaw_rad);  // heading east
    const Pose2 start{truth.x_m + sigma.x() * test::normal(random),
                      truth.y_m + sigma.y() * test::normal(random),
                      wrap_angle(truth.yaw_rad + sigma.z() * test::normal(random))};
    if (job.start({}, map_boulders, kWindow_m, local_map, start, Vec2(0.0, 0.0),
                  sigma.cwiseAbs2().asDiagonal()) != SearchStatus::kRunning)
      continue;
    WorkBudget budget = WorkBudget::unlimited();
    static_cast<void>(job.step(budget));
    if (job.result().verdict.status != VerdictStatus::kAccepted) continue;
    ++sum.applied;
    const Pose2& found = job.result().T_map_site;
    const Vec2 error = found.translation() - truth.translation();
    sum.squares += error.cwiseProduct(error);
    sum.yaw_squares += std::pow(wrap_angle(found.yaw_rad - truth.yaw_rad), 2);
  }
  return sum;
}

/// The probability of a fix, and how good it is, against draws of the flight module's search and verdict.
void test_probability_against_the_verdict(void**) {
  Random random(3);
  static std::vector<TableBoulder> all;
  static std::vector<PathPoint> drive;
  drive = straight(2.0);
  for (const double per_m2 : {0.5, 1.5}) {
    all.clear();
    for (int i = 0; i < static_cast<int>(per_m2 * 576.0); ++i)
      all.push_back(boulder(test::uniform(random, -10.0, 14.0), test::uniform(random, -12.0, 12.0)));
    for (const double clutter : {0.1, 0.6}) {
      for (const double most : {0.45, 0.7, 0.95}) {
        ForecastModel model = plain();
        model.detection.most = most;
        model.clutter_per_m2 = clutter;
        const FixStation s = forecast(model, all, drive).stations.at(0);
        const Searched r = search_many(model, all, drive, s, test::kSanitized ? 40 : 200);
        const double share = static_cast<double>(r.applied) / r.tried;
        // Three standard deviations of the draws, and a tenth that is the closed form's own.
        assert_near(s.applied, share, 3.0 * std::sqrt(0.25 / r.tried) + 0.1);
        if (r.applied < 50) continue;
        const double forecast_m = std::hypot(s.after.along_m, s.after.across_m);
        const double drawn_m = std::sqrt(r.squares.sum() / r.applied);
        if (!(drawn_m < 1.25 * forecast_m && drawn_m > 0.6 * forecast_m))
          fail_msg("%.3f m forecast, %.3f m drawn", forecast_m, drawn_m);
        const double drawn_rad = std::sqrt(r.yaw_squares / r.applied);
        assert_true(drawn_rad < 1.3 * s.after.yaw_rad && drawn_rad > 0.6 * s.after.yaw_rad);
      }
    }
  }
}

/// Between fixes errors grow as the flight module's do, and a fix that is sure takes them back alike.
void test_errors_against_the_fusion(void**) {
  const std::vector<PathPoint> drive =
      drive_over({Vec2(0.0, 0.0), Vec2(4.0, 1.0), Vec2(5.0, 6.0)}, 0.06, 2.0);
  ForecastModel model = mission_model();
  const Forecast blind = forecast(model, {}, drive);
  static PoseFusion fusion;
  fusion.init(model.fusion, model.sigma_start_xy_m, model.sigma_start_yaw_rad);
  std::size_t next = 0;
  for (std::size_t i = 1; i < drive.size(); ++i) {
    fusion.propagate({Vec2(drive[i].x_m - drive[i - 1].x_m, drive[i].y_m - drive[i - 1].y_m),
                      wrap_angle(drive[i].yaw_rad - drive[i - 1].yaw_rad), Mat3::Zero()});
    if (next == blind.stations.size() || blind.stations[next].frame != i) continue;
    const FixStation& s = blind.stations[next++];
    const Ellipse flight = ellipse_of(fusion.covariance().topLeftCorner<2, 2>());
    assert_near(s.ellipse.major_m, flight.major_m, 1e-9);
    assert_near(s.ellipse.minor_m, flight.minor_m, 1e-9);
    assert_near(s.before.yaw_rad, fusion.sigma_yaw_rad(), 1e-9);
  }
  assert_int_equal(next, blind.stations.size());
  assert_near(blind.at_end.yaw_rad, fusion.sigma_yaw_rad(), 1e-9);
}

/// A rover that creeps sees the same boulders at each fix: they tell it once. The faster one, on as many
/// fixes, sees new ones.
void test_the_same_boulders_tell_once(void**) {
  const std::vector<TableBoulder> all = field(-4.0, 20.0, 0.7);
  const auto fixes_on = [&](double step_m) {
    std::vector<PathPoint> drive(150);
    for (std::size_t i = 0; i < drive.size(); ++i)
      drive[i].x_m = drive[i].arc_m = step_m * static_cast<double>(i);
    return forecast(mission_model(), all, drive).stations;
  };
  const std::vector<FixStation> creeping = fixes_on(0.0005);
  const std::vector<FixStation> driving = fixes_on(0.06);
  assert_int_equal(creeping.size(), driving.size());
  assert_at_least(creeping.size(), 4);
  assert_at_least(creeping[0].applied, 0.7);
  assert_at_least(creeping.back().after.along_m, 0.9 * creeping[0].after.along_m);
  assert_at_least(0.9 * creeping.back().after.along_m, driving.back().after.along_m);
}

/// How densely a way is drawn does not matter, nor that its points are some millimetres off.
void test_a_way_drawn_densely_or_not(void**) {
  const std::vector<TableBoulder> all = field(-4.0, 14.0, 0.7);
  Random random(3);
  static std::vector<Forecast> made;
  for (const double apart_m : {2.0, 0.25, 0.06}) {
    std::vector<Vec2> way;
    for (double s = 0.0; s <= 12.0; s += apart_m) {  // a curve of 8 m radius
      const double off_m = apart_m < 1.0 ? test::uniform(random, -0.008, 0.008) : 0.0;
      const SinCos a = sin_cos(s / 8.0);
      way.emplace_back((8.0 + off_m) * a.sin, 4.0 - (8.0 + off_m) * a.cos);
    }
    made.push_back(forecast(mission_model(), all, drive_over(way, 0.06, 2.0)));
  }
  for (const Forecast& f : made) {
    assert_true(made[0].stations.size() >= 6);
    assert_near(f.stations.size(), made[0].stations.size(), 1);
    assert_near(f.at_end.across_m, made[0].at_end.across_m, 0.1 * made[0].at_end.across_m);
    assert_near(f.at_end.yaw_rad, made[0].at_end.yaw_rad, 0.1 * made[0].at_end.yaw_rad);
  }
}

/// 90 degrees are turned in place, 2 degrees a frame; where the way goes back, it goes back.
void test_turns_in_place(void**) {
  const std::vector<PathPoint> corner = drive_over({Vec2(0, 0), Vec2(3, 0), Vec2(3, 3)}, 0.1, 2.0);
  assert_int_equal(corner.size(), 1 + 30 + 45 + 30);
  const std::vector<PathPoint> back = drive_over({Vec2(0, 0), Vec2(3, 0), Vec2(1, 0)}, 0.1, 2.0);
  assert_int_equal(back.size(), 1 + 30 + 90 + 20);
  assert_near(back.back().x_m, 1.0, 1e-9);
  assert_near(back.back().arc_m, 5.0, 1e-9);
}

/// An error larger than the map, or than half a turn, is none that numbers tell of.
void test_lost(void**) {
  ForecastModel model = mission_model();
  model.sigma_start_xy_m = 100.0;
  const std::vector<TableBoulder> all = field(-4.0, 8.0, 1.0);
  model.verdict.ln_threshold = 1.0e6;
  assert_true(forecast(model, all, straight(4.0)).at_end.lost);
  model.sigma_start_xy_m = 1.0;
  assert_false(forecast(model, all, straight(4.0)).at_end.lost);
  model.sigma_start_yaw_rad = 4.0;
  assert_true(forecast(model, all, straight(4.0)).at_end.lost);
}

/// Of two outcomes the covariance carried on is the mean, weighed by their probabilities.
void test_both_outcomes_are_carried_on(void**) {
  const std::vector<TableBoulder> all = field(-4.0, 8.0, 1.0);
  ForecastModel model = plain();
  model.detection.most = 0.5;
  const auto after_two = [&](bool applied) {
    ForecastModel m = model;
    if (!applied) m.verdict.ln_threshold = 1.0e6;
    return forecast(m, all, straight(4.0));
  };
  const Forecast mixed = after_two(true);
  const Forecast none = after_two(false);
  assert_int_equal(mixed.stations.size(), 2);
  assert_near(none.stations[0].applied, 0.0, 0.0);
  const double p = mixed.stations[0].applied;
  if (!(p > 0.05 && p < 0.95)) fail_msg("probability %.3f", p);
  // At the next fix yaw has grown by what does not depend on the first one, but for what it told of the turn.
  assert_true(mixed.stations[0].after.yaw_rad < mixed.stations[0].before.yaw_rad);
  const double low = mixed.stations[0].after.yaw_rad;
  const double high = none.stations[0].after.yaw_rad;
  const double between = std::sqrt(p * low * low + (1.0 - p) * high * high);
  assert_true(mixed.stations[1].before.yaw_rad > between);
  assert_true(mixed.stations[1].before.yaw_rad < none.stations[1].before.yaw_rad);
  const double grown = std::pow(none.stations[1].before.yaw_rad, 2) - high * high;
  assert_near(std::pow(mixed.stations[1].before.yaw_rad, 2), between * between + grown, 0.25 * grown);
}

// ---- plane geometry ---------------------------------------------------------------------------------------

void test_ellipses(void**) {
  Mat2 covariance;
  const double a = 0.7;
  const Mat2 turn = (Mat2() << std::cos(a), -std::sin(a), std::sin(a), std::cos(a)).finished();
  covariance = turn * (Mat2() << 9.0, 0.0, 0.0, 4.0).finished() * turn.transpose();
  const Ellipse e = ellipse_of(covariance);
  assert_near(e.major_m, 3.0, 1e-12);
  assert_near(e.minor_m, 2.0, 1e-12);
  assert_near(e.azimuth_rad, a, 1e-12);
}

void test_within_a_disc(void**) {
  // A circle: Rayleigh. A line: the error function. Nothing: all of it.
  assert_near(within_disc({0.2, 0.2, 0.3}, 0.3), 1.0 - std::exp(-0.5 * 2.25), 1e-12);
  assert_near(within_disc({0.2, 0.0, 0.3}, 0.3), std::erf(1.5 / std::sqrt(2.0)), 1e-9);
  assert_near(within_disc({0.0, 0.0, 0.0}, 0.3), 1.0, 0.0);
  Random random(9);
  int inside = 0;
  constexpr int kDraws = 200000;
  for (int i = 0; i < kDraws; ++i)
    inside += std::hypot(0.25 * test::normal(random), 0.08 * test::normal(random)) <= 0.2 ? 1 : 0;
  assert_near(within_disc({0.25, 0.08, 1.0}, 0.2), static_cast<double>(inside) / kDraws, 0.005);
}

/// Of way, where landmarks serve the map: turning on the spot forgets nothing.
void test_a_window_of_way(void**) {
  const ForecastModel model = mission_model();
  const Sweep sweep(model.rig, model.max_range_m, model.tracks, 10.0);
  std::vector<PathPoint> drive = straight(20.0);
  const std::size_t last = drive.size() - 1;
  assert_near(drive[sweep.first_of_window(drive, last)].arc_m, drive[last].arc_m - 10.0, 0.061);
  assert_true(sweep.in_footprint(drive, last, Vec2(drive[last].x_m - 6.0, 0.0)));
  assert_false(sweep.in_footprint(drive, last, Vec2(drive[last].x_m - 12.0, 0.0)));
  PathPoint standing = drive.back();
  for (int i = 0; i < 500; ++i) drive.push_back(standing);
  assert_true(sweep.in_footprint(drive, drive.size() - 1, Vec2(standing.x_m - 6.0, 0.0)));
}

/// A pair with a landmark is what the flight module takes it for: seen once from 2.5 m, then left behind.
void test_sigma_of_landmarks(void**) {
  ForecastModel model = mission_model();
  model.window_m = 60.0;
  model.footprint_sigma_m = 0.15;
  model.evidence.sigma_pair_m = 0.1;
  const std::vector<PathPoint> drive = straight(50.0);
  const Sweep sweep(model.rig, model.max_range_m, model.tracks, model.window_m);
  const TableBoulder seen = boulder(10.0, 0.6, 0.9);
  const SpotView view = sweep.view_of(drive, drive.size() - 1, seen.p_map_m);
  Relief::Boulders survey;
  ReliefBoulder b;
  b.p_site_m = seen.p_map_m;
  b.diameter_m = 1.0;
  b.sigma_m = model.footprint_sigma_m;
  b.way_m = view.last_arc_m;
  b.range_m = view.nearest_m;
  survey.append(b);
  LandmarkParams params;
  params.window_m = model.window_m;
  static Landmarks landmarks;
  landmarks.init(params);
  landmarks.start(survey, Vec2(view.last_arc_m, 0.0), view.last_arc_m, 12.0, 30.0);
  WorkBudget all = WorkBudget::unlimited();
  assert_status(landmarks.step(all), Progress::kDone);
  for (const std::size_t last : {drive.size() / 4, drive.size() - 1}) {
    landmarks.build(0.25, drive[last].arc_m, local_map);
    assert_int_equal(local_map.size(), 1);
    assert_near(claimed_sigma_m(model, sweep, drive, last, {seen}),
                std::hypot(0.1, static_cast<double>(local_map[0].sigma_m)), 1e-6);
  }
  assert_near(claimed_sigma_m(mission_model(), sweep, drive, 100, {seen}), EvidenceParams{}.sigma_pair_m,
              0.0);
}

/// Lengths of landmarks go with the pixel; a window has none of it.
void test_what_serves_a_map(void**) {
  std::vector<TableBoulder> large = field(-4.0, 30.0, 1.0);
  for (TableBoulder& b : large) b.diameter_m = 0.45;
  const MapExtent extent = extent_of(large);
  const ForecastModel fine = model_for(mission_model(), large, extent, 0.02);
  const ForecastModel coarse = model_for(mission_model(), large, extent, 0.2);
  assert_near(fine.window_m, 0.0, 0.0);
  assert_true((coarse.window_m > 10.0) == cfg::kHaveLandmarks);
  assert_true((coarse.sigma_common_m > 2.0 * fine.sigma_common_m) == cfg::kHaveLandmarks);
  static Landmarks landmarks;
  landmarks.init(LandmarkParams());
  if (cfg::kHaveLandmarks) assert_near(coarse.sigma_common_m, landmarks.common_m(0.2), 1.0e-12);
  assert_true((coarse.verdict.ln_threshold < fine.verdict.ln_threshold) == cfg::kHaveLandmarks);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_what_is_in_view),
      cmocka_unit_test(test_frames_of_the_window),
      cmocka_unit_test(test_fixes_follow_the_schedule),
      cmocka_unit_test(test_no_boulders_no_fix),
      cmocka_unit_test(test_many_boulders_sure_fixes),
      cmocka_unit_test(test_a_drive_without_a_fix_is_blind),
      cmocka_unit_test(test_a_clump_is_weak),
      cmocka_unit_test(test_too_few_boulders),
      cmocka_unit_test(test_what_a_proof_takes),
      cmocka_unit_test(test_against_the_table_of_trials),
      cmocka_unit_test(test_blind_in_between),
      cmocka_unit_test(test_probability_against_the_verdict),
      cmocka_unit_test(test_errors_against_the_fusion),
      cmocka_unit_test(test_the_same_boulders_tell_once),
      cmocka_unit_test(test_a_way_drawn_densely_or_not),
      cmocka_unit_test(test_turns_in_place),
      cmocka_unit_test(test_lost),
      cmocka_unit_test(test_both_outcomes_are_carried_on),
      cmocka_unit_test(test_ellipses),
      cmocka_unit_test(test_within_a_disc),
      cmocka_unit_test(test_a_window_of_way),
      cmocka_unit_test(test_sigma_of_landmarks),
      cmocka_unit_test(test_what_serves_a_map),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
