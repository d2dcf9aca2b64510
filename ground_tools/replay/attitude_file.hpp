/// Attitudes that were measured along a drive: a table for `cairn run --attitude`.
///
///   frame      number of the stereo pair
///   up_x, up_y, up_z, up_sigma_deg
///              unit vector away from gravity in the rover frame, as accelerometers of a rover that stands
///              show it, and its standard deviation
///   yaw_deg, yaw_sigma_deg
///              heading in the map, counter-clockwise from east (a compass heading is 90 degrees minus it),
///              and its standard deviation
///
/// Fields of what was not measured are empty. That the rover stood is the word of whoever writes the row.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>

#include "app/telecommand.hpp"

namespace cairn::ground {

/// By the number of the pair.
using AttitudeTable = std::map<std::uint32_t, app::MeasuredAttitude>;

/// Throws ToolError with file and line: what the flight module would refuse, and a frame named twice.
AttitudeTable read_attitudes(const std::filesystem::path& path);

}  // namespace cairn::ground
