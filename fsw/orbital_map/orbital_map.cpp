#include "orbital_map/orbital_map.hpp"

#include <cmath>
#include <limits>

#include "core/big_endian.hpp"
#include "core/crc32.hpp"
#include "core/subnormal.hpp"
#include "orbital_map/cmap_format.hpp"

namespace cairn {
namespace {

constexpr std::uint32_t kDirectoryUnit = 64;
constexpr std::uint32_t kBoulderUnit = 32;
constexpr std::uint32_t kTileUnitCost = 10;
constexpr double kMicrometre = 1e-6;

static_assert(std::numeric_limits<double>::is_iec559, "maps carry IEEE 754 bit patterns");

std::uint32_t smaller(std::uint32_t a, std::uint32_t b) { return a < b ? a : b; }

template <typename T>
bool within(T value, T least, T most) {
  return value >= least && value <= most;
}  // false on NaN

bool is_printable(const std::uint8_t* text, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) {
    if (text[i] < 0x20 || text[i] > 0x7E) return false;
  }
  return true;
}

}  // namespace

Vec2 OrbitalMap::extent_m() const {
  if (!usable()) return {0.0, 0.0};
  return {(extent_x_ - 1U) * quantum_m_, (extent_y_ - 1U) * quantum_m_};
}

bool OrbitalMap::still_in(const std::uint8_t* bank, std::size_t size) const {
  if (!usable() || bank != bytes_ || size < file_bytes_) return false;
  return be::get_u32(bank + directory_at_ - cmap::kCrcBytes) == head_crc_ ||
         be::get_u32(bank + cmap::kTilesCrcAt) == tiles_crc_;
}

MapStatus OrbitalMap::read_head(const std::uint8_t* bytes, std::size_t size) {
  if (bytes == nullptr || size == 0) return MapStatus::kNoMap;
  if (size < cmap::kMinHeadBytes) return MapStatus::kTruncated;
  if (be::get_u32(bytes + cmap::kMagicAt) != cmap::kMagic) return MapStatus::kBadMagic;
  if (!cmap::is_known(bytes[cmap::kVersionAt])) return MapStatus::kUnknownVersion;
  const std::uint32_t head_bytes = be::get_u16(bytes + cmap::kHeadBytesAt);
  if (head_bytes < cmap::kMinHeadBytes || head_bytes > cmap::kMaxHeadBytes) return MapStatus::kHeaderCrc;
  if (size < head_bytes) return MapStatus::kTruncated;
  const std::size_t crc_at = head_bytes - cmap::kCrcBytes;
  if (crc32(bytes, crc_at) != be::get_u32(bytes + crc_at)) return MapStatus::kHeaderCrc;
  bytes_ = bytes;
  const MapStatus fields = read_fields(head_bytes);
  if (fields != MapStatus::kUsable) return fields;
  return size < file_bytes_ ? MapStatus::kTruncated : MapStatus::kUsable;
}

/// kUsable or kBadHeader.
MapStatus OrbitalMap::read_fields(std::uint32_t head_bytes) {
  const std::uint8_t* h = bytes_;
  const std::uint8_t flags = h[cmap::kFlagsAt];
  const std::uint32_t quantum_um = be::get_u32(h + cmap::kQuantumAt);
  file_bytes_ = be::get_u32(h + cmap::kFileBytesAt);
  count_ = be::get_u32(h + cmap::kCountAt);
  origin_x_m_ = be::get_f64(h + cmap::kOriginXAt);
  origin_y_m_ = be::get_f64(h + cmap::kOriginYAt);
  extent_x_ = be::get_u32(h + cmap::kExtentXAt);
  extent_y_ = be::get_u32(h + cmap::kExtentYAt);
  tile_side_ = be::get_u32(h + cmap::kTileSideAt);
  offset_bytes_ = h[cmap::kOffsetBytesAt];
  parameter_hash_ = be::get_u32(h + cmap::kParameterHashAt);
  tiles_crc_ = be::get_u32(h + cmap::kTilesCrcAt);
  head_crc_ = be::get_u32(h + head_bytes - cmap::kCrcBytes);
  quantum_m_ = quantum_um * kMicrometre;
  // For information, so no fault where it is none. Positive floats are ordered as their bits are.
  const bool is_pixel = within(be::get_u32(h + cmap::kPixelAt), cmap::kMinPixelBits, cmap::kMaxPixelBits);
  pixel_m_ = is_pixel ? static_cast<double>(be::get_f32(h + cmap::kPixelAt)) : 0.0;
  directory_at_ = head_bytes;
  if (is_subnormal(origin_x_m_) || is_subnormal(origin_y_m_)) return MapStatus::kBadHeader;
  if (!within(origin_x_m_, -cmap::kMaxCoordinate, cmap::kMaxCoordinate) ||
      !within(origin_y_m_, -cmap::kMaxCoordinate, cmap::kMaxCoordinate) ||
      !within(quantum_um, cmap::kMinQuantum, cmap::kMaxQuantum) || !within(extent_x_, 1U, cmap::kMaxExtent) ||
      !within(extent_y_, 1U, cmap::kMaxExtent) || !within(tile_side_, 1U, cmap::kMaxTileSide) ||
      !within(offset_bytes_, 2U, 4U)) {
    return MapStatus::kBadHeader;
  }
  columns_ = cmap::tiles_along(extent_x_, tile_side_);
  rows_ = cmap::tiles_along(extent_y_, tile_side_);
  if (columns_ > cmap::kMaxTiles || rows_ > cmap::kMaxTiles / columns_) return MapStatus::kBadHeader;
  payloads_at_ = directory_at_ + columns_ * rows_ * offset_bytes_;
  if (file_bytes_ < payloads_at_) return MapStatus::kBadHeader;

  const std::size_t text_bytes = h[cmap::kReferenceLengthAt];
  std::size_t models_end = head_bytes - cmap::kCrcBytes;
  heights_ = MapHeights();
  if (h[cmap::kVersionAt] == cmap::kHeightsVersion) {
    if (models_end < cmap::kReferenceAt + cmap::kHeightBytes) return MapStatus::kBadHeader;
    models_end -= cmap::kHeightBytes;
    if (!read_heights(h + models_end)) return MapStatus::kBadHeader;
  }
  if (text_bytes > models_end - cmap::kReferenceAt) return MapStatus::kBadHeader;
  const std::size_t models_at = cmap::kReferenceAt + text_bytes;
  const bool good = flags < 1U << cmap::kAttributes && is_printable(h + cmap::kReferenceAt, text_bytes) &&
                    models_.read(flags, h + models_at, models_end - models_at);
  return good ? MapStatus::kUsable : MapStatus::kBadHeader;
}

bool OrbitalMap::read_heights(const std::uint8_t* fields) {
  heights_.spacing = be::get_u32(fields + cmap::kHeightSpacingAt);
  const std::uint32_t quantum_um = be::get_u32(fields + cmap::kHeightQuantumAt);
  heights_.quantum_m = quantum_um * kMicrometre;
  heights_.base_m = be::get_f64(fields + cmap::kHeightBaseAt);
  heights_.sigma_m = be::get_f32(fields + cmap::kHeightSigmaAt);
  heights_.common_m = be::get_f32(fields + cmap::kHeightCommonAt);
  return within(heights_.spacing, 1U, tile_side_) && tile_side_ % heights_.spacing == 0 &&
         tile_side_ / heights_.spacing <= cmap::kMaxTileSteps &&
         within(quantum_um, cmap::kMinQuantum, cmap::kMaxQuantum) &&
         within(heights_.base_m, -cmap::kMaxHeight, cmap::kMaxHeight) && !is_subnormal(heights_.base_m) &&
         within(heights_.sigma_m, cmap::kMinHeightSigma, cmap::kMaxHeightSigma) &&
         within(heights_.common_m, cmap::kMinHeightSigma, cmap::kMaxHeightSigma);
}

/// Directory entry `tile`; behind the last the end of the payloads.
std::uint32_t OrbitalMap::offset(std::uint32_t tile) const {
  if (tile == tiles()) return payload_bytes();
  const std::uint8_t* entry = bytes_ + directory_at_ + tile * offset_bytes_;
  std::uint32_t value = 0;
  for (std::uint32_t i = 0; i < offset_bytes_; ++i) value = value << 8U | entry[i];
  return value;
}

bool OrbitalMap::tile(std::uint32_t index, MapTile& out) const {
  CAIRN_ASSERT(index < tiles());
  const std::uint32_t first = offset(index);
  const std::uint32_t end = offset(index + 1U);
  if (first > end || end > payload_bytes()) return false;
  out = MapTile();
  if (first < end) out.payload = bytes_ + payloads_at_ + first;
  out.bytes = end - first;
  out.boulder_bytes = out.bytes > cmap::kCrcBytes ? out.bytes - cmap::kCrcBytes : 0U;
  if (heights_.spacing > 0 && out.payload != nullptr && out.boulder_bytes > 0) {
    out.heights_at = cmap::kHeightLengthBytes;
    if (out.boulder_bytes < out.heights_at) return false;
    out.height_bytes = be::get_u16(out.payload);
    out.boulder_bytes -= out.heights_at;
    if (out.height_bytes > out.boulder_bytes) return false;
    out.boulder_bytes -= out.height_bytes;
    out.boulders_at = out.heights_at + out.height_bytes;
  }
  const std::uint32_t row = index / columns_;
  out.first_x = (index - row * columns_) * tile_side_;
  out.first_y = row * tile_side_;
  out.shape = {smaller(tile_side_, extent_x_ - out.first_x), smaller(tile_side_, extent_y_ - out.first_y)};
  return true;
}

bool OrbitalMap::tile_holds(std::uint32_t index, const MapTile& tile) {
  if (tile.payload == nullptr) return true;
  if (tile.bytes < cmap::kCrcBytes || tile.bytes > cmap::kMaxTileBytes) return false;
  const std::uint32_t coded = tile.bytes - cmap::kCrcBytes;
  return crc32(tile.payload, coded, cmap::tile_crc_start(index)) == be::get_u32(tile.payload + coded);
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

bool OrbitalMap::is_circle(const Vec2& p_map_m, double radius_m) {
  return std::isfinite(p_map_m.x()) && std::isfinite(p_map_m.y()) && std::isfinite(radius_m) &&
         radius_m >= 0.0;
}

void OrbitalMap::tiles_about(const Vec2& p_map_m, double radius_m, Span& columns, Span& rows) const {
  const double tile_m = tile_side_ * quantum_m_;
  // A quantum more on each side: a boulder exactly on the circle is not lost to the rounding of
  // a tile's edge.
  const double reach_m = radius_m + quantum_m_;
  const double east_m = p_map_m.x() - origin_x_m_;
  const double north_m = p_map_m.y() - origin_y_m_;
  columns = tiles_between(east_m - reach_m, east_m + reach_m, tile_m, columns_);
  rows = tiles_between(north_m - reach_m, north_m + reach_m, tile_m, rows_);
}

MapBoulder OrbitalMap::boulder(const MapTile& tile, const cmap::TileBoulder& coded) const {
  MapBoulder out;
  out.p_map_m = Vec2(origin_x_m_ + (tile.first_x + coded.x) * quantum_m_,
                     origin_y_m_ + (tile.first_y + coded.y) * quantum_m_);
  out.diameter_m = models_.diameter_m(coded.attribute[0]);
  out.height_mm = models_.height_mm(coded.attribute[1]);
  out.confidence_percent = models_.confidence_percent(coded.attribute[2]);
  return out;
}

WindowStatus OrbitalMap::window(const Vec2& p_map_m, double radius_m, MapBoulders& out) const {
  if (!usable()) return WindowStatus::kNoMap;
  if (!is_circle(p_map_m, radius_m)) return WindowStatus::kBadInput;
  Span columns;
  Span rows;
  tiles_about(p_map_m, radius_m, columns, rows);
  const std::size_t before = out.size();
  bool damaged = false;
  for (std::uint32_t row = rows.first; row < rows.end; ++row) {
    for (std::uint32_t column = columns.first; column < columns.end; ++column) {
      const Taken taken = take_tile(row * columns_ + column, p_map_m, radius_m, out);
      if (taken == Taken::kFull) return WindowStatus::kWindowFull;
      damaged = damaged || taken == Taken::kCorrupt;
    }
  }
  if (damaged) return WindowStatus::kDamaged;
  return out.size() > before ? WindowStatus::kUsable : WindowStatus::kNoneNear;
}

OrbitalMap::Taken OrbitalMap::take_tile(std::uint32_t index, const Vec2& p_map_m, double radius_m,
                                        MapBoulders& out) const {
  MapTile place;
  if (!tile(index, place) || !tile_holds(index, place)) return Taken::kCorrupt;
  if (place.payload == nullptr || place.heights_alone()) return Taken::kAll;
  cmap::TileDecoder decoder;
  if (!decoder.start(models_, place.shape, place.boulders(), place.boulder_bytes)) return Taken::kCorrupt;
  const std::size_t before = out.size();
  const double radius2 = radius_m * radius_m;
  // Copies: for all that the compiler knows, what is written below might change the originals.
  const double centre_x_m = p_map_m.x();
  const double centre_y_m = p_map_m.y();
  const double origin_x_m = origin_x_m_;
  const double origin_y_m = origin_y_m_;
  const double quantum_m = quantum_m_;
  const std::size_t room = MapBoulders::capacity() - before;
  MapBoulder* const next = out.end();
  std::size_t taken = 0;
  bool full = false;
  cmap::TileBoulder coded[kBoulderUnit];
  cmap::TileStep step = cmap::TileStep::kMore;
  while (step == cmap::TileStep::kMore) {
    unsigned given = 0;
    step = decoder.read(models_, coded, kBoulderUnit, given);
    for (unsigned i = 0; i < given; ++i) {
      const cmap::TileBoulder& c = coded[i];
      const double x_m = origin_x_m + (place.first_x + c.x) * quantum_m;
      const double y_m = origin_y_m + (place.first_y + c.y) * quantum_m;
      const double east_m = x_m - centre_x_m;
      const double north_m = y_m - centre_y_m;
      if (east_m * east_m + north_m * north_m > radius2) continue;
      if (taken == room) {
        full = true;  // the tile is read to its end all the same: it may turn out corrupt
        break;
      }
      MapBoulder& boulder = next[taken++];
      boulder.p_map_m = Vec2(x_m, y_m);
      boulder.diameter_m = models_.diameter_m(c.attribute[0]);
      boulder.height_mm = models_.height_mm(c.attribute[1]);
      boulder.confidence_percent = models_.confidence_percent(c.attribute[2]);
    }
  }
  if (step == cmap::TileStep::kCorrupt) return Taken::kCorrupt;
  out.resize(before + taken);
  return full ? Taken::kFull : Taken::kAll;
}

MapStatus MapValidation::start(const std::uint8_t* bytes, std::size_t size) {
  candidate_ = result_ = OrbitalMap();  // not all of *this: that would lie on the stack, too
  phase_ = Phase::kDirectory;
  falls_ = false;
  index_ = cursor_ = crc_ = tiles_crc_ = good_boulders_ = 0;
  status_ = candidate_.read_head(bytes, size);
  if (status_ == MapStatus::kUsable) status_ = MapStatus::kChecking;
  return status_;
}

Progress MapValidation::step(WorkBudget& budget) {
  while (status_ == MapStatus::kChecking) {
    switch (phase_) {
      case Phase::kDirectory:
        if (!budget.take((8 + 4) * kDirectoryUnit)) return Progress::kMore;
        check_directory_unit();
        break;
      case Phase::kNextTile:
        if (!budget.take(kTileUnitCost)) return Progress::kMore;
        begin_tile();
        break;
      case Phase::kTileCrc:
        if (!budget.take(2 * kCrcUnitBytes)) return Progress::kMore;
        check_tile_crc_unit();
        break;
      case Phase::kHeights:
        if (!budget.take(12 * cmap::kMaxPosts)) return Progress::kMore;
        check_height_row();
        break;
      case Phase::kBoulders:
        if (!budget.take(25 * kBoulderUnit)) return Progress::kMore;
        check_boulder_unit();
        break;
    }
  }
  return Progress::kDone;
}

void MapValidation::check_directory_unit() {
  const OrbitalMap& map = candidate_;
  const std::uint32_t tiles = map.tiles();
  const std::uint32_t end = smaller(tiles, index_ + kDirectoryUnit);
  crc_ = crc32(map.bytes_ + map.directory_at_ + index_ * map.offset_bytes_,
               (end - index_) * map.offset_bytes_, crc_);
  for (; index_ < end; ++index_) {
    const std::uint32_t first = map.offset(index_);
    const std::uint32_t next = map.offset(index_ + 1U);
    falls_ = falls_ || (index_ == 0 && first != 0) || next < first || next > map.payload_bytes();
  }
  if (index_ < tiles) return;
  if (crc_ != be::get_u32(map.bytes_ + cmap::kDirectoryCrcAt)) {
    status_ = MapStatus::kDirectoryCrc;
  } else if (falls_) {
    status_ = MapStatus::kBadDirectory;
  }
  phase_ = Phase::kNextTile;
  index_ = 0;
}

void MapValidation::begin_tile() {
  if (index_ == candidate_.tiles()) {
    conclude();
    return;
  }
  const bool leads = candidate_.tile(index_, tile_);
  if (leads && tile_.payload == nullptr) {
    ++index_;
  } else if (!leads || tile_.bytes < cmap::kCrcBytes || tile_.bytes > cmap::kMaxTileBytes) {
    leave_out_tile();
  } else {
    cursor_ = 0;
    crc_ = cmap::tile_crc_start(index_);
    phase_ = Phase::kTileCrc;
  }
}

void MapValidation::check_tile_crc_unit() {
  const std::uint32_t coded = tile_.bytes - cmap::kCrcBytes;
  const std::uint32_t bytes = smaller(kCrcUnitBytes, coded - cursor_);
  crc_ = crc32(tile_.payload + cursor_, bytes, crc_);
  cursor_ += bytes;
  if (cursor_ < coded) return;
  const std::uint8_t* said = tile_.payload + coded;
  tiles_crc_ = crc32(said, cmap::kCrcBytes, tiles_crc_);
  if (crc_ != be::get_u32(said)) {
    leave_out_tile();
  } else if (tile_.height_bytes > 0) {
    phase_ = Phase::kHeights;
    const MapHeights& grid = candidate_.heights_;
    if (!heights_.start(grid.posts(tile_.shape.width), grid.posts(tile_.shape.height), tile_.heights(),
                        tile_.height_bytes))
      leave_out_tile();
  } else {
    begin_boulders();
  }
}

void MapValidation::check_height_row() {
  switch (heights_.read(posts_)) {
    case cmap::HeightStep::kMore: break;
    case cmap::HeightStep::kCorrupt: leave_out_tile(); break;
    case cmap::HeightStep::kEnd: begin_boulders(); break;
  }
}

void MapValidation::begin_boulders() {
  phase_ = Phase::kBoulders;
  if (tile_.heights_alone()) {
    tile_is_done();
  } else if (!decoder_.start(candidate_.models_, tile_.shape, tile_.boulders(), tile_.boulder_bytes)) {
    leave_out_tile();
  }
}

void MapValidation::check_boulder_unit() {
  cmap::TileBoulder boulders[kBoulderUnit];
  unsigned given = 0;
  switch (decoder_.read(candidate_.models_, boulders, kBoulderUnit, given)) {
    case cmap::TileStep::kMore: break;
    case cmap::TileStep::kCorrupt: leave_out_tile(); break;
    case cmap::TileStep::kEnd:
      good_boulders_ += decoder_.count();
      tile_is_done();
      break;
  }
}

void MapValidation::tile_is_done() {
  ++index_;
  phase_ = Phase::kNextTile;
}

void MapValidation::leave_out_tile() {
  ++candidate_.damaged_tiles_;
  tile_is_done();
}

void MapValidation::conclude() {
  const bool whole = candidate_.damaged_tiles_ == 0;
  const bool as_made = !whole || tiles_crc_ == be::get_u32(candidate_.bytes_ + cmap::kTilesCrcAt);
  if (whole && good_boulders_ != candidate_.count_) {
    status_ = MapStatus::kBadDirectory;
  } else if (whole && as_made && good_boulders_ == 0) {
    status_ = MapStatus::kNoBoulders;
  } else if (!as_made || good_boulders_ == 0) {
    status_ = MapStatus::kPayloadCrc;
  } else {
    status_ = whole ? MapStatus::kUsable : MapStatus::kDamaged;
    candidate_.count_ = good_boulders_;
    result_ = candidate_;
  }
}

}  // namespace cairn
