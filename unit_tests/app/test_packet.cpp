// The framing of packets: writer and sizer. Reading, and what is refused: test_telemetry, test_telecommand.
#include "app/packet.hpp"

#include "core/crc32.hpp"
#include "support/cmocka.hpp"
#include "support/death.hpp"

using namespace cairn;
using namespace cairn::app;

namespace {

Packet out;

void test_header_body_crc(void**) {
  PacketWriter w(out, {7, 0x01020304U});
  w.field(std::uint16_t{0xABCD});
  w.finish();
  const std::uint8_t expected[] = {7, 1, 0, 14, 1, 2, 3, 4, 0xAB, 0xCD};
  assert_int_equal(out.size(), 14);
  assert_memory_equal(out.data(), expected, sizeof expected);
  assert_int_equal(be::get_u32(out.data() + 10), crc32(expected, sizeof expected));
}

void test_a_writer_begins_anew(void**) {
  PacketWriter(out, {1, 2}).finish();
  PacketWriter(out, {1, 2}).finish();
  assert_int_equal(out.size(), 12);
}

void test_sizer_counts_what_the_writer_writes(void**) {
  const auto walk = [](auto& walker) {
    const std::uint8_t a = 1;
    const std::array<std::uint16_t, 3> b = {1, 2, 3};
    const std::uint64_t c = 4;
    const std::array<float, 2> d = {1.0F, 2.0F};
    const double e = 3.0;
    walker.field(a);
    walker.field(b);
    walker.field(c);
    walker.field(d);
    walker.field(e);
    walker.field(Pose3());
  };
  PacketWriter w(out, {1, 2});
  walk(w);
  w.finish();
  PacketSizer sizer;
  walk(sizer);
  assert_int_equal(out.size(), 8 + 1 + 6 + 8 + 8 + 8 + 56 + 4);
  assert_int_equal(sizer.packet_bytes(), out.size());
}

void test_no_room_is_our_own_error(void**) {
  const auto write = [](std::size_t body_bytes) {
    PacketWriter w(out, {1, 2});
    for (std::size_t i = 0; i < body_bytes; ++i) w.field(std::uint8_t{3});
    w.finish();
  };
  write(kMaxPacketBytes - 12);
  assert_int_equal(out.size(), kMaxPacketBytes);
  assert_true(test::asserts([&] { write(kMaxPacketBytes - 11); }));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_header_body_crc),
      cmocka_unit_test(test_a_writer_begins_anew),
      cmocka_unit_test(test_sizer_counts_what_the_writer_writes),
      cmocka_unit_test(test_no_room_is_our_own_error),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
