#include "forecast/sweep.hpp"

#include <algorithm>
#include <cmath>

#include "schedule.hpp"

namespace cairn::ground {

std::vector<PathPoint> drive_over(const std::vector<Vec2>& waypoints_map_m, double step_m,
                                  double turn_step_deg) {
  CAIRN_ASSERT(waypoints_map_m.size() >= 2);
  sim::Scene scene;
  scene.traverse.kind = sim::TraverseKind::kWaypoints;
  scene.traverse.waypoints_map_m = waypoints_map_m;
  scene.traverse.step_m = step_m;
  scene.traverse.turn_step_deg = turn_step_deg;
  return sim::plan(scene);
}

std::vector<std::size_t> fix_frames(std::size_t frames) {
  std::size_t begin = 0;
  for (const cfg::ScheduleRow& row : cfg::kSchedule) {
    if (row.task == cfg::Task::kFixBegin) begin = static_cast<std::size_t>(row.first_minor);
  }
  std::vector<std::size_t> all;
  for (std::size_t i = begin; i < frames; i += cfg::kMinorFrames) all.push_back(i);
  return all;
}

Sweep::Sweep(const StereoRig& rig, double max_range_m, const TrackParams& tracks)
    : rig_(rig),
      T_cam_rover_(rig.T_rover_cam.inverse()),
      max_range_m_(max_range_m),
      reach_m_(max_range_m + rig.T_rover_cam.t.head<2>().norm()),
      tracks_(tracks) {}

bool Sweep::in_view(const PathPoint& at, const Vec2& p_map_m) const {
  const Vec2 p_rover_m = Pose2{at.x_m, at.y_m, at.yaw_rad}.inverse() * p_map_m;
  if ((p_rover_m - rig_.T_rover_cam.t.head<2>()).norm() > max_range_m_) return false;
  const Vec3 p_cam_m = T_cam_rover_ * Vec3(p_rover_m.x(), p_rover_m.y(), 0.0);
  if (!(p_cam_m.z() > 0.0)) return false;
  const StereoPixel at_px = project(rig_, p_cam_m);
  return at_px.u_right >= 0.0 && at_px.u_left <= rig_.width_px - 1.0 && at_px.v_left >= 0.0 &&
         at_px.v_left <= rig_.height_px - 1.0;
}

std::size_t Sweep::first_of_window(std::size_t last) const {
  const auto window = static_cast<std::size_t>(tracks_.window_frames);
  return last > window ? last - window : 0;
}

int Sweep::frames_in_view(const std::vector<PathPoint>& drive, std::size_t last, const Vec2& p_map_m) const {
  int count = 0;
  for (std::size_t i = first_of_window(last); i <= last; ++i) count += in_view(drive[i], p_map_m) ? 1 : 0;
  return count;
}

std::vector<Vec2> Sweep::spots(const std::vector<PathPoint>& drive, std::size_t last, double cell_m) const {
  Vec2 low = Vec2::Constant(1.0e300);
  Vec2 high = Vec2::Constant(-1.0e300);
  for (std::size_t i = first_of_window(last); i <= last; ++i) {
    low = low.cwiseMin(Vec2(drive[i].x_m, drive[i].y_m));
    high = high.cwiseMax(Vec2(drive[i].x_m, drive[i].y_m));
  }
  const auto cells = [&](int axis) {
    return static_cast<int>(std::ceil((high[axis] - low[axis] + 2.0 * reach_m_) / cell_m));
  };
  std::vector<Vec2> found;
  for (int row = 0; row < cells(1); ++row) {
    for (int column = 0; column < cells(0); ++column) {
      const Vec2 spot = low - Vec2::Constant(reach_m_) + cell_m * Vec2(column + 0.5, row + 0.5);
      if (in_footprint(drive, last, spot)) found.push_back(spot);
    }
  }
  return found;
}

}  // namespace cairn::ground
