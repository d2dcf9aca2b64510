/// The bits of a flight map (`.cmap`), version 1: one place for the reader here and for the ground tool's
/// encoder. doc/ICD.md tells the same in prose. All numbers are big-endian; floating point is IEEE 754.
///
///   header                 kHeaderBytes
///   tile directory         (columns * rows + 1) x u32: number of boulders in all tiles before this one
///   boulders               count x kBoulderBytes, tile by tile
///
/// Tiles are squares of `tile_side` quanta, row-major from the south-west corner: eastward, then northward.
#pragma once

#include <cstddef>
#include <cstdint>

namespace cairn::cmap {

inline constexpr std::uint32_t kMagic = 0x434D4150U;  // "CMAP"
inline constexpr std::uint16_t kVersion = 1;

// Header fields: offset in bytes from the file's first.
inline constexpr std::size_t kMagicAt = 0;        // u32
inline constexpr std::size_t kVersionAt = 4;      // u16
inline constexpr std::size_t kHeaderBytesAt = 6;  // u16
inline constexpr std::size_t kFileBytesAt = 8;    // u32
inline constexpr std::size_t kCountAt = 12;       // u32, boulders
inline constexpr std::size_t kOriginXAt = 16;     // f64, m, frame `map`: south-west corner of the first tile
inline constexpr std::size_t kOriginYAt = 24;     // f64, m
inline constexpr std::size_t kExtentXAt =
    32;  // f64, m: the mapped ground reaches from the origin this far east
inline constexpr std::size_t kExtentYAt = 40;   // f64, m: and north
inline constexpr std::size_t kQuantumAt = 48;   // f64, m
inline constexpr std::size_t kColumnsAt = 56;   // u16, tiles
inline constexpr std::size_t kRowsAt = 58;      // u16, tiles
inline constexpr std::size_t kTileSideAt = 60;  // u16, quanta
inline constexpr std::size_t kMethodAt = 62;    // u16, Method
inline constexpr std::size_t kPixelAt = 64;     // f32, m: pixel of the orthoimage, 0 where there was none
inline constexpr std::size_t kParameterHashAt = 68;  // u32, CRC-32 of the preparation's parameter text
inline constexpr std::size_t kReferenceAt = 72;  // kReferenceBytes of ASCII, zero-filled, the last byte zero
inline constexpr std::size_t kReferenceBytes = 96;
inline constexpr std::size_t kPayloadCrcAt = 168;  // u32, CRC-32 of all bytes after the header
inline constexpr std::size_t kHeaderCrcAt = 172;   // u32, CRC-32 of the header's bytes before this field
inline constexpr std::size_t kHeaderBytes = 176;

inline constexpr std::size_t kDirectoryEntryBytes = 4;

// One boulder: position in its tile, in quanta from the tile's south-west corner, less than tile_side;
// diameter.
inline constexpr std::size_t kBoulderXAt = 0;         // u16, quanta east
inline constexpr std::size_t kBoulderYAt = 2;         // u16, quanta north
inline constexpr std::size_t kBoulderDiameterAt = 4;  // u16, mm, at least 1
inline constexpr std::size_t kBoulderBytes = 6;
inline constexpr double kDiameterUnit = 0.001;  // m

enum class Method : std::uint16_t {
  kTable = 0,  ///< made from a table of boulders
  kOtsu = 1,   ///< detected by the paper's detector (METHOD B.1)
};

// Ranges that the reader insists on, so that every position is a plain double of better than 0.1 mm.
inline constexpr double kMaxCoordinate = 1e8;  // m
inline constexpr double kMinQuantum = 1e-4;    // m
inline constexpr double kMaxQuantum = 10.0;    // m

}  // namespace cairn::cmap
