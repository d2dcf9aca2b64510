// cairn map info
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/output_file.hpp"
#include "base/statistics.hpp"
#include "commands/cmd_map.hpp"
#include "core/big_endian.hpp"
#include "core/trig.hpp"
#include "ortho/site_frame.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

struct InfoOptions {
  fs::path file;
  bool json = false;
};

const char* method_name(cmap::Method method) {
  switch (method) {
    case cmap::Method::kTable: return "table";
    case cmap::Method::kOtsu: return "otsu";
    case cmap::Method::kShadow: return "shadow";
  }
  return "unknown";
}

/// "2009-02-18T09:57:42 TT"; "" where unknown.
std::string epoch_text(std::uint32_t epoch_s) {
  if (epoch_s == 0) return "";
  // 2000-01-01T12:00:00, all days alike.
  const std::time_t seconds = 946728000 + static_cast<std::time_t>(epoch_s);
  std::tm day{};
  ::gmtime_r(&seconds, &day);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02} TT", day.tm_year + 1900, day.tm_mon + 1,
                     day.tm_mday, day.tm_hour, day.tm_min, day.tm_sec);
}

/// Where the bytes of a map go.
struct Parts {
  std::size_t head = 0;  ///< with models and reference system
  std::size_t directory = 0;
  std::size_t positions = 0;   ///< with counts and modes of the tiles
  std::size_t attributes = 0;  ///< streams, with their lengths
  std::size_t crcs = 0;        ///< of the tiles
  std::size_t heights = 0;     ///< with their lengths
};

Parts parts_of(const std::vector<std::uint8_t>& bytes, const CmapContent& map) {
  Parts parts;
  parts.head = be::get_u16(bytes.data() + cmap::kHeadBytesAt);
  parts.directory = map.tiles.size() * bytes[cmap::kOffsetBytesAt];
  for (const CmapTile& tile : map.tiles) {
    if (tile.bytes == 0 || !tile.good) continue;
    const bool has_attributes = bytes[cmap::kFlagsAt] != 0 && tile.count > 0;
    const std::uint8_t* const boulders = bytes.data() + tile.offset + tile.heights_bytes;
    const std::size_t attributes = has_attributes ? 2U + be::get_u16(boulders + cmap::kAttributeBytesAt) : 0U;
    parts.attributes += attributes;
    parts.crcs += cmap::kCrcBytes;
    parts.heights += tile.heights_bytes;
    parts.positions += tile.bytes - cmap::kCrcBytes - attributes - tile.heights_bytes;
  }
  return parts;
}

/// log2 of the number of ways to place `count` boulders in the map's cells: what positions take at least
/// where nothing is known of them.
double position_limit_bits(const CmapContent& map) {
  const double cells = static_cast<double>(map.layout.extent_x) * static_cast<double>(map.layout.extent_y);
  const auto count = static_cast<double>(map.boulders.size());
  // Stirling's series loses nothing that matters; differences of lgamma lose digits where cells are many.
  const double rest = cells - count;
  if (!(count > 0.0) || !(rest > 0.0)) return 0.0;
  const double nats = count * std::log(cells / count) - rest * std::log1p(-count / cells) -
                      0.5 * std::log(2.0 * kPi * count * rest / cells);
  return std::max(0.0, nats / std::log(2.0));
}

struct Spread {
  std::size_t known = 0;
  double least = 0.0;
  double median = 0.0;
  double largest = 0.0;
};

template <typename Value>
Spread spread_of(const std::vector<TableBoulder>& boulders, const Value& value, bool zero_is_unknown) {
  std::vector<double> values;
  for (const TableBoulder& b : boulders) {
    if (!zero_is_unknown || value(b) != 0.0) values.push_back(value(b));
  }
  if (values.empty()) return {};
  const auto [least, largest] = std::minmax_element(values.begin(), values.end());
  return {values.size(), *least, median(values), *largest};
}

Json to_json(const Spread& s) {
  if (s.known == 0) return {{"known", 0}, {"least", nullptr}, {"median", nullptr}, {"largest", nullptr}};
  return {{"known", s.known}, {"least", s.least}, {"median", s.median}, {"largest", s.largest}};
}

constexpr double kEdges[] = {0.0, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, INFINITY};
constexpr std::size_t kBins = std::size(kEdges) - 1;

std::vector<std::size_t> histogram(const std::vector<TableBoulder>& boulders) {
  std::vector<std::size_t> bins(kBins, 0);
  for (const TableBoulder& b : boulders) {
    const auto* const above = std::upper_bound(std::begin(kEdges), std::end(kEdges), b.diameter_m);
    ++bins[std::min(kBins, static_cast<std::size_t>(above - std::begin(kEdges))) - 1];
  }
  return bins;
}

double area_m2(const MapExtent& e) { return (e.max_x_m - e.min_x_m) * (e.max_y_m - e.min_y_m); }

struct Facts {
  std::size_t bytes = 0;
  Parts parts;
  Spread diameter;
  Spread height;
  Spread confidence;
  std::vector<std::size_t> sizes;
  std::size_t full_tiles = 0;
  double per_boulder = 0.0;  ///< 8 / boulders
};

Facts facts_of(const std::vector<std::uint8_t>& bytes, const CmapContent& map) {
  Facts f;
  f.bytes = bytes.size();
  f.parts = parts_of(bytes, map);
  f.diameter = spread_of(
      map.boulders, [](const TableBoulder& b) { return b.diameter_m; }, true);
  f.height = spread_of(
      map.boulders, [](const TableBoulder& b) { return b.height_m; }, true);
  f.confidence = spread_of(
      map.boulders, [](const TableBoulder& b) { return b.confidence; }, false);
  f.sizes = histogram(map.boulders);
  f.full_tiles = static_cast<std::size_t>(std::count_if(
      map.tiles.begin(), map.tiles.end(), [](const CmapTile& t) { return t.count != 0 || !t.good; }));
  f.per_boulder = map.boulders.empty() ? 0.0 : 8.0 / static_cast<double>(map.boulders.size());
  return f;
}

/// Along x and y at the middle; null where no body is known.
Json ground_scale(const CmapContent& map) {
  const MapExtent& e = map.extent;
  const auto frame =
      site_frame(map.reference_system, {0.5 * (e.min_x_m + e.max_x_m), 0.5 * (e.min_y_m + e.max_y_m)});
  if (!frame) return nullptr;
  return {frame->ground_per_map().x(), frame->ground_per_map().y()};
}

int version_of(const CmapContent& map) {
  return map.heights.present() ? cmap::kHeightsVersion : cmap::kVersion;
}

/// Null where the map has none.
Json heights_json(const CmapContent& map, const Facts& f) {
  const HeightGrid& grid = map.heights;
  if (!grid.present()) return nullptr;
  return {{"step_m", grid.spacing * map.quantum_m},
          {"height_step_m", grid.quantum_m()},
          {"known", grid.known()},
          {"of", grid.posts.size()},
          {"sigma_m", grid.sigma_m},
          {"common_sigma_m", grid.common_m},
          {"bits_per_height", 8.0 * static_cast<double>(f.parts.heights) /
                                  static_cast<double>(std::max<std::size_t>(grid.known(), 1))}};
}

Json info_json(const fs::path& path, const CmapContent& map, const Facts& f) {
  const double area = area_m2(map.extent);
  Json sizes = Json::array();
  for (std::size_t i = 0; i < kBins; ++i) {
    Json bin = {{"from_m", kEdges[i]}, {"to_m", nullptr}, {"boulders", f.sizes[i]}};
    if (std::isfinite(kEdges[i + 1])) bin["to_m"] = kEdges[i + 1];
    sizes.push_back(bin);
  }
  const std::string epoch = epoch_text(map.epoch_s);
  return {{"file", path.string()},
          {"bytes", f.bytes},
          {"version", version_of(map)},
          {"boulders", map.boulders.size()},
          {"extent", to_json(map.extent)},
          {"area_m2", area},
          {"density_per_m2", area > 0.0 ? static_cast<double>(map.boulders.size()) / area : 0.0},
          {"reference_system", map.reference_system},
          {"ground_m_per_map_m", ground_scale(map)},
          {"position_step_m", map.quantum_m},
          {"tiles",
           {{"columns", map.columns},
            {"rows", map.rows},
            {"side_m", map.tile_m},
            {"with_boulders", f.full_tiles},
            {"damaged", map.damaged_tiles}}},
          {"diameter_m", to_json(f.diameter)},
          {"diameter_histogram", sizes},
          {"height_m", to_json(f.height)},
          {"confidence", to_json(f.confidence)},
          {"bytes_by_part",
           {{"head", f.parts.head},
            {"directory", f.parts.directory},
            {"positions", f.parts.positions},
            {"attributes", f.parts.attributes},
            {"heights", f.parts.heights},
            {"tile_crcs", f.parts.crcs}}},
          {"heights", heights_json(map, f)},
          {"bits_per_boulder",
           {{"whole", static_cast<double>(f.bytes) * f.per_boulder},
            {"positions", static_cast<double>(f.parts.positions) * f.per_boulder},
            {"attributes", static_cast<double>(f.parts.attributes) * f.per_boulder},
            {"position_limit", position_limit_bits(map) * f.per_boulder / 8.0}}},
          {"method", method_name(map.method)},
          {"pixel_m", map.pixel_m},
          {"parameter_hash", fmt::format("{:08x}", map.parameter_hash)},
          {"site", map.site},
          {"revision", map.revision},
          {"epoch", epoch.empty() ? Json(nullptr) : Json(epoch)},
          {"epoch_s", map.epoch_s},
          {"crc", fmt::format("{:08x}", map.head_crc)}};
}

void print_spread(const char* name, const Spread& s, const char* unit) {
  if (s.known != 0)
    fmt::print("{:<17} {:.3f} to {:.3f}{}, median {:.3f}{} ({} known)\n", name, s.least, s.largest, unit,
               s.median, unit, s.known);
}

void print_text(const fs::path& path, const CmapContent& map, const Facts& f) {
  const double area = area_m2(map.extent);
  const auto bits = [&](double bytes) { return bytes * f.per_boulder; };
  fmt::print("file              {} ({} bytes, version {}, CRC {:08x})\n", path.string(), f.bytes,
             version_of(map), map.head_crc);
  fmt::print("boulders          {} ({:.4g} per m2)\n", map.boulders.size(),
             area > 0.0 ? static_cast<double>(map.boulders.size()) / area : 0.0);
  print_spread("diameter", f.diameter, " m");
  for (std::size_t i = 0; i < kBins; ++i) {
    if (f.sizes[i] == 0) continue;
    fmt::print("  {:>5} to {:<5} m  {}\n", kEdges[i],
               std::isfinite(kEdges[i + 1]) ? fmt::format("{}", kEdges[i + 1]) : "", f.sizes[i]);
  }
  print_spread("height", f.height, " m");
  print_spread("confidence", f.confidence, "");
  fmt::print("east              {:.3f} to {:.3f} m\n", map.extent.min_x_m, map.extent.max_x_m);
  fmt::print("north             {:.3f} to {:.3f} m\n", map.extent.min_y_m, map.extent.max_y_m);
  fmt::print("reference system  {}\n", map.reference_system);
  if (const std::string scale = scale_words(map); !scale.empty()) fmt::print("scale             {}\n", scale);
  fmt::print("position step     {} m\n", map.quantum_m);
  fmt::print("tiles             {} x {} of {:.3f} m, {} with boulders\n", map.columns, map.rows, map.tile_m,
             f.full_tiles);
  fmt::print("bytes             head {}, directory {}, positions {}, attributes {}, CRCs of tiles {}\n",
             f.parts.head, f.parts.directory, f.parts.positions, f.parts.attributes, f.parts.crcs);
  fmt::print(
      "bits per boulder  {:.2f}: positions {:.2f} (limit of uniform ground {:.2f}), attributes {:.2f}\n",
      bits(static_cast<double>(f.bytes)), bits(static_cast<double>(f.parts.positions)),
      bits(position_limit_bits(map) / 8.0), bits(static_cast<double>(f.parts.attributes)));
  if (const HeightGrid& grid = map.heights; grid.present()) {
    fmt::print("ground heights    each {:g} m, {} of {} known; {} bytes, {:.2f} bits each\n",
               grid.spacing * map.quantum_m, grid.known(), grid.posts.size(), f.parts.heights,
               8.0 * static_cast<double>(f.parts.heights) /
                   static_cast<double>(std::max<std::size_t>(grid.known(), 1)));
    fmt::print("  of the ground   {:.1f} mm (1 sigma), and {:.3g} m in common; steps of {:g} mm\n",
               1000.0 * grid.sigma_m, grid.common_m, 0.001 * grid.quantum_um);
  }
  if (map.method == cmap::Method::kTable) {
    fmt::print("made from         a table, parameters {:08x}\n", map.parameter_hash);
  } else {
    fmt::print("made by           {} on pixels of {:.4g} m, parameters {:08x}\n", method_name(map.method),
               map.pixel_m, map.parameter_hash);
  }
  const std::string epoch = epoch_text(map.epoch_s);
  fmt::print("site              {}, revision {}, image of {}\n", map.site, map.revision,
             epoch.empty() ? "unknown date" : epoch);
  if (map.damaged_tiles != 0)
    fmt::print("damaged           {} tiles, not included above; see cairn map verify\n", map.damaged_tiles);
}

void info(const InfoOptions& options) {
  const std::vector<std::uint8_t> bytes = read_file(options.file);
  const CmapContent map = decode_cmap(bytes, options.file.string(), true);
  const Facts facts = facts_of(bytes, map);
  if (options.json)
    print_json(info_json(options.file, map, facts));
  else
    print_text(options.file, map, facts);
}

}  // namespace

void add_map_info(Command map) {
  const auto asked = std::make_shared<InfoOptions>();
  Command info_app = map.add_command("info",
                                     "show what a map contains, and what its bytes are used "
                                     "for");
  info_app.add_option("MAP", asked->file, "map (.cmap)").required();
  info_app.add_flag("--json", asked->json, "one JSON object on stdout");
  info_app.on_run([asked] { info(*asked); });
}

}  // namespace cairn::ground
