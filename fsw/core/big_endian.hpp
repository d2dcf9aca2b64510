/// Big-endian fields of maps and packets, read and written byte by byte: no alignment, no host byte order.
/// Floating point travels as IEEE 754 bit patterns. The caller has checked the bounds.
#pragma once

#include <cstdint>
#include <cstring>

namespace cairn::be {

inline std::uint16_t get_u16(const std::uint8_t* p) {
  return static_cast<std::uint16_t>((static_cast<unsigned>(p[0]) << 8U) | p[1]);
}
inline std::uint32_t get_u32(const std::uint8_t* p) {
#if __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__  // one instruction where the processor reads words at any address
  std::uint32_t value = 0;
  std::memcpy(&value, p, sizeof value);
  return value;
#else
  return (static_cast<std::uint32_t>(p[0]) << 24U) | (static_cast<std::uint32_t>(p[1]) << 16U) |
         (static_cast<std::uint32_t>(p[2]) << 8U) | p[3];
#endif
}
inline std::uint64_t get_u64(const std::uint8_t* p) {
  return (static_cast<std::uint64_t>(get_u32(p)) << 32U) | get_u32(p + 4);
}
inline double get_f64(const std::uint8_t* p) {
  const std::uint64_t bits = get_u64(p);
  double value = 0.0;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}
inline float get_f32(const std::uint8_t* p) {
  const std::uint32_t bits = get_u32(p);
  float value = 0.0F;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

inline void put_u16(std::uint8_t* p, std::uint16_t v) {
  p[0] = static_cast<std::uint8_t>(v >> 8U);
  p[1] = static_cast<std::uint8_t>(v);
}
inline void put_u32(std::uint8_t* p, std::uint32_t v) {
  put_u16(p, static_cast<std::uint16_t>(v >> 16U));
  put_u16(p + 2, static_cast<std::uint16_t>(v));
}
inline void put_u64(std::uint8_t* p, std::uint64_t v) {
  put_u32(p, static_cast<std::uint32_t>(v >> 32U));
  put_u32(p + 4, static_cast<std::uint32_t>(v));
}
inline void put_f64(std::uint8_t* p, double v) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &v, sizeof bits);
  put_u64(p, bits);
}
inline void put_f32(std::uint8_t* p, float v) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &v, sizeof bits);
  put_u32(p, bits);
}

}  // namespace cairn::be
