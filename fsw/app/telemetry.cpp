#include "app/telemetry.hpp"

namespace cairn::app {
namespace {

// Each report's fields in one list. `Report` is the type that the last argument names, const or not.

template <typename Walker, typename Report>
void walk(Walker& w, Report& r, const FrameReport*) {
  w.field(r.number);
  w.field(r.t_capture_us);
  w.field(r.pair_status);
  w.field(r.missed_pairs);
  w.field(r.pose_source);
  w.field(r.vo_status);
  w.field(r.boulder_status);
  w.field(r.watch);
  w.field(r.trust);
  w.field(r.gravity);
  w.field(r.heading);
  w.field(r.T_map_cam_vo);
  w.field(r.T_map_cam);
  w.field(r.sigma_xy_m);
  w.field(r.sigma_yaw_rad);
  w.field(r.sigma_tilt_rad);
  w.field(r.sigma_z_m);
  w.field(r.features_left);
  w.field(r.features_right);
  w.field(r.stereo);
  w.field(r.matches);
  w.field(r.own_points);
  w.field(r.inliers);
  w.field(r.rms_px);
  w.field(r.regions);
  w.field(r.evident_regions);
  w.field(r.boulders);
  w.field(r.boulders_matched);
  w.field(r.scale);
  w.field(r.turn_rad_per_m);
  w.field(r.vo_ops);
  w.field(r.boulder_ops);
  w.field(r.fix_ops);
}

template <typename Walker, typename Report>
void walk(Walker& w, Report& r, const FixReport*) {
  w.field(r.number);
  w.field(r.status);
  w.field(r.map_window_full);
  w.field(r.dx_m);
  w.field(r.dy_m);
  w.field(r.dyaw_rad);
  w.field(r.scale);
  w.field(r.rms_m);
  w.field(r.sigma_xy_m);
  w.field(r.sigma_yaw_rad);
  w.field(r.local_boulders);
  w.field(r.map_boulders);
  w.field(r.pairs);
  w.field(r.trimmed);
  w.field(r.gated);
  w.field(r.iterations);
  w.field(r.snapshot);
  w.field(r.lost);
  w.field(r.chi2);
  w.field(r.log_ratio);
  w.field(r.second_log_ratio);
  w.field(r.chance_log);
  w.field(r.hypotheses);
  w.field(r.windows);
  w.field(r.windows_log_ratio);
}

template <typename Walker, typename Report>
void walk(Walker& w, Report& r, const BoulderReport*) {
  w.field(r.id);
  w.field(r.x_m);
  w.field(r.y_m);
  w.field(r.z_m);
  w.field(r.diameter_m);
  w.field(r.spread_m);
  w.field(r.sightings);
}

template <typename Walker, typename Report>
void walk(Walker& w, Report& r, const AckReport*) {
  w.field(r.command_sequence);
  w.field(r.command_type);
  w.field(r.status);
  w.field(r.detail);
  w.field(r.newest);
}

template <typename Walker, typename Report>
void walk(Walker& w, Report& r, const HealthReport*) {
  w.field(r.frames);
  w.field(r.vo);
  w.field(r.watch);
  w.field(r.boulders);
  w.field(r.fixes);
  w.field(r.gravity);
  w.field(r.headings);
  w.field(r.overruns);
  w.field(r.extrapolated);
  w.field(r.abandoned_boulders);
  w.field(r.dropped_tracks);
  w.field(r.dropped_pairs);
  w.field(r.pairs);
  w.field(r.missed_pairs);
  w.field(r.bad_priors);
  w.field(r.bad_attitudes);
  w.field(r.commands);
  w.field(r.lost_packets);
  w.field(r.map_status);
  w.field(r.map_crc);
  w.field(r.halved);
  w.field(r.rows_px);
  w.field(r.columns_px);
  w.field(r.lens);
  w.field(r.turn_x_rad);
  w.field(r.turn_z_rad);
  w.field(r.baseline_y_rad);
  w.field(r.baseline_z_rad);
  w.field(r.heights);
}

template <typename Walker, typename Report>
void walk(Walker& w, Report& r, const UploadReport*) {
  w.field(r.status);
  w.field(r.detail);
  w.field(r.kind);
  w.field(r.id);
  w.field(r.bytes);
  w.field(r.chunk_bytes);
  w.field(r.chunks);
  w.field(r.taken);
  w.field(r.first_missing);
  w.field(r.counts);
  w.field(r.missing);
}

}  // namespace

template <typename Report>
void encode(const Report& report, std::uint32_t sequence, Packet& out) {
  PacketWriter writer(out, {static_cast<std::uint8_t>(Report::kType), sequence});
  walk(writer, report, &report);
  writer.finish();
}

template <typename Report>
PacketStatus decode(const std::uint8_t* bytes, std::size_t size, Report& out) {
  PacketHead head;
  const PacketStatus status = check_packet(bytes, size, head);
  if (status != PacketStatus::kGood) return status;
  if (head.type != static_cast<std::uint8_t>(Report::kType)) return PacketStatus::kOtherType;
  PacketSizer sizer;
  walk(sizer, out, &out);
  if (sizer.packet_bytes() != size) return PacketStatus::kBadSize;
  PacketReader reader(bytes);
  walk(reader, out, &out);
  return PacketStatus::kGood;
}

template void encode(const FrameReport&, std::uint32_t, Packet&);
template PacketStatus decode(const std::uint8_t*, std::size_t, FrameReport&);
template void encode(const FixReport&, std::uint32_t, Packet&);
template PacketStatus decode(const std::uint8_t*, std::size_t, FixReport&);
template void encode(const BoulderReport&, std::uint32_t, Packet&);
template PacketStatus decode(const std::uint8_t*, std::size_t, BoulderReport&);
template void encode(const AckReport&, std::uint32_t, Packet&);
template PacketStatus decode(const std::uint8_t*, std::size_t, AckReport&);
template void encode(const HealthReport&, std::uint32_t, Packet&);
template PacketStatus decode(const std::uint8_t*, std::size_t, HealthReport&);
template void encode(const UploadReport&, std::uint32_t, Packet&);
template PacketStatus decode(const std::uint8_t*, std::size_t, UploadReport&);

}  // namespace cairn::app
