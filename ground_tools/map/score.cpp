#include "map/score.hpp"

#include <algorithm>
#include <limits>

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

void score_recall(const ByEast& entries, const std::vector<TableBoulder>& truth, const MapExtent& extent,
                  const ScoreParams& params, MapScore& score) {
  std::vector<double> errors_m;
  Vec2 shift_m(0.0, 0.0);
  for (const TableBoulder& rock : truth) {
    if (rock.diameter_m < params.recall_diameter_m || !extent.contains(rock.p_map_m, params.margin_m))
      continue;
    ++score.rocks;
    double nearest_m = std::numeric_limits<double>::infinity();
    Vec2 nearest_shift_m(0.0, 0.0);
    entries.within(rock.p_map_m, std::max(params.distance_m, 0.5 * rock.diameter_m),
                   [&](const TableBoulder& entry, double distance_m) {
                     if (distance_m >= nearest_m) return;
                     nearest_m = distance_m;
                     nearest_shift_m = entry.p_map_m - rock.p_map_m;
                   });
    if (nearest_m == std::numeric_limits<double>::infinity()) continue;
    ++score.found;
    errors_m.push_back(nearest_m);
    shift_m += nearest_shift_m;
  }
  if (errors_m.empty()) return;
  const auto middle = errors_m.begin() + static_cast<std::ptrdiff_t>(errors_m.size() / 2);
  std::nth_element(errors_m.begin(), middle, errors_m.end());
  score.median_error_m = *middle;
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

}  // namespace cairn::ground
