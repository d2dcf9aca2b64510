#include "map/score.hpp"

#include <algorithm>
#include <limits>

#include "base/statistics.hpp"

namespace cairn::ground {
namespace {

/// Boulders by x, so that a search by distance looks at a narrow strip only.
class ByEast {
 public:
  explicit ByEast(std::vector<TableBoulder> boulders) : boulders_(std::move(boulders)) {
    std::stable_sort(boulders_.begin(), boulders_.end(), [](const TableBoulder& a, const TableBoulder& b) {
      return a.p_map_m.x() < b.p_map_m.x();
    });
  }
  template <typename Visit>
  void within(const Vec2& p_map_m, double radius_m, const Visit& visit) const {
    auto at = std::lower_bound(boulders_.begin(), boulders_.end(), p_map_m.x() - radius_m,
                               [](const TableBoulder& b, double x) { return b.p_map_m.x() < x; });
    for (; at != boulders_.end() && at->p_map_m.x() <= p_map_m.x() + radius_m; ++at) {
      const double distance_m = (at->p_map_m - p_map_m).norm();
      if (distance_m <= radius_m) visit(*at, distance_m);
    }
  }

 private:
  std::vector<TableBoulder> boulders_;
};

/// The entry nearest to a rock that belongs to it; null where there is none.
const TableBoulder* nearest_entry(const ByEast& entries, const TableBoulder& rock,
                                  const ScoreParams& params) {
  const TableBoulder* nearest = nullptr;
  double nearest_m = std::numeric_limits<double>::infinity();
  entries.within(rock.p_map_m, std::max(params.distance_m, 0.5 * rock.diameter_m),
                 [&](const TableBoulder& entry, double distance_m) {
                   if (distance_m >= nearest_m) return;
                   nearest_m = distance_m;
                   nearest = &entry;
                 });
  return nearest;
}

void score_recall(const ByEast& entries, const std::vector<TableBoulder>& truth, const MapExtent& extent,
                  const ScoreParams& params, MapScore& score) {
  std::vector<double> errors_m;
  Vec2 shift_m(0.0, 0.0);
  for (const TableBoulder& rock : truth) {
    if (rock.diameter_m < params.recall_diameter_m || !extent.contains(rock.p_map_m, params.margin_m))
      continue;
    ++score.rocks;
    const TableBoulder* nearest = nearest_entry(entries, rock, params);
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

void score_precision(const std::vector<TableBoulder>& entries, const ByEast& truth, double largest_m,
                     const MapExtent& extent, const ScoreParams& params, MapScore& score) {
  for (const TableBoulder& entry : entries) {
    if (!extent.contains(entry.p_map_m, params.margin_m)) continue;
    ++score.entries;
    bool right = false;
    truth.within(entry.p_map_m, std::max(params.distance_m, 0.5 * largest_m),
                 [&](const TableBoulder& rock, double distance_m) {
                   right = right || (rock.diameter_m >= params.precision_diameter_m &&
                                     distance_m <= std::max(params.distance_m, 0.5 * rock.diameter_m));
                 });
    if (right) ++score.right;
  }
}

}  // namespace

MapScore score_map(const std::vector<TableBoulder>& entries, const std::vector<TableBoulder>& truth,
                   const MapExtent& extent, const ScoreParams& params) {
  MapScore score;
  double largest_m = 0.0;
  for (const TableBoulder& rock : truth) largest_m = std::max(largest_m, rock.diameter_m);
  score_recall(ByEast(entries), truth, extent, params, score);
  score_precision(entries, ByEast(truth), largest_m, extent, params, score);
  return score;
}

std::vector<SizeClass> score_by_size(const std::vector<TableBoulder>& entries,
                                     const std::vector<TableBoulder>& truth, const MapExtent& extent,
                                     const ScoreParams& params) {
  double largest_m = 0.0;
  for (const TableBoulder& rock : truth) {
    if (extent.contains(rock.p_map_m, params.margin_m)) largest_m = std::max(largest_m, rock.diameter_m);
  }
  const ByEast by_east(entries);
  std::vector<SizeClass> classes;
  for (double from_m = params.recall_diameter_m; from_m <= largest_m; from_m *= 2.0) {
    SizeClass c;
    c.from_m = from_m;
    c.to_m = 2.0 * from_m;
    std::vector<double> errors_m;
    std::vector<double> ratios;
    for (const TableBoulder& rock : truth) {
      if (rock.diameter_m < c.from_m || rock.diameter_m >= c.to_m ||
          !extent.contains(rock.p_map_m, params.margin_m)) {
        continue;
      }
      ++c.rocks;
      const TableBoulder* nearest = nearest_entry(by_east, rock, params);
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
