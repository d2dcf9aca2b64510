// cairn map uplink: what the next drive needs of a map, as telecommand packets.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "base/json_file.hpp"
#include "base/number_table.hpp"
#include "base/output_file.hpp"
#include "base/tool_error.hpp"
#include "base/waypoints.hpp"
#include "cmap/uplink.hpp"
#include "commands/cmd_map.hpp"
#include "forecast/forecast.hpp"
#include "map/way_file.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

struct UplinkOptions {
  fs::path map;
  fs::path path;
  fs::path base;
  fs::path fixes;
  fs::path output;
  UplinkParams params;
  double drift_percent = 100.0 * UplinkParams().drift;
  std::optional<std::uint32_t> sequence;
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
  if (cut.unchanged)
    fmt::print("nothing has changed: the map in use serves this way; there is no need to send this\n");
}

Vec2 place_at(const PlannedPath& path, double s_m) {
  std::size_t i = 1;
  while (i + 1 < path.s_m.size() && path.s_m[i] < s_m) ++i;
  const double share = (s_m - path.s_m[i - 1]) / (path.s_m[i] - path.s_m[i - 1]);
  return path.p_map_m[i - 1] + std::clamp(share, 0.0, 1.0) * (path.p_map_m[i] - path.p_map_m[i - 1]);
}

/// Ways to the fixes that a forecast counts on.
std::vector<double> fixes_of(const fs::path& forecast, const PlannedPath& path) {
  constexpr double kOffWay_m = 1.0;  // and a share of the way, which the forecast drives in steps
  constexpr double kOffShare = 0.01;
  const CsvTable table(forecast, "give the forecast.csv of cairn map forecast");
  const std::size_t arc = table.column("arc_m");
  const std::size_t blind = table.column("blind");
  const std::optional<std::size_t> x = table.find({"x_m"});
  const std::optional<std::size_t> y = table.find({"y_m"});
  std::vector<double> fixes;
  for (std::size_t row = 0; row < table.size(); ++row) {
    const double s_m = table.number(row, arc);
    const Vec2 there = place_at(path, s_m);
    const double off_m = x && y ? (Vec2(table.number(row, *x), table.number(row, *y)) - there).norm() : 0.0;
    if (off_m > kOffWay_m + kOffShare * s_m)
      throw ToolError(
          "{}: is the forecast of another way: its place at {:.1f} m is {:.1f} m off this one; give the "
          "forecast.csv of the same --path",
          forecast.string(), s_m, off_m);
    if (table.number(row, blind) == 0.0) fixes.push_back(s_m);
  }
  std::sort(fixes.begin(), fixes.end());
  return fixes;
}

/// Lost chunks fit the upload that they were lost from.
void check_same_upload(const fs::path& report, const Cut& cut) {
  if (!fs::exists(report)) return;
  const Json before = read_json(report, "is no report of cairn map uplink; give another folder");
  const std::string id = fmt::format("{:08x}", cut.upload.plan.id);
  const Json upload = before.value("upload", Json::object());
  if (upload.value("id", "") == id && upload.value("chunk_bytes", 0U) == cut.upload.plan.chunk_bytes) return;
  throw ToolError("--only: {} is of another upload than {} in chunks of {}; give all else as it was before",
                  report.string(), id, cut.upload.plan.chunk_bytes);
}

/// Chunks that were lost, beside the whole upload.
void write_lost(const Cut& cut, const UplinkOptions& options) {
  check_same_upload(options.output / "report.json", cut);
  std::uint32_t sequence = options.sequence.value_or(0);
  std::vector<PacketBytes> packets;
  std::size_t bytes = 0;
  std::vector<std::uint32_t> numbers = choose_chunks(send_order(cut.upload, cut.rank_of_tile), options.only);
  for (const std::uint32_t number : numbers) {
    packets.push_back(chunk_packet(cut.upload, number, sequence++));
    bytes += packets.back().size();
  }
  make_folder(options.output);
  const fs::path file = options.output / "lost.tc";
  write_packets(file, packets);
  if (options.json) {
    print_json({{"upload", fmt::format("{:08x}", cut.upload.plan.id)},
                {"written", file.string()},
                {"chunks", numbers},
                {"bytes", bytes},
                {"next_sequence", sequence}});
    return;
  }
  fmt::print("{}: {} of {} chunks of upload {:08x}, {} bytes on the link\n", file.string(), numbers.size(),
             chunks_of(cut.upload.plan), cut.upload.plan.id, bytes);
}

/// Of the folder, which may be that of the map itself.
fs::path map_file(const UplinkOptions& options) {
  fs::path file = options.output / "map.cmap";
  for (const fs::path& input : {options.map, options.base}) {
    if (options.only.empty() && !input.empty() && same_file(file, input))
      throw ToolError("{}: would be overwritten by the corridor's map; choose another folder",
                      input.string());
  }
  return file;
}

void uplink(UplinkOptions options) {
  const fs::path file = map_file(options);
  const CmapContent whole = load_map(options.map);
  const std::vector<Vec2> way = read_way(options.path, whole.reference_system);
  warn_of_way(options.path, way);
  const PlannedPath path = path_of(way);
  std::optional<BaseMap> base;
  if (!options.base.empty()) base = BaseMap{read_file(options.base), options.base.string()};
  warn_of_scale(options.map, whole);
  if (!options.fixes.empty()) options.params.fixes_s_m = fixes_of(options.fixes, path);
  UplinkParams params = options.params;
  params.found = [curve = mission_model(whole.method, whole.pixel_m).detection](const TableBoulder& b) {
    return b.confidence * curve(b.diameter_m);
  };
  const Cut cut = cut_corridor(read_file(options.map), options.map.string(), path, params, base);

  if (!options.only.empty()) {
    write_lost(cut, options);
    return;
  }
  if (base && !options.sequence)
    fmt::print(
        stderr,
        "cairn: warning: --sequence: packets are numbered from 0, and a rover that has taken the base as "
        "an upload answers stale or contradicts; give next_sequence of its report.json\n");
  std::uint32_t sequence = options.sequence.value_or(0);
  std::vector<PacketBytes> packets{begin_packet(cut.upload, sequence++)};
  for (const std::uint32_t number : send_order(cut.upload, cut.rank_of_tile))
    packets.push_back(chunk_packet(cut.upload, number, sequence++));
  const std::uint32_t use = sequence++;
  const std::string report = to_json(cut, options.params, sequence);
  const HoldInterrupts all_or_none;
  make_folder(options.output);
  OutputFile map(file);
  map.write(cut.map);
  write_packets(options.output / "upload.tc", packets);
  write_packets(options.output / "use.tc", {use_packet(cut.upload, use)});
  write_file(options.output / "report.json", report);
  map.commit();
  if (options.json) {
    fmt::print("{}", report);
  } else {
    print(cut, options);
    fmt::print("next upload       --sequence {}\n", sequence);
  }
}

}  // namespace

void add_map_uplink(Command map) {
  const auto options = std::make_shared<UplinkOptions>();
  UplinkOptions& o = *options;
  UplinkParams& p = o.params;
  Command app = map.add_command("uplink",
                                "cut a corridor around a planned path out of a map, and make "
                                "telecommands from it");
  app.add_option("MAP", o.map, "map (.cmap)").required();
  app.add_option(
         "--path", o.path,
         "way of the drive: CSV with columns x, y, metres in the map; or a line or points of a GeoPackage, GeoJSON, "
         "shapefile")
      .required();
  app.add_option("-o,--output", o.output,
                 "folder for upload.tc, use.tc, map.cmap and report.json; created if missing")
      .required();
  app.add_option("--base", o.base, "map in use on board: send only the difference where that is smaller");
  app.add_option("--width", p.half_width_m, "half width of the corridor at the start of the path, m")
      .default_shown();
  app.add_option("--drift", o.drift_percent,
                 "growth of the half width, in per cent of the distance since the last fix")
      .default_shown();
  app.add_option("--fix-every", p.fix_every_m, "distance between expected fixes, m (default: none expected)");
  app.add_option("--fixes", o.fixes, "or the forecast.csv of this way: fixes where it counts on them")
      .excludes("--fix-every");
  app.add_option("--budget", p.budget_bytes,
                 "limit of bytes on the link, packet overhead included; 20k or 1M, too "
                 "(default: no limit)")
      .in_bytes()
      .positive();
  app.add_option("--chunk", p.chunk_bytes, "data per chunk, bytes").default_shown();
  app.add_option(
      "--tile", p.tile_m,
      fmt::format("side of a tile, m (default: about {:.0f} boulders in each; with --base, that of "
                  "the base)",
                  kBouldersPerCutTile));
  app.add_option(
      "--sequence", o.sequence,
      "sequence number of the first packet: next_sequence of the upload before (default 0: the first)");
  app.add_option("--only", o.only,
                 "write only these chunks, e.g. 3,7-9, which were lost, to lost.tc; all else stays as it is");
  app.add_flag("--json", o.json, "print the report as JSON");
  app.on_run([options] {
    options->params.drift = options->drift_percent / 100.0;
    uplink(*options);
  });
}

}  // namespace cairn::ground
