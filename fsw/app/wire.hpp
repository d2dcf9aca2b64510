/// Big-endian writer and reader of packets, for telemetry and telecommands.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/assert.hpp"
#include "core/big_endian.hpp"
#include "core/crc32.hpp"
#include "geometry/pose3.hpp"

namespace cairn::app {

inline constexpr std::size_t kPacketHeaderBytes = 8;
inline constexpr std::size_t kPacketCrcBytes = 4;
inline constexpr std::uint8_t kPacketVersion = 1;

/// Fields go to a byte vector; its room is our own affair, so a lack of it asserts.
template <typename Bytes>
class Writer {
 public:
  Writer(Bytes& out, std::uint8_t type, std::uint32_t sequence) : out_(out) {
    out_.clear();
    field(type);
    field(kPacketVersion);
    field(std::uint16_t{0});  // size, known at the end
    field(sequence);
  }
  void field(std::uint8_t v) { CAIRN_ASSERT(out_.push_back(v)); }
  void field(std::uint16_t v) {
    field(static_cast<std::uint8_t>(v >> 8U));
    field(static_cast<std::uint8_t>(v));
  }
  void field(std::uint32_t v) {
    field(static_cast<std::uint16_t>(v >> 16U));
    field(static_cast<std::uint16_t>(v));
  }
  void field(std::uint64_t v) {
    field(static_cast<std::uint32_t>(v >> 32U));
    field(static_cast<std::uint32_t>(v));
  }
  void field(float v) {
    std::uint8_t b[4];
    be::put_f32(b, v);
    for (const std::uint8_t byte : b) field(byte);
  }
  void field(double v) {
    std::uint8_t b[8];
    be::put_f64(b, v);
    for (const std::uint8_t byte : b) field(byte);
  }
  void field(const Pose3& p) {
    for (int i = 0; i < 3; ++i) field(p.t[i]);
    field(p.q.w());
    field(p.q.x());
    field(p.q.y());
    field(p.q.z());
  }
  template <typename T, std::size_t N>
  void field(const std::array<T, N>& array) {
    for (const T& item : array) field(item);
  }
  void finish() {
    be::put_u16(&out_[2], static_cast<std::uint16_t>(out_.size() + kPacketCrcBytes));
    field(crc32(out_.data(), out_.size()));
  }

 private:
  Bytes& out_;
};

/// Reads the fields of a packet that was checked; the caller knows that they are there.
class Reader {
 public:
  explicit Reader(const std::uint8_t* packet) : p_(packet + kPacketHeaderBytes) {}
  void field(std::uint8_t& v) { v = *p_++; }
  void field(std::uint16_t& v) {
    v = be::get_u16(p_);
    p_ += 2;
  }
  void field(std::uint32_t& v) {
    v = be::get_u32(p_);
    p_ += 4;
  }
  void field(std::uint64_t& v) {
    v = be::get_u64(p_);
    p_ += 8;
  }
  void field(float& v) {
    v = be::get_f32(p_);
    p_ += 4;
  }
  void field(double& v) {
    v = be::get_f64(p_);
    p_ += 8;
  }
  void field(Pose3& p) {
    for (int i = 0; i < 3; ++i) field(p.t[i]);
    field(p.q.w());
    field(p.q.x());
    field(p.q.y());
    field(p.q.z());
  }
  template <typename T, std::size_t N>
  void field(std::array<T, N>& array) {
    for (T& item : array) field(item);
  }

 private:
  const std::uint8_t* p_;
};

/// Counts what a list of fields takes, so that a packet's size is never written down twice.
class Sizer {
 public:
  void field(const Pose3&) { bytes_ += 7 * sizeof(double); }
  template <typename T>
  void field(const T&) {
    bytes_ += sizeof(T);
  }
  std::size_t packet_bytes() const { return kPacketHeaderBytes + bytes_ + kPacketCrcBytes; }

 private:
  std::size_t bytes_ = 0;
};

}  // namespace cairn::app
