/// The way-points of a planned drive, in the forms in which planners keep them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/eigen.hpp"

namespace cairn::ground {

/// Reads a way for a map of the system `reference_system` (reference_system.hpp):
///   .csv, .txt, .tsv, .dat, none   a table as in base/waypoints.hpp; or, where it has a column `WKT` and
///                                  no `x`, points or a line of well-known text
///   all else                       a layer that GDAL opens: GeoPackage, GeoJSON, shapefile, KML, GPX
/// A layer holds one line, or points in the order in which they stand. Of several layers `way` or `drive`
/// counts, else there must be one. Of several lines that with the attribute kind = 'drive' counts, so that a
/// forecast's own layer can be read back.
///
/// Places of another system are taken to the map's. As they stand, as metres of the map: those of a table; of
/// a layer that names no system, or degrees that are none; and whatever the layer says where the map is a
/// local one, except a way that spans less than 0.1 of what it calls degrees.
///
/// Two points or more, neighbours at least a millimetre apart, metres of the map. Throws ToolError, one line.
std::vector<Vec2> read_way(const std::filesystem::path& path, const std::string& reference_system);

}  // namespace cairn::ground
