#include "labeling/relief.hpp"

#include <cmath>

#include "core/arithmetic.hpp"

namespace cairn {
namespace {

constexpr int kGroundIterations = 8;

constexpr double kFarthest_m = 1.0e5;         // of a point from the site's origin
constexpr std::uint32_t kOffset = 1U << 28U;  // cells: makes all indices positive

/// The cell of a coordinate.
std::uint32_t index_of(double metres, double cell_m) {
  const double cells = metres / cell_m + static_cast<double>(kOffset);
  return static_cast<std::uint32_t>(static_cast<int>(cells));
}

/// Of ReliefCell::way_inside, the lowest bit 1: less that of a cell, it is no less than 0.
constexpr double kSteps_per_m = 20.0;
std::uint16_t way_steps(double way_m) {
  const double steps = way_m * kSteps_per_m;
  return static_cast<std::uint16_t>(1 | (steps < 2.0e9 ? static_cast<int>(steps) & 0xFFFF : 0));
}

}  // namespace

void Relief::init(const ReliefParams& params, const ReliefGrid& grid) {
  params_ = params;
  grid_ = grid;
  clear();
}

ReliefCell& Relief::cell_of(std::uint32_t ix, std::uint32_t iy) const {
  const std::uint32_t mask = grid_.side - 1U;
  return grid_.cells[(iy & mask) * grid_.side + (ix & mask)];
}

void Relief::clear() {
  phase_ = Phase::kIdle;
  boulders_.clear();
  dropped_ = 0;
  for (std::uint32_t i = 0; i < grid_.side * grid_.side; ++i) grid_.cells[i] = ReliefCell();
}

void Relief::add(const Vec3& p, const Vec3& ray, double way_m, bool inside) {
  CAIRN_ASSERT(phase_ == Phase::kIdle);
  const double range2 = ray.x() * ray.x() + ray.y() * ray.y();
  if (!(range2 > 0.01 && range2 <= params_.max_range_m * params_.max_range_m)) return;
  if (!(std::fabs(p.x()) < kFarthest_m && std::fabs(p.y()) < kFarthest_m)) return;
  const std::uint32_t ix = index_of(p.x(), params_.cell_m);
  const std::uint32_t iy = index_of(p.y(), params_.cell_m);
  const std::uint16_t now = way_steps(way_m);
  const double along = params_.sigma_per_range2 * range2;
  const double weight = 1.0 / (params_.near_sigma_m * params_.near_sigma_m + along * along);
  ReliefCell& cell = cell_of(ix, iy);
  const auto age = static_cast<std::uint16_t>(now - cell.way_inside);
  const bool same = cell.tile_x == tile_of(ix) && cell.tile_y == tile_of(iy);
  if (!same || age > params_.stale_m * kSteps_per_m) cell = ReliefCell();
  const double total = static_cast<double>(cell.weight) + weight;
  const double share = weight / total;
  const double range = std::sqrt(range2);
  const auto mixed = [share](float old, double fresh) {
    return static_cast<float>(static_cast<double>(old) + (fresh - static_cast<double>(old)) * share);
  };
  cell.height_m = mixed(cell.height_m, p.z());
  cell.view_x = mixed(cell.view_x, ray.x() / range);
  cell.view_y = mixed(cell.view_y, ray.y() / range);
  cell.weight = static_cast<float>(total);
  cell.way_inside = inside || (cell.way_inside & 1) != 0 ? now : now ^ 1;
  cell.tile_x = tile_of(ix);
  cell.tile_y = tile_of(iy);
}

void Relief::start(const Vec2& centre, double way_m) {
  boulders_.clear();
  dropped_ = 0;
  const bool near = std::fabs(centre.x()) < kFarthest_m && std::fabs(centre.y()) < kFarthest_m;
  if (!near) return;
  centre_site_m_ = centre;
  way_m_ = way_m;
  now_ = way_steps(way_m);
  origin_x_ = (index_of(centre.x(), params_.cell_m) - grid_.side / 2U) / kBlock * kBlock;
  origin_y_ = (index_of(centre.y(), params_.cell_m) - grid_.side / 2U) / kBlock * kBlock;
  cursor_ = scan_ = 0;
  phase_ = Phase::kLows;
}

double Relief::x_of(std::uint32_t wx) const {
  return (static_cast<double>(origin_x_ + wx) - static_cast<double>(kOffset) + 0.5) * params_.cell_m;
}

double Relief::y_of(std::uint32_t wy) const {
  return (static_cast<double>(origin_y_ + wy) - static_cast<double>(kOffset) + 0.5) * params_.cell_m;
}

/// Of the window; null where nothing was seen on this passage.
const ReliefCell* Relief::cell_at(std::uint32_t wx, std::uint32_t wy) const {
  const std::uint32_t ix = origin_x_ + wx;
  const std::uint32_t iy = origin_y_ + wy;
  const ReliefCell& cell = cell_of(ix, iy);
  if (!(cell.weight > 0.0F) || cell.tile_x != tile_of(ix) || cell.tile_y != tile_of(iy)) return nullptr;
  const auto age = static_cast<std::uint16_t>(now_ - cell.way_inside);
  return age > params_.stale_m * kSteps_per_m ? nullptr : &cell;
}

Progress Relief::step(WorkBudget& budget) {
  while (phase_ != Phase::kIdle) {
    if (!budget.take(unit_ops())) return Progress::kMore;
    unit();
  }
  return Progress::kDone;
}

std::uint32_t Relief::unit_ops() const {
  switch (phase_) {
    case Phase::kLows: return kLowOps;
    case Phase::kPlanes: return kPlaneOps;
    case Phase::kMark: return mark_ops(grid_.side);
    case Phase::kScan: return scan_ops(grid_.side);
    case Phase::kFlood: return kFloodOps;
    case Phase::kExtent: return kExtentOps;
    case Phase::kIdle: break;
  }
  return 1;
}

void Relief::unit() {
  switch (phase_) {
    case Phase::kLows: low(); break;
    case Phase::kPlanes: plane(); break;
    case Phase::kMark: mark(); break;
    case Phase::kScan: scan(); break;
    case Phase::kFlood: flood(); break;
    case Phase::kExtent: extent(); break;
    case Phase::kIdle: break;
  }
}

void Relief::low() {
  const std::uint32_t bx = cursor_ % blocks() * kBlock;
  const std::uint32_t by = cursor_ / blocks() * kBlock;
  double mean = 0.0;
  int seen = 0;
  for (std::uint32_t k = 0; k < kBlock * kBlock; ++k) {
    const ReliefCell* cell = cell_at(bx + k % kBlock, by + k / kBlock);
    if (cell == nullptr) continue;
    mean += static_cast<double>(cell->height_m);
    ++seen;
  }
  ReliefBlock& block = grid_.blocks[cursor_];
  block.seen = seen >= 4;
  if (block.seen) {
    mean /= seen;
    double low = 0.0;
    int lower = 0;
    for (std::uint32_t k = 0; k < kBlock * kBlock; ++k) {
      const ReliefCell* cell = cell_at(bx + k % kBlock, by + k / kBlock);
      if (cell == nullptr || static_cast<double>(cell->height_m) > mean) continue;
      low += static_cast<double>(cell->height_m);
      ++lower;
    }
    block.low_m = static_cast<float>(lower > 0 ? low / lower : mean);
  }
  if (++cursor_ < blocks() * blocks()) return;
  cursor_ = 0;
  phase_ = Phase::kPlanes;
}

/// About the block's middle, in metres.
void Relief::plane() {
  const auto bx = static_cast<int>(cursor_ % blocks());
  const auto by = static_cast<int>(cursor_ / blocks());
  const double side = kBlock * params_.cell_m;
  GroundPlane plane{};
  int used = 0;
  for (int iteration = 0; iteration < kGroundIterations; ++iteration) {
    PlaneSums sums;
    used = 0;
    for (int k = 0; k < 25; ++k) {
      const int x = bx + k % 5 - 2;
      const int y = by + k / 5 - 2;
      const auto across = static_cast<int>(blocks());
      if (x < 0 || y < 0 || x >= across || y >= across) continue;
      const ReliefBlock& block = grid_.blocks[y * across + x];
      if (!block.seen) continue;
      const double px = (x - bx) * side;
      const double py = (y - by) * side;
      const auto low = static_cast<double>(block.low_m);
      const double w = iteration == 0 ? 1.0 : ground_weight((low - plane.at(px, py)) / params_.plane_scale_m);
      sums.add(w, px, py, low);
      ++used;
    }
    if (used < 6) break;
    sums.solve(plane);
  }
  ReliefBlock& block = grid_.blocks[cursor_];
  block.ground = used >= 6;
  block.a = static_cast<float>(plane.a);
  block.b = static_cast<float>(plane.b);
  block.c = static_cast<float>(plane.c);
  if (++cursor_ < blocks() * blocks()) return;
  cursor_ = 0;
  phase_ = Phase::kMark;
}

double Relief::height(std::uint32_t wx, std::uint32_t wy, const ReliefCell& cell) const {
  const ReliefBlock& block = grid_.blocks[wy / kBlock * blocks() + wx / kBlock];
  constexpr double kMiddle = 0.5 * (kBlock - 1.0);
  const double dx = (wx % kBlock - kMiddle) * params_.cell_m;
  const double dy = (wy % kBlock - kMiddle) * params_.cell_m;
  return static_cast<double>(cell.height_m) -
         (static_cast<double>(block.a) * dx + static_cast<double>(block.b) * dy +
          static_cast<double>(block.c));
}

void Relief::mark() {
  for (std::uint32_t wx = 0; wx < grid_.side; ++wx) {
    Mark& mark = grid_.marks[cursor_ * grid_.side + wx];
    mark = Mark::kUnseen;
    if (!grid_.blocks[cursor_ / kBlock * blocks() + wx / kBlock].ground) continue;
    const ReliefCell* cell = cell_at(wx, cursor_);
    if (cell == nullptr) continue;
    mark = height(wx, cursor_, *cell) >= params_.min_height_m ? Mark::kRaised : Mark::kGround;
  }
  if (++cursor_ < grid_.side) return;
  scan_ = 0;
  phase_ = Phase::kScan;
}

/// To the end of the row, or the first cell of the next boulder.
void Relief::scan() {
  const std::uint32_t end = (scan_ / grid_.side + 1U) * grid_.side;
  while (scan_ < end && grid_.marks[scan_] != Mark::kRaised) ++scan_;
  if (scan_ < end) {
    list_.clear();
    sums_ = {};
    head_ = 0;
    too_large_ = false;
    take(scan_ % grid_.side, scan_ / grid_.side);
    phase_ = Phase::kFlood;
  } else if (scan_ == grid_.side * grid_.side) {
    phase_ = Phase::kIdle;
  }
}

void Relief::take(std::uint32_t wx, std::uint32_t wy) {
  const std::uint32_t at = wy * grid_.side + wx;
  if (!list_.push_back(static_cast<std::uint16_t>(at))) {
    too_large_ = true;
    return;
  }
  grid_.marks[at] = Mark::kTaken;
  const ReliefCell* cell = cell_at(wx, wy);
  CAIRN_ASSERT(cell != nullptr);
  const double h = height(wx, wy, *cell);
  sums_.x += x_of(wx);
  sums_.y += y_of(wy);
  sums_.z += static_cast<double>(cell->height_m);
  sums_.view_x += static_cast<double>(cell->view_x);
  sums_.view_y += static_cast<double>(cell->view_y);
  sums_.top_m = h > sums_.top_m ? h : sums_.top_m;
  const std::uint32_t age = static_cast<std::uint16_t>(now_ - cell->way_inside);
  if (list_.size() == 1 || age < sums_.age) sums_.age = age;
}

void Relief::flood() {
  for (std::size_t k = 0; k < kFlood && head_ < list_.size(); ++k, ++head_) {
    const std::uint32_t wx = list_[head_] % grid_.side;
    const std::uint32_t wy = list_[head_] / grid_.side;
    for (std::uint32_t n = 0; n < 9; ++n) {
      const std::uint32_t x = wx + n % 3U - 1U;  // beyond the rim: a large number
      const std::uint32_t y = wy + n / 3U - 1U;
      if (x < grid_.side && y < grid_.side && grid_.marks[y * grid_.side + x] == Mark::kRaised) take(x, y);
    }
  }
  if (head_ < list_.size()) return;
  const bool worth = static_cast<int>(list_.size()) >= params_.min_cells;
  if (too_large_) ++dropped_;
  if (!worth || too_large_) {
    phase_ = Phase::kScan;
    return;
  }
  const auto n = static_cast<double>(list_.size());
  mean_ = Vec2(sums_.x / n, sums_.y / n);
  const double length = std::sqrt(sums_.view_x * sums_.view_x + sums_.view_y * sums_.view_y);
  u_ = length > 1.0e-6 ? Vec2(sums_.view_x / length, sums_.view_y / length) : Vec2(1.0, 0.0);
  extents_ = {};
  head_ = 0;
  phase_ = Phase::kExtent;
}

void Relief::extent() {
  for (std::size_t k = 0; k < kExtent && head_ < list_.size(); ++k, ++head_) {
    const std::uint32_t wx = list_[head_] % grid_.side;
    const std::uint32_t wy = list_[head_] / grid_.side;
    const double dx = x_of(wx) - mean_.x();
    const double dy = y_of(wy) - mean_.y();
    const double a = u_.x() * dx + u_.y() * dy;
    const double c = u_.x() * dy - u_.y() * dx;
    const ReliefCell* cell = cell_at(wx, wy);
    CAIRN_ASSERT(cell != nullptr);
    const auto told = static_cast<double>(cell->weight);
    extents_.add(told / (told + params_.half_told), a, c);
    extents_.cut += 1 - (cell->way_inside & 1);
    // Neighbours on the side that faces the rover.
    const bool west = u_.x() > 0.0;
    const bool south = u_.y() > 0.0;
    const std::uint32_t x = west ? wx - 1U : wx + 1U;
    const std::uint32_t y = south ? wy - 1U : wy + 1U;
    const Mark ahead_x = x < grid_.side ? grid_.marks[wy * grid_.side + x] : Mark::kUnseen;
    const Mark ahead_y = y < grid_.side ? grid_.marks[y * grid_.side + wx] : Mark::kUnseen;
    extents_.front += (ahead_x != Mark::kTaken ? 1 : 0) + (ahead_y != Mark::kTaken ? 1 : 0);
    extents_.open += (ahead_x == Mark::kUnseen ? 1 : 0) + (ahead_y == Mark::kUnseen ? 1 : 0);
  }
  if (head_ < list_.size()) return;
  describe();
  phase_ = Phase::kScan;
}

void Relief::describe() {
  const double cell = params_.cell_m;
  const double mean_along = extents_.a / extents_.w;
  const double across = extents_.c / extents_.w;
  // Of a disc the diameter is four standard deviations; a cell's own is its side by root 12.
  const double own = cell * cell / 12.0;
  const double seen = 4.0 * std::sqrt(positive(extents_.aa / extents_.w - mean_along * mean_along) + own);
  const double width = 4.0 * std::sqrt(positive(extents_.cc / extents_.w - across * across) + own);
  const double most = params_.deepest * width;
  const double shown = seen < most ? seen : most;
  const double depth = shown > width ? shown : width;
  const double along = mean_along + 0.5 * (depth - seen);
  const auto n = static_cast<double>(list_.size());
  ReliefBoulder b;
  b.p_site_m =
      Vec2(mean_.x() + u_.x() * along - u_.y() * across, mean_.y() + u_.y() * along + u_.x() * across);
  b.view = u_;
  b.z_site_m = sums_.z / n;
  b.height_m = sums_.top_m;
  b.diameter_m = std::sqrt(width * depth);
  if (b.diameter_m > widest_m()) {
    ++dropped_;
    return;
  }
  const double hidden = params_.depth_share * std::fabs(depth - seen) + 0.05 * depth;
  const double cut = params_.cut_share * extents_.cut / n * b.diameter_m;
  b.sigma_m = std::sqrt(0.25 * cell * cell + 0.5 * hidden * hidden + cut * cut);
  b.range_m = (b.p_site_m - centre_site_m_).norm();
  b.open_share = extents_.front > 0 ? static_cast<double>(extents_.open) / extents_.front : 0.0;
  b.way_m = way_m_ - sums_.age / kSteps_per_m;
  b.cells = static_cast<int>(list_.size());
  if (!boulders_.push_back(b)) ++dropped_;
}

}  // namespace cairn
