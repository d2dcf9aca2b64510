/// Deltas between flight maps: what fsw/orbital_map/map_delta.hpp applies.
#pragma once

#include <cstdint>
#include <vector>

#include "cmap/cmap_file.hpp"

namespace cairn::ground {

/// Part of an upload that holds the payload of a tile.
struct TilePiece {
  std::uint32_t tile = 0;
  std::size_t offset = 0;
  std::size_t bytes = 0;
};

struct MapDelta {
  std::vector<std::uint8_t> bytes;
  std::vector<TilePiece> pieces;  ///< of the tiles whose payload is in it
  std::size_t tiles_kept = 0;     ///< with boulders, taken from the base
};

/// Where the tiles of `layout` lie on the grid of `base`, in tiles of both, east and north.
struct GridShift {
  int columns = 0;
  int rows = 0;
};

/// False where tiles of the one are not tiles of the other: another quantum or side, or origins that are not
/// whole tiles apart.
bool find_shift(const CmapLayout& base, const CmapLayout& layout, GridShift& out);

/// The delta that makes `next` from `base`, both whole maps. Tiles are compared as bytes, so that the result
/// is `next` whatever the two have in common; `shift` (find_shift) says which to compare.
MapDelta encode_delta(const std::vector<std::uint8_t>& base, const std::vector<std::uint8_t>& next,
                      const GridShift& shift);

/// Where the payloads of a whole map lie.
std::vector<TilePiece> pieces_of(const std::vector<std::uint8_t>& map);

}  // namespace cairn::ground
