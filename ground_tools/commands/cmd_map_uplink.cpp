// cairn map uplink: what the next drive needs of a map, as telecommand packets.
#include <fmt/format.h>

#include <memory>
#include <optional>

#include "base/output_file.hpp"
#include "base/tool_error.hpp"
#include "base/waypoints.hpp"
#include "cmap/uplink.hpp"
#include "commands/cmd_map.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

struct UplinkOptions {
  fs::path map;
  fs::path path;
  fs::path base;
  fs::path output;
  UplinkParams params;
  double drift_percent = 100.0 * UplinkParams().drift;
  std::uint32_t sequence = 0;
  std::string only;
  bool json = false;
};

void write_packets(const fs::path& path, const std::vector<PacketBytes>& packets) {
  OutputFile file(path);
  for (const PacketBytes& packet : packets) file.write(packet);
  file.commit();
}

void print(const Cut& cut, const UplinkOptions& options) {
  const UplinkParams& p = options.params;
  std::size_t kept = 0;
  for (const RankedTile& tile : cut.tiles) kept += tile.kept ? 1U : 0U;
  fmt::print("path              {:.1f} m, half width {:.1f} m at its start, {:.1f} m at its end\n",
             cut.length_m, reach_m(p, 0.0), reach_m(p, cut.length_m));
  fmt::print("boulders          {} of {} within reach, of {} in the map\n", cut.boulders,
             cut.corridor_boulders, cut.map_boulders);
  fmt::print("tiles             {} of {} with boulders, {:.2f} m a side\n", kept, cut.tiles.size(),
             cut.layout.tile_side * cut.layout.quantum_um / 1e6);
  fmt::print("map               {} bytes, of {} in the map\n", cut.whole_bytes, cut.map_bytes);
  if (cut.delta_bytes > 0) {
    fmt::print("delta             {} bytes, {} tiles kept from the base{}\n", cut.delta_bytes,
               cut.tiles_of_base, cut.is_delta ? "" : "; not smaller, so the whole map is sent");
  }
  fmt::print("upload            {:08x}, {}: {} chunks, {} bytes on the link\n", cut.upload.plan.id,
             cut.is_delta ? "delta" : "map", chunks_of(cut.upload.plan), link_bytes(cut.upload.plan));
}

void uplink(const UplinkOptions& options) {
  const PlannedPath path = path_of(read_waypoints(options.path));
  std::optional<BaseMap> base;
  if (!options.base.empty()) base = BaseMap{read_file(options.base), options.base.string()};
  warn_of_scale(options.map, load_map(options.map));
  const Cut cut = cut_corridor(read_file(options.map), options.map.string(), path, options.params, base);

  std::uint32_t sequence = options.sequence;
  std::vector<PacketBytes> packets;
  if (options.only.empty()) packets.push_back(begin_packet(cut.upload, sequence++));
  for (const std::uint32_t number : choose_chunks(send_order(cut.upload, cut.rank_of_tile), options.only))
    packets.push_back(chunk_packet(cut.upload, number, sequence++));
  const std::string report = to_json(cut, options.params);
  make_folder(options.output);
  OutputFile map(options.output / "map.cmap");
  map.write(cut.map);
  write_packets(options.output / "upload.tc", packets);
  write_packets(options.output / "use.tc", {use_packet(cut.upload, sequence)});
  write_file(options.output / "report.json", report);
  map.commit();
  if (options.json) {
    fmt::print("{}", report);
  } else {
    print(cut, options);
  }
}

}  // namespace

void add_map_uplink(CLI::App& map) {
  const auto options = std::make_shared<UplinkOptions>();
  UplinkOptions& o = *options;
  UplinkParams& p = o.params;
  CLI::App* app = map.add_subcommand("uplink",
                                     "cut a corridor around a planned path out of a map, and make "
                                     "telecommands from it");
  app->add_option("MAP", o.map, "map (.cmap)")->required();
  app->add_option("--path", o.path, "way-points: CSV table with columns x, y in the map's frame, m")
      ->required();
  app->add_option("-o,--output", o.output,
                  "folder for upload.tc, use.tc, map.cmap and report.json; created if missing")
      ->required();
  app->add_option("--base", o.base, "map in use on board: send only the difference where that is smaller");
  app->add_option("--width", p.half_width_m, "half width of the corridor at the start of the path, m")
      ->capture_default_str();
  app->add_option("--drift", o.drift_percent,
                  "growth of the half width, in per cent of the distance since the last fix")
      ->capture_default_str();
  app->add_option("--fix-every", p.fix_every_m,
                  "distance between expected fixes, m (default: none expected)");
  app->add_option("--budget", p.budget_bytes,
                  "limit of bytes on the link, packet overhead included "
                  "(default: no limit)")
      ->check(CLI::PositiveNumber);
  app->add_option("--chunk", p.chunk_bytes, "data per chunk, bytes")->capture_default_str();
  app->add_option(
      "--tile", p.tile_m,
      fmt::format("side of a tile, m (default: about {:.0f} boulders in each; with --base, that of "
                  "the base)",
                  kBouldersPerCutTile));
  app->add_option("--sequence", o.sequence, "sequence number of the first packet")->capture_default_str();
  app->add_option("--only", o.only,
                  "write only these chunks, e.g. 3,7-9, which were lost (default: all, with the begin "
                  "command)");
  app->add_flag("--json", o.json, "print the report as JSON");
  app->callback([options] {
    options->params.drift = options->drift_percent / 100.0;
    uplink(*options);
  });
}

}  // namespace cairn::ground
