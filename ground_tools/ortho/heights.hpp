/// The ground's height at places of a map, from an elevation model.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "base/boulder_table.hpp"
#include "core/eigen.hpp"

namespace cairn::ground {

struct GroundHeights {
  std::vector<double> z_m;  ///< for each place; NaN where unknown
  std::size_t known = 0;
  double pixel_m = 0.0;  ///< of the model, in metres of the map; 0 where it has none of the places
};

/// Of `places` (frame `map`) from `dem`, band 1 of any raster that GDAL opens, times its scale plus its
/// offset where it has them, in metres: of the unit of the band, else of the vertical system, metres where
/// neither is told, and turned round where its vertical system counts down (depths). Heights are above what
/// the model counts them from (geoid, ellipsoid, sphere). Bilinear between the centres of the four pixels
/// around; the outermost half pixel has the height of the nearest centres. NaN outside, and where one of the
/// pixels that count has no data. Places are taken to the model's reference system where it is not
/// `reference_system`; a model or a map without one counts as being in the other's.
///
/// They are looked up by blocks of the file: memory does not grow with it.
///
/// Throws ToolError: cannot be opened or read, no geo-reference, systems that cannot be brought together (of
/// two bodies, say), an unknown unit, a scale of 0, a picture in colours; voids that nothing marks: around
/// the places, pixels of one value more than 50 m, and four times what all others span, from the next.
GroundHeights heights_at(const std::filesystem::path& dem, const std::vector<Vec2>& places,
                         const std::string& reference_system);

/// Sets ground_z_m of each boulder; returns how many heights are known. Throws ToolError where not a single
/// boulder is on the model, too.
std::size_t sample_heights(const std::filesystem::path& dem, std::vector<TableBoulder>& boulders,
                           const std::string& reference_system);

}  // namespace cairn::ground
