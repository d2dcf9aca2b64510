// cairn run: replays a data set through the flight module.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>

#include "app/command_content.hpp"
#include "base/number_table.hpp"
#include "base/output_file.hpp"
#include "base/progress_line.hpp"
#include "base/tool_error.hpp"
#include "cmap/cmap_file.hpp"
#include "commands/commands.hpp"
#include "commands/frame_range.hpp"
#include "commands/number_list.hpp"
#include "dataset/dataset.hpp"
#include "dataset/hardware_mask.hpp"
#include "dataset/pair_check.hpp"
#include "ortho/raster_source.hpp"
#include "ortho/reference_system.hpp"
#include "plot/ortho_piece.hpp"
#include "replay/replay.hpp"
#include "replay/results.hpp"
#include "sim/simulated_drive.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

/// Maps of such pixels and coarser hold large boulders alone: those in a window of frames are too few to
/// prove a fix (doc/RESULTS.md, maps of 5 and 10 cm a pixel).
constexpr double kCoarsePixel_m = 0.035;
constexpr int kStood = 3;  ///< exit status: driven, and nothing moved

struct RunOptions {
  fs::path dataset;
  std::vector<fs::path> calibration;
  bool raw = false;
  fs::path scene;
  std::vector<std::string> sets;
  bool simulate = false;  ///< --scene or --set was given
  fs::path map;
  fs::path output;
  fs::path ortho;
  std::string frames;
  std::string start;
  std::string start_sigma;
  bool lost = false;
  std::string degrade;
  fs::path mask;
  fs::path attitude;
  bool no_map = false;
  bool salvage = false;
  bool paper = false;
  unsigned pictures = 4;
};

/// A finite number that fills the whole text.
double number(std::string_view text, const std::string& option, const std::string& mend) {
  if (const std::optional<double> value = to_finite(text)) return *value;
  throw ToolError("{}: '{}' is not a finite number; {}", option, text, mend);
}

Pose3 parse_start(const std::string& text) {
  const std::vector<double> v = parse_numbers(
      text, 6, "--start", "give x,y,z,roll,pitch,yaw of the rover in the map (metres, degrees)");
  const Attitude attitude{v[5] * kRadPerDeg, v[4] * kRadPerDeg, v[3] * kRadPerDeg};
  return {quat_from_attitude(attitude), Vec3(v[0], v[1], v[2])};
}

/// Standard deviations of the start: metres, degrees.
void parse_start_sigma(const std::string& text, ReplayOptions& out) {
  const std::vector<double> v = parse_numbers(
      text, 2, "--start-sigma", "give XY,YAW: what the start is uncertain by (metres, degrees)");
  check_range("--start-sigma", v[0], app::kStartSigmaXy_m.least, app::kStartSigmaXy_m.most);
  check_range("--start-sigma", v[1], app::kStartSigmaYaw_rad.least * kDegPerRad,
              app::kStartSigmaYaw_rad.most * kDegPerRad);
  out.start_sigma_xy_m = v[0];
  out.start_sigma_yaw_rad = v[1] * kRadPerDeg;
}

StepTrim parse_degrade(const std::string& text) {
  const std::string mend = "give scale=FACTOR and yaw=ANGLEdeg/m, as in scale=1.02,yaw=0.1deg/m";
  StepTrim trim;
  for (const std::string_view part : split(text, ',')) {
    const std::size_t equals = part.find('=');
    const std::string_view key = part.substr(0, equals);
    std::string_view value = equals == std::string_view::npos ? "" : part.substr(equals + 1);
    if (key == "scale") {
      trim.scale = number(value, "--degrade", mend);
    } else if (key == "yaw") {
      double unit = 0.0;
      for (const auto& [suffix, factor] :
           {std::pair<std::string, double>{"deg/m", kRadPerDeg}, {"rad/m", 1.0}}) {
        if (value.size() > suffix.size() &&
            value.compare(value.size() - suffix.size(), suffix.size(), suffix) == 0) {
          value.remove_suffix(suffix.size());
          unit = factor;
          break;
        }
      }
      if (unit == 0.0) throw ToolError("--degrade: '{}' has no unit; {}", part, mend);
      trim.yaw_rad_per_m = unit * number(value, "--degrade", mend);
    } else {
      throw ToolError("--degrade: '{}' is unknown; {}", part, mend);
    }
  }
  return trim;
}

/// The drive that the options name: a data set, or a scene that is rendered as it is driven over.
struct DriveSource {
  std::unique_ptr<sim::World> world;
  std::unique_ptr<Drive> drive;
  const Dataset* data = nullptr;  ///< it, where it is one
  PairFault fault;                ///< of a data set's images
};

/// In place of the mission's.
void wear_mask(const fs::path& picture, const DriveSource& source, LocalizerParams& params) {
  const StereoRig& rig = source.drive->rig();
  const Rectification* const made = source.data != nullptr ? source.data->rectification() : nullptr;
  const HardwareMask mask = made != nullptr
                                ? read_hardware_mask(picture, source.data->cameras().left, made->left)
                                : read_hardware_mask(picture);
  if (mask.width_px != rig.width_px || mask.height_px != rig.height_px)
    throw ToolError("{}: has {} x {} pixels, the drive's images {} x {}; draw it on one of these",
                    picture.string(), mask.width_px, mask.height_px, rig.width_px, rig.height_px);
  params.vo.own = params.boulders.own = mask.own;
}

void warn(const std::string& words) { fmt::print(stderr, "cairn: warning: {}\n", words); }

/// A line each, but for those that go on and on.
void warn_of_all(const std::vector<std::string>& faults) {
  constexpr std::size_t kMost = 6;
  const std::size_t told = faults.size() <= kMost ? faults.size() : kMost - 1;
  for (std::size_t i = 0; i < told; ++i) warn(faults[i]);
  if (told < faults.size()) warn(fmt::format("and {} more of that kind", faults.size() - told));
}

/// What a data set's files and images say against it: told before the work. Swapped images are refused.
void open_dataset(const RunOptions& options, const ReplayOptions& range, DriveSource& source) {
  auto data = std::make_unique<Dataset>(Dataset::open(options.dataset, options.calibration,
                                                      options.raw ? ImagesAre::kRaw : ImagesAre::kRectified));
  for (const std::string& note : data->notes()) warn(note);
  const std::size_t end = std::min(range.end_frame, data->size());
  const bool fits = data->rig().width_px <= cfg::kImageWidth && data->rig().height_px <= cfg::kImageHeight;
  if (fits && range.first_frame < end) source.fault = check_pairs(*data, range.first_frame, end);
  if (source.fault.kind == PairFault::Kind::kSwapped)
    throw ToolError("{}: {}", options.dataset.string(), source.fault.words);
  if (source.fault.kind != PairFault::Kind::kNone) warn(source.fault.words);
  source.data = data.get();
  source.drive = std::move(data);
}

DriveSource open_drive(const RunOptions& options, const ReplayOptions& range) {
  DriveSource source;
  if (options.simulate) {
    source.world = std::make_unique<sim::World>(sim::load_scene(options.scene, options.sets));
    source.drive = std::make_unique<sim::SimulatedDrive>(
        *source.world, options.scene.empty() ? "simulated drive" : options.scene.string());
  } else {
    open_dataset(options, range, source);
  }
  return source;
}

/// What the scene's sensors read, where there are any.
AttitudeTable simulated_attitudes(const sim::World& world) {
  const sim::AttitudeSigma sigma = sim::told_sigma(world.scene().attitude);
  AttitudeTable out;
  for (const sim::AttitudeReading& r : world.attitude_readings())
    out[static_cast<std::uint32_t>(r.frame)] = {
        {r.up_rover.x(), r.up_rover.y(), r.up_rover.z()}, sigma.gravity_rad, r.yaw_rad, sigma.heading_rad};
  return out;
}

/// The orthoimage is drawn under the map's coordinates.
void check_ortho(const RunOptions& options, const std::string& map_system) {
  if (options.ortho.empty()) return;
  const std::string system =
      open_orthoimage(options.ortho, 0, {std::nullopt, false})->facts().reference_system;
  if (is_local_reference(system) || is_local_reference(map_system) || same_reference(system, map_system))
    return;
  throw ToolError("{}: is in {}, the map in {}; reproject it with gdalwarp -t_srs '{}'",
                  options.ortho.string(), system, map_system, map_system);
}

/// What was seen in the pictures before the drive, unless VO knows better.
std::string likely_cause(const MotionCounts& motion, const PairFault& fault) {
  const bool known = motion.noisy || motion.lens != 0.0 || motion.unmeasured() == 0 ||
                     (motion.mostly_frozen() && fault.kind != PairFault::Kind::kFrozen);
  return fault.words.empty() || known ? motion.cause() : fault.words;
}

/// How many steps were not measured and why, and where nothing moved: then the command fails.
void tell_motion(const std::string& drive, std::size_t size, const Replay& replay, const PairFault& fault) {
  const MotionCounts motion = motion_counts(replay);
  if (motion.measured == 0 && motion.unmeasured() + motion.doubted > 0)
    throw ToolError("{}: no step of the drive was measured{} ({}): {}", drive,
                    motion.doubted > 0 ? " beyond doubt" : "", motion.words(), likely_cause(motion, fault));
  if (motion.unmeasured() + motion.doubted > 0)
    warn(fmt::format("{}: {}", motion.words(), likely_cause(motion, fault)));
  if (size == 1) {
    warn(drive + ": one pair alone tells of no motion; give two or more");
    throw Answer{kStood};
  }
  const std::string standing = standing_words(replay);
  if (standing.empty()) return;
  warn(drive + ": " + standing);
  throw Answer{kStood};
}

/// What says the same thing twice, or leaves it open.
void check_choices(const RunOptions& options) {
  if (options.simulate != options.dataset.empty()) {
    throw ToolError("--dataset: {}", options.simulate
                                         ? "cannot be combined with --scene and --set; remove one"
                                         : "is missing; give a folder of stereo pairs, or --scene");
  }
  if (options.no_map != options.map.empty()) {
    throw ToolError("--map: {}", options.no_map ? "cannot be combined with --no-map; remove one"
                                                : "is missing; give a .cmap, or --no-map for VO alone");
  }
  if (options.lost && !options.start_sigma.empty())
    throw ToolError("--lost: cannot be combined with --start-sigma; leave one out");
}

ReplayOptions replay_options_of(const RunOptions& options) {
  ReplayOptions replay_options;
  if (options.paper) replay_options.params = paper_params();
  if (!options.frames.empty()) {
    const FrameRange range = parse_frames(options.frames);
    replay_options.first_frame = range.first;
    replay_options.end_frame = range.end;
  }
  if (!options.start.empty()) replay_options.T_map_rover = parse_start(options.start);
  if (!options.start_sigma.empty()) parse_start_sigma(options.start_sigma, replay_options);
  if (options.lost) {
    replay_options.start_sigma_xy_m = Localizer::kUnknownStart_m;
    replay_options.start_sigma_yaw_rad = kPi;
  }
  if (!options.attitude.empty()) replay_options.attitudes = read_attitudes(options.attitude);
  if (!options.degrade.empty()) replay_options.trim = parse_degrade(options.degrade);
  return replay_options;
}

RunTitle title_of(const RunOptions& options) {
  RunTitle title;
  title.dataset = options.simulate ? options.scene.string() : options.dataset.string();
  title.variant = options.paper ? "paper" : "cairn";
  title.degrade = options.degrade;
  title.ortho = options.ortho;
  return title;
}

void take_map(const RunOptions& options, ReplayOptions& replay_options, RunTitle& title) {
  replay_options.map = read_file(options.map);
  CmapContent map = decode_cmap(replay_options.map, options.map.string(), options.salvage);
  if (map.damaged_tiles > 0)
    fmt::print(stderr, "cairn: warning: {}: {} damaged tile{} left out, as in flight\n", options.map.string(),
               map.damaged_tiles, map.damaged_tiles == 1 ? "" : "s");
  if (map.boulders.empty()) throw ToolError("{}: {}", options.map.string(), explain(MapStatus::kNoBoulders));
  check_ortho(options, map.reference_system);
  if (!cfg::kHaveLandmarks && map.pixel_m >= kCoarsePixel_m) {
    warn(
        fmt::format("{}: has {:.0f} mm a pixel; mission '{}' keeps no landmarks, which such maps ask for "
                    "(MISSION=drone and mast do), and fixes may be few",
                    options.map.string(), 1.0e3 * map.pixel_m, cfg::kMission.name));
  }
  title.map = options.map.string();
  title.map_pixel_m = map.pixel_m;
  title.orbital = std::move(map.boulders);
}

void run(RunOptions options) {
  options.simulate = !options.scene.empty() || !options.sets.empty();
  check_choices(options);
  ReplayOptions replay_options = replay_options_of(options);
  RunTitle title = title_of(options);
  if (!options.no_map) take_map(options, replay_options, title);
  const DriveSource source = open_drive(options, replay_options);
  const Drive& drive = *source.drive;
  if (source.world && options.attitude.empty()) replay_options.attitudes = simulated_attitudes(*source.world);
  if (!options.mask.empty()) wear_mask(options.mask, source, replay_options.params);
  title.truth_rocks = drive.truth_rocks();
  if (!options.ortho.empty())
    static_cast<void>(read_ortho_piece(options.ortho, Box(), 1));  // told before the work
  Results results(options.output);
  PictureRecorder pictures(options.pictures, replay_options.first_frame,
                           std::min(replay_options.end_frame, drive.size()));
  replay_options.watch = [&](const ReplayFrame& frame, const host::Picture& left) {
    pictures.watch(frame, left);
  };
  Replay replay;
  {
    ProgressLine progress(fmt::format("run {}", fs::path(title.dataset).filename().string()));
    replay = run_replay(drive, replay_options, [&](double share) { progress.show(share); });
  }
  warn_of_all(replay.warnings);
  for (const std::string& doubt : attitude_doubts(replay.health))
    warn((options.attitude.empty() ? "[attitude]" : options.attitude.string()) + ": " + doubt);
  const RunErrors errors = errors_of(replay);
  results.write(title, replay, errors, pictures);
  print_table(replay, errors);
  fmt::print("written: {}\n", results.names());
  const MotionCounts motion = motion_counts(replay);
  if (motion.measured > 0) {
    for (const std::string& doubt : {truth_words(errors), order_words(replay), pace_words(replay)})
      if (!doubt.empty()) warn(title.dataset + ": " + doubt);
  }
  tell_motion(title.dataset, drive.size(), replay, source.fault);
}

}  // namespace

void add_run_command(Command app) {
  const auto options = std::make_shared<RunOptions>();
  Command command = app.add_command("run", "Replay a drive, on disk or simulated, through the flight module");
  command.add_option("--dataset", options->dataset, "folder of stereo pairs (layout: doc/guide/drives.md)");
  command
      .add_option("--calibration", options->calibration,
                  "one file or two (left, right) in place of the data set's own; kinds: cairn rig")
      .values(1, 2);
  command.add_flag("--raw", options->raw,
                   "images are raw, where the calibration tells of rectified ones, too");
  command.add_option("--scene", options->scene,
                     "instead of a data set: a scene (TOML), rendered during "
                     "the drive");
  command.add_option("--set", options->sets,
                     "override a value of the scene, e.g. traverse.length_m=20; repeatable");
  command.add_option("--map", options->map, "orbital boulder map (.cmap)");
  command.add_flag("--salvage", options->salvage,
                   "take a map with damaged tiles, as the flight module does: without these");
  command.add_flag("--no-map", options->no_map, "visual odometry alone");
  command.add_option("-o,--output", options->output, "folder for the results").required();
  command.add_option("--ortho", options->ortho, "orthoimage to draw the plot on");
  command.add_option("--frames", options->frames, "frames to use, FIRST:END, counted from 0");
  command.add_option("--start", options->start,
                     "rover's start in the map: x,y,z,roll,pitch,yaw (metres, degrees)");
  command.add_option(
      "--start-sigma", options->start_sigma,
      "what the start is uncertain by: XY,YAW (metres, degrees; default 0.05,0.57); beyond the mission's limits it is unconfirmed until a fix");
  command.add_flag("--lost", options->lost,
                   "the start is not known: looked for in the whole map, at any heading");
  command.add_option("--mask", options->mask,
                     "picture, white where the left camera sees the rover itself (default: the mission's)");
  command.add_option("--attitude", options->attitude,
                     "table of gravity and headings that were measured (doc/guide/drives.md); default: the "
                     "scene's [attitude]");
  command.add_option("--degrade", options->degrade, "degrade each VO step, e.g. scale=1.02,yaw=0.1deg/m");
  command.add_flag("--paper", options->paper, "use the paper's own choices throughout");
  command
      .add_option("--pictures", options->pictures,
                  "number of frames whose pictures are kept for cairn report, evenly spaced (default 4)")
      .within(0, 100);
  command.on_run([options] { run(*options); });
}

}  // namespace cairn::ground
