/// Drives the flight module over a drive, frame by frame, through `hal`: telecommands in, telemetry out.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/flight_app.hpp"
#include "dataset/drive.hpp"
#include "dataset/trajectory.hpp"
#include "platform/host/host_hal.hpp"
#include "replay/attitude_file.hpp"

namespace cairn::ground {

struct ReplayFrame {
  std::size_t index = 0;  ///< in the drive
  app::FrameReport report;
  bool left_again = false;   ///< the picture is the one before's, to the bit
  bool right_again = false;  ///< likewise
  double seconds = 0.0;      ///< of the flight module for this pair
  /// Of it by task: the time of each slice, shared out by the operations that were done in it.
  double task_seconds[cfg::kTaskCount] = {};
};

/// A ground boulder and the map's that it goes with, once a fix was applied: as the corrected pose lays the
/// local map, the nearest within three sigmas, and each of the map's with its nearest. The verdict itself has
/// no pairs, but weights.
struct FixPair {
  std::uint32_t frame = 0;  ///< number of the stereo pair at which the fix was applied
  Vec2 seen_map_m = Vec2(0.0, 0.0);
  Vec2 map_m = Vec2(0.0, 0.0);
};

struct ReplayOptions {
  LocalizerParams params;
  std::vector<std::uint8_t> map;  ///< `.cmap` bytes; empty: VO alone
  /// Start; without it the drive's truth. VO alone begins so that it meets a truth which begins later.
  std::optional<Pose3> T_map_rover;
  double start_sigma_xy_m = 0.05;     ///< what the start is uncertain by, each of x and y; and ...
  double start_sigma_yaw_rad = 0.01;  ///< ... its yaw. From Localizer::kUnknownStart_m on: lost
  StepTrim trim;                      ///< worsens the VO steps (--degrade)
  AttitudeTable attitudes;            ///< measured: each is sent before its pair
  std::size_t first_frame = 0;        ///< index into the drive's frames
  std::size_t end_frame = SIZE_MAX;   ///< one past the last
  std::uint32_t slice_ops = cfg::kSliceOps;
  /// Called after each frame with its left image; the public state of app::root may be read then.
  /// May be empty.
  std::function<void(const ReplayFrame&, const host::Picture& left)> watch;
};

struct Replay {
  std::vector<ReplayFrame> frames;
  std::vector<app::FixReport> fixes;
  std::vector<Mat2> fix_covariance_m2;                   ///< of x, y after each fix; not in telemetry
  std::vector<FixPair> pairs;                            ///< of applied fixes; not in telemetry either
  std::map<std::uint32_t, app::BoulderReport> boulders;  ///< the last report of each
  LocalizerHealth health;
  ImageOffset offset;              ///< of the rig beyond its calibration, as known at the end
  std::array<double, 4> angles{};  ///< likewise, rad: turns about x and z, baseline's y and z
  app::ExecutiveCounts executive;
  std::uint8_t map_status = 0;
  std::uint32_t unreadable_images = 0;
  std::vector<std::string> warnings;  ///< one line each: what could not be read

  Trajectory vo;  ///< T_map_cam, VO alone
  Trajectory corrected;
  Trajectory truth;  ///< where it is known
};

/// The rig: intrinsics of the drive, mounting of the mission.
StereoRig rig_of(const Drive& drive);

/// Throws ToolError where the drive does not fit this build, no start pose is known, or the map is not
/// usable. `progress` gets the share done; may be empty.
Replay run_replay(const Drive& drive, const ReplayOptions& options,
                  const std::function<void(double)>& progress);

}  // namespace cairn::ground
