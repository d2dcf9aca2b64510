/// What a replay drives over: stereo pairs, their rig, and truth where it is known. From disk (dataset.hpp)
/// or rendered as it is asked for (sim/simulated_drive.hpp).
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "dataset/image.hpp"
#include "geometry/stereo_rig.hpp"

namespace cairn::ground {

struct TruthRock {
  int id = 0;
  Vec2 p_map_m = Vec2(0.0, 0.0);
  double z_ground_map_m = 0.0;
  double diameter_m = 0.0;
  double height_m = 0.0;
};

struct FrameTag {
  int number = 0;        ///< a data set's file name where it is a number, else the position in the order
  double stamp_s = 0.0;  ///< the number where there are no times
};

struct PairImages {
  Image left;  ///< without pixels where there is none
  Image right;
  std::vector<std::string> faults;  ///< one line for each that is there and cannot be read
};

class Drive {
 public:
  virtual ~Drive() = default;

  /// For messages: the folder, or the scene.
  virtual std::string name() const = 0;
  /// T_rover_cam stays identity: where the rig sits is the mission's.
  virtual const StereoRig& rig() const = 0;
  virtual std::size_t size() const = 0;
  virtual FrameTag tag(std::size_t index) const = 0;
  virtual PairImages images(std::size_t index) const = 0;
  /// T_map_cam (left camera) and T_map_rover of the frame at `index`; empty where they are not known.
  virtual std::optional<Pose3> truth_cam(std::size_t index) const = 0;
  virtual std::optional<Pose3> truth_rover(std::size_t index) const = 0;
  /// Empty where they are not known.
  virtual const std::vector<TruthRock>& truth_rocks() const = 0;
};

}  // namespace cairn::ground
