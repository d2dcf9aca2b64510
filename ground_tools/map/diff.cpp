#include "map/diff.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>

#include "base/statistics.hpp"
#include "map/boulder_cells.hpp"

namespace cairn::ground {
namespace {

auto place_key(const TableBoulder& b) {
  return std::make_tuple(b.p_map_m.y(), b.p_map_m.x(), b.diameter_m, b.confidence);
}

/// Where the shifts of all pairs of boulders heap up.
Vec2 voted_shift(const std::vector<TableBoulder>& a, const std::vector<TableBoulder>& b, double cell_m,
                 double reach_m) {
  const int half = static_cast<int>(std::min(500.0, std::ceil(reach_m / cell_m)));
  const double side_m = reach_m / half;
  const int side = 2 * half + 1;
  std::vector<std::uint32_t> votes(static_cast<std::size_t>(side) * static_cast<std::size_t>(side), 0);
  const BoulderCells near(b, Vec2(0.0, 0.0), reach_m);
  for (const TableBoulder& one : a) {
    near.within(one.p_map_m, reach_m, [&](std::size_t i, double) {
      const Vec2 shift_m = b[i].p_map_m - one.p_map_m;
      const auto x = static_cast<std::size_t>(std::lround(shift_m.x() / side_m) + half);
      const auto y = static_cast<std::size_t>(std::lround(shift_m.y() / side_m) + half);
      ++votes[y * static_cast<std::size_t>(side) + x];
    });
  }
  std::uint64_t most = 0;
  int best_x = 0;
  int best_y = 0;
  for (int y = -half; y <= half; ++y) {
    for (int x = -half; x <= half; ++x) {
      std::uint64_t sum = 0;  // weights 1 2 1 each way: the middle of a heap, not some cell beside it
      for (int v = std::max(y - 1, -half); v <= std::min(y + 1, half); ++v) {
        for (int u = std::max(x - 1, -half); u <= std::min(x + 1, half); ++u) {
          const std::uint32_t weight = (v == y ? 2U : 1U) * (u == x ? 2U : 1U);
          sum += weight * votes[static_cast<std::size_t>(v + half) * static_cast<std::size_t>(side) +
                                static_cast<std::size_t>(u + half)];
        }
      }
      const bool nearer = x * x + y * y < best_x * best_x + best_y * best_y;
      if (sum > most || (sum == most && nearer)) {
        most = sum;
        best_x = x;
        best_y = y;
      }
    }
  }
  return most == 0 ? Vec2(0.0, 0.0) : Vec2(best_x * side_m, best_y * side_m);
}

MapExtent shifted(const MapExtent& e, const Vec2& by_m) {
  return {e.min_x_m + by_m.x(), e.min_y_m + by_m.y(), e.max_x_m + by_m.x(), e.max_y_m + by_m.y()};
}

MapExtent overlap(const MapExtent& a, const MapExtent& b) {
  return {std::max(a.min_x_m, b.min_x_m), std::max(a.min_y_m, b.min_y_m), std::min(a.max_x_m, b.max_x_m),
          std::min(a.max_y_m, b.max_y_m)};
}

/// Those without a partner that both maps should show.
std::vector<std::size_t> unpaired(const std::vector<TableBoulder>& boulders, const std::vector<bool>& paired,
                                  const Vec2& shift_map_m, const MapExtent& common) {
  std::vector<std::size_t> alone;
  for (std::size_t i = 0; i < boulders.size(); ++i) {
    if (!paired[i] && common.contains(boulders[i].p_map_m - shift_map_m)) alone.push_back(i);
  }
  return alone;
}

}  // namespace

std::vector<BoulderPair> pair_boulders(const std::vector<TableBoulder>& a, const std::vector<TableBoulder>& b,
                                       double within_m, const Vec2& shift_map_m) {
  if (!(within_m > 0.0) || a.empty() || b.empty()) return {};
  const BoulderCells near(b, shift_map_m, within_m);
  std::vector<BoulderPair> all;
  for (std::size_t i = 0; i < a.size(); ++i) {
    near.within(a[i].p_map_m, within_m, [&](std::size_t j, double distance_m) {
      all.push_back({i, j, distance_m});
    });
  }
  std::sort(all.begin(), all.end(), [&](const BoulderPair& x, const BoulderPair& y) {
    if (x.distance_m != y.distance_m) return x.distance_m < y.distance_m;
    const auto x_key = std::make_pair(place_key(a[x.a]), place_key(b[x.b]));
    const auto y_key = std::make_pair(place_key(a[y.a]), place_key(b[y.b]));
    return x_key != y_key ? x_key < y_key : std::tie(x.a, x.b) < std::tie(y.a, y.b);
  });
  std::vector<bool> a_taken(a.size(), false);
  std::vector<bool> b_taken(b.size(), false);
  std::vector<BoulderPair> pairs;
  for (const BoulderPair& pair : all) {
    if (a_taken[pair.a] || b_taken[pair.b]) continue;
    a_taken[pair.a] = true;
    b_taken[pair.b] = true;
    pairs.push_back(pair);
  }
  std::sort(pairs.begin(), pairs.end(), [](const BoulderPair& x, const BoulderPair& y) { return x.a < y.a; });
  return pairs;
}

Vec2 common_shift(const std::vector<TableBoulder>& a, const std::vector<TableBoulder>& b, double within_m,
                  double reach_m) {
  if (!(within_m > 0.0) || !(reach_m > 0.0)) return {0.0, 0.0};
  Vec2 shift_m = voted_shift(a, b, within_m, reach_m);
  constexpr int kRounds = 5;
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<BoulderPair> pairs = pair_boulders(a, b, within_m, shift_m);
    if (pairs.empty()) break;
    std::vector<double> x;
    std::vector<double> y;
    for (const BoulderPair& pair : pairs) {
      const Vec2 d = b[pair.b].p_map_m - a[pair.a].p_map_m;
      x.push_back(d.x());
      y.push_back(d.y());
    }
    const Vec2 next(median(x), median(y));
    const bool still = (next - shift_m).norm() < 1e-4;
    shift_m = next;
    if (still) break;
  }
  return shift_m;
}

double MapDiff::repeatability() const {
  const std::size_t fewer = std::min(a_inside, b_inside);
  if (fewer != 0) return static_cast<double>(pairs.size()) / static_cast<double>(fewer);
  return a_inside == b_inside ? 1.0 : 0.0;
}

MapDiff diff_maps(const std::vector<TableBoulder>& a, const MapExtent& extent_a,
                  const std::vector<TableBoulder>& b, const MapExtent& extent_b, const DiffParams& params) {
  MapDiff diff;
  if (params.align) diff.shift_map_m = common_shift(a, b, params.within_m, params.reach_m);
  diff.common = overlap(extent_a, shifted(extent_b, -diff.shift_map_m));
  diff.pairs = pair_boulders(a, b, params.within_m, diff.shift_map_m);
  std::vector<bool> a_paired(a.size(), false);
  std::vector<bool> b_paired(b.size(), false);
  std::vector<double> ratios;
  double squares_m2 = 0.0;
  for (const BoulderPair& pair : diff.pairs) {
    a_paired[pair.a] = true;
    b_paired[pair.b] = true;
    if (pair.distance_m > params.moved_m) ++diff.moved;
    diff.mean_shift_map_m += b[pair.b].p_map_m - a[pair.a].p_map_m;
    squares_m2 += pair.distance_m * pair.distance_m;
    ratios.push_back(b[pair.b].diameter_m / a[pair.a].diameter_m);
  }
  if (!diff.pairs.empty()) {
    const auto count = static_cast<double>(diff.pairs.size());
    diff.mean_shift_map_m /= count;
    diff.rms_m = std::sqrt(squares_m2 / count);
    diff.median_size_ratio = median(ratios);
  }
  diff.removed = unpaired(a, a_paired, Vec2(0.0, 0.0), diff.common);
  diff.added = unpaired(b, b_paired, diff.shift_map_m, diff.common);
  diff.a_inside = diff.pairs.size() + diff.removed.size();
  diff.b_inside = diff.pairs.size() + diff.added.size();
  return diff;
}

}  // namespace cairn::ground
