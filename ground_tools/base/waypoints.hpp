/// The way-points of a planned drive.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/boulder_table.hpp"

namespace cairn::ground {

/// Reads a CSV table with columns x and y (or x_m, y_m), metres in the map's reference system; other columns
/// are passed over. Two points or more, neighbours at least a millimetre apart.
///
/// Throws ToolError, one line: cannot be read, no such columns, not numbers, too few points, two alike.
std::vector<Vec2> read_waypoints(const std::filesystem::path& path);

/// All within the range of longitudes and latitudes.
bool in_degrees(const std::vector<Vec2>& points);

/// Throws ToolError that names `name` where these are fewer than two, or two neighbours are one.
void check_way(const std::vector<Vec2>& points, const std::string& name);

/// Throws ToolError where a point lies outside `extent`, which is that of the map `map_name`.
void check_waypoints(const std::vector<Vec2>& p_map_m, const MapExtent& extent, const std::string& map_name);

/// Of a point from the leg between two way-points.
double distance_m(const Vec2& p, const Vec2& from, const Vec2& to);

}  // namespace cairn::ground
