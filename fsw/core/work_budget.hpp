/// Work is budgeted in operations, not in time, so that a slice is the same on every machine.
///
/// One operation is about one inner-loop step (a multiply-add on a pixel, a byte of a descriptor compared). A
/// job splits its work into units (a row, a feature, an iteration) of bounded cost and asks before each one.
///
/// Smallest budget that makes progress: 1 (0 grants nothing). The first unit asked of a budget is always
/// granted, so a step overspends by at most one unit; `spent()` says by how much.
#pragma once

#include <cstdint>

#include "core/nodiscard.hpp"

namespace cairn {

/// What a job's `step` says.
enum class CAIRN_NODISCARD Progress : std::uint8_t {
  kMore,  ///< the budget ran out first: call `step` again
  kDone,  ///< nothing left to do: read `status()` and `result()`
};

class WorkBudget {
 public:
  explicit constexpr WorkBudget(std::uint32_t ops) : ops_(ops) {}

  /// A budget that never runs out: a job's whole work in one step.
  static constexpr WorkBudget unlimited() { return WorkBudget(UINT32_MAX); }

  /// True: do the unit of `cost` operations now. False: come back with another budget.
  [[nodiscard]] bool take(std::uint32_t cost) {
    const std::uint64_t after = spent_ + cost;
    if (spent_ > 0 && after > ops_ && ops_ != UINT32_MAX) return false;
    if (ops_ == 0) return false;
    spent_ = after;
    return true;
  }
  /// Books work that was done on another budget.
  void charge(std::uint64_t ops) { spent_ += ops; }
  std::uint64_t spent() const { return spent_; }
  std::uint32_t ops() const { return ops_; }
  /// What is left for another job in the same slice (0 when overspent).
  std::uint32_t left() const {
    if (ops_ == UINT32_MAX) return UINT32_MAX;
    return spent_ >= ops_ ? 0U : static_cast<std::uint32_t>(ops_ - spent_);
  }

 private:
  std::uint32_t ops_;
  std::uint64_t spent_ = 0;
};

}  // namespace cairn
