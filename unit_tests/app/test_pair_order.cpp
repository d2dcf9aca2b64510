// Order of stereo pairs: each row of the header's table, wrapping numbers, and any order of arrival.
#include "app/pair_order.hpp"

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::app;

namespace {

PairStatus after(std::uint32_t last, std::uint64_t last_us, std::uint32_t number, std::uint64_t t_us) {
  PairOrder order;
  assert_status(order.judge(last, last_us), PairStatus::kFirst);
  return order.judge(number, t_us);
}

void test_the_table(void**) {
  assert_status(after(7, 100, 8, 200), PairStatus::kNext);
  assert_status(after(7, 0, 8, 0), PairStatus::kNext);  // no clock
  assert_status(after(7, 100, 8, 99), PairStatus::kOld);
  assert_status(after(7, 100, 9, 300), PairStatus::kGap);
  assert_status(after(7, 0, 9, 0), PairStatus::kGap);
  assert_status(after(7, 100, 9, 99), PairStatus::kOld);
  assert_status(after(7, 100, 7, 100), PairStatus::kRepeated);
  assert_status(after(7, 100, 7, 101), PairStatus::kRenumbered);
  assert_status(after(7, 100, 7, 99), PairStatus::kOld);
  assert_status(after(7, 100, 6, 99), PairStatus::kOld);
  assert_status(after(7, 100, 6, 100), PairStatus::kOld);
  assert_status(after(7, 0, 6, 0), PairStatus::kOld);
  assert_status(after(7, 100, 0, 101), PairStatus::kRenumbered);
}

void test_numbers_wrap(void**) {
  assert_status(after(UINT32_MAX, 0, 0, 0), PairStatus::kNext);
  assert_status(after(UINT32_MAX, 0, 2, 0), PairStatus::kGap);
  assert_status(after(2, 0, UINT32_MAX, 0), PairStatus::kOld);
}

void test_missed_pairs_are_counted(void**) {
  PairOrder order;
  assert_status(order.judge(10, 0), PairStatus::kFirst);
  assert_int_equal(order.missed(), 0);
  assert_status(order.judge(19, 0), PairStatus::kGap);
  assert_int_equal(order.missed(), 8);
  assert_status(order.judge(12, 0), PairStatus::kOld);  // which tells nothing of the gap
  assert_status(order.status(), PairStatus::kOld);
  assert_status(order.judge(20, 0), PairStatus::kNext);
  assert_int_equal(order.missed(), 0);
  order.init();
  assert_status(order.judge(3, 0), PairStatus::kFirst);
}

/// A camera that was started anew, its clock as well: believed after a few pairs in their order, and what is
/// missing is not nothing. Old pairs that are in no order, or whose row is broken, are never believed.
void test_a_camera_that_begins_anew(void**) {
  PairOrder order;
  assert_status(order.judge(5000, 9000), PairStatus::kFirst);
  for (std::uint32_t i = 0; i + 1 < PairOrder::kRestartedAfter; ++i)
    assert_status(order.judge(i, 10 * i), PairStatus::kOld);
  assert_status(order.judge(PairOrder::kRestartedAfter - 1, 500), PairStatus::kRenumbered);
  assert_int_equal(order.missed(), PairOrder::kUnknownGap);
  assert_status(order.judge(PairOrder::kRestartedAfter, 510), PairStatus::kNext);
  assert_int_equal(order.missed(), 0);

  order.init();
  assert_status(order.judge(5000, 9000), PairStatus::kFirst);
  for (std::uint32_t i = 0; i < 100; ++i) {  // one row after another, each too short
    const std::uint32_t number = 10 * (i / 7) + i % 7;
    assert_status(order.judge(number, number), PairStatus::kOld);
  }
  for (std::uint32_t i = 0; i < 100; ++i) assert_status(order.judge(5000, 9000), PairStatus::kRepeated);
  assert_status(order.judge(5001, 9001), PairStatus::kNext);
  for (std::uint32_t i = 0; i < 100; ++i) {  // stragglers in their order, but the camera goes on
    assert_status(order.judge(i, i), PairStatus::kOld);
    assert_status(order.judge(5002 + i, 9002 + i), PairStatus::kNext);
  }
}

/// Shuffled, dropped and repeated pairs of one camera: used ones rise, and used and missed are all.
void test_any_order_of_arrival(void**) {
  Random random(3);
  for (int run = 0; run < 200; ++run) {
    PairOrder order;
    std::uint32_t last = 0;
    std::uint32_t used = 0;
    std::uint32_t missed = 0;
    bool any = false;
    for (int i = 0; i < 300; ++i) {
      const std::uint32_t number = 1000U + i + random.below(6);
      if (!to_be_used(order.judge(number, 10ULL * number))) continue;
      if (any) assert_true(number > last);
      missed += order.missed();
      ++used;
      if (!any) last = number - 1;
      any = true;
      assert_int_equal(number - last - 1, order.missed());
      last = number;
    }
    assert_true(used > 100);
    assert_true(missed > 0);
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_the_table),
      cmocka_unit_test(test_numbers_wrap),
      cmocka_unit_test(test_missed_pairs_are_counted),
      cmocka_unit_test(test_a_camera_that_begins_anew),
      cmocka_unit_test(test_any_order_of_arrival),
  };
  return cmocka_run_group_tests_name("app/pair_order", tests, nullptr, nullptr);
}
