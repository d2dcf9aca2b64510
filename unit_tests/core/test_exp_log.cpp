// Own exponential and logarithm against the host's libm.
#include "core/exp_log.hpp"

#include <cstdint>
#include <cstring>
#include <limits>

#include "core/random.hpp"
#include "support/cmocka.hpp"

namespace {

/// Distance in units of the last place of `want`.
double ulps(double got, double want) {
  const double next = std::nextafter(std::fabs(want), std::numeric_limits<double>::infinity());
  return std::fabs(got - want) / (next - std::fabs(want));
}

void test_exp_against_libm(void**) {
  double worst = 0.0;
  for (int i = -708000; i <= 709000; ++i) {
    const double x = i * 0.001 + 0.0001234567;
    worst = std::fmax(worst, ulps(cairn::exp(x), std::exp(x)));
  }
  for (int i = -200000; i <= 200000; ++i) {
    const double x = i * 1e-6 + 1e-9;
    worst = std::fmax(worst, ulps(cairn::exp(x), std::exp(x)));
  }
  assert_true(worst <= 2.0);
  assert_near(cairn::exp(0.0), 1.0, 0.0);
}

void test_ln_against_libm(void**) {
  cairn::Random random(3);
  double worst = 0.0;
  for (int i = 0; i < 2000000; ++i) {
    const std::uint64_t high = random.next();
    std::uint64_t bits = (high << 32U) | random.next();
    // Positive, normal.
    bits = (bits & 0x7FFFFFFFFFFFFFFFULL) % 0x7FE0000000000000ULL + 0x0010000000000000ULL;
    double x = 0.0;
    std::memcpy(&x, &bits, sizeof x);
    worst = std::fmax(worst, ulps(cairn::ln(x), std::log(x)));
  }
  for (int i = -499999; i <= 1000000; ++i) {
    const double x = 1.0 + i * 1e-6 + 3e-12;  // where the result is small
    worst = std::fmax(worst, ulps(cairn::ln(x), std::log(x)));
  }
  assert_true(worst <= 2.0);
  assert_near(cairn::ln(1.0), 0.0, 0.0);
}

void test_edges(void**) {
  const double infinity = std::numeric_limits<double>::infinity();
  assert_true(std::isnan(cairn::exp(NAN)) && std::isnan(cairn::ln(NAN)) && std::isnan(cairn::ln(-1.0)));
  assert_true(cairn::exp(-709.0) == 0.0 && cairn::exp(-infinity) == 0.0);
  assert_true(cairn::exp(710.0) == infinity && cairn::exp(infinity) == infinity);
  assert_true(cairn::ln(0.0) == -infinity && cairn::ln(5e-324) == -infinity);
  assert_true(cairn::ln(infinity) == infinity);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_exp_against_libm),
      cmocka_unit_test(test_ln_against_libm),
      cmocka_unit_test(test_edges),
  };
  return cmocka_run_group_tests_name("core/exp_log", tests, nullptr, nullptr);
}
