// A failed assertion reaches the one handler; one that holds does nothing. Eigen's own checks end there too.
#include "core/assert.hpp"

#include "core/eigen.hpp"
#include "image/image_view.hpp"
#include "support/cmocka.hpp"
#include "support/death.hpp"

using namespace cairn;

namespace {

void test_handler(void**) {
  assert_true(test::asserts([] { CAIRN_ASSERT(1 + 1 == 3); }));
  assert_false(test::asserts([] { CAIRN_ASSERT(1 + 1 == 2); }));
  assert_true(test::asserts([] { assert_failed("file", 7); }));
}

void test_condition_is_evaluated_once(void**) {
  int count = 0;
  CAIRN_ASSERT(++count == 1);
  assert_int_equal(count, 1);
}

void test_eigen_asserts_end_in_the_handler(void**) {
  assert_true(test::asserts([] {
    volatile int row = 3;
    const Vec3 v(1.0, 2.0, 3.0);
    volatile double taken = v(row);
    static_cast<void>(taken);
  }));
}

void test_image_view_bounds(void**) {
  static std::uint8_t pixels[4 * 3];
  static const MutableImageU8 view = {pixels, 3, 3, 4};
  view.at(2, 1) = 9;
  assert_int_equal(pixels[1 * 4 + 2], 9);
  assert_true(view.contains(0, 0) && view.contains(2, 2));
  assert_false(view.contains(3, 0) || view.contains(0, 3) || view.contains(-1, 0) || view.contains(0, -1));
  assert_true(test::asserts([] { view.at(3, 0) = 1; }));
  assert_true(test::asserts([] { view.at(-1, 0) = 1; }));
  assert_true(test::asserts([] { view.at(0, 3) = 1; }));
  assert_true(test::asserts([] { view.at(0, -1) = 1; }));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_handler),
      cmocka_unit_test(test_condition_is_evaluated_once),
      cmocka_unit_test(test_eigen_asserts_end_in_the_handler),
      cmocka_unit_test(test_image_view_bounds),
  };
  return cmocka_run_group_tests_name("assert", tests, nullptr, nullptr);
}
