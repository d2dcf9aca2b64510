#include "dataset/trajectory.hpp"

#include <algorithm>
#include <cmath>

#include "base/number_table.hpp"
#include "base/tool_error.hpp"

namespace cairn::ground {

std::string to_tum(const Trajectory& trajectory) {
  std::string text = "# stamp tx ty tz qx qy qz qw\n";
  for (const StampedPose& at : trajectory) {
    const Vec3& t = at.pose.t;
    const Quat& q = at.pose.q;
    text += fmt::format("{:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", at.stamp_s, t.x(), t.y(),
                        t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

Trajectory read_tum(const std::filesystem::path& path) {
  Trajectory trajectory;
  for (const NumberRow& row : read_number_rows(path, 8, "stamp tx ty tz qx qy qz qw")) {
    const std::vector<double>& v = row.values;
    const Quat q(v[7], v[4], v[5], v[6]);
    if (std::fabs(q.norm() - 1.0) > 1.0e-3) {
      throw ToolError("{}:{}: the quaternion's length is {:.6f}; give qx qy qz qw of length 1", path.string(),
                      row.line, q.norm());
    }
    if (!trajectory.empty() && v[0] <= trajectory.back().stamp_s) {
      throw ToolError("{}:{}: stamp {} is not after the one before it; sort the lines", path.string(),
                      row.line, v[0]);
    }
    trajectory.push_back({v[0], {q.normalized(), Vec3(v[1], v[2], v[3])}});
  }
  return trajectory;
}

const StampedPose* find_stamp(const Trajectory& trajectory, double stamp_s, double tolerance_s) {
  const auto above = std::lower_bound(trajectory.begin(), trajectory.end(), stamp_s - tolerance_s,
                                      [](const StampedPose& at, double stamp) { return at.stamp_s < stamp; });
  if (above == trajectory.end() || above->stamp_s > stamp_s + tolerance_s) return nullptr;
  const auto next = above + 1;  // of two within the tolerance, the nearer
  const bool next_is_nearer =
      next != trajectory.end() && std::fabs(next->stamp_s - stamp_s) < std::fabs(above->stamp_s - stamp_s);
  return &*(next_is_nearer ? next : above);
}

std::optional<TrajectoryErrors> compare(const Trajectory& estimate, const Trajectory& truth) {
  TrajectoryErrors errors;
  const StampedPose* before = nullptr;
  Vec3 estimated_start_m = Vec3(0.0, 0.0, 0.0), estimated_before_m = Vec3(0.0, 0.0, 0.0);
  double sum_xy = 0.0;
  for (const StampedPose& at : estimate) {
    const StampedPose* const truly = find_stamp(truth, at.stamp_s);
    if (truly == nullptr) continue;
    if (before != nullptr) {
      errors.path_m += (truly->pose.t - before->pose.t).norm();
      errors.estimated_path_m += (at.pose.t - estimated_before_m).norm();
    } else {
      estimated_start_m = at.pose.t;
    }
    before = truly;
    estimated_before_m = at.pose.t;

    PoseError error;
    error.stamp_s = at.stamp_s;
    error.distance_m = errors.path_m;
    error.estimated_away_m = (at.pose.t - estimated_start_m).norm();
    error.position_map_m = at.pose.t - truly->pose.t;
    error.xy_m = error.position_map_m.head<2>().norm();
    error.xyz_m = error.position_map_m.norm();
    const Quat turn = at.pose.q * truly->pose.q.conjugate();  // same angle as R_est^-1 R_true
    error.rotation_deg = quat_log(turn).norm() * kDegPerRad;
    error.yaw_deg = attitude_of(turn).yaw_rad * kDegPerRad;
    errors.poses.push_back(error);

    sum_xy += error.xy_m * error.xy_m;
    if (errors.poses.size() == 1 || error.xy_m > errors.largest_xy.xy_m) errors.largest_xy = error;
  }
  if (errors.poses.empty()) return std::nullopt;
  errors.end = errors.poses.back();
  errors.rms_xy_m = std::sqrt(sum_xy / static_cast<double>(errors.poses.size()));
  return errors;
}

}  // namespace cairn::ground
