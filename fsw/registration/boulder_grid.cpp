#include "registration/boulder_grid.hpp"

#include <cmath>

namespace cairn {
namespace {

// False for NaN.
bool is_near(const Vec2& p) {
  constexpr double kMax = BoulderGrid::kMaxCoordinate_m;
  return std::fabs(p.x()) <= kMax && std::fabs(p.y()) <= kMax;
}

}  // namespace

bool SizeRule::agree(float a_m, float b_m) const {
  if (max_ratio == 0.0 || a_m <= 0.0F || b_m <= 0.0F) return true;
  const auto a = static_cast<double>(a_m);
  const auto b = static_cast<double>(b_m);
  return a <= max_ratio * b && b <= max_ratio * a;
}

// ---- building ---------------------------------------------------------------------------------------------

GridStatus BoulderGrid::start(const MapBoulders& boulders, const Vec2& origin_map_m, double least_cell_m) {
  points_.clear();
  status_ = GridStatus::kNoBoulders;
  if (boulders.empty()) return status_;
  status_ = GridStatus::kBadInput;
  if (!origin_map_m.allFinite() || !(least_cell_m >= 1.0e-3 && least_cell_m <= 1.0e3)) return status_;
  source_ = &boulders;
  origin_map_m_ = origin_map_m;
  cells_per_m_ = 1.0 / least_cell_m;
  phase_ = Phase::kCopy;
  cursor_ = 0;
  return status_ = GridStatus::kRunning;
}

/// One unit; false where a boulder is bad.
bool BoulderGrid::copy_unit(std::uint32_t boulders) {
  const std::uint32_t end = cursor_ + boulders;
  for (; cursor_ < end; ++cursor_) {
    const MapBoulder& b = (*source_)[cursor_];
    if (!is_near(b.p_map_m) || !std::isfinite(b.diameter_m)) return false;
    const Vec2 p = b.p_map_m - origin_map_m_;
    const bool first = points_.empty();
    if (first || p.x() < x0_m_) x0_m_ = p.x();
    if (first || p.x() > x1_m_) x1_m_ = p.x();
    if (first || p.y() < y0_m_) y0_m_ = p.y();
    if (first || p.y() > y1_m_) y1_m_ = p.y();
    points_.append({p.x(), p.y(), b.diameter_m});  // the capacity is that of the window
  }
  return true;
}

void BoulderGrid::lay() {
  const double extent = x1_m_ - x0_m_ > y1_m_ - y0_m_ ? x1_m_ - x0_m_ : y1_m_ - y0_m_;
  if (extent * cells_per_m_ > kSide) cells_per_m_ = kSide / extent;
  reach_per_m_ = cells_per_m_ * (1.0 + 1.0e-9);
  for (std::uint16_t& count : cell_begin_) count = 0;
}

int BoulderGrid::cell_of(const GridPoint& p) const {
  int x = static_cast<int>((p.x_m - x0_m_) * cells_per_m_);  // not negative: the grid starts at the smallest
  int y = static_cast<int>((p.y_m - y0_m_) * cells_per_m_);
  if (x >= kSide) x = kSide - 1;
  if (y >= kSide) y = kSide - 1;
  return y * kSide + x;
}

void BoulderGrid::count_unit() {
  for (std::uint32_t i = 0; i < kChunk && cursor_ < points_.size(); ++i, ++cursor_) {
    ++cell_begin_[cell_of(points_[cursor_])];
  }
}

/// From counts to ends; place_unit() then runs each end down to where its cell begins.
void BoulderGrid::sum_unit() {
  std::uint16_t end = 0;
  for (std::uint16_t& cell : cell_begin_) {
    end = static_cast<std::uint16_t>(end + cell);
    cell = end;
  }
}

/// Last boulder first, so that indices ascend within a cell.
void BoulderGrid::place_unit() {
  for (std::uint32_t i = 0; i < kChunk && cursor_ < points_.size(); ++i, ++cursor_) {
    const std::size_t index = points_.size() - 1U - cursor_;
    by_cell_[--cell_begin_[cell_of(points_[index])]] = static_cast<std::uint16_t>(index);
  }
}

Progress BoulderGrid::copy(WorkBudget& budget) {
  const auto all = static_cast<std::uint32_t>(source_->size());
  while (cursor_ < all) {
    const std::uint32_t count = all - cursor_ < kChunk ? all - cursor_ : kChunk;
    if (!budget.take(copy_ops(count))) return Progress::kMore;
    if (copy_unit(count)) continue;
    status_ = GridStatus::kBadInput;
    return Progress::kDone;
  }
  phase_ = Phase::kClear;
  cursor_ = 0;
  return Progress::kDone;
}

Progress BoulderGrid::step(WorkBudget& budget) {
  while (status_ == GridStatus::kRunning) {
    if (phase_ == Phase::kCopy) {
      if (copy(budget) == Progress::kMore) return Progress::kMore;
      continue;
    }
    const bool clearing = phase_ == Phase::kClear;
    const bool cells = clearing || phase_ == Phase::kSum;
    if (!budget.take(cells ? cells_ops() : kChunkOps)) return Progress::kMore;
    if (cells) {
      clearing ? lay() : sum_unit();
      phase_ = clearing ? Phase::kCount : Phase::kPlace;
      continue;
    }
    const bool counting = phase_ == Phase::kCount;
    if (counting) {
      count_unit();
    } else {
      place_unit();
    }
    if (cursor_ < points_.size()) continue;
    cursor_ = 0;
    if (counting) {
      phase_ = Phase::kSum;
    } else {
      status_ = GridStatus::kReady;
    }
  }
  return Progress::kDone;
}

// ---- questions --------------------------------------------------------------------------------------------

BoulderQuery BoulderGrid::query(const GridPoint& at, double radius_m) const {
  CAIRN_ASSERT(status_ == GridStatus::kReady);
  const double reach = radius_m * reach_per_m_;
  const double column = (at.x_m - x0_m_) * cells_per_m_;
  const double row = (at.y_m - y0_m_) * cells_per_m_;
  constexpr double kLast = kSide - 1;
  const double left = column - reach;
  const double right = column + reach;
  const double upper = row - reach;
  const double lower = row + reach;
  const bool within = left > 0.0 && upper > 0.0 && right < kLast && lower < kLast;  // most are
  const auto cell = [within](double c) {
    return static_cast<int>(within || (c > 0.0 && c < kLast) ? c : c >= kLast ? kLast : 0.0);
  };
  const int x0 = cell(left);
  const int x1 = cell(right);
  const int y0 = cell(upper);
  const int y1 = cell(lower);
  std::uint32_t candidates = 0;
  const std::uint16_t* begins = &cell_begin_[y0 * kSide];
  for (int y = y0; y <= y1; ++y, begins += kSide)
    candidates += static_cast<std::uint32_t>(begins[x1 + 1] - begins[x0]);
  return {at, radius_m, x0, x1, y0, y1, 0, candidates};
}

NearestBoulder BoulderGrid::nearest(const BoulderQuery& query, const SizeRule& sizes) const {
  NearestBoulder best = none(query);
  nearest(query, sizes, best);
  return best;
}

void BoulderGrid::nearest(const BoulderQuery& query, const SizeRule& sizes, NearestBoulder& best) const {
  for_each_near(query, [&](std::uint16_t index, double r2) {
    if (r2 > best.r2_m2 || (r2 == best.r2_m2 && index >= best.index)) return;
    if (!sizes.agree(query.at.diameter_m, points_[index].diameter_m)) return;
    best = {index, r2};
  });
}

}  // namespace cairn
