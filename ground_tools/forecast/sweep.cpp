#include "forecast/sweep.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/waypoints.hpp"
#include "schedule.hpp"

namespace cairn::ground {

namespace {

/// The way in as few legs as lie within kWayWidth_m of its points (Douglas and Peucker 1973).
std::vector<Vec2> legs_of(const std::vector<Vec2>& way) {
  std::vector<bool> keeps(way.size(), false);
  keeps.front() = keeps.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, way.size() - 1}};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    std::size_t farthest = first;
    double most_m = kWayWidth_m;
    for (std::size_t i = first + 1; i < last; ++i) {
      const double off_m = distance_m(way[i], way[first], way[last]);
      if (off_m <= most_m) continue;
      farthest = i;
      most_m = off_m;
    }
    if (farthest == first) continue;
    keeps[farthest] = true;
    open.emplace_back(first, farthest);
    open.emplace_back(farthest, last);
  }
  std::vector<Vec2> legs;
  for (std::size_t i = 0; i < way.size(); ++i) {
    if (keeps[i]) legs.push_back(way[i]);
  }
  return legs;
}

/// Frames one after another; where the last one stands on its leg.
class Frames {
 public:
  Frames(double step_m, double turn_step_deg) : step_m_(step_m), turn_step_rad_(turn_step_deg * kRadPerDeg) {}

  void leg(const Vec2& from, const Vec2& to) {
    const Vec2 way = to - from;
    const double yaw_rad = std::atan2(way.y(), way.x());
    if (frames_.empty()) {
      frames_.push_back({from.x(), from.y(), yaw_rad, 0.0});
    } else {
      turn(from, wrap_angle(yaw_rad - yaw_rad_));
    }
    yaw_rad_ = yaw_rad;
    const double end_m = arc_m_ + way.norm();
    for (; next_m() <= end_m + 1.0e-9 * step_m_ * (steps_ + 2.0); ++steps_) {
      const Vec2 at = from + (next_m() - arc_m_) / way.norm() * way;
      frames_.push_back({at.x(), at.y(), yaw_rad, next_m()});
    }
    arc_m_ = end_m;
  }

  std::vector<PathPoint> take() { return std::move(frames_); }

 private:
  double next_m() const { return run_m_ + (steps_ + 1.0) * step_m_; }

  /// In place, but for what is driven through.
  void turn(const Vec2& at, double angle_rad) {
    if (std::fabs(angle_rad) <= kSteeredRad) return;
    if (arc_m_ - frames_.back().arc_m > 1.0e-6) frames_.push_back({at.x(), at.y(), yaw_rad_, arc_m_});
    const int parts = static_cast<int>(std::ceil(std::fabs(angle_rad) / turn_step_rad_ - 1.0e-9));
    for (int i = 1; i <= parts; ++i)
      frames_.push_back({at.x(), at.y(), wrap_angle(yaw_rad_ + angle_rad * i / parts), arc_m_});
    run_m_ = arc_m_;
    steps_ = 0.0;
  }

  double step_m_;
  double turn_step_rad_;
  std::vector<PathPoint> frames_;
  double yaw_rad_ = 0.0;
  double arc_m_ = 0.0;  ///< of the end of the last leg
  double run_m_ = 0.0;  ///< of the last turn in place: frames lie step_m apart from there
  double steps_ = 0.0;  ///< since then
};

}  // namespace

std::vector<PathPoint> drive_over(const std::vector<Vec2>& waypoints_map_m, double step_m,
                                  double turn_step_deg) {
  CAIRN_ASSERT(waypoints_map_m.size() >= 2);
  const std::vector<Vec2> legs = legs_of(waypoints_map_m);
  Frames frames(step_m, turn_step_deg);
  for (std::size_t i = 1; i < legs.size(); ++i) frames.leg(legs[i - 1], legs[i]);
  return frames.take();
}

std::vector<std::size_t> fix_frames(std::size_t frames) {
  std::vector<std::size_t> all;
  for (std::size_t i = cfg::kFixBeginMinor; i < frames; i += cfg::kMinorFrames) all.push_back(i);
  return all;
}

Sweep::Sweep(const StereoRig& rig, double max_range_m, const TrackParams& tracks, double window_m)
    : rig_(rig),
      T_cam_rover_(rig.T_rover_cam.inverse()),
      max_range_m_(max_range_m),
      reach_m_(max_range_m + rig.T_rover_cam.t.head<2>().norm()),
      tracks_(tracks),
      window_m_(window_m) {}

bool Sweep::in_pictures(const Vec2& p_rover_m) const {
  const Vec3 p_cam_m = T_cam_rover_ * Vec3(p_rover_m.x(), p_rover_m.y(), 0.0);
  if (!(p_cam_m.z() > 0.0)) return false;
  const StereoPixel at_px = project(rig_, p_cam_m);
  return at_px.u_right >= 0.0 && at_px.u_left <= rig_.width_px - 1.0 && at_px.v_left >= 0.0 &&
         at_px.v_left <= rig_.height_px - 1.0;
}

bool Sweep::in_view(const PathPoint& at, const Vec2& p_map_m, double radius_m) const {
  const Vec2 p_rover_m = Pose2{at.x_m, at.y_m, at.yaw_rad}.inverse() * p_map_m;
  const Vec2 ray_m = p_rover_m - rig_.T_rover_cam.t.head<2>();
  const double far_m = ray_m.norm();
  if (far_m > max_range_m_ || !in_pictures(p_rover_m)) return false;
  if (radius_m == 0.0) return true;
  const Vec2 along_m = radius_m / far_m * ray_m;
  const Vec2 across_m(-along_m.y(), along_m.x());
  return in_pictures(p_rover_m - along_m) && in_pictures(p_rover_m + across_m) &&
         in_pictures(p_rover_m - across_m);
}

std::size_t Sweep::first_of_window(const std::vector<PathPoint>& drive, std::size_t last) const {
  if (window_m_ > 0.0) {
    std::size_t first = last;
    while (first > 0 && drive[last].arc_m - drive[first - 1].arc_m <= window_m_) --first;
    return first;
  }
  const auto window = static_cast<std::size_t>(tracks_.window_frames);
  return last > window ? last - window : 0;
}

SpotView Sweep::view_of(const std::vector<PathPoint>& drive, std::size_t last, const Vec2& p_map_m,
                        double radius_m) const {
  SpotView view;
  for (std::size_t i = first_of_window(drive, last); i <= last; ++i) {
    const double far_m = (p_map_m - Vec2(drive[i].x_m, drive[i].y_m)).norm();
    if (far_m > reach_m_ || !in_view(drive[i], p_map_m, radius_m)) continue;
    view.nearest_m = view.frames == 0 ? far_m : std::min(view.nearest_m, far_m);
    view.last_arc_m = drive[i].arc_m;
    ++view.frames;
  }
  return view;
}

std::vector<Vec2> Sweep::spots(const std::vector<PathPoint>& drive, std::size_t last, double cell_m) const {
  Vec2 low = Vec2::Constant(1.0e300);
  Vec2 high = Vec2::Constant(-1.0e300);
  for (std::size_t i = first_of_window(drive, last); i <= last; ++i) {
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
