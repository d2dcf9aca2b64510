/// The boulders of an orbital map within a circle, a handful at a time: what OrbitalMap::window does, as a
/// job. For readings that are too long for one slice, and for readers with a memory of their own.
///
/// Order: tiles row by row from the south-west, in a tile as in the file. A tile whose CRC does not hold, or
/// whose place is led astray, is left out and counted. (Of a tile that contradicts itself although its CRC
/// holds, which a validated map has once in 2^32 upsets, the boulders before the fault have been handed out.)
///
/// Cost. Units: a tile's place (10 operations), 256 bytes of its CRC, 32 of its boulders
/// (25 operations each).
#pragma once

#include <cstdint>

#include "core/work_budget.hpp"
#include "geometry/boulder.hpp"
#include "orbital_map/orbital_map.hpp"

namespace cairn {

class MapReader {
 public:
  static constexpr std::size_t kChunk = 32;
  static constexpr std::uint32_t kTileOps = 10;
  static constexpr std::uint32_t kChunkOps = 25 * kChunk;
  using Chunk = FixedVector<MapBoulder, kChunk>;

  /// kUsable where there is a map and the circle is a circle, else kNoMap or kBadInput. The map's bytes are
  /// borrowed until done.
  WindowStatus start(const OrbitalMap& map, const Vec2& p_map_m, double radius_m);
  /// Hands out the next boulders in `out`, which is cleared first. kMore with none in it: the budget ran out.
  Progress step(WorkBudget& budget, Chunk& out);
  std::uint32_t damaged_tiles() const { return damaged_tiles_; }

 private:
  enum class Phase : std::uint8_t { kNextTile, kCrc, kBoulders, kDone };

  void begin_tile();
  void crc_unit();
  void boulder_unit(Chunk& out);
  void leave_out_tile();

  OrbitalMap map_;
  Vec2 centre_map_m_ = Vec2(0.0, 0.0);
  double radius2_m2_ = 0.0;
  OrbitalMap::Span columns_;
  OrbitalMap::Span rows_;
  std::uint32_t column_ = 0;
  std::uint32_t row_ = 0;
  Phase phase_ = Phase::kDone;
  MapTile tile_;
  cmap::TileDecoder decoder_;
  std::uint32_t cursor_ = 0;  ///< byte of the tile that comes next
  std::uint32_t crc_ = 0;
  std::uint32_t damaged_tiles_ = 0;
};

}  // namespace cairn
