/// The assignment problem: pairs of rows and columns, each used once, with the least sum of costs or the most
/// votes (METHOD section B.2; the result of Munkres 1957).
///
/// Method: shortest augmenting paths with dual variables (Jonker & Volgenant, "A Shortest Augmenting Path
/// Algorithm for Dense and Sparse Linear Assignment Problems", Computing 38, 1987), without their
/// initialising heuristics: rows are added one by one, each along the cheapest alternating path by Dijkstra's
/// rule. It has the optimum of Munkres' starred zeros at O(n^2 m) operations with three short passes in place
/// of its covered lines, and cuts into even units.
///
/// Rectangular n x m: all of the shorter side is assigned. Several optima: the one found is the same on every
/// machine (the lowest column wins a tie); which one it is carries no meaning. Integers only, no rounding:
/// entries are 16 bits, dual variables stay within 1024 * 65535.
///
/// Cost: n m (path length) operations, n^2 m at worst for n <= m. Units: one column added to a path,
/// 4 m operations.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/nodiscard.hpp"
#include "core/work_budget.hpp"

namespace cairn {

enum class CAIRN_NODISCARD AssignmentStatus : std::uint8_t {
  kIdle,      ///< never started
  kRunning,   ///< call step() again
  kSolved,    ///< the optimum; no rows or no columns: nothing is assigned
  kTooLarge,  ///< more rows or columns than the job has room for
  kBadInput,  ///< no data, a negative size, or a stride below the number of columns
};

enum class AssignmentSense : std::uint8_t { kLeastCost, kMostVotes };

/// A borrowed matrix, row-major; it stays as it is until the job is done.
struct AssignmentMatrix {
  const std::uint16_t* data = nullptr;
  int rows = 0;
  int cols = 0;
  int stride = 0;  ///< entries from one row to the next
};

/// The algorithm on memory that its owner lends to it.
class AssignmentCore {
 public:
  static constexpr std::uint32_t unit_ops(int columns) { return 4U * static_cast<std::uint32_t>(columns); }
  static constexpr std::uint16_t kNone = 0xFFFF;

  /// `capacity` items each.
  struct Workspace {
    int capacity;
    std::int32_t* row_dual;
    std::int32_t* col_dual;
    std::int32_t* slack;        ///< of each column: cheapest known way to it
    std::uint16_t* col_before;  ///< the column before it on that way; kNone: the new row's own
    std::uint16_t* row_of_col;  ///< the assignment so far
    std::uint16_t* col_of_row;  ///< the result, by rows of the caller's matrix
    std::uint8_t* col_reached;  ///< column is in the tree
  };

  AssignmentStatus start(const AssignmentMatrix& matrix, AssignmentSense sense, const Workspace& w);
  Progress step(WorkBudget& budget, const Workspace& w);
  AssignmentStatus status() const { return status_; }
  std::int64_t total() const { return total_; }

 private:
  std::int32_t cost(int row, int col) const;
  void begin_row(const Workspace& w);
  void grow(const Workspace& w);
  void augment(const Workspace& w);
  void finish(const Workspace& w);

  AssignmentMatrix matrix_;
  AssignmentSense sense_ = AssignmentSense::kLeastCost;
  AssignmentStatus status_ = AssignmentStatus::kIdle;
  bool transposed_ = false;  ///< inside, rows are the shorter side
  int rows_ = 0;
  int cols_ = 0;
  int row_ = 0;       ///< the row being added
  int tip_row_ = 0;   ///< where the path grows from ...
  int tip_col_ = -1;  ///< ... and the column that it holds; -1 at the new row
  std::int64_t total_ = 0;
};

/// The job with its memory: up to `Capacity` rows and columns.
template <std::size_t Capacity>
class AssignmentJob {
  static_assert(Capacity >= 1 && Capacity <= 1024, "dual variables are 32 bits");

 public:
  static constexpr std::uint16_t kNone = AssignmentCore::kNone;

  /// kRunning, kSolved where there is nothing to assign, or what is wrong with the input.
  AssignmentStatus start(const AssignmentMatrix& matrix, AssignmentSense sense) {
    return core_.start(matrix, sense, workspace());
  }
  Progress step(WorkBudget& budget) { return core_.step(budget, workspace()); }  ///< same for every slicing
  AssignmentStatus status() const { return core_.status(); }

  /// Column of a row (row < rows of the matrix), or kNone. Once solved.
  std::uint16_t col_of_row(std::size_t row) const { return col_of_row_[row]; }
  /// Sum of the entries assigned, in either sense. Once solved.
  std::int64_t total() const { return core_.total(); }

 private:
  AssignmentCore::Workspace workspace() {
    return {static_cast<int>(Capacity),
            row_dual_,
            col_dual_,
            slack_,
            col_before_,
            row_of_col_,
            col_of_row_,
            col_reached_};
  }

  AssignmentCore core_;
  std::int32_t row_dual_[Capacity] = {};
  std::int32_t col_dual_[Capacity] = {};
  std::int32_t slack_[Capacity] = {};
  std::uint16_t col_before_[Capacity] = {};
  std::uint16_t row_of_col_[Capacity] = {};
  std::uint16_t col_of_row_[Capacity] = {};
  std::uint8_t col_reached_[Capacity] = {};
};

}  // namespace cairn
