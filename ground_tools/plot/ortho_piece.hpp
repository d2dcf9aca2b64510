/// A piece of an orthoimage as a small JPEG, for plots.
#pragma once

#include <filesystem>
#include <string>

#include "core/eigen.hpp"

namespace cairn::ground {

/// A rectangle in metres, x east, y north.
struct Box {
  Vec2 low_m = Vec2(0.0, 0.0);
  Vec2 high_m = Vec2(0.0, 0.0);

  Vec2 size_m() const { return high_m - low_m; }
};

struct OrthoPiece {
  Box box;             ///< what it covers: whole pixels, at most a pixel beyond what was asked for
  std::string base64;  ///< a JPEG file; empty where the orthoimage does not reach there
};

/// Reads what the orthoimage shows of `box` (its own projection), averaged down to at most `max_side_px`
/// pixels a side and stretched so that 1 % of the samples are black and 1 % white. Grey or colour, any sample
/// type, no-data white. Throws ToolError where the file cannot be read or is not north-up.
OrthoPiece read_ortho_piece(const std::filesystem::path& path, const Box& box, int max_side_px);

}  // namespace cairn::ground
