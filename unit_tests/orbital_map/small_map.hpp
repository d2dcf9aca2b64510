/// A flight map written from doc/ICD.md, apart from the ground tool's encoder: sizes alone, tiles of depth 0.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "core/big_endian.hpp"
#include "core/crc32.hpp"

namespace cairn::test {

constexpr std::size_t kMapText = 77;              // "EPSG:32633"
constexpr std::size_t kMapModel = kMapText + 10;  // 10 sizes, 75 mm and twice as much each, alike
constexpr std::size_t kMapHeader = kMapModel + 1 + 3 + 7 + 4;
constexpr unsigned kSizes = 10;

/// Room for a map; the bytes are filled by the functions below.
struct MapBytes {
  std::uint8_t bytes[60000] = {};
  std::size_t size = 0;
  unsigned tiles = 0;

  std::uint8_t* entry(unsigned tile) { return bytes + kMapHeader + 2U * tile; }
  std::size_t payloads() const { return kMapHeader + 2U * tiles; }
  /// Of a tile's payload, or of the map's end.
  std::size_t payload(unsigned tile) const {
    return tile == tiles ? size : payloads() + be::get_u16(bytes + kMapHeader + 2U * tile);
  }
};

struct GridBoulder {
  unsigned tile;
  unsigned x;  ///< cells in the tile
  unsigned y;
  unsigned diameter_mm;  ///< 75, 150, 300, 600 ...
};

inline unsigned class_of(unsigned diameter_mm) {
  unsigned c = 0;
  while (75U << c < diameter_mm) ++c;
  return c;
}

/// The CRC of one tile, as after a change that was meant.
inline void seal_tile(MapBytes& map, unsigned tile) {
  const std::size_t first = map.payload(tile);
  const std::size_t end = map.payload(tile + 1U);
  if (end < first + 4U || end > map.size) return;
  std::uint8_t number[4];
  be::put_u32(number, tile);
  be::put_u32(map.bytes + end - 4U, crc32(map.bytes + first, end - first - 4U, crc32(number, 4)));
}

/// All other CRCs.
inline void seal(MapBytes& map) {
  std::uint32_t tiles_crc = 0;
  for (unsigned t = 0; t < map.tiles; ++t) {
    const std::size_t end = map.payload(t + 1U);
    if (end > map.payload(t) && end <= map.size) tiles_crc = crc32(map.bytes + end - 4U, 4, tiles_crc);
  }
  be::put_u32(map.bytes + 68, tiles_crc);
  be::put_u32(map.bytes + 72, crc32(map.bytes + kMapHeader, 2U * map.tiles));
  be::put_u32(map.bytes + kMapHeader - 4U, crc32(map.bytes, kMapHeader - 4U));
}

/// Appends bits to zeroed bytes.
struct MapBits {
  std::uint8_t* bytes;
  std::size_t used = 0;

  void bit(unsigned one) {
    bytes[used / 8U] = static_cast<std::uint8_t>(bytes[used / 8U] | one << (7U - used % 8U));
    ++used;
  }
  void bits(std::uint64_t value, unsigned count) {
    while (count-- > 0U) bit(static_cast<unsigned>(value >> count & 1U));
  }
  void truncated(std::uint64_t value, std::uint64_t values) {
    unsigned k = 0;
    while (2ULL << k <= values) ++k;
    const std::uint64_t shorter = (2ULL << k) - values;
    if (value < shorter) {
      bits(value, k);
    } else {
      bits(value + shorter, k + 1U);
    }
  }
};

/// The rANS stream of the sizes: each class has 4096 / 10 = 409 of 4096, the first one 6 more.
inline std::size_t put_sizes(std::uint8_t* out, const GridBoulder* boulders, unsigned count) {
  static std::uint8_t reversed[40000];
  std::size_t bytes = 0;
  std::uint64_t state = 1;
  for (unsigned i = count; i-- > 0U;) {
    const unsigned c = class_of(boulders[i].diameter_mm);
    const std::uint64_t f = c == 0 ? 415U : 409U;
    const std::uint64_t start = c == 0 ? 0U : 6U + 409U * c;
    for (; state >= f << 19U; state >>= 8U) reversed[bytes++] = static_cast<std::uint8_t>(state);
    state = state / f * 4096U + start + state % f;
  }
  for (; state > 0U; state >>= 8U) reversed[bytes++] = static_cast<std::uint8_t>(state);
  for (std::size_t i = 0; i < bytes; ++i) out[i] = reversed[bytes - 1U - i];
  return bytes;
}

/// A tile's payload without its CRC: its bytes.
inline std::size_t put_tile(std::uint8_t* out, unsigned width, unsigned height, const GridBoulder* boulders,
                            unsigned count) {
  be::put_u16(out, static_cast<std::uint16_t>(count));
  out[2] = 0;
  const std::size_t stream = put_sizes(out + 5, boulders, count);
  be::put_u16(out + 3, static_cast<std::uint16_t>(stream));
  MapBits bits{out + 5 + stream};
  std::uint64_t next = 0;
  for (unsigned i = 0; i < count; ++i) {
    const std::uint64_t here = static_cast<std::uint64_t>(boulders[i].y) * width + boulders[i].x;
    const std::uint64_t left = static_cast<std::uint64_t>(width) * height - next;
    const std::uint64_t gap = here - next;
    if (i + 1U == count) {
      bits.truncated(gap, left);
    } else {
      std::uint64_t m = left / (count - i) * 2977044471U >> 32U;
      if (m == 0U) m = 1;
      for (std::uint64_t q = 0; q < gap / m; ++q) bits.bit(1);
      bits.bit(0);
      bits.truncated(gap % m, m);
    }
    next = here + 1U;
  }
  return 5 + stream + (bits.used + 7U) / 8U;
}

/// A map of columns x rows tiles of `side` cells of `quantum_m`; boulders given in the order of their tiles,
/// there by y and x, no two in one cell. The northern row of tiles is a tenth lower than the others.
inline void make_map(MapBytes& map, unsigned columns, unsigned rows, unsigned side, double quantum_m,
                     const GridBoulder* boulders, unsigned count) {
  std::memset(map.bytes, 0, sizeof map.bytes);
  map.tiles = columns * rows;
  std::uint8_t* h = map.bytes;
  std::memcpy(h, "CMAP", 4);
  h[4] = 2;
  h[5] = 1;
  h[6] = 2;
  h[7] = 1;
  be::put_u16(h + 8, kMapHeader);
  be::put_u16(h + 10, 3);
  be::put_u32(h + 16, count);
  be::put_f64(h + 20, -35.5);
  be::put_f64(h + 28, 2251000.25);
  be::put_u32(h + 36, columns * side);
  be::put_u32(h + 40, rows * side - side / 10U);
  be::put_u32(h + 44, static_cast<std::uint32_t>(quantum_m * 1e6 + 0.5));
  be::put_u32(h + 48, side);
  be::put_u32(h + 60, 0xCAFE0123U);
  be::put_f32(h + 64, 0.25F);
  h[76] = 10;
  std::memcpy(h + kMapText, "EPSG:32633", 10);
  h[kMapModel] = kSizes;
  be::put_u16(h + kMapModel + 1, 75);
  h[kMapModel + 3] = 128;

  unsigned next = 0;
  map.size = map.payloads();
  for (unsigned tile = 0; tile < map.tiles; ++tile) {
    be::put_u16(map.entry(tile), static_cast<std::uint16_t>(map.size - map.payloads()));
    unsigned end = next;
    while (end < count && boulders[end].tile == tile) ++end;
    if (end == next) continue;
    const unsigned height = tile / columns + 1U == rows ? side - side / 10U : side;
    const std::size_t first = map.size;
    map.size += put_tile(h + first, side, height, boulders + next, end - next) + 4U;
    std::uint8_t number[4];
    be::put_u32(number, tile);
    be::put_u32(h + map.size - 4U, crc32(h + first, map.size - first - 4U, crc32(number, 4)));
    next = end;
  }
  be::put_u32(h + 12, static_cast<std::uint32_t>(map.size));
  seal(map);
}

}  // namespace cairn::test
