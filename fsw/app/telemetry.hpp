/// Telemetry packets: their content, and their coding, which the ground tools share. Framing: app/packet.hpp;
/// every byte: doc/ICD.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "app/packet.hpp"
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

/// After each minor frame.
struct FrameReport {
  static constexpr TelemetryType kType = TelemetryType::kFrame;
  std::uint32_t number = 0;  ///< of the stereo pair
  std::uint64_t t_capture_us = 0;
  std::uint8_t pose_source = 0;     ///< PoseSource
  std::uint8_t vo_status = 0;       ///< VoStatus
  std::uint8_t boulder_status = 0;  ///< ObserveStatus
  Pose3 T_map_cam_vo;               ///< VO alone
  Pose3 T_map_cam;                  ///< corrected
  float sigma_xy_m = 0.0F;
  float sigma_yaw_rad = 0.0F;
  std::uint16_t features_left = 0;
  std::uint16_t features_right = 0;
  std::uint16_t stereo = 0;
  std::uint16_t matches = 0;
  std::uint16_t inliers = 0;
  float rms_px = 0.0F;
  std::uint16_t regions = 0;
  std::uint16_t evident_regions = 0;
  std::uint16_t boulders = 0;  ///< sighted in this frame
  std::uint16_t boulders_matched = 0;
  float scale = 0.0F;           ///< VO's rates as the fixes tell them: k, and ...
  float turn_rad_per_m = 0.0F;  ///< ... w (localizer/pose_fusion.hpp)
  std::uint32_t vo_ops = 0;
  std::uint32_t boulder_ops = 0;
  std::uint32_t fix_ops = 0;
};

/// After each registration, whatever came of it.
struct FixReport {
  static constexpr TelemetryType kType = TelemetryType::kFix;
  std::uint32_t number = 0;  ///< stereo pair at which it was applied or declined
  std::uint8_t status = 0;   ///< FixStatus
  std::uint8_t map_window_full = 0;
  double dx_m = 0.0;  ///< correction of the rover in map: new minus old
  double dy_m = 0.0;
  double dyaw_rad = 0.0;
  double scale = 1.0;
  float rms_m = 0.0F;
  float sigma_xy_m = 0.0F;
  float sigma_yaw_rad = 0.0F;
  std::uint16_t local_boulders = 0;
  std::uint16_t map_boulders = 0;
  std::uint16_t pairs = 0;
  std::uint16_t trimmed = 0;
  std::uint16_t gated = 0;
  std::uint16_t iterations = 0;
};

/// A boulder of the local map, after each registration.
struct BoulderReport {
  static constexpr TelemetryType kType = TelemetryType::kBoulder;
  std::uint32_t id = 0;
  double x_m = 0.0;  ///< map
  double y_m = 0.0;
  double z_m = 0.0;
  float diameter_m = 0.0F;
  float spread_m = 0.0F;
  std::uint16_t sightings = 0;
};

/// What became of a telecommand.
struct AckReport {
  static constexpr TelemetryType kType = TelemetryType::kAck;
  std::uint32_t command_sequence = 0;
  std::uint8_t command_type = 0;
  std::uint8_t status = 0;   ///< CommandStatus
  std::uint8_t detail = 0;   ///< ContentStatus, MapStatus or what else of the command's, by its type
  std::uint32_t newest = 0;  ///< number of the newest command of this type that was accepted
};

/// Counts since the start, once a major frame.
struct HealthReport {
  static constexpr TelemetryType kType = TelemetryType::kHealth;
  std::uint32_t frames = 0;
  std::array<std::uint32_t, kVoStatusCount> vo{};
  std::array<std::uint32_t, kObserveStatusCount> boulders{};
  std::array<std::uint32_t, kFixStatusCount> fixes{};
  std::array<std::uint32_t, cfg::kTaskCount> overruns{};  ///< by cfg::Task
  std::uint32_t extrapolated = 0;
  std::uint32_t abandoned_boulders = 0;
  std::uint32_t dropped_tracks = 0;
  std::uint32_t dropped_pairs = 0;
  std::uint32_t bad_priors = 0;  ///< refused, too late, or of a pair that never came
  std::array<std::uint32_t, kCommandStatusCount> commands{};  ///< by CommandStatus
  std::uint32_t lost_packets = 0;
  std::uint8_t map_status = 0;  ///< MapStatus of the last map that was judged for use
  std::uint32_t map_crc = 0;    ///< head CRC of the map in use, 0 where there is none
};

/// How the upload of a map stands: when one is begun, complete, verified or in use, and on command.
struct UploadReport {
  static constexpr TelemetryType kType = TelemetryType::kUpload;
  std::uint8_t status = 0;  ///< TransferStatus
  std::uint8_t detail = 0;  ///< DeltaStatus where the delta was refused, MapStatus where the map was judged
  std::uint8_t kind = 0;    ///< UploadKind
  std::uint32_t id = 0;
  std::uint32_t bytes = 0;
  std::uint16_t chunk_bytes = 0;
  std::uint16_t chunks = 0;
  std::uint16_t taken = 0;
  std::uint16_t first_missing = 0;                        ///< chunk; `chunks` where none is missing
  std::array<std::uint32_t, kChunkStatusCount> counts{};  ///< chunks by ChunkStatus, since the start
  /// Chunk first_missing + n is missing: bit 7 - n % 8 of byte n / 8. Farther ones are told when these came.
  std::array<std::uint8_t, 256> missing{};
};

/// `Report` is one of the six above.
template <typename Report>
void encode(const Report& report, std::uint32_t sequence, Packet& out);
template <typename Report>
PacketStatus decode(const std::uint8_t* bytes, std::size_t size, Report& out);

}  // namespace cairn::app
