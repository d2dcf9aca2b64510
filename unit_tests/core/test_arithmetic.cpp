// The small arithmetic of formulas, at its ends.
#include "core/arithmetic.hpp"

#include <cmath>

#include "support/cmocka.hpp"

using namespace cairn;

namespace {

void test_clamped_on_both_sides(void**) {
  assert_true(clamped(3.0, 2.0) == 2.0);
  assert_true(clamped(-3.0, 2.0) == -2.0);
  assert_true(clamped(-1.5, 2.0) == -1.5);
}

void test_ends_are_in_range(void**) {
  assert_true(in_range(1.0, 1.0, 2.0));
  assert_true(in_range(2.0, 1.0, 2.0));
  assert_false(in_range(2.5, 1.0, 2.0));
  assert_false(in_range(0.5, 1.0, 2.0));
}

void test_no_number_is_in_no_range(void**) {
  const double none = std::nan("");
  assert_false(in_range(none, 1.0, 2.0));
  assert_false(in_range(1.5, none, 2.0));
  assert_false(in_range(1.5, 1.0, none));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_clamped_on_both_sides),
      cmocka_unit_test(test_ends_are_in_range),
      cmocka_unit_test(test_no_number_is_in_no_range),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
