#include "localizer/attitude_fusion.hpp"

#include <cmath>

#include "core/arithmetic.hpp"
#include "core/factors.hpp"

namespace cairn {
namespace {

constexpr double kForgiven = 0.9;  // of a contradiction's variance, by each ground that agrees

constexpr double kTiltedAnyhow = 1.8;  // sigma of a tilt about which nothing is known

bool finite(double v) { return std::fabs(v) <= 1.0e8; }

template <int N>
Eigen::Matrix<double, N, N> symmetric(const Eigen::Matrix<double, N, N>& m) {
  Eigen::Matrix<double, N, N> out;
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < N; ++j) out(i, j) = 0.5 * (m(i, j) + m(j, i));
  }
  return out;
}

}  // namespace

Mat3 tilt_covariance(const Mat6& of_camera, const Pose3& T_rover_cam, const Pose3& T_map_rover) {
  // A motion (w, v) right of the camera's pose is (R w, R v + t x R w) right of the rover's.
  const Mat3 R_rover_cam = T_rover_cam.q.toRotationMatrix();
  const Mat3 R_map_rover = T_map_rover.q.toRotationMatrix();
  const Mat3 R = R_map_rover * R_rover_cam;
  const Vec3 lever = R_map_rover * T_rover_cam.t;
  Eigen::Matrix<double, 3, 6> J;
  for (int j = 0; j < 3; ++j) {
    const Vec3 turned = R.col(j);
    J(0, j) = lever.cross(turned).z();
    J(1, j) = turned.x();
    J(2, j) = turned.y();
    J(0, 3 + j) = turned.z();
    J(1, 3 + j) = J(2, 3 + j) = 0.0;
  }
  const Eigen::Matrix<double, 3, 6> JC = J.lazyProduct(of_camera);
  return JC.lazyProduct(J.transpose());
}

void AttitudeFusion::init(const TiltParams& params) {
  params_ = params;
  P_ = Covariance::Zero();
  P_(1, 1) = P_(2, 2) = square(params.sigma_start_rad);
  P_(3, 3) = P_(4, 4) = square(params.sigma_turn_rad_per_m);
  turn_ = Vec2(0.0, 0.0);
  hidden_m_ = hidden_rad_ = 0.0;
  on_map_ = false;
  map_share_ = map_variance_ = contradicted_ = Vec3(0.0, 0.0, 0.0);
}

Pose3 AttitudeFusion::calibrated(const Pose3& step) const {
  if (turn_[0] == 0.0 && turn_[1] == 0.0) return step;  // a product with no turn rounds
  const double distance = std::sqrt(step.t.squaredNorm());
  const Vec3 turn_rad(turn_[0] * distance, turn_[1] * distance, 0.0);
  return {(step.q * quat_exp(turn_rad)).normalized(), step.t};
}

void AttitudeFusion::propagate(const TiltStep& step) {
  const Vec2& d = step.d_map_m;
  const double ds = std::sqrt(d.squaredNorm());
  const SinCos heading = sin_cos(step.yaw_rad);
  Covariance F = Covariance::Identity();
  F(0, 1) = d.y();
  F(0, 2) = -d.x();
  F(1, 3) = F(2, 4) = heading.cos * ds;
  F(1, 4) = -heading.sin * ds;
  F(2, 3) = heading.sin * ds;
  const Covariance FP = F.lazyProduct(P_);
  P_ = FP.lazyProduct(F.transpose());
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) P_(i, j) += square(params_.vo_sigma_factor) * step.covariance(i, j);
  }
  P_(0, 0) += square(params_.noise_z_m) * ds;
  P_(1, 1) += square(params_.noise_tilt_rad) * ds;
  P_(2, 2) += square(params_.noise_tilt_rad) * ds;
  P_(3, 3) += square(params_.turn_walk_rad_per_m) * ds;
  P_(4, 4) += square(params_.turn_walk_rad_per_m) * ds;
  P_ = symmetric<5>(P_);
}

void AttitudeFusion::hold(std::uint32_t frames) {
  hidden_m_ += frames * params_.unseen_step_m;
  hidden_rad_ += frames * params_.unseen_step_rad;
}

void AttitudeFusion::coast(const Pose3& prior_step) {
  hidden_rad_ += params_.prior_share * quat_log(prior_step.q).norm() + params_.prior_sigma_rad;
  const double tilt = hidden_rad_ + std::sqrt(0.5 * (P_(1, 1) + P_(2, 2)));
  hidden_m_ += (params_.prior_share + (tilt < 1.0 ? tilt : 1.0)) * std::sqrt(prior_step.t.squaredNorm());
}

void AttitudeFusion::doubt(double xyz_m, double turn_rad) {
  hidden_m_ += xyz_m;
  hidden_rad_ += turn_rad;
  give_up();
}

void AttitudeFusion::caught_up() { hidden_m_ = hidden_rad_ = 0.0; }

void AttitudeFusion::give_up() {
  const double tilt_rad = hidden_rad_ < kTiltedAnyhow ? hidden_rad_ : kTiltedAnyhow;
  P_(0, 0) += square(hidden_m_);
  P_(1, 1) += square(tilt_rad);
  P_(2, 2) += square(tilt_rad);
  hidden_m_ = hidden_rad_ = 0.0;
}

TiltResult AttitudeFusion::gravity(const Quat& R_map_rover, const Vec3& up_rover, double sigma_rad) {
  TiltResult out;
  if (!finite(up_rover.x()) || !finite(up_rover.y()) || !finite(up_rover.z())) return out;
  const double length = std::sqrt(up_rover.squaredNorm());
  if (!(std::fabs(length - 1.0) <= kUpLengthError)) return out;
  if (!(sigma_rad >= kLeastAttitudeSigma_rad && sigma_rad <= kMostAttitudeSigma_rad)) return out;
  const Vec3 v = (R_map_rover * up_rover) / length;
  const Vec2 r(v.y(), -v.x());
  const double sxx = P_(1, 1) + square(sigma_rad);
  const double syy = P_(2, 2) + square(sigma_rad);
  const double sxy = P_(1, 2);
  const double det = sxx * syy - sxy * sxy;
  const Vec2 pull((syy * r[0] - sxy * r[1]) / det, (sxx * r[1] - sxy * r[0]) / det);
  out.chi2 = r.dot(pull);
  out.status = AttitudeStatus::kInconsistent;
  // Upside down has a small r, too.
  if (!(v.z() > 0.0 && out.chi2 <= params_.gate_chi2)) return out;
  out.status = AttitudeStatus::kFused;
  const Covariance P = P_;
  const auto gain = [&](int i, const Vec2& w) { return P(i, 1) * w[0] + P(i, 2) * w[1]; };
  out.z_m = gain(0, pull);
  out.turn_map = Vec2(gain(1, pull), gain(2, pull));
  for (int i = 0; i < 2; ++i) turn_[i] = clamped(turn_[i] + gain(3 + i, pull), params_.max_turn_rad_per_m);
  for (int j = 0; j < 5; ++j) {
    const Vec2 weight((syy * P(1, j) - sxy * P(2, j)) / det, (sxx * P(2, j) - sxy * P(1, j)) / det);
    for (int i = 0; i < 5; ++i) P_(i, j) -= gain(i, weight);
  }
  P_ = symmetric<5>(P_);
  return out;
}

TiltResult AttitudeFusion::ground(const Vec3& offset, const Mat3& covariance, const Vec3& least) {
  TiltResult out;
  Covariance P = P_;
  if (!on_map_) P(0, 0) += square(params_.sigma_start_z_m);
  Mat3 S;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) S(i, j) = P(i, j) + covariance(i, j);
    S(i, i) += contradicted_[i];
  }
  const Factors factors(S);
  if (!factors.positive()) return out;
  const Mat3 inverse = factors.inverse();
  const Vec3 pull = inverse * offset;
  out.chi2 = offset.dot(pull);
  out.status = AttitudeStatus::kInconsistent;
  const int first = on_map_ ? 0 : 1;  // which height is 0 only ground that was taken tells
  for (int i = first; i < 3 && out.chi2 > params_.ground_surprise_chi2; ++i) {
    const double seen = square(offset[i]);
    if (contradicted_[i] < seen) contradicted_[i] = seen;
  }
  if (!(out.chi2 <= params_.ground_gate_chi2)) return out;
  out.status = AttitudeStatus::kFused;
  const auto gain = [&](int i, const Vec3& w) { return P(i, 0) * w[0] + P(i, 1) * w[1] + P(i, 2) * w[2]; };
  out.z_m = gain(0, pull);
  out.turn_map = Vec2(gain(1, pull), gain(2, pull));
  for (int i = 0; i < 2; ++i) turn_[i] = clamped(turn_[i] + gain(3 + i, pull), params_.max_turn_rad_per_m);
  P_ = P;
  for (int j = 0; j < 5; ++j) {
    const Vec3 weight = inverse * Vec3(P(0, j), P(1, j), P(2, j));
    for (int i = 0; i < 5; ++i) P_(i, j) -= gain(i, weight);
  }
  P_ = symmetric<5>(P_);
  for (int i = 0; i < 3; ++i) {
    map_share_[i] += gain(i, Vec3(inverse(0, i), inverse(1, i), inverse(2, i))) * (1.0 - map_share_[i]);
    map_variance_[i] = square(least[i]);
    contradicted_[i] *= kForgiven;
  }
  on_map_ = true;
  return out;
}

/// What the map's own errors have made of z (0) and a (1, 2).
double AttitudeFusion::variance_of_map(int i) const {
  return square(map_share_[i]) * (map_variance_[i] + contradicted_[i]);
}

double AttitudeFusion::sigma_z_m() const {
  return std::sqrt(std::fabs(P_(0, 0)) + variance_of_map(0) + square(hidden_m_));
}

double AttitudeFusion::sigma_tilt_rad() const {
  const double of_map = variance_of_map(1) + variance_of_map(2);
  return std::sqrt(0.5 * (P_(1, 1) + P_(2, 2) + of_map) + square(hidden_rad_));
}

}  // namespace cairn
