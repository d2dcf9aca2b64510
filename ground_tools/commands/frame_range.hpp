/// Parts of a drive on the command line.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace cairn::ground {

struct FrameRange {
  std::size_t first = 0;
  std::size_t end = SIZE_MAX;  ///< one past the last
};

/// FIRST:END, counted from 0; either may be left out. Throws ToolError that names --frames.
FrameRange parse_frames(const std::string& text);

}  // namespace cairn::ground
