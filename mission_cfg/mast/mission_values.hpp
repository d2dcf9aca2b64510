/// A mast rig, 1024 x 768: 66 x 52 degrees, 2 m high, 20 degrees down, 0.40 m baseline. Level ground is seen
/// from 1.9 m ahead to the horizon.
#pragma once

#include "mission.hpp"

namespace cairn::cfg {

inline constexpr Mission kMission = [] {
  Mission m{};
  m.name = "mast";
  m.pixels_per_region = 8;
  m.vo_ops_per_pixel = 300;
  m.boulder_ops_per_pixel = 200;
  m.image_width_px = 1024;
  m.image_height_px = 768;
  m.fx_px = 788.410861474;
  m.fy_px = 788.410861474;
  m.cx_px = 511.5;
  m.cy_px = 383.5;
  m.baseline_m = 0.40;
  m.camera_height_m = 2.0;
  m.camera_pitch_down_rad = 0.34906585039886592;  // 20 degrees
  m.max_features = 1200;
  m.min_disparity_px = 8;    // 39 m
  m.max_disparity_px = 240;  // 1.3 m: level ground is at 126 px and less
  m.search_radius_px = 60;   // 0.06 m a frame is 19 px on the nearest ground
  m.first_search_radius_px = 200;
  m.boulder_max_range_m = 8.0;  // where z^2/(f b) is that of the paper's rig at 3 m
  m.max_local_boulders = 512;   // more ground in view
  m.max_cluster_points = 2048;
  m.usual_step_m = 0.2;   // a mast's pictures share more ground than those of the paper's rig
  m.unseen_step_m = 0.1;  // these steps, and half as much
  m.map_window_radius_m = 12.0;
  m.max_wide_map_boulders = 32000;  // a square kilometre at k = 0.15 has 21,000 of 0.75 m and more
  m.landmark_least_pixel_m = 0.15;
  m.max_landmarks = 256;
  m.relief_side = 256;  // 32 m, 1.5 MB
  m.icp_job_max_bytes = 320 * 1024;
  m.root_max_bytes = 64 * 1024 * 1024;
  return m;
}();

}  // namespace cairn::cfg
