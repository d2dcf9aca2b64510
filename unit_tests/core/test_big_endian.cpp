// Big-endian fields: the bytes themselves, and round trips at the corners, at odd addresses.
#include "core/big_endian.hpp"

#include "support/cmocka.hpp"

using namespace cairn;

namespace {

std::uint8_t room[17];
std::uint8_t* const odd = room + 1;

void assert_bytes(std::initializer_list<int> expected) {
  int i = 0;
  for (const int b : expected) assert_int_equal(odd[i++], b);
}

void test_bytes_on_the_wire(void**) {
  be::put_u16(odd, 0x0102);
  assert_bytes({1, 2});
  be::put_u32(odd, 0x01020384U);
  assert_bytes({1, 2, 3, 0x84});
  be::put_u64(odd, 0x8102030405060708ULL);
  assert_bytes({0x81, 2, 3, 4, 5, 6, 7, 8});
  be::put_f32(odd, -1.5F);  // IEEE 754: sign, exponent 127, fraction 0.5
  assert_bytes({0xBF, 0xC0, 0, 0});
  be::put_f64(odd, 1.0);
  assert_bytes({0x3F, 0xF0, 0, 0, 0, 0, 0, 0});
}

void test_integers_round_trip(void**) {
  for (const std::uint32_t v : {0U, 1U, 0x7FFFU, 0x8000U, 0xFFFFU}) {
    be::put_u16(odd, static_cast<std::uint16_t>(v));
    assert_int_equal(be::get_u16(odd), v);
  }
  for (const std::uint32_t v : {0U, 1U, 0x7FFFFFFFU, 0x80000000U, 0xFFFFFFFFU, 0x12345678U}) {
    be::put_u32(odd, v);
    assert_int_equal(be::get_u32(odd), v);
    be::put_u64(odd, (static_cast<std::uint64_t>(v) << 32U) | ~v);
    assert_true(be::get_u64(odd) == ((static_cast<std::uint64_t>(v) << 32U) | ~v));
  }
}

void test_floats_keep_their_bits(void**) {
  for (const double v : {0.0, -0.0, 1.0 / 3.0, -1e300, 5e-324, static_cast<double>(INFINITY)}) {
    be::put_f64(odd, v);
    const double back = be::get_f64(odd);
    assert_memory_equal(&back, &v, sizeof v);
    const auto f = static_cast<float>(v);
    be::put_f32(odd, f);
    const float back_f = be::get_f32(odd);
    assert_memory_equal(&back_f, &f, sizeof f);
  }
  be::put_f64(odd, NAN);
  assert_true(std::isnan(be::get_f64(odd)));
  be::put_f32(odd, NAN);
  assert_true(std::isnan(be::get_f32(odd)));
}

void test_neighbours_are_left_alone(void**) {
  for (std::uint8_t& b : room) b = 0x5A;
  be::put_f64(odd, -1.0);
  assert_int_equal(room[0], 0x5A);
  assert_int_equal(room[9], 0x5A);
  be::put_u32(odd + 10, 0xFFFFFFFFU);
  assert_int_equal(room[10], 0x5A);
  assert_int_equal(room[15], 0x5A);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_bytes_on_the_wire),
      cmocka_unit_test(test_integers_round_trip),
      cmocka_unit_test(test_floats_keep_their_bits),
      cmocka_unit_test(test_neighbours_are_left_alone),
  };
  return cmocka_run_group_tests_name("big_endian", tests, nullptr, nullptr);
}
