/// The paper's rig over maps of 4 to 10 cm a pixel, as a scouting drone or a low orbiter makes them: large
/// boulders are taken from the relief and kept as landmarks, as on the mast rig and three times as small.
#pragma once

#include "mission.hpp"

namespace cairn::cfg {

inline constexpr Mission kMission = [] {
  Mission m{};
  m.name = "drone";
  m.pixels_per_region = 8;
  m.vo_ops_per_pixel = 300;
  m.boulder_ops_per_pixel = 200;
  m.landmark_least_pixel_m = 0.035;  // finer maps hold enough of what the window has
  m.max_landmarks = 128;
  m.landmark_window_m = 40.0;
  m.relief_side = 256;     // 10 m, 1.5 MB
  m.relief_cell_m = 0.04;  // coarser ones lose boulders of 0.15 m, finer ones take those of 0.7 m for swells
  m.relief_range_m = 3.0;
  m.relief_min_height_m = 0.04;  // half of what a boulder of 0.15 m stands
  m.root_max_bytes = 7 * 1024 * 1024;
  return m;
}();

}  // namespace cairn::cfg
