// cairn map: its parts, and what they share
#include <fmt/format.h>

#include <ogr_spatialref.h>

#include <algorithm>
#include <cmath>

#include "base/json_file.hpp"
#include "base/output_file.hpp"
#include "base/tool_error.hpp"
#include "commands/cmd_map.hpp"
#include "commands/commands.hpp"
#include "core/trig.hpp"
#include "ortho/reference_system.hpp"
#include "ortho/site_frame.hpp"

namespace cairn::ground {

void print_json(const Json& object) { fmt::print("{}", to_text(object)); }

Json to_json(const MapExtent& e) {
  return {{"min_x_m", e.min_x_m}, {"min_y_m", e.min_y_m}, {"max_x_m", e.max_x_m}, {"max_y_m", e.max_y_m}};
}

double usual_distance_m(std::initializer_list<double> pixels_m) {
  return std::max(0.1, 2.0 * std::max(pixels_m));
}

CmapContent load_map(const std::filesystem::path& path) {
  return decode_cmap(read_file(path), path.string());
}

void need_same_system(const std::filesystem::path& a_path, const CmapContent& a,
                      const std::filesystem::path& b_path, const CmapContent& b) {
  if (same_reference(a.reference_system, b.reference_system)) return;
  throw ToolError(
      "{}: uses {}, but {} uses {}; build both from orthoimages of one reference system (gdalwarp -t_srs)",
      b_path.string(), b.reference_system, a_path.string(), a.reference_system);
}

std::string scale_words(const CmapContent& map) {
  const MapExtent& e = map.extent;
  return scale_words(map.reference_system, {0.5 * (e.min_x_m + e.max_x_m), 0.5 * (e.min_y_m + e.max_y_m)});
}

void warn_of_scale(const std::filesystem::path& path, const CmapContent& map) {
  const std::string words = scale_words(map);
  if (!words.empty())
    fmt::print(stderr, "cairn: warning: {}: {}; lengths here are the map's\n", path.string(), words);
}

void warn_of_way(const std::filesystem::path& path, const std::vector<Vec2>& p_map_m) {
  double length_m = 0.0;
  for (std::size_t i = 1; i < p_map_m.size(); ++i) length_m += (p_map_m[i] - p_map_m[i - 1]).norm();
  if (length_m >= 1.0) return;
  fmt::print(
      stderr,
      "cairn: warning: {}: a way of {:.3g} m; its coordinates are taken as metres of the map (are they "
      "degrees?)\n",
      path.string(), length_m);
}

std::string apart_words(const std::filesystem::path& a_path, const CmapContent& a,
                        const std::filesystem::path& b_path, const CmapContent& b) {
  const MapExtent& p = a.extent;
  const MapExtent& q = b.extent;
  const double gap_x = std::max({0.0, q.min_x_m - p.max_x_m, p.min_x_m - q.max_x_m});
  const double gap_y = std::max({0.0, q.min_y_m - p.max_y_m, p.min_y_m - q.max_y_m});
  const double gap_m = std::hypot(gap_x, gap_y);
  const double side_m =
      std::max({p.max_x_m - p.min_x_m, p.max_y_m - p.min_y_m, q.max_x_m - q.min_x_m, q.max_y_m - q.min_y_m});
  if (gap_m <= side_m) return {};
  std::string words =
      fmt::format("{} and {} lie {:.0f} m apart and do not overlap", a_path.string(), b_path.string(), gap_m);
  if (is_local_reference(a.reference_system)) return words;
  const OGRSpatialReference system = reference_of(a.reference_system, a_path.string());
  const double around_m = 2.0 * kPi * system.GetSemiMajor();
  const double x_m = std::fabs(0.5 * (p.min_x_m + p.max_x_m - q.min_x_m - q.max_x_m));
  // Cylindrical systems stretch it by no more than the cosine of their true parallel.
  if (gap_y <= side_m && x_m > 0.2 * around_m && x_m < 1.01 * around_m)
    words +=
        ": is one in longitudes from 0 to 360 and the other from -180 to 180? Bring both into one system with "
        "gdalwarp -t_srs";
  return words;
}

void add_map_commands(Command app) {
  Command map = app.add_command("map", "prepare and inspect orbital boulder maps");
  map.require_command();
  add_map_build(map);
  add_map_info(map);
  add_map_verify(map);
  add_map_unpack(map);
  add_map_quicklook(map);
  add_map_diff(map);
  add_map_merge(map);
  add_map_uplink(map);
  add_map_forecast(map);
  add_map_score(map);
}

}  // namespace cairn::ground
