// Height and tilt by gravity: against a textbook filter, on drives whose truth is known, where VO is blind.
#include "localizer/attitude_fusion.hpp"

#include <cmath>

#include "core/random.hpp"
#include "geometry/stereo_rig.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

constexpr double kSigma_rad = 0.0035;

Random generator(1);

double gauss() {
  double sum = -6.0;
  for (int i = 0; i < 12; ++i) sum += generator.next() / 4294967296.0;
  return sum;
}

/// What an accelerometer reads on a rover that stands.
Vec3 up_of(const Quat& R_map_rover, double noise_rad = 0.0) {
  const Vec3 up = R_map_rover.conjugate() * Vec3(0.0, 0.0, 1.0);
  const Vec3 noise(noise_rad * gauss(), noise_rad * gauss(), 0.0);
  return (R_map_rover.conjugate() * (quat_exp(noise) * (R_map_rover * up))).normalized();
}

bool same_bits(const Pose3& a, const Pose3& b) {
  for (int i = 0; i < 4; ++i)
    if (a.q.coeffs()[i] != b.q.coeffs()[i]) return false;
  for (int i = 0; i < 3; ++i)
    if (a.t[i] != b.t[i]) return false;
  return true;
}

void test_without_a_measurement_steps_stay_to_the_bit(void**) {
  AttitudeFusion fusion;
  fusion.init({});
  const Pose3 step{quat_exp(Vec3(0.011, -0.007, 0.02)), Vec3(0.06, 0.001, -0.003)};
  for (int i = 0; i < 20; ++i) {
    assert_true(same_bits(fusion.calibrated(step), step));
    fusion.propagate({Vec2(0.05, 0.03), 0.5, Mat3::Zero()});
  }
  const Quat level(1.0, 0.0, 0.0, 0.0);
  assert_status(fusion.gravity(level, up_of(quat_exp(Vec3(0.004, 0.0, 0.0))), kSigma_rad).status,
                AttitudeStatus::kFused);
  assert_false(same_bits(fusion.calibrated(step), step));
}

/// Plain loops over the five errors, in the equations of the header.
struct Oracle {
  double P[5][5] = {};
  double e[5] = {};

  void start(const TiltParams& p) {
    P[1][1] = P[2][2] = p.sigma_start_rad * p.sigma_start_rad;
    P[3][3] = P[4][4] = p.sigma_turn_rad_per_m * p.sigma_turn_rad_per_m;
  }
  void step(const TiltParams& p, const TiltStep& s) {
    const double ds = std::hypot(s.d_map_m.x(), s.d_map_m.y());
    const double c = std::cos(s.yaw_rad);
    const double n = std::sin(s.yaw_rad);
    const double F[5][5] = {{1, s.d_map_m.y(), -s.d_map_m.x(), 0, 0},
                            {0, 1, 0, c * ds, -n * ds},
                            {0, 0, 1, n * ds, c * ds},
                            {0, 0, 0, 1, 0},
                            {0, 0, 0, 0, 1}};
    double next[5][5] = {};
    for (int i = 0; i < 5; ++i)
      for (int j = 0; j < 5; ++j)
        for (int k = 0; k < 5; ++k)
          for (int m = 0; m < 5; ++m) next[i][j] += F[i][k] * P[k][m] * F[j][m];
    const double q[5] = {p.noise_z_m, p.noise_tilt_rad, p.noise_tilt_rad, p.turn_walk_rad_per_m,
                         p.turn_walk_rad_per_m};
    for (int i = 0; i < 5; ++i)
      for (int j = 0; j < 5; ++j) {
        P[i][j] = next[i][j] + (i == j ? q[i] * q[i] * ds : 0.0);
        if (i < 3 && j < 3) P[i][j] += p.vo_sigma_factor * p.vo_sigma_factor * s.covariance(i, j);
      }
  }
  /// Of a, one axis after the other. The state is taken out as it is corrected.
  void measure(double a_x, double a_y, double sigma) {
    const double z[2] = {a_x, a_y};
    for (double& v : e) v = 0.0;
    for (int axis = 0; axis < 2; ++axis) {
      double Ph[5];
      for (int i = 0; i < 5; ++i) Ph[i] = P[i][1 + axis];
      const double S = Ph[1 + axis] + sigma * sigma;
      const double innovation = z[axis] - e[1 + axis];
      for (int i = 0; i < 5; ++i) e[i] += Ph[i] / S * innovation;
      for (int i = 0; i < 5; ++i)
        for (int j = 0; j < 5; ++j) P[i][j] -= Ph[i] * Ph[j] / S;
    }
  }
};

void test_against_the_textbook_filter(void**) {
  TiltParams params;
  params.gate_chi2 = 1e9;
  params.max_turn_rad_per_m = 1.0;
  AttitudeFusion fusion;
  fusion.init(params);
  Oracle oracle;
  oracle.start(params);
  double turn[2] = {};
  generator = Random(7);
  for (int stop = 0; stop < 30; ++stop) {
    for (int i = 0; i < 33; ++i) {
      const double yaw = 0.2 * stop + 0.01 * i;
      TiltStep s{0.06 * Vec2(std::cos(yaw + 0.3), std::sin(yaw + 0.3)), yaw, Mat3::Zero()};
      Mat3 A;
      for (int m = 0; m < 9; ++m) A(m / 3, m % 3) = 0.0002 * gauss();
      s.covariance = A * A.transpose();
      fusion.propagate(s);
      oracle.step(params, s);
    }
    const double a_x = 0.004 * gauss();
    const double a_y = 0.004 * gauss();
    // Any attitude will do: what counts is v = R up.
    const Quat R = quat_exp(Vec3(0.1 * gauss(), 0.1 * gauss(), gauss()));
    const Vec3 v(-a_y, a_x, std::sqrt(1.0 - a_x * a_x - a_y * a_y));
    const TiltResult got = fusion.gravity(R, R.conjugate() * v, kSigma_rad);
    assert_status(got.status, AttitudeStatus::kFused);
    oracle.measure(a_x, a_y, kSigma_rad);
    turn[0] += oracle.e[3];
    turn[1] += oracle.e[4];
    assert_near(got.z_m, oracle.e[0], 1e-10);
    assert_near(got.turn_map[0], oracle.e[1], 1e-10);
    assert_near(got.turn_map[1], oracle.e[2], 1e-10);
    assert_near(fusion.roll_rad_per_m(), turn[0], 1e-10);
    assert_near(fusion.pitch_rad_per_m(), turn[1], 1e-10);
    assert_near(fusion.sigma_z_m(), std::sqrt(oracle.P[0][0]), 1e-10);
    assert_near(fusion.sigma_tilt_rad(), std::sqrt(0.5 * (oracle.P[1][1] + oracle.P[2][2])), 1e-10);
  }
}

/// A rover over rolling ground, whose VO turns too little by `drift` a metre; errors as sigma says.
struct Run {
  double tilt_rad = 0.0;
  double z_m = 0.0;
  double sigma_tilt_rad = 0.0;
  double sigma_z_m = 0.0;
  double roll_rad_per_m = 0.0;
  double pitch_rad_per_m = 0.0;
};
Run drive(const Vec2& drift, double noise_rad, bool measured) {
  AttitudeFusion fusion;
  fusion.init({});
  Pose3 truth{quat_exp(Vec3(0.05, -0.03, 0.4)), Vec3(3.0, 4.0, 0.0)};
  Pose3 estimate = truth;
  for (int i = 1; i <= 420; ++i) {
    const Vec3 turn(0.01 * std::sin(0.05 * i), 0.008 * std::cos(0.04 * i), 0.001);
    const Pose3 step{quat_exp(turn), Vec3(0.06, 0.0, 0.0)};
    truth = truth * step;
    const Vec3 lacks(0.06 * drift.x(), 0.06 * drift.y(), 0.0);
    const Pose3 seen{(step.q * quat_exp(lacks).conjugate()).normalized(), step.t};
    const Vec2 before(estimate.t.x(), estimate.t.y());
    estimate = estimate * fusion.calibrated(seen);
    const Vec2 d = Vec2(estimate.t.x(), estimate.t.y()) - before;
    fusion.propagate({d, planar(estimate).yaw_rad, Mat3::Zero()});
    if (!measured || i % 33 != 0) continue;
    const TiltResult r = fusion.gravity(estimate.q, up_of(truth.q, noise_rad), kSigma_rad);
    assert_status(r.status, AttitudeStatus::kFused);
    estimate.q = quat_exp(Vec3(r.turn_map.x(), r.turn_map.y(), 0.0)) * estimate.q;
    estimate.t.z() += r.z_m;
  }
  const Vec3 up = estimate.q * up_of(truth.q);
  return {std::hypot(up.x(), up.y()), std::fabs(estimate.t.z() - truth.t.z()),
          fusion.sigma_tilt_rad(),    fusion.sigma_z_m(),
          fusion.roll_rad_per_m(),    fusion.pitch_rad_per_m()};
}

void test_gravity_takes_tilt_and_height_errors_away(void**) {
  generator = Random(11);
  const Vec2 drift(0.0004, -0.0006);
  const Run alone = drive(drift, 0.0, false);
  assert_at_least(alone.tilt_rad, 0.012);
  assert_at_least(alone.z_m, 0.08);
  const Run exact = drive(drift, 0.0, true);
  assert_at_most(exact.tilt_rad, 0.0012);
  assert_at_most(exact.z_m, 0.025);
  assert_near(exact.roll_rad_per_m, drift.x(), 0.0001);
  assert_near(exact.pitch_rad_per_m, drift.y(), 0.0001);
  assert_at_most(exact.sigma_z_m, 0.5 * alone.sigma_z_m);
  assert_at_most(exact.sigma_tilt_rad, 0.5 * alone.sigma_tilt_rad);
}

/// Over drives with noise and drift as the parameters say, errors are as large as sigma claims.
void test_sigma_is_honest(void**) {
  generator = Random(5);
  const TiltParams params;
  double tilt = 0.0;
  double z = 0.0;
  constexpr int kDrives = 60;
  for (int i = 0; i < kDrives; ++i) {
    const Vec2 drift(params.sigma_turn_rad_per_m * gauss(), params.sigma_turn_rad_per_m * gauss());
    const Run r = drive(drift, kSigma_rad, true);
    tilt += r.tilt_rad * r.tilt_rad / (2.0 * r.sigma_tilt_rad * r.sigma_tilt_rad) / kDrives;
    z += r.z_m * r.z_m / (r.sigma_z_m * r.sigma_z_m) / kDrives;
  }
  // Steps have no noise here, and the start no error, so errors are smaller than claimed, but not by much.
  assert_at_most(tilt, 1.2);
  assert_at_least(tilt, 0.15);
  assert_at_most(z, 1.2);
  assert_at_least(z, 0.05);
}

void test_what_is_refused_changes_nothing(void**) {
  AttitudeFusion fusion;
  fusion.init({});
  fusion.propagate({Vec2(2.0, 0.0), 0.0, Mat3::Zero()});
  const double tilt = fusion.sigma_tilt_rad();
  const Quat level(1.0, 0.0, 0.0, 0.0);
  const Vec3 up(0.0, 0.0, 1.0);
  struct Case {
    Vec3 up;
    double sigma_rad;
    AttitudeStatus status;
  };
  const Case cases[] = {{Vec3(0.0, NAN, 1.0), 0.01, AttitudeStatus::kBadInput},
                        {Vec3(0.0, 0.0, HUGE_VAL), 0.01, AttitudeStatus::kBadInput},
                        {Vec3(0.0, 0.0, 1e300), 0.01, AttitudeStatus::kBadInput},
                        {1.011 * up, 0.01, AttitudeStatus::kBadInput},
                        {0.989 * up, 0.01, AttitudeStatus::kBadInput},
                        {up, 0.99e-4, AttitudeStatus::kBadInput},
                        {up, 1.01, AttitudeStatus::kBadInput},
                        {up, -0.01, AttitudeStatus::kBadInput},
                        {up, NAN, AttitudeStatus::kBadInput},
                        {-up, 0.01, AttitudeStatus::kInconsistent},
                        {-up, 1.0, AttitudeStatus::kInconsistent},
                        {up_of(quat_exp(Vec3(0.06, 0.0, 0.0))), 0.01, AttitudeStatus::kInconsistent},
                        {up_of(quat_exp(Vec3(0.0, -0.06, 0.0))), 0.01, AttitudeStatus::kInconsistent}};
  for (const Case& c : cases) {
    assert_status(fusion.gravity(level, c.up, c.sigma_rad).status, c.status);
    assert_near(fusion.sigma_tilt_rad(), tilt, 0.0);
    assert_near(std::fabs(fusion.roll_rad_per_m()) + std::fabs(fusion.pitch_rad_per_m()), 0.0, 0.0);
  }
  for (const Case& c :
       {Case{1.009 * up, 0.01, AttitudeStatus::kFused}, Case{0.991 * up, 1.0, AttitudeStatus::kFused},
        Case{up_of(quat_exp(Vec3(0.04, 0.0, 0.0))), 0.01, AttitudeStatus::kFused}}) {
    assert_status(fusion.gravity(level, c.up, c.sigma_rad).status, c.status);
  }
}

void test_what_is_hidden_widens_and_what_is_measured_does_not(void**) {
  AttitudeFusion fusion;
  fusion.init({});
  const double tilt = fusion.sigma_tilt_rad();
  fusion.hold(3);
  assert_near(fusion.sigma_tilt_rad(), std::hypot(tilt, 3 * TiltParams().unseen_step_rad), 1e-12);
  assert_near(fusion.sigma_z_m(), 3 * TiltParams().unseen_step_m, 1e-12);
  fusion.caught_up();
  assert_near(fusion.sigma_tilt_rad(), tilt, 0.0);
  fusion.coast({quat_exp(Vec3(0.0, 0.0, 0.1)), Vec3(0.5, 0.0, 0.0)});
  assert_at_least(fusion.sigma_z_m(), 0.05);
  assert_at_most(fusion.sigma_z_m(), 0.07);
  fusion.give_up();
  fusion.caught_up();
  assert_at_least(fusion.sigma_z_m(), 0.05);
  fusion.init({});
  fusion.doubt(0.2, 0.1);
  assert_near(fusion.sigma_z_m(), 0.2, 1e-12);
  assert_near(fusion.sigma_tilt_rad(), std::hypot(tilt, 0.1), 1e-12);
  // Then gravity says it again, far off as it may be.
  const Quat level(1.0, 0.0, 0.0, 0.0);
  const TiltResult r = fusion.gravity(level, up_of(quat_exp(Vec3(0.2, 0.0, 0.0))), kSigma_rad);
  assert_status(r.status, AttitudeStatus::kFused);
  assert_at_most(fusion.sigma_tilt_rad(), kSigma_rad);
  assert_near(r.turn_map[0], 0.2, 0.003);
  assert_near(r.turn_map[1], 0.0, 1e-9);
}

/// By differences: the camera's pose disturbed, what becomes of the rover's.
void test_covariance_of_a_step(void**) {
  const Pose3 T_rover_cam = mast_pose(0.7, 0.6, 0.12);
  const Pose3 T_map_rover{quat_exp(Vec3(0.2, -0.1, 0.8)), Vec3(3.0, -2.0, 0.4)};
  Eigen::Matrix<double, 3, 6> J;
  for (int j = 0; j < 6; ++j) {
    constexpr double kStep = 1e-6;
    Vec3 w(0.0, 0.0, 0.0);
    Vec3 t(0.0, 0.0, 0.0);
    (j < 3 ? w[j] : t[j - 3]) = kStep;
    const Pose3 moved = T_map_rover * T_rover_cam * Pose3{quat_exp(w), t} * T_rover_cam.inverse();
    const Vec3 turned = quat_log(moved.q * T_map_rover.q.conjugate());
    J(0, j) = (moved.t.z() - T_map_rover.t.z()) / kStep;
    J(1, j) = turned.x() / kStep;
    J(2, j) = turned.y() / kStep;
  }
  Mat6 A;
  for (int i = 0; i < 36; ++i) A(i / 6, i % 6) = 0.01 * gauss();
  const Mat6 C = A * A.transpose();
  const Mat3 want = J * C * J.transpose();
  const Mat3 got = tilt_covariance(C, T_rover_cam, T_map_rover);
  for (int i = 0; i < 9; ++i) assert_near(got(i / 3, i % 3), want(i / 3, i % 3), 1e-8);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_without_a_measurement_steps_stay_to_the_bit),
      cmocka_unit_test(test_against_the_textbook_filter),
      cmocka_unit_test(test_gravity_takes_tilt_and_height_errors_away),
      cmocka_unit_test(test_sigma_is_honest),
      cmocka_unit_test(test_what_is_refused_changes_nothing),
      cmocka_unit_test(test_what_is_hidden_widens_and_what_is_measured_does_not),
      cmocka_unit_test(test_covariance_of_a_step),
  };
  return cmocka_run_group_tests_name("localizer/attitude_fusion", tests, nullptr, nullptr);
}
