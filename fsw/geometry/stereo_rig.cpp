#include "geometry/stereo_rig.hpp"

#include <cmath>

#include "core/assert.hpp"

namespace cairn {
namespace {

/// An image point from the principal point, and the square of how far it is, in focal lengths.
struct Radial {
  double u, v, r2;
  Radial(const StereoRig& rig, double u_px, double v_px) : u(u_px - rig.cx_px), v(v_px - rig.cy_px) {
    r2 = u * u / (rig.fx_px * rig.fx_px) + v * v / (rig.fy_px * rig.fy_px);
  }
};

void take_lens(const StereoRig& rig, double lens, double& u_px, double& v_px) {
  const Radial seen(rig, u_px, v_px);
  const double more = 1.0 / (1.0 + lens * seen.r2) - 1.0;
  u_px += seen.u * more;
  v_px += seen.v * more;
}

/// Of the two solutions the one that is the point itself without a lens.
void give_lens(const StereoRig& rig, double lens, double& u_px, double& v_px) {
  const Radial ideal(rig, u_px, v_px);
  const double root2 = 1.0 - 4.0 * lens * ideal.r2;
  const double more = 2.0 / (1.0 + std::sqrt(root2 > 0.0 ? root2 : 0.0)) - 1.0;
  u_px += ideal.u * more;
  v_px += ideal.v * more;
}

}  // namespace

bool is_valid(const StereoRig& rig) {
  const auto positive = [](double v) { return v > 0.0 && std::isfinite(v); };
  return rig.width_px > 0 && rig.height_px > 0 && positive(rig.fx_px) && positive(rig.fy_px) &&
         positive(rig.baseline_m) && std::isfinite(rig.cx_px) && std::isfinite(rig.cy_px) &&
         is_valid(rig.T_rover_cam);
}

StereoRig halved(const StereoRig& rig) {
  StereoRig half = rig;
  half.width_px = rig.width_px / 2;
  half.height_px = rig.height_px / 2;
  half.fx_px = 0.5 * rig.fx_px;
  half.fy_px = 0.5 * rig.fy_px;
  half.cx_px = 0.5 * (rig.cx_px - 0.5);
  half.cy_px = 0.5 * (rig.cy_px - 0.5);
  return half;
}

Pose3 mast_pose(double height_m, double pitch_down_rad, double baseline_m) {
  const SinCos p = sin_cos(pitch_down_rad);
  Mat3 R_rover_cam;                   // columns: camera x (right), y (down), z (forward) in the rover frame
  R_rover_cam << 0.0, -p.sin, p.cos,  //
      -1.0, 0.0, 0.0,                 //
      0.0, -p.cos, -p.sin;
  return {Quat(R_rover_cam).normalized(), Vec3(0.0, 0.5 * baseline_m, height_m)};
}

StereoPixel project(const StereoRig& rig, const Vec3& p_cam) {
  CAIRN_ASSERT(p_cam.z() > 0.0);
  const double inv_z = 1.0 / p_cam.z();
  StereoPixel px;
  px.u_left = rig.fx_px * p_cam.x() * inv_z + rig.cx_px;
  px.v_left = rig.fy_px * p_cam.y() * inv_z + rig.cy_px;
  px.u_right = px.u_left - rig.fx_px * rig.baseline_m * inv_z;
  px.v_right = px.v_left;
  return px;
}

StereoPixel sampson_correct(const StereoPixel& match) {
  StereoPixel px = match;
  px.v_left = px.v_right = 0.5 * (match.v_left + match.v_right);
  return px;
}

StereoPixel without_lens(const StereoRig& rig, double lens, const StereoPixel& seen) {
  if (lens == 0.0) return seen;
  StereoPixel px = seen;
  take_lens(rig, lens, px.u_left, px.v_left);
  take_lens(rig, lens, px.u_right, px.v_right);
  return px;
}

StereoPixel with_lens(const StereoRig& rig, double lens, const StereoPixel& ideal) {
  if (lens == 0.0) return ideal;
  StereoPixel px = ideal;
  give_lens(rig, lens, px.u_left, px.v_left);
  give_lens(rig, lens, px.u_right, px.v_right);
  return px;
}

StereoPixel to_ideal(const StereoRig& rig, const ImageOffset& offset, const StereoPixel& seen) {
  StereoPixel px = without_lens(rig, offset.lens, seen);
  px.u_right -= offset.columns_px;
  px.v_right -= offset.rows_px;
  return px;
}

StereoPixel to_seen(const StereoRig& rig, const ImageOffset& offset, const StereoPixel& ideal) {
  StereoPixel px = ideal;
  px.u_right += offset.columns_px;
  px.v_right += offset.rows_px;
  return with_lens(rig, offset.lens, px);
}

Vec3 triangulate(const StereoRig& rig, const StereoPixel& corrected) {
  const double d = corrected.disparity_px();
  CAIRN_ASSERT(d > 0.0);
  const double m_per_px = rig.baseline_m / d;
  const double z = rig.fx_px * m_per_px;
  return {(corrected.u_left - rig.cx_px) * m_per_px, (corrected.v_left - rig.cy_px) * z / rig.fy_px, z};
}

}  // namespace cairn
