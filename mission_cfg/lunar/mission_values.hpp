/// A lunar rover's rectified pairs of 1280 x 720, 0.162 m baseline, with steps of up
/// to a metre between frames.
#pragma once

#include "mission.hpp"

namespace cairn::cfg {

inline constexpr Mission kMission = [] {
  Mission m{};
  m.name = "lunar";
  m.pixels_per_region = 8;
  m.vo_ops_per_pixel = 300;
  m.boulder_ops_per_pixel = 110;
  m.image_width_px = 1280;
  m.image_height_px = 720;
  m.fx_px = 914.015;
  m.fy_px = 914.015;
  m.cx_px = 640.0;
  m.cy_px = 360.0;
  m.baseline_m = 0.162;
  m.camera_height_m = 0.5;
  m.camera_pitch_down_rad = 0.0;
  m.max_features = 1200;
  m.min_disparity_px = 4;
  m.max_disparity_px = 260;
  m.search_radius_px = 120;
  m.first_search_radius_px = 320;
  m.max_step_m = 1.5;
  m.usual_step_m = 0.3;
  m.unseen_step_m = 0.3;
  m.unseen_step_rad = 0.15;
  m.root_max_bytes = 64 * 1024 * 1024;
  return m;
}();

}  // namespace cairn::cfg
