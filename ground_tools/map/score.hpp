/// How good a boulder map is, against a table of the true rocks.
#pragma once

#include <cstddef>
#include <vector>

#include "base/boulder_table.hpp"
#include "ortho/sun.hpp"

namespace cairn::ground {

struct ScoreParams {
  double margin_m = 0.5;            ///< rocks and entries nearer than this to the extent's rim do not count
  std::vector<Vec2> way_map_m;      ///< of a drive: what lies farther from it than within_m does not count;
  double within_m = 15.0;           ///< no way: all counts
  double recall_diameter_m = 0.15;  ///< true rocks of this size and more are to be found
  double precision_diameter_m = 0.08;  ///< true rocks of this size and more make an entry right
  double distance_m = 0.10;  ///< an entry belongs to a rock within this, or within half the rock's diameter
};

struct MapScore {
  std::size_t rocks = 0;                   ///< true rocks to be found
  std::size_t found = 0;                   ///< of these, those with an entry near enough
  std::size_t entries = 0;                 ///< entries inside
  std::size_t right = 0;                   ///< of these, those near enough to a true rock
  double median_error_m = 0.0;             ///< of found rocks, to the nearest entry; 0 where none was found
  Vec2 mean_shift_map_m = Vec2(0.0, 0.0);  ///< nearest entry minus rock, mean over found rocks

  double recall() const { return rocks == 0 ? 0.0 : static_cast<double>(found) / static_cast<double>(rocks); }
  double precision() const {
    return entries == 0 ? 0.0 : static_cast<double>(right) / static_cast<double>(entries);
  }
};

/// Whether what lies there counts.
bool counts(const ScoreParams& params, const MapExtent& extent, const Vec2& p_map_m);

/// Compares `entries` (a map that covers `extent`) with `truth`.
MapScore score_map(const std::vector<TableBoulder>& entries, const std::vector<TableBoulder>& truth,
                   const MapExtent& extent, const ScoreParams& params = {});

/// How the rocks of one range of diameters were found.
struct SizeClass {
  double from_m = 0.0;
  double to_m = 0.0;
  std::size_t rocks = 0;
  std::size_t found = 0;
  double median_error_m = 0.0;  ///< of found rocks; 0 where none was found
  double diameter_ratio = 0.0;  ///< entry's over rock's, median over found rocks; 0 where none was found
  double recall() const { return rocks == 0 ? 0.0 : static_cast<double>(found) / static_cast<double>(rocks); }
};

/// By classes of diameter that double from `params.recall_diameter_m` on, up to the largest rock.
std::vector<SizeClass> score_by_size(const std::vector<TableBoulder>& entries,
                                     const std::vector<TableBoulder>& truth, const MapExtent& extent,
                                     const ScoreParams& params = {});

/// The mean shift along the sun's azimuth: positive = entries lie towards the sun, negative = in the shadow.
double sunward_shift_m(const MapScore& score, const Sun& sun);

}  // namespace cairn::ground
