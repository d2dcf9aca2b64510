/// What is left of the rectification's errors, estimated on board.
///
/// A rig that is off by a milliradian still matches, but its depths are bent: a baseline that points 1 mrad
/// out of the image plane turned a straight drive by 0.03 degrees a metre, in this and in two other
/// pipelines. To first order, with u, v of the right point from the principal point, f the focal length in
/// px, d the disparity:
///   v_right - v_left = rows + f r_x (1 + v^2/f^2) - r_z u - b_y d + b_z v d/f
///   u_right          = ideal + columns + r_x u v/f + r_z v + b_z u d/f
/// and, before that, both cameras' lens (division model, Fitzgibbon 2001), r in units of f:
///   seen = ideal (1 + lens r_seen^2),   so   v_right - v_left = lens (v_left r_right^2 - v_right r_left^2)
/// Angles: rotation r_x, r_z of the right camera's axes about x and z, and the direction (1, b_y, b_z) of the
/// baseline, in the left camera. Offset: `rows` is what a pitch, a principal point's offset and a shifted
/// image have in common; `columns` what a turn r_y about y and an offset of the principal point do: all
/// disparities are short by it.
///
/// Rows and angles show in each match and need no motion and no truth: least squares, zero-mean priors, old
/// frames slowly forgotten. Where disparities are those of a plane, 1, v and v^2 are nearly all that is seen
/// beside the roll, for five causes; the priors share it out. Columns show in no row. They bend space by
/// 1 / (1 + c Z), so that near points tell another motion than far ones: the caller brings what a frame's
/// motion tells of them (vo/motion.hpp).
///
/// The lens is what calibration left of both cameras' distortion, or what nobody told. It bends the plane's
/// depths as columns do. Its rows, u v d / f^2, are those of a yaw but for the disparity's change; motions
/// tell it from columns, and a road that goes straight ahead may fake it: what counts is what both tell.
///
/// An offset or a lens counts beyond what a perfect rig's matches fake, t, and is zero to the bit up to that:
/// x (1 - t^2/x^2), without a jump (non-negative garrote). So a good rig has the four angles and nothing
/// else, while an image that lies lower is not taken for milliradians of baseline: 0.5 px turned the path by
/// 2.2 degrees in 25 m.
///
/// Source: first-order epipolar geometry (Longuet-Higgins 1981; as in Hartley & Zisserman 11.12
/// for rectified pairs); Fitzgibbon 2001, "Simultaneous linear estimation of multiple view geometry and lens
/// distortion"; Breiman 1995, "Better subset regression using the nonnegative garrote".
#pragma once

#include "core/eigen.hpp"
#include "geometry/stereo_rig.hpp"
#include "vo/motion.hpp"

namespace cairn {

struct RectificationParams {
  bool enabled = true;
  double prior_sigma_rad = 1.0e-3;  ///< of each angle: what a flight rig may be off after calibration
  double prior_rows_px = 3.0;       ///< sigma
  double columns_px = 0.0;          ///< known beforehand
  /// Sigma about it, of which three are the most that is believed; 0: columns stay what is known beforehand.
  double prior_columns_px = 0.5;
  double least_rows_px = 0.1;      ///< what matches of a perfect rig fake
  double least_columns_px = 0.05;  ///< likewise; twice the estimate's sigma is added in squares
  double prior_lens = 0.03;        ///< likewise; 0: there is none
  double least_lens = 0.003;       ///< likewise
  double common_px = 0.02;         ///< error that all matches share: their mean is no better
  double sigma_px = 0.3;  ///< of one vertical disparity; above its noise: errors of a frame go together
  double gate_px = 0.5;   ///< larger residuals are no evidence
  double memory_frames = 2000.0;  ///< evidence fades with this time constant
};

class RectificationEstimator {
 public:
  using Angles = Eigen::Matrix<double, 4, 1>;  ///< r_x, r_z, b_y, b_z (rad)

  void init(const RectificationParams& params, const StereoRig& rig);
  /// Rows as a search found them, before there is evidence.
  void set_rows(double rows_px);
  /// A match as measured, not corrected.
  void observe(const StereoPixel& measured);
  /// What a motion tells beyond the present estimate.
  void observe_motion(const RigEvidence& motion);
  /// What was learnt holds on for the same rig with pixels larger by 1 / `scale` (an exact power of two, so
  /// that the way back gives the same bits).
  void rescale(const StereoRig& rig, double scale);
  /// Takes in what was observed since the last call. Call once a frame, at its end, so that one frame
  /// uses one estimate.
  void end_frame();
  /// The match with both sides moved to where the ideal rig would see them.
  StereoPixel correct(const StereoPixel& measured) const;
  const Angles& angles() const { return angles_; }
  const ImageOffset& offset() const { return offset_; }

 private:
  /// What rows show: the angles, then these.
  enum : int { kRows = 4, kYaw, kLens, kCauses };
  using Causes = Eigen::Matrix<double, kCauses, 1>;
  using Normal = Eigen::Matrix<double, kCauses, kCauses>;
  using Matrix4 = Eigen::Matrix<double, 4, 4>;

  Causes causes_at(const StereoPixel& px) const;
  void estimate_lens();
  void estimate_rows_and_angles();
  double columns_information() const;
  void estimate_columns();

  RectificationParams params_;
  StereoRig rig_;
  Normal information_ = Normal::Zero();
  Causes evidence_ = Causes::Zero();
  RigEvidence motions_;
  Angles angles_ = Angles::Zero();
  ImageOffset offset_;
};

}  // namespace cairn
