/// What is left of the rectification's errors, estimated on board from vertical disparities.
///
/// A rig that is off by a milliradian still matches, but its depths are bent: a baseline that points 1 mrad
/// out of the image plane turned a straight drive by 0.03 degrees a metre, in this and in two other
/// pipelines. Four small angles tell the relative attitude of the right camera but for its turn about y:
/// rotation r_x, r_z of its axes about x and z, and the direction (1, b_y, b_z) of the baseline, in the left
/// camera. To first order, with u, v of the right point from the principal point, f the focal length in px,
/// d the disparity:
///   v_right - v_left = f r_x (1 + v^2/f^2) - r_z u - b_y d + b_z v d/f
///   u_right          = ideal + r_x u v/f + r_z v + b_z u d/f            (b_y does not act on u)
/// The first row is observed by every match, needs no motion and no truth; its least squares, with a
/// zero-mean prior on each angle and old frames slowly forgotten, give the angles; the second row then says
/// what to take off the disparities.
///
/// The turn r_y is left to the calibration: what it does to v (u v/f) is weak and much like the other angles'
/// traces, while it shifts all disparities by f r_y. Estimated with the others it changed nothing on rendered
/// images and ran away to 9 mrad on KITTI's, where no frame gave a motion any more.
///
/// Source: first-order epipolar geometry (Longuet-Higgins 1981; as in Hartley & Zisserman 11.12
/// for rectified pairs).
#pragma once

#include "core/eigen.hpp"
#include "geometry/stereo_rig.hpp"

namespace cairn {

struct RectificationParams {
  bool enabled = true;
  double prior_sigma_rad = 1.0e-3;  ///< of each angle: what a flight rig may be off after calibration
  double sigma_px = 0.3;  ///< of one vertical disparity; above its noise: errors of a frame go together
  double gate_px = 0.5;   ///< larger residuals are no evidence
  double memory_frames = 2000.0;  ///< evidence fades with this time constant
};

class RectificationEstimator {
 public:
  using Angles = Eigen::Matrix<double, 4, 1>;  ///< r_x, r_z, b_y, b_z (rad)

  void init(const RectificationParams& params, const StereoRig& rig);
  /// A match as measured, not corrected.
  void observe(const StereoPixel& measured);
  /// Takes in what was observed since the last call. Call once a frame, at its end, so that one frame
  /// uses one estimate.
  void end_frame();
  /// The match with the right camera's position moved to where the ideal rig would see it.
  StereoPixel correct(const StereoPixel& measured) const;
  const Angles& angles() const { return angles_; }

 private:
  using Matrix4 = Eigen::Matrix<double, 4, 4>;

  RectificationParams params_;
  StereoRig rig_;
  Matrix4 information_ = Matrix4::Zero();
  Angles evidence_ = Angles::Zero();
  Angles angles_ = Angles::Zero();
};

}  // namespace cairn
