// Merging of similar neighbours and elimination of small regions.
#include "segmentation/region_merge.hpp"

#include <algorithm>
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
  // 17 and 20 become 18.5, which is too far from 10; had 10 and 17 been joined first,
  // 20 would have been left.
  fill_stripes({10, 17, 20});
  connect(0);
  run({8, 0});
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

/// The definition: every pass looks at every pixel.
class Reference {
 public:
  void run(const RegionMergeParams& params, const RegionMap& connected) {
    const int pixels_in_all = connected.width() * connected.height();
    numbers_ = connected.numbers();
    for (int n = 0; n < numbers_; ++n) root_[n] = connected.root_of(static_cast<std::uint16_t>(n));
    for (int n = 0; n < numbers_; ++n) {
      area_[n] = connected.area_px(static_cast<std::uint16_t>(n));
      sum_[n] = 0;
    }
    const int width = connected.width();
    for (int i = 0; i < pixels_in_all; ++i) {
      label_[i] = connected.root_of(connected.row(i / width)[i % width]);
      sum_[label_[i]] += grey_[i];
    }
    bool pruning = false;
    for (int level = 0;;) {
      const bool quiet = pass(params, width, pixels_in_all, pruning, level) == 0;
      if (!pruning && level < params.merge_grey) {
        level = std::min(level + RegionMergeJob::kLevelStep_grey, params.merge_grey);
      } else if (quiet && !pruning) {
        pruning = true;
      } else if (quiet) {
        return;
      }
    }
  }
  int label(int i) const { return root(label_[i]); }
  std::uint8_t grey_[cfg::kImagePixels];

 private:
  int root(int n) const {
    while (root_[n] != n) n = root_[n];
    return n;
  }
  int mean(int n) const {
    return static_cast<int>(sum_[n] / area_[n] * 256 + sum_[n] % area_[n] * 256 / area_[n]);
  }
  int apart(int a, int b) const { return std::abs(mean(a) - mean(b)); }
  void offer(int to, int from) {
    int& nearest = nearest_[to];
    const int now = nearest < 0 ? 0 : apart(to, nearest);
    if (nearest < 0 || apart(to, from) < now || (apart(to, from) == now && from < nearest)) nearest = from;
  }
  int pass(const RegionMergeParams& params, int width, int pixels_in_all, bool pruning, int level) {
    for (int n = 0; n < numbers_; ++n) nearest_[n] = -1;
    for (int i = 0; i < pixels_in_all; ++i) label_[i] = root(label_[i]);
    for (int i = 0; i < pixels_in_all; ++i) {
      for (const int k : {i % width + 1 < width ? i + 1 : i, i + width < pixels_in_all ? i + width : i}) {
        if (label_[i] == label_[k]) continue;
        offer(label_[i], label_[k]);
        offer(label_[k], label_[i]);
      }
    }
    int joined = 0;
    for (int n = 0; n < numbers_; ++n) {
      if (root_[n] != n || nearest_[n] < 0) continue;
      const int partner = root(nearest_[n]);
      const bool may = pruning ? area_[n] < static_cast<std::uint32_t>(params.min_area_px)
                               : apart(n, partner) <= 256 * level;
      if (partner == n || !may) continue;
      const int low = std::min(n, partner);
      const int high = std::max(n, partner);
      root_[high] = low;
      area_[low] += area_[high];
      sum_[low] += sum_[high];
      ++joined;
    }
    return joined;
  }

  int numbers_ = 0;
  int label_[cfg::kImagePixels];
  int root_[kMaxRegionNumbers];
  int nearest_[kMaxRegionNumbers];
  std::uint32_t area_[kMaxRegionNumbers];
  std::uint32_t sum_[kMaxRegionNumbers];
};
Reference reference;

/// Of reference.grey_.
void expect_reference(int width, int height, int tolerance, const RegionMergeParams& params) {
  const ImageU8 grey = packed_view<const std::uint8_t>(reference.grey_, width, height);
  map.clear(width, height);
  for (int y = 0; y < height; ++y) assert_true(map.connect_row(grey, y, tolerance));
  reference.run(params, map);
  run(params);
  for (int i = 0; i < width * height; ++i)
    assert_int_equal(map.row(i / width)[i % width], reference.label(i));
}

void test_equals_the_definition(void**) {
  for (std::uint32_t seed = 1; seed <= 12; ++seed) {
    Random random(seed);
    const std::uint32_t contrast = seed % 3 == 0 ? 256 : 60;
    for (int i = 0; i < kWidth * kHeight; ++i) {
      const int wave = i % kWidth / 7 % 2 * 40 + i / kWidth / 5 % 3 * 25;
      reference.grey_[i] = static_cast<std::uint8_t>((static_cast<int>(random.below(contrast)) + wave) % 256);
    }
    expect_reference(kWidth, kHeight, static_cast<int>(seed % 4), {static_cast<int>(4 * seed % 40), 12});
  }
}

// A wall of bricks has three pairs of neighbours a brick: more than there is room for.
void test_more_pairs_than_there_is_room_for(void**) {
  constexpr int kWide = cfg::kImageWidth;
  const int rows = static_cast<int>(kMaxRegionNumbers) / (kWide / 2 + 1);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < kWide; ++x) {
      const int brick = (x + y % 2) / 2;
      Random random(static_cast<std::uint32_t>(1000 * y + brick));
      // Neighbours differ by more than nothing: six steps of grey for six neighbours, and some at random.
      const int step = brick % 3 + 3 * (y % 2);
      reference.grey_[y * kWide + x] =
          static_cast<std::uint8_t>(40 * step + static_cast<int>(random.below(39)));
    }
  }
  expect_reference(kWide, rows, 0, {30, 4});
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
      cmocka_unit_test(test_equals_the_definition),
      cmocka_unit_test(test_more_pairs_than_there_is_room_for),
      cmocka_unit_test(test_same_bits_however_sliced),
      cmocka_unit_test(test_bad_input),
  };
  return cmocka_run_group_tests_name("segmentation/region_merge", tests, nullptr, nullptr);
}
