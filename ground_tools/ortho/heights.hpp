/// The ground's height under each boulder, from an elevation model.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "base/boulder_table.hpp"

namespace cairn::ground {

/// Sets ground_z_m of each boulder from `dem`, band 1 of any raster that GDAL opens, times its scale plus its
/// offset where it has them, in metres: of the unit of the band, else of the vertical system, metres where
/// neither is told. Heights are above what the model counts them from (geoid, ellipsoid, sphere). Bilinear
/// between the centres of the four pixels around; the outermost half pixel has the height of the nearest
/// centres. NaN outside, and where one of the pixels that count has no data. Boulders are taken to the
/// model's reference system where it is not `reference_system`; a model or a map without one counts as being
/// in the other's.
///
/// Returns how many heights are known. Boulders are looked up by blocks of the file:
/// memory does not grow with it.
///
/// Throws ToolError: cannot be opened or read, no geo-reference, systems that cannot be brought together (of
/// two bodies, say), an unknown unit, a scale of 0, not a single boulder on it.
std::size_t sample_heights(const std::filesystem::path& dem, std::vector<TableBoulder>& boulders,
                           const std::string& reference_system);

}  // namespace cairn::ground
