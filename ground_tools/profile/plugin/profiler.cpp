#include "profile/plugin/profiler.hpp"

#include <cinttypes>
#include <cstdio>

#include "profile/function_name.hpp"

namespace cairn::profile {

Profiler::Profiler(const Timing& timing, std::vector<Symbol> symbols, const ProfilerOptions& options)
    : timing_(timing),
      symbols_(std::move(symbols)),
      tree_(symbols_.size()),
      code_(timing.instruction_cache),
      data_(timing.data_cache),
      history_(static_cast<std::size_t>(timing.history_entries), 1),
      misses_(symbols_.size()),
      wanted_frame_(options.frame) {
  for (std::size_t i = 1; i < symbols_.size(); ++i) {
    if (!timing_.trap_table.empty() && symbols_[i].name == timing_.trap_table)
      trap_table_ = static_cast<int>(i);
    if (is_fragment(symbols_[i].name)) continue;
    const std::string name = plain_name(symbols_[i].name);
    for (const std::string& watched : options.watch) {
      if (name == watched) tree_.watch(static_cast<int>(i));
    }
    if (name == options.mark) mark_ = static_cast<int>(i);
  }
}

void Profiler::enter(Block& block) {
  if (!trapped(block)) {
    const bool slot = in_slot_ && block.start == previous_->end;
    const bool again =
        previous_ != nullptr && slot_.at == block.start && (after_trap_ || previous_ == slot_.block);
    after_trap_ = false;
    in_slot_ = false;
    if (slot) {
      slot_ = {block.start, &block, flow_, returns_to_};
    } else if (again) {
      flow_ = slot_.flow;
      returns_to_ = slot_.returns_to;
    } else {
      if (previous_ != nullptr) go(block);
      flow_ = block.flow;
      returns_to_ = block.end + (block.slot_missing ? 4 : 0);
      in_slot_ = block.slot_missing;
    }
    if (tree_.empty()) tree_.enter(block.function, ~0U, false, now());
  }
  function_ = block.function;
  ++block.runs;
  fetch(block);
  clock_ += in_flight_.wait(block, clock_) + block.cycles;
  instructions_ += block.length;
  in_flight_.after(block, clock_);
  previous_ = &block;
}

/// What a trap does counts where it struck; then all goes on as if it had not been. The instruction that met
/// it, which runs once more, may have been a jump's delay slot.
bool Profiler::trapped(const Block& block) {
  if (block.function == trap_table_ && !in_trap_) {
    in_trap_ = true;
    clock_ += static_cast<std::uint64_t>(timing_.trap);
  } else if (in_trap_ && previous_->ends_trap) {
    in_trap_ = false;
    after_trap_ = true;
    in_slot_ = false;
    flow_ = Flow::kNext;
  }
  return in_trap_;
}

/// What the end of the block before has led to.
void Profiler::go(const Block& block) {
  switch (flow_) {
    case Flow::kNext: return;
    case Flow::kBranch:
      predict(*previous_, block.start != previous_->end);
      jumped(block);
      return;
    case Flow::kJump:
      clock_ += static_cast<std::uint64_t>(timing_.taken);
      jumped(block);
      return;
    case Flow::kIndirect:
      if (timing_.isa == Isa::kPpc && block.start == previous_->end)
        return;  // a conditional return that was none
      clock_ += static_cast<std::uint64_t>(timing_.taken);
      returned(block);
      return;
    case Flow::kCall:
    case Flow::kIndirectCall:
      if (block.start == returns_to_) return;  // `bcl 20,31,.+4` asks for its own address; or not taken
      clock_ += static_cast<std::uint64_t>(timing_.taken);
      if (block.function == mark_) frame_begins();
      tree_.enter(block.function, returns_to_, false, now());
      return;
  }
}

void Profiler::returned(const Block& block) {
  const std::vector<CallTree::Frame>& stack = tree_.stack();
  const bool home = !stack.empty() && stack.back().returns_to == block.start;
  if (!home && !stack.empty() && stack.back().function == block.function) return;  // a switch
  for (std::size_t depth = stack.size(); depth > 0; --depth) {
    if (stack[depth - 1].returns_to != block.start) continue;
    while (depth > 1 && stack[depth - 1].tail) --depth;
    return tree_.leave_to(depth - 1, now());
  }
  jumped(block);
}

/// To another function without a call: a call in the tail, or the way back from a long jump or, on SPARC,
/// from a function that returns a struct (four bytes further).
void Profiler::jumped(const Block& block) {
  const std::vector<CallTree::Frame>& stack = tree_.stack();
  if (stack.empty() || block.function == stack.back().function || block.function == 0) return;
  if (block.start == symbols_[static_cast<std::size_t>(block.function)].start) {
    if (block.function == mark_) frame_begins();
    tree_.enter(block.function, stack.back().returns_to, true, now());
    return;
  }
  for (std::size_t depth = stack.size(); depth > 0; --depth) {
    if (stack[depth - 1].function == block.function) return tree_.leave_to(depth, now());
  }
}

/// Two-bit counters by address, as many as the processor has.
void Profiler::predict(const Block& from, bool taken) {
  if (taken) clock_ += static_cast<std::uint64_t>(timing_.taken);
  if (history_.empty()) return;
  std::uint8_t& counter = history_[(from.last >> 2) & (history_.size() - 1)];
  if ((counter >= 2) != taken) clock_ += static_cast<std::uint64_t>(timing_.mispredicted);
  if (taken && counter < 3) ++counter;
  if (!taken && counter > 0) --counter;
}

void Profiler::fetch(const Block& block) {
  for (std::uint32_t line = block.first_line; line <= block.last_line; ++line) {
    if (line == last_line_) continue;
    last_line_ = line;
    if (code_.read(line * code_.line_bytes(), 1) == Cache::Found::kHit) continue;
    ++misses_[static_cast<std::size_t>(function_)].fetch;
    wait_for_bus(0);
    stall(static_cast<std::uint32_t>(timing_.fetch_miss));
  }
}

void Profiler::stall(std::uint32_t cycles) {
  clock_ += cycles;
  misses_[static_cast<std::size_t>(function_)].stalled += cycles;
}

/// Until the write buffer is empty.
void Profiler::wait_for_bus(std::int32_t offset) {
  const std::uint64_t at = clock_ + static_cast<std::uint64_t>(static_cast<std::int64_t>(offset));
  if (bus_free_ > at) stall(static_cast<std::uint32_t>(bus_free_ - at));
}

void Profiler::read_missed(Cache::Found found, std::uint32_t words, std::int32_t offset) {
  ++misses_[static_cast<std::size_t>(function_)].data;
  wait_for_bus(offset);
  stall(static_cast<std::uint32_t>(timing_.read_miss + (words > 1 ? timing_.read_miss_word : 0) +
                                   (found == Cache::Found::kMissCastOut ? timing_.cast_out : 0)));
}

void Profiler::write_missed(Cache::Found found) {
  ++misses_[static_cast<std::size_t>(function_)].data;
  stall(static_cast<std::uint32_t>(timing_.write_miss +
                                   (found == Cache::Found::kMissCastOut ? timing_.cast_out : 0)));
}

void Profiler::write_through(std::uint32_t words, std::int32_t offset) {
  wait_for_bus(offset);
  bus_free_ = clock_ + static_cast<std::uint64_t>(static_cast<std::int64_t>(offset)) +
              static_cast<std::uint64_t>(timing_.write + (words > 1 ? timing_.write_word : 0));
}

void Profiler::frame_begins() {
  frame_ends();
  tree_.settle(now());
  before_ = tree_.nodes();
  watched_before_ = tree_.watched().size();
  frame_at_ = now();
  frames_.push_back({instructions_, {}, 0});
}

/// Keeps what the frame added where it is the wanted or the longest one.
void Profiler::frame_ends() {
  if (frames_.empty()) return;
  tree_.settle(now());
  FrameSpan& span = frames_.back();
  span.whole = now() - frame_at_;
  const auto& watched = tree_.watched();
  // Calls come in the order of their ends: one that began before that holds the others.
  std::uint64_t until = 0;
  for (std::size_t i = watched.size(); i-- > watched_before_;) {
    if (until != 0 && watched[i].at >= until) continue;
    span.watched_cycles += watched[i].cost.cycles;
    until = watched[i].at;
  }
  const long index = static_cast<long>(frames_.size()) - 1;
  if (wanted_frame_ >= 0 ? index != wanted_frame_
                         : detail_frame_ >= 0 && span.watched_cycles <= detail_weight_)
    return;
  detail_frame_ = index;
  detail_weight_ = span.watched_cycles;
  detail_ = tree_.nodes();
  for (std::size_t i = 0; i < before_.size(); ++i) {
    detail_[i].calls -= before_[i].calls;
    detail_[i].self = detail_[i].self - before_[i].self;
  }
}

void Profiler::finish(std::FILE* out, const std::vector<Block*>& blocks) {
  tree_.leave_to(0, now());
  frame_ends();
  std::vector<std::uint64_t> counts(symbols_.size() * kClasses, 0);
  for (const Block* b : blocks) {
    for (int c = 0; c < kClasses; ++c)
      counts[static_cast<std::size_t>(b->function) * kClasses + static_cast<std::size_t>(c)] +=
          b->runs * b->counts[c];
  }
  std::fprintf(out, "cairn-profile\t1\nprocessor\t%s\nclock_mhz\t%.6f\n", timing_.name.c_str(),
               timing_.clock_mhz);
  std::fprintf(out, "total\t%" PRIu64 "\t%" PRIu64 "\nclasses", instructions_, clock_);
  for (const char* name : kClassNames) std::fprintf(out, "\t%s", name);
  std::fputc('\n', out);
  for (std::size_t i = 0; i < symbols_.size(); ++i) {
    const CallTree::Total& t = tree_.totals()[i];
    std::uint64_t executed = 0;
    for (int c = 0; c < kClasses; ++c) executed += counts[i * kClasses + static_cast<std::size_t>(c)];
    if (executed == 0 && t.calls == 0) continue;
    std::fprintf(out,
                 "function\t%zu\t%s\t%" PRIu64 "\t%" PRIu64 "\t%" PRIu64 "\t%" PRIu64 "\t%" PRIu64
                 "\t%" PRIu64 "\t%" PRIu64 "\t%" PRIu64,
                 i, symbols_[i].name.c_str(), t.calls, t.inclusive.instructions, t.inclusive.cycles,
                 t.longest.instructions, t.longest.cycles, misses_[i].fetch, misses_[i].data,
                 misses_[i].stalled);
    for (int c = 0; c < kClasses; ++c)
      std::fprintf(out, "\t%" PRIu64, counts[i * kClasses + static_cast<std::size_t>(c)]);
    std::fputc('\n', out);
  }
  const auto& nodes = tree_.nodes();
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const bool seen = i < detail_.size();
    std::fprintf(out,
                 "node\t%zu\t%" PRIu32 "\t%d\t%" PRIu64 "\t%" PRIu64 "\t%" PRIu64 "\t%" PRIu64 "\t%" PRIu64
                 "\t%" PRIu64 "\n",
                 i, nodes[i].parent, nodes[i].function, nodes[i].calls, nodes[i].self.instructions,
                 nodes[i].self.cycles, seen ? detail_[i].calls : 0, seen ? detail_[i].self.instructions : 0,
                 seen ? detail_[i].self.cycles : 0);
  }
  for (const FrameSpan& f : frames_)
    std::fprintf(out, "frame\t%" PRIu64 "\t%" PRIu64 "\t%" PRIu64 "\n", f.at, f.whole.instructions,
                 f.whole.cycles);
  for (const CallTree::Watched& w : tree_.watched())
    std::fprintf(out, "call\t%d\t%" PRIu64 "\t%" PRIu64 "\t%" PRIu64 "\n", w.function, w.at,
                 w.cost.instructions, w.cost.cycles);
  std::fprintf(out, "detail\t%ld\nend\n", detail_frame_);
}

}  // namespace cairn::profile
