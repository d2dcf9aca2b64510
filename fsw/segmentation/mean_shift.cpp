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

struct Point {
  int x;
  int y;
  int grey;
};

/// `floor` + `rest` / `count` rounded to an integer, halves to even.
int rounded(int floor, int rest, int count) {
  return floor + static_cast<int>(2 * rest > count || (2 * rest == count && (floor & 1) != 0));
}

/// Rounded quotient of two numbers that are not negative, halves to even.
int rounded_mean(int sum, int count) {
  const int floor = sum / count;
  return rounded(floor, sum - floor * count, count);
}

// ---- by pixels --------------------------------------------------------------------------------------------

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

void shift_by_pixels(const ImageU8& image, int radius, int range, Point& at) {
  const int x_first = larger(at.x - radius, 0);
  const int x_last = smaller(at.x + radius, image.width - 1);
  const int y_first = larger(at.y - radius, 0);
  const int y_last = smaller(at.y + radius, image.height - 1);
  RowSums total;
  int total_y = 0;
  for (int y = y_first; y <= y_last; ++y) {
    const RowSums row = sum_row(image.row(y), x_first, x_last, at.grey, range);
    total.count += row.count;
    total.x += row.x;
    total.grey += row.grey;
    total_y += row.count * y;
  }
  // A mean of places need not have a member around it: the trajectory then rests where it stands.
  if (total.count == 0) return;
  at = {rounded_mean(total.x, total.count), rounded_mean(total_y, total.count),
        rounded_mean(total.grey, total.count)};
}

// ---- by words: four pixels of a column, the uppermost in the uppermost byte -------------------------------

constexpr int kMaxRadius = 2;  // four rows of five are a word
constexpr int kMaxSide = 2 * kMaxRadius + 1;
constexpr int kMaxRange = 25;  // 5 * 2 * 25 < 256
constexpr std::uint32_t kOnes = 0x01010101U;
constexpr std::uint32_t kHigh = 0x80808080U;

/// floor(sum / count) = sum * of[count] / 2^20 for sums of up to kMaxSide^2 numbers of up to 2 kMaxRange.
struct Reciprocals {
  std::uint32_t of[kMaxSide * kMaxSide + 1] = {};
  constexpr Reciprocals() {
    for (std::uint32_t n = 1; n <= kMaxSide * kMaxSide; ++n) of[n] = ((1U << 20U) + n - 1) / n;
  }
  constexpr bool exact() const {
    for (std::uint32_t n = 1; n <= kMaxSide * kMaxSide; ++n) {
      for (std::uint32_t sum = 0; sum <= 2 * kMaxRange * n; ++sum) {
        if ((sum * of[n]) >> 20U != sum / n) return false;
      }
    }
    return true;
  }
};
constexpr Reciprocals kReciprocals;
static_assert(kReciprocals.exact());

/// `base` + `sum` / `count`, rounded.
int rounded_mean(int base, std::uint32_t sum, std::uint32_t count) {
  const std::uint32_t quotient = (sum * kReciprocals.of[count]) >> 20U;
  return rounded(base + static_cast<int>(quotient), static_cast<int>(sum - quotient * count),
                 static_cast<int>(count));
}

/// Sum of the four bytes, below 256.
std::uint32_t sum_of_bytes(std::uint32_t word) { return (word * kOnes) >> 24U; }

/// Of the bytes, two and two, in halves of 16 bits.
std::uint32_t sum_of_pairs(std::uint32_t word) { return (word & 0x00FF00FFU) + ((word >> 8U) & 0x00FF00FFU); }

/// Which bytes lie between two grey values, and how far above the lower one.
class Range {
 public:
  Range(int low, int high)
      : low_(static_cast<std::uint32_t>(low)),
        span_(static_cast<std::uint32_t>(high - low)),
        offset_(static_cast<std::uint32_t>(0x80 - (low & 0x7F)) * kOnes),
        flip_((low & 0x80) != 0 ? 0U : kHigh),
        beyond_(static_cast<std::uint32_t>(127 - (high - low)) * kOnes) {}

  /// By how much one grey value lies above the lower one; beyond every span where it lies below.
  std::uint32_t above(std::uint32_t grey) const { return grey - low_; }
  std::uint32_t span() const { return span_; }

  /// 0x80 in each byte of `valid` (kHigh or a part of it) that lies between. `above`: by how much, modulo
  /// 256. A byte below the lower value comes out above every span.
  std::uint32_t members(std::uint32_t word, std::uint32_t valid, std::uint32_t& above) const {
    above = ((word & ~kHigh) + offset_) ^ ((word & kHigh) ^ flip_);
    return ~(((above & ~kHigh) + beyond_) | above) & valid;
  }

 private:
  std::uint32_t low_;
  std::uint32_t span_;
  std::uint32_t offset_;
  std::uint32_t flip_;
  std::uint32_t beyond_;
};

/// Sums over the members of a window, from its upper left corner and the lowest grey value.
struct WindowSums {
  std::uint32_t count;
  std::uint32_t x;
  std::uint32_t y;
  std::uint32_t grey;
};

/// `words`: of the window's columns; `valid`: their rows that are in it. `fifth`: pixels of the row below
/// them, where the window has five. Without `kPlaces`, x and y are left out.
template <bool kPlaces>
WindowSums sum_window(const std::uint32_t* words, std::uint32_t valid, const std::uint8_t* fifth, int columns,
                      const Range& range) {
  std::uint32_t rows = 0;        // members by row
  std::uint32_t from_right = 0;  // members times their place, counted from the right, the last column 1
  std::uint32_t grey = 0;
  for (int i = 0; i < columns; ++i) {
    std::uint32_t above = 0;
    const std::uint32_t in = range.members(words[i], valid, above);
    const std::uint32_t one = in >> 7U;
    grey += above & (in - one);
    rows += one;
    if (kPlaces) from_right += rows;
  }
  WindowSums sums{};
  sums.count = sum_of_bytes(rows);
  const std::uint32_t pairs = sum_of_pairs(grey);
  sums.grey = (pairs >> 16U) + (pairs & 0xFFFFU);
  if (kPlaces) {
    sums.x = static_cast<std::uint32_t>(columns) * sums.count - sum_of_bytes(from_right);
    sums.y = (rows * 0x03020100U) >> 24U;  // rows 0 to 3 are the bytes from the uppermost on
  }
  if (fifth == nullptr) return sums;
  std::uint32_t count = 0;
  for (int i = 0; i < columns; ++i) {
    const std::uint32_t above = range.above(fifth[i]);
    const std::uint32_t mask = 0U - static_cast<std::uint32_t>(above <= range.span());
    count -= mask;
    sums.grey += above & mask;
    if (kPlaces) sums.x += static_cast<std::uint32_t>(i) & mask;
  }
  sums.count += count;
  if (kPlaces) sums.y += 4U * count;
  return sums;
}

/// `words`: a ring of `ring` rows of `stride` words.
template <bool kPlaces>
void shift_by_words(const ImageU8& image, const std::uint32_t* words, int ring, int stride, int radius,
                    int range_radius, Point& at) {
  const int x_first = larger(at.x - radius, 0);
  const int columns = smaller(at.x + radius, image.width - 1) - x_first + 1;
  const int y_first = larger(at.y - radius, 0);
  const int rows = smaller(at.y + radius, image.height - 1) - y_first + 1;
  const int low = larger(at.grey - range_radius, 0);
  const Range range(low, smaller(at.grey + range_radius, 255));
  const WindowSums sums = sum_window<kPlaces>(
      words + y_first % ring * stride + x_first, rows >= 4 ? kHigh : kHigh << (32 - 8 * rows),
      rows == 5 ? image.row(y_first + 4) + x_first : nullptr, columns, range);
  if (sums.count == 0) return;  // as above
  at.grey = rounded_mean(low, sums.grey, sums.count);
  if (!kPlaces) return;
  at.x = rounded_mean(x_first, sums.x, sums.count);
  at.y = rounded_mean(y_first, sums.y, sums.count);
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
  begin_row(0);
  by_words_ = params.spatial_radius_px <= kMaxRadius && params.range_radius_grey <= kMaxRange &&
              input.width <= cfg::kImageWidth;
  packed_rows_ = -3;  // the word of row 0 is whole with the fourth row
  status_ = MeanShiftStatus::kRunning;
  return status_;
}

Progress MeanShiftJob::step(WorkBudget& budget) {
  const int side = 2 * params_.spatial_radius_px + 1;
  const std::uint32_t cost =
      by_words_ ? shift_ops(params_.spatial_radius_px) : static_cast<std::uint32_t>(side * side);
  while (status_ == MeanShiftStatus::kRunning) {
    if (by_words_ && packed_rows_ < smaller(y_px_ + kRing / 2, input_.height)) {
      if (!budget.take(pack_ops(input_.width))) return Progress::kMore;
      pack_row(packed_rows_++);
      continue;
    }
    if (x_px_ >= input_.width) {
      if (!budget.take(params_.each_second ? fill_ops(input_.width) : 1U)) return Progress::kMore;
      if (params_.each_second) fill_row();
      begin_row(y_px_ + 1);
      if (y_px_ == input_.height) status_ = MeanShiftStatus::kDone;
      continue;
    }
    const int left = (input_.width - x_px_ + step_px() - 1) / step_px();
    const int run = smaller(by_words_ ? kRun : 1, left);
    if (!budget.take(cost * static_cast<std::uint32_t>(run))) return Progress::kMore;
    budget.charge(cost * static_cast<std::uint32_t>(settle_run(run) - run));
  }
  return Progress::kDone;
}

void MeanShiftJob::begin_row(int y) {
  y_px_ = y;
  x_px_ = params_.each_second ? y % 2 : 0;
}

/// What did not walk. Its neighbours did, and one of the three is there.
void MeanShiftJob::fill_row() {
  const std::uint8_t* in = input_.row(y_px_);
  std::uint8_t* out = output_.row(y_px_);
  const int above = y_px_ > 0 ? y_px_ - 1 : y_px_;
  const std::uint8_t* in_above = input_.row(above);
  const std::uint8_t* out_above = output_.row(above);
  constexpr int kAway = 256;  // of no pixel
  for (int x = 1 - y_px_ % 2; x < input_.width; x += 2) {
    const int grey = in[x];
    const int left = x > 0 ? magnitude(in[x - 1] - grey) : kAway;
    const int right = x + 1 < input_.width ? magnitude(in[x + 1] - grey) : kAway;
    const int up = y_px_ > 0 ? magnitude(in_above[x] - grey) : kAway;
    const int beside = left <= right ? left : right;
    out[x] = up < beside ? out_above[x] : left <= right ? out[x - 1] : out[x + 1];
  }
}

/// Of the words before it, and the fourth row. Rows below the image are not looked at.
void MeanShiftJob::pack_row(int y) {
  const std::uint8_t* row = input_.row(smaller(y + 3, input_.height - 1));
  const std::uint32_t* before = words_[(y + kRing - 1) % kRing];
  std::uint32_t* words = words_[(y + kRing) % kRing];
  for (int x = 0; x < input_.width; ++x) words[x] = before[x] << 8U | row[x];
}

/// Carries the next trajectories to their ends. Returns their iterations.
int MeanShiftJob::settle_run(int length) {
  constexpr int kReach = kRing / 2 - 4;  // so far from the scan, a window's words are there
  const std::uint8_t* in = input_.row(y_px_);
  std::uint8_t* out = output_.row(y_px_);
  int iterations = 0;
  for (; length > 0; --length, x_px_ += step_px()) {
    Point at{x_px_, y_px_, in[x_px_]};
    for (int left = params_.max_iterations; left > 0; --left) {
      ++iterations;
      const Point before = at;
      const bool near = by_words_ && magnitude(at.y - y_px_) <= kReach;
      if (!near) {
        shift_by_pixels(input_, params_.spatial_radius_px, params_.range_radius_grey, at);
      } else if (left > 1) {
        shift_by_words<true>(input_, words_[0], kRing, cfg::kImageWidth, params_.spatial_radius_px,
                             params_.range_radius_grey, at);
      } else {  // where it ends matters to no one
        shift_by_words<false>(input_, words_[0], kRing, cfg::kImageWidth, params_.spatial_radius_px,
                              params_.range_radius_grey, at);
      }
      const int moved = magnitude(at.x - before.x) + magnitude(at.y - before.y);
      const int dg = at.grey - before.grey;
      if (moved == 0 || moved + dg * dg <= params_.convergence) break;
    }
    out[x_px_] = static_cast<std::uint8_t>(at.grey);
  }
  return iterations;
}

}  // namespace cairn
