/// What is done with one tile of an image, and what comes of it as bytes. See map_build.hpp.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "map/byte_stream.hpp"
#include "map/detector.hpp"
#include "map/grey_range.hpp"

namespace cairn::ground {

/// The rounds over an image, in their order. The values are those of the partial state's records.
enum class Round : std::uint8_t {
  kValues = 1,       ///< counts of pixel values
  kLowerHalves = 2,  ///< of the lower halves of reals
  kStatistics = 3,   ///< of the difference image
  kBoulders = 4,
};

/// What a round needs of those before, the same for all tiles.
struct RoundInput {
  Round round = Round::kValues;
  FineBins bins = {};
  GreyRange range;
  BlockDarkness darkness;
};
Bytes to_bytes(const RoundInput& input);
void read(ByteReader& from, RoundInput& input);

/// What finds boulders, and how.
struct Detection {
  DetectorParams otsu;
};

/// A record of Round::kBoulders.
struct TileBoulders {
  std::vector<FoundBoulder> found;
  TileComponents shared;  ///< with other tiles; `closed` is empty
};
TileBoulders tile_boulders(const Bytes& record);

/// How far a tile's result depends on the image around it.
int reach_px(const Detection& detection, double pixel_m);

/// One round's work on one tile: a pure function of its arguments and of the pixels.
Bytes work_on_tile(RasterReader& reader, const RasterFacts& facts, const Detection& detection,
                   const RoundInput& input, const PixelBox& tile);

}  // namespace cairn::ground
