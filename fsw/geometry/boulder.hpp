/// Boulders as the modules hand them to each other.
#pragma once

#include <cstdint>

#include "core/eigen.hpp"
#include "core/fixed_vector.hpp"
#include "mission_cfg.hpp"

namespace cairn {

/// A boulder of the orbital map, frame `map`.
struct MapBoulder {
  Vec2 p_map_m = Vec2(0.0, 0.0);
  float diameter_m = 0.0F;              ///< 0 = unknown
  std::uint16_t height_mm = 0;          ///< top above the ground around it; 0 = unknown
  std::uint8_t confidence_percent = 0;  ///< that a boulder stands there
};
/// The orbital boulders near the rover.
using MapBoulders = FixedVector<MapBoulder, cfg::kMaxMapWindowBoulders>;

/// A boulder seen from the ground, frame `site`, projected vertically (METHOD section C).
struct LocalBoulder {
  Vec2 p_site_m = Vec2(0.0, 0.0);
  double z_site_m = 0.0;
  float diameter_m = 0.0F;      ///< 0 = unknown
  float spread_m = 0.0F;        ///< root mean square distance of its 3D points from their mean
  float sigma_m = 0.0F;         ///< error of its place in the local map, on an axis; 0 = as of all
  std::uint32_t id = 0;         ///< unique over the drive
  std::uint16_t sightings = 0;  ///< frames in which it was seen
  bool counted = false;         ///< as evidence, in a window before (localizer/carried_hypothesis.hpp)
  bool in_view = false;         ///< in the last frame that boulders were looked for in
  float fresh = 1.0F;           ///< share of what it tells that no fix has been made of
};
/// The ground boulders of the last frames.
using LocalMap = FixedVector<LocalBoulder, cfg::kMaxLocalBoulders>;

}  // namespace cairn
