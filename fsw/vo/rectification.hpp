/// What is left of the rectification's errors, estimated on board from vertical disparities.
///
/// A rig that is off by a milliradian still matches, but its depths are bent: a baseline that points 1 mrad
/// out of the image plane turned a straight drive by 0.03 degrees a metre, in this and in two other
/// pipelines. Five small angles tell the whole relative attitude of the right camera: rotation r = (x, y, z)
/// of its axes and direction (b_y, b_z) of the baseline, relative to the ideal rig. To first order, with u, v
/// from the principal point, f the focal length in px, d the disparity:
///   v_right - v_left = f r_x (1 + v^2/f^2) + r_y u v/f - r_z u - b_y d - b_z v d/f
///   u_right          = ideal + f r_y (1 + u^2/f^2) + r_x u v/f + r_z v - b_z u d/f     (b_y does not act on
///   u)
/// The first row is observed by every match, needs no motion and no truth; its least squares, with a
/// zero-mean prior on each angle and old frames slowly forgotten, give the angles; the second row then says
/// what to take off the disparities. r_y and b_z are told apart by their different patterns in v and d, which
/// needs points at several depths.
///
/// Source: first-order epipolar geometry (Longuet-Higgins 1981; as in Hartley & Zisserman 11.12 for rectified
/// pairs).
#pragma once

#include "core/eigen.hpp"
#include "geometry/stereo_rig.hpp"

namespace cairn {

struct RectificationParams {
  bool enabled = true;
  double prior_sigma_rad = 1.0e-3;  ///< of each angle: what a flight rig may be off after calibration
  double sigma_px =
      0.3;  ///< of one vertical disparity; more than its noise, since errors of a frame go together
  double gate_px = 0.5;           ///< larger residuals are no evidence
  double memory_frames = 2000.0;  ///< evidence fades with this time constant
};

class RectificationEstimator {
 public:
  using Angles = Eigen::Matrix<double, 5, 1>;  ///< r_x, r_y, r_z, b_y, b_z (rad)

  void init(const RectificationParams& params, const StereoRig& rig);
  /// A match as measured, not corrected.
  void observe(const StereoPixel& measured);
  /// Takes in what was observed since the last call. Call once a frame, at its end, so that one frame uses
  /// one estimate.
  void end_frame();
  /// The match with the right camera's position moved to where the ideal rig would see it.
  StereoPixel correct(const StereoPixel& measured) const;
  const Angles& angles() const { return angles_; }

 private:
  using Matrix5 = Eigen::Matrix<double, 5, 5>;

  RectificationParams params_;
  StereoRig rig_;
  Matrix5 information_ = Matrix5::Zero();
  Angles evidence_ = Angles::Zero();
  Angles angles_ = Angles::Zero();
};

}  // namespace cairn
