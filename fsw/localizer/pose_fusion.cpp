#include "localizer/pose_fusion.hpp"

#include <cmath>

namespace cairn {
namespace {

/// Inverse of a symmetric positive definite matrix, column by column: the solve that needs no heap.
template <int N>
Eigen::Matrix<double, N, N> inverse(const Eigen::Matrix<double, N, N>& m) {
  const Eigen::LDLT<Eigen::Matrix<double, N, N>> ldlt(m);
  Eigen::Matrix<double, N, N> out;
  for (int k = 0; k < N; ++k) {
    Eigen::Matrix<double, N, 1> unit = Eigen::Matrix<double, N, 1>::Zero();
    unit[k] = 1.0;
    const Eigen::Matrix<double, N, 1> column = ldlt.solve(unit);
    for (int r = 0; r < N; ++r) out(r, k) = column[r];
  }
  return out;
}

}  // namespace

void PoseFusion::init(const FusionParams& params, double sigma_xy_m, double sigma_yaw_rad) {
  params_ = params;
  scale_ = turn_rad_per_m_ = 0.0;
  P_.setZero();
  P_(0, 0) = P_(1, 1) = sigma_xy_m * sigma_xy_m;
  P_(2, 2) = sigma_yaw_rad * sigma_yaw_rad;
  P_(3, 3) = params.sigma_scale * params.sigma_scale;
  P_(4, 4) = params.sigma_turn_rad_per_m * params.sigma_turn_rad_per_m;
}

Pose3 PoseFusion::calibrated(const Pose3& step) const {
  const double distance = std::sqrt(step.t.squaredNorm());
  Pose3 out = step;
  out.t *= 1.0 + scale_;
  out.q = (step.q * lift({0.0, 0.0, turn_rad_per_m_ * distance}).q).normalized();
  return out;
}

void PoseFusion::propagate(const Vec2& d_map_m) {
  const double ds = std::sqrt(d_map_m.squaredNorm());
  Mat5 F = Mat5::Identity();
  F(0, 2) = -d_map_m.y();
  F(1, 2) = d_map_m.x();
  F(0, 3) = d_map_m.x();
  F(1, 3) = d_map_m.y();
  F(2, 4) = ds;
  const Mat5 FP = F * P_;
  P_.noalias() = FP * F.transpose();
  const auto grow = [&](int i, double sigma) { P_(i, i) += sigma * sigma * ds; };
  grow(0, params_.noise_xy_m);
  grow(1, params_.noise_xy_m);
  grow(2, params_.noise_yaw_rad);
  grow(3, params_.scale_walk);
  grow(4, params_.turn_walk_rad_per_m);
}

double PoseFusion::sigma_xy_m() const { return std::sqrt(0.5 * (P_(0, 0) + P_(1, 1))); }

double PoseFusion::sigma_yaw_rad() const { return std::sqrt(P_(2, 2)); }

Pose2 PoseFusion::update(const Pose2& correction, const Mat3& covariance, double prior_sigma_xy_m,
                         double prior_sigma_yaw_rad) {
  const Mat3 J = inverse<3>(covariance);
  Mat3 added = J;
  added(0, 0) -= 1.0 / (prior_sigma_xy_m * prior_sigma_xy_m);
  added(1, 1) -= 1.0 / (prior_sigma_xy_m * prior_sigma_xy_m);
  added(2, 2) -= 1.0 / (prior_sigma_yaw_rad * prior_sigma_yaw_rad);
  Mat5 information = inverse<5>(P_);
  information.topLeftCorner<3, 3>() += params_.information_share * added;
  P_ = inverse<5>(information);
  const Vec3 c(correction.x_m, correction.y_m, correction.yaw_rad);
  const Vec3 pull = params_.information_share * (J * c);
  const Vec5 e = P_.leftCols<3>() * pull;
  scale_ += e[3];
  turn_rad_per_m_ += e[4];
  const auto hold = [&](int i, double floor) {
    if (P_(i, i) < floor * floor) P_(i, i) = floor * floor;
  };
  hold(0, params_.floor_xy_m);
  hold(1, params_.floor_xy_m);
  hold(2, params_.floor_yaw_rad);
  return {e[0], e[1], e[2]};
}

}  // namespace cairn
