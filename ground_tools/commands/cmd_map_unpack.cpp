// cairn map unpack
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "base/output_file.hpp"
#include "base/tool_error.hpp"
#include "commands/cmd_map.hpp"
#include "map/geopackage.hpp"
#include "ortho/heights.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

struct UnpackOptions {
  fs::path map;
  fs::path csv;
  fs::path gpkg;
  fs::path dem;
  bool salvage = false;
  bool json = false;
};

void unpack(const UnpackOptions& options) {
  if (options.csv.empty() && options.gpkg.empty())
    throw ToolError("map unpack: give --csv TABLE, --gpkg FILE or both");
  CmapContent map = decode_cmap(read_file(options.map), options.map.string(), options.salvage);
  std::size_t heights = 0;
  if (!options.dem.empty()) heights = sample_heights(options.dem, map.boulders, map.reference_system);
  if (!options.csv.empty()) write_csv(options.csv, map.boulders, map.reference_system);
  if (!options.gpkg.empty()) write_geopackage(options.gpkg, map.boulders, map.reference_system);
  if (options.json) {
    print_json({{"file", options.map.string()},
                {"boulders", map.boulders.size()},
                {"damaged_tiles", map.damaged_tiles},
                {"ground_heights", heights},
                {"reference_system", map.reference_system},
                {"csv", options.csv.empty() ? Json(nullptr) : Json(options.csv.string())},
                {"gpkg", options.gpkg.empty() ? Json(nullptr) : Json(options.gpkg.string())}});
    return;
  }
  fmt::print("{}: {} boulders", options.map.string(), map.boulders.size());
  if (map.damaged_tiles != 0) fmt::print(", those of {} damaged tiles are lost", map.damaged_tiles);
  if (!options.dem.empty()) fmt::print(", ground height known for {}", heights);
  fmt::print("\n");
}

}  // namespace

void add_map_unpack(Command map) {
  const auto unpacked = std::make_shared<UnpackOptions>();
  UnpackOptions& u = *unpacked;
  Command unpack_app = map.add_command("unpack", "write a map's boulders as CSV, GeoPackage or both");
  unpack_app.add_option("MAP", u.map, "map (.cmap)").required();
  unpack_app.add_option("--csv", u.csv, "table to write (.csv), with .csvt and .prj beside it").written();
  unpack_app.add_option("--gpkg", u.gpkg, "GeoPackage to write (.gpkg)").written();
  unpack_app.add_option("--dem", u.dem, "elevation model: height of the ground under each boulder");
  unpack_app.add_flag("--salvage", u.salvage, "read the intact tiles of a damaged map");
  unpack_app.add_flag("--json", u.json, "one JSON object on stdout");
  unpack_app.on_run([unpacked] { unpack(*unpacked); });
}

}  // namespace cairn::ground
