/// Which stereo pair comes next: a pair that is there twice, or that was overtaken, must not move the pose.
///
/// By number (32 bits, which may wrap) and time of capture (0 where the camera knows none):
///
///   number ahead of the last by | time as the last's, or later               | time before it
///   1                           | kNext                                      | kOld
///   2 and more                  | kGap                                       | kOld
///   0                           | later: kRenumbered, the same: kRepeated    | kOld
///   less                        | later: kRenumbered, the same: kOld         | kOld
///
/// A camera that begins its numbers anew is believed where its clock went on; where that begins anew, too,
/// after kRestartedAfter pairs, each the next of the one before, or the rover would never see again.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/enum_count.hpp"
#include "core/nodiscard.hpp"

namespace cairn::app {

enum class CAIRN_NODISCARD PairStatus : std::uint8_t {
  kFirst,       ///< of this application
  kNext,        ///< to be used, like the first
  kGap,         ///< to be used; pairs before it never came
  kRenumbered,  ///< to be used; how many are missing is not known
  kRepeated,    ///< to be let go
  kOld,         ///< to be let go: a later one was used already
};
inline constexpr std::size_t kPairStatusCount = 6;
static_assert(enum_has<PairStatus, kPairStatusCount>());

class PairOrder {
 public:
  static constexpr int kRestartedAfter = 8;
  /// Missing before a pair that is renumbered: a guess, so that what may have been is not left out.
  static constexpr std::uint32_t kUnknownGap = 8;

  void init() { *this = PairOrder(); }
  /// Where the pair is to be used, it becomes the last.
  PairStatus judge(std::uint32_t number, std::uint64_t t_capture_us);

  PairStatus status() const { return status_; }     ///< of the last judged
  std::uint32_t missed() const { return missed_; }  ///< before the last that was used

 private:
  struct Pair {
    std::uint32_t number = 0;
    std::uint64_t t_capture_us = 0;
  };
  static PairStatus after(const Pair& last, const Pair& pair);

  bool any_ = false;
  Pair last_;    ///< used
  Pair let_go_;  ///< the last of a row
  int row_ = 0;  ///< of pairs let go, each the next of the one before
  PairStatus status_ = PairStatus::kFirst;
  std::uint32_t missed_ = 0;
};

inline bool to_be_used(PairStatus status) {
  return status != PairStatus::kRepeated && status != PairStatus::kOld;
}

}  // namespace cairn::app
