#include "registration/wide_map.hpp"

#include <cmath>

#include "core/exp_log.hpp"

namespace cairn {
namespace {

constexpr double kBouldersPerBucket = 0.7;

std::uint32_t bits_set(std::uint32_t word) {
  word -= (word >> 1U) & 0x55555555U;
  word = (word & 0x33333333U) + ((word >> 2U) & 0x33333333U);
  return (((word + (word >> 4U)) & 0x0F0F0F0FU) * 0x01010101U) >> 24U;
}

/// Goes over items from the cursor to `end`, `unit` of them at a time, at `ops` each. False: the
/// budget ran out.
template <typename Work>
bool each(WorkBudget& budget, std::uint32_t& cursor, std::uint32_t end, std::uint32_t unit, std::uint32_t ops,
          Work&& work) {
  while (cursor < end) {
    const std::uint32_t stop = end - cursor < unit ? end : cursor + unit;
    if (!budget.take(ops * (stop - cursor))) return false;
    for (; cursor < stop; ++cursor) work(cursor);
  }
  return true;
}

int at_most(int value, int limit) { return value < limit ? value : limit; }

}  // namespace

bool WideMap::begin(const Vec2& origin_map_m, const Vec2& extent_m, double reach_m) {
  points_.clear();
  left_out_ = sized_all_ = 0;
  for (std::uint32_t& n : sized_) n = 0;
  cursor_ = 0;
  phase_ = Phase::kFilling;
  width_m_ = height_m_ = 0.0;
  cells_x_ = cells_y_ = 0;
  const auto side = [](double v) { return std::isfinite(v) && v > 0.0 && v <= 1.0e5; };
  if (!std::isfinite(origin_map_m.x()) || !std::isfinite(origin_map_m.y()) || !side(extent_m.x()) ||
      !side(extent_m.y()) || !side(reach_m)) {
    return false;
  }
  origin_map_m_ = origin_map_m;
  width_m_ = extent_m.x();
  height_m_ = extent_m.y();
  reach_m_ = reach_m;
  return true;
}

bool WideMap::add(const MapBoulder& boulder) {
  const double x = boulder.p_map_m.x() - origin_map_m_.x();
  const double y = boulder.p_map_m.y() - origin_map_m_.y();
  const bool inside = x >= 0.0 && x <= width_m_ && y >= 0.0 && y <= height_m_;  // NaN is outside
  const std::size_t i = points_.size();
  if (phase_ != Phase::kFilling || !inside ||
      !points_.push_back({static_cast<float>(x), static_cast<float>(y)})) {
    ++left_out_;
    return false;
  }
  const float cm = boulder.diameter_m * 100.0F + 0.5F;
  if (boulder.diameter_m > 0.0F) {
    ++sized_[size_bin(ln(static_cast<double>(boulder.diameter_m)))];
    ++sized_all_;
  }
  diameter_cm_[i] = static_cast<std::uint8_t>(cm >= 0.0F ? (cm < 255.0F ? cm : 255.0F) : 0.0F);
  return true;
}

int WideMap::size_bin(double log_diameter) {
  const double k = (log_diameter - kSizeLow) / kSizeBin;
  if (!(k > 0.0)) return 0;
  return k < kSizeBins - 1 ? static_cast<int>(k) : kSizeBins - 1;
}

double WideMap::size_density(double log_diameter, double sigma) const {
  // Each bin as a Gaussian of its own width and the error; one more boulder than there are, spread over all
  // bins: no size is impossible.
  const double variance = sigma * sigma + kSizeBin * kSizeBin / 12.0;
  const double peak = 1.0 / std::sqrt(2.0 * kPi * variance);
  double sum = 1.0 / (kSizeBins * kSizeBin);
  for (int k = 0; k < kSizeBins; ++k) {
    const double off = log_diameter - (kSizeLow + (k + 0.5) * kSizeBin);
    sum += sized_[k] * peak * exp(-0.5 * off * off / variance);
  }
  return sum / (sized_all_ + 1.0);
}

int WideMap::bucket_of(double at_m, int count) const {
  const double k = at_m / bucket_m_;
  if (!(k > 0.0)) return 0;
  return k < count - 1 ? static_cast<int>(k) : count - 1;
}

std::size_t WideMap::bucket_of(const Point& p) const {
  const auto row = static_cast<std::size_t>(row_of(static_cast<double>(p.y_m)));
  const auto column = static_cast<std::size_t>(column_of(static_cast<double>(p.x_m)));
  return row * static_cast<std::size_t>(columns_) + column;
}

void WideMap::lay_grid() {
  const auto n = static_cast<double>(points_.size() + 1);
  bucket_m_ = std::sqrt(kBouldersPerBucket * area_m2() / n);
  const auto count = [&](double side) { return static_cast<int>(side / bucket_m_) + 1; };
  // A ground that is long and narrow takes more buckets than its area says.
  while (static_cast<std::size_t>(count(width_m_)) * static_cast<std::size_t>(count(height_m_)) >
         kMaxBuckets) {
    bucket_m_ *= 1.25;
  }
  columns_ = count(width_m_);
  rows_ = count(height_m_);
}

void WideMap::lay_raster() {
  cell_m_ = kMinCellM;
  const auto words = [&] {
    const double across = width_m_ / cell_m_ / 32.0 + 1.0;
    return across * (height_m_ / cell_m_ + 1.0);
  };
  while (words() > static_cast<double>(kWords)) cell_m_ *= 1.05;
  cells_x_ = static_cast<int>(width_m_ / cell_m_) + 1;
  cells_y_ = static_cast<int>(height_m_ / cell_m_) + 1;
  words_ = (static_cast<std::uint32_t>(cells_x_) + 31U) / 32U;
  blocks_x_ = (cells_x_ + kBlockCells - 1) / kBlockCells;
  blocks_y_ = (cells_y_ + kBlockCells - 1) / kBlockCells;
}

Progress WideMap::step(WorkBudget& budget) {
  if (phase_ == Phase::kFilling) {
    lay_grid();
    lay_raster();
    phase_ = Phase::kClear;
  }
  while (phase_ != Phase::kReady) {
    if (!run_phase(budget)) return Progress::kMore;
    cursor_ = 0;
    phase_ = static_cast<Phase>(static_cast<std::uint8_t>(phase_) + 1);
  }
  return Progress::kDone;
}

/// False: the budget ran out first.
bool WideMap::run_phase(WorkBudget& budget) {
  const auto count = static_cast<std::uint32_t>(points_.size());
  switch (phase_) {
    case Phase::kClear:
      return each(budget, cursor_, kWords, kWordsPerUnit, 1, [&](std::uint32_t k) {
        raster_[k] = 0;
        if (k < kMaxBuckets + 2) begin_[k] = 0;
      });
    case Phase::kCount:
      return each(budget, cursor_, count, kBouldersPerUnit, kPlaceOps, [&](std::uint32_t k) {
        std::uint16_t& n = begin_[bucket_of(points_[k]) + 2];
        n = static_cast<std::uint16_t>(n + 1);
      });
    case Phase::kSum:
      // Afterwards begin_[k + 1] is where bucket k starts; placing moves it on to where it ends.
      return each(budget, cursor_, static_cast<std::uint32_t>(columns_ * rows_), kWordsPerUnit, 2,
                  [&](std::uint32_t k) {
                    begin_[k + 2] = static_cast<std::uint16_t>(begin_[k + 2] + begin_[k + 1]);
                  });
    case Phase::kPlace:
      return each(budget, cursor_, count, kBouldersPerUnit, kPlaceOps, [&](std::uint32_t k) {
        std::uint16_t& at = begin_[bucket_of(points_[k]) + 1];
        by_bucket_[at] = static_cast<std::uint16_t>(k);
        at = static_cast<std::uint16_t>(at + 1);
      });
    case Phase::kRaster:
      return each(budget, cursor_, count, kMarksPerUnit, mark_ops(cells_of_boulder(reach_m_, cell_m_)),
                  [&](std::uint32_t k) { raster_unit(points_[k]); });
    case Phase::kBlocks:
      return each(budget, cursor_, static_cast<std::uint32_t>(blocks_x_ * blocks_y_), kBlocksPerUnit,
                  block_ops(), [&](std::uint32_t k) { block_unit(k); });
    case Phase::kAround:
      return each(budget, cursor_, static_cast<std::uint32_t>(blocks_x_ * blocks_y_), kAroundPerUnit,
                  kAroundOps, [&](std::uint32_t k) { around_unit(k); });
    case Phase::kFilling:
    case Phase::kReady: break;
  }
  return true;
}

void WideMap::raster_unit(const Point& p) {
  const double x = static_cast<double>(p.x_m);
  const double y = static_cast<double>(p.y_m);
  const auto cell = [&](double at, int count) {
    const double k = at / cell_m_;
    return k > 0.0 ? at_most(static_cast<int>(k), count - 1) : 0;
  };
  const auto gap = [&](double at, int k) {  // from a point to the nearest of the cell, on an axis
    const double low = k * cell_m_;
    if (at < low) return low - at;
    return at > low + cell_m_ ? at - low - cell_m_ : 0.0;
  };
  const int x0 = cell(x - reach_m_, cells_x_);
  const int x1 = cell(x + reach_m_, cells_x_);
  const int y1 = cell(y + reach_m_, cells_y_);
  for (int cy = cell(y - reach_m_, cells_y_); cy <= y1; ++cy) {
    const double dy = gap(y, cy);
    std::uint32_t* const row = raster_ + static_cast<std::uint32_t>(cy) * words_;
    for (int cx = x0; cx <= x1; ++cx) {
      const double dx = gap(x, cx);
      if (dx * dx + dy * dy > reach_m_ * reach_m_) continue;
      row[static_cast<std::uint32_t>(cx) >> 5U] |= 1U << (static_cast<std::uint32_t>(cx) & 31U);
    }
  }
}

void WideMap::block_unit(std::uint32_t block) {
  const auto column = static_cast<int>(block % static_cast<std::uint32_t>(blocks_x_));
  const auto row = static_cast<int>(block / static_cast<std::uint32_t>(blocks_x_));
  const auto first_word = static_cast<std::uint32_t>(column) * (kBlockCells / 32);
  const std::uint32_t end_word =
      first_word + kBlockCells / 32 < words_ ? first_word + kBlockCells / 32 : words_;
  const int end_row = at_most((row + 1) * kBlockCells, cells_y_);
  std::uint32_t set = 0;
  std::uint32_t all = 0;
  for (int y = row * kBlockCells; y < end_row; ++y) {
    for (std::uint32_t w = first_word; w < end_word; ++w) {
      set += bits_set(raster_[static_cast<std::uint32_t>(y) * words_ + w]);
      all += 32;
    }
  }
  const std::uint32_t share = all > 0 ? 65535U * set / all : 0U;
  share_[block] = static_cast<std::uint16_t>(share > 0 ? share : 1);
}

void WideMap::around_unit(std::uint32_t block) {
  const auto column = static_cast<int>(block % static_cast<std::uint32_t>(blocks_x_));
  const auto row = static_cast<int>(block / static_cast<std::uint32_t>(blocks_x_));
  std::uint32_t sum = share_[block];
  std::uint32_t blocks = 1;
  for (int r = row > 0 ? row - 1 : 0; r <= at_most(row + 1, blocks_y_ - 1); ++r) {
    for (int c = column > 0 ? column - 1 : 0; c <= at_most(column + 1, blocks_x_ - 1); ++c) {
      if (r == row && c == column) continue;
      sum += share_[r * blocks_x_ + c];
      ++blocks;
    }
  }
  around_[block] = static_cast<std::uint16_t>(sum / blocks);
}

}  // namespace cairn
