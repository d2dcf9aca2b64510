#include "forecast/route.hpp"

#include "base/number_table.hpp"
#include "base/tool_error.hpp"

namespace cairn::ground {
namespace {

std::size_t column(const CsvTable& table, const std::string& name) {
  try {
    return table.column(name + "_m");
  } catch (const ToolError&) {
    return table.column(name);
  }
}

}  // namespace

std::vector<Vec2> read_waypoints(const std::filesystem::path& path, const MapExtent& extent,
                                 const std::string& map_name) {
  const CsvTable table(path);
  const std::size_t x = column(table, "x");
  const std::size_t y = column(table, "y");
  std::vector<Vec2> points;
  for (const NumberRow& row : table.rows()) {
    const Vec2 p(row.values[x], row.values[y]);
    if (!extent.contains(p)) {
      throw ToolError(
          "{}:{}: ({}, {}) lies outside {} (x {:.2f} to {:.2f}, y {:.2f} to {:.2f}); move it, or give the "
          "map of "
          "this drive",
          path.string(), row.line, p.x(), p.y(), map_name, extent.min_x_m, extent.max_x_m, extent.min_y_m,
          extent.max_y_m);
    }
    if (!points.empty() && (p - points.back()).norm() < 1.0e-3)
      throw ToolError("{}:{}: the same point as before; drop it", path.string(), row.line);
    points.push_back(p);
  }
  if (points.size() < 2)
    throw ToolError("{}: holds {} way-point{}; a drive wants two or more", path.string(), points.size(),
                    points.size() == 1 ? "" : "s");
  return points;
}

}  // namespace cairn::ground
