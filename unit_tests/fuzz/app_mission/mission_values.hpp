/// A small module for `fuzz_app`, which looks through a rig that is smaller still: a pair costs a sixteenth
/// of what it does with the paper's rig.
#pragma once

#include "mission.hpp"

namespace cairn::cfg {

constexpr Mission small_mission() {
  Mission m;
  m.name = "fuzz";
  m.image_width_px = 288;
  m.image_height_px = 224;
  m.fx_px = m.fy_px = 98.6;
  m.cx_px = 63.5;
  m.cy_px = 47.5;
  m.max_features = 120;
  m.max_labels = 16;
  m.max_disparity_px = 48;
  m.min_disparity_px = 2;
  m.search_radius_px = 12;
  m.first_search_radius_px = 24;
  m.max_local_boulders = 32;
  m.max_map_window_boulders = 64;
  m.max_map_chunks = 64;
  m.max_cluster_points = 128;
  return m;
}
inline constexpr Mission kMission = small_mission();

}  // namespace cairn::cfg
