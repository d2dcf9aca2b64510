// cairn mask: the rover's own hardware, from a picture to the mission's table.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "base/output_file.hpp"
#include "commands/commands.hpp"
#include "dataset/hardware_mask.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

struct MaskOptions {
  fs::path picture;
  fs::path output;
};

void run(const MaskOptions& options) {
  const HardwareMask mask = read_hardware_mask(options.picture);
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
      .add_option("-o,--output", options->output,
                  "own_hardware.hpp in the mission's folder of mission_cfg; without it the cells are shown")
      .written();
  command.on_run([options] { run(*options); });
}

}  // namespace cairn::ground
