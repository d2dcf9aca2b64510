/// What the flight module saw in a few chosen frames: for `cairn report`.
///
/// Each chosen frame is told with the two kept before it, `kStride` frames apart, so that the labels of
/// boulders can be followed over time. The chain of labels itself goes from frame to frame, as the flight
/// module votes: a boulder keeps its number as long as each frame finds it again.
#pragma once

#include <cstddef>
#include <deque>
#include <nlohmann/json.hpp>
#include <vector>

#include "replay/replay.hpp"

namespace cairn::ground {

class PictureRecorder {
 public:
  static constexpr std::size_t kStride = 4;
  static constexpr std::size_t kStrip = 3;  ///< pictures of one chosen frame, itself the last

  /// Chooses up to `count` frames of [first, end), each in the middle of an equal share.
  PictureRecorder(std::size_t count, std::size_t first, std::size_t end);

  /// For ReplayOptions::watch: to be called after every frame, while app::root holds what it made of it.
  void watch(const ReplayFrame& frame, const host::Picture& left);

  /// A list of strips, each a list of frames (doc/guide/drives.md tells the keys).
  const nlohmann::ordered_json& strips() const { return strips_; }

 private:
  void follow_labels();
  nlohmann::ordered_json frame_json(const ReplayFrame& frame, const host::Picture& left,
                                    bool with_regions) const;

  std::vector<std::size_t> chosen_;    ///< indices into the data set, rising
  std::vector<std::uint32_t> labels_;  ///< chain number of each sighting of the last frame that had any
  std::uint32_t next_label_ = 1;
  std::deque<std::pair<std::size_t, nlohmann::ordered_json>>
      before_;  ///< pictures that a strip may begin with
  nlohmann::ordered_json strips_ = nlohmann::ordered_json::array();
};

}  // namespace cairn::ground
