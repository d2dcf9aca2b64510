#include "dataset/hardware_mask.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/tool_error.hpp"
#include "dataset/image.hpp"

namespace cairn::ground {
namespace {

Image load_drawing(const std::filesystem::path& path) {
  try {
    return load_grey(path);
  } catch (const ImageError& error) {
    throw ToolError("{}; give a picture, white where the rover is", error.what());
  }
}

HardwareMask mask_of(const std::filesystem::path& path, const Image& image) {
  constexpr std::uint8_t kHalf = 128;
  HardwareMask mask;
  mask.width_px = image.width;
  mask.height_px = image.height;
  const ImageU8 view = image.view();
  for (int v = 0; v < view.height; ++v) {
    for (int u = 0; u < view.width; ++u) {
      if (view.row(v)[u] >= kHalf) mask.own.cover({u, v, u + 1, v + 1});
    }
  }
  const int columns = (image.width + OwnHardware::kCell_px - 1) / OwnHardware::kCell_px;
  const int rows = (image.height + OwnHardware::kCell_px - 1) / OwnHardware::kCell_px;
  int covered = 0;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) covered += mask.own.covers_cell(column, row) ? 1 : 0;
  }
  mask.covered = static_cast<double>(covered) / (columns * rows);
  if (covered == 0)
    throw ToolError("{}: is black throughout; draw the rover in white, or leave the mask out", path.string());
  if (covered == columns * rows)
    throw ToolError("{}: is white throughout, so that no ground is left; draw the rover alone in white",
                    path.string());
  return mask;
}

}  // namespace

HardwareMask read_hardware_mask(const std::filesystem::path& path) {
  const Image image = load_drawing(path);
  if (image.width > cfg::kImageWidth || image.height > cfg::kImageHeight)
    throw ToolError(
        "{}: {} x {} pixels are more than the {} x {} of mission '{}'; build with another MISSION",
        path.string(), image.width, image.height, cfg::kImageWidth, cfg::kImageHeight, cfg::kMission.name);
  return mask_of(path, image);
}

HardwareMask read_hardware_mask(const std::filesystem::path& path, const CameraModel& raw_left,
                                const RemapTable& rectified) {
  const Image image = load_drawing(path);
  if (image.width != raw_left.width_px || image.height != raw_left.height_px)
    throw ToolError("{}: has {} x {} pixels, the raw left images {} x {}; draw it on one of these",
                    path.string(), image.width, image.height, raw_left.width_px, raw_left.height_px);
  return mask_of(path, remapped(rectified, image));
}

std::vector<PixelBox> boxes_of(const OwnHardware& own) {
  constexpr int kCell = OwnHardware::kCell_px;
  std::vector<PixelBox> boxes;
  for (int row = 0; row < OwnHardware::kRows; ++row) {
    for (int column = 0; column < OwnHardware::kColumns; ++column) {
      if (!own.covers_cell(column, row)) continue;
      const int first = column;
      while (column < OwnHardware::kColumns && own.covers_cell(column, row)) ++column;
      const PixelBox run{first * kCell, row * kCell, column * kCell, (row + 1) * kCell};
      const auto above = std::find_if(boxes.begin(), boxes.end(), [&](const PixelBox& b) {
        return b.v1 == run.v0 && b.u0 == run.u0 && b.u1 == run.u1;
      });
      if (above == boxes.end()) {
        boxes.push_back(run);
      } else {
        above->v1 = run.v1;
      }
    }
  }
  return boxes;
}

std::string hardware_header(const HardwareMask& mask, const std::string& picture) {
  std::string text = fmt::format(
      "/// The rover itself in the left picture, by `cairn mask {}`: {:.0f} % of {} x {} pixels. To be named in\n"
      "/// mission_values.hpp: own_hardware = kOwnHardware, own_hardware_boxes = kOwnHardwareBoxes.\n"
      "#pragma once\n\n#include \"mission.hpp\"\n\nnamespace cairn::cfg {{\n\n"
      "inline constexpr PixelBox kOwnHardware[] = {{\n",
      picture, 100.0 * mask.covered, mask.width_px, mask.height_px);
  for (const PixelBox& b : boxes_of(mask.own))
    text += fmt::format("    {{{}, {}, {}, {}}},\n", b.u0, b.v0, b.u1, b.v1);
  text +=
      "};\ninline constexpr int kOwnHardwareBoxes = sizeof(kOwnHardware) / sizeof(kOwnHardware[0]);\n\n"
      "}  // namespace cairn::cfg\n";
  return text;
}

}  // namespace cairn::ground
