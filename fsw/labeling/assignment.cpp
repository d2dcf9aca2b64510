#include "labeling/assignment.hpp"

#include "core/assert.hpp"

namespace cairn {
namespace {

constexpr std::int32_t kFar = 0x7FFFFFFF;

}  // namespace

AssignmentStatus AssignmentCore::start(const AssignmentMatrix& matrix, AssignmentSense sense,
                                       const Workspace& w) {
  matrix_ = matrix;
  sense_ = sense;
  total_ = 0;
  const bool known = sense == AssignmentSense::kLeastCost || sense == AssignmentSense::kMostVotes;
  if (!known || matrix.rows < 0 || matrix.cols < 0 || matrix.stride < matrix.cols ||
      (matrix.data == nullptr && matrix.rows > 0 && matrix.cols > 0)) {
    return status_ = AssignmentStatus::kBadInput;
  }
  if (matrix.rows > w.capacity || matrix.cols > w.capacity) return status_ = AssignmentStatus::kTooLarge;
  transposed_ = matrix.rows > matrix.cols;
  rows_ = transposed_ ? matrix.cols : matrix.rows;
  cols_ = transposed_ ? matrix.rows : matrix.cols;
  for (int j = 0; j < cols_; ++j) {
    w.col_dual[j] = 0;
    w.row_of_col[j] = kNone;
  }
  for (int i = 0; i < matrix.rows; ++i) w.col_of_row[i] = kNone;
  row_ = 0;
  if (rows_ == 0) return status_ = AssignmentStatus::kSolved;
  begin_row(w);
  return status_ = AssignmentStatus::kRunning;
}

std::int32_t AssignmentCore::cost(int row, int col) const {
  const int r = transposed_ ? col : row;
  const int c = transposed_ ? row : col;
  const std::int32_t entry = matrix_.data[static_cast<std::ptrdiff_t>(r) * matrix_.stride + c];
  return sense_ == AssignmentSense::kLeastCost ? entry : -entry;
}

void AssignmentCore::begin_row(const Workspace& w) {
  w.row_dual[row_] = 0;
  tip_row_ = row_;
  tip_col_ = -1;
  for (int j = 0; j < cols_; ++j) {
    w.slack[j] = kFar;
    w.col_before[j] = kNone;
    w.col_reached[j] = 0;
  }
}

/// Looks at every column from the tip's row, adds the nearest one to the tree and moves the tip there. The
/// duals are kept such that reduced costs are never negative, and zero along the tree.
void AssignmentCore::grow(const Workspace& w) {
  std::int32_t delta = kFar;
  int nearest = -1;
  for (int j = 0; j < cols_; ++j) {
    if (w.col_reached[j] != 0) continue;
    const std::int32_t reduced = cost(tip_row_, j) - w.row_dual[tip_row_] - w.col_dual[j];
    if (reduced < w.slack[j]) {
      w.slack[j] = reduced;
      w.col_before[j] = tip_col_ < 0 ? kNone : static_cast<std::uint16_t>(tip_col_);
    }
    if (w.slack[j] < delta) {
      delta = w.slack[j];
      nearest = j;
    }
  }
  CAIRN_ASSERT(nearest >= 0);  // fewer columns reached than there are, as rows <= columns
  w.row_dual[row_] += delta;
  for (int j = 0; j < cols_; ++j) {
    if (w.col_reached[j] != 0) {
      w.row_dual[w.row_of_col[j]] += delta;
      w.col_dual[j] -= delta;
    } else {
      w.slack[j] -= delta;
    }
  }
  w.col_reached[nearest] = 1;
  tip_col_ = nearest;
  if (w.row_of_col[nearest] != kNone) tip_row_ = w.row_of_col[nearest];
}

/// The tip is a free column: each column on the path takes the row of the one before it.
void AssignmentCore::augment(const Workspace& w) {
  int col = tip_col_;
  for (int length = 0; length <= cols_ && w.col_before[col] != kNone; ++length) {
    const std::uint16_t before = w.col_before[col];
    w.row_of_col[col] = w.row_of_col[before];
    col = before;
  }
  w.row_of_col[col] = static_cast<std::uint16_t>(row_);
}

void AssignmentCore::finish(const Workspace& w) {
  for (int j = 0; j < cols_; ++j) {
    const std::uint16_t i = w.row_of_col[j];
    if (i == kNone) continue;
    const int r = transposed_ ? j : i;
    const int c = transposed_ ? i : j;
    w.col_of_row[r] = static_cast<std::uint16_t>(c);
    total_ += matrix_.data[static_cast<std::ptrdiff_t>(r) * matrix_.stride + c];
  }
  status_ = AssignmentStatus::kSolved;
}

Progress AssignmentCore::step(WorkBudget& budget, const Workspace& w) {
  while (status_ == AssignmentStatus::kRunning) {
    if (!budget.take(unit_ops(cols_))) return Progress::kMore;
    grow(w);
    if (w.row_of_col[tip_col_] != kNone) continue;
    augment(w);
    if (++row_ == rows_) {
      finish(w);
    } else {
      begin_row(w);
    }
  }
  return Progress::kDone;
}

}  // namespace cairn
