#include "geometry/stereo_rig.hpp"

#include <cmath>

#include "core/assert.hpp"

namespace cairn {

bool is_valid(const StereoRig& rig) {
  const auto positive = [](double v) { return v > 0.0 && std::isfinite(v); };
  return rig.width_px > 0 && rig.height_px > 0 && positive(rig.fx_px) && positive(rig.fy_px) &&
         positive(rig.baseline_m) && std::isfinite(rig.cx_px) && std::isfinite(rig.cy_px) &&
         is_valid(rig.T_rover_cam);
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

Vec3 triangulate(const StereoRig& rig, const StereoPixel& corrected) {
  const double d = corrected.disparity_px();
  CAIRN_ASSERT(d > 0.0);
  const double z = rig.fx_px * rig.baseline_m / d;
  return {(corrected.u_left - rig.cx_px) * z / rig.fx_px, (corrected.v_left - rig.cy_px) * z / rig.fy_px, z};
}

}  // namespace cairn
