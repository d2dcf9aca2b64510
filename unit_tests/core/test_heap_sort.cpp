// Heap sort against the standard library's: any length, equal items, orders that are its worst.
#include "core/heap_sort.hpp"

#include <algorithm>

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

struct Item {
  int key;
  int index;
};

bool before(const Item& a, const Item& b) { return a.key < b.key || (a.key == b.key && a.index < b.index); }

constexpr int kMost = 1000;
Item items[kMost];
Item expected[kMost];
long comparisons;

void check(int size) {
  for (int i = 0; i < size; ++i) expected[i] = items[i];
  std::sort(expected, expected + size, before);
  comparisons = 0;
  heap_sort(items, size, [](const Item& a, const Item& b) {
    ++comparisons;
    return before(a, b);
  });
  for (int i = 0; i < size; ++i) {
    assert_int_equal(items[i].key, expected[i].key);
    assert_int_equal(items[i].index, expected[i].index);
  }
}

void test_every_length(void**) {
  Random random(1);
  for (int size = 0; size <= 70; ++size) {
    for (int trial = 0; trial < 20; ++trial) {
      for (int i = 0; i < size; ++i) items[i] = {static_cast<int>(random.below(30)), i};
      check(size);
    }
  }
}

void test_orders_and_their_cost(void**) {
  for (int pattern = 0; pattern < 4; ++pattern) {
    for (int i = 0; i < kMost; ++i) {
      const int keys[] = {i, kMost - i, 7, i % 2 == 0 ? i : kMost - i};  // up, down, all equal, two runs
      items[i] = {keys[pattern], i};
    }
    check(kMost);
    assert_at_most(comparisons, 2.0 * kMost * 10.0);  // 2 n log2 n
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_every_length),
      cmocka_unit_test(test_orders_and_their_cost),
  };
  return cmocka_run_group_tests_name("heap_sort", tests, nullptr, nullptr);
}
