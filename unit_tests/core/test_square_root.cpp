// The square root is correctly rounded on every target: an instruction here, own code there.
#include <cmath>
#include <cstring>
#include <limits>

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

// Through a pointer, so that the compiler computes nothing by itself.
double (*volatile root)(double) = [](double x) { return std::sqrt(x); };
float (*volatile root_single)(float) = [](float x) { return std::sqrt(x); };

std::uint64_t bits_of(double x) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &x, sizeof bits);
  return bits;
}
double of_bits(std::uint64_t bits) {
  double x = 0.0;
  std::memcpy(&x, &bits, sizeof x);
  return x;
}

/// Two digits of the radicand at a time, in integers: 53 bits of root, one more to round by,
/// and what remains.
std::uint64_t rounded_root_bits(std::uint64_t bits) {
  const int exponent = static_cast<int>(bits >> 52U) - 1023;
  const int odd = exponent & 1;
  const std::uint64_t radicand = ((bits & 0xFFFFFFFFFFFFFULL) | 0x10000000000000ULL) << (2 + odd);
  std::uint64_t root_bits = 0;
  std::uint64_t rest = 0;
  for (int i = 0; i < 54; ++i) {
    const std::uint64_t digits = i < 28 ? radicand >> (54 - 2 * i) & 3U : 0;
    rest = rest << 2U | digits;
    root_bits <<= 1U;
    if (rest > 2 * root_bits) {
      rest -= 2 * root_bits + 1;
      root_bits |= 1U;
    }
  }
  const std::uint64_t mantissa = (root_bits >> 1U) + (root_bits & 1U);  // a tie is impossible
  return mantissa + (static_cast<std::uint64_t>((exponent - odd) / 2 + 1022) << 52U);
}

void check(double x) {
  const std::uint64_t expected = rounded_root_bits(bits_of(x));
  if (bits_of(root(x)) != expected) fail_msg("sqrt(%.17g) = %.17g, not %.17g", x, root(x), of_bits(expected));
}

void test_rounds_to_nearest(void**) {
  Random random(7);
  for (int i = 0; i < 20000; ++i) {
    const std::uint64_t mantissa = static_cast<std::uint64_t>(random.next()) << 20U ^ random.next();
    const std::uint64_t exponent = 1 + random.below(2046);
    check(of_bits(exponent << 52U | (mantissa & 0xFFFFFFFFFFFFFULL)));
  }
}

void test_near_squares_and_midpoints(void**) {
  Random random(8);
  for (int i = 0; i < 5000; ++i) {
    const double s = 1.0 + random.next() * 0x1p-32 + (i % 2 == 0 ? 0.0 : random.below(1024) * 0x1p-52);
    const std::uint64_t square = bits_of(s * s);
    for (std::uint64_t off = 0; off < 5; ++off) check(of_bits(square + off - 2));
  }
  for (const double x : {1.0, 2.0, 3.0, 4.0, 0.25, 1.0 - 0x1p-53, 1.0 + 0x1p-52, 2.0 - 0x1p-52, 4.0 - 0x1p-51,
                         std::numeric_limits<double>::min(), std::numeric_limits<double>::max()}) {
    check(x);
  }
}

void test_special_values(void**) {
  assert_true(bits_of(root(0.0)) == 0);
  assert_true(bits_of(root(-0.0)) == bits_of(-0.0));
  assert_true(std::isinf(root(HUGE_VAL)));
  assert_true(std::isnan(root(-1.0)) && std::isnan(root(-HUGE_VAL)) && std::isnan(root(NAN)));
  assert_true(root(0x1p-1074) == 0x1p-537);
  assert_true(root(9 * 0x1p-1074) == 3 * 0x1p-537);
}

void test_single_precision(void**) {
  Random random(9);
  for (int i = 0; i < 20000; ++i) {
    const std::uint32_t bits = 0x00800000U + random.below(0x7F000000U);
    float x = 0.0F;
    std::memcpy(&x, &bits, sizeof x);
    const float exact = static_cast<float>(of_bits(rounded_root_bits(bits_of(static_cast<double>(x)))));
    if (root_single(x) != exact) fail_msg("sqrtf(%.9g)", static_cast<double>(x));
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_rounds_to_nearest),
      cmocka_unit_test(test_near_squares_and_midpoints),
      cmocka_unit_test(test_special_values),
      cmocka_unit_test(test_single_precision),
  };
  return cmocka_run_group_tests_name("core/square_root", tests, nullptr, nullptr);
}
