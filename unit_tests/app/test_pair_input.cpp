// What waits for its pair: each is had by its number, whenever it came, and none is lost unseen.
#include "app/pair_input.hpp"

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::app;

namespace {

Pose3 forward(double x_m) {
  Pose3 p;
  p.t.x() = x_m;
  return p;
}

void test_each_serves_its_pair(void**) {
  MotionPriors priors;
  priors.put(7, forward(0.7));
  priors.put(9, forward(0.9));
  assert_null(priors.of(8));
  assert_near(priors.of(7)->t.x(), 0.7, 0.0);
  assert_near(priors.of(9)->t.x(), 0.9, 0.0);
  priors.let_go(8);
  assert_null(priors.of(7));
  assert_non_null(priors.of(9));
  assert_int_equal(priors.unused(), 0);
}

void test_the_last_word_counts(void**) {
  MotionPriors priors;
  for (int i = 0; i < 100; ++i) priors.put(5, forward(i));
  assert_near(priors.of(5)->t.x(), 99.0, 0.0);
  assert_int_equal(priors.unused(), 0);
}

void test_what_was_never_asked_for_is_counted(void**) {
  MotionPriors priors;
  for (std::uint32_t i = 0; i < MotionPriors::kRoom + 3; ++i) priors.put(i, forward(i));
  assert_int_equal(priors.unused(), 3);  // no room
  assert_null(priors.of(2));
  assert_non_null(priors.of(3));
  priors.let_go(5);  // 3 was used
  assert_int_equal(priors.unused(), 5);
  priors.let_go_all();
  assert_int_equal(priors.unused(), MotionPriors::kRoom + 2);
  priors.init();
  assert_int_equal(priors.unused(), 0);
}

void test_numbers_wrap(void**) {
  MotionPriors priors;
  for (const std::uint32_t pair : {UINT32_MAX - 1, UINT32_MAX, 0U, 1U}) priors.put(pair, Pose3());
  priors.let_go(UINT32_MAX);
  assert_null(priors.of(UINT32_MAX));
  assert_non_null(priors.of(0));
  assert_non_null(priors.of(1));
}

/// Whatever comes: all that were put are waiting, were used, replaced, or are counted.
void test_none_is_lost_unseen(void**) {
  Random random(5);
  MotionPriors priors;
  std::uint32_t taken = 1000;
  std::uint32_t put = 0;
  std::uint32_t used = 0;
  for (int i = 0; i < 100000; ++i) {
    const std::uint32_t pair = taken + 1 + random.below(40);
    if (priors.of(pair) == nullptr) {
      priors.put(pair, Pose3());
      ++put;
    } else {
      ++used;  // and put it back as a new one
      MotionPriors rest = priors;
      rest.let_go_all();
      priors = rest;
    }
    if (random.below(3) == 0) priors.let_go(++taken);
  }
  priors.let_go_all();
  assert_int_equal(priors.unused() + used, put);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_each_serves_its_pair),
      cmocka_unit_test(test_the_last_word_counts),
      cmocka_unit_test(test_what_was_never_asked_for_is_counted),
      cmocka_unit_test(test_numbers_wrap),
      cmocka_unit_test(test_none_is_lost_unseen),
  };
  return cmocka_run_group_tests_name("app/pair_input", tests, nullptr, nullptr);
}
