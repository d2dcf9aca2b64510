// Telecommands against doc/ICD.md: every byte, every status, every flipped bit.
#include "app/telecommand.hpp"

#include <limits>

#include "app/packet_bytes.hpp"
#include "support/cmocka.hpp"
#include "support/death.hpp"

using namespace cairn;
using namespace cairn::app;
using cairn::test::PacketBytes;

namespace {

constexpr std::uint32_t kSequence = 0x81726354U;
const Pose3 kPose{Quat(0.5, -0.5, 0.25, 0.75), Vec3(1.5, -2.25, 1e-3)};
constexpr std::size_t kSizes[] = {84, 28, 72, 12, 23, 29, 16, 12, 64};  // by type, from 1
constexpr std::uint8_t kChunk[] = {9, 8, 7, 6, 5, 4, 3, 2, 1, 0, 10, 11, 12, 13, 14, 15, 16};
constexpr int kLastType = 9;

Packet packet;
PacketBytes damaged;

Command command(int type) {
  Command c;
  c.type = static_cast<CommandType>(type);
  c.sequence = kSequence;
  c.pair = 0x91929394U;
  c.pose = kPose;
  c.number[0] = 0.05;
  c.number[1] = -0.01;
  c.attitude = {{0.1, -0.2, 0.97}, 0.003, -1.5, 0.004};
  c.upload = {0x21, 0xA1A2A3A4U, 0xB1B2B3B4U, 0xC1C2};
  c.chunk = kChunk;
  c.chunk_bytes = sizeof kChunk;
  return c;
}

PacketBytes bytes_of(int type) {
  PacketBytes b(static_cast<std::uint8_t>(type), kSequence);
  if (type == 3 || type == 9) b.u32(0x91929394U);
  if (type == 1 || type == 3) b.pose(kPose);
  if (type == 1 || type == 2) {
    b.f64(0.05);
    b.f64(-0.01);
  }
  if (type == 9) {
    for (const double v : {0.1, -0.2, 0.97, 0.003, -1.5, 0.004}) b.f64(v);
  }
  if (type == 5) b.u8(0x21);
  if (type == 5 || type == 7) b.u32(0xA1A2A3A4U);
  if (type == 5) {
    b.u32(0xB1B2B3B4U);
    b.u16(0xC1C2);
  }
  if (type == 6) {
    for (const std::uint8_t v : kChunk) b.u8(v);
  }
  b.finish();
  return b;
}

CommandStatus status_of(const PacketBytes& b) {
  Command out;
  return decode(b.data(), b.size(), out);
}

void test_every_byte_is_as_the_icd_says(void**) {
  for (int type = 1; type <= kLastType; ++type) {
    const PacketBytes expected = bytes_of(type);
    encode(command(type), packet);
    assert_int_equal(packet.size(), kSizes[type - 1]);
    assert_int_equal(expected.size(), kSizes[type - 1]);
    assert_memory_equal(packet.data(), expected.data(), expected.size());
    Command back;
    assert_status(decode(expected.data(), expected.size(), back), CommandStatus::kAccepted);
    assert_status(back.type, type);
    assert_int_equal(back.sequence, kSequence);
    assert_int_equal(back.crc, be::get_u32(expected.data() + expected.size() - 4));
    encode(back, packet);
    assert_memory_equal(packet.data(), expected.data(), expected.size());
  }
}

void test_the_largest_chunk_fills_a_packet(void**) {
  static std::uint8_t chunk[kMaxChunkBytes];
  for (std::size_t i = 0; i < sizeof chunk; ++i) chunk[i] = static_cast<std::uint8_t>(i * 31);
  Command c = command(6);
  c.chunk = chunk;
  c.chunk_bytes = sizeof chunk;
  encode(c, packet);
  assert_int_equal(packet.size(), kMaxPacketBytes);
  Command back;
  assert_status(decode(packet.data(), packet.size(), back), CommandStatus::kAccepted);
  assert_int_equal(back.chunk_bytes, sizeof chunk);
  assert_memory_equal(back.chunk, chunk, sizeof chunk);
  assert_int_equal(kMaxChunkDataBytes, 490);
}

void test_content_is_taken_as_it_comes(void**) {
  Command c = command(1);
  c.pose.t.x() = std::numeric_limits<double>::quiet_NaN();
  c.number[0] = -std::numeric_limits<double>::infinity();
  encode(c, packet);
  Command back;
  assert_status(decode(packet.data(), packet.size(), back), CommandStatus::kAccepted);
  assert_true(std::isnan(back.pose.t.x()) && std::isinf(back.number[0]));
}

void test_every_single_flip_is_detected(void**) {
  for (int type = 1; type <= kLastType; ++type) {
    const PacketBytes good = bytes_of(type);
    for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
      damaged = good;
      damaged.data()[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
      assert_status(status_of(damaged), CommandStatus::kBadPacket);
    }
  }
}

void test_every_length_is_judged(void**) {
  Command out;
  for (int type = 1; type <= kLastType; ++type) {
    const PacketBytes good = bytes_of(type);
    for (std::size_t size = 0; size < good.size() + 8; ++size) {
      if (size != good.size()) assert_status(decode(good.data(), size, out), CommandStatus::kBadPacket);
      if (size < 12 || size == good.size()) continue;
      damaged = good;  // a good packet, but too short or too long for its type
      damaged.seal(size);
      const bool may_be = type == 6 && size >= 12 + 11;  // a chunk has no size of its own
      assert_status(status_of(damaged), may_be ? CommandStatus::kAccepted : CommandStatus::kBadPacket);
    }
  }
  assert_status(decode(nullptr, 12, out), CommandStatus::kBadPacket);
}

void test_unknown_types_and_versions(void**) {
  for (const int type : {0, 10, 255}) {
    damaged = bytes_of(4);
    damaged.data()[0] = static_cast<std::uint8_t>(type);
    damaged.seal(damaged.size());
    assert_status(status_of(damaged), CommandStatus::kUnknownType);
  }
  damaged = bytes_of(4);
  damaged.data()[1] = 2;
  damaged.seal(damaged.size());
  assert_status(status_of(damaged), CommandStatus::kBadPacket);
}

void test_own_errors_assert(void**) {
  assert_true(test::asserts([] { encode(command(10), packet); }));
  assert_true(test::asserts([] {  // less than a chunk with a byte in it
    Command c = command(6);
    c.chunk_bytes = 10;
    encode(c, packet);
  }));
  assert_true(test::asserts([] {  // more than a packet holds
    static std::uint8_t much[kMaxChunkBytes + 1];
    Command c = command(6);
    c.chunk = much;
    c.chunk_bytes = sizeof much;
    encode(c, packet);
  }));
  assert_false(test::asserts([] { encode(command(4), packet); }));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_every_byte_is_as_the_icd_says),
      cmocka_unit_test(test_the_largest_chunk_fills_a_packet),
      cmocka_unit_test(test_content_is_taken_as_it_comes),
      cmocka_unit_test(test_every_single_flip_is_detected),
      cmocka_unit_test(test_every_length_is_judged),
      cmocka_unit_test(test_unknown_types_and_versions),
      cmocka_unit_test(test_own_errors_assert),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
