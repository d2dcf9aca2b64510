#include "profile/plugin/block.hpp"

#include <algorithm>

namespace cairn::profile {
namespace {

std::uint16_t limited(std::uint32_t cycles) {
  return static_cast<std::uint16_t>(std::min<std::uint32_t>(cycles, kNever - 1));
}

}  // namespace

Block make_block(const Timing& timing, std::uint32_t start, const std::vector<Instruction>& code) {
  Block out;
  out.start = start;
  out.length = static_cast<std::uint32_t>(code.size());
  out.end = start;
  std::fill(std::begin(out.slack), std::end(out.slack), kNever);
  std::uint32_t ready[kResources] = {};
  bool own[kResources] = {};
  std::uint32_t next = 0;  // cycle in which the next one can be issued
  const auto want = [&](int resource, std::uint32_t& at) {
    if (own[resource]) {
      at = std::max(at, ready[resource]);
    }
  };
  const auto note = [&](int resource, std::uint32_t at) {
    if (!own[resource]) out.slack[resource] = std::min(out.slack[resource], limited(at));
  };
  const auto set = [&](int resource, std::uint32_t when) {
    own[resource] = true;
    ready[resource] = when;
  };
  for (const Instruction& i : code) {
    out.last = out.end;
    out.end += i.bytes;
    const ClassCost& cost = timing.cost[static_cast<int>(i.kind)];
    out.ends_trap = out.ends_trap || i.ends_trap;
    ++out.counts[static_cast<int>(i.kind)];
    const int unit = cost.unit < 0 ? -1 : kRegisters + cost.unit;
    std::uint32_t at = next;
    for (int s = 0; s < i.sources; ++s) want(i.source[s], at);
    if (unit >= 0) want(unit, at);
    for (int s = 0; s < i.sources; ++s) note(i.source[s], at);
    if (unit >= 0) note(unit, at);
    out.issued.push_back(at);
    for (int t = 0; t < i.targets; ++t) {
      const bool flags = i.target[t] == kFlags || i.target[t] == kFloatFlags;
      set(i.target[t], at + static_cast<std::uint32_t>(flags ? cost.flags : cost.latency));
    }
    if (unit >= 0) set(unit, at + static_cast<std::uint32_t>(cost.busy));
    next = at + static_cast<std::uint32_t>(cost.issue + cost.per_word * i.words);
  }
  out.cycles = next;
  for (int r = 0; r < kResources; ++r) {
    if (own[r] && ready[r] > next) {
      out.pending.push_back({static_cast<std::uint8_t>(r), limited(ready[r] - next)});
    }
  }
  return out;
}

}  // namespace cairn::profile
