/// A folder that `cairn run` wrote, read back for the report.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

namespace cairn::ground {

/// What the page needs of one run, as one JSON object:
///   name       the folder's name
///   summary    summary.json
///   paths      {truth, vo, corrected}: x, y, x, y ... in map, m
///   errors     {distance_m, vo, corrected}, each of the latter {xy_m, xyz_m, rotation_deg, yaw_deg};
///              null where there is no truth
///   frames     the columns of frames.csv, and distance_m along the true path (the corrected
///              one without truth)
///   fixes      the columns of fixes.csv, and of each: distance_m; x_m, y_m (corrected camera);
///              before_m, after_m (error in x, y; null without truth)
///   pairs      {frame, x_m, y_m, map_x_m, map_y_m} of applied fixes
///   ground     {id, x, y, size, sightings}; orbital {x_m, y_m, diameter_m}
///   ortho, stride, strips    pictures.json
///
/// Throws ToolError, one line with the file and the mend: no folder, a file missing, cut off, not of this
/// form, or of another run than the others.
nlohmann::ordered_json read_run_folder(const std::filesystem::path& folder);

}  // namespace cairn::ground
