// The writer, reader and sizer of packets.
#include "app/wire.hpp"

#include "core/fixed_vector.hpp"
#include "support/cmocka.hpp"
#include "support/death.hpp"

using namespace cairn;
using namespace cairn::app;

namespace {

using Bytes = FixedVector<std::uint8_t, 32>;

void test_header_body_crc(void**) {
  static Bytes out;
  Writer<Bytes> w(out, 7, 0x01020304U);
  w.field(std::uint16_t{0xABCD});
  w.finish();
  const std::uint8_t expected[] = {7, 1, 0, 14, 1, 2, 3, 4, 0xAB, 0xCD};
  assert_int_equal(out.size(), 14);
  assert_memory_equal(out.data(), expected, sizeof expected);
  assert_int_equal(be::get_u32(out.data() + 10), crc32(expected, sizeof expected));
}

void test_a_writer_begins_anew(void**) {
  static Bytes out;
  Writer<Bytes>(out, 1, 2).finish();
  Writer<Bytes>(out, 1, 2).finish();
  assert_int_equal(out.size(), 12);
}

void test_sizer_counts_what_the_writer_writes(void**) {
  using Wide = FixedVector<std::uint8_t, 200>;
  static Wide out;
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
  Writer<Wide> w(out, 1, 2);
  walk(w);
  w.finish();
  Sizer sizer;
  walk(sizer);
  assert_int_equal(out.size(), 8 + 1 + 6 + 8 + 8 + 8 + 56 + 4);
  assert_int_equal(sizer.packet_bytes(), out.size());
}

void test_no_room_is_our_own_error(void**) {
  assert_true(test::asserts([] {
    static Bytes out;
    Writer<Bytes> w(out, 1, 2);
    for (int i = 0; i < 4; ++i) w.field(1.0);
  }));
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
