#include "cmap/corridor.hpp"

#include <algorithm>
#include <cmath>

#include "core/trig.hpp"

namespace cairn::ground {
namespace {

constexpr double kPieceOfWay_m = 1.0;  ///< reach is taken as constant on it

/// Way on the segment from `a` to `b` that lies within `radius_m` of `p`: [from, to] as shares, or nothing.
bool within_reach(const Vec2& p, const Vec2& a, const Vec2& b, double radius_m, double& from, double& to) {
  const Vec2 along = b - a;
  const double length = along.norm();
  const double foot = (p - a).dot(along) / length;
  const double off = std::fabs((p.x() - a.x()) * along.y() - (p.y() - a.y()) * along.x()) / length;
  if (off > radius_m) return false;
  const double half_chord = std::sqrt(radius_m * radius_m - off * off);
  from = std::max(0.0, (foot - half_chord) / length);
  to = std::min(1.0, (foot + half_chord) / length);
  return from < to;
}

/// Calls `piece(a, b, s, reach)` for each piece of the way.
template <typename Piece>
void along_path(const PlannedPath& path, const CorridorParams& params, const Piece& piece) {
  for (std::size_t i = 1; i < path.p_map_m.size(); ++i) {
    const double length_m = path.s_m[i] - path.s_m[i - 1];
    const int pieces = std::max(1, static_cast<int>(std::ceil(length_m / kPieceOfWay_m)));
    const Vec2 step = (path.p_map_m[i] - path.p_map_m[i - 1]) / pieces;
    for (int n = 0; n < pieces; ++n) {
      const Vec2 a = path.p_map_m[i - 1] + n * step;
      const double s_m = path.s_m[i - 1] + length_m * n / pieces;
      piece(a, Vec2(a + step), s_m, reach_m(params, s_m + 0.5 * length_m / pieces));
    }
  }
}

}  // namespace

PlannedPath path_of(const std::vector<Vec2>& p_map_m) {
  PlannedPath path;
  for (const Vec2& p : p_map_m) {
    const double step_m = path.p_map_m.empty() ? 0.0 : (p - path.p_map_m.back()).norm();
    if (!path.p_map_m.empty() && step_m == 0.0) continue;
    path.s_m.push_back(path.length_m() + step_m);
    path.p_map_m.push_back(p);
  }
  return path;
}

double reach_m(const CorridorParams& params, double s_m) {
  double since_fix_m = params.fix_every_m > 0.0 ? std::fmod(s_m, params.fix_every_m) : s_m;
  const auto next = std::upper_bound(params.fixes_s_m.begin(), params.fixes_s_m.end(), s_m);
  if (next != params.fixes_s_m.begin()) since_fix_m = s_m - *(next - 1);
  return params.half_width_m + params.drift * since_fix_m;
}

std::vector<CorridorBoulder> boulders_within_reach(const std::vector<TableBoulder>& boulders,
                                                   const PlannedPath& path, const CorridorParams& params) {
  std::vector<CorridorBoulder> by_x;
  by_x.reserve(boulders.size());
  for (const TableBoulder& b : boulders) by_x.push_back({&b, 0.0, 0.0, 0});
  const auto x = [](const CorridorBoulder& r) { return r.boulder->p_map_m.x(); };
  std::stable_sort(by_x.begin(), by_x.end(),
                   [&](const CorridorBoulder& a, const CorridorBoulder& b) { return x(a) < x(b); });
  along_path(path, params, [&](const Vec2& a, const Vec2& b, double s_m, double radius_m) {
    const double low = std::min(a.x(), b.x()) - radius_m;
    const double high = std::max(a.x(), b.x()) + radius_m;
    auto r = std::lower_bound(by_x.begin(), by_x.end(), low,
                              [&](const CorridorBoulder& item, double value) { return x(item) < value; });
    for (; r != by_x.end() && x(*r) <= high; ++r) {
      double from = 0.0;
      double to = 0.0;
      if (!within_reach(r->boulder->p_map_m, a, b, radius_m, from, to)) continue;
      const double length_m = (b - a).norm();
      if (r->way_m == 0.0) r->first_s_m = s_m + from * length_m;
      r->way_m += (to - from) * length_m;
    }
  });
  by_x.erase(
      std::remove_if(by_x.begin(), by_x.end(), [](const CorridorBoulder& r) { return r.way_m == 0.0; }),
      by_x.end());
  return by_x;
}

MapExtent corridor_box(const PlannedPath& path, const CorridorParams& params, const MapExtent& mapped) {
  MapExtent box{mapped.max_x_m, mapped.max_y_m, mapped.min_x_m, mapped.min_y_m};
  along_path(path, params, [&](const Vec2& a, const Vec2& b, double, double radius_m) {
    for (const Vec2& p : {a, b}) {
      box.min_x_m = std::min(box.min_x_m, p.x() - radius_m);
      box.min_y_m = std::min(box.min_y_m, p.y() - radius_m);
      box.max_x_m = std::max(box.max_x_m, p.x() + radius_m);
      box.max_y_m = std::max(box.max_y_m, p.y() + radius_m);
    }
  });
  return {std::max(box.min_x_m, mapped.min_x_m), std::max(box.min_y_m, mapped.min_y_m),
          std::min(box.max_x_m, mapped.max_x_m), std::min(box.max_y_m, mapped.max_y_m)};
}

double corridor_area_m2(const PlannedPath& path, const CorridorParams& params) {
  double area_m2 = kPi * params.half_width_m * params.half_width_m;
  along_path(path, params, [&](const Vec2& a, const Vec2& b, double, double radius_m) {
    area_m2 += 2.0 * radius_m * (b - a).norm();
  });
  return area_m2;
}

}  // namespace cairn::ground
