/// Who called whom, and what was spent there: a tree of calling contexts and totals by function.
#pragma once

#include <cstdint>
#include <vector>

namespace cairn::profile {

struct Cost {
  std::uint64_t instructions = 0;
  std::uint64_t cycles = 0;
};
inline Cost operator-(const Cost& a, const Cost& b) {
  return {a.instructions - b.instructions, a.cycles - b.cycles};
}

class CallTree {
 public:
  static constexpr std::size_t kMostNodes = 1U << 17;  ///< what goes beyond is counted with the caller
  static constexpr std::size_t kDeepest = 512;

  struct Node {
    std::uint32_t parent = 0;
    int function = 0;
    std::uint32_t child = 0;    ///< first; 0 for none
    std::uint32_t sibling = 0;  ///< next; 0 for none
    std::uint32_t latest = 0;   ///< child entered last
    std::uint64_t calls = 0;
    Cost self;
  };
  struct Total {
    std::uint64_t calls = 0;
    Cost inclusive;
    Cost longest;  ///< by cycles, of one call
    std::uint32_t active = 0;
  };
  struct Frame {
    std::uint32_t node;
    int function;
    std::uint32_t returns_to;
    bool tail;  ///< entered by a jump: returns together with the one below
    Cost at;
  };
  /// A call of a watched function, whole.
  struct Watched {
    int function;
    std::uint64_t at;  ///< instructions executed before it
    Cost cost;
  };

  explicit CallTree(std::size_t functions) : nodes_(1), totals_(functions), watch_(functions, 0) {}

  void watch(int function) { watch_[static_cast<std::size_t>(function)] = 1; }
  bool empty() const { return stack_.empty(); }
  const Frame& top() const { return stack_.back(); }
  const std::vector<Frame>& stack() const { return stack_; }
  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<Total>& totals() const { return totals_; }
  const std::vector<Watched>& watched() const { return watched_; }

  void enter(int function, std::uint32_t returns_to, bool tail, const Cost& now) {
    if (stack_.size() == kDeepest) return;
    settle(now);
    current_ = child_of(current_, function);
    ++nodes_[current_].calls;
    Total& total = totals_[static_cast<std::size_t>(function)];
    ++total.calls;
    ++total.active;
    stack_.push_back({current_, function, returns_to, tail, now});
  }

  /// Leaves frames until `depth` of them are left.
  void leave_to(std::size_t depth, const Cost& now) {
    settle(now);
    while (stack_.size() > depth) {
      const Frame frame = stack_.back();
      stack_.pop_back();
      current_ = stack_.empty() ? 0 : stack_.back().node;
      Total& total = totals_[static_cast<std::size_t>(frame.function)];
      if (--total.active != 0) continue;  // a call of itself: counted by the outer one
      const Cost spent = now - frame.at;
      total.inclusive.instructions += spent.instructions;
      total.inclusive.cycles += spent.cycles;
      if (spent.cycles > total.longest.cycles) total.longest.cycles = spent.cycles;
      if (spent.instructions > total.longest.instructions) total.longest.instructions = spent.instructions;
      if (watch_[static_cast<std::size_t>(frame.function)] != 0)
        watched_.push_back({frame.function, frame.at.instructions, spent});
    }
  }

  /// Books what was spent since the last time.
  void settle(const Cost& now) {
    Cost& self = nodes_[current_].self;
    self.instructions += now.instructions - booked_.instructions;
    self.cycles += now.cycles - booked_.cycles;
    booked_ = now;
  }

 private:
  std::uint32_t child_of(std::uint32_t parent, int function) {
    const std::uint32_t latest = nodes_[parent].latest;
    if (latest != 0 && nodes_[latest].function == function) return latest;
    std::uint32_t found = nodes_[parent].child;
    while (found != 0 && nodes_[found].function != function) found = nodes_[found].sibling;
    if (found == 0) {
      if (nodes_.size() == kMostNodes) return parent;
      found = static_cast<std::uint32_t>(nodes_.size());
      Node node;
      node.parent = parent;
      node.function = function;
      node.sibling = nodes_[parent].child;
      nodes_.push_back(node);
      nodes_[parent].child = found;
    }
    nodes_[parent].latest = found;
    return found;
  }

  std::vector<Node> nodes_;
  std::vector<Total> totals_;
  std::vector<char> watch_;
  std::vector<Frame> stack_;
  std::vector<Watched> watched_;
  std::uint32_t current_ = 0;
  Cost booked_;
};

}  // namespace cairn::profile
