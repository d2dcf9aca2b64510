// cairn map: its parts, and what they share
#include <fmt/format.h>

#include <algorithm>

#include "base/json_file.hpp"
#include "base/output_file.hpp"
#include "base/tool_error.hpp"
#include "commands/cmd_map.hpp"
#include "commands/commands.hpp"
#include "ortho/reference_system.hpp"

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

void add_map_commands(CLI::App& app) {
  CLI::App* map = app.add_subcommand("map", "prepare and inspect orbital boulder maps");
  map->require_subcommand(1);
  add_map_build(*map);
  add_map_info(*map);
  add_map_verify(*map);
  add_map_unpack(*map);
  add_map_quicklook(*map);
  add_map_diff(*map);
  add_map_merge(*map);
  add_map_uplink(*map);
  add_map_forecast(*map);
  add_map_score(*map);
}

}  // namespace cairn::ground
