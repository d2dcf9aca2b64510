/// The framing that telemetry and telecommands share (doc/ICD.md); their content is app/telemetry.hpp's and
/// app/telecommand.hpp's.
///
/// A packet is big-endian: type u8, version u8 (1), size u16 of the whole packet, sequence u32, body, CRC-32
/// of all before it. Floating point travels as IEEE 754. A pose is t (x, y, z, m) and q
/// (w, x, y, z): seven f64.
///
/// The fields of a body stand in one list, a function that hands each in turn to `field` of whatever it is
/// given: writer, reader or sizer. So the three cannot disagree.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/big_endian.hpp"
#include "core/fixed_vector.hpp"
#include "core/nodiscard.hpp"
#include "geometry/pose3.hpp"

namespace cairn::app {

inline constexpr std::size_t kMaxPacketBytes = 512;
inline constexpr std::size_t kPacketHeaderBytes = 8;
inline constexpr std::size_t kPacketCrcBytes = 4;
inline constexpr std::uint8_t kPacketVersion = 1;
using Packet = FixedVector<std::uint8_t, kMaxPacketBytes>;

struct PacketHead {
  std::uint8_t type = 0;  ///< TelemetryType or CommandType, by the way it travels
  std::uint32_t sequence = 0;
};

enum class CAIRN_NODISCARD PacketStatus : std::uint8_t {
  kGood,
  kTooShort,
  kBadSize,  ///< the size field disagrees with what came, or with the type
  kBadCrc,
  kBadVersion,
  kOtherType,  ///< a good packet, but not of the type asked for
};

/// Checks size, CRC and version, in this order; `head` is that of a good packet, else untouched.
PacketStatus check_packet(const std::uint8_t* bytes, std::size_t size, PacketHead& head);

template <typename Walker, typename Pose>
void pose_fields(Walker& walker, Pose& pose) {
  for (int i = 0; i < 3; ++i) walker.field(pose.t[i]);
  walker.field(pose.q.w());
  walker.field(pose.q.x());
  walker.field(pose.q.y());
  walker.field(pose.q.z());
}

/// Begins `out` anew. Its room is our own affair, so a lack of it asserts.
class PacketWriter {
 public:
  PacketWriter(Packet& out, const PacketHead& head);
  // Not inline, as those of the reader: there are some hundred calls of each.
  void field(std::uint8_t v);
  void field(std::uint16_t v);
  void field(std::uint32_t v);
  void field(std::uint64_t v);
  void field(float v);
  void field(double v);
  void field(const Pose3& pose) { pose_fields(*this, pose); }
  template <typename T, std::size_t N>
  void field(const std::array<T, N>& array) {
    for (const T& item : array) field(item);
  }
  /// Size and CRC: after this the packet is whole.
  void finish();

 private:
  std::uint8_t* grow(std::size_t bytes);

  Packet& out_;
};

/// Reads the fields of a packet that was checked; the caller knows that they are there.
class PacketReader {
 public:
  explicit PacketReader(const std::uint8_t* packet) : next_(packet + kPacketHeaderBytes) {}
  void field(std::uint8_t& v);
  void field(std::uint16_t& v);
  void field(std::uint32_t& v);
  void field(std::uint64_t& v);
  void field(float& v);
  void field(double& v);
  void field(Pose3& pose) { pose_fields(*this, pose); }
  template <typename T, std::size_t N>
  void field(std::array<T, N>& array) {
    for (T& item : array) field(item);
  }

 private:
  const std::uint8_t* take(std::size_t bytes);

  const std::uint8_t* next_;
};

/// Counts what a list of fields takes, so that a packet's size is never written down twice.
class PacketSizer {
 public:
  void field(const Pose3& pose) { pose_fields(*this, pose); }
  template <typename T>
  void field(const T&) {
    bytes_ += sizeof(T);
  }
  std::size_t packet_bytes() const { return bytes_; }

 private:
  std::size_t bytes_ = kPacketHeaderBytes + kPacketCrcBytes;
};

}  // namespace cairn::app
