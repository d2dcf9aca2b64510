#include "core/crc32.hpp"

#include "core/big_endian.hpp"

namespace cairn {
namespace {

/// Four bytes at a time (M. Kounavis and F. Berry, "A systematic approach to building high performance
/// software-based CRC generators", 2005). The register stands with its bytes in the order of big-endian
/// words, so that a word of data goes into it as it is.
struct Table {
  std::uint32_t entry[4][256];  ///< [n]: a byte with n bytes of zeros behind it
};

constexpr std::uint32_t turned(std::uint32_t v) {
  return v >> 24U | (v >> 8U & 0xFF00U) | (v << 8U & 0xFF0000U) | v << 24U;
}

constexpr Table make_table() {
  Table table{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t c = i;
    for (int bit = 0; bit < 8; ++bit) c = (c & 1U) != 0U ? (c >> 1U) ^ 0xEDB88320U : c >> 1U;
    table.entry[0][i] = turned(c);
  }
  for (std::uint32_t n = 1; n < 4; ++n) {
    for (std::uint32_t i = 0; i < 256; ++i) {
      const std::uint32_t before = table.entry[n - 1][i];
      table.entry[n][i] = before << 8U ^ table.entry[0][before >> 24U];
    }
  }
  return table;
}

constexpr Table kTable = make_table();

}  // namespace

std::uint32_t crc32(const std::uint8_t* data, std::size_t size, std::uint32_t crc) {
  std::uint32_t c = turned(~crc);
  for (; size >= 4; size -= 4, data += 4) {
    c ^= be::get_u32(data);
    c = kTable.entry[3][c >> 24U] ^ kTable.entry[2][c >> 16U & 0xFFU] ^ kTable.entry[1][c >> 8U & 0xFFU] ^
        kTable.entry[0][c & 0xFFU];
  }
  for (; size > 0; --size, ++data) c = kTable.entry[0][c >> 24U ^ *data] ^ c << 8U;
  return ~turned(c);
}

}  // namespace cairn
