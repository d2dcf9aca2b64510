// Forecasts: footprint, cases with known answers, covariances and probabilities against the flight module's
// own registration and fusion, blind stretches.
#include "forecast/forecast.hpp"

#include <cmath>

#include "support/cmocka.hpp"
#include "support/noise.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

IcpJob job;
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
  model.sigma_pair_m = model.icp.sigma_pair_m;
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
}

void test_frames_of_the_window(void**) {
  const ForecastModel model = mission_model();
  const Sweep sweep(model.rig, model.max_range_m, model.tracks);
  const std::vector<PathPoint> drive = straight(20.0);
  // In view from 0.33 m to 3.0 m ahead: 44 or 45 steps of 0.06 m.
  const int whole = sweep.frames_in_view(drive, 150, Vec2(drive[150].x_m, 0.0));
  assert_in_range(whole, 44, 45);
  assert_int_equal(sweep.frames_in_view(drive, 150, Vec2(drive[150].x_m - 4.0, 0.0)), 0);  // left the window
  assert_int_equal(sweep.first_of_window(150), 90);
  assert_int_equal(sweep.first_of_window(24), 0);
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

/// Eight boulders within a hand's breadth tell where the rover is, but not which way it looks:
/// the flight module refuses.
void test_a_clump_is_weak(void**) {
  static std::vector<TableBoulder> clump;
  static std::vector<TableBoulder> spread;
  for (int i = 0; i < 8; ++i) {
    clump.push_back(boulder(2.5 + 0.1 * (i % 4), 0.2 * (i / 4)));
    spread.push_back(boulder(2.0 + 0.4 * (i % 4), 1.2 * (i / 4) - 0.6));
  }
  const FixStation weak = forecast(plain(), clump, straight(2.0)).stations.at(0);
  assert_int_equal(weak.boulders, 8);
  assert_at_most(weak.lever_m, 0.3);
  assert_near(weak.applied, 0.0, 0.0);
  const FixStation strong = forecast(plain(), spread, straight(2.0)).stations.at(0);
  assert_int_equal(strong.boulders, 8);
  assert_at_least(strong.applied, 0.999);
  // Where the lever does: yaw is what a short one costs.
  ForecastModel lenient = plain();
  lenient.icp.min_lever_m = 0.01;
  lenient.sigma_start_yaw_rad = 1.0;
  lenient.sigma_start_xy_m = 10.0;
  const FixStation loose = forecast(lenient, clump, straight(2.0)).stations.at(0);
  const FixStation firm = forecast(lenient, spread, straight(2.0)).stations.at(0);
  assert_at_least(loose.after.yaw_rad, 3.0 * firm.after.yaw_rad);
}

void test_too_few_pairs(void**) {
  ForecastModel model = plain();
  assert_int_equal(fewest_pairs(model.icp), 5);  // of 5 the worst goes, and 4 stay
  static std::vector<TableBoulder> all;
  for (int i = 0; i < 4; ++i) all.push_back(boulder(2.0 + 0.4 * i, 0.5 * i - 0.8));
  assert_near(forecast(model, all, straight(2.0)).stations.at(0).applied, 0.0, 0.0);
  all.push_back(boulder(2.3, 0.9));
  assert_at_least(forecast(model, all, straight(2.0)).stations.at(0).enough, 0.999);
  // Each found in 9 cases of 10.
  model.detection.most = 0.9;
  assert_near(forecast(model, all, straight(2.0)).stations.at(0).enough, std::pow(0.9, 5), 1e-9);
  for (TableBoulder& b : all) b.confidence = 0.5;
  const FixStation s = forecast(model, all, straight(2.0)).stations.at(0);
  assert_near(s.enough, std::pow(0.45, 5), 1e-9);
  assert_near(s.found, 5 * 0.45, 1e-9);
  for (TableBoulder& b : all) b.confidence = 0.0;
  assert_near(forecast(model, all, straight(2.0)).stations.at(0).enough, 0.0, 0.0);
  model.icp.trim_fraction = 0.0;
  assert_int_equal(fewest_pairs(model.icp), 4);
  model.icp.trim_fraction = 0.5;
  assert_int_equal(fewest_pairs(model.icp), 7);
}

void test_blind_in_between(void**) {
  static std::vector<TableBoulder> all;
  all = field(-1.0, 6.0, 0.4);
  for (const TableBoulder& b : field(16.0, 24.0, 0.4)) all.push_back(b);
  const std::vector<PathPoint> drive = straight(20.0);
  const Forecast made = forecast(mission_model(), all, drive);
  assert_int_equal(made.blind.size(), 1);
  const BlindStretch& b = made.blind[0];
  assert_true(b.from_m > 4.0 && b.from_m < 8.5);
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

/// A start that is known badly: the pairs are there, but not within the gate.
void test_an_error_beyond_the_gate(void**) {
  ForecastModel model = plain();
  const std::vector<TableBoulder> all = field(-4.0, 8.0, 0.4);
  model.sigma_start_xy_m = 0.6;
  model.fusion.sigma_scale = model.fusion.sigma_turn_rad_per_m = 1e-9;
  model.sigma_start_yaw_rad = 1e-9;
  model.fusion.noise_xy_m = model.fusion.noise_yaw_rad = 1e-9;
  const FixStation s = forecast(model, all, straight(2.0)).stations.at(0);
  assert_near(s.caught, 1.0 - std::exp(-0.5), 1e-3);  // Rayleigh
  assert_near(s.applied, s.caught * s.enough, 1e-12);
}

// ---- against the flight module ----------------------------------------------------------------------------

/// The covariance of the registration itself, of all pairs at their places.
void test_information_against_the_registration(void**) {
  ForecastModel model = plain();
  model.icp.trim_fraction = 0.0;
  model.sigma_start_xy_m = 1e3;
  model.sigma_start_yaw_rad = 30.0;
  model.icp.gate_start_m = 1e3;
  const std::vector<PathPoint> drive = drive_over({Vec2(3.0, 1.0), Vec2(5.0, 2.0)}, 0.06, 2.0);
  static std::vector<TableBoulder> all;
  const double places[][2] = {{5.1, 1.6}, {5.6, 2.3}, {6.1, 2.0}, {6.4, 2.9}, {5.9, 2.75}, {4.9, 2.35}};
  for (const auto& p : places) all.push_back(boulder(p[0], p[1]));
  model.fusion.sigma_scale = model.fusion.sigma_turn_rad_per_m = 1e-9;
  model.fusion.noise_xy_m = model.fusion.noise_yaw_rad = 1e-9;
  model.fusion.scale_walk = model.fusion.turn_walk_rad_per_m = 1e-9;
  const FixStation s = forecast(model, all, drive).stations.at(0);
  assert_int_equal(s.boulders, 6);

  map_boulders.clear();
  local_map.clear();
  const Pose2 T_map_site{s.at.x_m, s.at.y_m, s.at.yaw_rad};
  for (const auto& p : places) {
    assert_true(map_boulders.push_back({Vec2(p[0], p[1]), 0.3F}));
    LocalBoulder b;
    b.p_site_m = T_map_site.inverse() * Vec2(p[0], p[1]);
    assert_true(local_map.push_back(b));
  }
  IcpParams params = model.icp;
  params.gate_start_m = 0.6;
  assert_status(job.start(params, map_boulders, local_map, T_map_site, Vec2(0.0, 0.0)), IcpStatus::kRunning);
  WorkBudget budget = WorkBudget::unlimited();
  static_cast<void>(job.step(budget));
  assert_status(job.status(), IcpStatus::kConverged);
  const Mat3& flight = job.result().covariance;
  const Ellipse expected = ellipse_of(flight.topLeftCorner<2, 2>());
  assert_near(s.ellipse.major_m, expected.major_m, 1e-4 * expected.major_m);
  assert_near(s.ellipse.minor_m, expected.minor_m, 1e-4 * expected.minor_m);
  assert_near(s.ellipse.azimuth_rad, expected.azimuth_rad, 1e-4);
  assert_near(s.after.yaw_rad, std::sqrt(flight(2, 2)), 1e-4 * std::sqrt(flight(2, 2)));
  assert_at_least(expected.major_m, 1.3 * expected.minor_m);  // so that the azimuth is worth something
  // With the worst 30 % dropped: seven of ten stay, each worth A/p of what it was (registration/icp.hpp).
  model.icp.trim_fraction = 0.3;
  const Ellipse trimmed = forecast(model, all, drive).stations.at(0).ellipse;
  const double left = 0.7 * (0.7 + 0.3 * std::log(0.3)) / 0.7;
  assert_near(trimmed.major_m, expected.major_m / std::sqrt(left), 1e-4 * trimmed.major_m);
}

struct Registered {
  int tried = 0;
  int applied = 0;
  Vec2 squares = Vec2(0.0, 0.0);
  double yaw_squares = 0.0;
};

/// Draws what the model says is drawn, and lets the flight module's registration decide.
Registered register_many(const ForecastModel& model, const std::vector<TableBoulder>& all,
                         const FixStation& s, int times) {
  Random random(7);
  Registered sum;
  const Pose2 truth{s.at.x_m, s.at.y_m, s.at.yaw_rad};
  for (int i = 0; i < times; ++i) {
    map_boulders.clear();
    local_map.clear();
    const auto see = [&](const Vec2& p_map_m) {
      LocalBoulder b;
      b.p_site_m = truth.inverse() * p_map_m;
      assert_true(local_map.push_back(b));
    };
    for (const TableBoulder& b : all) {
      assert_true(map_boulders.push_back({b.p_map_m, 0.3F}));
      if (test::uniform(random, 0.0, 1.0) < model.detection(b.diameter_m))
        see(b.p_map_m + model.sigma_pair_m * Vec2(test::normal(random), test::normal(random)));
    }
    // Clutter over a square around them all.
    constexpr double kSide_m = 7.0;
    const double expected = model.clutter_per_m2 * kSide_m * kSide_m;
    for (int k = 0; k < 200; ++k) {
      if (test::uniform(random, 0.0, 1.0) >= expected / 200.0) continue;
      see(truth.translation() +
          Vec2(2.0 + kSide_m * test::uniform(random, -0.5, 0.5), kSide_m * test::uniform(random, -0.5, 0.5)));
    }
    ++sum.tried;
    const IcpPrior prior{true,
                         std::sqrt(0.5 * (std::pow(s.before.along_m, 2) + std::pow(s.before.across_m, 2))),
                         s.before.yaw_rad};
    const Vec2 off_m = prior.sigma_xy_m * Vec2(test::normal(random), test::normal(random));
    const double off_rad = prior.sigma_yaw_rad * test::normal(random);
    const Pose2 start{truth.x_m + off_m.x(), truth.y_m + off_m.y(), wrap_angle(truth.yaw_rad + off_rad)};
    if (job.start(model.icp, map_boulders, local_map, start, Vec2(0.0, 0.0), prior) != IcpStatus::kRunning)
      continue;
    WorkBudget budget = WorkBudget::unlimited();
    static_cast<void>(job.step(budget));
    if (job.status() != IcpStatus::kConverged) continue;
    ++sum.applied;
    const Pose2& found = job.result().T_map_site;
    const Vec2 error = found.translation() - truth.translation();
    sum.squares += error.cwiseProduct(error);
    sum.yaw_squares += std::pow(wrap_angle(found.yaw_rad - truth.yaw_rad), 2);
  }
  return sum;
}

/// The probability of a fix, and how good it is, against draws of the flight module's registration
/// under its prior.
void test_probability_against_the_registration(void**) {
  static std::vector<TableBoulder> all;
  const double places[][2] = {{2.0, -0.9}, {2.4, 0.7}, {3.1, 0.1},  {2.9, -1.1},
                              {3.6, 0.9},  {1.9, 0.2}, {3.9, -0.4}, {4.1, 0.6}};
  for (const auto& p : places) all.push_back(boulder(p[0], p[1]));
  for (const double clutter : {0.0, 0.3}) {
    for (const double most : {0.45, 0.65, 0.85}) {
      ForecastModel model = plain();
      model.detection.most = most;
      model.clutter_per_m2 = clutter;
      const FixStation s = forecast(model, all, straight(2.0)).stations.at(0);
      assert_int_equal(s.boulders, 8);
      const Registered r = register_many(model, all, s, 2000);
      const double share = static_cast<double>(r.applied) / r.tried;
      // Four standard deviations of the draws; with clutter a hundredth or so is the model's own.
      assert_near(s.applied, share,
                  4.0 * std::sqrt(share * (1.0 - share) / r.tried) + (clutter > 0.0 ? 0.03 : 0.015));
      // The covariance allows for outliers among what was trimmed, so that it is large rather than small.
      const double forecast_m = std::hypot(s.after.along_m, s.after.across_m);
      const double drawn_m = std::sqrt(r.squares.sum() / r.applied);
      assert_true(drawn_m < 1.15 * forecast_m && drawn_m > 0.6 * forecast_m);
      const double drawn_rad = std::sqrt(r.yaw_squares / r.applied);
      assert_true(drawn_rad < 1.15 * s.after.yaw_rad && drawn_rad > 0.6 * s.after.yaw_rad);
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

/// Of two outcomes the covariance carried on is the mean, weighed by their probabilities.
void test_both_outcomes_are_carried_on(void**) {
  static std::vector<TableBoulder> all;
  const double places[][2] = {{2.0, -0.9}, {2.4, 0.7}, {3.1, 0.1}, {2.9, -1.1}, {3.6, 0.9}};
  for (const auto& p : places) all.push_back(boulder(p[0], p[1]));
  ForecastModel model = plain();
  model.detection.most = 0.8;
  const auto after_two = [&](double applied) {
    ForecastModel m = model;
    if (applied == 0.0) m.icp.min_pairs = 200;
    return forecast(m, all, straight(4.0));
  };
  const Forecast mixed = after_two(1.0);
  const Forecast none = after_two(0.0);
  assert_int_equal(mixed.stations.size(), 2);
  const double p = mixed.stations[0].applied;
  assert_near(p, std::pow(0.8, 5), 1e-3);
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
      cmocka_unit_test(test_too_few_pairs),
      cmocka_unit_test(test_blind_in_between),
      cmocka_unit_test(test_an_error_beyond_the_gate),
      cmocka_unit_test(test_information_against_the_registration),
      cmocka_unit_test(test_probability_against_the_registration),
      cmocka_unit_test(test_errors_against_the_fusion),
      cmocka_unit_test(test_both_outcomes_are_carried_on),
      cmocka_unit_test(test_ellipses),
      cmocka_unit_test(test_within_a_disc),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
