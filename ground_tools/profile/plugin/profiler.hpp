/// Follows a run block by block: calls and returns, caches, branches, and the clock of the model.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "profile/plugin/block.hpp"
#include "profile/plugin/cache.hpp"
#include "profile/plugin/call_tree.hpp"
#include "profile/plugin/symbols.hpp"
#include "profile/plugin/timing.hpp"

namespace cairn::profile {

struct ProfilerOptions {
  std::vector<std::string> watch;  ///< functions whose every call is told (plain names)
  std::string mark;                ///< each call of it begins a frame; none where empty
  long frame = -1;  ///< the frame to keep in detail; -1: the longest by what the watched functions spend
};

class Profiler {
 public:
  Profiler(const Timing& timing, std::vector<Symbol> symbols, const ProfilerOptions& options);

  /// The block begins to run.
  void enter(Block& block);
  /// `words` at `address`, by the instruction that is issued `offset` cycles after the block's end
  /// (so at most 0).
  void read(std::uint32_t address, std::uint32_t words, std::int32_t offset) {
    const Cache::Found found = data_.read(address, words);
    if (found != Cache::Found::kHit) read_missed(found, words, offset);
  }
  void write(std::uint32_t address, std::uint32_t words, std::int32_t offset) {
    const Cache::Found found = data_.write(address);
    if (timing_.write != 0) {
      write_through(words, offset);
    } else if (found != Cache::Found::kHit) {
      write_missed(found);
    }
  }
  const Timing& timing() const { return timing_; }
  const std::vector<Symbol>& symbols() const { return symbols_; }
  std::uint32_t fetch_line(std::uint32_t address) const { return code_.line_of(address); }

  /// Ends the run and writes what was found (format: ground_tools/profile/profile.hpp). `blocks`:
  /// all there were.
  void finish(std::FILE* out, const std::vector<Block*>& blocks);

 private:
  struct Misses {
    std::uint64_t fetch = 0;
    std::uint64_t data = 0;
    std::uint64_t stalled = 0;  ///< cycles
  };
  /// The delay slot that ran last in a block of its own, and where its jump goes.
  struct Slot {
    std::uint32_t at = ~0U;
    const Block* block = nullptr;
    Flow flow = Flow::kNext;
    std::uint32_t returns_to = 0;
  };
  struct FrameSpan {
    std::uint64_t at;  ///< instructions executed before it
    Cost whole;
    std::uint64_t watched_cycles;
  };

  Cost now() const { return {instructions_, clock_}; }
  bool trapped(const Block& block);
  void go(const Block& block);
  void returned(const Block& block);
  void jumped(const Block& block);
  void predict(const Block& from, bool taken);
  void fetch(const Block& block);
  void wait_for_bus(std::int32_t offset);
  void stall(std::uint32_t cycles);
  void read_missed(Cache::Found found, std::uint32_t words, std::int32_t offset);
  void write_missed(Cache::Found found);
  void write_through(std::uint32_t words, std::int32_t offset);
  void frame_begins();
  void frame_ends();

  Timing timing_;
  std::vector<Symbol> symbols_;
  CallTree tree_;
  Cache code_;
  Cache data_;
  InFlight in_flight_;
  std::vector<std::uint8_t> history_;
  std::vector<Misses> misses_;

  std::uint64_t instructions_ = 0;
  std::uint64_t clock_ = 0;
  std::uint64_t bus_free_ = 0;  ///< clock at which the write buffer is empty
  const Block* previous_ = nullptr;
  Flow flow_ = Flow::kNext;
  std::uint32_t returns_to_ = 0;
  bool in_slot_ = false;
  Slot slot_;
  int trap_table_ = -1;
  bool in_trap_ = false;
  bool after_trap_ = false;
  std::uint32_t last_line_ = ~0U;
  int function_ = 0;

  int mark_ = -1;
  long wanted_frame_;
  std::vector<FrameSpan> frames_;
  std::vector<CallTree::Node> before_;  ///< the tree when the frame began
  std::size_t watched_before_ = 0;
  Cost frame_at_;
  long detail_frame_ = -1;
  std::uint64_t detail_weight_ = 0;
  std::vector<CallTree::Node> detail_;  ///< what the frame in detail added
};

}  // namespace cairn::profile
