/// Two boulder tables of the same ground, boulder by boulder: what came, what went, what moved.
#pragma once

#include <cstddef>
#include <vector>

#include "base/boulder_table.hpp"

namespace cairn::ground {

/// One boulder of each table, by index.
struct BoulderPair {
  std::size_t a = 0;
  std::size_t b = 0;
  double distance_m = 0.0;  ///< once the shift is taken off
};

/// Pairs the boulders of two tables one to one: of all pairs at most `within_m` apart, b less `shift_map_m`,
/// the nearest first, as long as both are free. Ties go by place, so that the order of the tables does not
/// matter. Sorted by `a`. n log n for tables whose boulders are not much nearer to each
/// other than `within_m`.
std::vector<BoulderPair> pair_boulders(const std::vector<TableBoulder>& a, const std::vector<TableBoulder>& b,
                                       double within_m, const Vec2& shift_map_m = Vec2(0.0, 0.0));

/// The shift, b less a, that brings the most boulders together, among shifts of at most `reach_m`: all pairs
/// vote in cells of `within_m`, pairing begins where the votes heap up, and the median of what is paired
/// refines it. Boulders that are in one table only hardly matter. Zero where nothing is near.
Vec2 common_shift(const std::vector<TableBoulder>& a, const std::vector<TableBoulder>& b, double within_m,
                  double reach_m);

struct DiffParams {
  double within_m = 0.5;  ///< a boulder is the same if it is found again within this
  double moved_m = 0.0;   ///< and has moved if it is found farther than this
  bool align = false;     ///< take the common shift off first
  double reach_m = 5.0;   ///< longest shift that is looked for
};

struct MapDiff {
  MapExtent common;          ///< where both maps look; the rest does not count
  std::size_t a_inside = 0;  ///< boulders of a in it
  std::size_t b_inside = 0;
  std::vector<BoulderPair> pairs;          ///< indices into the tables that were given
  std::vector<std::size_t> removed;        ///< of a, without a partner
  std::vector<std::size_t> added;          ///< of b
  std::size_t moved = 0;                   ///< pairs farther apart than moved_m
  Vec2 shift_map_m = Vec2(0.0, 0.0);       ///< that was taken off, b less a; 0 unless aligned
  Vec2 mean_shift_map_m = Vec2(0.0, 0.0);  ///< of the pairs, b less a as they are
  double rms_m = 0.0;                      ///< of the pairs' distances
  double median_size_ratio = 1.0;          ///< of the pairs, diameter in b over that in a

  /// Share of the boulders of the map with fewer that the other has, too: the usual measure of detectors. 1
  /// where both are empty.
  double repeatability() const;
};

/// Compares two maps where both look: boulders without a partner outside of that do not count.
MapDiff diff_maps(const std::vector<TableBoulder>& a, const MapExtent& extent_a,
                  const std::vector<TableBoulder>& b, const MapExtent& extent_b, const DiffParams& params);

}  // namespace cairn::ground
