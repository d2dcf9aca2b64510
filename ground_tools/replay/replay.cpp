#include "replay/replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "base/tool_error.hpp"
#include "replay/status_names.hpp"

namespace cairn::ground {
namespace {

void command(const app::Command& content) {
  app::Packet packet;
  app::encode(content, packet);
  host::feed_telecommand(std::vector<std::uint8_t>(packet.begin(), packet.end()));
}

/// Sorts telemetry into the replay. The module under test is told apart from the ground only by its packets.
class Receiver {
 public:
  explicit Receiver(Replay& replay) : replay_(replay) {}

  void operator()(const std::uint8_t* bytes, std::size_t size) {
    app::FrameReport frame;
    app::FixReport fix;
    app::BoulderReport boulder;
    app::AckReport ack;
    app::HealthReport health;
    if (app::decode(bytes, size, frame) == app::PacketStatus::kGood) {
      ReplayFrame told;
      told.report = frame;
      replay_.frames.push_back(told);
    } else if (app::decode(bytes, size, fix) == app::PacketStatus::kGood) {
      replay_.fixes.push_back(fix);
    } else if (app::decode(bytes, size, boulder) == app::PacketStatus::kGood) {
      replay_.boulders[boulder.id] = boulder;
    } else if (app::decode(bytes, size, ack) == app::PacketStatus::kGood) {
      last_ack_ = ack;
    } else if (app::decode(bytes, size, health) == app::PacketStatus::kGood) {
      replay_.map_status = health.map_status;
    }
  }
  const app::AckReport& last_ack() const { return last_ack_; }

 private:
  Replay& replay_;
  app::AckReport last_ack_;
};

void run_until_idle(std::uint32_t slice_ops) {
  while (app::root.cycle(slice_ops) == app::FlightApp::State::kBusy) {
  }
}

/// Runs a frame through and notes its time, whole and by task.
void run_frame(std::uint32_t slice_ops, ReplayFrame& times) {
  std::uint32_t before[cfg::kTaskCount] = {};
  bool more = true;
  while (more) {
    const auto begun = std::chrono::steady_clock::now();
    more = app::root.cycle(slice_ops) == app::FlightApp::State::kBusy;
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
    const std::uint32_t(&ops)[cfg::kTaskCount] = app::root.executive().work().ops;
    double all = 0.0;
    for (std::size_t t = 0; t < cfg::kTaskCount; ++t) all += ops[t] - before[t];
    for (std::size_t t = 0; t < cfg::kTaskCount; ++t) {
      if (all > 0.0) times.task_seconds[t] += seconds * (ops[t] - before[t]) / all;
      before[t] = ops[t];
    }
    times.seconds += seconds;
  }
}

void append_pairs(const Localizer& localizer, std::uint32_t frame, std::vector<FixPair>& pairs) {
  const double sigma_m = EvidenceParams().sigma_pair_m;
  const std::size_t first = pairs.size();
  const auto length = [](const FixPair& p) { return (p.seen_map_m - p.map_m).norm(); };
  MapBoulders near;
  for (const LocalBoulder& b : localizer.local_map()) {
    FixPair pair;
    pair.frame = frame;
    pair.seen_map_m = localizer.T_map_site() * b.p_site_m;
    near.clear();
    static_cast<void>(localizer.map().window(
        pair.seen_map_m, 3.0 * std::hypot(sigma_m, static_cast<double>(b.sigma_m)), near));
    if (near.empty()) continue;
    pair.map_m = std::min_element(near.begin(), near.end(), [&](const MapBoulder& a, const MapBoulder& c) {
                   return (a.p_map_m - pair.seen_map_m).norm() < (c.p_map_m - pair.seen_map_m).norm();
                 })->p_map_m;
    const auto rival = std::find_if(pairs.begin() + static_cast<std::ptrdiff_t>(first), pairs.end(),
                                    [&](const FixPair& p) { return p.map_m == pair.map_m; });
    if (rival == pairs.end()) {
      pairs.push_back(pair);
    } else if (length(pair) < length(*rival)) {
      *rival = pair;
    }
  }
}

void check_frames(const Drive& drive, const AttitudeTable& attitudes) {
  AttitudeTable rest = attitudes;
  for (std::size_t i = 0; i < drive.size(); ++i) rest.erase(static_cast<std::uint32_t>(drive.tag(i).number));
  if (rest.empty()) return;
  throw ToolError("--attitude: frame {} is not in {}; its frames are {} to {}", rest.begin()->first,
                  drive.name(), drive.tag(0).number, drive.tag(drive.size() - 1).number);
}

bool again(const Image& image, const Image& before) {
  return !image.pixels.empty() && image.pixels == before.pixels;
}

/// A picture for the camera; empty where there is no image.
host::Picture picture_of(Image& image, Replay& replay) {
  if (image.pixels.empty()) ++replay.unreadable_images;
  return {image.width, image.height, std::move(image.pixels)};
}

/// From a start that is known.
Replay replay_from(const Pose3& T_map_rover, const Drive& drive, const ReplayOptions& options,
                   const std::function<void(double)>& progress) {
  const StereoRig rig = rig_of(drive);
  const std::size_t end = std::min(options.end_frame, drive.size());
  if (rig.width_px > cfg::kImageWidth || rig.height_px > cfg::kImageHeight) {
    throw ToolError(
        "{}: images of {} x {} are larger than the {} x {} of mission '{}'; build with another MISSION",
        drive.name(), rig.width_px, rig.height_px, cfg::kImageWidth, cfg::kImageHeight, cfg::kMission.name);
  }
  check_frames(drive, options.attitudes);
  Replay replay;
  Receiver receiver(replay);
  host::reset();
  host::on_telemetry([&](const std::uint8_t* bytes, std::size_t size) { receiver(bytes, size); });
  if (app::root.init(options.params, rig) != LocalizerStatus::kReady) {
    throw ToolError("{}: the calibration is not one of a stereo rig; check calib.txt", drive.name());
  }
  app::Command start;
  start.type = app::CommandType::kSetStart;
  start.pose = T_map_rover;
  start.number[0] = options.start_sigma_xy_m;
  start.number[1] = options.start_sigma_yaw_rad;
  command(start);
  run_until_idle(options.slice_ops);
  if (receiver.last_ack().status != static_cast<std::uint8_t>(app::CommandStatus::kAccepted)) {
    throw ToolError(
        "--start: refused (detail {}); give six finite numbers x,y,z,roll,pitch,yaw (metres, degrees)",
        receiver.last_ack().detail);
  }
  app::Command trim;
  trim.type = app::CommandType::kSetTrim;
  trim.number[0] = options.trim.scale;
  trim.number[1] = options.trim.yaw_rad_per_m;
  command(trim);
  run_until_idle(options.slice_ops);
  if (receiver.last_ack().status != static_cast<std::uint8_t>(app::CommandStatus::kAccepted)) {
    throw ToolError("--degrade: out of range; scale is 0.5 to 2, yaw at most 0.1 rad/m either way");
  }
  if (!options.map.empty()) {
    host::load_map_bank(options.map);
    command(app::Command{});
    run_until_idle(options.slice_ops);
  }

  app::Command attitude;
  attitude.type = app::CommandType::kAttitude;
  PairImages shown;  // last
  std::size_t sent = 0;
  for (std::size_t i = options.first_frame; i < end; ++i) {
    const FrameTag frame = drive.tag(i);
    const auto measured = options.attitudes.find(static_cast<std::uint32_t>(frame.number));
    if (measured != options.attitudes.end()) {
      ++attitude.sequence;
      ++sent;
      attitude.pair = measured->first;
      attitude.attitude = measured->second;
      command(attitude);
      run_until_idle(options.slice_ops);
    }
    PairImages pair = drive.images(i);
    replay.warnings.insert(replay.warnings.end(), pair.faults.begin(), pair.faults.end());
    ReplayFrame times;
    times.left_again = again(pair.left, shown.left);
    times.right_again = again(pair.right, shown.right);
    shown = pair;
    const host::Picture left = picture_of(pair.left, replay);
    host::feed_pair(static_cast<std::uint32_t>(frame.number),
                    static_cast<std::uint64_t>(frame.stamp_s * 1.0e6), left, picture_of(pair.right, replay));
    const std::size_t before = replay.frames.size();
    run_frame(options.slice_ops, times);
    if (replay.fixes.size() > replay.fix_covariance_m2.size()) {
      const Localizer& localizer = app::root.localizer();
      replay.fix_covariance_m2.push_back(localizer.fusion().covariance().topLeftCorner<2, 2>());
      const app::FixReport& fix = replay.fixes.back();
      if (fix.status == static_cast<std::uint8_t>(FixStatus::kApplied))
        append_pairs(localizer, fix.number, replay.pairs);
    }
    if (replay.frames.size() > before) {
      ReplayFrame& done = replay.frames.back();
      times.index = i;
      times.report = done.report;
      done = times;
      replay.vo.push_back({frame.stamp_s, done.report.T_map_cam_vo});
      replay.corrected.push_back({frame.stamp_s, done.report.T_map_cam});
      if (const auto truth = drive.truth_cam(i)) replay.truth.push_back({frame.stamp_s, *truth});
      if (options.watch) options.watch(done, left);
    }
    if (progress)
      progress(static_cast<double>(i + 1 - options.first_frame) /
               static_cast<double>(end - options.first_frame));
  }
  if (sent == 0 && !options.attitudes.empty())
    replay.warnings.emplace_back("--attitude: none of its rows is of a frame that is driven (--frames)");
  replay.health = app::root.localizer().health();
  replay.offset = app::root.localizer().vo().offset();
  for (int k = 0; k < 4; ++k)
    replay.angles[static_cast<std::size_t>(k)] = app::root.localizer().vo().rectification().angles()[k];
  replay.executive = app::root.executive().counts();
  return replay;
}

/// The first frame of the range whose camera's true pose is known; nothing where none is.
std::optional<std::size_t> first_true_frame(const Drive& drive, const ReplayOptions& options) {
  for (std::size_t i = options.first_frame; i < std::min(options.end_frame, drive.size()); ++i) {
    if (drive.truth_cam(i)) return i;
  }
  return std::nullopt;
}

/// Where the drive has to begin for VO to be at the truth in the first frame that has one: it is driven so
/// far from the origin.
Pose3 start_before_truth(const Drive& drive, const ReplayOptions& options, std::size_t first_true) {
  ReplayOptions rehearsal = options;
  rehearsal.end_frame = first_true + 1;
  rehearsal.watch = {};
  const Replay replay = replay_from(Pose3(), drive, rehearsal, {});
  if (replay.vo.empty()) return Pose3();
  return *drive.truth_cam(first_true) * replay.vo.back().pose.inverse();
}

}  // namespace

StereoRig rig_of(const Drive& drive) {
  StereoRig rig = drive.rig();
  rig.T_rover_cam =
      mast_pose(cfg::kMission.camera_height_m, cfg::kMission.camera_pitch_down_rad, rig.baseline_m);
  return rig;
}

Replay run_replay(const Drive& drive, const ReplayOptions& options,
                  const std::function<void(double)>& progress) {
  if (options.first_frame >= std::min(options.end_frame, drive.size())) {
    throw ToolError("{}: has {} frames; --frames must give a range within 0:{}", drive.name(), drive.size(),
                    drive.size());
  }
  const std::size_t first = options.first_frame;
  if (options.T_map_rover) return replay_from(*options.T_map_rover, drive, options, progress);
  if (const auto rover = drive.truth_rover(first)) return replay_from(*rover, drive, options, progress);
  const std::optional<std::size_t> first_true = first_true_frame(drive, options);
  if (first_true == first) {
    const Pose3 T_cam_rover = rig_of(drive).T_rover_cam.inverse();
    return replay_from(*drive.truth_cam(first) * T_cam_rover, drive, options, progress);
  }
  if (!options.map.empty()) {
    throw ToolError("{}: has no truth to start from; give --start x,y,z,roll,pitch,yaw{}", drive.name(),
                    first_true ? fmt::format(", or --frames {}: where it begins", *first_true) : "");
  }
  if (!first_true) return replay_from(Pose3(), drive, options, progress);
  const Pose3 start = start_before_truth(drive, options, *first_true);
  Replay replay = replay_from(start, drive, options, progress);
  replay.warnings.push_back(
      fmt::format("{}: the truth begins at frame {}; VO is laid on it there, and errors are of what follows",
                  drive.name(), drive.tag(*first_true).number));
  return replay;
}

}  // namespace cairn::ground
