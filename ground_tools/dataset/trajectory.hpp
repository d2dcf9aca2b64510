/// Trajectories: TUM files, and their errors against truth.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "geometry/pose3.hpp"

namespace cairn::ground {

struct StampedPose {
  double stamp_s = 0.0;
  Pose3 pose;
};
using Trajectory = std::vector<StampedPose>;

/// TUM text, a line a pose: `stamp tx ty tz qx qy qz qw`, 9 decimals, after one comment line.
std::string to_tum(const Trajectory& trajectory);

/// Reads such a file. Throws ToolError where a line has not 8 numbers, a quaternion is not of unit length (to
/// 1e-3), or stamps do not increase.
Trajectory read_tum(const std::filesystem::path& path);

/// The pose stamped within `tolerance_s` of `stamp_s`; null where there is none.
const StampedPose* find_stamp(const Trajectory& trajectory, double stamp_s, double tolerance_s = 1.0e-3);

/// Error of one pose. Position errors are estimated minus true, in the map frame.
struct PoseError {
  double stamp_s = 0.0;
  double distance_m = 0.0;        ///< along the true path since the first compared pose
  double estimated_away_m = 0.0;  ///< of the estimate from the first compared one
  Vec3 position_map_m = Vec3(0.0, 0.0, 0.0);
  double xy_m = 0.0;
  double xyz_m = 0.0;
  double rotation_deg = 0.0;  ///< arccos((trace(R_est^-1 R_true) - 1) / 2), in [0, 180]
  double yaw_deg = 0.0;       ///< turn about the map's z of R_est R_true^-1, signed
};

struct TrajectoryErrors {
  std::vector<PoseError> poses;   ///< one for each estimate that has a true pose; never empty
  double path_m = 0.0;            ///< length of the true path over the compared poses
  double estimated_path_m = 0.0;  ///< of the estimate's over the same
  PoseError end;                  ///< of the last compared pose
  PoseError largest_xy;           ///< the compared pose with the largest xy error (the first of equals)
  double rms_xy_m = 0.0;

  /// An error as a share of the path; 0 where the path has no length.
  double percent_of_path(double error_m) const { return path_m > 0.0 ? 100.0 * error_m / path_m : 0.0; }
};

/// Compares poses of equal stamps (to 1 ms); empty where no stamp agrees. Nothing is aligned:
/// both are in one frame.
std::optional<TrajectoryErrors> compare(const Trajectory& estimate, const Trajectory& truth);

}  // namespace cairn::ground
