/// What is done with one tile of an image, and what comes of it as bytes. See map_build.hpp.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/byte_stream.hpp"
#include "detect/detector.hpp"
#include "detect/shadow_detector.hpp"
#include "detect/tile_grid.hpp"
#include "orbital_map/cmap_format.hpp"
#include "ortho/grey_range.hpp"

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
  cmap::Method method = cmap::Method::kOtsu;  ///< or kShadow
  DetectorParams otsu;
  ShadowParams shadow;
  Sun sun;  ///< for kShadow
};

/// Throws ToolError that names the option, where a value of the method is out of its range.
void check(const Detection& detection);

/// Method and parameters as one line of text, e.g. for the map's parameter hash.
std::string to_text(const Detection& detection);

/// A record of Round::kBoulders.
struct TileBoulders {
  std::vector<FoundBoulder> found;
  TileComponents shared;  ///< with other tiles; `closed` is empty
  GreyContent content;    ///< of the tile, where no round before has looked at it (kShadow)
};
TileBoulders tile_boulders(const Bytes& record);

/// How far a tile's result depends on the image around it.
int reach_px(const Detection& detection, const GeoTransform& geo);

/// The tiles that suit a file and a method; squares of `side` pixels where that is not 0.
TileGrid tiles_of(const RasterFacts& facts, const Detection& detection, int side);

/// One round's work on one tile: a pure function of its arguments and of the pixels.
Bytes work_on_tile(RasterReader& reader, const RasterFacts& facts, const Detection& detection,
                   const RoundInput& input, const PixelBox& tile);

}  // namespace cairn::ground
