// SPDX-License-Identifier: Apache-2.0
/// Telemetry down, telecommands up: whole packets as in doc/ICD.md. The transport below is the platform's.
#pragma once

#include <cstddef>
#include <cstdint>

namespace cairn::hal {

/// Hands over one packet. False: no room; the app counts it as lost.
[[nodiscard]] bool telemetry_send(const std::uint8_t* packet, std::size_t size);

/// Takes the next telecommand into `out`; its size, or 0 where there is none. One larger than
/// `capacity` is cut.
std::size_t telecommand_receive(std::uint8_t* out, std::size_t capacity);

}  // namespace cairn::hal
