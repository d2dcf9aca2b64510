/// Neighbours among the map boulders: a grid of cells over their positions. What all registrations ask.
///
/// Two questions, both answered exactly as a search through all boulders would (a test compares them):
///   nearest        the nearest boulder within a radius, of equally near ones the lowest index
///   for_each_near  every boulder within a radius
/// A boulder lies within a radius when dx^2 + dy^2 <= radius^2 in doubles. Distances are in the plane, in
/// metres, between points in axes of `map` about an origin that the caller chooses: near the rover, so that
/// coordinates keep their digits (a boulder on the very circle is safe up to 1e6 radii from the origin).
///
/// The grid has 64 x 64 cells over the square that holds the boulders; a cell is as small as that allows, but
/// no smaller than `least_cell_m`. With the radius of the questions for it, an answer looks at 3 x 3 cells
/// (by rounding, seldom, 4 in a row). Where boulders crowd, the worst that an answer looks at is all
/// of them: `BoulderQuery::ops` says beforehand what it costs, and `cut` cuts it, so that no unit of work
/// need be longer than kPiece boulders. Pieces one after the other visit what the whole does, in its order.
///
/// Cost. start(): next to nothing. step(): copies and checks, 5 operations a boulder; then 8 a boulder and
/// 8192 once; units of 256 boulders, or all cells. A query: see BoulderQuery.
#pragma once

#include <cstdint>

#include "core/nodiscard.hpp"
#include "core/work_budget.hpp"
#include "geometry/boulder.hpp"

namespace cairn {

enum class CAIRN_NODISCARD GridStatus : std::uint8_t {
  kIdle,        ///< never started
  kRunning,     ///< call step() again
  kReady,       ///< ask
  kNoBoulders,  ///< nothing to lay a grid over
  kBadInput,    ///< NaN or infinity, a coordinate beyond 1e7 m, or least_cell_m out of its range
};

/// A boulder as a registration sees it.
struct GridPoint {
  double x_m = 0.0;
  double y_m = 0.0;
  float diameter_m = 0.0F;  ///< 0 = unknown
};

/// What boulders of which sizes may be taken for one another.
struct SizeRule {
  double max_ratio = 0.0;  ///< diameters differ by this factor at most, >= 1; 0 = sizes are not looked at

  /// True also where a diameter is unknown.
  bool agree(float a_m, float b_m) const;
};

/// One question: a point, a radius, and the cells that its answer looks at; good until the grid starts anew.
struct BoulderQuery {
  GridPoint at;
  double radius_m = 0.0;
  int x0 = 0, x1 = 0, y0 = 0, y1 = 0;  ///< cells, inclusive
  std::uint32_t skipped = 0;           ///< boulders in them that pieces before had
  std::uint32_t candidates = 0;        ///< boulders in them that it looks at
  static constexpr std::uint32_t kPiece = 256;

  /// Operations of one answer: 5 a row of cells, at least 20, and 4 a boulder in them.
  std::uint32_t ops() const { return ops(static_cast<std::uint32_t>(y1 - y0 + 1), candidates); }
  /// Leaves of this question what comes after its first `from` boulders, kPiece of them at most; true where
  /// that is the rest of it.
  bool cut(std::uint32_t from) {
    const std::uint32_t rest = candidates - from;
    skipped = from;
    candidates = rest < kPiece ? rest : kPiece;
    return rest <= kPiece;
  }
  static constexpr std::uint32_t ops(std::uint32_t rows, std::uint32_t boulders) {
    return (rows > 4U ? 5U * rows : 20U) + 4U * boulders;
  }
};

struct NearestBoulder {
  std::uint16_t index = 0;  ///< in the MapBoulders given to start(); BoulderGrid::kNone where there is none
  double r2_m2 = 0.0;       ///< squared distance; without a boulder the radius squared
};

/// A grid over one window of the orbital map. Its building is a job; questions are asked once it is kReady.
class BoulderGrid {
 public:
  static constexpr std::uint16_t kNone = 0xFFFF;
  static constexpr double kMaxCoordinate_m = 1.0e7;
  static constexpr std::uint32_t kChunk = 256;  ///< boulders of a unit
  static constexpr std::uint32_t kChunkOps = 4 * kChunk;
  static constexpr std::uint32_t copy_ops(std::uint32_t boulders) { return 5U * boulders; }
  static constexpr std::uint32_t cells_ops() { return kSide * kSide; }
  /// Of a piece of a question.
  static constexpr std::uint32_t most_piece_ops() { return BoulderQuery::ops(kSide, BoulderQuery::kPiece); }

  /// kRunning, or what is wrong with the input but its boulders. These are borrowed: step() copies positions
  /// (less `origin_map_m`) and diameters, and ends with kBadInput where one is bad.
  /// `least_cell_m`: [1e-3, 1e3].
  GridStatus start(const MapBoulders& boulders, const Vec2& origin_map_m, double least_cell_m);
  Progress step(WorkBudget& budget);  ///< the same grid for every slicing
  GridStatus status() const { return status_; }

  std::size_t size() const { return points_.size(); }
  /// By the index in the MapBoulders of start().
  const GridPoint& operator[](std::size_t index) const { return points_[index]; }

  /// `radius_m`: at least 0. A point that is not finite, or far outside, is asked about like any other.
  BoulderQuery query(const GridPoint& at, double radius_m) const;
  /// The nearest boulder within the radius whose size agrees with that of the point.
  NearestBoulder nearest(const BoulderQuery& query, const SizeRule& sizes = SizeRule()) const;
  /// The same over pieces: `best` is what those before found, and begins as none().
  void nearest(const BoulderQuery& piece, const SizeRule& sizes, NearestBoulder& best) const;
  static NearestBoulder none(const BoulderQuery& query) { return {kNone, query.radius_m * query.radius_m}; }
  /// visit(index, r2_m2) for each boulder within the radius, row of cells by row, ascending within a cell.
  template <typename Visit>
  void for_each_near(const BoulderQuery& query, Visit visit) const;

 private:
  static constexpr int kSide = 64;
  enum class Phase : std::uint8_t { kCopy, kClear, kCount, kSum, kPlace };

  Progress copy(WorkBudget& budget);
  bool copy_unit(std::uint32_t boulders);
  void lay();
  int cell_of(const GridPoint& p) const;
  void count_unit();
  void sum_unit();
  void place_unit();

  GridStatus status_ = GridStatus::kIdle;
  Phase phase_ = Phase::kCopy;
  std::uint32_t cursor_ = 0;
  const MapBoulders* source_ = nullptr;  ///< while they are copied
  Vec2 origin_map_m_ = Vec2(0.0, 0.0);
  FixedVector<GridPoint, cfg::kMaxMapWindowBoulders> points_;
  double x0_m_ = 0.0;  ///< corner of the grid: the smallest coordinates
  double y0_m_ = 0.0;
  double x1_m_ = 0.0;  ///< the largest
  double y1_m_ = 0.0;
  double cells_per_m_ = 1.0;
  double reach_per_m_ = 1.0;  ///< a hair more: rounding must not lose a boulder that lies on a circle
  std::uint16_t cell_begin_[kSide * kSide + 1] = {};
  std::uint16_t by_cell_[cfg::kMaxMapWindowBoulders] = {};  ///< indices by cell, ascending within a cell
};

/// Inline: what it visits for then stays in registers.
template <typename Visit>
[[gnu::always_inline]] inline void BoulderGrid::for_each_near(const BoulderQuery& query, Visit visit) const {
  CAIRN_ASSERT(status_ == GridStatus::kReady);
  const double radius2 = query.radius_m * query.radius_m;
  std::uint32_t skip = query.skipped;
  std::uint32_t left = query.candidates;
  for (int y = query.y0; y <= query.y1 && left > 0; ++y) {
    const std::uint32_t end = cell_begin_[y * kSide + query.x1 + 1];
    const std::uint32_t begin = cell_begin_[y * kSide + query.x0];
    const std::uint32_t pass = skip < end - begin ? skip : end - begin;
    skip -= pass;
    for (std::uint32_t k = begin + pass; k < end && left > 0; ++k, --left) {
      const std::uint16_t index = by_cell_[k];
      const double dx = points_[index].x_m - query.at.x_m;
      const double dy = points_[index].y_m - query.at.y_m;
      const double r2 = dx * dx + dy * dy;
      if (r2 <= radius2) visit(index, r2);
    }
  }
}

}  // namespace cairn
