/// What is known of the orbital map around here: where its boulders are, how densely they lie, how large
/// they are. The null hypothesis of the verdict (registration/verdict.hpp) is measured from it.
///
/// Density. The area covered is the disc of `radius_m` about the centre, cut to the box of the boulders in
/// it (a window may hang over the edge of the map). It is divided into square cells, so wide that 3 x 3 of
/// them hold some 30 boulders at the mean density; the density at a point is (boulders + 1) / (area covered
/// + 1 / mean density) over the 3 x 3 cells about its own: local where the ground changes, and never zero.
///
/// Sizes. The density of ln(diameter) over the boulders whose diameter is known: shares of 40 bins of 0.25
/// from 5 mm up, smoothed by (1 2 1)/4, plus one boulder spread evenly.
///
/// Crowding. How many more neighbours within `crowd_m` the boulders of the map have than scattered ones
/// would: (neighbours + 4) / (pi crowd_m^2 sum of densities + 4), over 256 of them at most. 1 on scattered
/// ground, less on lattices, much more where boulders lie in clusters.
///
/// Coordinates: axes of `map` about the centre.
///
/// Cost. start(): next to nothing; the boulders are borrowed as the grid borrows them. step(): the grid's, 70
/// operations a boulder and 20,000 once, and 256 questions to the grid; units of 64 boulders, of all cells'
/// cover, of all cells' density, of a piece of one question.
#pragma once

#include <cstdint>

#include "core/work_budget.hpp"
#include "registration/boulder_grid.hpp"

namespace cairn {

class Ground {
 public:
  static constexpr int kBins = 40;           ///< of sizes
  static constexpr std::size_t kChunk = 64;  ///< boulders of a unit
  static constexpr std::uint32_t kChunkOps = 35 * kChunk;
  static constexpr std::uint32_t row_ops() { return 36U * kMaxCells; }
  static constexpr std::uint32_t crowd_ops(std::uint32_t query) { return 20U + query; }
  /// kRunning, or what is wrong with the input. Boulders outside the disc stay in the grid and count for
  /// nothing else. `radius_m`: [1e-2, 1e5]; `crowd_m`: [1e-3, 1e3].
  GridStatus start(const MapBoulders& boulders, const Vec2& centre_map_m, double radius_m,
                   double least_cell_m, double crowd_m);
  Progress step(WorkBudget& budget);  ///< the same for every slicing
  GridStatus status() const { return status_; }

  const BoulderGrid& grid() const { return grid_; }
  const Vec2& centre_map_m() const { return centre_map_m_; }
  double radius_m() const { return radius_m_; }
  double area_m2() const { return area_m2_; }       ///< covered
  double mean_density() const { return density_; }  ///< boulders a square metre of it
  double density(double x_m, double y_m) const;     ///< around a point; outside the cells the nearest cell's
  double crowding() const { return crowding_; }
  /// Of ln(diameter), per unit; diameter > 0. 0 where the map knows no diameters.
  double size_density(double diameter_m) const;

 private:
  static constexpr int kMaxCells = 16;  // a side

  enum class Phase : std::uint8_t { kGrid, kBox, kCover, kCount, kDensity, kCrowd };

  bool next_phase();
  void box_one(const GridPoint& m);
  void count_one(const GridPoint& m);
  void lay_grid();
  void lay_row(int y);
  void measure_row(int y);
  void measure_sizes();
  bool crowd_step(WorkBudget& budget);
  double covered(double x0, double y0, double side) const;
  int cell_of(double x_m, double y_m) const;

  GridStatus status_ = GridStatus::kIdle;
  Phase phase_ = Phase::kGrid;
  std::size_t cursor_ = 0;
  BoulderGrid grid_;
  Vec2 centre_map_m_ = Vec2(0.0, 0.0);
  double radius_m_ = 1.0;
  double area_m2_ = 1.0;
  double density_ = 0.0;
  double boulders_ = 0.0;  // in the disc
  double box_[4] = {};     // of the boulders in the disc: x0, x1, y0, y1
  int cells_ = 1;          // a side
  double cell_m_ = 1.0;
  double cells_per_m_ = 1.0;
  float count_[kMaxCells * kMaxCells] = {};
  float cover_m2_[kMaxCells * kMaxCells] = {};
  float density_of_[kMaxCells * kMaxCells] = {};
  double crowd_m_ = 0.4;
  double crowding_ = 1.0;
  double neighbours_ = 0.0;
  std::uint32_t seen_ = 0;  ///< of the question under way
  double expected_ = 0.0;
  float sizes_[kBins] = {};  // boulders in a bin
  float sized_ = 0.0F;       // and in all
  float size_density_[kBins] = {};
};

}  // namespace cairn
