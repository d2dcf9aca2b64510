/// A planned drive: way-points from a file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/boulder_table.hpp"

namespace cairn::ground {

/// Reads a CSV table with columns x, y (or x_m, y_m), metres in the map's reference system; others are passed
/// over where they hold numbers. Two points or more, neighbours at least a millimetre apart.
///
/// Throws ToolError, one line: cannot be read, no such columns, not numbers, too few points, two alike, a
/// point outside `extent` (of the map that `map_name` tells).
std::vector<Vec2> read_waypoints(const std::filesystem::path& path, const MapExtent& extent,
                                 const std::string& map_name);

}  // namespace cairn::ground
