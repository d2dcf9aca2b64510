#include "core/crc32.hpp"

namespace cairn {
namespace {

struct Table {
  std::uint32_t entry[256];
};

constexpr Table make_table() {
  Table table{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t c = i;
    for (int bit = 0; bit < 8; ++bit) c = (c & 1U) != 0U ? (c >> 1U) ^ 0xEDB88320U : c >> 1U;
    table.entry[i] = c;
  }
  return table;
}

constexpr Table kTable = make_table();

}  // namespace

std::uint32_t crc32(const std::uint8_t* data, std::size_t size, std::uint32_t crc) {
  crc = ~crc;
  for (std::size_t i = 0; i < size; ++i) crc = kTable.entry[(crc ^ data[i]) & 0xFFU] ^ (crc >> 8U);
  return ~crc;
}

}  // namespace cairn
