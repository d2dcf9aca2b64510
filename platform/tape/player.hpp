/// Plays the tape that is linked into the image (tape_image.S) through the flight module,
/// and sums up its telemetry.
#pragma once

#include <cstdint>

#include "app/telemetry.hpp"
#include "platform/tape/tape_hal.hpp"
#include "schedule.hpp"

namespace cairn::tape {

/// CRC-32 over the packets of each kind, as they were sent. No time of the machine is in them, so that they
/// are the same on every target.
struct Telemetry {
  std::uint32_t poses = 0;  ///< frame packets
  std::uint32_t fixes = 0;
  std::uint32_t boulders = 0;
  std::uint32_t rest = 0;  ///< acknowledgements, health
  int frames = 0;
  int applied = 0;                                      ///< fixes
  int bad = 0;                                          ///< packets that do not decode
  void (*on_frame)(const app::FrameReport&) = nullptr;  ///< told of each frame; play() leaves it
};

/// Initialises app::root with the rig of the tape and plays `frames` pairs, or all where there are fewer.
/// `slice_ops`: of each cycle.
TapeStatus play(int frames, Telemetry& telemetry, std::uint32_t slice_ops = cfg::kSliceOps);

}  // namespace cairn::tape
