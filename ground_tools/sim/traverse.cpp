#include "sim/traverse.hpp"

#include <algorithm>
#include <cmath>

#include "core/trig.hpp"
#include "sim/hash_random.hpp"

namespace cairn::ground::sim {
namespace {

/// A piece of the commanded way: an arc (or straight, curvature 0), or a turn in place (length 0).
struct Piece {
  double length_m;
  double curvature_per_m;
  double turn_rad;
};

struct Nominal {
  Pose2 pose;
  double arc_m;
};

Pose2 along(double length_m, double curvature_per_m) {
  const double yaw = length_m * curvature_per_m;
  if (std::fabs(yaw) < 1.0e-9) return {length_m, 0.5 * length_m * yaw, yaw};
  return {std::sin(yaw) / curvature_per_m, (1.0 - std::cos(yaw)) / curvature_per_m, yaw};
}

std::vector<Piece> two_arcs(const Traverse& t) {
  const double curvature = 1.0 / (t.radius_m != 0.0 ? t.radius_m : 0.5 * t.length_m / kPi);
  return {{0.5 * t.length_m, curvature, 0.0}, {0.5 * t.length_m, -curvature, 0.0}};
}

std::vector<Piece> zigzag(const Traverse& t) {
  std::vector<Piece> pieces;
  double turn_rad = -2.0 * t.zigzag_deg * kRadPerDeg;
  for (double left_m = t.length_m; left_m > 1.0e-9; left_m -= t.leg_m) {
    if (!pieces.empty()) {
      pieces.push_back({0.0, 0.0, turn_rad});
      turn_rad = -turn_rad;
    }
    pieces.push_back({std::min(left_m, t.leg_m), 0.0, 0.0});
  }
  return pieces;
}

std::vector<Piece> between_waypoints(const std::vector<Vec2>& points) {
  std::vector<Piece> pieces;
  double yaw_rad = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Vec2 leg = points[i] - points[i - 1];
    const double next_rad = std::atan2(leg.y(), leg.x());
    const double turn_rad = wrap_angle(next_rad - yaw_rad);
    if (i > 1 && std::fabs(turn_rad) > 1.0e-9) pieces.push_back({0.0, 0.0, turn_rad});
    pieces.push_back({leg.norm(), 0.0, 0.0});
    yaw_rad = next_rad;
  }
  return pieces;
}

std::vector<Piece> pieces_of(const Traverse& t) {
  switch (t.kind) {
    case TraverseKind::kS:
    case TraverseKind::kStopAndGo: return two_arcs(t);
    case TraverseKind::kStraight: return {{t.length_m, 0.0, 0.0}};
    case TraverseKind::kArc:
      return {{t.length_m, t.radius_m != 0.0 ? 1.0 / t.radius_m : 0.5 * kPi / t.length_m, 0.0}};
    case TraverseKind::kZigzag: return zigzag(t);
    case TraverseKind::kPointTurn:
      return {
          {0.5 * t.length_m, 0.0, 0.0}, {0.0, 0.0, t.turn_deg * kRadPerDeg}, {0.5 * t.length_m, 0.0, 0.0}};
    case TraverseKind::kWaypoints: return between_waypoints(t.waypoints_map_m);
  }
  return {};
}

/// Heading in which the first piece begins.
double first_yaw_rad(const Traverse& t) {
  if (t.kind == TraverseKind::kWaypoints) {
    const Vec2 leg = t.waypoints_map_m[1] - t.waypoints_map_m[0];
    return std::atan2(leg.y(), leg.x());
  }
  return (t.start_heading_deg + (t.kind == TraverseKind::kZigzag ? t.zigzag_deg : 0.0)) * kRadPerDeg;
}

/// Samples the commanded way, from the origin of its own frame.
class Sampler {
 public:
  explicit Sampler(const Traverse& t) : t_(t) { frames_.push_back({Pose2{}, 0.0}); }

  /// Frames lie step_m apart, pieces of different curvature or not.
  void drive(const Piece& piece) {
    const double end_m = piece_arc_m_ + piece.length_m;
    for (;;) {
      const double next_m = run_arc_m_ + (steps_ + 1) * t_.step_m;
      if (next_m > end_m + 1.0e-9 * t_.step_m * (steps_ + 2)) break;
      ++steps_;
      add(piece_start_ * along(next_m - piece_arc_m_, piece.curvature_per_m), next_m);
    }
    piece_start_ = piece_start_ * along(piece.length_m, piece.curvature_per_m);
    piece_arc_m_ = end_m;
  }

  void turn(double angle_rad) {
    if (piece_arc_m_ - frames_.back().arc_m > 1.0e-6) add(piece_start_, piece_arc_m_);
    const int parts =
        static_cast<int>(std::ceil(std::fabs(angle_rad) / (t_.turn_step_deg * kRadPerDeg) - 1.0e-9));
    for (int i = 1; i <= parts; ++i) {
      frames_.push_back({piece_start_ * Pose2{0.0, 0.0, angle_rad * i / parts}, piece_arc_m_});
    }
    piece_start_ = piece_start_ * Pose2{0.0, 0.0, angle_rad};
    run_arc_m_ = piece_arc_m_;
    steps_ = 0;
  }

  const std::vector<Nominal>& frames() const { return frames_; }

 private:
  void add(const Pose2& pose, double arc_m) {
    frames_.push_back({pose, arc_m});
    if (t_.kind != TraverseKind::kStopAndGo || arc_m < next_stop_m()) return;
    ++stops_;
    frames_.insert(frames_.end(), static_cast<std::size_t>(t_.stop_frames), frames_.back());
  }
  double next_stop_m() const { return (stops_ + 1) * t_.stop_every_m - 1.0e-9; }

  const Traverse& t_;
  std::vector<Nominal> frames_;
  Pose2 piece_start_;
  double piece_arc_m_ = 0.0;
  double run_arc_m_ = 0.0;  ///< where the last turn was: steps count from there
  int steps_ = 0;
  int stops_ = 0;
};

/// Start of the way in the map frame.
Pose2 start_pose(const Scene& scene, const std::vector<Nominal>& frames) {
  const Traverse& t = scene.traverse;
  Pose2 start{0.0, 0.0, first_yaw_rad(t)};
  if (t.kind == TraverseKind::kWaypoints) {
    start.x_m = t.waypoints_map_m[0].x();
    start.y_m = t.waypoints_map_m[0].y();
    return start;
  }
  if (t.start_x_m && t.start_y_m) {
    start.x_m = *t.start_x_m;
    start.y_m = *t.start_y_m;
    return start;
  }
  Vec2 low(0.0, 0.0);
  Vec2 high(0.0, 0.0);
  for (const Nominal& frame : frames) {
    const Vec2 p = start * frame.pose.translation();
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  start.x_m = scene.site.origin_x_m + 0.5 * (scene.site.width_m - low.x() - high.x());
  start.y_m = scene.site.origin_y_m + 0.5 * (scene.site.height_m - low.y() - high.y());
  return start;
}

}  // namespace

std::vector<PathPoint> plan(const Scene& scene) {
  const Traverse& t = scene.traverse;
  Sampler sampler(t);
  for (const Piece& piece : pieces_of(t)) {
    if (piece.turn_rad != 0.0) {
      sampler.turn(piece.turn_rad);
    } else {
      sampler.drive(piece);
    }
  }
  const std::vector<Nominal>& frames = sampler.frames();
  Pose2 pose = start_pose(scene, frames);
  std::vector<PathPoint> path{{pose.x_m, pose.y_m, wrap_angle(pose.yaw_rad), 0.0}};
  double arc_m = 0.0;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    Pose2 step = frames[i - 1].pose.inverse() * frames[i].pose;
    const double step_m = frames[i].arc_m - frames[i - 1].arc_m;
    Draw draw(scene.seed, Stream::kSlip, i);
    const double kept = 1.0 - draw.uniform(0.0, 2.0 * t.slip);
    const double aside = draw.uniform(-t.slip_sideways, t.slip_sideways);
    step.x_m *= kept;
    step.y_m = kept * step.y_m + aside * step_m;
    pose = pose * step;
    arc_m += step_m * std::hypot(kept, aside);
    path.push_back({pose.x_m, pose.y_m, pose.yaw_rad, arc_m});
  }
  return path;
}

Pose3 settle(const PathPoint& at, const GroundHeight& ground_height) {
  constexpr double kWheelX[] = {0.5, 0.0, -0.5};
  constexpr double kWheelY = 0.4;
  const SinCos yaw = sin_cos(at.yaw_rad);
  // The wheels' pattern is symmetric: the normal equations of z = z0 + a x + b y fall apart.
  double sum = 0.0;
  double sum_x = 0.0;
  double sum_y = 0.0;
  double xx = 0.0;
  for (const double x : kWheelX) {
    for (const double y : {kWheelY, -kWheelY}) {
      const double z = ground_height(at.x_m + yaw.cos * x - yaw.sin * y, at.y_m + yaw.sin * x + yaw.cos * y);
      sum += z;
      sum_x += x * z;
      sum_y += y * z;
      xx += x * x;
    }
  }
  const double a = sum_x / xx;
  const double b = sum_y / (6.0 * kWheelY * kWheelY);
  Attitude attitude;
  attitude.yaw_rad = at.yaw_rad;
  attitude.pitch_rad = -cairn::atan2(a, 1.0);
  attitude.roll_rad = cairn::atan2(b, std::sqrt(1.0 + a * a));
  return {quat_from_attitude(attitude), Vec3(at.x_m, at.y_m, sum / 6.0)};
}

}  // namespace cairn::ground::sim
