/// Boulders that the rover finds and the map's resolution leaves out.
///
/// A coarse map holds large boulders alone; the rover sees the small ones, too, and each may lie by chance
/// where a boulder of the map is expected. How many there are follows from the law of Golombek and Rapp
/// (sim/rocks.hpp): the map's own boulders above its smallest diameter give k, and the law goes on below it.
#pragma once

#include <vector>

#include "base/boulder_table.hpp"
#include "forecast/detection.hpp"

namespace cairn::ground {

/// Ground boulders per m^2 that the curve finds and the map is too coarse for. The map's smallest diameter is
/// the tenth percentile, k is sought in 0.001 to 0.5. 0 where the map holds fewer than 10 boulders, which
/// tell no law, or no area.
double unmapped_per_m2(const std::vector<TableBoulder>& boulders, const MapExtent& extent,
                       const DetectionCurve& curve);

}  // namespace cairn::ground
