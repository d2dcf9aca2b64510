/// KITTI odometry, rectified grey pairs of 1226 x 370 on a car: a test of VO on real images,
/// about 1.2 m a frame.
#pragma once

#include "mission.hpp"

namespace cairn::cfg {

inline constexpr Mission kMission = [] {
  Mission m{};
  m.name = "kitti";
  m.pixels_per_region = 8;
  m.vo_ops_per_pixel = 300;
  m.boulder_ops_per_pixel = 110;
  m.image_width_px = 1242;
  m.image_height_px = 376;
  m.fx_px = 707.0912;
  m.fy_px = 707.0912;
  m.cx_px = 601.8873;
  m.cy_px = 183.1104;
  m.baseline_m = 0.53715;
  m.camera_height_m = 1.65;
  m.camera_pitch_down_rad = 0.0;
  m.max_features = 1200;
  m.min_disparity_px = 3;
  m.max_disparity_px = 150;
  m.search_radius_px = 60;
  m.first_search_radius_px = 150;
  m.max_step_m = 4.0;
  m.usual_step_m = 1.2;
  m.unseen_step_m = 0.6;
  m.unseen_step_rad = 0.05;
  m.root_max_bytes = 64 * 1024 * 1024;
  return m;
}();

}  // namespace cairn::cfg
