// SPDX-License-Identifier: Apache-2.0
/// Stereo camera, as flight software sees it: rectified pairs of 8-bit grey images, or raw
/// ones where the app was given tables for them (app/pair_rectifier.hpp). Implemented by platform/<target>.
#pragma once

#include <cstddef>
#include <cstdint>

namespace cairn::hal {

/// Where the app wants the images: packed rows, `capacity` bytes for each side; 0 to let a pair go.
struct StereoBuffer {
  std::uint8_t* left;
  std::uint8_t* right;
  std::size_t capacity;
};

/// What came. A side that is missing, or larger than the buffer and so not copied, has width 0.
struct StereoInfo {
  std::uint32_t number = 0;  ///< of the pair, rising; gaps are dropped pairs
  std::uint64_t t_capture_us = 0;
  int left_width = 0;
  int left_height = 0;
  int right_width = 0;
  int right_height = 0;
};

/// Takes the next pair where there is one. False: none yet, or one that is still on its way into the buffer,
/// which is the camera's until a call gives true: where the processor copies, it may do so a piece a call.
[[nodiscard]] bool camera_take(const StereoBuffer& buffer, StereoInfo& info);

}  // namespace cairn::hal
