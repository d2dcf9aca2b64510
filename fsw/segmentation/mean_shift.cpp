#include "segmentation/mean_shift.hpp"

namespace cairn {
namespace {

bool is_valid(const MeanShiftParams& p) {
  return p.spatial_radius_px >= 1 && p.spatial_radius_px <= 32 && p.range_radius_grey >= 1 &&
         p.range_radius_grey <= 255 && p.max_iterations >= 1 && p.max_iterations <= 100 && p.convergence >= 0;
}

int larger(int a, int b) { return a > b ? a : b; }
int smaller(int a, int b) { return a < b ? a : b; }
int magnitude(int a) { return a < 0 ? -a : a; }

/// Sums over the members of one row of a window.
struct RowSums {
  int count = 0;
  int x = 0;
  int grey = 0;
};

// Without a branch: whether a pixel belongs to the window is as good as random.
RowSums sum_row(const std::uint8_t* row, int x_first, int x_last, int grey, int radius) {
  RowSums sums;
  const auto lowest = static_cast<unsigned>(grey - radius);
  const auto span = static_cast<unsigned>(2 * radius);
  for (int x = x_first; x <= x_last; ++x) {
    const int value = row[x];
    const int mask = -static_cast<int>(static_cast<unsigned>(value) - lowest <= span);
    sums.count -= mask;
    sums.x += x & mask;
    sums.grey += value & mask;
  }
  return sums;
}

/// Rounded quotient of two numbers that are not negative, halves to even.
int rounded_mean(int sum, int count) {
  const int floor = sum / count;
  const int twice_rest = 2 * (sum - floor * count);
  return floor + static_cast<int>(twice_rest > count || (twice_rest == count && (floor & 1) != 0));
}

}  // namespace

MeanShiftStatus MeanShiftJob::start(const MeanShiftParams& params, const ImageU8& input,
                                    const MutableImageU8& output) {
  status_ = MeanShiftStatus::kBadInput;
  if (!is_valid(params) || input.data == nullptr || output.data == nullptr) return status_;
  if (input.width < 1 || input.height < 1 || input.stride < input.width) return status_;
  if (output.width != input.width || output.height != input.height || output.stride < output.width)
    return status_;
  params_ = params;
  input_ = input;
  output_ = output;
  x_px_ = 0;
  y_px_ = 0;
  iteration_ = 0;
  status_ = MeanShiftStatus::kRunning;
  return status_;
}

Progress MeanShiftJob::step(WorkBudget& budget) {
  if (status_ != MeanShiftStatus::kRunning) return Progress::kDone;
  const int side = 2 * params_.spatial_radius_px + 1;
  const auto cost = static_cast<std::uint32_t>(side * side);
  while (budget.take(cost)) {
    if (!iterate()) continue;
    output_.row(y_px_)[x_px_] = static_cast<std::uint8_t>(at_.grey);
    if (++x_px_ == input_.width) {
      x_px_ = 0;
      if (++y_px_ == input_.height) {
        status_ = MeanShiftStatus::kDone;
        return Progress::kDone;
      }
    }
    iteration_ = 0;
  }
  return Progress::kMore;
}

/// One iteration. True: the trajectory rests.
bool MeanShiftJob::iterate() {
  // Read here and not in `start`: the caller may fill the image between the two.
  if (iteration_ == 0) at_ = {x_px_, y_px_, input_.row(y_px_)[x_px_]};
  const Point before = at_;
  shift();
  const int dx = magnitude(at_.x - before.x);
  const int dy = magnitude(at_.y - before.y);
  const int dg = at_.grey - before.grey;
  if (dx + dy == 0 || dx + dy + dg * dg <= params_.convergence) return true;
  return ++iteration_ == params_.max_iterations;
}

void MeanShiftJob::shift() {
  const int radius = params_.spatial_radius_px;
  const int x_first = larger(at_.x - radius, 0);
  const int x_last = smaller(at_.x + radius, input_.width - 1);
  const int y_first = larger(at_.y - radius, 0);
  const int y_last = smaller(at_.y + radius, input_.height - 1);
  RowSums total;
  int total_y = 0;
  for (int y = y_first; y <= y_last; ++y) {
    const RowSums row = sum_row(input_.row(y), x_first, x_last, at_.grey, params_.range_radius_grey);
    total.count += row.count;
    total.x += row.x;
    total.grey += row.grey;
    total_y += row.count * y;
  }
  // A mean of places need not have a member around it: the trajectory then rests where it stands.
  if (total.count == 0) return;
  at_ = {rounded_mean(total.x, total.count), rounded_mean(total_y, total.count),
         rounded_mean(total.grey, total.count)};
}

}  // namespace cairn
