/// A stretch of straight code with what it costs, worked out once by a scoreboard.
///
/// One instruction is issued in a cycle, in order. It waits for its operands and for a unit that is busy
/// (divide, square root); a branch that is folded takes no cycle of its own. Times are those of a run in
/// which everything from before is ready and all memory is in the cache; what is still under way when the
/// block begins is made up for by `slack` and `pending` (InFlight below), and misses are added
/// where they happen.
#pragma once

#include <cstdint>
#include <vector>

#include "profile/plugin/timing.hpp"

namespace cairn::profile {

inline constexpr int kResources = kRegisters + kUnits;
inline constexpr std::uint16_t kNever = 0xffff;

struct Block {
  struct Pending {
    std::uint8_t resource;
    std::uint16_t cycles;  ///< after the block's end
  };

  std::uint32_t start = 0;
  std::uint32_t end = 0;     ///< the address after it
  std::uint32_t last = 0;    ///< of its last instruction
  std::uint32_t length = 0;  ///< instructions
  std::uint32_t cycles = 0;
  int function = 0;
  Flow flow = Flow::kNext;
  bool slot_missing = false;  ///< SPARC: ends with the jump; its delay slot is a block of its own
  bool ends_trap = false;     ///< SPARC rett
  std::uint32_t first_line = 0;
  std::uint32_t last_line = 0;
  std::uint64_t runs = 0;
  std::vector<Pending> pending;       ///< results and units that are not ready at the end
  std::vector<std::uint32_t> issued;  ///< cycle in which each instruction is issued
  std::uint16_t slack[kResources];    ///< cycle in which it is first wanted from outside, or kNever
  std::uint16_t counts[kClasses] = {};
};

Block make_block(const Timing& timing, std::uint32_t start, const std::vector<Instruction>& code);

/// Results under way between blocks.
class InFlight {
 public:
  /// Cycles that `next` has to wait when it begins at `clock`.
  std::uint32_t wait(const Block& next, std::uint64_t clock) const {
    std::uint64_t longest = 0;
    for (int i = 0; i < count_; ++i) {
      const std::uint16_t slack = next.slack[items_[i].resource];
      const std::uint64_t wanted = clock + slack;
      if (slack != kNever && items_[i].ready > wanted) {
        const std::uint64_t late = items_[i].ready - wanted;
        longest = late > longest ? late : longest;
      }
    }
    return static_cast<std::uint32_t>(longest);
  }
  /// Takes over what `done` leaves under way when it ends at `clock`.
  void after(const Block& done, std::uint64_t clock) {
    int kept = 0;
    for (int i = 0; i < count_; ++i) {
      if (items_[i].ready > clock) items_[kept++] = items_[i];
    }
    count_ = kept;
    for (const Block::Pending& p : done.pending) {
      if (count_ < kMost) items_[count_++] = {p.resource, clock + p.cycles};
    }
  }

 private:
  static constexpr int kMost = 64;
  struct Item {
    std::uint8_t resource;
    std::uint64_t ready;
  };
  int count_ = 0;
  Item items_[kMost];
};

}  // namespace cairn::profile
