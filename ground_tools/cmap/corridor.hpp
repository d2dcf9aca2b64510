/// The corridor of a planned path: all ground within reach of it. Reach grows along the path with the drift
/// that has gathered since the last fix that is expected:
///   reach(s) = half_width + drift * (s - s of the last expected fix)
/// Fixes are expected evenly, or where a list has them.
/// half_width is what the rig sees to its side, and what registration may correct.
#pragma once

#include <cstdint>
#include <vector>

#include "base/boulder_table.hpp"
#include "mission_cfg.hpp"

namespace cairn::ground {

struct CorridorParams {
  double half_width_m = cfg::kMission.boulder_max_range_m + cfg::kMission.icp_max_correction_m;
  double drift = cfg::kMission.drift_scale;  ///< share of the way
  double fix_every_m = 0.0;                  ///< way between fixes that are expected; 0: none is
  std::vector<double> fixes_s_m;             ///< way to each that is expected, ascending; in place of that
};

/// Way-points in frame `map`, at least two, in order.
struct PlannedPath {
  std::vector<Vec2> p_map_m;
  std::vector<double> s_m;  ///< way to each
  double length_m() const { return s_m.empty() ? 0.0 : s_m.back(); }
};

/// A point that is given twice in a row counts once.
PlannedPath path_of(const std::vector<Vec2>& p_map_m);

double reach_m(const CorridorParams& params, double s_m);

/// A boulder within reach of the path.
struct CorridorBoulder {
  const TableBoulder* boulder = nullptr;
  double way_m = 0.0;      ///< on which it is within reach
  double first_s_m = 0.0;  ///< way after which it comes within reach
  std::uint32_t tile = 0;  ///< for the caller
};

/// By x; they point into `boulders`.
std::vector<CorridorBoulder> boulders_within_reach(const std::vector<TableBoulder>& boulders,
                                                   const PlannedPath& path, const CorridorParams& params);

/// The corridor's box, cut to the mapped ground.
MapExtent corridor_box(const PlannedPath& path, const CorridorParams& params, const MapExtent& mapped);

/// Its area, where the path does not cross itself.
double corridor_area_m2(const PlannedPath& path, const CorridorParams& params);

}  // namespace cairn::ground
