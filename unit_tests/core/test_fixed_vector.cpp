// The vector with its memory inside: order, the full one, and indices out of range.
#include "core/fixed_vector.hpp"

#include "support/cmocka.hpp"
#include "support/death.hpp"

using namespace cairn;

namespace {

void test_fills_in_order_and_refuses_when_full(void**) {
  FixedVector<int, 3> v;
  assert_true(v.empty());
  assert_false(v.full());
  assert_int_equal(v.capacity(), 3);
  for (int i = 0; i < 3; ++i) {
    assert_true(v.push_back(10 + i));
    assert_int_equal(v.back(), 10 + i);
    assert_int_equal(v.size(), i + 1);
  }
  assert_true(v.full());
  assert_false(v.push_back(99));
  assert_int_equal(v.size(), 3);
  int expected = 10;
  for (const int item : v) assert_int_equal(item, expected++);
  assert_int_equal(expected, 13);
  assert_ptr_equal(v.data(), v.begin());
  assert_int_equal(v.end() - v.begin(), 3);
}

void test_clear_and_resize(void**) {
  FixedVector<int, 4> v;
  for (int i = 0; i < 4; ++i) assert_true(v.push_back(i));
  v.resize(2);
  assert_int_equal(v.size(), 2);
  assert_int_equal(v.back(), 1);
  assert_true(v.push_back(7));
  assert_int_equal(v[2], 7);
  v.clear();
  assert_true(v.empty());
  v.resize(4);
  assert_true(v.full());
  assert_int_equal(v[0], 0);  // old content
}

void test_out_of_range_asserts(void**) {
  static FixedVector<int, 2> v;
  assert_true(test::asserts([] { v[0] = 1; }));
  assert_true(test::asserts([] { v.back() = 1; }));
  assert_true(v.push_back(5));
  assert_false(test::asserts([] { v[0] = 1; }));
  assert_true(test::asserts([] { v[1] = 1; }));
  assert_true(test::asserts([] { v[static_cast<std::size_t>(-1)] = 1; }));
  assert_false(test::asserts([] { v.append(6); }));
  assert_int_equal(v.back(), 6);
  assert_true(test::asserts([] { v.append(7); }));
  assert_false(test::asserts([] { v.resize(2); }));
  assert_true(test::asserts([] { v.resize(3); }));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_fills_in_order_and_refuses_when_full),
      cmocka_unit_test(test_clear_and_resize),
      cmocka_unit_test(test_out_of_range_asserts),
  };
  return cmocka_run_group_tests_name("fixed_vector", tests, nullptr, nullptr);
}
