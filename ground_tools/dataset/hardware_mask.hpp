/// The rover itself in the left picture, as a picture that people draw: white where it is, black elsewhere,
/// on one of the left images as they are: of a raw rig it is rectified with them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "dataset/rectify.hpp"
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
/// The same drawn on a raw left image: of cells in the rectified one. Another size than the
/// camera's is refused.
HardwareMask read_hardware_mask(const std::filesystem::path& path, const CameraModel& raw_left,
                                const RemapTable& rectified);

/// The fewest boxes that are easily found: runs of cells that go on from row to row are one. Of these
/// `OwnHardware::of` makes the same cells again.
std::vector<PixelBox> boxes_of(const OwnHardware& own);

/// A header for mission_cfg/<mission>, that its mission_values.hpp includes: the boxes as kOwnHardware.
std::string hardware_header(const HardwareMask& mask, const std::string& picture);

}  // namespace cairn::ground
