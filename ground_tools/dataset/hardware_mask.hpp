/// The rover itself in the left picture, as a picture that people draw: white where it is, black elsewhere,
/// of the size of the rectified left images.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "geometry/own_hardware.hpp"

namespace cairn::ground {

struct HardwareMask {
  int width_px = 0;
  int height_px = 0;
  OwnHardware own;       ///< cells with any pixel that is half grey or lighter
  double covered = 0.0;  ///< share of the picture's cells
};

/// Any image that load_grey reads. Throws ToolError: cannot be read, larger than this build's images, covers
/// nothing or everything.
HardwareMask read_hardware_mask(const std::filesystem::path& path);

/// The fewest boxes that are easily found: runs of cells that go on from row to row are one. Of these
/// `OwnHardware::of` makes the same cells again.
std::vector<PixelBox> boxes_of(const OwnHardware& own);

/// A header for mission_cfg/<mission>, that its mission_values.hpp includes: the boxes as kOwnHardware.
std::string hardware_header(const HardwareMask& mask, const std::string& picture);

}  // namespace cairn::ground
