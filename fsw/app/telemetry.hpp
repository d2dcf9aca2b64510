/// Telemetry packets: their content, and their coding, which the ground tools share. Framing: app/packet.hpp;
/// every byte: doc/ICD.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "app/packet.hpp"
#include "app/pair_order.hpp"
#include "app/telecommand.hpp"
#include "localizer/localizer.hpp"
#include "orbital_map/map_transfer.hpp"
#include "schedule.hpp"

namespace cairn::app {

enum class TelemetryType : std::uint8_t {
  kFrame = 1,
  kFix = 2,
  kBoulder = 3,
  kAck = 4,
  kHealth = 5,
  kUpload = 6,
};

// The comments of these fields are also their meanings in the ICD (make icd).

/// After each minor frame.
struct FrameReport {
  static constexpr TelemetryType kType = TelemetryType::kFrame;
  std::uint32_t number = 0;        ///< of the stereo pair, as the camera gave it
  std::uint64_t t_capture_us = 0;  ///< as the camera gave it
  /// `PairStatus`; a pair that is let go gives no report, and counts in health
  std::uint8_t pair_status = 0;
  std::uint16_t missed_pairs = 0;  ///< before this one, by its number; 65535 for more
  std::uint8_t pose_source = 0;    ///< `PoseSource`
  std::uint8_t vo_status = 0;      ///< `VoStatus`
  /// `ObserveStatus`; 0: not observed, since VO held the pose; 1: not finished in time
  std::uint8_t boulder_status = 0;
  std::uint8_t watch = 0;    ///< `WatchStatus`: what speaks against VO
  std::uint8_t trust = 0;    ///< `Trust`
  std::uint8_t gravity = 0;  ///< `AttitudeStatus` of what came for this pair
  /// `AttitudeStatus` of what came for this pair, or became in it of a heading that waited
  std::uint8_t heading = 0;
  Pose3 T_map_cam_vo;                  ///< left camera, VO alone
  Pose3 T_map_cam;                     ///< left camera, corrected
  float sigma_xy_m = 0.0F;             ///< standard deviation of the corrected x and y, each; 1e4: anywhere
  float sigma_yaw_rad = 0.0F;          ///< and of its yaw; 1.8: any heading
  float sigma_tilt_rad = 0.0F;         ///< of its turn about any horizontal axis
  float sigma_z_m = 0.0F;              ///< of its height, since the start
  std::uint16_t features_left = 0;     ///< found in the left image
  std::uint16_t features_right = 0;    ///< in the right one
  std::uint16_t stereo = 0;            ///< points with a disparity
  std::uint16_t matches = 0;           ///< from the reference frame, before RANSAC
  std::uint16_t own_points = 0;        ///< that stand still while the others move: the rover's own hardware
  std::uint16_t inliers = 0;           ///< of the motion
  float rms_px = 0.0F;                 ///< of the inliers' residuals
  std::uint16_t regions = 0;           ///< labelled by the segmentation
  std::uint16_t evident_regions = 0;   ///< of these, that stand above the ground
  std::uint16_t boulders = 0;          ///< sighted in this frame
  std::uint16_t boulders_matched = 0;  ///< that go on one of the frame before
  float scale = 0.0F;                  ///< k, as the fixes tell it: share by which VO steps are too short
  float turn_rad_per_m = 0.0F;         ///< w, as the fixes tell it: turn that VO lacks
  std::uint32_t vo_ops = 0;            ///< work of VO in this minor frame
  std::uint32_t boulder_ops = 0;       ///< of the boulder observer
  std::uint32_t fix_ops = 0;           ///< of the registration
};

/// After each registration, whatever came of it.
struct FixReport {
  static constexpr TelemetryType kType = TelemetryType::kFix;
  std::uint32_t number = 0;          ///< stereo pair at which it was applied or declined
  std::uint8_t status = 0;           ///< `FixStatus`
  std::uint8_t map_window_full = 0;  ///< 1: more orbital boulders near than there is room for; else 0
  double dx_m = 0.0;                 ///< correction of the rover in `map`, new minus old: east
  double dy_m = 0.0;                 ///< north
  double dyaw_rad = 0.0;             ///< counter-clockwise
  double scale = 1.0;                ///< of a similarity; 1 for a rigid fit
  float rms_m = 0.0F;                ///< of the pairs used
  float sigma_xy_m = 0.0F;           ///< after the fix
  float sigma_yaw_rad = 0.0F;        ///< after the fix
  std::uint16_t local_boulders = 0;  ///< of the local map
  std::uint16_t map_boulders = 0;    ///< orbital, near the rover
  std::uint16_t pairs = 0;           ///< used
  std::uint16_t trimmed = 0;         ///< pairs rejected as the worst
  std::uint16_t gated = 0;           ///< local boulders without a partner
  std::uint16_t iterations = 0;      ///< of the registration
  std::uint32_t snapshot = 0;        ///< frame that it speaks of, counted from the start
  std::uint8_t lost = 0;             ///< 1: looked for in the whole map; else 0
  float chi2 = 0.0F;                 ///< against the pose before, three degrees of freedom
  float log_ratio = 0.0F;            ///< of same ground against chance, nats
  float second_log_ratio = 0.0F;     ///< of the second best pose, nats; -1000: none
  float chance_log = 0.0F;           ///< what this map does by chance, nats; 1000: nothing
  std::uint32_t hypotheses = 0;      ///< poses looked at
  /// windows whose evidence was added up, of the fix or of the hypothesis that is carried on; 0: none, as
  /// where LocalizerParams::add_windows is off
  std::uint8_t windows = 0;
  float windows_log_ratio = 0.0F;  ///< of these together, nats
};

/// A boulder of the local map, after each registration.
struct BoulderReport {
  static constexpr TelemetryType kType = TelemetryType::kBoulder;
  std::uint32_t id = 0;         ///< unique over the drive
  double x_m = 0.0;             ///< `map`, corrected
  double y_m = 0.0;             ///< the same
  double z_m = 0.0;             ///< the same
  float diameter_m = 0.0F;      ///< width across the line of sight
  float spread_m = 0.0F;        ///< root mean square distance of its points from their mean
  std::uint16_t sightings = 0;  ///< frames that saw it
};

/// What became of a telecommand.
struct AckReport {
  static constexpr TelemetryType kType = TelemetryType::kAck;
  std::uint32_t command_sequence = 0;  ///< of the command; 0 for a packet that could not be read
  std::uint8_t command_type = 0;       ///< the same
  std::uint8_t status = 0;             ///< `CommandStatus`
  /// set start, set trim, motion prior, attitude: `ContentStatus`; load map: `MapStatus`; begin upload:
  /// `BeginStatus`; map chunk: `ChunkStatus`; use upload: `TransferStatus` after it; else 0
  std::uint8_t detail = 0;
  /// sequence of the newest command of this type that was accepted; 0 where there is none, and for types
  /// without an order
  std::uint32_t newest = 0;
};

/// Counts since the start, and what is learnt of the rig beyond its calibration; once a major frame.
struct HealthReport {
  static constexpr TelemetryType kType = TelemetryType::kHealth;
  std::uint32_t frames = 0;                                   ///< begun
  std::array<std::uint32_t, kVoStatusCount> vo{};             ///< by `VoStatus`
  std::array<std::uint32_t, kWatchStatusCount> watch{};       ///< by `WatchStatus`
  std::array<std::uint32_t, kObserveStatusCount> boulders{};  ///< by `ObserveStatus`
  std::array<std::uint32_t, kFixStatusCount> fixes{};         ///< by `FixStatus`
  std::array<std::uint32_t, kAttitudeStatusCount> gravity{};  ///< measured, by `AttitudeStatus`
  /// by `AttitudeStatus`; one that waited counts as that, and by what became of it
  std::array<std::uint32_t, kAttitudeStatusCount> headings{};
  std::array<std::uint32_t, cfg::kTaskCount> overruns{};  ///< by `Task`
  std::uint32_t extrapolated = 0;                         ///< frames moved without a motion from VO
  std::uint32_t abandoned_boulders = 0;                   ///< frames whose boulders were not finished in time
  std::uint32_t dropped_tracks = 0;                       ///< sightings without room for a track
  std::uint32_t dropped_pairs = 0;                        ///< pairs that came while VO was at the one before
  std::array<std::uint32_t, kPairStatusCount> pairs{};    ///< by `PairStatus`
  /// pairs that never came, by the numbers of those that did; dropped ones, too
  std::uint32_t missed_pairs = 0;
  /// motion priors that were refused, came too late, or whose pair never came
  std::uint32_t bad_priors = 0;
  /// attitudes that were refused, came too late, or whose pair never came
  std::uint32_t bad_attitudes = 0;
  std::array<std::uint32_t, kCommandStatusCount> commands{};  ///< by `CommandStatus`
  std::uint32_t lost_packets = 0;                             ///< telemetry that the link had no room for
  /// `MapStatus` of the last validation, by `load map` or of an upload that is in use
  std::uint8_t map_status = 0;
  /// head CRC of the map in use, which tells it from all others; 0 where there is none
  std::uint32_t map_crc = 0;
  std::uint32_t halved = 0;     ///< frames whose images were looked at halved, for their noise
  float rows_px = 0.0F;         ///< by which right images lie lower
  float columns_px = 0.0F;      ///< by which they lie to the right: disparities are short by it
  float lens = 0.0F;            ///< distortion of both cameras, division model: about k1; 0: none
  float turn_x_rad = 0.0F;      ///< of the right camera about x
  float turn_z_rad = 0.0F;      ///< and about z
  float baseline_y_rad = 0.0F;  ///< direction of the baseline in the left camera, (1, y, z)
  float baseline_z_rad = 0.0F;  ///< the same
  std::array<std::uint32_t, kAttitudeStatusCount> heights{};  ///< the map's, by `AttitudeStatus`
};

/// How the upload of a map stands: when one is begun, complete, verified or in use, and on command.
struct UploadReport {
  static constexpr TelemetryType kType = TelemetryType::kUpload;
  std::uint8_t status = 0;  ///< `TransferStatus`
  /// `DeltaStatus` where the delta was refused; `MapStatus` where the map was refused, is ready or in use;
  /// else 0
  std::uint8_t detail = 0;
  std::uint8_t kind = 0;            ///< `UploadKind`
  std::uint32_t id = 0;             ///< CRC-32 of the whole upload
  std::uint32_t bytes = 0;          ///< of the whole upload
  std::uint16_t chunk_bytes = 0;    ///< of each chunk's data, but the last one's
  std::uint16_t chunks = 0;         ///< of the upload
  std::uint16_t taken = 0;          ///< chunks that are there
  std::uint16_t first_missing = 0;  ///< number of the first chunk that is not; `chunks` where all are
  /// chunks that came since the module was started, by `ChunkStatus`
  std::array<std::uint32_t, kChunkStatusCount> counts{};
  /// chunk first_missing + n is missing: bit 7 - n mod 8 of byte n div 8. So 2048 chunks are told of; farther
  /// ones when these have come
  std::array<std::uint8_t, 256> missing{};
};

/// `Report` is one of the six above.
template <typename Report>
void encode(const Report& report, std::uint32_t sequence, Packet& out);
template <typename Report>
PacketStatus decode(const std::uint8_t* bytes, std::size_t size, Report& out);

}  // namespace cairn::app
