// cairn map verify
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "base/output_file.hpp"
#include "commands/cmd_map.hpp"
#include "core/big_endian.hpp"
#include "replay/status_names.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

struct VerifyOptions {
  fs::path file;
  bool json = false;
};

const char* verdict_of(MapStatus status) {
  switch (status) {
    case MapStatus::kUsable: return "good";
    case MapStatus::kNoBoulders: return "empty";
    case MapStatus::kDamaged: return "damaged";
    default: return "bad";
  }
}

Json verify_json(const VerifyOptions& options, MapStatus status, const CmapContent& map,
                 std::uint32_t announced) {
  Json tiles = Json::array();
  for (const CmapTile& tile : map.tiles) {
    if (tile.good) continue;
    tiles.push_back({{"tile", tile.index},
                     {"column", tile.index % map.columns},
                     {"row", tile.index / map.columns},
                     {"extent", to_json(tile.extent)}});
  }
  const bool readable =
      status == MapStatus::kUsable || status == MapStatus::kDamaged || status == MapStatus::kNoBoulders;
  return {{"file", options.file.string()},
          {"verdict", verdict_of(status)},
          {"status", map_status_name(static_cast<std::uint8_t>(status))},
          {"reason", status == MapStatus::kUsable ? std::string() : explain(status)},
          {"boulders", map.boulders.size()},
          {"boulders_lost", readable ? announced - map.boulders.size() : 0},
          {"tiles", map.tiles.size()},
          {"damaged_tiles", tiles}};
}

void verify(const VerifyOptions& options) {
  const std::vector<std::uint8_t> bytes = read_file(options.file);
  const MapStatus status = validate_cmap(bytes);
  const bool readable =
      status == MapStatus::kUsable || status == MapStatus::kDamaged || status == MapStatus::kNoBoulders;
  const CmapContent map = readable ? decode_cmap(bytes, options.file.string(), true) : CmapContent{};
  const std::uint32_t announced = readable ? be::get_u32(bytes.data() + cmap::kCountAt) : 0;
  if (options.json) {
    print_json(verify_json(options, status, map, announced));
  } else if (status == MapStatus::kDamaged) {
    std::string names;
    std::size_t named = 0;
    for (const CmapTile& tile : map.tiles) {
      if (tile.good) continue;
      if (named == 10) names += ", ...";
      if (named++ < 10) names += fmt::format("{}{}", names.empty() ? "" : ", ", tile.index);
    }
    fmt::print("{}: damaged, {} of {} tiles ({}) and {} of {} boulders are lost; the rest can be used\n",
               options.file.string(), map.damaged_tiles, map.tiles.size(), names,
               announced - map.boulders.size(), announced);
  } else if (status == MapStatus::kUsable) {
    fmt::print("{}: good, {} boulders in {} tiles\n", options.file.string(), map.boulders.size(),
               map.tiles.size());
  } else {
    fmt::print("{}: {}, it {}\n", options.file.string(), verdict_of(status), explain(status));
  }
  if (status != MapStatus::kUsable && status != MapStatus::kNoBoulders) throw Answer{kAnswerIsNo};
}

}  // namespace

void add_map_verify(Command map) {
  const auto checked = std::make_shared<VerifyOptions>();
  Command verify_app = map.add_command("verify",
                                       "check a map with the flight code; exit status 0: good, 2: damaged or "
                                       "unusable");
  verify_app.add_option("MAP", checked->file, "map (.cmap)").required();
  verify_app.add_flag("--json", checked->json, "one JSON object on stdout");
  verify_app.on_run([checked] { verify(*checked); });
}

}  // namespace cairn::ground
