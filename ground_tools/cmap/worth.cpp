#include "cmap/worth.hpp"

#include <algorithm>
#include <cmath>
#include <queue>

namespace cairn::ground {
namespace {

struct Station {
  Vec2 p_map_m;
  double s_m = 0.0;
  double sigma_m = 0.0;  ///< of the drift across the path
  double weight = 1.0;
  double pairs = 0.0;  ///< expected
};

struct View {
  std::size_t station;
  double share;
};

std::vector<Station> stations_on(const PlannedPath& path, const CorridorParams& params) {
  constexpr double kLeastSigma_m = 0.1;
  const double length_m = std::max(path.length_m(), 1e-9);
  const int count = static_cast<int>(length_m / kStation_m) + 1;
  std::vector<Station> stations;
  std::size_t leg = 1;
  for (int n = 0; n < count; ++n) {
    Station s;
    s.s_m = std::min((n + 0.5) * kStation_m, length_m);
    while (leg + 1 < path.s_m.size() && path.s_m[leg] < s.s_m) ++leg;
    const double share = (s.s_m - path.s_m[leg - 1]) / (path.s_m[leg] - path.s_m[leg - 1]);
    s.p_map_m = path.p_map_m[leg - 1] + share * (path.p_map_m[leg] - path.p_map_m[leg - 1]);
    // The corridor's reach allows for two of these.
    s.sigma_m = std::max(kLeastSigma_m, 0.5 * (reach_m(params, s.s_m) - params.half_width_m));
    s.weight = 1.0 / (1.0 + s.s_m / length_m);
    stations.push_back(s);
  }
  return stations;
}

/// Less loss by one more pair, of a station that expects `pairs`.
double gain_at(const Station& s) {
  const double n = s.pairs + 1.0;
  const double scarce = kProofPairs / n;
  return s.weight * (0.5 / (n * std::sqrt(n)) + 4.0 * scarce * scarce * scarce * scarce / n);
}

}  // namespace

std::vector<std::size_t> by_worth(const std::vector<CorridorBoulder>& reached, const PlannedPath& path,
                                  const CorridorParams& params,
                                  const std::function<double(const TableBoulder&)>& found) {
  std::vector<Station> stations = stations_on(path, params);
  const double view_m = cfg::kMission.boulder_max_range_m;
  std::vector<std::vector<View>> views(reached.size());
  for (std::size_t j = 0; j < reached.size(); ++j) {
    const TableBoulder& b = *reached[j].boulder;
    for (std::size_t i = 0; i < stations.size(); ++i) {
      const double beyond = ((b.p_map_m - stations[i].p_map_m).norm() - view_m) / stations[i].sigma_m;
      if (beyond > 4.0) continue;
      const double share = found(b) * 0.5 * std::erfc(beyond / std::sqrt(2.0));
      views[j].push_back({i, share});
      stations[i].pairs += share;
    }
  }
  const auto worth = [&](std::size_t j) {
    double sum = 0.0;
    for (const View& v : views[j]) sum += v.share * gain_at(stations[v.station]);
    return sum;
  };
  // Worth only rises as others go: the least of the queue is the least where it still is what it was.
  using Entry = std::pair<double, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> least;
  for (std::size_t j = 0; j < reached.size(); ++j) least.emplace(worth(j), j);
  std::vector<std::size_t> order;
  order.reserve(reached.size());
  while (!least.empty()) {
    const auto [was, j] = least.top();
    least.pop();
    const double is = worth(j);
    if (!least.empty() && is > least.top().first) {
      least.emplace(is, j);
      continue;
    }
    static_cast<void>(was);
    for (const View& v : views[j]) stations[v.station].pairs -= v.share;
    order.push_back(j);
  }
  std::reverse(order.begin(), order.end());
  return order;
}

}  // namespace cairn::ground
