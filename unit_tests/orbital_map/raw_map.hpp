/// Maps and deltas put together by hand from doc/ICD.md, around payloads that are given as they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "core/big_endian.hpp"
#include "core/crc32.hpp"

namespace cairn::test {

struct RawBytes {
  std::uint8_t bytes[60000] = {};
  std::size_t size = 0;

  void u8(unsigned v) { bytes[size++] = static_cast<std::uint8_t>(v); }
  void u16(unsigned v) {
    u8(v >> 8U & 0xFFU);
    u8(v & 0xFFU);
  }
  void u32(std::uint32_t v) {
    u16(v >> 16U);
    u16(v & 0xFFFFU);
  }
  void append(const std::uint8_t* from, std::size_t count) {
    if (count > 0) std::memcpy(bytes + size, from, count);
    size += count;
  }
};

/// A tile's payload without its CRC; empty: no payload.
struct RawTile {
  const std::uint8_t* bytes = nullptr;
  std::size_t size = 0;
};

inline std::uint32_t tile_crc(std::uint32_t number, const RawTile& tile) {
  std::uint8_t field[4];
  be::put_u32(field, number);
  return crc32(tile.bytes, tile.size, crc32(field, 4));
}

constexpr std::size_t kRawHead = 81;  // no reference system, no attributes

/// A map of columns x rows tiles of 1000 cells of 10 mm, 40 cells cut off at the north and the east edge.
inline void raw_map(RawBytes& map, unsigned columns, unsigned rows, unsigned offset_bytes,
                    const RawTile* tiles, std::uint32_t count = 1) {
  map.size = 0;
  std::memset(map.bytes, 0, sizeof map.bytes);
  std::uint8_t* h = map.bytes;
  std::memcpy(h, "CMAP", 4);
  h[4] = 2;
  h[6] = static_cast<std::uint8_t>(offset_bytes);
  be::put_u16(h + 8, kRawHead);
  be::put_u32(h + 16, count);
  be::put_f64(h + 20, -35.5);
  be::put_f64(h + 28, 2251000.25);
  be::put_u32(h + 36, 1000 * columns - 40);
  be::put_u32(h + 40, 1000 * rows - 40);
  be::put_u32(h + 44, 10000);
  be::put_u32(h + 48, 1000);
  map.size = kRawHead;
  std::uint32_t offset = 0;
  for (unsigned t = 0; t < columns * rows; ++t) {
    for (unsigned i = offset_bytes; i-- > 0;) map.u8(offset >> 8 * i & 0xFFU);
    if (tiles[t].size > 0) offset += static_cast<std::uint32_t>(tiles[t].size) + 4;
  }
  be::put_u32(h + 72, crc32(h + kRawHead, map.size - kRawHead));
  std::uint32_t crc_of_crcs = 0;
  for (unsigned t = 0; t < columns * rows; ++t) {
    if (tiles[t].size == 0) continue;
    map.append(tiles[t].bytes, tiles[t].size);
    map.u32(tile_crc(t, tiles[t]));
    crc_of_crcs = crc32(map.bytes + map.size - 4, 4, crc_of_crcs);
  }
  be::put_u32(h + 12, static_cast<std::uint32_t>(map.size));
  be::put_u32(h + 68, crc_of_crcs);
  be::put_u32(h + kRawHead - 4, crc32(h, kRawHead - 4));
}

/// The delta from `base` to the map with `head`, its tiles given as `sent` (those of bit 1) or left
/// to the base.
inline void raw_delta(RawBytes& out, const RawBytes& base, int column_shift, int row_shift,
                      const std::uint8_t* head, std::size_t head_bytes, const bool* is_sent,
                      const RawTile* tiles, unsigned count) {
  out.size = 0;
  const std::uint8_t start[] = {'C', 'D', 'L', 'T', 1, 0};
  out.append(start, 6);
  out.u16(static_cast<unsigned>(column_shift) & 0xFFFFU);
  out.u16(static_cast<unsigned>(row_shift) & 0xFFFFU);
  out.u32(static_cast<std::uint32_t>(base.size));
  out.u32(be::get_u32(base.bytes + be::get_u16(base.bytes + 8) - 4));
  out.append(head, head_bytes);
  for (unsigned t = 0; t < count; t += 8) {
    unsigned bits = 0;
    for (unsigned i = 0; i < 8; ++i) bits = bits << 1U | (t + i < count && is_sent[t + i] ? 1U : 0U);
    out.u8(bits);
  }
  for (unsigned t = 0; t < count; ++t) {
    if (!is_sent[t]) continue;
    out.u16(tiles[t].size == 0 ? 0U : static_cast<unsigned>(tiles[t].size) + 4U);
    out.append(tiles[t].bytes, tiles[t].size);
    if (tiles[t].size > 0) out.u32(tile_crc(t, tiles[t]));
  }
}

}  // namespace cairn::test
