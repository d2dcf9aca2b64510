// cairn mask: the rover's own hardware, from a picture to the mission's table.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "base/output_file.hpp"
#include "base/tool_error.hpp"
#include "commands/commands.hpp"
#include "dataset/hardware_mask.hpp"
#include "dataset/rig_file.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

struct MaskOptions {
  fs::path picture;
  std::vector<fs::path> calibration;
  bool raw = false;
  fs::path output;
};

/// In the pictures that flight code sees: rectified where the calibration is one of raw images.
HardwareMask mask_of(const MaskOptions& options) {
  if (options.calibration.empty()) return read_hardware_mask(options.picture);
  RigQuestion question;
  question.raw_alone = options.raw;
  question.images = options.raw ? ImagesAre::kRaw : ImagesAre::kRectified;
  CameraPair pair = read_rig(options.calibration, question);
  if (why_not_rectified(pair).empty()) return read_hardware_mask(options.picture);
  const std::string file = options.calibration[0].string();
  if (pair.left.width_px == 0) throw ToolError("{}: tells no size of images; add it", file);
  Rectification made;
  if (const std::string fault = rectify(pair, made); !fault.empty())
    throw ToolError("{}: these cannot be rectified: {}", file, fault);
  return read_hardware_mask(options.picture, pair.left, made.left);
}

void run(const MaskOptions& options) {
  const HardwareMask mask = mask_of(options);
  if (mask.width_px < cfg::kImageWidth || mask.height_px < cfg::kImageHeight) {
    fmt::print(
        stderr,
        "cairn: warning: {}: {} x {} pixels are fewer than the {} x {} of mission '{}'; right only for "
        "a camera of that size\n",
        options.picture.string(), mask.width_px, mask.height_px, cfg::kImageWidth, cfg::kImageHeight,
        cfg::kMission.name);
  }
  const int columns = (mask.width_px + OwnHardware::kCell_px - 1) / OwnHardware::kCell_px;
  const int rows = (mask.height_px + OwnHardware::kCell_px - 1) / OwnHardware::kCell_px;
  for (int row = 0; row < rows; ++row) {
    std::string line;
    for (int column = 0; column < columns; ++column) line += mask.own.covers_cell(column, row) ? '#' : '.';
    fmt::print("{}\n", line);
  }
  fmt::print("{:.0f} % of {} x {} pixels are the rover; whole cells of {} x {}\n", 100.0 * mask.covered,
             mask.width_px, mask.height_px, OwnHardware::kCell_px, OwnHardware::kCell_px);
  if (options.output.empty()) return;
  OutputFile file(options.output);
  file.write(hardware_header(mask, options.picture.filename().string()));
  file.commit();
  fmt::print("written: {}\n", options.output.string());
}

}  // namespace

void add_mask_command(Command app) {
  const auto options = std::make_shared<MaskOptions>();
  Command command = app.add_command(
      "mask",
      "The rover itself in its pictures: from a drawing to the mission's table, which flight code takes");
  command.add_option("PICTURE", options->picture, "of the left camera's size, white where the rover is")
      .required();
  command
      .add_option("--calibration", options->calibration,
                  "of raw cameras, one file or two: the drawing is on a raw image, and rectified with it")
      .values(1, 2);
  command.add_flag("--raw", options->raw,
                   "images are raw, where the calibration tells of rectified ones, too");
  command
      .add_option("-o,--output", options->output,
                  "own_hardware.hpp in the mission's folder of mission_cfg; without it the cells are shown")
      .written();
  command.on_run([options] { run(*options); });
}

}  // namespace cairn::ground
