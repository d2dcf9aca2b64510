// Fusion of fixes with VO: against a textbook filter, on drives whose truth is known, and where VO is blind.
#include "localizer/pose_fusion.hpp"

#include <cmath>

#include "core/random.hpp"
#include "geometry/stereo_rig.hpp"
#include "support/cmocka.hpp"
#include "support/sanitized.hpp"

using namespace cairn;

namespace {

Random generator(1);

double uniform(double low, double high) { return low + (high - low) * (generator.next() / 4294967296.0); }

double gauss() {
  double sum = -6.0;
  for (int i = 0; i < 12; ++i) sum += uniform(0.0, 1.0);
  return sum;
}

Mat3 diagonal(double xy, double yaw) { return Vec3(xy * xy, xy * xy, yaw * yaw).asDiagonal(); }

PlanarStep step_of(double dx, double dy, double turn = 0.0) { return {Vec2(dx, dy), turn, Mat3::Zero()}; }

/// Errors of fixes that have nothing in common.
FusionParams without_common() {
  FusionParams p;
  p.common_xy_m = p.common_yaw_rad = 0.0;
  return p;
}

FusionResult fuse(PoseFusion& fusion, const Vec3& z, const Mat3& R, double fresh = 1.0) {
  fusion.snapshot();
  return fusion.update({z, R}, fresh);
}

// ---- the equations -----------------------------------------------------------------------------------

/// The textbook filter in covariance form, whose state holds the snapshot's pose errors as well: a late fix
/// is then a measurement like any other.
struct Oracle {
  using Vec16 = Eigen::Matrix<double, 16, 1>;
  double P[16][16] = {};
  double k = 0.0;
  double w = 0.0;
  Vec3 common = Vec3::Zero();  // now, and of the snapshot
  Vec3 common_then = Vec3::Zero();

  void start(const FusionParams& p, double xy, double yaw) {
    const double sigma[8] = {
        xy, xy, yaw, p.sigma_scale, p.sigma_turn_rad_per_m, p.common_xy_m, p.common_xy_m, p.common_yaw_rad};
    for (int i = 0; i < 8; ++i) P[i][i] = sigma[i] * sigma[i];
    snapshot();
  }
  void snapshot() {
    for (int i = 0; i < 8; ++i) {
      for (int j = 0; j < 8; ++j) P[8 + i][8 + j] = P[8 + i][j] = P[i][8 + j] = P[i][j];
    }
    common_then = common;
  }
  void step(const FusionParams& p, const PlanarStep& s) {
    const double dx = s.d_map_m.x();
    const double dy = s.d_map_m.y();
    const double ds = std::hypot(dx, dy);
    const double a = p.common_length_m / (p.common_length_m + ds);
    double F[16][16] = {};
    for (int i = 0; i < 16; ++i) F[i][i] = i >= 5 && i < 8 ? a : 1.0;
    F[0][2] = -dy;
    F[1][2] = dx;
    F[0][3] = dx;
    F[1][3] = dy;
    F[2][4] = ds;
    double FP[16][16] = {};
    for (int i = 0; i < 16; ++i)
      for (int j = 0; j < 16; ++j)
        for (int m = 0; m < 16; ++m) FP[i][j] += F[i][m] * P[m][j];
    for (int i = 0; i < 16; ++i)
      for (int j = 0; j < 16; ++j) {
        P[i][j] = 0.0;
        for (int m = 0; m < 16; ++m) P[i][j] += FP[i][m] * F[j][m];
      }
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) P[i][j] += p.vo_sigma_factor * p.vo_sigma_factor * s.covariance(i, j);
    P[0][0] += p.noise_xy_m * p.noise_xy_m * ds;
    P[1][1] += p.noise_xy_m * p.noise_xy_m * ds;
    P[2][2] += p.noise_yaw_rad * p.noise_yaw_rad * ds + p.noise_turn * p.noise_turn * std::fabs(s.turn_rad);
    P[3][3] += p.scale_walk * p.scale_walk * ds;
    P[4][4] += p.turn_walk_rad_per_m * p.turn_walk_rad_per_m * ds;
    for (int i = 0; i < 3; ++i) {
      const double c = i < 2 ? p.common_xy_m : p.common_yaw_rad;
      P[5 + i][5 + i] += (1.0 - a * a) * c * c;
    }
    common *= a;
  }
  /// Of the snapshot's pose, scalar by scalar (R diagonal). Returns the present state's correction.
  Vec16 fix(const Vec3& z, const Vec3& R) {
    Vec16 e = Vec16::Zero();
    for (int m = 0; m < 3; ++m) {
      const int a = 8 + m;
      const int b = 8 + 5 + m;
      double PH[16];
      for (int i = 0; i < 16; ++i) PH[i] = P[i][a] + P[i][b];
      const double S = PH[a] + PH[b] + R[m];
      const double innovation = z[m] - common_then[m] - e[a] - e[b];
      for (int i = 0; i < 16; ++i) e[i] += PH[i] / S * innovation;
      for (int i = 0; i < 16; ++i)
        for (int j = 0; j < 16; ++j) P[i][j] -= PH[i] * PH[j] / S;
    }
    k += e[3];
    w += e[4];
    common += e.segment<3>(5);
    common_then += e.segment<3>(13);
    return e;
  }
};

void test_against_the_textbook_filter(void**) {
  FusionParams params;
  params.gate_chi2 = params.surprise_chi2 = 1e9;
  params.max_scale = params.max_turn_rad_per_m = 1.0;
  for (const int late : {0, 7}) {
    static PoseFusion fusion;
    static Oracle oracle;
    fusion.init(params, 0.05, 0.01);
    oracle = Oracle();
    oracle.start(params, 0.05, 0.01);
    generator = Random(3);
    const auto drive = [&](int fix, int i) {
      const double heading = 0.1 * fix + 0.01 * i;
      const double length = 0.06 + 0.02 * gauss();
      PlanarStep s = step_of(length * std::cos(heading), length * std::sin(heading), 0.01);
      Mat3 A;
      for (int m = 0; m < 9; ++m) A(m / 3, m % 3) = 0.0005 * gauss();
      s.covariance = A * A.transpose();
      fusion.propagate(s);
      oracle.step(params, s);
    };
    for (int fix = 0; fix < 40; ++fix) {
      for (int i = 0; i < 30; ++i) drive(fix, i);
      fusion.snapshot();
      oracle.snapshot();
      for (int i = 0; i < late; ++i) drive(fix, 30 + i);
      const double fresh = fix % 2 == 0 ? 1.0 : 0.5;
      const Vec3 R(1e-4 * uniform(1.0, 9.0), 1e-4 * uniform(1.0, 9.0), 1e-4 * uniform(0.1, 2.0));
      const Vec3 z(0.05 * gauss(), 0.05 * gauss(), 0.01 * gauss());
      const FusionResult got = fusion.update({z, R.asDiagonal()}, fresh);
      assert_status(got.status, FusionStatus::kFused);
      const Oracle::Vec16 want = oracle.fix(z, R / fresh);
      assert_near(got.at_snapshot.x_m, want[8], 1e-9);
      assert_near(got.at_snapshot.y_m, want[9], 1e-9);
      assert_near(got.at_snapshot.yaw_rad, want[10], 1e-9);
      assert_near(fusion.scale(), oracle.k, 1e-9);
      assert_near(fusion.turn_rad_per_m(), oracle.w, 1e-9);
      // What the rates change since, beside what the turn does to the way since.
      assert_near(got.at_snapshot.yaw_rad + got.since.yaw_rad, want[2], 1e-9);
      if (late == 0) assert_near(std::hypot(got.since.x_m, got.since.y_m), 0.0, 0.0);
      const Mat3 now = fusion.covariance();
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) assert_near(now(i, j), oracle.P[i][j], 1e-10);
    }
  }
}

/// A heading is a scalar of the present yaw, and what goes with it follows.
void test_a_heading(void**) {
  FusionParams params;
  params.max_scale = params.max_turn_rad_per_m = 1.0;
  Oracle oracle;
  PoseFusion fusion;
  fusion.init(params, 0.05, 0.02);
  oracle.start(params, 0.05, 0.02);
  for (int i = 0; i < 5; ++i) {
    fusion.propagate(step_of(1.5, 0.3, 0.1));
    oracle.step(params, step_of(1.5, 0.3, 0.1));
    double Ph[8];
    for (int m = 0; m < 8; ++m) Ph[m] = oracle.P[m][2];
    const double S = Ph[2] + 1e-5;
    const double offset = 0.01 - 0.003 * i;
    for (int m = 0; m < 8; ++m)
      for (int n = 0; n < 8; ++n) oracle.P[m][n] -= Ph[m] * Ph[n] / S;
    oracle.k += Ph[3] * offset / S;
    oracle.w += Ph[4] * offset / S;
    const FusionResult got = fusion.heading(offset, 1e-5);
    assert_status(got.status, FusionStatus::kFused);
    assert_near(got.chi2, offset * offset / S, 1e-9);
    assert_near(got.at_snapshot.x_m, Ph[0] * offset / S, 1e-12);
    assert_near(got.at_snapshot.y_m, Ph[1] * offset / S, 1e-12);
    assert_near(got.at_snapshot.yaw_rad, Ph[2] * offset / S, 1e-12);
    assert_near(std::hypot(std::hypot(got.since.x_m, got.since.y_m), got.since.yaw_rad), 0.0, 0.0);
    assert_near(fusion.scale(), oracle.k, 1e-12);
    assert_near(fusion.turn_rad_per_m(), oracle.w, 1e-12);
    const Mat3 now = fusion.covariance();
    for (int m = 0; m < 9; ++m) assert_near(now(m / 3, m % 3), oracle.P[m / 3][m % 3], 1e-12);
  }
  assert_at_least(std::fabs(fusion.turn_rad_per_m()), 1e-4);
  const double before = fusion.sigma_yaw_rad();
  const double rate = fusion.turn_rad_per_m();
  const double sigma = std::sqrt(before * before + 1e-5);
  assert_status(fusion.heading(4.7 * sigma, 1e-5).status, FusionStatus::kInconsistent);
  assert_status(fusion.heading(-4.7 * sigma, 1e-5).status, FusionStatus::kInconsistent);
  for (const double bad : {static_cast<double>(NAN), static_cast<double>(HUGE_VAL)}) {
    assert_status(fusion.heading(bad, 1e-5).status, FusionStatus::kBadInput);
    assert_status(fusion.heading(0.0, bad).status, FusionStatus::kBadInput);
  }
  assert_status(fusion.heading(0.0, 0.0).status, FusionStatus::kBadInput);
  assert_status(fusion.heading(0.0, -1e-5).status, FusionStatus::kBadInput);
  assert_near(fusion.sigma_yaw_rad(), before, 0.0);
  assert_near(fusion.turn_rad_per_m(), rate, 0.0);
  assert_status(fusion.heading(4.5 * sigma, 1e-5).status, FusionStatus::kFused);
}

/// The present pose after a late fix: turned about the snapshot, then shifted by what the rates change.
void test_late_fix_moves_the_present_pose(void**) {
  const FusionParams params = without_common();
  Oracle oracle;
  PoseFusion fusion;
  fusion.init(params, 0.05, 0.02);
  oracle.start(params, 0.05, 0.02);
  const auto drive = [&](double dx, double dy) {
    fusion.propagate(step_of(dx, dy));
    oracle.step(params, step_of(dx, dy));
  };
  drive(10.0, 0.0);
  fusion.snapshot();
  oracle.snapshot();
  drive(0.5, 0.2);
  drive(0.1, 0.4);
  const Vec3 R(1e-4, 1e-4, 1e-4);
  const Vec3 z(0.02, -0.01, 0.001);
  const FusionResult got = fusion.update({z, R.asDiagonal()}, 1.0);
  const Oracle::Vec16 want = oracle.fix(z, R);
  const Vec2 way(0.6, 0.6);
  assert_near(got.at_snapshot.x_m - got.at_snapshot.yaw_rad * way.y() + got.since.x_m, want[0], 1e-12);
  assert_near(got.at_snapshot.y_m + got.at_snapshot.yaw_rad * way.x() + got.since.y_m, want[1], 1e-12);
  assert_at_least(std::fabs(got.since.x_m), 1e-5);
}

/// VO's covariance, seen from above: against the pose itself, moved a little.
void test_covariance_of_a_step(void**) {
  const Pose3 T_rover_cam = mast_pose(0.7, 0.68, 0.12);
  const Pose3 T_map_rover{quat_from_attitude({0.7, 0.1, -0.05}), Vec3(3.0, -2.0, 0.3)};
  const Pose3 T_map_cam = T_map_rover * T_rover_cam;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) {
      constexpr double kSmall = 1.0e-6;
      const auto moved = [&](int axis) {
        Vec3 w(0.0, 0.0, 0.0);
        Vec3 v(0.0, 0.0, 0.0);
        (axis < 3 ? w[axis] : v[axis - 3]) = kSmall;
        const Pose3 rover = T_map_cam * Pose3{quat_exp(w), v} * T_rover_cam.inverse();
        // Turn about the map's z: what the yaw of a level rover would be.
        const Vec3 turn = quat_log(rover.q * T_map_rover.q.conjugate());
        return Vec3(Vec3(rover.t.x() - T_map_rover.t.x(), rover.t.y() - T_map_rover.t.y(), turn.z()) /
                    kSmall);
      };
      Mat6 C = Mat6::Zero();
      C(i, j) = C(j, i) = 1.0;
      const Mat3 got = planar_covariance(C, T_rover_cam, T_map_rover);
      Mat3 want = moved(i) * moved(j).transpose();
      if (i != j) want += Mat3(want.transpose());
      for (int m = 0; m < 9; ++m) assert_near(got(m / 3, m % 3), want(m / 3, m % 3), 1e-5);
    }
  }
}

void test_without_fixes(void**) {
  PoseFusion fusion;
  fusion.init({}, 0.05, 0.01);
  assert_near(fusion.sigma_xy_m(), 0.05, 1e-15);
  assert_near(fusion.sigma_yaw_rad(), 0.01, 1e-15);
  for (int i = 0; i < 100; ++i) {
    fusion.propagate(step_of(0.1, 0.0));
    Pose3 step;
    step.t = Vec3(0.06, 0.01, -0.02);
    step.q = quat_from_attitude({0.05, -0.02, 0.01});
    const Pose3 out = fusion.calibrated(step);
    assert_near((out.t - step.t).norm(), 0.0, 0.0);
    assert_near((out.q.coeffs() - step.q.coeffs()).norm(), 0.0, 1e-15);
  }
  assert_near(fusion.scale(), 0.0, 0.0);
  assert_near(fusion.turn_rad_per_m(), 0.0, 0.0);
}

/// One straight step of d: the formula of the header, by hand.
void test_growth(void**) {
  const FusionParams p;
  const double d = 1.8;
  for (const double angle : {0.0, 0.7, 2.0}) {
    PoseFusion fusion;
    fusion.init(p, 0.02, 0.004);
    fusion.propagate(step_of(d * std::cos(angle), d * std::sin(angle)));
    const double along = std::pow(d * p.sigma_scale, 2);
    const double across = std::pow(d * 0.004, 2);
    const double noise = std::pow(p.noise_xy_m, 2) * d;
    assert_near(fusion.sigma_xy_m(), std::sqrt(0.02 * 0.02 + noise + 0.5 * (along + across)), 1e-14);
    const double turn = std::pow(d * p.sigma_turn_rad_per_m, 2) + std::pow(p.noise_yaw_rad, 2) * d;
    assert_near(fusion.sigma_yaw_rad(), std::sqrt(0.004 * 0.004 + turn), 1e-14);
  }
}

/// Where the rover only turns, yaw grows; where it stands, both do by what VO says.
void test_growth_on_the_spot(void**) {
  const FusionParams p;
  PoseFusion fusion;
  fusion.init(p, 0.02, 0.004);
  for (int i = 0; i < 90; ++i) fusion.propagate(step_of(0.0, 0.0, 0.01 * (i % 2 == 0 ? 1.0 : -1.0)));
  assert_near(fusion.sigma_xy_m(), 0.02, 1e-15);
  assert_near(fusion.sigma_yaw_rad(), std::sqrt(0.004 * 0.004 + 0.9 * p.noise_turn * p.noise_turn), 1e-14);
  fusion.init(p, 0.02, 0.004);
  PlanarStep standing;
  standing.covariance = diagonal(3e-5, 2e-5);
  for (int i = 0; i < 1000; ++i) fusion.propagate(standing);
  const double f = p.vo_sigma_factor;
  assert_near(fusion.sigma_xy_m(), std::sqrt(4e-4 + 1000 * f * f * 9e-10), 1e-12);
  assert_near(fusion.sigma_yaw_rad(), std::sqrt(16e-6 + 1000 * f * f * 4e-10), 1e-12);
}

// ---- what is refused ---------------------------------------------------------------------------------

void test_gate(void**) {
  const FusionParams params = without_common();
  const Mat3 R = diagonal(0.03, 0.01);
  const double s = std::sqrt(0.04 * 0.04 + 0.03 * 0.03);
  PoseFusion fusion;
  fusion.init(params, 0.04, 0.01);
  const double edge = s * std::sqrt(params.gate_chi2);
  FusionResult r = fuse(fusion, Vec3(0.0, 1.001 * edge, 0.0), R);
  assert_status(r.status, FusionStatus::kInconsistent);
  assert_near(r.chi2, 1.001 * 1.001 * params.gate_chi2, 1e-9);
  assert_near(fusion.sigma_xy_m(), 0.04, 1e-15);
  assert_near(fusion.scale(), 0.0, 0.0);
  r = fuse(fusion, Vec3(0.0, 0.999 * edge, 0.0), R);
  assert_status(r.status, FusionStatus::kFused);
  assert_at_least(r.at_snapshot.y_m, 0.5 * edge);
}

/// Good fixes are hardly ever refused, and of what the sigmas do not allow hardly any passes.
void test_gate_on_draws(void**) {
  generator = Random(17);
  const FusionParams params = without_common();
  int refused = 0;
  int passed = 0;
  for (int i = 0; i < 20000; ++i) {
    PoseFusion fusion;
    fusion.init(params, 0.05, 0.01);
    const Vec3 z(std::hypot(0.05, 0.03) * gauss(), std::hypot(0.05, 0.03) * gauss(),
                 std::hypot(0.01, 0.02) * gauss());
    if (fuse(fusion, z, diagonal(0.03, 0.02)).status != FusionStatus::kFused) ++refused;
    fusion.init(params, 0.05, 0.01);
    if (fuse(fusion, z + Vec3(0.6, 0.0, 0.0), diagonal(0.03, 0.02)).status == FusionStatus::kFused) ++passed;
  }
  assert_at_most(refused, 3);
  assert_at_most(passed, 3);
}

/// An offset between surprise and gate says that errors are larger than believed: more of it is taken.
void test_surprise(void**) {
  FusionParams params = without_common();
  const Mat3 R = diagonal(0.03, 0.01);
  const auto gain = [&](double chi2) {
    PoseFusion fusion;
    fusion.init(params, 0.03, 0.01);
    const double z = std::sqrt(chi2 * 2.0) * 0.03;
    return fuse(fusion, Vec3(z, 0.0, 0.0), R).at_snapshot.x_m / z;
  };
  assert_near(gain(1.0), 0.5, 1e-12);
  assert_near(gain(params.surprise_chi2 - 0.01), 0.5, 1e-12);
  const double wider = 20.0 / params.surprise_chi2;
  assert_near(gain(20.0), wider / (wider + 1.0), 1e-12);
  // What fixes have in common is the map's, and no larger for it.
  params.common_xy_m = 0.04;
  const double z2 = 20.0 * (2.0 * 0.03 * 0.03 + 0.04 * 0.04);
  PoseFusion fusion;
  fusion.init(params, 0.03, 0.01);
  const double own = wider * 0.03 * 0.03;
  assert_near(fuse(fusion, Vec3(std::sqrt(z2), 0.0, 0.0), R).at_snapshot.x_m,
              std::sqrt(z2) * own / (own + 0.03 * 0.03 + 0.04 * 0.04), 1e-12);
}

void test_bad_input(void**) {
  PoseFusion fusion;
  fusion.init({}, 0.05, 0.01);
  const Mat3 good = diagonal(0.03, 0.01);
  const auto refused = [&](const Vec3& z, const Mat3& R, double fresh) {
    assert_status(fuse(fusion, z, R, fresh).status, FusionStatus::kBadInput);
    if (fresh == 1.0) assert_status(fusion.relocate({z, R}).status, FusionStatus::kBadInput);
    assert_near(fusion.sigma_xy_m(), 0.05, 1e-15);
    assert_near(fusion.sigma_yaw_rad(), 0.01, 1e-15);
  };
  for (int i = 0; i < 3; ++i) {
    for (const double bad : {static_cast<double>(NAN), static_cast<double>(INFINITY)}) {
      Vec3 z(0.0, 0.0, 0.0);
      z[i] = bad;
      refused(z, good, 1.0);
      Mat3 R = good;
      R(i, (i + 1) % 3) = bad;
      refused(Vec3(0.0, 0.0, 0.0), R, 1.0);
    }
    Mat3 R = good;
    R(i, i) = -R(i, i);
    refused(Vec3(0.0, 0.0, 0.0), R, 1.0);
    R = good;
    R(i, i) = 0.0;
    refused(Vec3(0.0, 0.0, 0.0), R, 1.0);
    R = good;
    R(i, i) = 1e160;
    refused(Vec3(0.0, 0.0, 0.0), R, 1.0);
    R = good;
    R(i, (i + 1) % 3) = 1e-3;  // not symmetric
    refused(Vec3(0.0, 0.0, 0.0), R, 1.0);
  }
  for (const double fresh : {0.0, -1.0, 1.5, static_cast<double>(NAN)})
    refused(Vec3(0.0, 0.0, 0.0), good, fresh);
}

// ---- what fixes share --------------------------------------------------------------------------------

/// However many fixes a map gives, the pose in it is known no better than the map's own shift is.
void test_false_certainty(void**) {
  const FusionParams p;
  PoseFusion fusion;
  fusion.init(p, 1.0, 0.1);
  for (int i = 0; i < 100; ++i)
    assert_status(fuse(fusion, Vec3(0.0, 0.0, 0.0), diagonal(0.03, 0.01)).status, FusionStatus::kFused);
  assert_near(fusion.sigma_xy_m(), std::hypot(p.common_xy_m, 0.003), 2e-4);
  assert_near(fusion.sigma_yaw_rad(), std::hypot(p.common_yaw_rad, 0.001), 1e-4);
  // And a pose that was known better before is not pulled to the map's shift.
  fusion.init(p, 0.002, 0.0003);
  double pulled = 0.0;
  for (int i = 0; i < 100; ++i)
    pulled += fuse(fusion, Vec3(0.02 - pulled, 0.0, 0.0), diagonal(0.03, 0.01)).at_snapshot.x_m;
  assert_at_most(pulled, 0.001);
}

/// Half fresh: half as much worth.
void test_fresh_share(void**) {
  const FusionParams p = without_common();
  PoseFusion fusion;
  fusion.init(p, 0.03, 0.01);
  const double e = fuse(fusion, Vec3(0.03, 0.0, 0.0), diagonal(0.03, 0.01), 0.5).at_snapshot.x_m;
  assert_near(e, 0.01, 1e-12);
  assert_near(fusion.sigma_xy_m(), 0.03 * std::sqrt(2.0 / 3.0), 1e-12);
}

// ---- drives ------------------------------------------------------------------------------------------

/// A rover on an S-shaped drive, its VO off by `scale` and `turn`.
struct Drive {
  PoseFusion fusion;
  Pose2 truth;
  Pose2 estimate;
  Pose2 truth_at_snapshot;
  Pose2 estimate_at_snapshot;

  void step(double length, double turn, double vo_scale, double vo_turn, const Vec3& noise,
            const Mat3& covariance) {
    truth = truth * Pose2{length, 0.0, turn};
    // VO's step is too short by vo_scale, and lacks vo_turn a metre.
    Pose3 vo = lift({(length + noise[0]) / (1.0 + vo_scale), noise[1], 0.0});
    vo.q = lift({0.0, 0.0, turn - vo_turn * length + noise[2]}).q;
    const Pose2 before = estimate;
    estimate = estimate * planar(fusion.calibrated(vo));
    fusion.propagate({estimate.translation() - before.translation(), turn, covariance});
  }
  static Vec3 between(const Pose2& a, const Pose2& b) {
    return {a.x_m - b.x_m, a.y_m - b.y_m, wrap_angle(a.yaw_rad - b.yaw_rad)};
  }
  Vec3 error() const { return between(truth, estimate); }
  void snapshot() {
    fusion.snapshot();
    truth_at_snapshot = truth;
    estimate_at_snapshot = estimate;
  }
  FusionStatus fix(const Mat3& R, const Vec3& noise, double fresh = 1.0) {
    const FusionResult r =
        fusion.update({between(truth_at_snapshot, estimate_at_snapshot) + noise, R}, fresh);
    if (r.status == FusionStatus::kFused) correct(r);
    return r.status;
  }
  void correct(const FusionResult& r) {
    const Pose2& a = estimate_at_snapshot;
    const Pose2 about{-a.x_m, -a.y_m, 0.0};
    const Pose2 to{a.x_m + r.at_snapshot.x_m, a.y_m + r.at_snapshot.y_m, 0.0};
    estimate = to * Pose2{0.0, 0.0, r.at_snapshot.yaw_rad} * about * estimate;
    estimate = {estimate.x_m + r.since.x_m, estimate.y_m + r.since.y_m,
                wrap_angle(estimate.yaw_rad + r.since.yaw_rad)};
  }
};

const Vec3 kNoNoise(0.0, 0.0, 0.0);

/// A rig that is off by five sigmas: learnt all the same, and the pose never beyond what is claimed.
void test_errors_of_vo_are_learned(void**) {
  const double scale = 0.02;
  const double turn = 0.1 * kRadPerDeg;
  static Drive drive;
  drive = Drive();
  FusionParams params;
  params.common_xy_m = params.common_yaw_rad = 0.001;
  drive.fusion.init(params, 0.02, 0.004);
  generator = Random(11);
  const Mat3 R = diagonal(0.03, 0.01);
  double largest_late = 0.0;
  double farthest = 0.0;
  for (int i = 1; i <= 417; ++i) {
    drive.step(0.06, 0.02 * std::sin(0.03 * i), scale, turn, kNoNoise, Mat3::Zero());
    if (i % 30 == 24) drive.snapshot();
    if (i % 30 == 29)
      assert_status(drive.fix(R, Vec3(0.03 * gauss(), 0.03 * gauss(), 0.01 * gauss())), FusionStatus::kFused);
    const double off = std::hypot(drive.error()[0], drive.error()[1]);
    if (i > 200) largest_late = std::fmax(largest_late, off);
    farthest = std::fmax(farthest, off / drive.fusion.sigma_xy_m());
  }
  print_message(
      "25 m: scale %.4f of %.4f, turn %.5f of %.5f rad/m, end %.3f m, largest after 12 m %.3f m, %.1f sigmas\n",
      drive.fusion.scale(), scale, drive.fusion.turn_rad_per_m(), turn,
      std::hypot(drive.error()[0], drive.error()[1]), largest_late, farthest);
  assert_near(drive.fusion.scale(), scale, 0.012);
  assert_near(drive.fusion.turn_rad_per_m(), turn, 0.0012);
  assert_at_most(largest_late, 0.08);
  assert_at_most(farthest, 6.0);
}

/// What was learnt is used: a step is longer by k and turns by w a metre.
void test_rates_act_on_steps(void**) {
  PoseFusion fusion;
  fusion.init(without_common(), 0.02, 0.004);
  fusion.propagate(step_of(5.0, 0.0));
  assert_status(fuse(fusion, Vec3(0.03, 0.02, 0.005), diagonal(0.01, 0.002)).status, FusionStatus::kFused);
  assert_at_least(fusion.scale(), 1e-4);
  assert_at_least(fusion.turn_rad_per_m(), 1e-5);
  Pose3 step;
  step.t = Vec3(0.03, 0.04, 0.0);
  const Pose3 out = fusion.calibrated(step);
  assert_near((out.t - step.t * (1.0 + fusion.scale())).norm(), 0.0, 1e-15);
  assert_near(planar(out).yaw_rad, 0.05 * fusion.turn_rad_per_m(), 1e-12);
}

/// Good VO is hardly pulled: yaw stays VO's, whatever yaw of fixes scatters.
void test_good_vo_keeps_its_yaw(void**) {
  generator = Random(13);
  const Mat3 R = diagonal(0.03, 0.02);
  double squares = 0.0;
  int count = 0;
  for (int run = 0; run < 30; ++run) {
    static Drive drive;
    drive = Drive();
    drive.fusion.init({}, 0.02, 0.002);
    for (int i = 1; i <= 417; ++i) {
      drive.step(0.06, 0.02 * std::sin(0.03 * i), 0.0003, 0.0002, kNoNoise, diagonal(3e-5, 3e-5));
      if (i % 30 == 0) {
        drive.snapshot();
        assert_status(drive.fix(R, Vec3(0.03 * gauss(), 0.03 * gauss(), 0.02 * gauss()), i == 30 ? 1.0 : 0.5),
                      FusionStatus::kFused);
      }
      squares += drive.error()[2] * drive.error()[2];
      ++count;
    }
  }
  const double rms = std::sqrt(squares / count);
  print_message("yaw after fixes that scatter by 0.02 rad: %.5f rad rms\n", rms);
  assert_at_most(rms, 0.003);
}

/// Share of draws within ellipses that hold 50 and 95 %, and the mean of their squares over what
/// it should be.
struct Coverage {
  int in_50 = 0;
  int in_95 = 0;
  int count = 0;
  double squares = 0.0;

  void add(const Vec3& error, const Mat3& covariance) {
    const Mat2 P = covariance.topLeftCorner<2, 2>();
    const Vec2 e(error[0], error[1]);
    const double d2 = e.dot(P.inverse() * e);
    in_50 += d2 < 2.0 * std::log(2.0) ? 1 : 0;
    in_95 += d2 < 2.0 * std::log(20.0) ? 1 : 0;
    squares += d2 / 2.0;
    ++count;
  }
  double share_50() const { return static_cast<double>(in_50) / count; }
  double share_95() const { return static_cast<double>(in_95) / count; }
  void print(const char* what) const {
    print_message("%s: 50 %% %.3f, 95 %% %.3f, squares %.3f, of %d\n", what, share_50(), share_95(),
                  squares / count, count);
  }
};

/// Errors drawn as the filter believes them, fixes late and with errors in common: claimed is what comes.
void test_consistent_over_many_drives(void**) {
  const FusionParams params;
  generator = Random(29);
  const Mat3 R = diagonal(0.03, 0.01);
  const Mat3 of_vo = diagonal(1e-4, 1e-4);
  const double f = params.vo_sigma_factor;
  Coverage coverage;
  double yaw = 0.0;
  for (int run = 0; run < (test::kSanitized ? 30 : 1500); ++run) {
    static Drive drive;
    drive = Drive();
    drive.fusion.init(params, 0.03, 0.005);
    drive.truth = {0.03 * gauss(), 0.03 * gauss(), 0.005 * gauss()};
    const double scale = params.sigma_scale * gauss();
    const double turn = params.sigma_turn_rad_per_m * gauss();
    Vec3 common(params.common_xy_m * gauss(), params.common_xy_m * gauss(), params.common_yaw_rad * gauss());
    for (int i = 1; i <= 300; ++i) {
      const double length = 0.1;
      const double dyaw = 0.03 * std::sin(0.1 * i);
      const double xy = std::sqrt(length * params.noise_xy_m * params.noise_xy_m + f * f * 1e-8);
      const double heading = std::sqrt(length * params.noise_yaw_rad * params.noise_yaw_rad + f * f * 1e-8 +
                                       params.noise_turn * params.noise_turn * std::fabs(dyaw));
      drive.step(length, dyaw, scale, turn, Vec3(xy * gauss(), xy * gauss(), heading * gauss()), of_vo);
      const double kept = 1.0 / (1.0 + length / params.common_length_m);
      const double fresh = std::sqrt(1.0 - kept * kept);
      for (int c = 0; c < 3; ++c)
        common[c] = kept * common[c] + fresh * (c < 2 ? params.common_xy_m : params.common_yaw_rad) * gauss();
      static Vec3 of_snapshot;
      if (i % 20 == 14) {
        drive.snapshot();
        of_snapshot = common;
      }
      if (i % 20 == 19)
        assert_status(drive.fix(R, of_snapshot + Vec3(0.03 * gauss(), 0.03 * gauss(), 0.01 * gauss())),
                      FusionStatus::kFused);
      if (i % 10 != 0) continue;
      coverage.add(drive.error(), drive.fusion.covariance());
      yaw += drive.error()[2] * drive.error()[2] / std::pow(drive.fusion.sigma_yaw_rad(), 2);
    }
  }
  coverage.print("as modelled, each metre");
  print_message("yaw squares %.3f\n", yaw / coverage.count);
  if (test::kSanitized) return;
  assert_near(coverage.share_50(), 0.50, 0.01);
  assert_near(coverage.share_95(), 0.95, 0.005);
  assert_near(coverage.squares / coverage.count, 1.0, 0.03);
  assert_near(yaw / coverage.count, 1.0, 0.05);
}

/// Boulders themselves: each has its own error, which every fix that sees it repeats; windows of 60 frames
/// overlap by half; the map lies aside. Weighing the second window by its fresh half claims what comes.
void test_consistent_with_shared_boulders(void**) {
  const FusionParams params;
  generator = Random(31);
  constexpr double kPair = 0.06;
  Coverage coverage;
  for (int run = 0; run < (test::kSanitized ? 30 : 1000); ++run) {
    static Drive drive;
    drive = Drive();
    drive.fusion.init(params, 0.05, 0.01);
    drive.truth = {0.05 * gauss(), 0.05 * gauss(), 0.01 * gauss()};
    const double scale = params.sigma_scale * gauss();
    const double turn = params.sigma_turn_rad_per_m * gauss();
    const Vec2 shift(params.common_xy_m * gauss(), params.common_xy_m * gauss());
    constexpr int kBoulders = 8;  // of 30 frames
    static Vec2 places[2][kBoulders];
    static Vec2 errors[2][kBoulders];
    for (int i = 1; i <= 300; ++i) {
      const double dyaw = 0.01 * std::sin(0.03 * i);
      const double xy = std::sqrt(0.06) * params.noise_xy_m;
      const double heading = std::sqrt(0.06 * params.noise_yaw_rad * params.noise_yaw_rad +
                                       params.noise_turn * params.noise_turn * std::fabs(dyaw));
      drive.step(0.06, dyaw, scale, turn, Vec3(xy * gauss(), xy * gauss(), heading * gauss()), Mat3::Zero());
      if (i % 10 == 0) coverage.add(drive.error(), drive.fusion.covariance());
      if (i % 30 != 0) continue;
      for (int b = 0; b < kBoulders; ++b) {
        places[0][b] = places[1][b];
        errors[0][b] = errors[1][b];
        places[1][b] = drive.truth * Vec2(uniform(-0.5, 1.5), uniform(-1.2, 1.2));
        errors[1][b] = Vec2(kPair * gauss(), kPair * gauss());
      }
      // Least squares of the offset over the boulders in the window; the first has only its own.
      Mat3 J = Mat3::Zero();
      Vec3 pull(0.0, 0.0, 0.0);
      for (int half = i == 30 ? 1 : 0; half < 2; ++half) {
        for (int b = 0; b < kBoulders; ++b) {
          const Vec2 lever = places[half][b] - drive.truth.translation();
          const Vec2 seen = errors[half][b] + shift;
          Eigen::Matrix<double, 2, 3> A;
          A << 1.0, 0.0, -lever.y(), 0.0, 1.0, lever.x();
          J += A.transpose() * A / (kPair * kPair);
          pull += A.transpose() * seen / (kPair * kPair);
        }
      }
      const Mat3 R = J.inverse();
      drive.snapshot();
      assert_status(drive.fix(0.5 * (R + Mat3(R.transpose())), R * pull, i == 30 ? 1.0 : 0.5),
                    FusionStatus::kFused);
      coverage.add(drive.error(), drive.fusion.covariance());
    }
  }
  coverage.print("shared boulders");
  if (test::kSanitized) return;
  assert_near(coverage.share_50(), 0.50, 0.05);
  assert_near(coverage.share_95(), 0.95, 0.02);
}

// ---- frames that VO does not measure -----------------------------------------------------------------

/// Whatever the rover does within its bounds, for as long as it may: three sigmas hold it, and not
/// twenty times over.
void test_hidden_motion_is_within_three_sigmas(void**) {
  const FusionParams p;
  generator = Random(41);
  for (const int frames : {1, 9, 25, 100}) {
    for (int kind = 0; kind < 20; ++kind) {
      PoseFusion fusion;
      fusion.init(p, 0.001, 0.0005);
      Pose2 truth;
      const double length = 3.0 * p.unseen_step_m * (kind == 0 ? 1.0 : uniform(-1.0, 1.0));
      const double turn = 3.0 * p.unseen_step_rad * (kind == 0 ? 0.0 : uniform(-1.0, 1.0));
      for (int i = 0; i < frames; ++i) {
        truth = truth * Pose2{length, 0.0, turn};
        fusion.hold(1);
        assert_at_most(std::hypot(truth.x_m, truth.y_m), 3.0 * fusion.sigma_xy_m());
        assert_at_most(std::fabs(truth.yaw_rad), 3.0 * fusion.sigma_yaw_rad());
      }
      assert_at_most(fusion.sigma_xy_m(), frames * p.unseen_step_m + 0.001);
      assert_at_most(fusion.sigma_yaw_rad(), kPi);
    }
  }
  PoseFusion one;
  PoseFusion many;
  one.init(p, 0.01, 0.001);
  many.init(p, 0.01, 0.001);
  one.hold(7);
  for (int i = 0; i < 7; ++i) many.hold(1);
  assert_near(one.sigma_xy_m(), many.sigma_xy_m(), 1e-12);
}

/// A prior that slips by its share all the way, and whose heading drifts.
void test_coasting_on_priors(void**) {
  const FusionParams p;
  for (const double slip : {-3.0, 0.0, 3.0}) {
    for (const double drift : {-3.0, 3.0}) {
      PoseFusion fusion;
      fusion.init(p, 0.001, 0.0005);
      Pose2 truth;
      Pose2 estimate;
      for (int i = 0; i < 100; ++i) {
        const Pose2 prior{0.06, 0.0, 0.01};
        truth = truth * Pose2{0.06 * (1.0 + slip * p.prior_share), 0.0,
                              0.01 * (1.0 + slip * p.prior_share) + drift * p.prior_sigma_rad};
        estimate = estimate * prior;
        fusion.coast(lift(prior));
        const Vec3 e = Drive::between(truth, estimate);
        assert_at_most(std::hypot(e[0], e[1]), 3.0 * fusion.sigma_xy_m());
        assert_at_most(std::fabs(e[2]), 3.0 * fusion.sigma_yaw_rad());
      }
      assert_at_most(fusion.sigma_xy_m(), 3.0);
      assert_at_least(fusion.sigma_xy_m(), 0.6 * p.prior_share * 6.0);
    }
  }
}

void test_caught_up_and_given_up(void**) {
  const FusionParams p;
  PoseFusion fusion;
  fusion.init(p, 0.02, 0.004);
  fusion.hold(9);
  assert_near(fusion.sigma_xy_m(), std::hypot(0.02, 9.0 * p.unseen_step_m), 1e-12);
  fusion.caught_up();
  assert_near(fusion.sigma_xy_m(), 0.02, 1e-15);
  assert_near(fusion.sigma_yaw_rad(), 0.004, 1e-15);
  fusion.hold(3);
  fusion.give_up();
  fusion.hold(2);  // which add to those before
  assert_near(fusion.sigma_xy_m(), std::hypot(0.02, 5.0 * p.unseen_step_m), 1e-12);
  fusion.caught_up();  // only the last two
  assert_near(fusion.sigma_xy_m(), std::hypot(0.02, 3.0 * p.unseen_step_m), 1e-12);
  assert_near(fusion.sigma_yaw_rad(), std::hypot(0.004, 3.0 * p.unseen_step_rad), 1e-12);
  // And its turn acts on the way from here.
  fusion.propagate(step_of(1.0, 0.0));
  assert_at_least(fusion.covariance()(1, 1),
                  std::pow(3.0 * p.unseen_step_rad, 2) + std::pow(3.0 * p.unseen_step_m, 2));
  assert_at_least(fusion.covariance()(1, 2), std::pow(3.0 * p.unseen_step_rad, 2));
}

/// What VO and a prior differ by adds up as long as they do, and is noise once they agree again.
void test_doubts_add_up(void**) {
  PoseFusion fusion;
  fusion.init({}, 0.02, 0.004);
  PlanarStep doubtful;
  doubtful.sound = false;
  for (int i = 0; i < 10; ++i) {
    fusion.doubt(0.03, 0.01);
    fusion.propagate(doubtful);
  }
  assert_near(fusion.sigma_xy_m(), std::hypot(0.02, 0.30), 1e-12);
  assert_near(fusion.sigma_yaw_rad(), std::hypot(0.004, 0.10), 1e-12);
  fusion.propagate(PlanarStep());
  fusion.doubt(0.03, 0.01);
  fusion.propagate(doubtful);
  assert_near(fusion.sigma_xy_m(), std::sqrt(0.02 * 0.02 + 0.30 * 0.30 + 0.03 * 0.03), 1e-12);
  fusion.caught_up();
  assert_near(fusion.sigma_xy_m(), std::sqrt(0.02 * 0.02 + 0.30 * 0.30 + 0.03 * 0.03), 1e-12);
}

/// A heading about which nothing is known is not known less by another gap, nor does a drive from there
/// claim errors that no circle allows many times over.
void test_a_heading_is_lost_once(void**) {
  const FusionParams p;
  PoseFusion fusion;
  fusion.init(p, 0.02, 0.004);
  for (int gap = 0; gap < 5; ++gap) {
    fusion.hold(100);
    fusion.give_up();
  }
  assert_near(fusion.sigma_yaw_rad(), 1.8, 1e-4);
  const double xy = fusion.sigma_xy_m();
  fusion.propagate(step_of(10.0, 0.0));
  assert_at_most(std::sqrt(fusion.covariance()(1, 1)), std::hypot(xy, 1.9 * 10.0));
}

/// A fix of a frame that was held speaks of the reference before it, and what is hidden stays on top; one
/// before the gap is carried over it.
void test_fixes_about_hidden_frames(void**) {
  const FusionParams p = without_common();
  PoseFusion fusion;
  fusion.init(p, 0.10, 0.01);
  fusion.hold(4);
  assert_near(fusion.covariance_at_snapshot()(0, 0), 0.01, 1e-12);
  assert_status(fuse(fusion, Vec3(1.0, 0.0, 0.0), diagonal(0.01, 0.01)).status, FusionStatus::kInconsistent);
  assert_status(fuse(fusion, Vec3(0.1, 0.0, 0.0), diagonal(0.01, 0.01)).status, FusionStatus::kFused);
  assert_at_least(fusion.sigma_xy_m(), 4.0 * p.unseen_step_m);
  fusion.caught_up();
  assert_at_most(fusion.sigma_xy_m(), 0.02);
  fusion.init(p, 0.10, 0.01);
  fusion.snapshot();
  fusion.hold(4);
  fusion.give_up();
  fusion.propagate(step_of(0.06, 0.0));
  assert_status(fusion.update({Vec3(0.0, 0.0, 0.0), diagonal(0.01, 0.01)}, 1.0).status, FusionStatus::kFused);
  assert_at_least(fusion.sigma_xy_m(), 4.0 * p.unseen_step_m);
  assert_at_most(fusion.sigma_xy_m(), 4.0 * p.unseen_step_m + 0.02);
}

// ---- rates, and a pose found anew --------------------------------------------------------------------

void learn(PoseFusion& fusion, double scale, int fixes) {
  for (int i = 0; i < fixes; ++i) {
    fusion.propagate(step_of(5.0, 0.0));
    const double off = 5.0 * (scale - fusion.scale());
    static_cast<void>(fuse(fusion, Vec3(off, 0.0, 0.0), diagonal(0.005, 0.001)));
  }
}

void test_rates_are_bounded(void**) {
  FusionParams p = without_common();
  p.gate_chi2 = 1e9;
  PoseFusion fusion;
  for (const double sign : {-1.0, 1.0}) {
    fusion.init(p, 0.02, 0.004);
    for (int i = 0; i < 20; ++i) {
      fusion.propagate(step_of(5.0, 0.0));
      static_cast<void>(fuse(fusion, sign * Vec3(2.0, 0.0, 0.2), diagonal(0.01, 0.001)));
      assert_at_most(std::fabs(fusion.scale()), p.max_scale);
      assert_at_most(std::fabs(fusion.turn_rad_per_m()), p.max_turn_rad_per_m);
    }
    assert_near(fusion.scale(), sign * p.max_scale, 1e-12);
    assert_near(fusion.turn_rad_per_m(), sign * p.max_turn_rad_per_m, 1e-12);
  }
}

/// Found anew: the pose is as good as the fix, whatever it was before, less what fixes told of the map's own
/// error; what the last fix taught of VO is forgotten.
void test_relocation(void**) {
  const FusionParams p;
  PoseFusion fusion;
  fusion.init(p, 0.02, 0.004);
  learn(fusion, 0.004, 6);
  const double before = fusion.scale();
  assert_near(before, 0.004, 0.001);
  fusion.propagate(step_of(1.0, 0.0));
  assert_status(fuse(fusion, Vec3(0.05, 0.0, 0.0), diagonal(0.01, 0.002)).status, FusionStatus::kFused);
  assert_at_least(std::fabs(fusion.scale() - before), 1e-5);
  assert_status(fuse(fusion, Vec3(40.0, -7.0, 2.5), diagonal(0.03, 0.01)).status,
                FusionStatus::kInconsistent);
  fusion.hold(50);
  fusion.give_up();
  fusion.snapshot();
  const FusionResult r = fusion.relocate({Vec3(40.0, -7.0, 2.5), diagonal(0.03, 0.01)});
  assert_status(r.status, FusionStatus::kFused);
  assert_near(r.at_snapshot.x_m, 40.0, 2.0 * p.common_xy_m);
  assert_near(r.at_snapshot.y_m, -7.0, 1e-6);
  assert_near(r.at_snapshot.yaw_rad, 2.5, p.common_yaw_rad);
  assert_near(fusion.scale(), before, 1e-15);
  assert_near(fusion.sigma_xy_m(), std::hypot(0.03, p.common_xy_m), 0.002);
  assert_near(fusion.sigma_yaw_rad(), std::hypot(0.01, p.common_yaw_rad), 0.001);
  // And the rates are open again.
  const double yaw = fusion.sigma_yaw_rad();
  fusion.propagate(step_of(10.0, 0.0));
  assert_near(fusion.covariance()(0, 0),
              std::pow(0.03, 2) + std::pow(p.common_xy_m, 2) + std::pow(10.0 * p.sigma_scale, 2), 3e-4);
  assert_at_least(fusion.sigma_yaw_rad(), std::hypot(yaw, 10.0 * p.sigma_turn_rad_per_m));
}

/// Nothing is known of a lost pose: sigma holds it wherever it may be, and at any heading, as of a start that
/// is unknown, and goes on to, while a heading tells what it can. What finds it is worth as much as had it
/// never been lost.
void test_a_lost_pose_may_be_anywhere(void**) {
  const FusionParams p;
  PoseFusion known;
  PoseFusion lost;
  for (PoseFusion* fusion : {&known, &lost}) {
    fusion->init(p, 0.02, 0.004);
    learn(*fusion, 0.004, 6);
  }
  lost.lose();
  const double k = known.scale();
  assert_near(lost.scale(), k, 0.0);
  for (int i = 0; i < 3; ++i) {
    assert_at_least(lost.sigma_xy_m(), 1.0e4);
    assert_near(lost.sigma_yaw_rad(), 1.8, 1e-12);
    for (PoseFusion* fusion : {&known, &lost}) fusion->propagate(step_of(2.0, 0.3));
  }
  PoseFusion turned = lost;
  assert_status(turned.heading(2.5, 1e-4).status, FusionStatus::kFused);
  assert_near(turned.sigma_yaw_rad(), 0.01, 1e-4);
  assert_at_least(turned.sigma_xy_m(), 1.0e4);
  for (PoseFusion* fusion : {&known, &lost}) {
    fusion->snapshot();
    assert_status(fusion->relocate({Vec3(40.0, -7.0, 2.5), diagonal(0.03, 0.01)}).status,
                  FusionStatus::kFused);
  }
  assert_near((known.covariance() - lost.covariance()).norm(), 0.0, 1e-9);
  assert_near(known.scale(), lost.scale(), 0.0);
}

/// Whatever the start claimed and however far off it was: what the first fix leaves is within the sigmas that
/// the claim had to agree in, about where the fix is; and it counted twice as much at most.
void test_a_false_claim_stays_within_its_sigmas(void**) {
  const FusionParams params;
  int counted = 0, alone = 0;
  generator = Random(9);
  for (int n = 0; n < 2000; ++n) {
    const double claim = 0.01 * std::exp(uniform(0.0, 3.5));
    const double claim_rad = 0.2 * claim;
    const double fix = 0.01 * std::exp(uniform(0.0, 3.0));
    const double off = 0.01 * std::exp(uniform(0.0, 5.0));
    const Vec3 z(off, uniform(-1.0, 1.0) * off, uniform(-0.1, 0.1) * off);
    PoseFusion fusion;
    fusion.init(params, claim, claim_rad);
    fusion.snapshot();
    const FusionResult r = fusion.prove({z, diagonal(fix, 0.2 * fix)});
    assert_status(r.status, FusionStatus::kFused);
    const Vec3 left = Vec3(r.at_snapshot.x_m, r.at_snapshot.y_m, r.at_snapshot.yaw_rad) - z;
    const Mat3 P = fusion.covariance();
    assert_at_most(left.dot(Vec3(P.inverse() * left)), 2.0 * params.claim_chi2);
    const double own = fix * fix + params.common_xy_m * params.common_xy_m;
    assert_at_least(P(0, 0), 0.333 * own);
    counted += P(0, 0) < 0.99 * own;
    alone += P(0, 0) > 0.99 * own;
  }
  assert_at_least(counted, 200);
  assert_at_least(alone, 200);
}

/// What a start was off is no fault of odometry's: however far the rover has driven to the first fix, that
/// one teaches no rates, and the next ones teach those that are.
void test_a_false_claim_teaches_no_rates(void**) {
  const Mat3 R = diagonal(0.02, 0.002);
  for (const double off : {0.0, 0.1, 0.2, 0.3}) {
    PoseFusion fusion;
    fusion.init({}, 0.05, 0.01);
    for (int fix = 0; fix < 2; ++fix) {
      for (int n = 0; n < 20; ++n) fusion.propagate(step_of(0.3, 0.0));  // as they really were
      fusion.snapshot();
      const FusionResult r = fix == 0 ? fusion.prove({Vec3(off, 0.5 * off, 0.0), R})
                                      : fusion.update({Vec3(0.0, 0.0, 0.0), R}, 1.0);
      assert_status(r.status, FusionStatus::kFused);
      if (fix == 0) assert_near(fusion.scale(), 0.0, 0.0);
      if (fix == 0) assert_near(fusion.turn_rad_per_m(), 0.0, 0.0);
    }
    assert_near(fusion.scale(), 0.0, 0.001);
  }
}

/// A claim that agrees is a measurement like any other. Whether it does or not, rates stay as headings taught
/// them before the first fix.
void test_a_claim_that_agrees_counts(void**) {
  const Mat3 R = diagonal(0.01, 0.0005);
  for (const double off : {0.05, 1.5}) {
    PoseFusion proved;
    proved.init(without_common(), 0.05, 0.01);
    for (int n = 0; n < 40; ++n) {
      proved.propagate(step_of(0.5, 0.0));
      assert_status(proved.heading(0.0008, 1e-5).status, FusionStatus::kFused);
    }
    const double turn = proved.turn_rad_per_m();
    assert_at_least(std::fabs(turn), 1e-5);
    proved.snapshot();
    PoseFusion fused = proved;
    const FusionResult a = proved.prove({Vec3(off, 0.0, 0.0), R});
    const FusionResult b = fused.update({Vec3(off, 0.0, 0.0), R}, 1.0);
    assert_status(a.status, FusionStatus::kFused);
    const bool agrees = b.status == FusionStatus::kFused && b.chi2 <= FusionParams().claim_chi2;
    assert_int_equal(agrees, off < 0.1);
    if (agrees) {
      assert_near(a.at_snapshot.x_m, b.at_snapshot.x_m, 1e-12);
      assert_near((proved.covariance() - fused.covariance()).norm(), 0.0, 1e-12);
    } else {
      assert_near(a.at_snapshot.x_m, off, 1e-6);
    }
    assert_near(proved.turn_rad_per_m(), turn, 0.0);
  }
  PoseFusion fusion;
  fusion.init({}, 0.05, 0.01);
  assert_status(fusion.prove({Vec3(0.0, 0.0, 0.0), Mat3::Zero()}).status, FusionStatus::kBadInput);
  assert_near(fusion.sigma_xy_m(), 0.05, 1e-12);
}

/// A claim of nothing at all to be wrong counts for half of what the fix says, its part in the map's own
/// error included: a third of the correction is taken back, and the variance is a third of the fix's.
void test_the_most_that_a_claim_counts(void**) {
  const FusionParams p;
  const Mat3 R = diagonal(0.03, 0.01);
  PoseFusion fusion;
  fusion.init(p, 1e-6, 1e-6);
  fusion.snapshot();
  const Vec3 z(0.02, -0.01, 0.002);
  const FusionResult r = fusion.prove({z, R});
  assert_status(r.status, FusionStatus::kFused);
  assert_near(r.at_snapshot.x_m, z[0] / 3.0, 1e-9);
  assert_near(r.at_snapshot.y_m, z[1] / 3.0, 1e-9);
  assert_near(r.at_snapshot.yaw_rad, z[2] / 3.0, 1e-9);
  const double n_xy = 0.03 * 0.03 + p.common_xy_m * p.common_xy_m;
  const double n_yaw = 0.01 * 0.01 + p.common_yaw_rad * p.common_yaw_rad;
  assert_near(fusion.covariance()(0, 0), n_xy / 3.0, 1e-9);
  assert_near(fusion.covariance()(2, 2), n_yaw / 3.0, 1e-9);
}

/// Way on motion priors, be they exact, goes aside by as much as the heading was not known.
void test_coasting_on_an_uncertain_heading(void**) {
  FusionParams p;
  p.prior_share = p.prior_sigma_rad = 0.0;
  for (const double off : {-2.9, 2.9}) {
    PoseFusion fusion;
    fusion.init(p, 0.001, 0.1);
    for (int i = 1; i <= 100; ++i) {
      fusion.coast(lift({0.06, 0.0, 0.0}));
      const double way = 0.06 * i;
      const double aside = 2.0 * way * std::sin(std::fabs(0.1 * off) / 2.0);
      assert_at_most(aside, 3.0 * fusion.sigma_xy_m());
    }
  }
}

/// What fixes have told of the map's own error is not forgotten with the pose: it is the map's.
void test_a_lost_pose_keeps_the_map(void**) {
  const FusionParams p;
  PoseFusion fusion;
  fusion.init(p, 1e-4, 1e-5);
  for (int i = 0; i < 20; ++i)
    assert_status(fuse(fusion, Vec3(0.0, 0.0, 0.0), diagonal(0.005, 0.001)).status, FusionStatus::kFused);
  fusion.lose();
  fusion.snapshot();
  assert_status(fusion.relocate({Vec3(3.0, 0.0, 0.0), diagonal(0.005, 0.001)}).status, FusionStatus::kFused);
  assert_near(fusion.sigma_xy_m(), 0.005, 0.0005);
  assert_near(fusion.sigma_yaw_rad(), 0.001, 0.0001);
}

/// What fixes have in common is one error, not a surprise at each of them: a pose that was known well holds
/// against a map that lies aside, however often it says so, and the map's shift is taken from what it says
/// when the pose is known no longer. It fades with the way, and another map has its own.
void test_the_maps_shift_is_remembered(void**) {
  const FusionParams p;
  const Mat3 R = diagonal(0.005, 0.001);
  const Vec3 aside(0.04, 0.0, 0.0);
  const auto taught = [&] {
    PoseFusion fusion;
    fusion.init(p, 1e-3, 1e-4);
    assert_at_least(fuse(fusion, aside, R).chi2, 2.0);
    for (int i = 0; i < 20; ++i) assert_at_most(fuse(fusion, aside, R).chi2, 0.3);
    return fusion;
  };
  const auto found_at = [&](PoseFusion& fusion) {
    fusion.lose();
    fusion.snapshot();
    return fusion.relocate({Vec3(7.0, 0.0, 0.0) + aside, R}).at_snapshot.x_m;
  };
  PoseFusion here = taught();
  assert_near(found_at(here), 7.0, 0.003);
  PoseFusion far = taught();
  for (int i = 0; i < 5000; ++i) far.propagate(step_of(0.1, 0.0));
  assert_near(found_at(far), 7.04, 0.001);
  PoseFusion other = taught();
  other.other_map(p.common_xy_m);
  assert_near(found_at(other), 7.04, 1e-6);
}

/// What was hidden before a fix adds nothing to what is hidden after it.
void test_a_fix_ends_a_run(void**) {
  const FusionParams p;
  PoseFusion fusion;
  fusion.init(p, 0.05, 0.01);
  fusion.doubt(1.0, 0.2);
  assert_status(fuse(fusion, Vec3(0.5, 0.0, 0.0), diagonal(0.02, 0.004)).status, FusionStatus::kFused);
  const double before = fusion.covariance()(0, 0);
  fusion.hold(1);
  assert_near(fusion.covariance()(0, 0) - before, p.unseen_step_m * p.unseen_step_m, 1e-12);
}

/// The steps since the snapshot are on top.
void test_late_relocation(void**) {
  const FusionParams p;
  PoseFusion fusion;
  fusion.init(p, 5.0, 1.0);
  fusion.snapshot();
  for (int i = 0; i < 100; ++i) fusion.propagate(step_of(0.1, 0.0));
  assert_status(fusion.relocate({Vec3(3.0, 0.0, 0.0), diagonal(0.03, 0.02)}).status, FusionStatus::kFused);
  assert_near(fusion.covariance()(1, 1),
              std::pow(0.03, 2) + std::pow(p.common_xy_m, 2) +
                  100.0 * (std::pow(0.02, 2) + std::pow(p.common_yaw_rad, 2)),
              0.01);
}

// A map that lies aside: the fix of another map is not believed beyond that map's own error, and what the
// fixes before had in common tells nothing of it.
void test_another_map_has_its_own_error(void**) {
  FixOffset fix;
  fix.offset = Vec3(0.10, 0.0, 0.0);
  fix.covariance = Vec3(1.0e-4, 1.0e-4, 1.0e-6).asDiagonal();
  FusionParams params;
  PoseFusion fine;
  fine.init(params, 0.05, 0.01);
  fine.snapshot();
  const double believed = fine.update(fix, 1.0).at_snapshot.x_m;
  PoseFusion coarse;
  coarse.init(params, 0.05, 0.01);
  coarse.other_map(0.10);
  coarse.snapshot();
  const double doubted = coarse.update(fix, 1.0).at_snapshot.x_m;
  assert_at_least(believed, 0.07);
  assert_at_most(doubted, 0.03);
  assert_at_least(doubted, 0.01);
  // A hundred of them are one: sigma stays above what the map's own error leaves.
  for (int k = 0; k < 100; ++k) {
    coarse.snapshot();
    fix.offset = Vec3(0.0, 0.0, 0.0);
    (void)coarse.update(fix, 1.0);
  }
  const double stuck = coarse.sigma_xy_m();
  assert_at_least(stuck, 0.04);
  coarse.other_map(0.02);
  coarse.snapshot();
  (void)coarse.update(fix, 1.0);
  assert_at_most(coarse.sigma_xy_m(), 0.5 * stuck);
}

// 20 m by rates that nobody knows, then a fix of landmarks that were seen `kFar_m` before: it tells the pose
// of then, carried to now by the wrong rates.
void test_a_local_map_is_bent_by_unknown_rates(void**) {
  constexpr double kWay_m = 20.0;
  constexpr double kFar_m = 12.0;
  constexpr int kDraws = 400;
  const Mat3 R = diagonal(0.05, 0.005);
  const auto by_rates = [](double k, double w, double way) {
    return Vec3(k * way, 0.5 * w * way * way, w * way);
  };
  double with = 0.0;
  double without = 0.0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const FusionParams p = without_common();
    const Vec3 noise(0.05 * gauss(), 0.05 * gauss(), 0.005 * gauss());
    const double k = p.sigma_scale * gauss();
    const double w = p.sigma_turn_rad_per_m * gauss();
    const Vec3 truth = by_rates(k, w, kWay_m);
    const Vec3 told = truth - by_rates(k, w, kFar_m) + noise;
    for (const bool bent : {true, false}) {
      PoseFusion fusion;
      fusion.init(p, 0.02, 0.002);
      for (int i = 0; i < 20; ++i) fusion.propagate(step_of(1.0, 0.0));
      fusion.snapshot();
      const Mat3 bend = bent ? fusion.bend(kFar_m) : Mat3(Mat3::Zero());
      const FusionResult r = fusion.update({told, R + bend}, 1.0);
      assert_status(r.status, FusionStatus::kFused);
      const Vec3 left = truth - Vec3(r.at_snapshot.x_m, r.at_snapshot.y_m, r.at_snapshot.yaw_rad);
      (bent ? with : without) += left.dot(fusion.covariance().inverse() * left) / kDraws;
    }
  }
  assert_at_most(with, 4.0);  // three degrees of freedom
  assert_at_least(without, 8.0);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_against_the_textbook_filter),
      cmocka_unit_test(test_a_heading),
      cmocka_unit_test(test_late_fix_moves_the_present_pose),
      cmocka_unit_test(test_covariance_of_a_step),
      cmocka_unit_test(test_without_fixes),
      cmocka_unit_test(test_growth),
      cmocka_unit_test(test_growth_on_the_spot),
      cmocka_unit_test(test_gate),
      cmocka_unit_test(test_gate_on_draws),
      cmocka_unit_test(test_surprise),
      cmocka_unit_test(test_bad_input),
      cmocka_unit_test(test_false_certainty),
      cmocka_unit_test(test_fresh_share),
      cmocka_unit_test(test_errors_of_vo_are_learned),
      cmocka_unit_test(test_rates_act_on_steps),
      cmocka_unit_test(test_good_vo_keeps_its_yaw),
      cmocka_unit_test(test_consistent_over_many_drives),
      cmocka_unit_test(test_consistent_with_shared_boulders),
      cmocka_unit_test(test_hidden_motion_is_within_three_sigmas),
      cmocka_unit_test(test_coasting_on_priors),
      cmocka_unit_test(test_caught_up_and_given_up),
      cmocka_unit_test(test_doubts_add_up),
      cmocka_unit_test(test_a_heading_is_lost_once),
      cmocka_unit_test(test_fixes_about_hidden_frames),
      cmocka_unit_test(test_rates_are_bounded),
      cmocka_unit_test(test_relocation),
      cmocka_unit_test(test_a_lost_pose_may_be_anywhere),
      cmocka_unit_test(test_a_false_claim_stays_within_its_sigmas),
      cmocka_unit_test(test_a_false_claim_teaches_no_rates),
      cmocka_unit_test(test_a_claim_that_agrees_counts),
      cmocka_unit_test(test_the_maps_shift_is_remembered),
      cmocka_unit_test(test_the_most_that_a_claim_counts),
      cmocka_unit_test(test_coasting_on_an_uncertain_heading),
      cmocka_unit_test(test_a_lost_pose_keeps_the_map),
      cmocka_unit_test(test_a_fix_ends_a_run),
      cmocka_unit_test(test_late_relocation),
      cmocka_unit_test(test_another_map_has_its_own_error),
      cmocka_unit_test(test_a_local_map_is_bent_by_unknown_rates),
  };
  return cmocka_run_group_tests_name("localizer/pose_fusion", tests, nullptr, nullptr);
}
