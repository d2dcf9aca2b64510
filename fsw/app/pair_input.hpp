/// What commands bring for stereo pairs that have not come yet, each by the number of its pair.
///
/// A motion prior tells the camera's motion from the pair numbered one before to the pair that it names, so
/// that those of pairs that never come bridge the gap. An attitude is of its pair alone.
#pragma once

#include <cstddef>
#include <cstdint>

#include "app/telecommand.hpp"
#include "core/fixed_vector.hpp"
#include "geometry/pose3.hpp"

namespace cairn::app {

template <typename Content>
class PairInput {
 public:
  static constexpr std::size_t kRoom = 16;

  void init() { *this = PairInput(); }
  /// In place of one of the same pair. Where there is no room the one that came first goes, unused.
  void put(std::uint32_t pair, const Content& content) {
    for (Waiting& w : waiting_) {
      if (w.pair == pair) {
        w.content = content;
        return;
      }
    }
    if (waiting_.full()) remove(0);
    waiting_.append({pair, false, content});
  }
  /// Null where there is none; valid until the next `put` or `let_go`. It counts as used.
  const Content* of(std::uint32_t pair) {
    for (Waiting& w : waiting_) {
      if (w.pair != pair) continue;
      w.used = true;
      return &w.content;
    }
    return nullptr;
  }
  /// Those of this pair and of earlier ones (numbers may wrap) ...
  void let_go(std::uint32_t pair) {
    for (std::size_t i = waiting_.size(); i > 0; --i) {
      const std::uint32_t ahead = waiting_[i - 1].pair - pair;
      if (ahead == 0 || ahead >= 0x80000000U) remove(i - 1);
    }
  }
  /// ... and all of them.
  void let_go_all() {
    while (!waiting_.empty()) remove(waiting_.size() - 1);
  }

  std::uint32_t unused() const { return unused_; }  ///< let go without ever having been asked for

 private:
  struct Waiting {
    std::uint32_t pair = 0;
    bool used = false;
    Content content;
  };
  void remove(std::size_t i) {
    if (!waiting_[i].used) ++unused_;
    for (; i + 1 < waiting_.size(); ++i) waiting_[i] = waiting_[i + 1];
    waiting_.resize(waiting_.size() - 1);
  }

  FixedVector<Waiting, kRoom> waiting_;  ///< as they came
  std::uint32_t unused_ = 0;
};

using MotionPriors = PairInput<Pose3>;
using Attitudes = PairInput<MeasuredAttitude>;

}  // namespace cairn::app
