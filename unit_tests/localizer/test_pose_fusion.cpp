// Fusion of fixes with VO: against a Kalman filter in covariance form, and on drives whose truth is known.
#include "localizer/pose_fusion.hpp"

#include <cmath>

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

using Vec5 = Eigen::Matrix<double, 5, 1>;
using Mat5 = Eigen::Matrix<double, 5, 5>;
using Mat35 = Eigen::Matrix<double, 3, 5>;

Random generator(1);

double gauss() {
  double sum = -6.0;
  for (int i = 0; i < 12; ++i) sum += generator.next() / 4294967296.0;
  return sum;
}

FusionParams without_floors() {
  FusionParams p;
  p.floor_xy_m = p.floor_yaw_rad = 0.0;
  return p;
}

/// What a registration gives for the measurement z with noise R, under the prior:
/// the posterior mean and covariance.
struct Registration {
  Pose2 correction;
  Mat3 covariance;
};

Registration registration(const Vec3& z, const Mat3& R, double sigma_xy, double sigma_yaw) {
  Mat3 J0 = Mat3::Zero();
  J0(0, 0) = J0(1, 1) = 1.0 / (sigma_xy * sigma_xy);
  J0(2, 2) = 1.0 / (sigma_yaw * sigma_yaw);
  const Mat3 own = R.inverse();
  Registration r;
  r.covariance = (own + J0).inverse();
  const Vec3 c = r.covariance * (own * z);
  r.correction = {c[0], c[1], c[2]};
  return r;
}

Pose2 update(PoseFusion& fusion, const Vec3& z, const Mat3& R) {
  const double xy = fusion.sigma_xy_m();
  const double yaw = fusion.sigma_yaw_rad();
  const Registration r = registration(z, R, xy, yaw);
  return fusion.update(r.correction, r.covariance, xy, yaw);
}

/// The textbook filter, in covariance form, on the same error state.
struct Oracle {
  Mat5 P = Mat5::Zero();
  double k = 0.0;
  double w = 0.0;

  void step(const FusionParams& p, double dx, double dy) {
    const double ds = std::hypot(dx, dy);
    Mat5 F = Mat5::Identity();
    F.row(0) << 1, 0, -dy, dx, 0;
    F.row(1) << 0, 1, dx, dy, 0;
    F.row(2) << 0, 0, 1, 0, ds;
    Vec5 q;
    q << p.noise_xy_m, p.noise_xy_m, p.noise_yaw_rad, p.scale_walk, p.turn_walk_rad_per_m;
    const Mat5 Q = (q.cwiseProduct(q) * ds).asDiagonal();
    P = Mat5(F * P * F.transpose()) + Q;
  }
  Vec5 fix(const Vec3& z, const Mat3& R) {
    Mat35 H = Mat35::Zero();
    H(0, 0) = H(1, 1) = H(2, 2) = 1.0;
    const Mat3 S = H * P * H.transpose() + R;
    const Eigen::Matrix<double, 5, 3> K = P * H.transpose() * S.inverse();
    P = Mat5((Mat5::Identity() - K * H) * P);
    const Vec5 e = K * z;
    k += e[3];
    w += e[4];
    return e;
  }
};

void test_against_covariance_form(void**) {
  const FusionParams params = without_floors();
  static PoseFusion fusion;
  static Oracle oracle;
  fusion.init(params, 0.05, 0.01);
  oracle = Oracle();
  oracle.P.diagonal() << 0.05 * 0.05, 0.05 * 0.05, 0.01 * 0.01, params.sigma_scale * params.sigma_scale,
      params.sigma_turn_rad_per_m * params.sigma_turn_rad_per_m;
  generator = Random(3);
  for (int fix = 0; fix < 40; ++fix) {
    for (int i = 0; i < 30; ++i) {
      const double heading = 0.1 * fix + 0.01 * i;
      const double length = 0.06 + 0.02 * gauss();
      fusion.propagate(Vec2(length * std::cos(heading), length * std::sin(heading)));
      oracle.step(params, length * std::cos(heading), length * std::sin(heading));
    }
    assert_near(fusion.sigma_xy_m(), std::sqrt(0.5 * (oracle.P(0, 0) + oracle.P(1, 1))), 1e-10);
    assert_near(fusion.sigma_yaw_rad(), std::sqrt(oracle.P(2, 2)), 1e-11);
    Mat3 A;
    for (int i = 0; i < 9; ++i) A(i / 3, i % 3) = 0.02 * gauss();
    const Mat3 R = A * A.transpose() + Mat3::Identity() * 1e-4;
    const Vec3 z(0.1 * gauss(), 0.1 * gauss(), 0.01 * gauss());
    const Pose2 got = update(fusion, z, R);
    const Vec5 want = oracle.fix(z, R / params.information_share);
    assert_near(got.x_m, want[0], 1e-9);
    assert_near(got.y_m, want[1], 1e-9);
    assert_near(got.yaw_rad, want[2], 1e-9);
    assert_near(fusion.scale(), oracle.k, 1e-9);
    assert_near(fusion.turn_rad_per_m(), oracle.w, 1e-10);
  }
}

void test_without_fixes(void**) {
  PoseFusion fusion;
  const FusionParams params;
  fusion.init(params, 0.05, 0.01);
  assert_near(fusion.sigma_xy_m(), 0.05, 1e-15);
  assert_near(fusion.sigma_yaw_rad(), 0.01, 1e-15);
  for (int i = 0; i < 100; ++i) {
    fusion.propagate(Vec2(0.1, 0.0));
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
    fusion.propagate(Vec2(d * std::cos(angle), d * std::sin(angle)));
    const double along = std::pow(d * p.sigma_scale, 2);
    const double across = std::pow(d * 0.004, 2);
    const double noise = std::pow(p.noise_xy_m, 2) * d;
    assert_near(fusion.sigma_xy_m(), std::sqrt(0.02 * 0.02 + noise + 0.5 * (along + across)), 1e-14);
    const double turn = std::pow(d * p.sigma_turn_rad_per_m, 2) + std::pow(p.noise_yaw_rad, 2) * d;
    assert_near(fusion.sigma_yaw_rad(), std::sqrt(0.004 * 0.004 + turn), 1e-14);
    const double before = fusion.sigma_xy_m();
    fusion.propagate(Vec2(0.0, 0.0));
    assert_near(fusion.sigma_xy_m(), before, 0.0);
  }
}

/// What came out of the prior alone (covariance J_0^-1, no correction) tells nothing.
void test_no_information_changes_nothing(void**) {
  PoseFusion fusion;
  fusion.init(FusionParams(), 0.05, 0.01);
  fusion.propagate(Vec2(2.0, 1.0));
  const double xy = fusion.sigma_xy_m();
  const double yaw = fusion.sigma_yaw_rad();
  const Mat3 prior = Vec3(xy * xy, xy * xy, yaw * yaw).asDiagonal();
  const Pose2 e = fusion.update({}, prior, xy, yaw);
  assert_near(std::hypot(e.x_m, e.y_m) + std::fabs(e.yaw_rad), 0.0, 0.0);
  assert_near(fusion.sigma_xy_m(), xy, 1e-9);
  assert_near(fusion.sigma_yaw_rad(), yaw, 1e-9);
  assert_near(fusion.scale(), 0.0, 0.0);
}

void test_floors(void**) {
  const FusionParams params;
  PoseFusion fusion;
  fusion.init(params, 0.05, 0.01);
  const Mat3 R = Vec3(1e-8, 1e-8, 1e-8).asDiagonal();
  for (int i = 0; i < 20; ++i) static_cast<void>(update(fusion, Vec3(0.0, 0.0, 0.0), R));
  assert_near(fusion.sigma_xy_m(), params.floor_xy_m, 1e-12);
  assert_near(fusion.sigma_yaw_rad(), params.floor_yaw_rad, 1e-12);
}

/// A rover on an S-shaped drive, its VO off by `scale` and `turn`, with fixes every 1.8 m.
struct Drive {
  PoseFusion fusion;
  Pose2 truth;
  Pose2 estimate;

  void step(double length, double turn, double vo_scale, double vo_turn, const Vec3& noise) {
    truth = truth * Pose2{length, 0.0, turn};
    // VO's step is too short by vo_scale, and lacks vo_turn a metre.
    Pose3 vo = lift({(length + noise[0]) / (1.0 + vo_scale), noise[1], 0.0});
    vo.q = lift({0.0, 0.0, turn - vo_turn * length + noise[2]}).q;
    const Pose2 before = estimate;
    estimate = estimate * planar(fusion.calibrated(vo));
    fusion.propagate(estimate.translation() - before.translation());
  }
  Vec3 error() const {
    return {truth.x_m - estimate.x_m, truth.y_m - estimate.y_m, wrap_angle(truth.yaw_rad - estimate.yaw_rad)};
  }
  void fix(const Mat3& R, const Vec3& noise) {
    const Pose2 e = update(fusion, error() + noise, R);
    estimate = {estimate.x_m + e.x_m, estimate.y_m + e.y_m, wrap_angle(estimate.yaw_rad + e.yaw_rad)};
  }
};

void test_errors_of_vo_are_learned(void**) {
  const double scale = 0.02;
  const double turn = 0.1 * kRadPerDeg;
  static Drive drive;
  drive = Drive();
  drive.fusion.init(FusionParams(), 0.02, 0.004);
  generator = Random(11);
  const Mat3 R = Vec3(0.03 * 0.03, 0.03 * 0.03, 0.01 * 0.01).asDiagonal();
  double largest_late = 0.0;
  for (int i = 1; i <= 417; ++i) {
    drive.step(0.06, 0.02 * std::sin(0.03 * i), scale, turn, Vec3(0.0, 0.0, 0.0));
    if (i % 30 == 0) drive.fix(R, Vec3(0.03 * gauss(), 0.03 * gauss(), 0.01 * gauss()));
    if (i > 200) largest_late = std::fmax(largest_late, std::hypot(drive.error()[0], drive.error()[1]));
  }
  print_message("25 m: scale %.4f of %.4f, turn %.5f of %.5f rad/m, end %.3f m, largest after 12 m %.3f m\n",
                drive.fusion.scale(), scale, drive.fusion.turn_rad_per_m(), turn,
                std::hypot(drive.error()[0], drive.error()[1]), largest_late);
  assert_near(drive.fusion.scale(), scale, 0.008);
  assert_near(drive.fusion.turn_rad_per_m(), turn, 0.0008);
  assert_at_most(largest_late, 0.06);
  assert_at_most(std::fabs(drive.error()[2]), 0.5 * kRadPerDeg);
}

/// Errors drawn as the filter believes them: their squares, over its variances, are 1 on average.
void test_consistent_over_many_drives(void**) {
  FusionParams params = without_floors();
  params.information_share = 1.0;
  params.scale_walk = params.turn_walk_rad_per_m = 0.0;
  generator = Random(29);
  const Mat3 R = Vec3(0.04 * 0.04, 0.04 * 0.04, 0.01 * 0.01).asDiagonal();
  double xy = 0.0;
  double yaw = 0.0;
  int count = 0;
  for (int run = 0; run < 300; ++run) {
    static Drive drive;
    drive = Drive();
    drive.fusion.init(params, 0.03, 0.005);
    drive.truth = {0.03 * gauss(), 0.03 * gauss(), 0.005 * gauss()};
    const double scale = params.sigma_scale * gauss();
    const double turn = params.sigma_turn_rad_per_m * gauss();
    for (int i = 1; i <= 100; ++i) {
      const double length = 0.1;
      const double root = std::sqrt(length);
      drive.step(length, 0.03 * std::sin(0.1 * i), scale, turn,
                 root * Vec3(params.noise_xy_m * gauss(), params.noise_xy_m * gauss(),
                             params.noise_yaw_rad * gauss()));
      if (i % 20 != 0) continue;
      const Vec3 e = drive.error();
      const double sxy = drive.fusion.sigma_xy_m();
      const double syaw = drive.fusion.sigma_yaw_rad();
      xy += 0.5 * (e[0] * e[0] + e[1] * e[1]) / (sxy * sxy);
      yaw += e[2] * e[2] / (syaw * syaw);
      ++count;
      drive.fix(R, Vec3(0.04 * gauss(), 0.04 * gauss(), 0.01 * gauss()));
    }
  }
  print_message("squared errors over variances: xy %.3f, yaw %.3f\n", xy / count, yaw / count);
  assert_near(xy / count, 1.0, 0.15);
  assert_near(yaw / count, 1.0, 0.15);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_against_covariance_form),
      cmocka_unit_test(test_without_fixes),
      cmocka_unit_test(test_growth),
      cmocka_unit_test(test_no_information_changes_nothing),
      cmocka_unit_test(test_floors),
      cmocka_unit_test(test_errors_of_vo_are_learned),
      cmocka_unit_test(test_consistent_over_many_drives),
  };
  return cmocka_run_group_tests_name("localizer/pose_fusion", tests, nullptr, nullptr);
}
