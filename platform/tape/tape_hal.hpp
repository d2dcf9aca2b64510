/// The HAL of a tape (tape_format.hpp): camera, telecommands and map bank play it, telemetry goes to a sink.
/// One tape a program.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/nodiscard.hpp"
#include "geometry/stereo_rig.hpp"

namespace cairn::tape {

enum class CAIRN_NODISCARD TapeStatus : std::uint8_t {
  kReady,
  kNoTape,     ///< no header of a tape
  kVersion,    ///< of another version
  kTruncated,  ///< a record reaches beyond the end, or there is no end
  kNoRig,      ///< the first record is no rig, or another one is
  kBadRecord,  ///< a type that is not known; a rig or pair whose body has not the size that it must have
};

/// Checks the structure of all records and goes to the beginning. `rig` gets the intrinsics; its mounting is
/// the mission's. The bytes are borrowed.
TapeStatus open(const std::uint8_t* bytes, std::size_t size, StereoRig& rig);

/// Gets every telemetry packet, as it is sent. Null: every packet is lost.
void on_telemetry(void (*sink)(const std::uint8_t* packet, std::size_t size));

/// All records have been taken.
bool at_end();

}  // namespace cairn::tape
