/// The boulders of a whole map, or of a large part of it, as a search for a lost rover wants them: positions,
/// a grid of them, and a raster that answers 'does a boulder stand near here?' with one bit.
///
/// Memory. Positions about the origin in single precision (0.1 mm over a kilometre), diameters in
/// centimetres; a grid of buckets with some 0.7 boulders each, their indices by bucket; a raster of at most
/// cfg::kOccupancyBits cells, each set where a boulder lies within `reach_m` of any point of the cell. A cell
/// is kMinCellM wide, or as wide as the raster's room asks for. The share of set cells is kept by block of 64
/// x 64 cells, so that chance is judged by the density around here.
///
/// Filling: begin(), add() for each boulder, then step() until done. The order of add() changes nothing that
/// is found by it.
///
/// Cost of step(): units of at most 64 boulders or 4096 words of the raster, 50 operations a boulder and
/// phase, and (2 reach / cell + 2)^2 a boulder for the raster.
#pragma once

#include <cstdint>

#include "core/trig.hpp"
#include "core/work_budget.hpp"
#include "geometry/boulder.hpp"

namespace cairn {

class WideMap {
 public:
  static constexpr std::uint32_t kWordsPerUnit = 2048;
  static constexpr std::uint32_t kBouldersPerUnit = 64;
  static constexpr std::uint32_t kMarksPerUnit = 24;  ///< boulders marked in the raster
  static constexpr std::uint32_t kBlocksPerUnit = 3;
  static constexpr std::uint32_t kPlaceOps = 50;  ///< of a boulder
  static constexpr std::uint32_t mark_ops(std::uint32_t cells) { return 20U + 4U * cells; }
  static constexpr std::uint32_t kAroundPerUnit = 32;
  static constexpr std::uint32_t kAroundOps = 40;  ///< of a block
  static constexpr std::uint32_t block_ops() { return 20U * kBlockCells; }
  /// Of the raster, that a boulder's reach meets.
  static constexpr std::uint32_t cells_of_boulder(double reach_m, double cell_m) {
    const double across = 2.0 * reach_m / cell_m + 2.0;
    return static_cast<std::uint32_t>(across * across < 1.0e4 ? across * across : 1.0e4);
  }
  static constexpr std::size_t kCapacity = cfg::kMaxWideMapBoulders;
  static constexpr double kMinCellM = 0.08;  ///< of the raster
  static constexpr int kBlockCells = 64;     ///< side of a block in cells of the raster

  struct Point {
    float x_m;  ///< east of origin_map_m()
    float y_m;
  };
  /// Buckets x0 ... x1, y0 ... y1, inclusive.
  struct Buckets {
    int x0, x1, y0, y1;
  };

  /// Ground from `origin_map_m` (south-west corner) on, `extent_m` east and north: finite, positive, at most
  /// 1e5 m. False (and an empty map) where it is not.
  [[nodiscard]] bool begin(const Vec2& origin_map_m, const Vec2& extent_m, double reach_m);
  /// False: no room, or off the ground of begin(); left out and counted.
  bool add(const MapBoulder& boulder);
  Progress step(WorkBudget& budget);

  bool ready() const { return phase_ == Phase::kReady; }
  std::size_t size() const { return points_.size(); }
  std::uint32_t left_out() const { return left_out_; }
  Vec2 origin_map_m() const { return origin_map_m_; }
  double width_m() const { return width_m_; }
  double height_m() const { return height_m_; }
  double area_m2() const { return width_m_ * height_m_; }

  const Point& point(std::size_t i) const { return points_[i]; }
  double diameter_m(std::size_t i) const { return 0.01 * diameter_cm_[i]; }  ///< 0 = unknown

  /// Share of boulders by ln(diameter), per unit of it, among those whose diameter is known, as they look
  /// with an error of `sigma`: what is seen as larger than the largest is one of those, no rarity.
  double size_density(double log_diameter, double sigma) const;

  // The grid; all of it once ready().
  int columns() const { return columns_; }
  int rows() const { return rows_; }
  double bucket_m() const { return bucket_m_; }
  int column_of(double x_m) const { return bucket_of(x_m, columns_); }
  int row_of(double y_m) const { return bucket_of(y_m, rows_); }
  /// The indices of bucket (column, row) are by_bucket(k), first_in <= k < end_in.
  std::uint32_t first_in(int column, int row) const { return begin_[row * columns_ + column]; }
  std::uint32_t end_in(int column, int row) const { return begin_[row * columns_ + column + 1]; }
  std::uint16_t by_bucket(std::uint32_t k) const { return by_bucket_[k]; }

  // The raster; all of it once ready().
  double cell_m() const { return cell_m_; }
  int cells_x() const { return cells_x_; }
  int cells_y() const { return cells_y_; }
  /// By value into an inner loop.
  struct Raster {
    const std::uint32_t* words;
    std::uint32_t words_a_row;
    std::uint32_t cells_x;
    std::uint32_t cells_y;

    /// A boulder lies within reach of cell (x, y); false off the map.
    bool occupied(std::int32_t x, std::int32_t y) const {
      const auto column = static_cast<std::uint32_t>(x);
      const auto row = static_cast<std::uint32_t>(y);
      if (column >= cells_x || row >= cells_y) return false;
      return ((words[row * words_a_row + (column >> 5U)] >> (column & 31U)) & 1U) != 0;
    }
  };
  Raster raster() const {
    return {raster_, words_, static_cast<std::uint32_t>(cells_x_), static_cast<std::uint32_t>(cells_y_)};
  }
  /// What one boulder sets of the raster, in the mean: the disc of reach, blown up by a cell.
  double spread_of_boulder_m2() const {
    return kPi * reach_m_ * reach_m_ + 4.0 * reach_m_ * cell_m_ + cell_m_ * cell_m_;
  }
  /// Share of set cells about cell (x, y), clamped to the map: of its block and those around it, in 1/65536,
  /// at least 1.
  int density(std::int32_t x, std::int32_t y) const {
    return around_[block_of(y, blocks_y_) * blocks_x_ + block_of(x, blocks_x_)];
  }

 private:
  enum class Phase : std::uint8_t {
    kFilling,
    kClear,
    kCount,
    kSum,
    kPlace,
    kRaster,
    kBlocks,
    kAround,
    kReady
  };
  static constexpr std::size_t kWords = cfg::kOccupancyBits / 32;
  static constexpr std::size_t kMaxBuckets = kCapacity;
  static constexpr std::size_t kMaxBlocks = cfg::kOccupancyBits / (kBlockCells * kBlockCells) + 1024;

  int bucket_of(double at_m, int count) const;
  std::size_t bucket_of(const Point& p) const;
  bool run_phase(WorkBudget& budget);
  void lay_grid();
  void lay_raster();
  void raster_unit(const Point& p);
  void block_unit(std::uint32_t block);
  void around_unit(std::uint32_t block);
  static int block_of(std::int32_t cell, int count) {
    const std::int32_t block = cell > 0 ? cell / kBlockCells : 0;
    return block < count ? block : count - 1;
  }

  Phase phase_ = Phase::kFilling;
  std::uint32_t cursor_ = 0;
  std::uint32_t left_out_ = 0;
  Vec2 origin_map_m_ = Vec2(0.0, 0.0);
  double width_m_ = 0.0;
  double height_m_ = 0.0;
  double reach_m_ = 0.0;
  double bucket_m_ = 1.0;
  double cell_m_ = 1.0;
  int columns_ = 1;
  int rows_ = 1;
  int cells_x_ = 0;
  int cells_y_ = 0;
  int blocks_x_ = 1;
  int blocks_y_ = 1;
  std::uint32_t words_ = 0;  ///< of a raster row
  FixedVector<Point, kCapacity> points_;
  std::uint8_t diameter_cm_[kCapacity] = {};
  /// Boulders by ln(diameter), kSizeBins from kSizeLow on, and in all.
  static constexpr int kSizeBins = 16;
  static constexpr double kSizeLow = -3.5;  ///< 3 cm
  static constexpr double kSizeBin = 0.35;
  static int size_bin(double log_diameter);
  std::uint32_t sized_[kSizeBins] = {};
  std::uint32_t sized_all_ = 0;
  std::uint16_t begin_[kMaxBuckets + 2] = {};
  std::uint16_t by_bucket_[kCapacity] = {};
  std::uint32_t raster_[kWords] = {};
  std::uint16_t share_[kMaxBlocks] = {};   ///< of set cells by block, in 1/65536
  std::uint16_t around_[kMaxBlocks] = {};  ///< mean of it and its neighbours
};
static_assert(sizeof(WideMap) <= cfg::kWideMapMaxBytes, "raise wide_map_max_bytes in mission_cfg");

}  // namespace cairn
