// Mean-shift filter: what it flattens, what it keeps, its bounds and its slicing. OpenCV is the oracle in
// unit_tests/opencv/test_mean_shift.cpp.
#include "segmentation/mean_shift.hpp"

#include <algorithm>
#include <cstring>

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

constexpr int kWidth = 48;
constexpr int kHeight = 31;
std::uint8_t input[kWidth * kHeight];
std::uint8_t output[kWidth * kHeight];
std::uint8_t sliced[kWidth * kHeight];
MeanShiftJob job;

ImageU8 input_view() { return packed_view<const std::uint8_t>(input, kWidth, kHeight); }
MutableImageU8 view(std::uint8_t* pixels) { return packed_view(pixels, kWidth, kHeight); }

void run(const MeanShiftParams& params, std::uint8_t* out) {
  assert_status(job.start(params, input_view(), view(out)), MeanShiftStatus::kRunning);
  WorkBudget budget = WorkBudget::unlimited();
  assert_int_equal(static_cast<int>(job.step(budget)), static_cast<int>(Progress::kDone));
  assert_status(job.status(), MeanShiftStatus::kDone);
}

/// Two plains, 60 and 140, with texture of +-6 on both; the edge runs between the columns 19 and 20.
void fill_two_plains() {
  Random random(7);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const int texture = static_cast<int>(random.below(13)) - 6;
      input[y * kWidth + x] = static_cast<std::uint8_t>((x < 20 ? 60 : 140) + texture);
    }
  }
}

void test_constant_stays(void**) {
  for (const int grey : {0, 77, 255}) {
    std::memset(input, grey, sizeof input);
    run({}, output);
    assert_memory_equal(input, output, sizeof input);
  }
}

void test_texture_goes_edge_stays(void**) {
  MeanShiftParams params;
  params.spatial_radius_px = 3;
  params.max_iterations = 5;
  fill_two_plains();
  run(params, output);
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const int plain = i % kWidth < 20 ? 60 : 140;
    assert_at_most(std::abs(output[i] - plain), 3);
  }
}

// By hand: one row, radius 1 and 10 grey levels, one iteration. Halves round to even: 20.5 to 20, 25.5 to 26.
void test_one_iteration_by_hand(void**) {
  static const std::uint8_t row[] = {20, 21, 100, 91, 82, 25, 26};
  static const std::uint8_t expected[] = {20, 20, 96, 91, 86, 26, 26};
  std::uint8_t out[7] = {};
  MeanShiftParams params;
  params.spatial_radius_px = 1;
  params.range_radius_grey = 10;
  params.max_iterations = 1;
  assert_status(job.start(params, packed_view(row, 7, 1), packed_view(out, 7, 1)), MeanShiftStatus::kRunning);
  WorkBudget budget = WorkBudget::unlimited();
  (void)job.step(budget);
  // 100 and 91 average 95.5, 91 has 100 and 82 on its sides, 82 and 91 average 86.5.
  for (int i = 0; i < 7; ++i) assert_int_equal(out[i], expected[i]);
}

void test_range_radius_is_inclusive(void**) {
  static const std::uint8_t row[] = {50, 60};
  std::uint8_t out[2] = {};
  MeanShiftParams params;
  params.max_iterations = 1;
  for (const int radius : {9, 10}) {
    params.range_radius_grey = radius;
    (void)job.start(params, packed_view(row, 2, 1), packed_view(out, 2, 1));
    WorkBudget budget = WorkBudget::unlimited();
    (void)job.step(budget);
    assert_int_equal(out[0], radius == 9 ? 50 : 55);
    assert_int_equal(out[1], radius == 9 ? 60 : 55);
  }
}

// Nothing in the definition tells rows from columns.
void test_rows_are_as_columns(void**) {
  fill_two_plains();
  run({}, output);
  static std::uint8_t turned[kWidth * kHeight];
  for (int i = 0; i < kWidth * kHeight; ++i) turned[(i % kWidth) * kHeight + i / kWidth] = input[i];
  assert_status(job.start({}, packed_view<const std::uint8_t>(turned, kHeight, kWidth),
                          packed_view(sliced, kHeight, kWidth)),
                MeanShiftStatus::kRunning);
  WorkBudget budget = WorkBudget::unlimited();
  (void)job.step(budget);
  for (int i = 0; i < kWidth * kHeight; ++i) {
    assert_int_equal(sliced[(i % kWidth) * kHeight + i / kWidth], output[i]);
  }
}

// A place that stays ends the trajectory even where the grey value still moves by more than the convergence.
void test_rests_where_the_place_stays(void**) {
  // 0 sees 0 and 9, and goes to 4 (halves to even) at the place 0; a second iteration would see 12 as well.
  static const std::uint8_t row[] = {0, 9, 12};
  std::uint8_t out[3] = {};
  MeanShiftParams params;
  params.spatial_radius_px = 2;
  params.range_radius_grey = 9;
  (void)job.start(params, packed_view(row, 3, 1), packed_view(out, 3, 1));
  WorkBudget budget = WorkBudget::unlimited();
  (void)job.step(budget);
  assert_int_equal(out[0], 4);
}

void test_strides_and_extreme_parameters(void**) {
  fill_two_plains();
  const ImageU8 part{input + 5, 20, 9, kWidth};
  static std::uint8_t packed[20 * 9];
  static std::uint8_t expected[20 * 9];
  for (int y = 0; y < 9; ++y) std::memcpy(packed + 20 * y, part.row(y), 20);
  MeanShiftParams params;
  params.spatial_radius_px = 32;
  params.range_radius_grey = 255;
  params.max_iterations = 100;
  WorkBudget budget = WorkBudget::unlimited();
  (void)job.start(params, packed_view<const std::uint8_t>(packed, 20, 9), packed_view(expected, 20, 9));
  (void)job.step(budget);
  std::memset(output, 7, sizeof output);
  assert_status(job.start(params, part, {output + 3, 20, 9, kWidth}), MeanShiftStatus::kRunning);
  (void)job.step(budget);
  for (int y = 0; y < 9; ++y) {
    assert_memory_equal(output + 3 + y * kWidth, expected + 20 * y, 20);
    assert_int_equal(output[2 + y * kWidth], 7);
    assert_int_equal(output[23 + y * kWidth], 7);
  }
}

/// The definition, with quotients by division: the grey value where the trajectory from (x, y) rests.
int brute_force(const MeanShiftParams& params, const ImageU8& image, int x, int y, int* y_end = nullptr) {
  const auto mean = [](int sum, int count) {
    const int twice = 2 * (sum % count);
    return sum / count + (twice > count || (twice == count && sum / count % 2 == 1) ? 1 : 0);
  };
  int grey = image.at(x, y);
  for (int iteration = 0; iteration < params.max_iterations; ++iteration) {
    int count = 0;
    int sums[3] = {};
    for (int v = y - params.spatial_radius_px; v <= y + params.spatial_radius_px; ++v) {
      for (int u = x - params.spatial_radius_px; u <= x + params.spatial_radius_px; ++u) {
        if (!image.contains(u, v) || std::abs(image.at(u, v) - grey) > params.range_radius_grey) continue;
        ++count;
        sums[0] += u;
        sums[1] += v;
        sums[2] += image.at(u, v);
      }
    }
    if (count == 0) break;
    const int moved = std::abs(mean(sums[0], count) - x) + std::abs(mean(sums[1], count) - y);
    const int dg = mean(sums[2], count) - grey;
    x = mean(sums[0], count);
    y = mean(sums[1], count);
    grey += dg;
    if (moved == 0 || moved + dg * dg <= params.convergence) break;
  }
  if (y_end != nullptr) *y_end = y;
  return grey;
}

// By words and by pixels: both sides of the radii where one takes over from the other, all grey values, and
// images smaller than a window.
void test_equals_the_definition(void**) {
  Random random(3);
  for (const int contrast : {24, 80, 256}) {
    for (int i = 0; i < kWidth * kHeight; ++i) {
      const int slope = (i % kWidth + 3 * (i / kWidth)) * 2;
      input[i] = static_cast<std::uint8_t>((slope + static_cast<int>(random.below(contrast))) % 256);
    }
    for (const int spatial : {1, 2, 3, 4}) {
      for (const int range : {1, 5, 16, 25, 26, 200}) {
        for (const int iterations : {1, 5, 100}) {
          const MeanShiftParams params{spatial, range, iterations, iterations == 5 ? 0 : 1};
          run(params, output);
          for (int i = 0; i < kWidth * kHeight; ++i)
            assert_int_equal(output[i], brute_force(params, input_view(), i % kWidth, i / kWidth));
        }
      }
    }
  }
  for (int height = 1; height <= 9; ++height) {
    for (int width = 1; width <= 9; ++width) {
      const ImageU8 small{input, width, height, kWidth};
      assert_status(job.start({}, small, {output, width, height, kWidth}), MeanShiftStatus::kRunning);
      WorkBudget budget = WorkBudget::unlimited();
      assert_status(job.step(budget), Progress::kDone);
      for (int i = 0; i < width * height; ++i) {
        const int x = i % width;
        const int y = i / width;
        assert_int_equal(output[y * kWidth + x], brute_force({}, small, x, y));
      }
    }
  }
}

// Pixels that walk end where they did when all walked; the others have the mode of the neighbour that is most
// like them, of those that walked before the next row does.
void test_each_second_pixel(void**) {
  fill_two_plains();
  MeanShiftParams params;
  run(params, output);
  params.each_second = true;
  run(params, sliced);
  const MutableImageU8 modes = view(sliced);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if ((x + y) % 2 == 0) {
        assert_int_equal(modes.at(x, y), output[y * kWidth + x]);
        continue;
      }
      const int places[3][2] = {{x - 1, y}, {x + 1, y}, {x, y - 1}};
      int least = 256;
      int mode = -1;
      for (const auto& [u, v] : places) {
        if (!modes.contains(u, v)) continue;
        const int away = std::abs(input[v * kWidth + u] - input[y * kWidth + x]);
        if (away >= least) continue;
        least = away;
        mode = modes.at(u, v);
      }
      assert_int_equal(modes.at(x, y), mode);
    }
  }
  for (int height = 1; height <= 3; ++height) {
    for (int width = 1; width <= 3; ++width) {
      std::memset(output, 0, sizeof output);
      assert_status(job.start(params, {input, width, height, kWidth}, {output, width, height, kWidth}),
                    MeanShiftStatus::kRunning);
      WorkBudget budget = WorkBudget::unlimited();
      assert_status(job.step(budget), Progress::kDone);
      for (int i = 0; i < width * height; ++i) assert_at_least(output[i / width * kWidth + i % width], 54);
    }
  }
}

// Where members get denser by an eighth a row, trajectories run far from where they began, up or down.
void test_far_trajectories(void**) {
  constexpr int kLane = 60;
  static std::uint8_t lane[kLane * 7];
  static std::uint8_t out[kLane * 7];
  for (const bool up : {false, true}) {
    std::memset(lane, 255, sizeof lane);
    double members = 1.0;
    for (int y = 0; y < 18; ++y, members *= 1.135) {
      for (int i = 0; i < 7 && i < static_cast<int>(members + 0.5); ++i)
        lane[7 * (up ? kLane - 1 - y : y) + (i % 2 == 0 ? 3 + i / 2 : 2 - i / 2)] = 100;
    }
    const ImageU8 image = packed_view<const std::uint8_t>(lane, 7, kLane);
    const MeanShiftParams params{3, 18, 100, 0};
    (void)job.start(params, image, packed_view(out, 7, kLane));
    WorkBudget budget = WorkBudget::unlimited();
    (void)job.step(budget);
    int far = 0;
    for (int i = 0; i < kLane * 7; ++i) {
      int y = i / 7;
      assert_int_equal(out[i], brute_force(params, image, i % 7, i / 7, &y));
      far = std::max(far, std::abs(y - i / 7));
    }
    print_message("farthest: %d rows\n", far);
    assert_true(far > 6);
  }
}

void test_same_bits_however_sliced(void**) {
  constexpr std::uint32_t kUnit = 8 * 5 * 8 * 7;  // eight trajectories of five iterations
  fill_two_plains();
  run({}, output);
  for (const std::uint32_t ops : {1U, 49U, 50U, 997U, 65536U}) {
    std::memset(sliced, 0, sizeof sliced);
    assert_status(job.start({}, input_view(), view(sliced)), MeanShiftStatus::kRunning);
    int steps = 0;
    for (Progress progress = Progress::kMore; progress == Progress::kMore; ++steps) {
      assert_true(steps < 100000);
      WorkBudget budget(ops);
      progress = job.step(budget);
      assert_at_most(budget.spent(), ops + kUnit);
    }
    assert_memory_equal(output, sliced, sizeof output);
  }
}

void expect_bad(const MeanShiftParams& params) {
  assert_status(job.start(params, input_view(), view(output)), MeanShiftStatus::kBadInput);
  WorkBudget budget = WorkBudget::unlimited();
  assert_status(job.step(budget), Progress::kDone);
  assert_int_equal(budget.spent(), 0);
}

void test_bad_parameters(void**) {
  MeanShiftParams params;
  for (const int radius : {-1, 0, 33}) {
    params.spatial_radius_px = radius;
    expect_bad(params);
  }
  params = {};
  for (const int radius : {-1, 0, 256}) {
    params.range_radius_grey = radius;
    expect_bad(params);
  }
  params = {};
  for (const int iterations : {-1, 0, 101}) {
    params.max_iterations = iterations;
    expect_bad(params);
  }
  params = {};
  params.convergence = -1;
  expect_bad(params);
}

void test_bad_views(void**) {
  static MeanShiftJob fresh;
  assert_status(fresh.status(), MeanShiftStatus::kIdle);
  const MutableImageU8 out = view(output);
  assert_status(fresh.start({}, {}, out), MeanShiftStatus::kBadInput);
  assert_status(fresh.start({}, input_view(), {}), MeanShiftStatus::kBadInput);
  assert_status(fresh.start({}, {input, 0, kHeight, kWidth}, out), MeanShiftStatus::kBadInput);
  assert_status(fresh.start({}, {input, kWidth, kHeight, kWidth - 1}, out), MeanShiftStatus::kBadInput);
  assert_status(fresh.start({}, input_view(), {output, kWidth - 1, kHeight, kWidth}),
                MeanShiftStatus::kBadInput);
  assert_status(fresh.start({}, input_view(), {output, kWidth, kHeight - 1, kWidth}),
                MeanShiftStatus::kBadInput);
  assert_status(fresh.start({}, input_view(), {output, kWidth, kHeight, kWidth - 1}),
                MeanShiftStatus::kBadInput);
  assert_status(fresh.start({}, input_view(), out), MeanShiftStatus::kRunning);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_constant_stays),
      cmocka_unit_test(test_texture_goes_edge_stays),
      cmocka_unit_test(test_one_iteration_by_hand),
      cmocka_unit_test(test_range_radius_is_inclusive),
      cmocka_unit_test(test_rows_are_as_columns),
      cmocka_unit_test(test_rests_where_the_place_stays),
      cmocka_unit_test(test_strides_and_extreme_parameters),
      cmocka_unit_test(test_equals_the_definition),
      cmocka_unit_test(test_each_second_pixel),
      cmocka_unit_test(test_far_trajectories),
      cmocka_unit_test(test_same_bits_however_sliced),
      cmocka_unit_test(test_bad_parameters),
      cmocka_unit_test(test_bad_views),
  };
  return cmocka_run_group_tests_name("segmentation/mean_shift", tests, nullptr, nullptr);
}
