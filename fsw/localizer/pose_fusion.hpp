/// How far a fix moves the pose, and what fixes tell of VO's own errors.
///
/// VO's drift is systematic: a baseline that is 1 % off, a toe-in, a bias of its matches. So besides the
/// errors of x, y and yaw, two rates are estimated: k, by which each VO step is too short, and w, the turn
/// per metre that it lacks. An extended Kalman filter on the error state of the rover in `map`,
///   e = (x, y, yaw, k, w):
///   step   displacement D (map, m), length ds:
///            x += k D_x - yaw D_y,  y += k D_y + yaw D_x,  yaw += w ds,  and noise
///   fix    a registration with the prior's information J_0 gave the correction c with information J: what it
///          adds of its own is J - J_0, so (information form)
///            P' = (P^-1 + a H^T (J - J_0) H)^-1,  e' = P' a H^T J c
/// with H picking x, y and yaw, and a <= 1 since local maps of successive fixes share boulders. Then the pose
/// takes e' and the rates are used on the steps to come, so that the local map, too, is less bent.
///
/// Source: the paper takes each fix whole (CorrectionMode::kWhole, which does not come here); Kalman filter
/// in information form, e.g. Maybeck 1979, chapter 5.
#pragma once

#include "geometry/pose3.hpp"
#include "mission_cfg.hpp"

namespace cairn {

struct FusionParams {
  double sigma_scale = cfg::kMission.drift_scale;                   ///< of k at the start
  double sigma_turn_rad_per_m = cfg::kMission.drift_yaw_rad_per_m;  ///< of w at the start
  double noise_xy_m = cfg::kMission.drift_noise_xy_m;               ///< random part of a metre of VO
  double noise_yaw_rad = cfg::kMission.drift_noise_yaw_rad;
  double scale_walk = 0.002;                         ///< of k, per square root of a metre
  double turn_walk_rad_per_m = 0.0002;               ///< of w
  double information_share = 0.5;                    ///< a above
  double floor_xy_m = cfg::kMission.fix_floor_xy_m;  ///< errors that all boulders share are in no covariance
  double floor_yaw_rad = cfg::kMission.fix_floor_yaw_rad;
};

class PoseFusion {
 public:
  void init(const FusionParams& params, double sigma_xy_m, double sigma_yaw_rad);

  /// The step (rover frame, T_prev_cur) as the rates say it really was.
  Pose3 calibrated(const Pose3& step) const;
  /// The error grows by a step of displacement `d_map_m` (calibrated, seen from above).
  void propagate(const Vec2& d_map_m);

  double sigma_xy_m() const;
  double sigma_yaw_rad() const;
  /// Of the rover's x and y in `map`, for reports; sigma_xy_m() is the root of its mean variance.
  Mat2 covariance_xy_m2() const { return P_.topLeftCorner<2, 2>(); }
  double scale() const { return scale_; }                    ///< k
  double turn_rad_per_m() const { return turn_rad_per_m_; }  ///< w

  /// Takes in a registration: `correction` of the rover's pose (x, y, yaw) and its covariance, both as they
  /// came out with the Gaussian prior (sigma_xy_m, sigma_yaw_rad). Returns the correction to make.
  Pose2 update(const Pose2& correction, const Mat3& covariance, double prior_sigma_xy_m,
               double prior_sigma_yaw_rad);

 private:
  using Vec5 = Eigen::Matrix<double, 5, 1>;
  using Mat5 = Eigen::Matrix<double, 5, 5>;

  FusionParams params_;
  Mat5 P_ = Mat5::Zero();
  double scale_ = 0.0;
  double turn_rad_per_m_ = 0.0;
};

}  // namespace cairn
