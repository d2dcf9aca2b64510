/// The numbers of a processor model, as read from platform/<target>/timing.toml.
#pragma once

#include <string>
#include <vector>

#include "profile/plugin/cache.hpp"
#include "profile/plugin/instruction.hpp"

namespace cairn::profile {

inline constexpr int kUnits = 8;

struct ClassCost {
  int issue = 1;     ///< cycles until the next instruction can be issued
  int per_word = 0;  ///< more for each word of memory
  int latency = 1;   ///< cycles until a result can be used
  int flags = 1;     ///< the same for the flags
  int unit = -1;     ///< -1: none that could be busy
  int busy = 0;      ///< cycles that the unit takes no other
};

enum class Isa : std::uint8_t { kPpc, kSparc, kRiscv };

struct Timing {
  std::string name;
  Isa isa = Isa::kPpc;
  double clock_mhz = 0.0;
  int taken = 0;
  int mispredicted = 0;
  int history_entries = 0;
  std::string trap_table;  ///< symbol at which traps enter; empty for none
  int trap = 0;            ///< cycles until its first instruction
  ClassCost cost[kClasses];
  CacheShape instruction_cache;
  int fetch_miss = 0;
  CacheShape data_cache;
  int read_miss = 0;
  int read_miss_word = 0;  ///< more for the second word, where sub-blocks are fetched
  int write_miss = 0;
  int cast_out = 0;
  int write = 0;       ///< cycles that the write buffer is busy with a word (write-through)
  int write_word = 0;  ///< more for a second one
};

/// Throws std::runtime_error, one line with the file and the mend. `variant` names a table [variant.NAME] of
/// the file, another board than the file's: `memory` multiplies the cycles of memory, `cache` the bytes of
/// both caches, and its table `class` stands for those of [class] that it names.
Timing read_timing(const std::string& path, const std::string& variant = {});

/// What mission_cfg/timing_budget.toml asks to look at.
struct Watch {
  std::string frame;               ///< each call of it begins a frame
  std::vector<std::string> calls;  ///< functions whose every call is told
};
Watch read_watch(const std::string& path);

}  // namespace cairn::profile
