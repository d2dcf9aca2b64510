#include "map/cmap_file.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "core/big_endian.hpp"
#include "core/crc32.hpp"
#include "core/trig.hpp"
#include "tool_error.hpp"

namespace cairn::ground {
namespace {

constexpr double kBouldersPerTile = 32.0;
constexpr double kMaxCount16 = 65535.0;

struct Quantised {
  std::uint32_t tile = 0;
  std::uint16_t y = 0;
  std::uint16_t x = 0;
  std::uint16_t diameter_mm = 0;

  auto key() const { return std::tie(tile, y, x, diameter_mm); }
};

struct Grid {
  std::uint32_t side = 1;  ///< quanta
  std::uint32_t columns = 1;
  std::uint32_t rows = 1;
};

std::uint32_t tiles_for(double extent_m, double quantum_m, std::uint32_t side) {
  // The last quantum of the extent belongs to the map as well, hence the one more.
  const double tiles = std::floor((extent_m / quantum_m + 1.0) / side) + 1.0;
  if (tiles > kMaxCount16) {
    throw ToolError("--quantum: {} m is too small for a map {} m wide; choose a larger one", quantum_m,
                    extent_m);
  }
  return static_cast<std::uint32_t>(tiles);
}

Grid grid_for(const MapExtent& extent, double quantum_m, std::size_t boulders) {
  const double width_m = extent.max_x_m - extent.min_x_m;
  const double height_m = extent.max_y_m - extent.min_y_m;
  const double density =
      std::max<double>(1.0, static_cast<double>(boulders)) / std::max(width_m * height_m, 1e-6);
  const double side = std::round(std::sqrt(kBouldersPerTile / density) / quantum_m);
  Grid grid;
  grid.side = static_cast<std::uint32_t>(std::clamp(side, 256.0, kMaxCount16));
  grid.columns = tiles_for(width_m, quantum_m, grid.side);
  grid.rows = tiles_for(height_m, quantum_m, grid.side);
  return grid;
}

std::vector<Quantised> quantise(const std::vector<TableBoulder>& boulders, const MapExtent& extent,
                                double quantum_m, const Grid& grid) {
  std::vector<Quantised> all;
  all.reserve(boulders.size());
  for (const TableBoulder& b : boulders) {
    const double diameter_mm = std::max(1.0, std::round(b.diameter_m / cmap::kDiameterUnit));
    if (!extent.contains(b.p_map_m) || !(diameter_mm <= kMaxCount16)) {
      throw ToolError(
          "boulder at ({:.3f}, {:.3f}) of {:.3f} m: outside the map or larger than 65.5 m; mend the table",
          b.p_map_m.x(), b.p_map_m.y(), b.diameter_m);
    }
    const auto x = static_cast<std::uint32_t>(std::lround((b.p_map_m.x() - extent.min_x_m) / quantum_m));
    const auto y = static_cast<std::uint32_t>(std::lround((b.p_map_m.y() - extent.min_y_m) / quantum_m));
    all.push_back({y / grid.side * grid.columns + x / grid.side, static_cast<std::uint16_t>(y % grid.side),
                   static_cast<std::uint16_t>(x % grid.side), static_cast<std::uint16_t>(diameter_mm)});
  }
  std::sort(all.begin(), all.end(), [](const Quantised& a, const Quantised& b) { return a.key() < b.key(); });
  return all;
}

void put_header(std::vector<std::uint8_t>& bytes, std::size_t count, const MapExtent& extent,
                double quantum_m, const Grid& grid, const CmapSource& source) {
  std::uint8_t* h = bytes.data();
  be::put_u32(h + cmap::kMagicAt, cmap::kMagic);
  be::put_u16(h + cmap::kVersionAt, cmap::kVersion);
  be::put_u16(h + cmap::kHeaderBytesAt, static_cast<std::uint16_t>(cmap::kHeaderBytes));
  be::put_u32(h + cmap::kFileBytesAt, static_cast<std::uint32_t>(bytes.size()));
  be::put_u32(h + cmap::kCountAt, static_cast<std::uint32_t>(count));
  be::put_f64(h + cmap::kOriginXAt, extent.min_x_m);
  be::put_f64(h + cmap::kOriginYAt, extent.min_y_m);
  be::put_f64(h + cmap::kExtentXAt, extent.max_x_m - extent.min_x_m);
  be::put_f64(h + cmap::kExtentYAt, extent.max_y_m - extent.min_y_m);
  be::put_f64(h + cmap::kQuantumAt, quantum_m);
  be::put_u16(h + cmap::kColumnsAt, static_cast<std::uint16_t>(grid.columns));
  be::put_u16(h + cmap::kRowsAt, static_cast<std::uint16_t>(grid.rows));
  be::put_u16(h + cmap::kTileSideAt, static_cast<std::uint16_t>(grid.side));
  be::put_u16(h + cmap::kMethodAt, static_cast<std::uint16_t>(source.method));
  be::put_f32(h + cmap::kPixelAt, static_cast<float>(source.pixel_m));
  be::put_u32(
      h + cmap::kParameterHashAt,
      crc32(reinterpret_cast<const std::uint8_t*>(source.parameters.data()), source.parameters.size()));
  const std::size_t length = std::min(source.reference_system.size(), cmap::kReferenceBytes - 1);
  for (std::size_t i = 0; i < length; ++i) {
    const char c = source.reference_system[i];
    h[cmap::kReferenceAt + i] = c >= 0x20 && c < 0x7F ? static_cast<std::uint8_t>(c) : std::uint8_t{'?'};
  }
  be::put_u32(h + cmap::kPayloadCrcAt, crc32(h + cmap::kHeaderBytes, bytes.size() - cmap::kHeaderBytes));
  be::put_u32(h + cmap::kHeaderCrcAt, crc32(h, cmap::kHeaderCrcAt));
}

}  // namespace

double suitable_quantum_m(double pixel_m) {
  double quantum_mm = 1.0;
  for (const double step_mm : {2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0}) {
    if (step_mm <= 250.0 * pixel_m * (1.0 + 1e-9)) quantum_mm = step_mm;
  }
  return 0.001 * quantum_mm;
}

std::vector<std::uint8_t> encode_cmap(const std::vector<TableBoulder>& boulders, const MapExtent& extent,
                                      double quantum_m, const CmapSource& source) {
  if (!(quantum_m >= cmap::kMinQuantum && quantum_m <= cmap::kMaxQuantum)) {
    throw ToolError("--quantum: {} m is out of range; choose {} to {}", quantum_m, cmap::kMinQuantum,
                    cmap::kMaxQuantum);
  }
  for (const double c : {extent.min_x_m, extent.min_y_m, extent.max_x_m, extent.max_y_m}) {
    if (!(std::fabs(c) <= cmap::kMaxCoordinate)) {
      throw ToolError(
          "coordinate {} m is beyond {:g} m; shift the map's reference system nearer to its origin", c,
          cmap::kMaxCoordinate);
    }
  }
  const Grid grid = grid_for(extent, quantum_m, boulders.size());
  const std::vector<Quantised> coded = quantise(boulders, extent, quantum_m, grid);
  const std::size_t tiles = static_cast<std::size_t>(grid.columns) * grid.rows;
  const std::size_t size =
      cmap::kHeaderBytes + (tiles + 1) * cmap::kDirectoryEntryBytes + coded.size() * cmap::kBoulderBytes;
  if (size > UINT32_MAX)
    throw ToolError("the map would be {} bytes, more than 4 GiB; cut the region smaller", size);

  std::vector<std::uint8_t> bytes(size, 0);
  std::uint8_t* entry = bytes.data() + cmap::kHeaderBytes;
  std::uint8_t* boulder = entry + (tiles + 1) * cmap::kDirectoryEntryBytes;
  std::size_t next = 0;
  for (std::size_t tile = 0; tile <= tiles; ++tile, entry += cmap::kDirectoryEntryBytes) {
    be::put_u32(entry, static_cast<std::uint32_t>(next));
    for (; next < coded.size() && coded[next].tile == tile; ++next, boulder += cmap::kBoulderBytes) {
      be::put_u16(boulder + cmap::kBoulderXAt, coded[next].x);
      be::put_u16(boulder + cmap::kBoulderYAt, coded[next].y);
      be::put_u16(boulder + cmap::kBoulderDiameterAt, coded[next].diameter_mm);
    }
  }
  put_header(bytes, coded.size(), extent, quantum_m, grid, source);
  return bytes;
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
    case MapStatus::kBadHeader: return "has a header that contradicts itself; build it again";
    case MapStatus::kPayloadCrc: return "has damaged contents (CRC); copy or build it again";
    case MapStatus::kBadDirectory: return "has a tile directory that contradicts itself; build it again";
    case MapStatus::kBadBoulder: return "has a boulder outside its tile; build it again";
    case MapStatus::kNoBoulders:
      return "holds no boulder; build it with a lower threshold or from a larger image";
  }
  return "has an unknown status";
}

MapStatus validate_cmap(const std::vector<std::uint8_t>& bytes) {
  MapValidation validation;
  if (validation.start(bytes.data(), bytes.size()) != MapStatus::kChecking) return validation.status();
  WorkBudget budget = WorkBudget::unlimited();
  while (validation.step(budget) == Progress::kMore) {
  }
  return validation.status();
}

CmapContent decode_cmap(const std::vector<std::uint8_t>& bytes, const std::string& name) {
  const MapStatus status = validate_cmap(bytes);
  if (status != MapStatus::kUsable && status != MapStatus::kNoBoulders)
    throw ToolError("{}: {}", name, explain(status));
  const std::uint8_t* h = bytes.data();
  CmapContent map;
  map.extent.min_x_m = be::get_f64(h + cmap::kOriginXAt);
  map.extent.min_y_m = be::get_f64(h + cmap::kOriginYAt);
  map.extent.max_x_m = map.extent.min_x_m + be::get_f64(h + cmap::kExtentXAt);
  map.extent.max_y_m = map.extent.min_y_m + be::get_f64(h + cmap::kExtentYAt);
  map.quantum_m = be::get_f64(h + cmap::kQuantumAt);
  map.pixel_m = static_cast<double>(be::get_f32(h + cmap::kPixelAt));
  map.method = static_cast<cmap::Method>(be::get_u16(h + cmap::kMethodAt));
  map.parameter_hash = be::get_u32(h + cmap::kParameterHashAt);
  map.columns = be::get_u16(h + cmap::kColumnsAt);
  map.rows = be::get_u16(h + cmap::kRowsAt);
  const unsigned side = be::get_u16(h + cmap::kTileSideAt);
  map.tile_m = side * map.quantum_m;
  map.reference_system = reinterpret_cast<const char*>(h + cmap::kReferenceAt);

  const std::uint8_t* entry = h + cmap::kHeaderBytes;
  const std::size_t tiles = static_cast<std::size_t>(map.columns) * map.rows;
  const std::uint8_t* boulder = entry + (tiles + 1) * cmap::kDirectoryEntryBytes;
  for (std::size_t tile = 0; tile < tiles; ++tile, entry += cmap::kDirectoryEntryBytes) {
    const std::uint32_t held = be::get_u32(entry + cmap::kDirectoryEntryBytes) - be::get_u32(entry);
    for (std::uint32_t i = 0; i < held; ++i, boulder += cmap::kBoulderBytes) {
      const auto x =
          static_cast<double>(tile % map.columns * side + be::get_u16(boulder + cmap::kBoulderXAt));
      const auto y =
          static_cast<double>(tile / map.columns * side + be::get_u16(boulder + cmap::kBoulderYAt));
      TableBoulder b;
      b.p_map_m = Vec2(map.extent.min_x_m + x * map.quantum_m, map.extent.min_y_m + y * map.quantum_m);
      b.diameter_m = be::get_u16(boulder + cmap::kBoulderDiameterAt) * cmap::kDiameterUnit;
      b.area_m2 = 0.25 * kPi * b.diameter_m * b.diameter_m;
      map.boulders.push_back(b);
    }
  }
  return map;
}

}  // namespace cairn::ground
