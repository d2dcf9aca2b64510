/// A packet written by hand from doc/ICD.md, field after field, apart from the flight code's coding.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>

#include "core/big_endian.hpp"
#include "core/crc32.hpp"
#include "geometry/pose3.hpp"

namespace cairn::test {

class PacketBytes {
 public:
  PacketBytes() = default;
  PacketBytes(std::uint8_t type, std::uint32_t sequence) {
    u8(type);
    u8(1);
    u16(0);
    u32(sequence);
  }
  void u8(unsigned v) { bytes_[size_++] = static_cast<std::uint8_t>(v); }
  void u16(unsigned v) {
    u8(v >> 8U & 0xFFU);
    u8(v & 0xFFU);
  }
  void u32(std::uint32_t v) {
    u16(v >> 16U);
    u16(v & 0xFFFFU);
  }
  void u64(std::uint64_t v) {
    u32(static_cast<std::uint32_t>(v >> 32U));
    u32(static_cast<std::uint32_t>(v));
  }
  void f32(float v) {
    be::put_f32(bytes_ + size_, v);
    size_ += 4;
  }
  void f64(double v) {
    be::put_f64(bytes_ + size_, v);
    size_ += 8;
  }
  void pose(const Pose3& p) {
    for (const double v : {p.t.x(), p.t.y(), p.t.z(), p.q.w(), p.q.x(), p.q.y(), p.q.z()}) f64(v);
  }
  /// Size and CRC, as after a change that was meant. `size` is that of the packet with its CRC.
  void seal(std::size_t size) {
    size_ = size;
    be::put_u16(bytes_ + 2, static_cast<std::uint16_t>(size));
    be::put_u32(bytes_ + size - 4, crc32(bytes_, size - 4));
  }
  void finish() { seal(size_ + 4); }

  std::uint8_t* data() { return bytes_; }
  const std::uint8_t* data() const { return bytes_; }
  std::size_t size() const { return size_; }

 private:
  std::size_t size_ = 0;
  std::uint8_t bytes_[600] = {};
};

}  // namespace cairn::test
