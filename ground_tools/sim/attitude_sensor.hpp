/// What a rover's accelerometers and sun sensor would have read along a simulated drive.
///
/// A reading is due every AttitudeSensor::every_m of way, and taken in the next frame in which the rover
/// stands; on a way without stops, in the next frame at all, as if it stood.
///
///   gravity   up in the rover frame, R_map_rover' (0, 0, 1), turned about the rover's forward and left axes
///             by (bias + noise), each normal
///   heading   yaw in map + bias + noise
///
/// The sigma told is that of bias and noise together, which is what a rover's builders know; that part of it
/// is the same in all readings is not told.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "sim/scene.hpp"
#include "sim/traverse.hpp"

namespace cairn::ground::sim {

/// Where the rover stands in a frame of `plan`: T_map_rover.
using RoverPose = std::function<Pose3(std::size_t frame)>;

struct AttitudeReading {
  std::size_t frame = 0;
  Vec3 up_rover = Vec3(0.0, 0.0, 1.0);
  double yaw_rad = 0.0;  ///< counter-clockwise from east, within a turn of 0
};

struct AttitudeSigma {
  double gravity_rad = 0.0;
  double heading_rad = 0.0;
};
AttitudeSigma told_sigma(const AttitudeSensor& sensor);

/// By frame; none where the scene has none. The same for the same scene.
std::vector<AttitudeReading> read_attitude_sensors(const Scene& scene, const std::vector<PathPoint>& path,
                                                   const RoverPose& T_map_rover);

/// The table that `cairn run --attitude` reads.
std::string attitude_text(const AttitudeSensor& sensor, const std::vector<AttitudeReading>& readings);

}  // namespace cairn::ground::sim
