/// Where the rover stands in each frame.
#pragma once

#include <functional>
#include <vector>

#include "sim/scene.hpp"

namespace cairn::ground::sim {

/// One frame: T_map_rover seen from above, and the way so far.
struct PathPoint {
  double x_m = 0.0;
  double y_m = 0.0;
  double yaw_rad = 0.0;  ///< in (-pi, pi], counter-clockwise from east
  double arc_m = 0.0;    ///< travelled, slip included
};

/// The frames of a scene's traverse, at least one: every step_m along the way (a step before a turn in place
/// is shorter, so that the turn is where it belongs; what remains at the end is left out), every
/// turn_step_deg or less in a turn. 100 m by 0.06 m are 1667 frames. The heading is along the way. Slip
/// adds up: the rover does not know of it. Pure: depends on scene.seed and scene.traverse (scene.site for the
/// centring) alone. Asks for a scene whose numbers are in range (load_scene sees to that).
std::vector<PathPoint> plan(const Scene& scene);

/// Height of the ground at (x, y) of the map frame, metres.
using GroundHeight = std::function<double(double x_m, double y_m)>;

/// T_map_rover: the rover on the least-squares plane through the ground under its six wheels (0.5 m before,
/// beside and behind the origin, 0.4 m to either side), as an averaging suspension has it. The origin is on
/// that plane at (x, y); body x forward, y left, z up; R = Rz(yaw) Ry(pitch) Rx(roll), nose up is negative
/// pitch. Wheels are placed as if the rover were level: at 10 degrees of tilt they are 8 mm off.
Pose3 settle(const PathPoint& at, const GroundHeight& ground_height);

}  // namespace cairn::ground::sim
