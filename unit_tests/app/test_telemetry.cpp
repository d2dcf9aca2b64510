// Telemetry packets against doc/ICD.md: every byte, every status, every flipped bit.
#include "app/telemetry.hpp"

#include <cstring>
#include <limits>

#include "app/packet_bytes.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::app;
using cairn::test::PacketBytes;

namespace {

constexpr std::uint32_t kSequence = 0x81726354U;
const Pose3 kVoPose{Quat(0.5, -0.5, 0.25, 0.75), Vec3(1.5, -2.25, 1e-3)};
const Pose3 kPose{Quat(0.1, 0.2, 0.3, 0.4), Vec3(-1e6, 7.0, 0.1)};

FrameReport frame_report() {
  FrameReport r;
  r.number = 0x01020304U;
  r.t_capture_us = 0x1112131415161718ULL;
  r.pair_status = 0x19;
  r.missed_pairs = 0x1A1B;
  r.pose_source = 0x21;
  r.vo_status = 0x22;
  r.boulder_status = 0x23;
  r.watch = 0x24;
  r.trust = 0x25;
  r.gravity = 0x26;
  r.heading = 0x27;
  r.T_map_cam_vo = kVoPose;
  r.T_map_cam = kPose;
  r.sigma_xy_m = 0.125F;
  r.sigma_yaw_rad = -0.3F;
  r.sigma_tilt_rad = 0.5F;
  r.sigma_z_m = 0.75F;
  r.features_left = 0x3132;
  r.features_right = 0x3334;
  r.stereo = 0x3536;
  r.matches = 0x3738;
  r.own_points = 0x3B3C;
  r.inliers = 0x393A;
  r.rms_px = 1.1F;
  r.regions = 0x4142;
  r.evident_regions = 0x4344;
  r.boulders = 0x4546;
  r.boulders_matched = 0x4748;
  r.scale = 0.017F;
  r.turn_rad_per_m = -0.0021F;
  r.vo_ops = 0x51525354U;
  r.boulder_ops = 0x55565758U;
  r.fix_ops = 0xFFFFFFFFU;
  return r;
}

PacketBytes frame_bytes() {
  PacketBytes b(1, kSequence);
  b.u32(0x01020304U);
  b.u64(0x1112131415161718ULL);
  b.u8(0x19);
  b.u16(0x1A1B);
  for (const unsigned v : {0x21U, 0x22U, 0x23U, 0x24U, 0x25U, 0x26U, 0x27U}) b.u8(v);
  b.pose(kVoPose);
  b.pose(kPose);
  b.f32(0.125F);
  b.f32(-0.3F);
  b.f32(0.5F);
  b.f32(0.75F);
  for (const unsigned v : {0x3132U, 0x3334U, 0x3536U, 0x3738U, 0x3B3CU, 0x393AU}) b.u16(v);
  b.f32(1.1F);
  for (const unsigned v : {0x4142U, 0x4344U, 0x4546U, 0x4748U}) b.u16(v);
  b.f32(0.017F);
  b.f32(-0.0021F);
  for (const std::uint32_t v : {0x51525354U, 0x55565758U, 0xFFFFFFFFU}) b.u32(v);
  b.finish();
  return b;
}

FixReport fix_report() {
  FixReport r;
  r.number = 0x01020304U;
  r.status = 0x21;
  r.map_window_full = 0x22;
  r.dx_m = 0.1;
  r.dy_m = -0.2;
  r.dyaw_rad = 1e-300;
  r.scale = 1.02;
  r.rms_m = 0.05F;
  r.sigma_xy_m = 0.06F;
  r.sigma_yaw_rad = 0.07F;
  r.local_boulders = 0x3132;
  r.map_boulders = 0x3334;
  r.pairs = 0x3536;
  r.trimmed = 0x3738;
  r.gated = 0x393A;
  r.iterations = 0x3B3C;
  r.snapshot = 0x41424344U;
  r.lost = 0x45;
  r.chi2 = 1.25F;
  r.log_ratio = 41.5F;
  r.second_log_ratio = -7.1F;
  r.chance_log = 1000.0F;
  r.hypotheses = 0x51525354U;
  r.windows = 0x61;
  r.windows_log_ratio = 17.5F;
  return r;
}

PacketBytes fix_bytes() {
  PacketBytes b(2, kSequence);
  b.u32(0x01020304U);
  b.u8(0x21);
  b.u8(0x22);
  for (const double v : {0.1, -0.2, 1e-300, 1.02}) b.f64(v);
  for (const float v : {0.05F, 0.06F, 0.07F}) b.f32(v);
  for (const unsigned v : {0x3132U, 0x3334U, 0x3536U, 0x3738U, 0x393AU, 0x3B3CU}) b.u16(v);
  b.u32(0x41424344U);
  b.u8(0x45);
  for (const float v : {1.25F, 41.5F, -7.1F, 1000.0F}) b.f32(v);
  b.u32(0x51525354U);
  b.u8(0x61);
  b.f32(17.5F);
  b.finish();
  return b;
}

PacketBytes boulder_bytes() {
  PacketBytes b(3, kSequence);
  b.u32(0x01020304U);
  for (const double v : {12.5, -24.3, 0.125}) b.f64(v);
  b.f32(0.3F);
  b.f32(0.04F);
  b.u16(0x3132);
  b.finish();
  return b;
}
const BoulderReport kBoulder{0x01020304U, 12.5, -24.3, 0.125, 0.3F, 0.04F, 0x3132};

PacketBytes ack_bytes() {
  PacketBytes b(4, kSequence);
  b.u32(0x01020304U);
  for (const unsigned v : {0x21U, 0x22U, 0x23U}) b.u8(v);
  b.u32(0x05060708U);
  b.finish();
  return b;
}
const AckReport kAck{0x01020304U, 0x21, 0x22, 0x23, 0x05060708U};

HealthReport health_report() {
  HealthReport r;
  std::uint32_t next = 0xA0000001U;
  r.frames = next++;
  for (std::uint32_t& v : r.vo) v = next++;
  for (std::uint32_t& v : r.watch) v = next++;
  for (std::uint32_t& v : r.boulders) v = next++;
  for (std::uint32_t& v : r.fixes) v = next++;
  for (std::uint32_t& v : r.gravity) v = next++;
  for (std::uint32_t& v : r.headings) v = next++;
  for (std::uint32_t& v : r.overruns) v = next++;
  r.extrapolated = next++;
  r.abandoned_boulders = next++;
  r.dropped_tracks = next++;
  r.dropped_pairs = next++;
  for (std::uint32_t& v : r.pairs) v = next++;
  r.missed_pairs = next++;
  r.bad_priors = next++;
  r.bad_attitudes = next++;
  for (std::uint32_t& v : r.commands) v = next++;
  r.lost_packets = next++;
  r.map_status = 0x77;
  r.map_crc = 0x01020304U;
  r.halved = 0x05060708U;
  r.rows_px = 0.5F;
  r.columns_px = -0.25F;
  r.lens = -2.0F;
  r.turn_x_rad = 1.5F;
  r.turn_z_rad = -1.0F;
  r.baseline_y_rad = 3.0F;
  r.baseline_z_rad = -4.0F;
  for (std::uint32_t& v : r.heights) v = next++;
  return r;
}

PacketBytes health_bytes() {
  PacketBytes b(5, kSequence);
  for (std::uint32_t i = 1; i <= 84; ++i) b.u32(0xA0000000U + i);
  b.u8(0x77);
  b.u32(0x01020304U);
  b.u32(0x05060708U);
  for (const std::uint32_t v :
       {0x3F000000U, 0xBE800000U, 0xC0000000U, 0x3FC00000U, 0xBF800000U, 0x40400000U, 0xC0800000U})
    b.u32(v);
  for (std::uint32_t i = 85; i <= 92; ++i) b.u32(0xA0000000U + i);
  b.finish();
  return b;
}

UploadReport upload_report() {
  UploadReport r;
  r.status = 0x21;
  r.detail = 0x22;
  r.kind = 0x23;
  r.id = 0x01020304U;
  r.bytes = 0x05060708U;
  r.chunk_bytes = 0x3132;
  r.chunks = 0x3334;
  r.taken = 0x3536;
  r.first_missing = 0x3738;
  std::uint32_t next = 0xB0000001U;
  for (std::uint32_t& v : r.counts) v = next++;
  for (int i = 0; i < 256; ++i) r.missing[i] = static_cast<std::uint8_t>(i * 7);
  return r;
}

PacketBytes upload_bytes() {
  PacketBytes b(6, kSequence);
  for (const unsigned v : {0x21U, 0x22U, 0x23U}) b.u8(v);
  b.u32(0x01020304U);
  b.u32(0x05060708U);
  for (const unsigned v : {0x3132U, 0x3334U, 0x3536U, 0x3738U}) b.u16(v);
  for (std::uint32_t i = 1; i <= 8; ++i) b.u32(0xB0000000U + i);
  for (unsigned i = 0; i < 256; ++i) b.u8(i * 7 & 0xFFU);
  b.finish();
  return b;
}

Packet packet;
PacketBytes damaged;

/// Writes the bytes of the ICD; reads them back to a report that writes them again.
template <typename Report>
void check_round_trip(const Report& report, const PacketBytes& expected, int expected_type,
                      std::size_t icd_size) {
  encode(report, kSequence, packet);
  assert_int_equal(packet.size(), icd_size);
  assert_int_equal(expected.size(), icd_size);
  assert_memory_equal(packet.data(), expected.data(), icd_size);
  PacketHead head;
  assert_status(check_packet(packet.data(), packet.size(), head), PacketStatus::kGood);
  assert_int_equal(head.type, expected_type);
  assert_int_equal(head.sequence, kSequence);
  Report back;
  assert_status(decode(expected.data(), expected.size(), back), PacketStatus::kGood);
  encode(back, kSequence, packet);
  assert_memory_equal(packet.data(), expected.data(), icd_size);
}

void test_every_byte_is_as_the_icd_says(void**) {
  check_round_trip(frame_report(), frame_bytes(), 1, 206);
  check_round_trip(fix_report(), fix_bytes(), 2, 104);
  check_round_trip(kBoulder, boulder_bytes(), 3, 50);
  check_round_trip(kAck, ack_bytes(), 4, 23);
  check_round_trip(health_report(), health_bytes(), 5, 417);
  check_round_trip(upload_report(), upload_bytes(), 6, 319);
}

void test_numbers_that_are_none_come_through(void**) {
  FixReport r = fix_report();
  r.dx_m = std::numeric_limits<double>::quiet_NaN();
  r.dy_m = -std::numeric_limits<double>::infinity();
  r.rms_m = std::numeric_limits<float>::quiet_NaN();
  encode(r, 1, packet);
  FixReport back;
  assert_status(decode(packet.data(), packet.size(), back), PacketStatus::kGood);
  assert_true(std::isnan(back.dx_m) && std::isinf(back.dy_m) && back.dy_m < 0.0 && std::isnan(back.rms_m));
  assert_near(back.dyaw_rad, r.dyaw_rad, 0.0);
}

template <typename Report>
PacketStatus status_of(const PacketBytes& b, std::size_t size) {
  Report report;
  return decode(b.data(), size, report);
}

/// No decoder takes what is damaged, and the report stays as it was.
template <typename Report>
void check_every_flip(const PacketBytes& good) {
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    damaged = good;
    damaged.data()[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
    const PacketStatus expected =
        bit / 8 == 2 || bit / 8 == 3 ? PacketStatus::kBadSize : PacketStatus::kBadCrc;
    assert_status(status_of<Report>(damaged, damaged.size()), expected);
  }
}

void test_every_single_flip_is_detected(void**) {
  check_every_flip<FrameReport>(frame_bytes());
  check_every_flip<FixReport>(fix_bytes());
  check_every_flip<BoulderReport>(boulder_bytes());
  check_every_flip<AckReport>(ack_bytes());
  check_every_flip<HealthReport>(health_bytes());
  check_every_flip<UploadReport>(upload_bytes());
}

void test_every_length_is_judged(void**) {
  const PacketBytes good = frame_bytes();
  for (std::size_t size = 0; size < good.size() + 8; ++size) {
    if (size == good.size()) continue;
    assert_status(status_of<FrameReport>(good, size),
                  size < 12 ? PacketStatus::kTooShort : PacketStatus::kBadSize);
  }
  FrameReport report;
  assert_status(decode(nullptr, good.size(), report), PacketStatus::kTooShort);
}

void test_a_size_that_is_not_the_types(void**) {
  damaged = fix_bytes();
  damaged.seal(damaged.size() - 2);
  assert_status(status_of<FixReport>(damaged, damaged.size()), PacketStatus::kBadSize);
  damaged = fix_bytes();
  damaged.seal(damaged.size() + 1);
  assert_status(status_of<FixReport>(damaged, damaged.size()), PacketStatus::kBadSize);
  damaged.seal(12);  // no body
  assert_status(status_of<FixReport>(damaged, damaged.size()), PacketStatus::kBadSize);
}

void test_other_versions_and_types(void**) {
  for (const int version : {0, 2, 255}) {
    damaged = ack_bytes();
    damaged.data()[1] = static_cast<std::uint8_t>(version);
    damaged.seal(damaged.size());
    assert_status(status_of<AckReport>(damaged, damaged.size()), PacketStatus::kBadVersion);
  }
  assert_status(status_of<FrameReport>(fix_bytes(), 104), PacketStatus::kOtherType);
  assert_status(status_of<FixReport>(boulder_bytes(), 50), PacketStatus::kOtherType);
  assert_status(status_of<BoulderReport>(ack_bytes(), 23), PacketStatus::kOtherType);
  assert_status(status_of<AckReport>(health_bytes(), 417), PacketStatus::kOtherType);
  assert_status(status_of<HealthReport>(upload_bytes(), 319), PacketStatus::kOtherType);
  assert_status(status_of<UploadReport>(frame_bytes(), 206), PacketStatus::kOtherType);
  for (const int type : {0, 7, 255}) {
    damaged = ack_bytes();
    damaged.data()[0] = static_cast<std::uint8_t>(type);
    damaged.seal(damaged.size());
    assert_status(status_of<AckReport>(damaged, damaged.size()), PacketStatus::kOtherType);
  }
}

void test_a_refused_packet_leaves_the_report(void**) {
  damaged = ack_bytes();
  damaged.data()[9] ^= 1U;
  AckReport report{7, 8, 9, 10};
  assert_status(decode(damaged.data(), damaged.size(), report), PacketStatus::kBadCrc);
  assert_int_equal(report.command_sequence, 7);
  assert_int_equal(report.command_type, 8);
  assert_int_equal(report.status, 9);
  assert_int_equal(report.detail, 10);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_every_byte_is_as_the_icd_says),
      cmocka_unit_test(test_numbers_that_are_none_come_through),
      cmocka_unit_test(test_every_single_flip_is_detected),
      cmocka_unit_test(test_every_length_is_judged),
      cmocka_unit_test(test_a_size_that_is_not_the_types),
      cmocka_unit_test(test_other_versions_and_types),
      cmocka_unit_test(test_a_refused_packet_leaves_the_report),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
