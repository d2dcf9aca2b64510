// Merging of similar neighbours and elimination of small regions.
#include "segmentation/region_merge.hpp"

#include <cstring>

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

constexpr int kWidth = 60;
constexpr int kHeight = 30;
std::uint8_t pixels[kWidth * kHeight];
RegionMap map;
RegionMergeJob job;

void connect(int tolerance) {
  const ImageU8 grey = packed_view<const std::uint8_t>(pixels, kWidth, kHeight);
  map.clear(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) assert_true(map.connect_row(grey, y, tolerance));
}

void run(const RegionMergeParams& params) {
  assert_status(job.start(params, map), RegionMergeStatus::kRunning);
  WorkBudget budget = WorkBudget::unlimited();
  assert_status(job.step(budget), Progress::kDone);
  assert_status(job.status(), RegionMergeStatus::kDone);
}

int regions() {
  int count = 0;
  for (int n = 0; n < map.numbers(); ++n) count += map.is_root(static_cast<std::uint16_t>(n)) ? 1 : 0;
  return count;
}

/// Vertical stripes of equal width.
void fill_stripes(std::initializer_list<int> greys) {
  const int width = kWidth / static_cast<int>(greys.size());
  for (int i = 0; i < kWidth * kHeight; ++i) {
    pixels[i] = static_cast<std::uint8_t>(*(greys.begin() + (i % kWidth) / width));
  }
}

std::uint16_t region_at(int x, int y) { return map.row(y)[x]; }

void test_most_similar_first(void**) {
  // 16 and 21 become 18.5, which is too far from 10; had 10 and 16 been joined first, 21 would have been
  // left.
  fill_stripes({10, 16, 21});
  connect(0);
  run({6, 0});
  assert_int_equal(regions(), 2);
  assert_int_equal(region_at(25, 3), region_at(45, 3));
  assert_int_not_equal(region_at(5, 3), region_at(25, 3));
  assert_int_equal(map.mean_q8(region_at(45, 3)), 37 * 128);
}

void test_threshold_is_inclusive(void**) {
  for (const int merge_grey : {0, 9, 10, 255}) {
    fill_stripes({100, 110});
    connect(0);
    run({merge_grey, 0});
    assert_int_equal(regions(), merge_grey < 10 ? 2 : 1);
  }
}

// A ramp merges where single steps are small, but not without end: means drift apart as regions grow.
void test_ramp_breaks_up(void**) {
  for (int i = 0; i < kWidth * kHeight; ++i) pixels[i] = static_cast<std::uint8_t>(4 * (i % kWidth));
  connect(0);
  run({8, 0});
  assert_at_least(regions(), 3);
  assert_at_most(regions(), 30);
  for (int x = 1; x < kWidth; ++x) {
    const int step = map.mean_q8(region_at(x, 0)) - map.mean_q8(region_at(x - 1, 0));
    if (region_at(x, 0) != region_at(x - 1, 0)) assert_true(step > 8 * 256);
  }
}

void test_small_regions_go_to_nearest_neighbour(void**) {
  fill_stripes({50, 200});
  pixels[5 * kWidth + 30] = 90;   // on the edge, in the right half: nearer to 50
  pixels[9 * kWidth + 10] = 255;  // a speckle within 50
  for (int i = 0; i < 4; ++i) pixels[(20 + i / 2) * kWidth + 45 + i % 2] = 20;  // four pixels within 200
  connect(0);
  run({5, 4});
  assert_int_equal(regions(), 3);
  assert_int_equal(region_at(30, 5), region_at(0, 0));
  assert_int_equal(region_at(10, 9), region_at(0, 0));
  assert_int_equal(map.area_px(region_at(46, 21)), 4);
  connect(0);
  run({5, 5});
  assert_int_equal(regions(), 2);
  assert_int_equal(region_at(46, 21), region_at(59, 29));
}

void test_one_small_image(void**) {
  fill_stripes({50});
  connect(0);
  run({5, kWidth * kHeight + 1});
  assert_int_equal(regions(), 1);
  fill_stripes({50, 60, 90, 255});
  connect(0);
  run({0, kWidth * kHeight});
  assert_int_equal(regions(), 1);
  assert_int_equal(map.area_px(0), kWidth * kHeight);
}

void fill_noise(std::uint32_t seed) {
  Random random(seed);
  for (std::uint8_t& pixel : pixels) pixel = static_cast<std::uint8_t>(random.below(256));
}

// What the two stages promise, on noise: no neighbours closer than the threshold survive merging alone, and
// nothing small survives both.
void test_promises_hold_on_noise(void**) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    fill_noise(seed);
    connect(3);
    run({20, 0});
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x + 1 < kWidth; ++x) {
        const std::uint16_t a = region_at(x, y);
        const std::uint16_t b = region_at(x + 1, y);
        assert_true(a == b || std::abs(map.mean_q8(a) - map.mean_q8(b)) > 20 * 256);
      }
    }
    connect(3);
    run({20, 15});
    std::uint32_t total = 0;
    for (int n = 0; n < map.numbers(); ++n) {
      const auto root = static_cast<std::uint16_t>(n);
      if (!map.is_root(root)) continue;
      assert_at_least(map.area_px(root), 15);
      total += map.area_px(root);
    }
    assert_int_equal(total, kWidth * kHeight);
  }
}

void test_same_bits_however_sliced(void**) {
  static std::uint16_t whole[kWidth * kHeight];
  fill_noise(5);
  connect(3);
  run({20, 15});
  for (int y = 0; y < kHeight; ++y) std::memcpy(whole + y * kWidth, map.row(y), kWidth * sizeof *whole);
  for (const std::uint32_t ops : {1U, 240U, 513U, 4097U}) {
    connect(3);
    assert_status(job.start({20, 15}, map), RegionMergeStatus::kRunning);
    int steps = 0;
    for (Progress progress = Progress::kMore; progress == Progress::kMore; ++steps) {
      assert_true(steps < 100000);
      WorkBudget budget(ops);
      progress = job.step(budget);
    }
    for (int y = 0; y < kHeight; ++y) {
      assert_memory_equal(whole + y * kWidth, map.row(y), kWidth * sizeof *whole);
    }
  }
}

void test_bad_input(void**) {
  static RegionMap empty;
  static RegionMergeJob fresh;
  assert_status(fresh.status(), RegionMergeStatus::kIdle);
  assert_status(fresh.start({}, empty), RegionMergeStatus::kBadInput);
  fill_stripes({1, 2});
  connect(0);
  assert_status(fresh.start({-1, 0}, map), RegionMergeStatus::kBadInput);
  assert_status(fresh.start({256, 0}, map), RegionMergeStatus::kBadInput);
  assert_status(fresh.start({5, -1}, map), RegionMergeStatus::kBadInput);
  WorkBudget budget = WorkBudget::unlimited();
  assert_status(fresh.step(budget), Progress::kDone);
  assert_status(fresh.start({255, 0}, map), RegionMergeStatus::kRunning);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_most_similar_first),
      cmocka_unit_test(test_threshold_is_inclusive),
      cmocka_unit_test(test_ramp_breaks_up),
      cmocka_unit_test(test_small_regions_go_to_nearest_neighbour),
      cmocka_unit_test(test_one_small_image),
      cmocka_unit_test(test_promises_hold_on_noise),
      cmocka_unit_test(test_same_bits_however_sliced),
      cmocka_unit_test(test_bad_input),
  };
  return cmocka_run_group_tests_name("segmentation/region_merge", tests, nullptr, nullptr);
}
