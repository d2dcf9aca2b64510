// Region map: connection against a flood fill, merging, and running out of numbers.
#include "segmentation/region_map.hpp"

#include <cstring>

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

constexpr int kSide = 40;
// The largest image.
constexpr int kWidth = cfg::kImageWidth / cfg::kMission.segmentation_divisor;
constexpr int kHeight = cfg::kImageHeight / cfg::kMission.segmentation_divisor;
std::uint8_t pixels[kSide * kSide];
int flooded[kSide * kSide];
RegionMap map;

ImageU8 image() { return packed_view<const std::uint8_t>(pixels, kSide, kSide); }

void connect(const ImageU8& grey, int tolerance) {
  map.clear(grey.width, grey.height);
  for (int y = 0; y < grey.height; ++y) assert_true(map.connect_row(grey, y, tolerance));
  map.compress(0, map.numbers());
  for (int y = 0; y < grey.height; ++y) map.flatten_row(y);
}

/// The oracle: flood fill from `start` with an explicit stack.
void flood(int start, int tolerance, int mark) {
  static int stack[4 * kSide * kSide + 4];
  int depth = 0;
  stack[depth++] = start;
  flooded[start] = mark;
  while (depth > 0) {
    const int at = stack[--depth];
    const int neighbours[4] = {at % kSide > 0 ? at - 1 : at, at % kSide < kSide - 1 ? at + 1 : at,
                               at >= kSide ? at - kSide : at, at + kSide < kSide * kSide ? at + kSide : at};
    for (const int next : neighbours) {
      if (flooded[next] != 0 || std::abs(pixels[next] - pixels[at]) > tolerance) continue;
      flooded[next] = mark;
      stack[depth++] = next;
    }
  }
}

void test_connection_equals_flood_fill(void**) {
  Random random(3);
  for (int trial = 0; trial < 60; ++trial) {
    const int tolerance = trial % 4;
    const auto levels = static_cast<std::uint32_t>(2 + trial % 7);
    for (std::uint8_t& pixel : pixels)
      pixel = static_cast<std::uint8_t>(random.below(levels) * (1 + trial % 3));
    connect(image(), tolerance);
    std::memset(flooded, 0, sizeof flooded);
    int regions = 0;
    for (int i = 0; i < kSide * kSide; ++i) {
      const std::uint16_t root = map.row(i / kSide)[i % kSide];
      assert_true(map.is_root(root));
      if (flooded[i] == 0) {
        flood(i, tolerance, ++regions);
        int area = 0;
        int sum = 0;
        for (int k = 0; k < kSide * kSide; ++k) {
          if (flooded[k] != regions) continue;
          ++area;
          sum += pixels[k];
          assert_int_equal(map.row(k / kSide)[k % kSide], root);
        }
        assert_int_equal(map.area_px(root), area);
        assert_int_equal(map.mean_q8(root), sum * 256 / area);
      }
    }
    int roots = 0;
    for (int n = 0; n < map.numbers(); ++n) roots += map.is_root(static_cast<std::uint16_t>(n)) ? 1 : 0;
    assert_int_equal(roots, regions);
  }
}

void test_merge(void**) {
  // Four stripes of 10 columns: 10, 20, 30, 50.
  static const int greys[] = {10, 20, 30, 50};
  for (int i = 0; i < kSide * kSide; ++i) pixels[i] = static_cast<std::uint8_t>(greys[(i % kSide) / 10]);
  connect(image(), 0);
  assert_int_equal(map.numbers(), 4);
  assert_int_equal(map.merge(2, 1), 1);
  assert_int_equal(map.area_px(1), 800);
  assert_int_equal(map.mean_q8(1), 25 * 256);
  assert_int_equal(map.merge(0, 1), 0);
  assert_int_equal(map.mean_q8(0), 20 * 256);
  assert_int_equal(map.root_of(2), 0);
  assert_int_equal(map.root_of(3), 3);
  map.compress(0, map.numbers());
  map.flatten_row(17);
  assert_int_equal(map.row(17)[25], 0);
  assert_int_equal(map.row(17)[30], 3);
}

void test_mean_of_largest_sums(void**) {
  static std::uint8_t white[cfg::kWorkingPixels];
  std::memset(white, 255, sizeof white);
  connect(packed_view<const std::uint8_t>(white, kWidth, kHeight), 0);
  assert_int_equal(map.numbers(), 1);
  assert_int_equal(map.area_px(0), cfg::kWorkingPixels);
  assert_int_equal(map.mean_q8(0), 255 * 256);
}

void test_out_of_numbers(void**) {
  static std::uint8_t board[cfg::kWorkingPixels];
  for (int i = 0; i < static_cast<int>(cfg::kWorkingPixels); ++i) {
    board[i] = ((i % kWidth + i / kWidth) & 1) != 0 ? 255 : 0;
  }
  // As many pieces as there are numbers are taken; the next row is one too many.
  const ImageU8 grey = packed_view<const std::uint8_t>(board, kWidth, kHeight);
  const int full_rows = static_cast<int>(kMaxRegionNumbers) / kWidth;
  map.clear(grey.width, grey.height);
  for (int y = 0; y < full_rows; ++y) assert_true(map.connect_row(grey, y, 254));
  assert_false(map.connect_row(grey, full_rows, 254));
  // The next image finds an empty map.
  map.clear(grey.width, grey.height);
  for (int y = 0; y < grey.height; ++y) assert_true(map.connect_row(grey, y, 255));
  assert_int_equal(map.numbers(), 1);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_connection_equals_flood_fill),
      cmocka_unit_test(test_merge),
      cmocka_unit_test(test_mean_of_largest_sums),
      cmocka_unit_test(test_out_of_numbers),
  };
  return cmocka_run_group_tests_name("segmentation/region_map", tests, nullptr, nullptr);
}
