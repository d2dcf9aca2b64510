#include "cmap/cmap_file.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "base/tool_error.hpp"
#include "core/assert.hpp"
#include "core/big_endian.hpp"
#include "core/crc32.hpp"
#include "core/trig.hpp"

namespace cairn::ground {
namespace {

constexpr double kMillimetresPerMetre = 1e3;
constexpr double kLargest_mm = 65535.0;
constexpr double kMostTilesWanted = 60000.0;
using Payloads = std::vector<std::vector<std::uint8_t>>;

/// A boulder in its cell, counted from the origin.
struct Quantised {
  std::uint32_t x = 0;
  std::uint32_t y = 0;
  double value[cmap::kAttributes] = {};  ///< mm, mm, 0 to 1

  auto cell() const { return std::tie(y, x); }
  auto rank() const { return std::tie(value[0], value[1], value[2]); }
};

void check_extent(const MapExtent& extent, double quantum_m) {
  check_range("--quantum", quantum_m, cmap::kMinQuantum / kMicrometresPerMetre,
              cmap::kMaxQuantum / kMicrometresPerMetre);
  for (const double c : {extent.min_x_m, extent.min_y_m, extent.max_x_m, extent.max_y_m}) {
    if (!(std::fabs(c) <= cmap::kMaxCoordinate)) {
      throw ToolError(
          "coordinate {} m is beyond {:g} m; shift the map's reference system nearer to its origin", c,
          cmap::kMaxCoordinate);
    }
  }
}

/// Cells from the one around the lowest coordinate to the one around the highest.
std::uint32_t cells_along(double extent_m, double quantum_m) {
  const double cells = std::ceil(extent_m / quantum_m - 1e-6) + 1.0;
  if (cells > cmap::kMaxExtent) {
    throw ToolError("--quantum: {} m is too small for a map {} m wide; choose a larger one", quantum_m,
                    extent_m);
  }
  return static_cast<std::uint32_t>(std::max(cells, 1.0));
}

std::vector<Quantised> quantise(const std::vector<TableBoulder>& boulders, const CmapLayout& layout,
                                const MapExtent& extent, std::size_t& merged) {
  const double quantum_m = layout.quantum_um / kMicrometresPerMetre;
  std::vector<Quantised> all;
  all.reserve(boulders.size());
  for (const TableBoulder& b : boulders) {
    const double diameter_mm = b.diameter_m * kMillimetresPerMetre;
    const double height_mm = b.height_m > 0.0 ? b.height_m * kMillimetresPerMetre : 0.0;
    if (!extent.contains(b.p_map_m) || !(diameter_mm <= kLargest_mm) || !(height_mm <= kLargest_mm)) {
      throw ToolError(
          "boulder at ({:.3f}, {:.3f}) of {:.3f} m: outside the map or larger than 65.5 m; correct the "
          "table",
          b.p_map_m.x(), b.p_map_m.y(), std::max(b.diameter_m, b.height_m));
    }
    const auto cell = [&](double from_m, std::uint32_t cells) {
      return std::min(static_cast<std::uint32_t>(std::llround(from_m / quantum_m)), cells - 1U);
    };
    all.push_back({cell(b.p_map_m.x() - layout.origin_x_m, layout.extent_x),
                   cell(b.p_map_m.y() - layout.origin_y_m, layout.extent_y),
                   {std::max(1.0, diameter_mm), height_mm, b.confidence}});
  }
  std::sort(all.begin(), all.end(), [](const Quantised& a, const Quantised& b) {
    return a.cell() != b.cell() ? a.cell() < b.cell() : b.rank() < a.rank();
  });
  const auto end = std::unique(all.begin(), all.end(),
                               [](const Quantised& a, const Quantised& b) { return a.cell() == b.cell(); });
  merged = static_cast<std::size_t>(all.end() - end);
  all.erase(end, all.end());
  return all;
}

/// The side of tiles of whole steps of the heights' spacing.
std::uint32_t whole_steps(std::uint32_t side, const HeightGrid* heights) {
  if (heights == nullptr) return side;
  const std::uint32_t steps = std::clamp((side - 1U) / heights->spacing + 1U, 1U, cmap::kMaxTileSteps);
  return std::max(1U, std::min(steps, cmap::kMaxTileSide / heights->spacing)) * heights->spacing;
}

/// The fullest tile's boulders, for tiles of this side.
std::size_t fullest(const std::vector<Quantised>& coded, const CmapLayout& layout) {
  std::vector<std::size_t> held(static_cast<std::size_t>(layout.columns()) * layout.rows());
  for (const Quantised& b : coded) ++held[b.y / layout.tile_side * layout.columns() + b.x / layout.tile_side];
  return held.empty() ? 0 : *std::max_element(held.begin(), held.end());
}

/// Square tiles that hold so many boulders on average, and nowhere too many.
void choose_tiles(CmapLayout& layout, const std::vector<Quantised>& coded, double boulders_per_tile,
                  const HeightGrid* heights) {
  const double tiles =
      std::clamp(static_cast<double>(coded.size()) / std::max(boulders_per_tile, 1.0), 1.0, kMostTilesWanted);
  const double width = layout.extent_x;
  const double height = layout.extent_y;
  const double ideal = std::sqrt(width * height / tiles);
  const double side = std::max(std::ceil(width / std::max(1.0, std::round(width / ideal))),
                               std::ceil(height / std::max(1.0, std::round(height / ideal))));
  layout.tile_side =
      whole_steps(static_cast<std::uint32_t>(std::min<double>(side, cmap::kMaxTileSide)), heights);
  for (;;) {
    if (static_cast<double>(layout.columns()) * layout.rows() > cmap::kMaxTiles) {
      throw ToolError(
          "{} boulders on {:.0f} x {:.0f} cells take more than {} tiles; cut the region smaller, or "
          "choose a larger --quantum",
          coded.size(), width, height, cmap::kMaxTiles);
    }
    if (fullest(coded, layout) <= cmap::kMaxTileBoulders) return;
    const std::uint32_t smaller = whole_steps((layout.tile_side + 1U) / 2U, heights);
    if (smaller == layout.tile_side)
      throw ToolError("{} boulders are too many between posts of the heights; choose a smaller --height-step",
                      fullest(coded, layout));
    layout.tile_side = smaller;
  }
}

/// A payload of version 3: the heights, then the boulders as they were, sealed anew.
std::vector<std::uint8_t> with_heights(std::uint32_t tile, const std::vector<std::uint8_t>& boulders,
                                       const std::vector<std::uint8_t>& heights) {
  if (boulders.empty() && heights.empty()) return {};
  std::vector<std::uint8_t> out = {static_cast<std::uint8_t>(heights.size() >> 8U),
                                   static_cast<std::uint8_t>(heights.size())};
  out.insert(out.end(), heights.begin(), heights.end());
  if (!boulders.empty()) out.insert(out.end(), boulders.begin(), boulders.end() - cmap::kCrcBytes);
  const std::uint32_t crc = crc32(out.data(), out.size(), cmap::tile_crc_start(tile));
  out.resize(out.size() + cmap::kCrcBytes);
  be::put_u32(out.data() + out.size() - cmap::kCrcBytes, crc);
  if (out.size() > cmap::kMaxTileBytes)
    throw ToolError("a tile would take {} bytes, more than {}; choose a larger --height-step", out.size(),
                    cmap::kMaxTileBytes);
  return out;
}

Payloads encode_tiles(const CmapLayout& layout, const std::vector<Quantised>& coded,
                      const CmapOptions& options) {
  std::array<std::vector<std::uint8_t>, cmap::kAttributes> classes;
  for (unsigned a = 0; a < cmap::kAttributes; ++a) {
    if (!layout.tables[a].present()) continue;
    std::vector<double> values;
    for (const Quantised& b : coded) values.push_back(b.value[a]);
    classes[a] = layout.tables[a].classes_of(values);
  }
  const std::uint32_t side = layout.tile_side;
  const std::uint32_t columns = layout.columns();
  std::vector<std::vector<cmap::TileBoulder>> tiles(static_cast<std::size_t>(columns) * layout.rows());
  for (std::size_t i = 0; i < coded.size(); ++i) {
    const Quantised& b = coded[i];
    cmap::TileBoulder boulder;
    boulder.x = b.x % side;
    boulder.y = b.y % side;
    for (unsigned a = 0; a < cmap::kAttributes; ++a)
      boulder.attribute[a] = classes[a].empty() ? 0 : classes[a][i];
    tiles[b.y / side * columns + b.x / side].push_back(boulder);
  }
  Payloads payloads;
  payloads.reserve(tiles.size());
  for (std::uint32_t t = 0; t < tiles.size(); ++t) {
    const cmap::TileShape shape{std::min(side, layout.extent_x - t % columns * side),
                                std::min(side, layout.extent_y - t / columns * side)};
    if (tiles[t].size() > cmap::kMaxTileBoulders) {
      throw ToolError("a tile would hold {} boulders, more than {}; build without the base map",
                      tiles[t].size(), cmap::kMaxTileBoulders);
    }
    payloads.push_back(encode_tile(t, shape, layout.tables, tiles[t]));
    if (options.heights == nullptr) continue;
    const bool wanted = options.tiles_with_heights == nullptr || (*options.tiles_with_heights)[t];
    std::vector<std::uint8_t> heights;
    if (wanted) heights = encode_heights(*options.heights, t % columns * side, t / columns * side, shape);
    payloads.back() = with_heights(t, payloads.back(), heights);
  }
  return payloads;
}

std::vector<std::uint8_t> head_of(const CmapLayout& layout, const CmapSource& source,
                                  const HeightGrid* heights) {
  std::vector<std::uint8_t> head(cmap::kReferenceAt);
  std::uint8_t* h = head.data();
  be::put_u32(h + cmap::kMagicAt, cmap::kMagic);
  h[cmap::kVersionAt] = heights != nullptr ? cmap::kHeightsVersion : cmap::kVersion;
  for (unsigned a = 0; a < cmap::kAttributes; ++a) {
    if (layout.tables[a].present())
      h[cmap::kFlagsAt] = static_cast<std::uint8_t>(h[cmap::kFlagsAt] | 1U << a);
  }
  h[cmap::kMethodAt] = static_cast<std::uint8_t>(source.method);
  be::put_u16(h + cmap::kRevisionAt, source.revision);
  be::put_f64(h + cmap::kOriginXAt, layout.origin_x_m);
  be::put_f64(h + cmap::kOriginYAt, layout.origin_y_m);
  be::put_u32(h + cmap::kExtentXAt, layout.extent_x);
  be::put_u32(h + cmap::kExtentYAt, layout.extent_y);
  be::put_u32(h + cmap::kQuantumAt, layout.quantum_um);
  be::put_u32(h + cmap::kTileSideAt, layout.tile_side);
  be::put_u32(h + cmap::kSiteAt, source.site);
  be::put_u32(h + cmap::kEpochAt, source.epoch_s);
  be::put_u32(
      h + cmap::kParameterHashAt,
      crc32(reinterpret_cast<const std::uint8_t*>(source.parameters.data()), source.parameters.size()));
  be::put_f32(h + cmap::kPixelAt, static_cast<float>(source.pixel_m));
  const std::size_t length = std::min(source.reference_system.size(), cmap::kMaxReferenceBytes);
  h[cmap::kReferenceLengthAt] = static_cast<std::uint8_t>(length);
  for (std::size_t i = 0; i < length; ++i) {
    const char c = source.reference_system[i];
    head.push_back(c >= 0x20 && c < 0x7F ? static_cast<std::uint8_t>(c) : std::uint8_t{'?'});
  }
  for (const AttributeTable& table : layout.tables) table.put(head);
  if (heights != nullptr) heights->put_head(head);
  head.resize(head.size() + cmap::kCrcBytes);
  be::put_u16(head.data() + cmap::kHeadBytesAt, static_cast<std::uint16_t>(head.size()));
  return head;
}

/// Head, directory, payloads; fills in what of the head depends on them.
std::vector<std::uint8_t> assemble(std::vector<std::uint8_t> head, std::uint32_t count,
                                   const Payloads& payloads) {
  std::size_t payload_bytes = 0;
  for (const auto& payload : payloads) payload_bytes += payload.size();
  const unsigned width = payload_bytes < 1U << 16U ? 2U : payload_bytes < 1U << 24U ? 3U : 4U;
  const std::size_t size = head.size() + width * payloads.size() + payload_bytes;
  if (size > UINT32_MAX)
    throw ToolError("the map would be {} bytes, more than 4 GiB; cut the region smaller", size);

  std::vector<std::uint8_t> directory;
  std::size_t offset = 0;
  std::uint32_t tiles_crc = 0;
  for (const auto& payload : payloads) {
    for (unsigned i = width; i-- > 0;) directory.push_back(static_cast<std::uint8_t>(offset >> 8U * i));
    offset += payload.size();
    if (!payload.empty()) {
      tiles_crc = crc32(payload.data() + payload.size() - cmap::kCrcBytes, cmap::kCrcBytes, tiles_crc);
    }
  }
  std::uint8_t* h = head.data();
  h[cmap::kOffsetBytesAt] = static_cast<std::uint8_t>(width);
  be::put_u32(h + cmap::kFileBytesAt, static_cast<std::uint32_t>(size));
  be::put_u32(h + cmap::kCountAt, count);
  be::put_u32(h + cmap::kTilesCrcAt, tiles_crc);
  be::put_u32(h + cmap::kDirectoryCrcAt, crc32(directory.data(), directory.size()));
  const std::size_t crc_at = head.size() - cmap::kCrcBytes;
  be::put_u32(h + crc_at, crc32(h, crc_at));

  head.reserve(size);
  head.insert(head.end(), directory.begin(), directory.end());
  for (const auto& payload : payloads) head.insert(head.end(), payload.begin(), payload.end());
  return head;
}

/// Fresh tables, or the base's where they serve: a base of positions only stays one; else it must have what
/// there is to tell, and reach it. Returns whether all are the base's.
bool choose_tables(CmapLayout& layout, const std::vector<Quantised>& coded, const CmapOptions& options) {
  const bool positions_only =
      options.like != nullptr ? !layout.tables[0].present() : options.positions_only || coded.empty();
  bool like_base = options.like != nullptr;
  for (unsigned a = 0; a < cmap::kAttributes; ++a) {
    AttributeTable& table = layout.tables[a];
    table.attribute = a;
    if (positions_only) continue;
    std::vector<double> values;
    for (const Quantised& b : coded) values.push_back(b.value[a]);
    if (options.like != nullptr && table.present() && table.reaches(values)) continue;
    const bool had = table.present();
    table = table_for(a, values);
    like_base = like_base && !had && !table.present();
  }
  return like_base;
}

MapExtent extent_of(const CmapLayout& layout) {
  const double quantum_m = layout.quantum_um / kMicrometresPerMetre;
  return {layout.origin_x_m, layout.origin_y_m, layout.origin_x_m + (layout.extent_x - 1U) * quantum_m,
          layout.origin_y_m + (layout.extent_y - 1U) * quantum_m};
}

void check_heights(const CmapLayout& layout, const CmapOptions& options) {
  if (options.heights == nullptr) return;
  const std::uint32_t spacing = options.heights->spacing;
  CAIRN_ASSERT(options.heights->columns == posts_along(layout.extent_x, spacing) &&
               options.heights->rows == posts_along(layout.extent_y, spacing));
  if (options.like != nullptr &&
      (layout.tile_side % spacing != 0 || layout.tile_side / spacing > cmap::kMaxTileSteps))
    throw ToolError("tiles of {} cells are not 1 to {} steps of {} cells of the heights; choose another step",
                    layout.tile_side, cmap::kMaxTileSteps, spacing);
}

TableBoulder boulder_of(const OrbitalMap& map, const MapTile& tile, const cmap::TileBoulder& coded) {
  TableBoulder b;
  b.p_map_m = map.origin_map_m() + Vec2(tile.first_x + coded.x, tile.first_y + coded.y) * map.quantum_m();
  b.diameter_m =
      std::round(static_cast<double>(map.models().diameter_m(coded.attribute[0])) * kMillimetresPerMetre) /
      kMillimetresPerMetre;
  b.area_m2 = 0.25 * kPi * b.diameter_m * b.diameter_m;
  b.height_m = map.models().height_mm(coded.attribute[1]) / kMillimetresPerMetre;
  b.confidence = map.models().confidence_percent(coded.attribute[2]) / 100.0;
  return b;
}

/// False where the tile is bad.
bool read_tile(const OrbitalMap& map, std::uint32_t index, std::vector<TableBoulder>& out) {
  MapTile tile;
  if (!map.tile(index, tile) || !OrbitalMap::tile_holds(index, tile)) return false;
  if (tile.bytes == 0) return true;
  cmap::TileDecoder decoder;
  if (tile.heights_alone()) return true;
  if (!decoder.start(map.models(), tile.shape, tile.boulders(), tile.boulder_bytes)) return false;
  const std::size_t before = out.size();
  std::array<cmap::TileBoulder, 64> coded;
  cmap::TileStep step = cmap::TileStep::kMore;
  while (step == cmap::TileStep::kMore) {
    unsigned given = 0;
    step = decoder.read(map.models(), coded.data(), static_cast<unsigned>(coded.size()), given);
    for (unsigned i = 0; i < given; ++i) out.push_back(boulder_of(map, tile, coded[i]));
  }
  if (step == cmap::TileStep::kCorrupt) out.resize(before);
  return step == cmap::TileStep::kEnd;
}

AttributeTable table_in(unsigned attribute, const std::uint8_t*& next) {
  AttributeTable table;
  table.attribute = attribute;
  table.weights.resize(*next++);
  if (attribute != 2) {
    table.smallest_mm = be::get_u16(next);
    table.step = next[2];
    next += 3;
  }
  for (std::size_t c = 0; c < table.weights.size(); ++c) {
    const std::size_t at = cmap::kWeightBits * c;
    unsigned weight = 0;
    for (std::size_t bit = at; bit < at + cmap::kWeightBits; ++bit)
      weight = weight << 1U | (next[bit / 8U] >> (7U - bit % 8U) & 1U);
    table.weights[c] = static_cast<std::uint8_t>(weight);
  }
  next += (cmap::kWeightBits * table.weights.size() + 7U) / 8U;
  return table;
}

/// Of a head that was validated.
CmapLayout layout_in(const std::uint8_t* h) {
  CmapLayout layout;
  layout.origin_x_m = be::get_f64(h + cmap::kOriginXAt);
  layout.origin_y_m = be::get_f64(h + cmap::kOriginYAt);
  layout.extent_x = be::get_u32(h + cmap::kExtentXAt);
  layout.extent_y = be::get_u32(h + cmap::kExtentYAt);
  layout.quantum_um = be::get_u32(h + cmap::kQuantumAt);
  layout.tile_side = be::get_u32(h + cmap::kTileSideAt);
  const std::uint8_t* next = h + cmap::kReferenceAt + h[cmap::kReferenceLengthAt];
  for (unsigned a = 0; a < cmap::kAttributes; ++a) {
    layout.tables[a].attribute = a;
    if ((h[cmap::kFlagsAt] >> a & 1U) != 0U) layout.tables[a] = table_in(a, next);
  }
  return layout;
}

}  // namespace

double suitable_quantum_m(double pixel_m) {
  double quantum_mm = 2.0;
  for (const double step_mm : {5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0}) {
    if (step_mm <= 250.0 * pixel_m * (1.0 + 1e-9)) quantum_mm = step_mm;
  }
  return 0.001 * quantum_mm;
}

CmapLayout cells_of(const MapExtent& extent, double quantum_m) {
  check_extent(extent, quantum_m);
  CmapLayout layout;
  layout.origin_x_m = extent.min_x_m;
  layout.origin_y_m = extent.min_y_m;
  layout.quantum_um = static_cast<std::uint32_t>(std::llround(quantum_m * kMicrometresPerMetre));
  quantum_m = layout.quantum_um / kMicrometresPerMetre;
  layout.extent_x = cells_along(extent.max_x_m - extent.min_x_m, quantum_m);
  layout.extent_y = cells_along(extent.max_y_m - extent.min_y_m, quantum_m);
  return layout;
}

std::vector<std::uint8_t> encode_cmap(const std::vector<TableBoulder>& boulders, const MapExtent& extent,
                                      double quantum_m, const CmapSource& source, const CmapOptions& options,
                                      CmapReport* report) {
  CmapLayout layout;
  MapExtent mapped = extent;
  if (options.like != nullptr) {
    layout = *options.like;
    mapped = extent_of(layout);
  } else {
    layout = cells_of(extent, quantum_m);
  }
  check_heights(layout, options);
  CmapReport made;
  const std::vector<Quantised> coded = quantise(boulders, layout, mapped, made.merged);
  made.boulders = coded.size();
  if (options.like == nullptr) choose_tiles(layout, coded, options.boulders_per_tile, options.heights);
  made.like_base = choose_tables(layout, coded, options);
  if (report != nullptr) *report = made;
  return assemble(head_of(layout, source, options.heights), static_cast<std::uint32_t>(coded.size()),
                  encode_tiles(layout, coded, options));
}

std::string explain(MapStatus status) {
  switch (status) {
    case MapStatus::kIdle:
    case MapStatus::kChecking: return "validation is not finished";
    case MapStatus::kUsable: return "usable";
    case MapStatus::kNoMap: return "is empty; build it again";
    case MapStatus::kTruncated: return "is truncated; copy or build it again";
    case MapStatus::kBadMagic: return "is not a .cmap map; give the output of cairn map build";
    case MapStatus::kUnknownVersion: return "has a version that this program does not know; build it again";
    case MapStatus::kHeaderCrc: return "has a damaged header (CRC); copy or build it again";
    case MapStatus::kBadHeader: return "has an inconsistent header; build it again";
    case MapStatus::kPayloadCrc: return "has no intact tile (CRC); copy or build it again";
    case MapStatus::kDirectoryCrc: return "has a damaged tile directory (CRC); copy or build it again";
    case MapStatus::kBadDirectory:
      return "has a tile directory that is inconsistent or does not match the tiles; build it again";
    case MapStatus::kDamaged:
      return "has damaged tiles (CRC); cairn map unpack and cairn run take the rest with --salvage, or copy or build it again";
    case MapStatus::kNoBoulders:
      return "contains no boulders; build it with a lower threshold or from a larger image";
  }
  return "has an unknown status";
}

MapStatus validate_cmap(const std::vector<std::uint8_t>& bytes, OrbitalMap* map) {
  MapValidation validation;
  if (map != nullptr) *map = OrbitalMap();
  if (validation.start(bytes.data(), bytes.size()) != MapStatus::kChecking) return validation.status();
  WorkBudget budget = WorkBudget::unlimited();
  while (validation.step(budget) == Progress::kMore) {
  }
  if (map != nullptr) *map = validation.result();
  return validation.status();
}

CmapLayout layout_of(const std::vector<std::uint8_t>& bytes, const std::string& name) {
  const MapStatus status = validate_cmap(bytes);
  if (!may_be_used(status) && status != MapStatus::kNoBoulders)
    throw ToolError("{}: {}", name, explain(status));
  return layout_in(bytes.data());
}

CmapContent decode_cmap(const std::vector<std::uint8_t>& bytes, const std::string& name, bool salvage) {
  OrbitalMap reader;
  const MapStatus status = validate_cmap(bytes, &reader);
  const bool good = status == MapStatus::kUsable || status == MapStatus::kNoBoulders ||
                    (salvage && status == MapStatus::kDamaged);
  if (!good) throw ToolError("{}: {}", name, explain(status));
  const std::uint8_t* h = bytes.data();
  CmapContent map;
  map.layout = layout_in(h);
  map.extent = extent_of(map.layout);
  map.quantum_m = map.layout.quantum_um / kMicrometresPerMetre;
  map.pixel_m = static_cast<double>(be::get_f32(h + cmap::kPixelAt));
  map.method = static_cast<cmap::Method>(h[cmap::kMethodAt]);
  map.parameter_hash = be::get_u32(h + cmap::kParameterHashAt);
  map.site = be::get_u32(h + cmap::kSiteAt);
  map.epoch_s = be::get_u32(h + cmap::kEpochAt);
  map.revision = be::get_u16(h + cmap::kRevisionAt);
  map.head_crc = be::get_u32(h + be::get_u16(h + cmap::kHeadBytesAt) - cmap::kCrcBytes);
  map.columns = map.layout.columns();
  map.rows = map.layout.rows();
  map.tile_m = map.layout.tile_side * map.quantum_m;
  map.reference_system.assign(reinterpret_cast<const char*>(h + cmap::kReferenceAt),
                              h[cmap::kReferenceLengthAt]);
  map.damaged_tiles = reader.damaged_tiles();
  map.heights = read_heights(reader, map.layout.extent_x, map.layout.extent_y);
  for (std::uint32_t t = 0; t < map.columns * map.rows; ++t) {
    const std::uint32_t x = t % map.columns * map.layout.tile_side;
    const std::uint32_t y = t / map.columns * map.layout.tile_side;
    CmapTile tile;
    tile.index = t;
    tile.extent = {
        map.extent.min_x_m + x * map.quantum_m, map.extent.min_y_m + y * map.quantum_m,
        map.extent.min_x_m + (std::min(x + map.layout.tile_side, map.layout.extent_x) - 1U) * map.quantum_m,
        map.extent.min_y_m + (std::min(y + map.layout.tile_side, map.layout.extent_y) - 1U) * map.quantum_m};
    MapTile place;
    if (reader.usable() && reader.tile(t, place)) {
      const std::size_t before = map.boulders.size();
      tile.good = read_tile(reader, t, map.boulders);
      tile.count = static_cast<std::uint32_t>(map.boulders.size() - before);
      tile.bytes = place.bytes;
      tile.heights_bytes = place.height_bytes + place.heights_at;
      if (place.bytes > 0) {
        tile.offset = static_cast<std::size_t>(place.payload - bytes.data());
        if (place.bytes >= cmap::kCrcBytes)
          tile.crc = be::get_u32(place.payload + place.bytes - cmap::kCrcBytes);
      }
    }
    map.tiles.push_back(tile);
  }
  return map;
}

}  // namespace cairn::ground
