// Heights of a tile: bits written by hand from doc/ICD.md, and bytes that nobody made.
#include "orbital_map/height_decoder.hpp"

#include "core/random.hpp"
#include "orbital_map/small_map.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using cmap::HeightDecoder;
using cmap::HeightStep;
using cmap::Post;

namespace {

std::uint8_t bytes[4096];
Post row[cmap::kMaxPosts];

void check_row(const int* value, const bool* known, unsigned columns) {
  for (unsigned i = 0; i < columns; ++i) {
    assert_int_equal(row[i].known(), known[i]);
    if (known[i]) assert_int_equal(row[i].value(), value[i]);
  }
}

/// Rows 7 8 6 and 7 9 100000 under k = 1: off what is predicted by 7, 1 and -2; then by 0, 1 and 99993.
void test_bits_by_hand(void**) {
  std::memset(bytes, 0, sizeof bytes);
  bytes[0] = 1;
  test::MapBits bits{bytes + 1};
  const auto code = [&](unsigned c) {
    for (unsigned n = 0; n < c / 2U; ++n) bits.bit(1);
    bits.bit(0);
    bits.bits(c % 2U, 1);
  };
  for (const unsigned c : {13U, 1U, 4U, 0U, 1U}) code(c);
  bits.bits(0xFFFF, 16);
  bits.bits(2U * 99993U - 1U, 27);
  const std::size_t size = 1 + (bits.used + 7U) / 8U;
  const bool known[] = {true, true, true};
  const int first[] = {7, 8, 6};
  const int second[] = {7, 9, 100000};
  HeightDecoder decoder;
  assert_true(decoder.start(3, 2, bytes, size));
  assert_status(decoder.read(row), HeightStep::kMore);
  check_row(first, known, 3);
  assert_status(decoder.read(row), HeightStep::kEnd);
  check_row(second, known, 3);
  assert_status(decoder.read(row), HeightStep::kCorrupt);
  // A byte more, a byte less, a bit in the rest of the last one.
  for (const std::size_t other : {size + 1, size - 1}) {
    assert_true(decoder.start(3, 2, bytes, other));
    assert_status(decoder.read(row), HeightStep::kMore);
    assert_status(decoder.read(row), HeightStep::kCorrupt);
  }
  bytes[size - 1] |= 1U;
  assert_true(decoder.start(3, 2, bytes, size));
  assert_status(decoder.read(row), HeightStep::kMore);
  assert_status(decoder.read(row), HeightStep::kCorrupt);
}

/// Rows 5 ? 6 and ? 4 4 under k = 0: both missing predict 5, so that 6 is 1 more, the 4 are 1 less than
/// 5 + 5 - 5 and 4 + 6 - 5.
void test_holes_by_hand(void**) {
  std::memset(bytes, 0, sizeof bytes);
  bytes[0] = cmap::kHoles;
  test::MapBits bits{bytes + 1};
  bits.bits(1, 1);
  bits.bits(0x3FE, 10);  // 5: code 9
  bits.bits(0, 1);
  bits.bits(1, 1);
  bits.bits(2, 2);  // 1: code 1
  bits.bits(0, 1);
  for (int i = 0; i < 2; ++i) bits.bits(0xE, 4);  // known, -1: code 2
  HeightDecoder decoder;
  assert_true(decoder.start(3, 2, bytes, 1 + (bits.used + 7U) / 8U));
  assert_status(decoder.read(row), HeightStep::kMore);
  const bool first_known[] = {true, false, true};
  const int first[] = {5, 0, 6};
  check_row(first, first_known, 3);
  assert_status(decoder.read(row), HeightStep::kEnd);
  const bool second_known[] = {false, true, true};
  const int second[] = {0, 4, 4};
  check_row(second, second_known, 3);
}

void test_refused_at_once(void**) {
  HeightDecoder decoder;
  assert_status(decoder.read(row), HeightStep::kCorrupt);
  assert_false(decoder.start(2, 2, bytes, 0));
  assert_status(decoder.read(row), HeightStep::kCorrupt);
  bytes[0] = cmap::kMaxRice + 1;
  assert_false(decoder.start(2, 2, bytes, 20));
  bytes[0] = cmap::kHoles | (cmap::kMaxRice + 1);
  assert_false(decoder.start(2, 2, bytes, 20));
}

void test_any_bytes_end(void**) {
  Random random(5);
  int ends = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const std::size_t size = 1 + random.below(trial % 2 == 0 ? 6 : 4000);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(random.next() >> 24U);
    bytes[0] = static_cast<std::uint8_t>(random.below(cmap::kMaxRice + 1) | random.below(2) << 7U);
    const unsigned columns = 2 + random.below(cmap::kMaxPosts - 1);
    const unsigned rows = 2 + random.below(cmap::kMaxPosts - 1);
    HeightDecoder decoder;
    assert_true(decoder.start(columns, rows, bytes, size));
    unsigned read = 0;
    HeightStep step = HeightStep::kMore;
    while (step == HeightStep::kMore) {
      step = decoder.read(row);
      ++read;
      for (unsigned i = 0; i < columns && step != HeightStep::kCorrupt; ++i)
        assert_in_range(row[i].value() + cmap::kMaxPostValue, 0, 2 * cmap::kMaxPostValue);
    }
    assert_at_most(read, rows);
    ends += step == HeightStep::kEnd ? 1 : 0;
  }
  assert_at_most(ends, 2000);  // bits that are left tell
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_bits_by_hand),
      cmocka_unit_test(test_holes_by_hand),
      cmocka_unit_test(test_refused_at_once),
      cmocka_unit_test(test_any_bytes_end),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
