// Budgets: the first unit is granted whatever it costs, later ones only where they fit.
#include "core/work_budget.hpp"

#include "support/cmocka.hpp"

using namespace cairn;

namespace {

void test_first_unit_is_granted(void**) {
  WorkBudget budget(1);
  assert_true(budget.take(1000));
  assert_int_equal(budget.spent(), 1000);
  assert_int_equal(budget.left(), 0);
  assert_false(budget.take(1));
  assert_int_equal(budget.spent(), 1000);
}

void test_exact_fit(void**) {
  WorkBudget budget(10);
  assert_true(budget.take(4));
  assert_int_equal(budget.left(), 6);
  assert_false(budget.take(7));
  assert_true(budget.take(6));
  assert_int_equal(budget.left(), 0);
  assert_false(budget.take(1));
}

void test_nothing_of_nothing(void**) {
  WorkBudget budget(0);
  assert_false(budget.take(1));
  assert_int_equal(budget.spent(), 0);
  assert_int_equal(budget.left(), 0);
}

void test_unlimited(void**) {
  WorkBudget budget = WorkBudget::unlimited();
  for (int i = 0; i < 5; ++i) assert_true(budget.take(UINT32_MAX));
  assert_true(budget.spent() == 5ULL * UINT32_MAX);
  assert_int_equal(budget.left(), UINT32_MAX);
}

void test_sums_beyond_32_bits_do_not_wrap(void**) {
  WorkBudget budget(UINT32_MAX - 1);
  assert_true(budget.take(UINT32_MAX - 2));
  assert_false(budget.take(UINT32_MAX));
  assert_true(budget.take(1));
  assert_int_equal(budget.left(), 0);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_first_unit_is_granted),
      cmocka_unit_test(test_exact_fit),
      cmocka_unit_test(test_nothing_of_nothing),
      cmocka_unit_test(test_unlimited),
      cmocka_unit_test(test_sums_beyond_32_bits_do_not_wrap),
  };
  return cmocka_run_group_tests_name("work_budget", tests, nullptr, nullptr);
}
