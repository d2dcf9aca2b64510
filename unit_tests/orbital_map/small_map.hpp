/// A flight map written by hand from doc/ICD.md, apart from the ground tool's encoder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "core/big_endian.hpp"
#include "core/crc32.hpp"

namespace cairn::test {

constexpr std::size_t kMapHeader = 176;

/// Room for a map; the bytes are filled by the functions below.
struct MapBytes {
  std::uint8_t bytes[60000] = {};
  std::size_t size = 0;
};

struct GridBoulder {
  unsigned tile;
  unsigned x;  ///< quanta in the tile
  unsigned y;
  unsigned diameter_mm;
};

/// Both CRCs, as after a change that was meant.
inline void seal(MapBytes& map) {
  be::put_u32(map.bytes + 168, crc32(map.bytes + kMapHeader, map.size - kMapHeader));
  be::put_u32(map.bytes + 172, crc32(map.bytes, 172));
}

/// A map of columns x rows tiles of `side` quanta of `quantum_m`; boulders given in the order of their tiles.
inline void make_map(MapBytes& map, unsigned columns, unsigned rows, unsigned side, double quantum_m,
                     const GridBoulder* boulders, unsigned count) {
  std::memset(map.bytes, 0, sizeof map.bytes);
  const unsigned tiles = columns * rows;
  map.size = kMapHeader + 4U * (tiles + 1U) + 6U * count;
  std::uint8_t* h = map.bytes;
  std::memcpy(h, "CMAP", 4);
  be::put_u16(h + 4, 1);
  be::put_u16(h + 6, kMapHeader);
  be::put_u32(h + 8, static_cast<std::uint32_t>(map.size));
  be::put_u32(h + 12, count);
  be::put_f64(h + 16, -35.5);
  be::put_f64(h + 24, 2251000.25);
  be::put_f64(h + 32, columns * side * quantum_m);
  be::put_f64(h + 40, rows * side * quantum_m * 0.9);
  be::put_f64(h + 48, quantum_m);
  be::put_u16(h + 56, static_cast<std::uint16_t>(columns));
  be::put_u16(h + 58, static_cast<std::uint16_t>(rows));
  be::put_u16(h + 60, static_cast<std::uint16_t>(side));
  be::put_u16(h + 62, 1);
  be::put_f32(h + 64, 0.25F);
  be::put_u32(h + 68, 0xCAFE0123U);
  std::memcpy(h + 72, "EPSG:32633", 10);
  unsigned next = 0;
  for (unsigned tile = 0; tile <= tiles; ++tile) {
    be::put_u32(h + kMapHeader + 4U * tile, next);
    while (next < count && boulders[next].tile == tile) ++next;
  }
  for (unsigned i = 0; i < count; ++i) {
    std::uint8_t* b = h + kMapHeader + 4U * (tiles + 1U) + 6U * i;
    be::put_u16(b, static_cast<std::uint16_t>(boulders[i].x));
    be::put_u16(b + 2, static_cast<std::uint16_t>(boulders[i].y));
    be::put_u16(b + 4, static_cast<std::uint16_t>(boulders[i].diameter_mm));
  }
  seal(map);
}

}  // namespace cairn::test
