#include "localizer/pose_fusion.hpp"

#include <cmath>

#include "core/arithmetic.hpp"
#include "core/factors.hpp"

namespace cairn {
namespace {

constexpr double kTurnedAnyhow = 1.8;  // sigma of a heading about which nothing is known: pi / sqrt(3)

Mat3 inverse(const Mat3& m) { return Factors(m).inverse(); }

ErrorCovariance symmetric(const ErrorCovariance& m) {
  ErrorCovariance out;
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 8; ++j) out(i, j) = 0.5 * (m(i, j) + m(j, i));
  }
  return out;
}

/// F m F'
ErrorCovariance transformed(const ErrorCovariance& m, const ErrorCovariance& F) {
  const ErrorCovariance Fm = F.lazyProduct(m);
  return symmetric(Fm.lazyProduct(F.transpose()));
}

bool is_covariance(const Mat3& m) {
  for (int i = 0; i < 9; ++i) {
    if (!(std::fabs(m(i / 3, i % 3)) <= 1.0e8)) return false;
    if (!(std::fabs(m(i / 3, i % 3) - m(i % 3, i / 3)) <=
          1.0e-6 * std::sqrt(std::fabs(m(i / 3, i / 3) * m(i % 3, i % 3)))))
      return false;
  }
  return Factors(m).positive();
}

bool is_usable(const FixOffset& fix) {
  return is_covariance(fix.covariance) && is_finite({fix.offset[0], fix.offset[1], fix.offset[2]});
}

/// A heading is somewhere within a turn.
Mat3 with_a_heading(const Mat3& covariance) {
  Mat3 out = covariance;
  if (out(2, 2) > kTurnedAnyhow * kTurnedAnyhow) {
    out(2, 2) = kTurnedAnyhow * kTurnedAnyhow;
    out(0, 2) = out(2, 0) = out(1, 2) = out(2, 1) = 0.0;
  }
  return out;
}

}  // namespace

Mat3 planar_covariance(const Mat6& of_camera, const Pose3& T_rover_cam, const Pose3& T_map_rover) {
  // A motion (w, v) right of the camera's pose is (R w, R v + t x R w) right of the rover's.
  const Mat3 R_rover_cam = T_rover_cam.q.toRotationMatrix();
  const Mat3 R_map_rover = T_map_rover.q.toRotationMatrix();
  const Mat3 R = R_map_rover * R_rover_cam;
  const Vec3 lever = R_map_rover * T_rover_cam.t;
  Eigen::Matrix<double, 3, 6> J;
  for (int j = 0; j < 3; ++j) {
    const Vec3 turned = R.col(j);
    const Vec3 swept = lever.cross(turned);
    J(0, j) = swept.x();
    J(1, j) = swept.y();
    J(2, j) = turned.z();
    J(0, 3 + j) = turned.x();
    J(1, 3 + j) = turned.y();
    J(2, 3 + j) = 0.0;
  }
  const Eigen::Matrix<double, 3, 6> JC = J.lazyProduct(of_camera);
  return JC.lazyProduct(J.transpose());
}

ErrorCovariance errors_at_start(const FusionParams& params, double sigma_xy_m, double sigma_yaw_rad) {
  const double sigmas[] = {sigma_xy_m,
                           sigma_xy_m,
                           sigma_yaw_rad,
                           params.sigma_scale,
                           params.sigma_turn_rad_per_m,
                           params.common_xy_m,
                           params.common_xy_m,
                           params.common_yaw_rad};
  ErrorCovariance P = ErrorCovariance::Zero();
  for (int i = 0; i < 8; ++i) P(i, i) = sigmas[i] * sigmas[i];
  return P;
}

ErrorGrowth growth(const FusionParams& params, const PlanarStep& step) {
  const Vec2& d = step.d_map_m;
  const double ds = std::sqrt(d.squaredNorm());
  ErrorGrowth g;
  g.F(0, 2) = -d.y();
  g.F(1, 2) = d.x();
  g.F(0, 3) = d.x();
  g.F(1, 3) = d.y();
  g.F(2, 4) = ds;
  const double kept = 1.0 / (1.0 + ds / params.common_length_m);
  const auto square = [](double v) { return v * v; };
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) g.Q(i, j) = square(params.vo_sigma_factor) * step.covariance(i, j);
    g.F(5 + i, 5 + i) = kept;
    g.Q(5 + i, 5 + i) = (1.0 - kept * kept) * square(i < 2 ? params.common_xy_m : params.common_yaw_rad);
  }
  g.Q(0, 0) += square(params.noise_xy_m) * ds;
  g.Q(1, 1) += square(params.noise_xy_m) * ds;
  g.Q(2, 2) += square(params.noise_yaw_rad) * ds + square(params.noise_turn) * std::fabs(step.turn_rad);
  g.Q(3, 3) = square(params.scale_walk) * ds;
  g.Q(4, 4) = square(params.turn_walk_rad_per_m) * ds;
  return g;
}

ErrorCovariance grown(const ErrorCovariance& P, const ErrorGrowth& growth) {
  return transformed(P, growth.F) + symmetric(growth.Q);
}

ErrorUpdate updated(const ErrorCovariance& P, const Vec3& offset, const Mat3& covariance) {
  Eigen::Matrix<double, 8, 3> PH;
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 3; ++j) PH(i, j) = P(i, j) + P(i, 5 + j);
  }
  Mat3 S = covariance;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) S(i, j) += PH(i, j) + PH(5 + i, j);
  }
  const Mat3 weight = inverse(S);
  const Vec3 pull = weight * offset;
  const Eigen::Matrix<double, 8, 3> K = PH.lazyProduct(weight);
  ErrorUpdate out;
  out.chi2 = offset.dot(pull);
  out.e = PH.lazyProduct(pull);
  out.P = symmetric(P - K.lazyProduct(PH.transpose()));
  return out;
}

void PoseFusion::init(const FusionParams& params, double sigma_xy_m, double sigma_yaw_rad) {
  params_ = params;
  rates_ = rates_before_fix_ = {};
  hidden_ = run_ = {};
  common_.setZero();
  P_ = errors_at_start(params, sigma_xy_m, sigma_yaw_rad);
  snapshot();
}

void PoseFusion::other_map(double common_xy_m) {
  params_.common_xy_m = common_xy_m;
  const double sigmas[] = {common_xy_m, common_xy_m, params_.common_yaw_rad};
  common_.setZero();
  snapshot_common_.setZero();
  for (ErrorCovariance* m : {&P_, &snapshot_P_}) {
    m->bottomRows<3>().setZero();
    m->rightCols<3>().setZero();
    for (int i = 0; i < 3; ++i) (*m)(5 + i, 5 + i) = sigmas[i] * sigmas[i];
  }
}

Pose3 PoseFusion::calibrated(const Pose3& step) const {
  const double distance = std::sqrt(step.t.squaredNorm());
  Pose3 out = step;
  out.t *= 1.0 + rates_.scale;
  out.q = (step.q * lift({0.0, 0.0, rates_.turn_rad_per_m * distance}).q).normalized();
  return out;
}

void PoseFusion::propagate(const PlanarStep& step) {
  if (step.sound) run_ = {};
  const ErrorGrowth g = growth(params_, step);
  P_ = grown(P_, g);
  common_ *= g.F(5, 5);
  since_snapshot_.F = ErrorCovariance(g.F.lazyProduct(since_snapshot_.F));
  since_snapshot_.Q = grown(since_snapshot_.Q, g);
}

void PoseFusion::hold(std::uint32_t frames) {
  hidden_.xy_m += frames * params_.unseen_step_m;
  hidden_.yaw_rad += frames * params_.unseen_step_rad;
}

void PoseFusion::coast(const Pose3& prior_step) {
  const double length = std::sqrt(prior_step.t.squaredNorm());
  hidden_.yaw_rad += params_.prior_share * quat_log(prior_step.q).norm() + params_.prior_sigma_rad;
  const double heading = hidden_.yaw_rad + std::sqrt(P_(2, 2));
  hidden_.xy_m += (params_.prior_share + (heading < 1.0 ? heading : 1.0)) * length;
}

void PoseFusion::doubt(double xy_m, double yaw_rad) {
  hidden_.xy_m += xy_m;
  hidden_.yaw_rad += yaw_rad;
  give_up();
}

void PoseFusion::caught_up() { hidden_ = {}; }

void PoseFusion::give_up() {
  const double xy = hidden_variance_m2();
  const double yaw = hidden_variance_rad2();
  for (ErrorCovariance* m : {&P_, &since_snapshot_.Q}) {
    (*m)(0, 0) += xy;
    (*m)(1, 1) += xy;
    (*m)(2, 2) += yaw;
  }
  run_.xy_m += hidden_.xy_m;
  run_.yaw_rad += hidden_.yaw_rad;
  hidden_ = {};
}

void PoseFusion::lose() { P_ = anywhere(P_); }

/// Of the common errors nothing is forgotten; they are the map's.
ErrorCovariance PoseFusion::anywhere(const ErrorCovariance& P) const {
  ErrorCovariance out = errors_at_start(params_, kAnywhere_m, kTurnedAnyhow * 10.0);
  out.bottomRightCorner<3, 3>() = P.bottomRightCorner<3, 3>();
  return out;
}

/// Of what is hidden, on top of the run that is in P: errors that go the same way add up themselves.
double PoseFusion::hidden_variance_m2() const { return (2.0 * run_.xy_m + hidden_.xy_m) * hidden_.xy_m; }

double PoseFusion::hidden_variance_rad2() const {
  const double all = run_.yaw_rad + hidden_.yaw_rad;
  const double before = run_.yaw_rad < kTurnedAnyhow ? run_.yaw_rad : kTurnedAnyhow;
  const double after = all < kTurnedAnyhow ? all : kTurnedAnyhow;
  return after * after - before * before;
}

Mat3 PoseFusion::covariance() const {
  Mat3 out = P_.topLeftCorner<3, 3>();
  out(0, 0) += hidden_variance_m2();
  out(1, 1) += hidden_variance_m2();
  out(2, 2) += hidden_variance_rad2();
  return with_a_heading(out);
}

Mat3 PoseFusion::covariance_at_snapshot() const { return with_a_heading(snapshot_P_.topLeftCorner<3, 3>()); }

Mat3 PoseFusion::carried(const Mat3& covariance) const {
  ErrorCovariance P = snapshot_P_;
  P.topRows<3>().setZero();
  P.leftCols<3>().setZero();
  P.topLeftCorner<3, 3>() = covariance;
  return grown(P, since_snapshot_).topLeftCorner<3, 3>();
}

Mat3 PoseFusion::bend(double far_m) const {
  const double along = far_m * far_m * snapshot_P_(3, 3);
  const double turn = far_m * far_m * snapshot_P_(4, 4);
  const double xy = along + 0.25 * far_m * far_m * turn;
  return Vec3(xy, xy, turn).asDiagonal();
}

double PoseFusion::sigma_xy_m() const {
  const Mat3 now = covariance();
  return std::sqrt(0.5 * (now(0, 0) + now(1, 1)));
}

double PoseFusion::sigma_yaw_rad() const { return std::sqrt(covariance()(2, 2)); }

void PoseFusion::snapshot() {
  snapshot_P_ = P_;
  snapshot_common_ = common_;
  since_snapshot_ = {};
}

FusionResult PoseFusion::update(const FixOffset& fix, double fresh) {
  return fuse(fix, fresh, params_.gate_chi2);
}

FusionResult PoseFusion::fuse(const FixOffset& fix, double fresh, double gate_chi2) {
  FusionResult refused;
  if (!is_usable(fix) || !(fresh > 0.0 && fresh <= 1.0)) return refused;
  const Mat3 R = fix.covariance / fresh;
  const Vec3 offset = fix.offset - snapshot_common_;
  ErrorUpdate u = updated(snapshot_P_, offset, R);
  const double chi2 = u.chi2;
  refused.status = FusionStatus::kInconsistent;
  refused.chi2 = chi2;
  if (!(chi2 <= gate_chi2)) return refused;
  if (chi2 > params_.surprise_chi2) {
    const double wider = std::sqrt(chi2 / params_.surprise_chi2);
    for (int i = 0; i < 8; ++i) {
      for (int j = 0; j < 8; ++j) snapshot_P_(i, j) *= (i < 5 ? wider : 1.0) * (j < 5 ? wider : 1.0);
    }
    u = updated(snapshot_P_, offset, R);
    u.chi2 = chi2;
  }
  rates_before_fix_ = rates_;
  return take(u, true);
}

FusionResult PoseFusion::prove(const FixOffset& fix) {
  if (!is_usable(fix)) return {};
  for (int i = 0; i < 3; ++i) {
    const double least = 0.5 * (fix.covariance(i, i) + snapshot_P_(5 + i, 5 + i));
    if (snapshot_P_(i, i) < least) snapshot_P_(i, i) = least;
  }
  for (int i = 0; i < 8; ++i) {  // what the start was off is taken for no rates
    if (i == 3 || i == 4) continue;
    for (int rate = 3; rate < 5; ++rate) snapshot_P_(i, rate) = snapshot_P_(rate, i) = 0.0;
  }
  const FusionResult agreed = fuse(fix, 1.0, params_.claim_chi2);
  if (agreed.status != FusionStatus::kInconsistent) return agreed;
  rates_before_fix_ = rates_;
  return relocate(fix);
}

FusionResult PoseFusion::relocate(const FixOffset& fix) {
  if (!is_usable(fix)) return {};
  rates_ = rates_before_fix_;
  return take(updated(anywhere(snapshot_P_), fix.offset - snapshot_common_, fix.covariance), false);
}

FusionResult PoseFusion::heading(double offset_rad, double variance_rad2) {
  FusionResult out;
  if (!is_finite({offset_rad, 0.0, 0.0}) || !(variance_rad2 > 0.0 && variance_rad2 <= 1.0e8)) return out;
  const ErrorVector Ph = P_.col(2);
  const double S = Ph[2] + variance_rad2;
  out.chi2 = offset_rad * offset_rad / S;
  out.status = FusionStatus::kInconsistent;
  if (!(out.chi2 <= params_.heading_gate_chi2)) return out;
  out.status = FusionStatus::kFused;
  const ErrorVector e = Ph * (offset_rad / S);
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 8; ++j) P_(i, j) -= Ph[i] * Ph[j] / S;
  }
  correct_rates(e);
  common_ += e.tail<3>();
  out.at_snapshot = {e[0], e[1], wrap_angle(e[2])};
  return out;
}

void PoseFusion::correct_rates(const ErrorVector& e) {
  rates_.scale = clamped(rates_.scale + e[3], params_.max_scale);
  rates_.turn_rad_per_m = clamped(rates_.turn_rad_per_m + e[4], params_.max_turn_rad_per_m);
}

/// The update lands at the snapshot and is carried to the present.
FusionResult PoseFusion::take(const ErrorUpdate& update, bool with_rates) {
  FusionResult out;
  out.status = FusionStatus::kFused;
  out.chi2 = update.chi2;
  out.at_snapshot = {update.e[0], update.e[1], wrap_angle(update.e[2])};
  if (with_rates) {
    const Rates before = rates_;
    correct_rates(update.e);
    const double k = rates_.scale - before.scale;
    const double w = rates_.turn_rad_per_m - before.turn_rad_per_m;
    const ErrorCovariance& F = since_snapshot_.F;
    out.since = {F(0, 3) * k + F(0, 4) * w, F(1, 3) * k + F(1, 4) * w, F(2, 3) * k + F(2, 4) * w};
  }
  P_ = grown(update.P, since_snapshot_);
  common_ = since_snapshot_.F(5, 5) * (snapshot_common_ + update.e.tail<3>());
  run_ = {};
  snapshot_P_ = P_;
  snapshot_common_ = common_;
  since_snapshot_ = {};
  return out;
}

}  // namespace cairn
