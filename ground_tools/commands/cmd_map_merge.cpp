// cairn map merge
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/output_file.hpp"
#include "base/tool_error.hpp"
#include "commands/cmd_map.hpp"
#include "map/merge.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

struct MergeOptions {
  std::vector<fs::path> maps;
  fs::path output;
  double within_m = 0.0;
  double quantum_m = 0.0;
  bool json = false;
};

struct Joined {
  std::vector<MergePart> parts;
  MapExtent extent;
  CmapSource source;
  double quantum_m = 0.0;
  double pixel_m = 0.0;  ///< of the coarsest
};

Joined read_parts(const MergeOptions& options) {
  Joined joined;
  std::vector<std::string> hashes;
  std::vector<std::string> systems;
  CmapContent first;
  for (std::size_t i = 0; i < options.maps.size(); ++i) {
    CmapContent map = load_map(options.maps[i]);
    if (i == 0) {
      joined.extent = map.extent;
      joined.quantum_m = map.quantum_m;
      joined.source = {map.method, map.pixel_m, "", "", map.site, map.epoch_s, map.revision};
      first = map;
    }
    need_same_system(options.maps[0], first, options.maps[i], map);
    if (map.heights.present())
      fmt::print(stderr,
                 "cairn: warning: {}: its heights are left out; build {} anew with --like and --dem\n",
                 options.maps[i].string(), options.output.string());
    if (i > 0) {
      // Far from all that was joined so far.
      CmapContent so_far = first;
      so_far.extent = joined.extent;
      const std::string words = apart_words(options.maps[0], so_far, options.maps[i], map);
      if (!words.empty()) fmt::print(stderr, "cairn: warning: {}\n", words);
    }
    MapExtent& e = joined.extent;
    e = {std::min(e.min_x_m, map.extent.min_x_m), std::min(e.min_y_m, map.extent.min_y_m),
         std::max(e.max_x_m, map.extent.max_x_m), std::max(e.max_y_m, map.extent.max_y_m)};
    joined.quantum_m = std::min(joined.quantum_m, map.quantum_m);
    joined.pixel_m = std::max(joined.pixel_m, map.pixel_m);
    CmapSource& s = joined.source;
    if (s.method != map.method) s.method = cmap::Method::kTable;
    if (s.site != map.site) s.site = 0;
    s.pixel_m = std::max(s.pixel_m, map.pixel_m);
    s.epoch_s = std::max(s.epoch_s, map.epoch_s);
    s.revision = std::max(s.revision, map.revision);
    hashes.push_back(fmt::format("{:08x}", map.parameter_hash));
    systems.push_back(map.reference_system);
    joined.parts.push_back({std::move(map.boulders), map.pixel_m});
  }
  std::sort(hashes.begin(), hashes.end());
  joined.source.reference_system = *std::min_element(systems.begin(), systems.end());
  joined.source.parameters = fmt::format("merge of {}", fmt::join(hashes, " "));
  return joined;
}

void merge(const MergeOptions& options) {
  if (options.maps.size() < 2) throw ToolError("map merge: give two maps or more");
  OutputFile output(options.output);
  Joined joined = read_parts(options);
  const double within_m = options.within_m > 0.0 ? options.within_m : usual_distance_m({joined.pixel_m});
  const double quantum_m = options.quantum_m > 0.0 ? options.quantum_m : joined.quantum_m;
  joined.source.parameters += fmt::format(" within_m={}", within_m);
  const std::vector<TableBoulder> boulders = merge_boulders(joined.parts, within_m);
  CmapReport report;
  const std::vector<std::uint8_t> bytes =
      encode_cmap(boulders, joined.extent, quantum_m, joined.source, {}, &report);
  output.write(bytes);
  output.commit();
  std::size_t given = 0;
  for (const MergePart& part : joined.parts) given += part.boulders.size();
  if (options.json) {
    Json parts = Json::array();
    for (std::size_t i = 0; i < options.maps.size(); ++i)
      parts.push_back({{"file", options.maps[i].string()}, {"boulders", joined.parts[i].boulders.size()}});
    print_json({{"output", options.output.string()},
                {"bytes", bytes.size()},
                {"boulders", report.boulders},
                {"joined", given - report.boulders},
                {"within_m", within_m},
                {"position_step_m", quantum_m},
                {"extent", to_json(joined.extent)},
                {"reference_system", joined.source.reference_system},
                {"parts", parts}});
    return;
  }
  fmt::print("{}: {} boulders on {:.1f} x {:.1f} m, {} bytes; {} of {} entries were merged with another\n",
             options.output.string(), report.boulders, joined.extent.max_x_m - joined.extent.min_x_m,
             joined.extent.max_y_m - joined.extent.min_y_m, bytes.size(), given - report.boulders, given);
}

}  // namespace

void add_map_merge(Command map) {
  const auto merged = std::make_shared<MergeOptions>();
  MergeOptions& m = *merged;
  Command merge_app =
      map.add_command("merge", "join maps of one reference system into one; the order does not matter");
  merge_app.add_option("MAPS", m.maps, "maps (.cmap), two or more").required();
  merge_app.add_option("-o,--output", m.output, "the map to write (.cmap)").written().required();
  merge_app
      .add_option("--within", m.within_m,
                  "entries of different maps are one boulder within this distance, m (default: two pixels "
                  "of the coarsest, at least 0.1)")
      .positive();
  merge_app
      .add_option("--quantum", m.quantum_m, "step of the positions, m (default: the finest of the maps')")
      .positive();
  merge_app.add_flag("--json", m.json, "one JSON object on stdout");
  merge_app.on_run([merged] { merge(*merged); });
}

}  // namespace cairn::ground
