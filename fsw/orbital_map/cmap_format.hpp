/// The bits of a flight map (`.cmap`), versions 2 and 3: one place for the reader and for the ground tool's
/// encoder. Version 3 adds the ground's heights (doc/adr/0015-heights-of-the-ground.md). doc/ICD.md tells the
/// same in prose, with a worked example. All numbers are big-endian, floating point is IEEE 754, bit streams
/// begin at a byte's most significant bit.
///
///   head       fixed fields, reference system, attribute models, CRC-32 of all that: at most 404 bytes
///   directory  for each tile the offset of its payload from the first payload's first byte
///   payloads   one after another, in the order of the directory, to the end of the file
///
/// The mapped ground is extent_x by extent_y cells of one quantum; a boulder stands at
///   origin + cell * quantum
/// Tiles are squares of tile_side cells, row-major from the south-west corner: eastward, then northward;
/// those at the north and the east edge are cut off there.
///   columns = ceil(extent_x / tile_side),   rows = ceil(extent_y / tile_side)
/// follow, so does the directory's length. A payload ends where the next begins, the last one at the file's
/// end; a tile without boulders has none.
///
/// Payload: count, depth, where the map has attributes the bytes of their stream, the attribute stream, the
/// position bits, zero bits up to a byte, CRC-32 of the tile's number as u32 and of all before in it. In
/// version 3 the bytes of the tile's heights and the heights (orbital_map/height_decoder.hpp) come first, and
/// the rest may be missing: a tile without boulders.
#pragma once

#include <cstddef>
#include <cstdint>

namespace cairn::cmap {

inline constexpr std::uint32_t kMagic = 0x434D4150U;  // "CMAP"
inline constexpr std::uint8_t kVersion = 2;           // no heights
inline constexpr std::uint8_t kHeightsVersion = 3;    // heights
constexpr bool is_known(std::uint8_t version) { return version == kVersion || version == kHeightsVersion; }

// Head: offset in bytes from the file's first.
inline constexpr std::size_t kMagicAt = 0;           // u32
inline constexpr std::size_t kVersionAt = 4;         // u8
inline constexpr std::size_t kFlagsAt = 5;           // u8, attributes that boulders carry: kHasSize, ...
inline constexpr std::size_t kOffsetBytesAt = 6;     // u8, 2 to 4: width of a directory entry
inline constexpr std::size_t kMethodAt = 7;          // u8, Method
inline constexpr std::size_t kHeadBytesAt = 8;       // u16, head with its CRC = offset of the directory
inline constexpr std::size_t kRevisionAt = 10;       // u16, of the site's map
inline constexpr std::size_t kFileBytesAt = 12;      // u32
inline constexpr std::size_t kCountAt = 16;          // u32, boulders
inline constexpr std::size_t kOriginXAt = 20;        // f64, m, frame `map`: cell (0, 0), south-west
inline constexpr std::size_t kOriginYAt = 28;        // f64, m
inline constexpr std::size_t kExtentXAt = 36;        // u32, cells, at least 1
inline constexpr std::size_t kExtentYAt = 40;        // u32
inline constexpr std::size_t kQuantumAt = 44;        // u32, micrometres
inline constexpr std::size_t kTileSideAt = 48;       // u32, cells
inline constexpr std::size_t kSiteAt = 52;           // u32, number of the landing site
inline constexpr std::size_t kEpochAt = 56;          // u32, seconds since J2000 (2000-01-01T12:00:00 TT):
                                                     // when the image was taken; 0 where unknown
inline constexpr std::size_t kParameterHashAt = 60;  // u32, CRC-32 of the preparation's parameter text
inline constexpr std::size_t kPixelAt = 64;  // f32, m: pixel of the orthoimage, 0 where there was none
inline constexpr std::uint32_t kMinPixelBits = 0x3A83126F;  // of a pixel that is used: 1 mm ...
inline constexpr std::uint32_t kMaxPixelBits = 0x42C80000;  // ... to 100 m
inline constexpr std::size_t kTilesCrcAt = 68;         // u32, CRC-32 of the payloads' CRCs, one after another
inline constexpr std::size_t kDirectoryCrcAt = 72;     // u32, CRC-32 of the directory
inline constexpr std::size_t kReferenceLengthAt = 76;  // u8, characters of the reference system
inline constexpr std::size_t kReferenceAt = 77;        // printable ASCII; after it the models, the head's CRC
inline constexpr std::size_t kMaxReferenceBytes = 255;
// Heights of version 3: the head's last bytes before its CRC.
inline constexpr std::size_t kHeightSpacingAt = 0;  // u32, cells from post to post, divides the tile's side
inline constexpr std::size_t kHeightQuantumAt = 4;  // u32, micrometres
inline constexpr std::size_t kHeightBaseAt = 8;     // f64, m, frame `map`: height of a post of value 0
inline constexpr std::size_t kHeightSigmaAt = 16;   // f32, m: of the ground against the posts' surface
inline constexpr std::size_t kHeightCommonAt = 20;  // f32, m: what posts near each other share of their error
inline constexpr std::size_t kHeightBytes = 24;
inline constexpr std::uint32_t kMaxTileSteps = 32;  // from post to post, along a tile's side
inline constexpr std::uint32_t kMaxPosts = kMaxTileSteps + 1;
inline constexpr double kMaxHeight = 1e5;        // m, of the base
inline constexpr float kMinHeightSigma = 1e-4F;  // m
inline constexpr float kMaxHeightSigma = 1e3F;
inline constexpr std::int32_t kMaxPostValue = 1 << 23;
// Head CRC: the head's last bytes; with the two CRCs in the head it answers for the whole file.
inline constexpr std::uint32_t kCrcBytes = 4;
inline constexpr std::size_t kMinHeadBytes = kReferenceAt + kCrcBytes;

// Attributes, in this order in the models and for each boulder in the stream.
inline constexpr unsigned kAttributes = 3;
inline constexpr std::uint8_t kHasSize = 1;        // else 0 m: unknown
inline constexpr std::uint8_t kHasHeight = 2;      // else 0 m: unknown
inline constexpr std::uint8_t kHasConfidence = 4;  // else 1

// Model of an attribute: u8 classes; for size and height u16 smallest (mm) and u8 step; 5 bits a class of
// weight, padded with zero bits to a byte. See orbital_map/attribute_model.hpp.
inline constexpr unsigned kMaxClasses[kAttributes] = {32, 16, 8};
inline constexpr std::size_t kMaxModelBytes = (1 + 3 + 20) + (1 + 3 + 10) + (1 + 5);
inline constexpr std::size_t kMaxHeadBytes =
    kReferenceAt + kMaxReferenceBytes + kMaxModelBytes + kHeightBytes + kCrcBytes;
inline constexpr unsigned kWeightBits = 5;
inline constexpr unsigned kFrequencyBits = 12;
inline constexpr std::uint32_t kFrequencyTotal = 1U << kFrequencyBits;
// The rANS state goes on reading bytes below this.
inline constexpr std::uint32_t kStateLow = 1U << 23U;

// Payload of a tile.
inline constexpr std::size_t kTileCountAt = 0;        // u16, 1 to kMaxTileBoulders
inline constexpr std::size_t kTileDepthAt = 2;        // u8, 0 to kMaxDepth: to which blocks are halved
inline constexpr std::size_t kTileHeadBytes = 3;      // where the map has no attributes
inline constexpr std::size_t kAttributeBytesAt = 3;   // u16, bytes of the attribute stream, where it has some
inline constexpr std::size_t kHeightLengthBytes = 2;  // of version 3, before all: u16, bytes of the heights
inline constexpr unsigned kMaxDepth = 20;
inline constexpr std::uint32_t kMaxBlockSide = 16384;  // cells, so that sums of a block's fit 32 bits

enum class Method : std::uint8_t {
  kTable = 0,   ///< made from a table of boulders
  kOtsu = 1,    ///< detected by the paper's detector (METHOD B.1)
  kShadow = 2,  ///< detected by cap and shadow along the sun's direction
};

// Ranges that the reader insists on. A place is a plain double of better than 0.1 mm, and the work that a
// tile can ask for is bounded.
inline constexpr double kMaxCoordinate = 1e8;      // m
inline constexpr std::uint32_t kMinQuantum = 100;  // micrometres
inline constexpr std::uint32_t kMaxQuantum = 10000000;
inline constexpr std::uint32_t kMaxExtent = 0x7FFFFFFF;  // cells
inline constexpr std::uint32_t kMaxTileSide = 1U << 21U;
inline constexpr std::uint32_t kMaxTiles = 65536;
inline constexpr std::uint32_t kMaxTileBoulders = 4096;
inline constexpr std::uint32_t kMaxTileBytes = 65535;

/// Tiles of `side` cells, not 0, that cover `extent` cells.
constexpr std::uint32_t tiles_along(std::uint32_t extent, std::uint32_t side) {
  return extent / side + (extent % side != 0 ? 1U : 0U);
}

}  // namespace cairn::cmap
