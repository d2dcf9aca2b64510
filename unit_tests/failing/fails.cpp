// Fails on purpose: a target on which it passes would pass every test. Not among the tests; `make test` wants
// it to end with a failure, after CMocka has gone on to the next test and said so.
#include "support/cmocka.hpp"

namespace {

void test_that_fails(void**) { assert_int_equal(1 + 1, 3); }
void test_after_it(void**) {}

}  // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_that_fails), cmocka_unit_test(test_after_it)};
  return cmocka_run_group_tests_name("failing", tests, nullptr, nullptr);
}
