// The generator: values of the formula computed elsewhere (whole-number arithmetic of another language),
// ranges, and an even spread.
#include "core/random.hpp"

#include "support/cmocka.hpp"

using namespace cairn;

namespace {

void test_known_values(void**) {
  Random one(1);
  for (const std::uint32_t v : {0x33ED7CE0U, 0xF3193D19U, 0xE6E1FB00U, 0xCD027776U})
    assert_int_equal(one.next(), v);
  Random zero(0);
  for (const std::uint32_t v : {0xB99C5774U, 0xC5344D14U, 0x91CF3BF5U, 0x9B84069AU})
    assert_int_equal(zero.next(), v);
  Random large(0xDEADBEEFCAFEF00DULL);
  for (const std::uint32_t v : {0xFB69C16BU, 0x9BE58E55U, 0x3F82C69FU, 0x4F93DF81U})
    assert_int_equal(large.next(), v);
}

void test_below_stays_below(void**) {
  Random random(5);
  for (const std::uint32_t bound : {1U, 2U, 3U, 600U, 65535U}) {
    bool least = false;
    for (int i = 0; i < 2000; ++i) {
      const std::uint32_t v = random.below(bound);
      assert_true(v < bound);
      least = least || v < (bound + 9) / 10;
    }
    assert_true(least);
  }
}

void test_even_spread(void**) {
  // Chi-squared of 64 classes: mean 63, standard deviation 11.
  Random random(7);
  int count[64] = {};
  constexpr int kDraws = 64 * 1000;
  for (int i = 0; i < kDraws; ++i) ++count[random.below(64)];
  double chi2 = 0.0;
  for (const int c : count) chi2 += (c - 1000.0) * (c - 1000.0) / 1000.0;
  assert_at_most(chi2, 63.0 + 4 * 11.0);
  assert_at_least(chi2, 63.0 - 4 * 11.0);
}

void test_neighbours_are_not_related(void**) {
  // Correlation of successive draws: standard deviation 1/sqrt(n).
  Random random(11);
  constexpr int kDraws = 40000;
  double sum = 0.0;
  double last = random.next() / 4294967296.0 - 0.5;
  for (int i = 0; i < kDraws; ++i) {
    const double v = random.next() / 4294967296.0 - 0.5;
    sum += v * last;
    last = v;
  }
  assert_near(sum * 12.0 / kDraws, 0.0, 4.0 / std::sqrt(kDraws));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_known_values),
      cmocka_unit_test(test_below_stays_below),
      cmocka_unit_test(test_even_spread),
      cmocka_unit_test(test_neighbours_are_not_related),
  };
  return cmocka_run_group_tests_name("random", tests, nullptr, nullptr);
}
