#include "registration/ground.hpp"

#include <cmath>

#include "core/trig.hpp"

namespace cairn {
namespace {

constexpr double kPerBlock = 30.0;  // boulders in 3 x 3 cells
constexpr int kBins = Ground::kBins;
constexpr double kBinWidth = 0.25;
constexpr double kSmallest_m = 0.005;

/// Diameters from which on the bins are; the first one holds what is smaller, too.
struct SizeBins {
  double from_m[kBins] = {};
  constexpr SizeBins() {
    constexpr double kGrowth = 1.28402541668774148407;  // exp(kBinWidth)
    double from = kSmallest_m;
    for (double& bin : from_m) {
      bin = from;
      from *= kGrowth;
    }
  }
};
constexpr SizeBins kSizeBins;

int bin_of(double diameter_m) {
  int bin = 0;
  for (int step = 32; step > 0; step /= 2) {
    if (bin + step < kBins && diameter_m >= kSizeBins.from_m[bin + step]) bin += step;
  }
  return bin;
}

int clamp(double value, double count) {
  return value >= 0.0 ? static_cast<int>(value < count ? value : count - 1.0) : 0;
}

}  // namespace

GridStatus Ground::start(const MapBoulders& boulders, const Vec2& centre_map_m, double radius_m,
                         double least_cell_m, double crowd_m) {
  centre_map_m_ = centre_map_m;
  const bool good = radius_m >= 1.0e-2 && radius_m <= 1.0e5 && crowd_m >= 1.0e-3 && crowd_m <= 1.0e3;
  crowd_m_ = crowd_m;
  crowding_ = 1.0;
  neighbours_ = expected_ = 0.0;
  seen_ = 0;
  radius_m_ = good ? radius_m : 1.0;
  phase_ = Phase::kGrid;
  cursor_ = 0;
  boulders_ = 0.0;
  sized_ = 0.0F;
  for (float& bin : sizes_) bin = 0.0F;
  status_ = good ? grid_.start(boulders, centre_map_m, least_cell_m) : GridStatus::kBadInput;
  return status_;
}

/// The box of the boulders in the disc, grown one by one.
void Ground::box_one(const GridPoint& m) {
  if (m.x_m * m.x_m + m.y_m * m.y_m > radius_m_ * radius_m_) return;
  if (boulders_ == 0.0 || m.x_m < box_[0]) box_[0] = m.x_m;
  if (boulders_ == 0.0 || m.x_m > box_[1]) box_[1] = m.x_m;
  if (boulders_ == 0.0 || m.y_m < box_[2]) box_[2] = m.y_m;
  if (boulders_ == 0.0 || m.y_m > box_[3]) box_[3] = m.y_m;
  boulders_ += 1.0;
}

/// Area of a square that lies in disc and box, by 4 x 4 samples.
double Ground::covered(double x0, double y0, double side) const {
  const double far_x = x0 < -0.5 * side ? x0 : x0 + side;
  const double far_y = y0 < -0.5 * side ? y0 : y0 + side;
  const bool whole = far_x * far_x + far_y * far_y <= radius_m_ * radius_m_ && x0 >= box_[0] &&
                     x0 + side <= box_[1] && y0 >= box_[2] && y0 + side <= box_[3];
  if (whole) return side * side;
  int inside = 0;
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < 4; ++i) {
      const double x = x0 + (i + 0.5) * 0.25 * side;
      const double y = y0 + (j + 0.5) * 0.25 * side;
      const bool in = x * x + y * y <= radius_m_ * radius_m_ && x >= box_[0] && x <= box_[1] &&
                      y >= box_[2] && y <= box_[3];
      inside += in ? 1 : 0;
    }
  }
  return inside * side * side / 16.0;
}

void Ground::lay_grid() {
  if (boulders_ == 0.0) box_[0] = box_[1] = box_[2] = box_[3] = 0.0;
  // The box of n points falls short of the area that they were strewn over by one point's share each way.
  const double room = 0.5 * (box_[1] - box_[0] + box_[3] - box_[2]) / (boulders_ + 1.0);
  for (int side = 0; side < 4; ++side) box_[side] += side % 2 == 0 ? -room : room;
  const double disc = kPi * radius_m_ * radius_m_;
  const double side = std::sqrt(kPerBlock / 9.0 * disc / (boulders_ + 1.0));
  cells_ = clamp(2.0 * radius_m_ / side + 1.0, kMaxCells + 1);
  if (cells_ < 1) cells_ = 1;
  cell_m_ = 2.0 * radius_m_ / cells_;
  cells_per_m_ = 1.0 / cell_m_;
  area_m2_ = 0.0;
}

void Ground::lay_row(int y) {
  for (int x = 0; x < cells_; ++x) {
    const double cover = covered(x * cell_m_ - radius_m_, y * cell_m_ - radius_m_, cell_m_);
    cover_m2_[y * cells_ + x] = static_cast<float>(cover);
    count_[y * cells_ + x] = 0.0F;
    area_m2_ += cover;
  }
  if (y + 1 < cells_) return;
  if (!(area_m2_ > 0.0)) area_m2_ = kPi * radius_m_ * radius_m_;
  density_ = (boulders_ > 0.0 ? boulders_ : 1.0) / area_m2_;
}

void Ground::count_one(const GridPoint& m) {
  const auto d = static_cast<double>(m.diameter_m);
  if (d > 0.0) {
    sizes_[bin_of(d)] += 1.0F;
    sized_ += 1.0F;
  }
  if (m.x_m * m.x_m + m.y_m * m.y_m > radius_m_ * radius_m_) return;
  count_[cell_of(m.x_m, m.y_m)] += 1.0F;
}

void Ground::measure_row(int y) {
  for (int x = 0; x < cells_; ++x) {
    double boulders = 1.0;
    double area = 1.0 / density_;
    for (int v = y > 0 ? y - 1 : 0; v <= y + 1 && v < cells_; ++v) {
      for (int u = x > 0 ? x - 1 : 0; u <= x + 1 && u < cells_; ++u) {
        boulders += static_cast<double>(count_[v * cells_ + u]);
        area += static_cast<double>(cover_m2_[v * cells_ + u]);
      }
    }
    density_of_[y * cells_ + x] = static_cast<float>(boulders / area);
  }
}

int Ground::cell_of(double x_m, double y_m) const {
  const double count = cells_;
  return clamp((y_m + radius_m_) * cells_per_m_, count) * cells_ +
         clamp((x_m + radius_m_) * cells_per_m_, count);
}

double Ground::density(double x_m, double y_m) const {
  return static_cast<double>(density_of_[cell_of(x_m, y_m)]);
}

void Ground::measure_sizes() {
  const auto all = static_cast<double>(sized_);
  for (int i = 0; i < kBins; ++i) {
    const auto here = static_cast<double>(sizes_[i]);
    const double before = i > 0 ? static_cast<double>(sizes_[i - 1]) : here;
    const double after = i + 1 < kBins ? static_cast<double>(sizes_[i + 1]) : here;
    const double smooth = 0.25 * before + 0.5 * here + 0.25 * after + 1.0 / kBins;
    size_density_[i] = all > 0.0 ? static_cast<float>(smooth / (all + 1.0) / kBinWidth) : 0.0F;
  }
}

double Ground::size_density(double diameter_m) const {
  return static_cast<double>(size_density_[bin_of(diameter_m)]);
}

// ---- the cursor -------------------------------------------------------------------------------------------

/// After the last unit of a phase; false at the end.
bool Ground::next_phase() {
  cursor_ = 0;
  switch (phase_) {
    case Phase::kGrid: phase_ = Phase::kBox; return true;
    case Phase::kBox: phase_ = Phase::kCover; return true;
    case Phase::kCover: phase_ = Phase::kCount; return true;
    case Phase::kCount: phase_ = Phase::kDensity; return true;
    case Phase::kDensity: phase_ = Phase::kCrowd; return true;
    case Phase::kCrowd: break;
  }
  return false;
}

/// Neighbours of every so many-th boulder in the disc; false where the budget ran out.
bool Ground::crowd_step(WorkBudget& budget) {
  constexpr std::size_t kMost = 256;
  constexpr double kPriorNeighbours = 4.0;
  const std::size_t stride = grid_.size() / kMost + 1;
  for (; cursor_ < grid_.size(); cursor_ += stride) {
    const GridPoint& m = grid_[cursor_];
    if (m.x_m * m.x_m + m.y_m * m.y_m > radius_m_ * radius_m_) continue;
    for (bool last = false; !last;) {
      BoulderQuery query = grid_.query(m, crowd_m_);
      last = query.cut(seen_);
      if (!budget.take(crowd_ops(query.ops()))) return false;
      grid_.for_each_near(query, [this](std::uint16_t, double) { neighbours_ += 1.0; });
      seen_ = last ? 0 : seen_ + query.candidates;
    }
    neighbours_ -= 1.0;  // itself
    expected_ += density(m.x_m, m.y_m) * kPi * crowd_m_ * crowd_m_;
  }
  crowding_ = (neighbours_ + kPriorNeighbours) / (expected_ + kPriorNeighbours);
  return true;
}

Progress Ground::step(WorkBudget& budget) {
  while (status_ == GridStatus::kRunning) {
    if (phase_ == Phase::kGrid) {
      if (grid_.step(budget) == Progress::kMore) return Progress::kMore;
      if (grid_.status() != GridStatus::kReady) {
        status_ = grid_.status();
        continue;
      }
    } else if (phase_ == Phase::kCover || phase_ == Phase::kDensity) {
      if (!budget.take(row_ops())) return Progress::kMore;
      const bool laying = phase_ == Phase::kCover;
      if (laying && cursor_ == 0) lay_grid();
      const int row = static_cast<int>(cursor_++);
      laying ? lay_row(row) : measure_row(row);
      if (row + 1 < cells_) continue;
      if (!laying) measure_sizes();
    } else if (phase_ == Phase::kCrowd) {
      if (!crowd_step(budget)) return Progress::kMore;
    } else {
      if (!budget.take(kChunkOps)) return Progress::kMore;
      for (std::size_t n = 0; n < kChunk && cursor_ < grid_.size(); ++n, ++cursor_) {
        if (phase_ == Phase::kBox) {
          box_one(grid_[cursor_]);
        } else {
          count_one(grid_[cursor_]);
        }
      }
      if (cursor_ < grid_.size()) continue;
    }
    if (!next_phase()) status_ = GridStatus::kReady;
  }
  return Progress::kDone;
}

}  // namespace cairn
