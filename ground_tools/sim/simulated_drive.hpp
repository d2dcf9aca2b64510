/// A drive that is rendered as it is asked for: no files between the simulator and the flight module.
#pragma once

#include <cstddef>
#include <future>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "dataset/drive.hpp"
#include "sim/world.hpp"

namespace cairn::ground::sim {

/// The images of one frame, as the cameras give them.
PairImages take_pair(const World& world, std::size_t frame);

/// Rocks of the scene's smallest diameter and more; pebbles are no rocks.
std::vector<TruthRock> truth_rocks(const World& world);

class SimulatedDrive : public Drive {
 public:
  /// Throws ToolError where the rig sits otherwise than the mission's: the flight module would not know.
  SimulatedDrive(const World& world, std::string name);

  std::string name() const override { return name_; }
  const StereoRig& rig() const override { return rig_; }
  std::size_t size() const override { return world_.path().size(); }
  FrameTag tag(std::size_t index) const override {
    return {static_cast<int>(index), static_cast<double>(index)};
  }
  /// Renders frame `index`, and the next ones ahead of their time on the other cores.
  PairImages images(std::size_t index) const override;
  std::optional<Pose3> truth_cam(std::size_t index) const override;
  std::optional<Pose3> truth_rover(std::size_t index) const override { return world_.T_map_rover(index); }
  const std::vector<TruthRock>& truth_rocks() const override { return rocks_; }

 private:
  const World& world_;
  std::string name_;
  StereoRig rig_;
  std::vector<TruthRock> rocks_;
  mutable std::mutex guard_;
  mutable std::map<std::size_t, std::future<PairImages>> ahead_;
};

}  // namespace cairn::ground::sim
