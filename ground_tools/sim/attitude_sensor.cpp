#include "sim/attitude_sensor.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/exp_log.hpp"
#include "core/trig.hpp"
#include "sim/hash_random.hpp"

namespace cairn::ground::sim {
namespace {

/// Number `k` of this reading: the drive's bias and the reading's noise.
double error_rad(const Scene& scene, Stream stream, std::size_t reading, std::uint64_t k, double bias_deg,
                 double noise_deg) {
  return kRadPerDeg * (bias_deg * normal(scene.seed, stream, 0, k) +
                       noise_deg * normal(scene.seed, stream, 1 + reading, k));
}

bool same_place(const PathPoint& a, const PathPoint& b) {
  return a.arc_m == b.arc_m && a.yaw_rad == b.yaw_rad;
}

}  // namespace

AttitudeSigma told_sigma(const AttitudeSensor& s) {
  return {kRadPerDeg * std::hypot(s.gravity_noise_deg, s.gravity_bias_deg),
          kRadPerDeg * std::hypot(s.heading_noise_deg, s.heading_bias_deg)};
}

std::vector<AttitudeReading> read_attitude_sensors(const Scene& scene, const std::vector<PathPoint>& path,
                                                   const RoverPose& T_map_rover) {
  const AttitudeSensor& sensor = scene.attitude;
  std::vector<AttitudeReading> out;
  if (!(sensor.every_m > 0.0)) return out;
  const bool stops = scene.traverse.kind == TraverseKind::kStopAndGo;
  double due_m = sensor.every_m;
  for (std::size_t i = 1; i < path.size(); ++i) {
    if (path[i].arc_m < due_m - 1.0e-9 || (stops && !same_place(path[i], path[i - 1]))) continue;
    const auto error = [&](Stream stream, std::uint64_t k, double bias_deg, double noise_deg) {
      return error_rad(scene, stream, out.size(), k, bias_deg, noise_deg);
    };
    const Pose3 T = T_map_rover(i);
    const Vec3 turn(error(Stream::kGravity, 0, sensor.gravity_bias_deg, sensor.gravity_noise_deg),
                    error(Stream::kGravity, 1, sensor.gravity_bias_deg, sensor.gravity_noise_deg), 0.0);
    const double yaw_rad = attitude_of(T.q).yaw_rad +
                           error(Stream::kHeading, 0, sensor.heading_bias_deg, sensor.heading_noise_deg);
    out.push_back({i, quat_exp(turn) * (T.q.conjugate() * Vec3(0.0, 0.0, 1.0)), yaw_rad});
    due_m = path[i].arc_m + sensor.every_m;
  }
  return out;
}

std::string attitude_text(const AttitudeSensor& sensor, const std::vector<AttitudeReading>& readings) {
  const AttitudeSigma sigma = told_sigma(sensor);
  std::string text = "frame,up_x,up_y,up_z,up_sigma_deg,yaw_deg,yaw_sigma_deg\n";
  for (const AttitudeReading& r : readings)
    text += fmt::format("{},{:.9f},{:.9f},{:.9f},{:.6g},{:.6f},{:.6g}\n", r.frame, r.up_rover.x(),
                        r.up_rover.y(), r.up_rover.z(), sigma.gravity_rad * kDegPerRad,
                        r.yaw_rad * kDegPerRad, sigma.heading_rad * kDegPerRad);
  return text;
}

}  // namespace cairn::ground::sim
