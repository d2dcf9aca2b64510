#include "map/merge.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace cairn::ground {
namespace {

/// A boulder and where it comes from.
struct Entry {
  TableBoulder boulder;
  double pixel_m = 0.0;
  std::size_t part = 0;
};

auto key(const TableBoulder& b) {
  const double ground_m =
      std::isfinite(b.ground_z_m) ? b.ground_z_m : -std::numeric_limits<double>::infinity();
  return std::make_tuple(b.p_map_m.y(), b.p_map_m.x(), b.diameter_m, b.confidence, b.area_m2, b.contrast,
                         b.elongation, b.height_m, ground_m);
}

/// Best first; total, so that nothing hangs on where a part stood.
bool better(const Entry& a, const Entry& b) {
  return std::make_tuple(-a.boulder.confidence, a.pixel_m, key(a.boulder)) <
         std::make_tuple(-b.boulder.confidence, b.pixel_m, key(b.boulder));
}

struct Candidate {
  std::size_t a = 0;
  std::size_t b = 0;
  double distance_m = 0.0;
};

/// All pairs of different parts that are near enough; entries are sorted by y.
std::vector<Candidate> candidates(const std::vector<Entry>& entries, double within_m) {
  std::vector<Candidate> all;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const Vec2 p = entries[i].boulder.p_map_m;
    for (std::size_t j = i + 1; j < entries.size() && entries[j].boulder.p_map_m.y() - p.y() <= within_m;
         ++j) {
      const double distance_m = (entries[j].boulder.p_map_m - p).norm();
      if (entries[i].part != entries[j].part && distance_m <= within_m) all.push_back({i, j, distance_m});
    }
  }
  // Entries stand by their values: their numbers break ties the same way whatever the order of the parts.
  std::sort(all.begin(), all.end(), [](const Candidate& x, const Candidate& y) {
    return std::tie(x.distance_m, x.a, x.b) < std::tie(y.distance_m, y.a, y.b);
  });
  return all;
}

TableBoulder joined(std::vector<Entry> group) {
  std::sort(group.begin(), group.end(), better);
  const auto ends = std::find_if(group.begin(), group.end(), [&](const Entry& e) {
    return e.boulder.confidence != group.front().boulder.confidence || e.pixel_m != group.front().pixel_m;
  });
  TableBoulder best = group.front().boulder;
  const auto mean = [&](auto member) {
    double sum = 0.0;
    for (auto e = group.begin(); e != ends; ++e) sum += member(e->boulder);
    return sum / static_cast<double>(ends - group.begin());
  };
  best.p_map_m = Vec2(mean([](const TableBoulder& b) { return b.p_map_m.x(); }),
                      mean([](const TableBoulder& b) { return b.p_map_m.y(); }));
  best.diameter_m = mean([](const TableBoulder& b) { return b.diameter_m; });
  best.area_m2 = mean([](const TableBoulder& b) { return b.area_m2; });
  best.elongation = mean([](const TableBoulder& b) { return b.elongation; });
  for (const Entry& e : group) {
    if (best.contrast == 0.0) best.contrast = e.boulder.contrast;
    if (best.height_m == 0.0) best.height_m = e.boulder.height_m;
    if (!std::isfinite(best.ground_z_m)) best.ground_z_m = e.boulder.ground_z_m;
  }
  return best;
}

}  // namespace

std::vector<TableBoulder> merge_boulders(const std::vector<MergePart>& parts, double within_m) {
  std::vector<Entry> entries;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const double pixel_m =
        parts[part].pixel_m > 0.0 ? parts[part].pixel_m : std::numeric_limits<double>::infinity();
    for (const TableBoulder& b : parts[part].boulders) entries.push_back({b, pixel_m, part});
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return std::make_tuple(key(a.boulder), a.pixel_m) < std::make_tuple(key(b.boulder), b.pixel_m);
  });

  // Groups that hold each part at most once, joined nearest first.
  std::vector<std::size_t> group_of(entries.size());
  std::vector<std::vector<std::size_t>> groups(entries.size());
  for (std::size_t i = 0; i < entries.size(); ++i) {
    group_of[i] = i;
    groups[i] = {i};
  }
  for (const Candidate& pair : candidates(entries, within_m)) {
    const std::size_t into = std::min(group_of[pair.a], group_of[pair.b]);
    const std::size_t from = std::max(group_of[pair.a], group_of[pair.b]);
    if (into == from) continue;
    const bool clash = std::any_of(groups[from].begin(), groups[from].end(), [&](std::size_t i) {
      return std::any_of(groups[into].begin(), groups[into].end(),
                         [&](std::size_t j) { return entries[i].part == entries[j].part; });
    });
    if (clash) continue;
    for (const std::size_t i : groups[from]) {
      group_of[i] = into;
      groups[into].push_back(i);
    }
    groups[from].clear();
  }

  std::vector<TableBoulder> merged;
  for (const std::vector<std::size_t>& group : groups) {
    if (group.empty()) continue;
    std::vector<Entry> members;
    for (const std::size_t i : group) members.push_back(entries[i]);
    merged.push_back(joined(std::move(members)));
  }
  std::sort(merged.begin(), merged.end(),
            [](const TableBoulder& a, const TableBoulder& b) { return key(a) < key(b); });
  return merged;
}

}  // namespace cairn::ground
