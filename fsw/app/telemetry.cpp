#include "app/telemetry.hpp"

#include "app/wire.hpp"

namespace cairn::app {
namespace {

// Each report's fields stand in one list, which writer, reader and sizer walk alike.

template <typename Walker, typename Report>
void walk_frame(Walker& w, Report& r) {
  w.field(r.number);
  w.field(r.t_capture_us);
  w.field(r.pose_source);
  w.field(r.vo_status);
  w.field(r.boulder_status);
  w.field(r.T_map_cam_vo);
  w.field(r.T_map_cam);
  w.field(r.sigma_xy_m);
  w.field(r.sigma_yaw_rad);
  w.field(r.features_left);
  w.field(r.features_right);
  w.field(r.stereo);
  w.field(r.matches);
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
void walk_fix(Walker& w, Report& r) {
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
}

template <typename Walker, typename Report>
void walk_boulder(Walker& w, Report& r) {
  w.field(r.id);
  w.field(r.x_m);
  w.field(r.y_m);
  w.field(r.z_m);
  w.field(r.diameter_m);
  w.field(r.spread_m);
  w.field(r.sightings);
}

template <typename Walker, typename Report>
void walk_ack(Walker& w, Report& r) {
  w.field(r.command_sequence);
  w.field(r.command_type);
  w.field(r.status);
  w.field(r.detail);
}

template <typename Walker, typename Report>
void walk_health(Walker& w, Report& r) {
  w.field(r.frames);
  w.field(r.vo);
  w.field(r.boulders);
  w.field(r.fixes);
  w.field(r.overruns);
  w.field(r.extrapolated);
  w.field(r.abandoned_boulders);
  w.field(r.dropped_tracks);
  w.field(r.dropped_pairs);
  w.field(r.bad_priors);
  w.field(r.bad_commands);
  w.field(r.lost_packets);
  w.field(r.map_status);
}

template <typename Walker, typename Report>
void walk_upload(Walker& w, Report& r) {
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

template <typename W, typename R>
void walk(W& w, R& r, const FrameReport*) {
  walk_frame(w, r);
}
template <typename W, typename R>
void walk(W& w, R& r, const FixReport*) {
  walk_fix(w, r);
}
template <typename W, typename R>
void walk(W& w, R& r, const BoulderReport*) {
  walk_boulder(w, r);
}
template <typename W, typename R>
void walk(W& w, R& r, const AckReport*) {
  walk_ack(w, r);
}
template <typename W, typename R>
void walk(W& w, R& r, const HealthReport*) {
  walk_health(w, r);
}
template <typename W, typename R>
void walk(W& w, R& r, const UploadReport*) {
  walk_upload(w, r);
}

template <typename Report>
void encode_as(PacketType type, const Report& report, std::uint32_t sequence, Packet& out) {
  Writer<Packet> w(out, static_cast<std::uint8_t>(type), sequence);
  walk(w, report, &report);
  w.finish();
}

template <typename Report>
PacketStatus decode_as(PacketType wanted, const std::uint8_t* bytes, std::size_t size, Report& out) {
  PacketType type{};
  std::uint32_t sequence = 0;
  const PacketStatus status = check_packet(bytes, size, type, sequence);
  if (status != PacketStatus::kGood) return status;
  if (type != wanted) return PacketStatus::kOtherType;
  Sizer sizer;
  walk(sizer, out, &out);
  if (sizer.packet_bytes() != size) return PacketStatus::kBadSize;
  Reader r(bytes);
  walk(r, out, &out);
  return PacketStatus::kGood;
}

}  // namespace

void encode(const FrameReport& report, std::uint32_t sequence, Packet& out) {
  encode_as(PacketType::kFrame, report, sequence, out);
}
void encode(const FixReport& report, std::uint32_t sequence, Packet& out) {
  encode_as(PacketType::kFix, report, sequence, out);
}
void encode(const BoulderReport& report, std::uint32_t sequence, Packet& out) {
  encode_as(PacketType::kBoulder, report, sequence, out);
}
void encode(const AckReport& report, std::uint32_t sequence, Packet& out) {
  encode_as(PacketType::kAck, report, sequence, out);
}
void encode(const HealthReport& report, std::uint32_t sequence, Packet& out) {
  encode_as(PacketType::kHealth, report, sequence, out);
}
void encode(const UploadReport& report, std::uint32_t sequence, Packet& out) {
  encode_as(PacketType::kUpload, report, sequence, out);
}

PacketStatus check_packet(const std::uint8_t* bytes, std::size_t size, PacketType& type,
                          std::uint32_t& sequence) {
  if (bytes == nullptr || size < kPacketHeaderBytes + kPacketCrcBytes) return PacketStatus::kTooShort;
  if (be::get_u16(bytes + 2) != size) return PacketStatus::kBadSize;
  if (crc32(bytes, size - kPacketCrcBytes) != be::get_u32(bytes + size - kPacketCrcBytes))
    return PacketStatus::kBadCrc;
  if (bytes[1] != kPacketVersion) return PacketStatus::kBadVersion;
  type = static_cast<PacketType>(bytes[0]);
  sequence = be::get_u32(bytes + 4);
  return PacketStatus::kGood;
}

PacketStatus decode(const std::uint8_t* bytes, std::size_t size, FrameReport& out) {
  return decode_as(PacketType::kFrame, bytes, size, out);
}
PacketStatus decode(const std::uint8_t* bytes, std::size_t size, FixReport& out) {
  return decode_as(PacketType::kFix, bytes, size, out);
}
PacketStatus decode(const std::uint8_t* bytes, std::size_t size, BoulderReport& out) {
  return decode_as(PacketType::kBoulder, bytes, size, out);
}
PacketStatus decode(const std::uint8_t* bytes, std::size_t size, AckReport& out) {
  return decode_as(PacketType::kAck, bytes, size, out);
}
PacketStatus decode(const std::uint8_t* bytes, std::size_t size, HealthReport& out) {
  return decode_as(PacketType::kHealth, bytes, size, out);
}
PacketStatus decode(const std::uint8_t* bytes, std::size_t size, UploadReport& out) {
  return decode_as(PacketType::kUpload, bytes, size, out);
}

}  // namespace cairn::app
