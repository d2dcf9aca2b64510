/// A tape: a drive for targets without a file system, in one piece of memory. `cairn tape` makes it.
///
/// Big-endian. Header: magic "CTAP", version u32 (1). Then records to the end: type u32, size u32 of the
/// body, body, zeros to the next multiple of four. The first record is kRig, the last kEnd. What the flight
/// module takes from its HAL comes in the order of the tape, and nothing is skipped.
#pragma once

#include <cstdint>

namespace cairn::tape {

inline constexpr std::uint32_t kMagic = 0x43544150U;  // "CTAP"
inline constexpr std::uint32_t kVersion = 1;
inline constexpr std::uint32_t kHeaderBytes = 8;
inline constexpr std::uint32_t kRecordHeaderBytes = 8;

enum class Record : std::uint32_t {
  kEnd = 0,
  /// width u32, height u32, fx, fy, cx, cy, baseline f64 (pixels; metres)
  kRig = 1,
  /// a telecommand packet as in doc/ICD.md
  kTelecommand = 2,
  /// content of the map bank from here on
  kMapBank = 3,
  /// number u32, t_capture_us u64, then width u32, height u32 of left and of right,
  /// pixels of left and of right
  kPair = 4,
};

inline constexpr std::uint32_t kRigBytes = 48;
inline constexpr std::uint32_t kPairHeaderBytes = 28;
inline constexpr std::uint32_t kMaxExtent = 0xFFFF;  ///< width and height of an image

}  // namespace cairn::tape
