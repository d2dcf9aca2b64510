/// Telecommands: their content and coding, which the ground tools share. Framing: app/packet.hpp; every byte:
/// doc/ICD.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "app/packet.hpp"
#include "core/enum_count.hpp"
#include "core/nodiscard.hpp"
#include "geometry/pose3.hpp"
#include "orbital_map/map_transfer.hpp"

namespace cairn::app {

enum class CommandType : std::uint8_t {
  kSetStart = 1,      ///< T_map_rover (pose), sigma_xy_m f64, sigma_yaw_rad f64: a new site begins here
  kSetTrim = 2,       ///< scale f64, yaw_rad_per_m f64 (localizer StepTrim)
  kMotionPrior = 3,   ///< pair u32, T_prev_cur of the left camera (pose): for the pair of this number only
  kLoadMap = 4,       ///< no body: validate the map bank and use it
  kBeginUpload = 5,   ///< kind u8, id u32, bytes u32, chunk_bytes u16: chunks of a map or a delta follow
  kMapChunk = 6,      ///< one chunk (orbital_map/map_transfer.hpp), 11 bytes or more
  kUseUpload = 7,     ///< id u32: switch to the map that was uploaded and verified
  kReportUpload = 8,  ///< no body: send an upload report
  kAttitude = 9,      ///< pair u32, up f64 x 3, sigma f64, yaw f64, sigma f64: measured where it was taken
};
inline constexpr std::size_t kCommandTypeCount = 9;  ///< from 1

/// What accelerometers and a sun sensor say of the rover; a part whose sigma is 0 was not measured.
struct MeasuredAttitude {
  std::array<double, 3> up_rover{};  ///< away from gravity, unit length, while the rover stood
  double sigma_tilt_rad = 0.0;       ///< of it, about any horizontal axis
  double yaw_rad = 0.0;              ///< of the rover in `map`
  double sigma_yaw_rad = 0.0;
};

struct Command {
  CommandType type = CommandType::kLoadMap;
  std::uint32_t sequence = 0;
  std::uint32_t crc = 0;           ///< of its packet, as decode() found it: tells contents apart
  std::uint32_t pair = 0;          ///< kMotionPrior: of the stereo pair at the end of the motion; kAttitude
  Pose3 pose;                      ///< kSetStart, kMotionPrior; as it came (app/command_content.hpp)
  std::array<double, 2> number{};  ///< kSetStart: sigmas; kSetTrim: scale, yaw
  MeasuredAttitude attitude;       ///< kAttitude
  UploadPlan upload;               ///< kBeginUpload; kUseUpload: its id
  const std::uint8_t* chunk = nullptr;  ///< kMapChunk: inside the packet, which decode() borrows
  std::size_t chunk_bytes = 0;
};

enum class CAIRN_NODISCARD CommandStatus : std::uint8_t {
  kAccepted,
  kBadPacket,  ///< size, version or CRC
  kUnknownType,
  kRefused,      ///< well formed, but its content was not accepted; the detail tells why
  kRepeated,     ///< the newest of its type, once more: accepted before, the detail is that of then
  kStale,        ///< older than the newest of its type that was accepted, or of a stereo pair that is gone
  kContradicts,  ///< the number of the newest of its type, with other content
};
inline constexpr std::size_t kCommandStatusCount = 7;
static_assert(enum_has<CommandStatus, kCommandStatusCount>());

/// The largest chunk that fits a packet, and the data in it.
inline constexpr std::size_t kMaxChunkBytes = kMaxPacketBytes - kPacketHeaderBytes - kPacketCrcBytes;
inline constexpr std::size_t kMaxChunkDataBytes = kMaxChunkBytes - chunk::kOverheadBytes;

void encode(const Command& command, Packet& out);
CommandStatus decode(const std::uint8_t* bytes, std::size_t size, Command& out);

}  // namespace cairn::app
