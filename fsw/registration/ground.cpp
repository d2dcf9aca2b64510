#include "registration/ground.hpp"

#include <cmath>

#include "core/exp_log.hpp"
#include "core/trig.hpp"

namespace cairn {
namespace {

constexpr double kPerBlock = 30.0;  // boulders in 3 x 3 cells
constexpr double kBinWidth = 0.25;
constexpr double kSmallest_m = 0.005;

int clamp(double value, int count) {
  if (!(value >= 0.0)) return 0;
  return value < static_cast<double>(count) ? static_cast<int>(value) : count - 1;
}

}  // namespace

GridStatus Ground::start(const MapBoulders& boulders, const Vec2& centre_map_m, double radius_m,
                         double least_cell_m) {
  centre_map_m_ = centre_map_m;
  radius_m_ = radius_m >= 1.0e-2 && radius_m <= 1.0e5 ? radius_m : -1.0;
  const GridStatus laid = grid_.start(boulders, centre_map_m, radius_m_ > 0.0 ? least_cell_m : -1.0);
  if (laid != GridStatus::kRunning) return laid;
  measure_density();
  measure_sizes();
  return laid;
}

/// Area of a square that lies in disc and box, by 4 x 4 samples.
double Ground::covered(double x0, double y0, double side) const {
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

void Ground::measure_density() {
  double count = 0.0;
  for (std::size_t k = 0; k < grid_.size(); ++k) {
    const GridPoint& m = grid_[k];
    if (m.x_m * m.x_m + m.y_m * m.y_m > radius_m_ * radius_m_) continue;
    if (count == 0.0 || m.x_m < box_[0]) box_[0] = m.x_m;
    if (count == 0.0 || m.x_m > box_[1]) box_[1] = m.x_m;
    if (count == 0.0 || m.y_m < box_[2]) box_[2] = m.y_m;
    if (count == 0.0 || m.y_m > box_[3]) box_[3] = m.y_m;
    count += 1.0;
  }
  if (count == 0.0) box_[0] = box_[1] = box_[2] = box_[3] = 0.0;
  // The box of n points falls short of the area that they were strewn over by one point's share each way.
  const double room = 0.5 * (box_[1] - box_[0] + box_[3] - box_[2]) / (count + 1.0);
  for (int side = 0; side < 4; ++side) box_[side] += side % 2 == 0 ? -room : room;

  const double disc = kPi * radius_m_ * radius_m_;
  const double side = std::sqrt(kPerBlock / 9.0 * disc / (count + 1.0));
  const double cells = 2.0 * radius_m_ / side + 1.0;
  cells_ = clamp(cells, kMaxCells + 1);
  if (cells_ < 1) cells_ = 1;
  cell_m_ = 2.0 * radius_m_ / cells_;
  area_m2_ = 0.0;
  for (int y = 0; y < cells_; ++y) {
    for (int x = 0; x < cells_; ++x) {
      const double cover = covered(x * cell_m_ - radius_m_, y * cell_m_ - radius_m_, cell_m_);
      cover_m2_[y * cells_ + x] = static_cast<float>(cover);
      count_[y * cells_ + x] = 0.0F;
      area_m2_ += cover;
    }
  }
  if (!(area_m2_ > 0.0)) area_m2_ = disc;
  density_ = (count > 0.0 ? count : 1.0) / area_m2_;
  for (std::size_t k = 0; k < grid_.size(); ++k) {
    const GridPoint& m = grid_[k];
    if (m.x_m * m.x_m + m.y_m * m.y_m > radius_m_ * radius_m_) continue;
    count_[clamp((m.y_m + radius_m_) / cell_m_, cells_) * cells_ +
           clamp((m.x_m + radius_m_) / cell_m_, cells_)] += 1.0F;
  }
  for (int y = 0; y < cells_; ++y) {
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
}

double Ground::density(double x_m, double y_m) const {
  const int x = clamp((x_m + radius_m_) / cell_m_, cells_);
  const int y = clamp((y_m + radius_m_) / cell_m_, cells_);
  return static_cast<double>(density_of_[y * cells_ + x]);
}

void Ground::measure_sizes() {
  double count[kBins] = {};
  double all = 0.0;
  for (std::size_t k = 0; k < grid_.size(); ++k) {
    const auto d = static_cast<double>(grid_[k].diameter_m);
    if (!(d > 0.0)) continue;
    count[clamp(ln(d / kSmallest_m) / kBinWidth, kBins)] += 1.0;
    all += 1.0;
  }
  for (int i = 0; i < kBins; ++i) {
    const double before = i > 0 ? count[i - 1] : count[i];
    const double after = i + 1 < kBins ? count[i + 1] : count[i];
    const double smooth = 0.25 * before + 0.5 * count[i] + 0.25 * after + 1.0 / kBins;
    size_density_[i] = all > 0.0 ? static_cast<float>(smooth / (all + 1.0) / kBinWidth) : 0.0F;
  }
}

double Ground::size_density(double diameter_m) const {
  return static_cast<double>(size_density_[clamp(ln(diameter_m / kSmallest_m) / kBinWidth, kBins)]);
}

}  // namespace cairn
