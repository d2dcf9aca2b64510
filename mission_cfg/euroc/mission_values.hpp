/// EuRoC, rectified grey pairs of 752 x 480: real images of a platform that stands still.
#pragma once

#include "mission.hpp"

namespace cairn::cfg {

inline constexpr Mission kMission = [] {
  Mission m{};
  m.name = "euroc";
  m.pixels_per_region = 8;
  m.vo_ops_per_pixel = 300;
  m.boulder_ops_per_pixel = 110;
  m.image_width_px = 752;
  m.image_height_px = 480;
  m.fx_px = 436.2345864027;
  m.fy_px = 436.2345864027;
  m.cx_px = 364.4412345886;
  m.cy_px = 256.9516754150;
  m.baseline_m = 0.110078;
  m.camera_height_m = 1.0;
  m.camera_pitch_down_rad = 0.0;
  m.min_disparity_px = 2;
  m.max_disparity_px = 120;
  m.root_max_bytes = 64 * 1024 * 1024;
  return m;
}();

}  // namespace cairn::cfg
