// The nearest whole number, against the library's.
#include "core/rounding.hpp"

#include <cmath>

#include "support/cmocka.hpp"

using namespace cairn;

namespace {

void test_as_the_library(void**) {
  for (int i = -4000; i <= 4000; ++i) {
    const double x = i / 16.0;
    assert_int_equal(rounded(x), static_cast<int>(std::floor(x + 0.5)));
  }
}

void test_halves_go_up(void**) {
  assert_int_equal(rounded(0.5), 1);
  assert_int_equal(rounded(-0.5), 0);
  assert_int_equal(rounded(-1.5), -1);
  assert_int_equal(rounded(-1.75), -2);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_as_the_library),
      cmocka_unit_test(test_halves_go_up),
  };
  return cmocka_run_group_tests_name("core/rounding", tests, nullptr, nullptr);
}
