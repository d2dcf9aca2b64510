#include "orbital_map/map_reader.hpp"

#include <cmath>

#include "core/big_endian.hpp"
#include "core/crc32.hpp"
#include "orbital_map/cmap_format.hpp"

namespace cairn {
WindowStatus MapReader::start(const OrbitalMap& map, const Vec2& p_map_m, double radius_m) {
  phase_ = Phase::kDone;
  damaged_tiles_ = 0;
  if (!map.usable()) return WindowStatus::kNoMap;
  if (!OrbitalMap::is_circle(p_map_m, radius_m)) return WindowStatus::kBadInput;
  map_ = map;
  centre_map_m_ = p_map_m;
  radius2_m2_ = radius_m * radius_m;
  map.tiles_about(p_map_m, radius_m, columns_, rows_);
  column_ = columns_.first;
  row_ = rows_.first;
  phase_ = Phase::kNextTile;
  return WindowStatus::kUsable;
}

Progress MapReader::step(WorkBudget& budget, Chunk& out) {
  out.clear();
  while (phase_ != Phase::kDone && out.empty()) {
    switch (phase_) {
      case Phase::kNextTile:
        if (!budget.take(kTileOps)) return Progress::kMore;
        begin_tile();
        break;
      case Phase::kCrc:
        if (!budget.take(kCrcUnitBytes)) return Progress::kMore;
        crc_unit();
        break;
      case Phase::kBoulders:
        if (!budget.take(kChunkOps)) return Progress::kMore;
        boulder_unit(out);
        break;
      case Phase::kDone: break;
    }
  }
  return phase_ == Phase::kDone && out.empty() ? Progress::kDone : Progress::kMore;
}

void MapReader::begin_tile() {
  if (column_ >= columns_.end) {
    column_ = columns_.first;
    ++row_;
  }
  if (row_ >= rows_.end || columns_.first >= columns_.end) {
    phase_ = Phase::kDone;
    return;
  }
  const std::uint32_t index = row_ * map_.columns() + column_;
  const bool placed = map_.tile(index, tile_);
  const bool empty = placed && (tile_.payload == nullptr || tile_.heights_alone());
  const bool sized = tile_.bytes >= cmap::kCrcBytes && tile_.bytes <= cmap::kMaxTileBytes;
  if (empty) {
    ++column_;
  } else if (!placed || !sized) {
    leave_out_tile();
  } else {
    crc_ = cmap::tile_crc_start(index);
    cursor_ = 0;
    phase_ = Phase::kCrc;
  }
}

void MapReader::crc_unit() {
  const std::uint32_t coded = tile_.bytes - cmap::kCrcBytes;
  const std::uint32_t left = coded - cursor_;
  const std::uint32_t bytes = left < kCrcUnitBytes ? left : kCrcUnitBytes;
  crc_ = crc32(tile_.payload + cursor_, bytes, crc_);
  cursor_ += bytes;
  if (cursor_ < coded) return;
  phase_ = Phase::kBoulders;
  if (crc_ != be::get_u32(tile_.payload + coded) ||
      !decoder_.start(map_.models(), tile_.shape, tile_.boulders(), tile_.boulder_bytes)) {
    leave_out_tile();
  }
}

void MapReader::boulder_unit(Chunk& out) {
  cmap::TileBoulder coded[kChunk];
  unsigned given = 0;
  const cmap::TileStep step = decoder_.read(map_.models(), coded, kChunk, given);
  for (unsigned i = 0; i < given && step != cmap::TileStep::kCorrupt; ++i) {
    const MapBoulder boulder = map_.boulder(tile_, coded[i]);
    if ((boulder.p_map_m - centre_map_m_).squaredNorm() > radius2_m2_) continue;
    out.append(boulder);  // a unit gives no more than a chunk holds
  }
  if (step == cmap::TileStep::kCorrupt) leave_out_tile();
  if (step != cmap::TileStep::kEnd) return;
  ++column_;
  phase_ = Phase::kNextTile;
}

void MapReader::leave_out_tile() {
  ++damaged_tiles_;
  ++column_;
  phase_ = Phase::kNextTile;
}

}  // namespace cairn
