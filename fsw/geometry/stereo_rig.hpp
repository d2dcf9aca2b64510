/// The rectified stereo rig: projection, triangulation and its covariance, and where the rig sits
/// on the rover.
///
/// Frame `cam`: optical centre of the left camera, x right, y down, z forward (metres). Pixels: centre of the
/// top-left pixel is (0, 0), u right, v down. The right camera stands at +baseline on the x axis of `cam`,
/// same attitude, same intrinsics:
///   u_left = fx x/z + cx    v = fy y/z + cy    u_right = u_left - fx b/z    disparity d = u_left - u_right
#pragma once

#include "geometry/pose3.hpp"

namespace cairn {

/// A point seen by both cameras.
struct StereoPixel {
  double u_left = 0.0;
  double v_left = 0.0;
  double u_right = 0.0;
  double v_right = 0.0;

  double disparity_px() const { return u_left - u_right; }
};

/// How images differ from what the ideal rig would see, as a whole.
struct ImageOffset {
  double rows_px = 0.0;     ///< the right one lies lower
  double columns_px = 0.0;  ///< it lies to the right: disparities are short by so much
  /// Distortion of both images, r in focal lengths from the principal point (division model, Fitzgibbon
  /// 2001): ideal = seen / (1 + lens r_seen^2); to first order the k1 of others.
  double lens = 0.0;
};

struct StereoRig {
  int width_px = 0;
  int height_px = 0;
  double fx_px = 0.0;
  double fy_px = 0.0;
  double cx_px = 0.0;
  double cy_px = 0.0;
  double baseline_m = 0.0;
  Pose3 T_rover_cam;  ///< where the left camera sits on the rover
};

/// False where a number is not finite, or a size, focal length or baseline is not positive.
bool is_valid(const StereoRig& rig);

/// The rig whose pixels are the means of 2 x 2 of this one's (a last odd row or column is left out), and
/// where the middle of such a pixel lies in this one.
StereoRig halved(const StereoRig& rig);
constexpr double from_halved(double px) { return 2.0 * px + 0.5; }

/// Left camera pose for a mast: the stereo mid-point `height_m` above the rover's origin, optical axes
/// `pitch_down_rad` below the rover's x axis, left camera at +baseline/2 along the rover's y axis.
Pose3 mast_pose(double height_m, double pitch_down_rad, double baseline_m);

/// Projection of p_cam (z > 0) into both images.
StereoPixel project(const StereoRig& rig, const Vec3& p_cam);

/// Moves a match onto the epipolar geometry by the Sampson approximation (METHOD section A; Hartley and
/// Zisserman 12.4). Between rectified views the epipolar constraint is v_left = v_right, which is linear, so
/// the first-order correction is exact: each side takes half of the difference.
StereoPixel sampson_correct(const StereoPixel& match);

/// A match without its lens, and one of the ideal rig with it; the same bits where that is zero.
StereoPixel without_lens(const StereoRig& rig, double lens, const StereoPixel& seen);
StereoPixel with_lens(const StereoRig& rig, double lens, const StereoPixel& ideal);

/// Where the ideal rig would see a match, and where to look for what it would see.
StereoPixel to_ideal(const StereoRig& rig, const ImageOffset& offset, const StereoPixel& seen);
StereoPixel to_seen(const StereoRig& rig, const ImageOffset& offset, const StereoPixel& ideal);

/// Triangulated point in `cam`. Asks for a positive disparity (the caller gates it) and a match
/// on its epipolar line.
Vec3 triangulate(const StereoRig& rig, const StereoPixel& corrected);

}  // namespace cairn
