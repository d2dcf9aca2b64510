/// Motion priors that wait for their stereo pairs. Each tells the camera's motion from the pair numbered one
/// before to the pair that it names, so that those of pairs that never come bridge the gap.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/fixed_vector.hpp"
#include "geometry/pose3.hpp"

namespace cairn::app {

class MotionPriors {
 public:
  static constexpr std::size_t kRoom = 16;

  void init() { *this = MotionPriors(); }
  /// In place of one of the same pair. Where there is no room the one that came first goes, unused.
  void put(std::uint32_t pair, const Pose3& T_prev_cur);
  /// Null where there is none; valid until the next `put` or `let_go`. It counts as used.
  const Pose3* of(std::uint32_t pair);
  /// Those of this pair and of earlier ones (numbers may wrap) ...
  void let_go(std::uint32_t pair);
  /// ... and all of them.
  void let_go_all();

  std::uint32_t unused() const { return unused_; }  ///< let go without ever having been asked for

 private:
  struct Waiting {
    std::uint32_t pair = 0;
    bool used = false;
    Pose3 T_prev_cur;
  };
  void remove(std::size_t i);

  FixedVector<Waiting, kRoom> waiting_;  ///< as they came
  std::uint32_t unused_ = 0;
};

}  // namespace cairn::app
