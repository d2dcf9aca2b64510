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
  for (const MapBoulder& b : boulders) {
    if (!is_near(b.p_map_m) || !std::isfinite(b.diameter_m)) return status_;
    const Vec2 p = b.p_map_m - origin_map_m;
    points_.append({p.x(), p.y(), b.diameter_m});  // the capacity is that of the window
  }
  cells_per_m_ = 1.0 / least_cell_m;
  lay();
  phase_ = Phase::kCount;
  cursor_ = 0;
  status_ = GridStatus::kRunning;
  return status_;
}

void BoulderGrid::lay() {
  double x0 = points_[0].x_m;
  double x1 = x0;
  double y0 = points_[0].y_m;
  double y1 = y0;
  for (const GridPoint& p : points_) {
    if (p.x_m < x0) x0 = p.x_m;
    if (p.x_m > x1) x1 = p.x_m;
    if (p.y_m < y0) y0 = p.y_m;
    if (p.y_m > y1) y1 = p.y_m;
  }
  x0_m_ = x0;
  y0_m_ = y0;
  const double extent = x1 - x0 > y1 - y0 ? x1 - x0 : y1 - y0;
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

Progress BoulderGrid::step(WorkBudget& budget) {
  while (status_ == GridStatus::kRunning) {
    const bool summing = phase_ == Phase::kSum;
    if (!budget.take(summing ? sum_ops() : kChunkOps)) return Progress::kMore;
    if (summing) {
      sum_unit();
      phase_ = Phase::kPlace;
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
