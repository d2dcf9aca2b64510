#include "map/score.hpp"

#include <algorithm>
#include <limits>

#include "base/statistics.hpp"
#include "base/waypoints.hpp"
#include "map/boulder_cells.hpp"

namespace cairn::ground {
namespace {

constexpr double kCell_m = 0.5;  ///< of the search for entries, at least: most rocks are smaller

BoulderCells cells_of(const std::vector<TableBoulder>& entries, const ScoreParams& params) {
  return {entries, Vec2(0.0, 0.0), std::max(params.distance_m, kCell_m)};
}

/// The entry nearest to a rock that belongs to it; null where there is none.
const TableBoulder* nearest_entry(const std::vector<TableBoulder>& entries, const BoulderCells& cells,
                                  const TableBoulder& rock, const ScoreParams& params) {
  const TableBoulder* nearest = nullptr;
  double nearest_m = std::numeric_limits<double>::infinity();
  cells.within(rock.p_map_m, std::max(params.distance_m, 0.5 * rock.diameter_m),
               [&](std::size_t i, double distance_m) {
                 if (distance_m >= nearest_m) return;
                 nearest_m = distance_m;
                 nearest = &entries[i];
               });
  return nearest;
}

void score_recall(const std::vector<TableBoulder>& entries, const std::vector<TableBoulder>& truth,
                  const MapExtent& extent, const ScoreParams& params, MapScore& score) {
  const BoulderCells cells = cells_of(entries, params);
  std::vector<double> errors_m;
  Vec2 shift_m(0.0, 0.0);
  for (const TableBoulder& rock : truth) {
    if (rock.diameter_m < params.recall_diameter_m || !counts(params, extent, rock.p_map_m)) continue;
    ++score.rocks;
    const TableBoulder* nearest = nearest_entry(entries, cells, rock, params);
    if (nearest == nullptr) continue;
    ++score.found;
    const Vec2 shift = nearest->p_map_m - rock.p_map_m;
    errors_m.push_back(shift.norm());
    shift_m += shift;
  }
  if (errors_m.empty()) return;
  score.median_error_m = median(errors_m);
  score.mean_shift_map_m = shift_m / static_cast<double>(errors_m.size());
}

void score_precision(const std::vector<TableBoulder>& entries, const std::vector<TableBoulder>& truth,
                     double largest_m, const MapExtent& extent, const ScoreParams& params, MapScore& score) {
  const double reach_m = std::max(params.distance_m, 0.5 * largest_m);
  const BoulderCells cells(truth, Vec2(0.0, 0.0), std::max(reach_m, kCell_m));
  for (const TableBoulder& entry : entries) {
    if (!counts(params, extent, entry.p_map_m)) continue;
    ++score.entries;
    bool right = false;
    cells.within(entry.p_map_m, reach_m, [&](std::size_t i, double distance_m) {
      right = right || (truth[i].diameter_m >= params.precision_diameter_m &&
                        distance_m <= std::max(params.distance_m, 0.5 * truth[i].diameter_m));
    });
    if (right) ++score.right;
  }
}

}  // namespace

bool counts(const ScoreParams& params, const MapExtent& extent, const Vec2& p_map_m) {
  if (!extent.contains(p_map_m, params.margin_m)) return false;
  if (params.way_map_m.empty()) return true;
  for (std::size_t i = 1; i < params.way_map_m.size(); ++i) {
    if (distance_m(p_map_m, params.way_map_m[i - 1], params.way_map_m[i]) <= params.within_m) return true;
  }
  return false;
}

MapScore score_map(const std::vector<TableBoulder>& entries, const std::vector<TableBoulder>& truth,
                   const MapExtent& extent, const ScoreParams& params) {
  MapScore score;
  double largest_m = 0.0;
  for (const TableBoulder& rock : truth) largest_m = std::max(largest_m, rock.diameter_m);
  score_recall(entries, truth, extent, params, score);
  score_precision(entries, truth, largest_m, extent, params, score);
  return score;
}

std::vector<SizeClass> score_by_size(const std::vector<TableBoulder>& entries,
                                     const std::vector<TableBoulder>& truth, const MapExtent& extent,
                                     const ScoreParams& params) {
  double largest_m = 0.0;
  for (const TableBoulder& rock : truth) {
    if (counts(params, extent, rock.p_map_m)) largest_m = std::max(largest_m, rock.diameter_m);
  }
  const BoulderCells cells = cells_of(entries, params);
  std::vector<SizeClass> classes;
  for (double from_m = params.recall_diameter_m; from_m <= largest_m; from_m *= 2.0) {
    SizeClass c;
    c.from_m = from_m;
    c.to_m = 2.0 * from_m;
    std::vector<double> errors_m;
    std::vector<double> ratios;
    for (const TableBoulder& rock : truth) {
      if (rock.diameter_m < c.from_m || rock.diameter_m >= c.to_m || !counts(params, extent, rock.p_map_m)) {
        continue;
      }
      ++c.rocks;
      const TableBoulder* nearest = nearest_entry(entries, cells, rock, params);
      if (nearest == nullptr) continue;
      ++c.found;
      errors_m.push_back((nearest->p_map_m - rock.p_map_m).norm());
      ratios.push_back(nearest->diameter_m / rock.diameter_m);
    }
    if (c.found != 0) {
      c.median_error_m = median(errors_m);
      c.diameter_ratio = median(ratios);
    }
    classes.push_back(c);
  }
  return classes;
}

double sunward_shift_m(const MapScore& score, const Sun& sun) {
  return score.mean_shift_map_m.dot(sun_direction_map(sun));
}

}  // namespace cairn::ground
