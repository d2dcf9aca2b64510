/// CRC-32 of maps, packets and tables: polynomial 0x04C11DB7 reflected (0xEDB88320), initial value and
/// final exclusive-or 0xFFFFFFFF, bits reflected (ISO-HDLC, as in zlib and PNG).
/// crc32("123456789") = 0xCBF43926.
#pragma once

#include <cstddef>
#include <cstdint>

namespace cairn {

constexpr std::uint32_t kCrcUnitBytes = 256;  ///< as many are one unit of work

/// CRC of `size` bytes. Pass the CRC of the bytes before as `crc` to go on; 0 starts afresh.
std::uint32_t crc32(const std::uint8_t* data, std::size_t size, std::uint32_t crc = 0);

}  // namespace cairn
