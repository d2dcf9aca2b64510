/// Telecommands: their content and coding, which the ground tools share. Framing as in app/telemetry.hpp;
/// doc/ICD.md.
#pragma once

#include <cstddef>
#include <cstdint>

#include "app/telemetry.hpp"
#include "geometry/pose3.hpp"

namespace cairn::app {

enum class CommandType : std::uint8_t {
  kSetStart = 1,     ///< T_map_rover (pose), sigma_xy_m f64, sigma_yaw_rad f64: a new site begins here
  kSetTrim = 2,      ///< scale f64, yaw_rad_per_m f64 (localizer StepTrim)
  kMotionPrior = 3,  ///< T_prev_cur of the left camera (pose), for the next pair only
  kLoadMap = 4,      ///< no body: validate the map bank and use it
};

struct Command {
  CommandType type = CommandType::kLoadMap;
  std::uint32_t sequence = 0;
  Pose3 pose;             ///< kSetStart, kMotionPrior; taken as it comes: who uses it judges it
  double number[2] = {};  ///< kSetStart: sigmas; kSetTrim: scale, yaw
};

enum class [[nodiscard]] CommandStatus : std::uint8_t{
    kAccepted,
    kBadPacket,  ///< size, version or CRC
    kUnknownType,
    kRefused,  ///< well formed, but its content was not accepted; the detail tells by whom
};

void encode(const Command& command, Packet& out);
CommandStatus decode(const std::uint8_t* bytes, std::size_t size, Command& out);

}  // namespace cairn::app
