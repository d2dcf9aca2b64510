#include "sim/simulated_drive.hpp"

#include <cmath>
#include <utility>

#include "base/parallel.hpp"
#include "base/tool_error.hpp"
#include "mission_cfg.hpp"

namespace cairn::ground::sim {

PairImages take_pair(const World& world, std::size_t frame) {
  const Scene& scene = world.scene();
  const Pose3 T_map_rover = world.T_map_rover(frame);
  PairImages pair;
  FloatImage radiance;
  world.render(left_view(scene.rig, T_map_rover), scene.sun, radiance);
  expose(radiance, scene.camera, scene.seed, static_cast<int>(frame), Side::kLeft, pair.left);
  world.render(right_view(scene.rig, T_map_rover), scene.sun, radiance);
  expose(radiance, scene.camera, scene.seed, static_cast<int>(frame), Side::kRight, pair.right);
  return pair;
}

std::vector<TruthRock> truth_rocks(const World& world) {
  std::vector<TruthRock> rocks;
  for (const Rock& rock : world.rocks()) {
    if (rock.diameter_m < world.scene().rocks.min_diameter_m) break;  // the largest come first
    rocks.push_back(
        {static_cast<int>(rocks.size()), rock.p_map_m, rock.z_ground_map_m, rock.diameter_m, rock.height_m});
  }
  return rocks;
}

SimulatedDrive::SimulatedDrive(const World& world, std::string name)
    : world_(world),
      name_(std::move(name)),
      rig_(stereo_rig(world.scene().rig)),
      rocks_(sim::truth_rocks(world)) {
  const Pose3 flown =
      mast_pose(cfg::kMission.camera_height_m, cfg::kMission.camera_pitch_down_rad, rig_.baseline_m);
  if ((flown.t - rig_.T_rover_cam.t).norm() > 1e-6 ||
      (flown.inverse() * rig_.T_rover_cam).q.vec().norm() > 1e-6) {
    throw ToolError(
        "{}: its rig '{}' is not mounted as that of mission '{}'; build with the MISSION of this rig", name_,
        world.scene().rig.name, cfg::kMission.name);
  }
  rig_.T_rover_cam = Pose3();  // the mission's, as for any drive
}

PairImages SimulatedDrive::images(std::size_t index) const {
  std::future<PairImages> wanted;
  {
    const std::lock_guard lock(guard_);
    ahead_.erase(ahead_.begin(), ahead_.lower_bound(index));
    for (std::size_t i = index; i < size() && i <= index + core_count(); ++i) {
      if (ahead_.find(i) == ahead_.end())
        ahead_[i] = std::async(std::launch::async, [this, i] { return take_pair(world_, i); });
    }
    wanted = std::move(ahead_.at(index));
    ahead_.erase(index);
  }
  return wanted.get();
}

std::optional<Pose3> SimulatedDrive::truth_cam(std::size_t index) const {
  return left_view(world_.scene().rig, world_.T_map_rover(index)).T_map_cam;
}

}  // namespace cairn::ground::sim
