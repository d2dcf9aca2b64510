// cairn rig: what a calibration says, and whether the flight module can take its images.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands/commands.hpp"
#include "core/trig.hpp"
#include "dataset/rig_file.hpp"

namespace cairn::ground {
namespace {

using nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr int kNotAsTheyAre = 3;  ///< exit status: understood, and to be rectified

struct RigOptions {
  std::vector<fs::path> files;
  RigQuestion question;
  bool raw = false;
  bool json = false;
};

ordered_json json_of(const CameraModel& c) {
  ordered_json json = {{"fx_px", c.fx_px}, {"fy_px", c.fy_px},     {"cx_px", c.cx_px},
                       {"cy_px", c.cy_px}, {"skew_px", c.skew_px}, {"lens", lens_name(c.lens)}};
  if (c.lens != Lens::kNone) json["coefficients"] = c.k;
  if (c.width_px > 0) json["size_px"] = {c.width_px, c.height_px};
  if (const std::optional<Vec2> view = fields_of_view(c))
    json["field_of_view_deg"] = {view->x() * kDegPerRad, view->y() * kDegPerRad};
  return json;
}

void print_camera(const char* name, const CameraModel& c) {
  fmt::print("{:<9} focal lengths {:.3f}, {:.3f} px; centre {:.3f}, {:.3f} px; lens {}", name, c.fx_px,
             c.fy_px, c.cx_px, c.cy_px, lens_name(c.lens));
  if (c.width_px > 0) fmt::print("; {} x {} px", c.width_px, c.height_px);
  if (const std::optional<Vec2> view = fields_of_view(c))
    fmt::print(", {:.1f} x {:.1f} degrees", view->x() * kDegPerRad, view->y() * kDegPerRad);
  fmt::print("\n");
}

void run(RigOptions options) {
  options.question.images = options.raw ? ImagesAre::kRaw : ImagesAre::kRectified;
  const CameraPair pair = read_rig(options.files, options.question);
  const std::string why_not = why_not_rectified(pair);
  if (options.json) {
    fmt::print("{}\n", ordered_json{{"format", pair.format},
                                    {"left", json_of(pair.left)},
                                    {"right", json_of(pair.right)},
                                    {"baseline_m", baseline_m(pair)},
                                    {"rectified", why_not.empty()},
                                    {"why_not_rectified", why_not},
                                    {"notes", pair.notes}}
                           .dump(2));
  } else {
    fmt::print("format    {}\n", pair.format);
    print_camera("left", pair.left);
    print_camera("right", pair.right);
    fmt::print("baseline  {:.4f} m\n", baseline_m(pair));
    for (const std::string& note : pair.notes) fmt::print("note      {}\n", note);
    if (why_not.empty()) {
      const StereoRig rig = rectified_rig(pair);
      fmt::print(
          "rectified, as far as a calibration can tell; as calib.txt: {:.6f} {:.6f} {:.6f} {:.6f} {:.6f}\n",
          rig.fx_px, rig.fy_px, rig.cx_px, rig.cy_px, rig.baseline_m);
    } else {
      fmt::print("not rectified: {}; cairn run rectifies them\n", why_not);
    }
  }
  if (!why_not.empty()) throw CLI::RuntimeError(kNotAsTheyAre);
}

}  // namespace

void add_rig_command(CLI::App& app) {
  const auto options = std::make_shared<RigOptions>();
  CLI::App* command = app.add_subcommand(
      "rig",
      "What a stereo calibration says: cameras, lenses, baseline, and whether its images can be flown");
  command
      ->add_option("FILE", options->files,
                   "calibration: one file of both cameras, or left then right (kinds: doc/guide/drives.md)")
      ->required()
      ->expected(1, 2);
  command->add_flag("--raw", options->raw, "of the raw images, where the files tell of rectified ones, too");
  command->add_flag("--colour", options->question.colour, "KITTI: cameras 2 and 3 in place of 0 and 1");
  command->add_flag("--json", options->json, "print JSON");
  command->callback([options] { run(*options); });
}

}  // namespace cairn::ground
