#include "base/waypoints.hpp"

#include <algorithm>
#include <cmath>

#include "base/number_table.hpp"
#include "base/tool_error.hpp"

namespace cairn::ground {
namespace {

constexpr double kApart_m = 1e-3;

}  // namespace

bool in_degrees(const std::vector<Vec2>& points) {
  return std::all_of(points.begin(), points.end(),
                     [](const Vec2& p) { return std::fabs(p.x()) <= 360.0 && std::fabs(p.y()) <= 90.0; });
}

std::vector<Vec2> read_waypoints(const std::filesystem::path& path) {
  const CsvTable table(path);
  const std::size_t x = table.column({"x_m", "x"});
  const std::size_t y = table.column({"y_m", "y"});
  std::vector<Vec2> points;
  for (std::size_t row = 0; row < table.size(); ++row)
    points.emplace_back(table.number(row, x), table.number(row, y));
  check_way(points, path.string());
  return points;
}

void check_way(const std::vector<Vec2>& points, const std::string& name) {
  if (points.size() < 2)
    throw ToolError("{}: has {} way-point{}; a drive needs two or more", name, points.size(),
                    points.size() == 1 ? "" : "s");
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double apart = (points[i] - points[i - 1]).norm();
    if (apart >= kApart_m) continue;
    if (apart > 0.0 && in_degrees(points))
      throw ToolError("{}: way-points {} and {} are {:.2g} m apart; are they degrees? Give metres of the map",
                      name, i, i + 1, apart);
    throw ToolError("{}: way-points {} and {} are the same; remove one", name, i, i + 1);
  }
}

void check_waypoints(const std::vector<Vec2>& p_map_m, const MapExtent& extent, const std::string& map_name) {
  for (std::size_t i = 0; i < p_map_m.size(); ++i) {
    const Vec2& p = p_map_m[i];
    if (extent.contains(p)) continue;
    throw ToolError(
        "way-point {} at ({:.3f}, {:.3f}) lies outside {}, which reaches from ({:.3f}, {:.3f}) to ({:.3f}, "
        "{:.3f}){}; move it, or give a map of this drive",
        i + 1, p.x(), p.y(), map_name, extent.min_x_m, extent.min_y_m, extent.max_x_m, extent.max_y_m,
        in_degrees(p_map_m) ? " (are these degrees? They are taken as metres)" : "");
  }
}

double distance_m(const Vec2& p, const Vec2& from, const Vec2& to) {
  const Vec2 leg = to - from;
  const double squared = leg.squaredNorm();
  const double share = squared > 0.0 ? std::clamp((p - from).dot(leg) / squared, 0.0, 1.0) : 0.0;
  return (p - from - share * leg).norm();
}

}  // namespace cairn::ground
