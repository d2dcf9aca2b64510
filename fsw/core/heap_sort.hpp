/// Heap sort: in place, ascending, without recursion, n log n comparisons at worst.
///
/// `before(a, b)` is a strict weak order. Equal items come out in no particular order, so an order that is
/// total (ties broken by an index) gives one result on every target. Cost: at most about 2 n log2 n
/// comparisons; the caller books them.
#pragma once

namespace cairn {

template <typename T, typename Before>
void heap_sort(T* items, int size, Before before) {
  const auto sift = [items, &before](int root, int end) {
    for (int child = 2 * root + 1; child < end; child = 2 * root + 1) {
      if (child + 1 < end && before(items[child], items[child + 1])) ++child;
      if (!before(items[root], items[child])) return;
      const T held = items[root];
      items[root] = items[child];
      items[child] = held;
      root = child;
    }
  };
  for (int root = size / 2 - 1; root >= 0; --root) sift(root, size);
  for (int end = size - 1; end > 0; --end) {
    const T held = items[0];
    items[0] = items[end];
    items[end] = held;
    sift(0, end);
  }
}

}  // namespace cairn
