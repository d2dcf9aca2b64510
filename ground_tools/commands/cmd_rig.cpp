// cairn rig: what a calibration says, and whether the flight module can take its images.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/output_file.hpp"
#include "base/tool_error.hpp"
#include "commands/commands.hpp"
#include "core/trig.hpp"
#include "dataset/rectify.hpp"
#include "dataset/rig_file.hpp"
#include "report/rig_picture.hpp"
#include "schedule.hpp"

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
  fs::path svg;
  fs::path table;
};

/// What the rig says beside its cameras.
struct RigFacts {
  Vec3 turn_deg = Vec3(0.0, 0.0, 0.0);  ///< of the right camera against the left one, about x, y, z
  Vec3 along = Vec3(1.0, 0.0, 0.0);  ///< from the left camera to the right one, of length 1, in the left one
  std::string why_not_rectified;     ///< empty: rectified
  std::string why_no_table;          ///< of a raw pair
  std::unique_ptr<Rectification> made;  ///< null: none, or none is needed
  SourceArea area;
  std::vector<std::string> warnings;
};

std::size_t table_bytes(const Rectification& made) {
  const int nodes = remap::nodes_along(made.left.width_px, remap::kSpacing) *
                    remap::nodes_along(made.left.height_px, remap::kSpacing);
  return 2 * sizeof(RemapNode) * static_cast<std::size_t>(nodes);
}

int pair_operations(const Rectification& made) { return 2 * 4 * made.left.width_px * made.left.height_px; }

std::vector<std::string> warnings_of(const CameraPair& pair, const RigFacts& facts) {
  std::vector<std::string> out;
  if (const std::string doubt = doubt_of(pair); !doubt.empty()) out.push_back(doubt);
  constexpr double kTurned_deg = 5.0, kAside = 0.1, kZoomed = 1.25, kArea = 0.9;
  if (facts.turn_deg.norm() > kTurned_deg)
    out.push_back(
        fmt::format("the cameras are turned by {:.1f} degrees against each other: what both see is less",
                    facts.turn_deg.norm()));
  if (std::hypot(facts.along.y(), facts.along.z()) > kAside)
    out.push_back(
        "the right camera is not beside the left one: the images are turned to the baseline; is the "
        "order of the cameras right?");
  if (facts.made && facts.made->zoom > kZoomed)
    out.push_back(
        fmt::format("focal lengths are raised by {:.2f}, so that the images are filled: the field of view "
                    "is narrower",
                    facts.made->zoom));
  if (facts.made && facts.area.both < kArea)
    out.push_back(fmt::format("{:.0f} % of the rectified images have no source in one of the cameras",
                              100.0 * (1.0 - facts.area.both)));
  if (pair.left.width_px > cfg::kImageWidth || pair.left.height_px > cfg::kImageHeight)
    out.push_back(fmt::format("images are larger than this mission's ({} x {}): the middle is taken",
                              cfg::kImageWidth, cfg::kImageHeight));
  return out;
}

RigFacts facts_of(const CameraPair& pair) {
  RigFacts facts;
  const Quat q_left_right = pair.T_right_left.q.conjugate();
  const Vec3 none(0.0, 0.0, 0.0);  // minus which, and plus, no zero is negative
  facts.turn_deg = quat_log(q_left_right) * kDegPerRad + none;
  facts.along = none - (q_left_right * pair.T_right_left.t).normalized();
  facts.why_not_rectified = why_not_rectified(pair);
  if (pair.left.width_px <= 0 || pair.right.width_px <= 0) {
    facts.why_no_table = "the calibration tells no size; cairn run takes the images'";
  } else if (!facts.why_not_rectified.empty()) {
    auto made = std::make_unique<Rectification>();
    facts.why_no_table = rectify(pair, *made);
    if (facts.why_no_table.empty()) {
      facts.area = source_area(pair, *made);
      facts.made = std::move(made);
    }
  }
  facts.warnings = warnings_of(pair, facts);
  return facts;
}

ordered_json json_of(const Rectification& made, const SourceArea& area) {
  const CameraModel& c = made.pair.left;
  return {{"fx_px", c.fx_px},
          {"fy_px", c.fy_px},
          {"cx_px", c.cx_px},
          {"cy_px", c.cy_px},
          {"size_px", {c.width_px, c.height_px}},
          {"zoom", made.zoom},
          {"table_bytes", table_bytes(made)},
          {"operations_per_pair", pair_operations(made)},
          {"source_share", {{"left", area.left}, {"right", area.right}, {"both", area.both}}}};
}

void print_rectification(const Rectification& made, const SourceArea& area) {
  const CameraModel& c = made.pair.left;
  fmt::print("made of it focal lengths {:.3f}, {:.3f} px; centre {:.3f}, {:.3f} px; {} x {} px", c.fx_px,
             c.fy_px, c.cx_px, c.cy_px, c.width_px, c.height_px);
  if (const std::optional<Vec2> view = fields_of_view(c))
    fmt::print(", {:.1f} x {:.1f} degrees", view->x() * kDegPerRad, view->y() * kDegPerRad);
  fmt::print("\n");
  fmt::print(
      "area      {:.1f} % of the left image, {:.1f} % of the right one have a source; {:.1f} % in both\n",
      100.0 * area.left, 100.0 * area.right, 100.0 * area.both);
  const int operations = pair_operations(made);
  fmt::print("table     {} bytes for both cameras; {} operations a pair, {:.1f} % of odometry's budget\n",
             table_bytes(made), operations, 100.0 * operations / static_cast<double>(cfg::kVoOps));
}

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
  options.question.raw_alone = options.raw;
  options.question.images = options.raw ? ImagesAre::kRaw : ImagesAre::kRectified;
  const CameraPair pair = read_rig(options.files, options.question);
  const RigFacts facts = facts_of(pair);
  const std::string& why_not = facts.why_not_rectified;
  if (!facts.made && !(options.svg.empty() && options.table.empty()))
    throw ToolError(why_not.empty()
                        ? "the pair is rectified as it is; there is nothing to draw, and no table is needed"
                        : fmt::format("no table: {}", facts.why_no_table));
  if (!options.svg.empty()) write_file(options.svg, rig_picture(pair, *facts.made));
  if (!options.table.empty())
    write_file(options.table,
               rectification_header(pair, *facts.made, options.files.front().filename().string()));
  if (options.json) {
    ordered_json json = {{"format", pair.format},
                         {"left", json_of(pair.left)},
                         {"right", json_of(pair.right)},
                         {"baseline_m", baseline_m(pair)},
                         {"baseline_direction", {facts.along.x(), facts.along.y(), facts.along.z()}},
                         {"right_turned_deg", {facts.turn_deg.x(), facts.turn_deg.y(), facts.turn_deg.z()}},
                         {"rectified", why_not.empty()},
                         {"why_not_rectified", why_not},
                         {"notes", pair.notes},
                         {"warnings", facts.warnings}};
    if (facts.made) json["rectification"] = json_of(*facts.made, facts.area);
    fmt::print("{}\n", json.dump(2));
  } else {
    fmt::print("format    {}\n", pair.format);
    print_camera("left", pair.left);
    print_camera("right", pair.right);
    fmt::print("baseline  {:.4f} m, along {:.4f} {:.4f} {:.4f} of the left camera (right, down, forward)\n",
               baseline_m(pair), facts.along.x(), facts.along.y(), facts.along.z());
    fmt::print("turned    the right camera by {:.3f}, {:.3f}, {:.3f} degrees about these axes\n",
               facts.turn_deg.x(), facts.turn_deg.y(), facts.turn_deg.z());
    for (const std::string& note : pair.notes) fmt::print("note      {}\n", note);
    if (why_not.empty()) {
      const StereoRig rig = rectified_rig(pair);
      fmt::print(
          "rectified, as far as a calibration can tell; as calib.txt: {:.6f} {:.6f} {:.6f} {:.6f} {:.6f}\n",
          rig.fx_px, rig.fy_px, rig.cx_px, rig.cy_px, rig.baseline_m);
    } else {
      fmt::print("not rectified: {}; cairn run rectifies them\n", why_not);
      if (facts.made) print_rectification(*facts.made, facts.area);
      if (!facts.why_no_table.empty()) fmt::print("no table: {}\n", facts.why_no_table);
    }
    for (const std::string& warning : facts.warnings) fmt::print("warning: {}\n", warning);
  }
  if (!why_not.empty()) throw Answer{kNotAsTheyAre};
}

}  // namespace

void add_rig_command(Command app) {
  const auto options = std::make_shared<RigOptions>();
  Command command = app.add_command(
      "rig",
      "What a stereo calibration says: cameras, lenses, baseline, and whether its images can be flown");
  command
      .add_option("FILE", options->files,
                  "calibration: one file of both cameras, or left then right (kinds: doc/guide/drives.md)")
      .required()
      .values(1, 2);
  command.add_flag("--raw", options->raw, "of the raw images, where the files tell of rectified ones, too");
  command.add_flag("--colour", options->question.colour, "KITTI: cameras 2 and 3 in place of 0 and 1");
  command.add_flag("--json", options->json, "print JSON");
  command
      .add_option("--table", options->table,
                  "write the tables as a header for the flight module (doc/guide/integration.md)")
      .written();
  command.add_option("--svg", options->svg, "draw what of the rectified images has a source").written();
  command.on_run([options] { run(*options); });
}

}  // namespace cairn::ground
