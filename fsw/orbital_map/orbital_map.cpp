#include "orbital_map/orbital_map.hpp"

#include <cmath>
#include <limits>

#include "core/big_endian.hpp"
#include "core/crc32.hpp"
#include "orbital_map/cmap_format.hpp"

namespace cairn {
namespace {

constexpr std::uint32_t kCrcUnitBytes = 256;
constexpr std::uint32_t kDirectoryUnit = 64;
constexpr std::uint32_t kBoulderUnit = 32;

static_assert(std::numeric_limits<double>::is_iec559, "maps carry IEEE 754 bit patterns");

std::uint32_t smaller(std::uint32_t a, std::uint32_t b) { return a < b ? a : b; }

bool within(double value, double least, double most) {
  return value >= least && value <= most;
}  // false on NaN

/// Printable ASCII, then zeros to the field's end, at least one.
bool is_text_field(const std::uint8_t* field, std::size_t size) {
  std::size_t i = 0;
  while (i < size && field[i] >= 0x20 && field[i] < 0x7F) ++i;
  if (i == size) return false;
  while (i < size && field[i] == 0) ++i;
  return i == size;
}

}  // namespace

const char* OrbitalMap::reference_system() const {
  return usable() ? reinterpret_cast<const char*>(bytes_ + cmap::kReferenceAt) : "";
}

MapStatus OrbitalMap::read_header(const std::uint8_t* bytes, std::size_t size) {
  if (bytes == nullptr || size == 0) return MapStatus::kNoMap;
  if (size < cmap::kHeaderBytes) return MapStatus::kTruncated;
  if (be::get_u32(bytes + cmap::kMagicAt) != cmap::kMagic) return MapStatus::kBadMagic;
  if (be::get_u16(bytes + cmap::kVersionAt) != cmap::kVersion) return MapStatus::kUnknownVersion;
  if (be::get_u16(bytes + cmap::kHeaderBytesAt) != cmap::kHeaderBytes) return MapStatus::kUnknownVersion;
  if (crc32(bytes, cmap::kHeaderCrcAt) != be::get_u32(bytes + cmap::kHeaderCrcAt))
    return MapStatus::kHeaderCrc;
  bytes_ = bytes;
  file_bytes_ = be::get_u32(bytes + cmap::kFileBytesAt);
  count_ = be::get_u32(bytes + cmap::kCountAt);
  origin_x_m_ = be::get_f64(bytes + cmap::kOriginXAt);
  origin_y_m_ = be::get_f64(bytes + cmap::kOriginYAt);
  extent_x_m_ = be::get_f64(bytes + cmap::kExtentXAt);
  extent_y_m_ = be::get_f64(bytes + cmap::kExtentYAt);
  quantum_m_ = be::get_f64(bytes + cmap::kQuantumAt);
  columns_ = be::get_u16(bytes + cmap::kColumnsAt);
  rows_ = be::get_u16(bytes + cmap::kRowsAt);
  tile_side_ = be::get_u16(bytes + cmap::kTileSideAt);
  parameter_hash_ = be::get_u32(bytes + cmap::kParameterHashAt);
  const MapStatus fields = check_header();
  if (fields != MapStatus::kUsable) return fields;
  return size < file_bytes_ ? MapStatus::kTruncated : MapStatus::kUsable;
}

/// kUsable or kBadHeader.
MapStatus OrbitalMap::check_header() const {
  if (!within(origin_x_m_, -cmap::kMaxCoordinate, cmap::kMaxCoordinate) ||
      !within(origin_y_m_, -cmap::kMaxCoordinate, cmap::kMaxCoordinate) ||
      !within(quantum_m_, cmap::kMinQuantum, cmap::kMaxQuantum)) {
    return MapStatus::kBadHeader;
  }
  if (columns_ == 0 || rows_ == 0 || tile_side_ == 0) return MapStatus::kBadHeader;
  const double tile_m = tile_side_ * quantum_m_;
  if (!within(extent_x_m_, 0.0, columns_ * tile_m) || !within(extent_y_m_, 0.0, rows_ * tile_m)) {
    return MapStatus::kBadHeader;
  }
  const std::uint64_t entries = static_cast<std::uint64_t>(columns_) * rows_ + 1U;
  const std::uint64_t expected = cmap::kHeaderBytes + entries * cmap::kDirectoryEntryBytes +
                                 static_cast<std::uint64_t>(count_) * cmap::kBoulderBytes;
  if (expected != file_bytes_) return MapStatus::kBadHeader;
  const bool text = is_text_field(bytes_ + cmap::kReferenceAt, cmap::kReferenceBytes);
  return text ? MapStatus::kUsable : MapStatus::kBadHeader;
}

OrbitalMap::Span OrbitalMap::boulders_of_tile(std::uint32_t tile) const {
  const std::uint8_t* entry = bytes_ + cmap::kHeaderBytes + cmap::kDirectoryEntryBytes * tile;
  return {be::get_u32(entry), be::get_u32(entry + cmap::kDirectoryEntryBytes)};
}

const std::uint8_t* OrbitalMap::boulder_at(std::uint32_t index) const {
  return bytes_ + file_bytes_ - cmap::kBoulderBytes * (count_ - index);
}

/// Tiles along one axis that [low, high] touches, distances from the origin. Compared as doubles before any
/// conversion, so that no distance is too far; a conversion cuts, which is down for what is not negative.
OrbitalMap::Span OrbitalMap::tiles_between(double low_m, double high_m, double tile_m, std::uint32_t tiles) {
  const double first = low_m / tile_m;
  const double last = high_m / tile_m;
  if (last < 0.0 || first >= tiles) return {};
  const std::uint32_t from = first > 0.0 ? static_cast<std::uint32_t>(first) : 0U;
  const std::uint32_t to = last < tiles ? static_cast<std::uint32_t>(last) + 1U : tiles;
  return {from, to};
}

WindowStatus OrbitalMap::window(const Vec2& p_map_m, double radius_m, MapBoulders& out) const {
  if (!usable()) return WindowStatus::kNoMap;
  if (!std::isfinite(p_map_m.x()) || !std::isfinite(p_map_m.y()) || !std::isfinite(radius_m) ||
      radius_m < 0.0) {
    return WindowStatus::kBadInput;
  }
  const double tile_m = tile_side_ * quantum_m_;
  // A quantum more on each side: a boulder exactly on the circle is not lost to the rounding of a tile's
  // edge.
  const double reach_m = radius_m + quantum_m_;
  const double east_m = p_map_m.x() - origin_x_m_;
  const double north_m = p_map_m.y() - origin_y_m_;
  const Span columns = tiles_between(east_m - reach_m, east_m + reach_m, tile_m, columns_);
  const Span rows = tiles_between(north_m - reach_m, north_m + reach_m, tile_m, rows_);
  bool found = false;
  for (std::uint32_t row = rows.first; row < rows.end; ++row) {
    for (std::uint32_t column = columns.first; column < columns.end; ++column) {
      const Span boulders = boulders_of_tile(row * columns_ + column);
      for (std::uint32_t i = boulders.first; i < boulders.end; ++i) {
        const std::uint8_t* coded = boulder_at(i);
        const std::uint32_t x = column * tile_side_ + be::get_u16(coded + cmap::kBoulderXAt);
        const std::uint32_t y = row * tile_side_ + be::get_u16(coded + cmap::kBoulderYAt);
        MapBoulder boulder;
        boulder.p_map_m = Vec2(origin_x_m_ + x * quantum_m_, origin_y_m_ + y * quantum_m_);
        if ((boulder.p_map_m - p_map_m).squaredNorm() > radius_m * radius_m) continue;
        boulder.diameter_m =
            static_cast<float>(be::get_u16(coded + cmap::kBoulderDiameterAt) * cmap::kDiameterUnit);
        if (!out.push_back(boulder)) return WindowStatus::kWindowFull;
        found = true;
      }
    }
  }
  return found ? WindowStatus::kUsable : WindowStatus::kNoneNear;
}

MapStatus MapValidation::start(const std::uint8_t* bytes, std::size_t size) {
  candidate_ = OrbitalMap();
  result_ = OrbitalMap();
  phase_ = Phase::kPayloadCrc;
  cursor_ = static_cast<std::uint32_t>(cmap::kHeaderBytes);
  crc_ = 0;
  status_ = candidate_.read_header(bytes, size);
  if (status_ == MapStatus::kUsable) status_ = MapStatus::kChecking;
  return status_;
}

Progress MapValidation::step(WorkBudget& budget) {
  while (status_ == MapStatus::kChecking) {
    switch (phase_) {
      case Phase::kPayloadCrc:
        if (!budget.take(2 * kCrcUnitBytes)) return Progress::kMore;
        check_payload_unit();
        break;
      case Phase::kDirectory:
        if (!budget.take(4 * kDirectoryUnit)) return Progress::kMore;
        check_directory_unit();
        break;
      case Phase::kBoulders:
        if (!budget.take(8 * kBoulderUnit)) return Progress::kMore;
        check_boulder_unit();
        break;
    }
  }
  return Progress::kDone;
}

void MapValidation::check_payload_unit() {
  const std::uint32_t bytes = smaller(kCrcUnitBytes, candidate_.file_bytes_ - cursor_);
  crc_ = crc32(candidate_.bytes_ + cursor_, bytes, crc_);
  cursor_ += bytes;
  if (cursor_ < candidate_.file_bytes_) return;
  if (crc_ != be::get_u32(candidate_.bytes_ + cmap::kPayloadCrcAt)) {
    status_ = MapStatus::kPayloadCrc;
    return;
  }
  phase_ = Phase::kDirectory;
  cursor_ = 0;
}

void MapValidation::check_directory_unit() {
  const std::uint32_t tiles = candidate_.columns_ * candidate_.rows_;
  const std::uint32_t end = smaller(tiles, cursor_ + kDirectoryUnit);
  for (; cursor_ < end; ++cursor_) {
    const OrbitalMap::Span boulders = candidate_.boulders_of_tile(cursor_);
    const bool begins = cursor_ > 0 || boulders.first == 0;
    const bool ends = cursor_ + 1 < tiles || boulders.end == candidate_.count_;
    if (!begins || !ends || boulders.end < boulders.first) {
      status_ = MapStatus::kBadDirectory;
      return;
    }
  }
  if (cursor_ < tiles) return;
  phase_ = Phase::kBoulders;
  cursor_ = 0;
  if (candidate_.count_ == 0) status_ = MapStatus::kNoBoulders;
}

void MapValidation::check_boulder_unit() {
  const std::uint32_t end = smaller(candidate_.count_, cursor_ + kBoulderUnit);
  for (; cursor_ < end; ++cursor_) {
    const std::uint8_t* coded = candidate_.boulder_at(cursor_);
    if (be::get_u16(coded + cmap::kBoulderXAt) >= candidate_.tile_side_ ||
        be::get_u16(coded + cmap::kBoulderYAt) >= candidate_.tile_side_ ||
        be::get_u16(coded + cmap::kBoulderDiameterAt) == 0) {
      status_ = MapStatus::kBadBoulder;
      return;
    }
  }
  if (cursor_ < candidate_.count_) return;
  status_ = MapStatus::kUsable;
  result_ = candidate_;
}

}  // namespace cairn
