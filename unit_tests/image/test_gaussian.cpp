// The light image and the difference of Gaussians against brute-force convolutions in double precision.
#include "image/gaussian.hpp"

#include <cstring>

#include "core/random.hpp"
#include "support/cmocka.hpp"
#include "support/death.hpp"

using namespace cairn;

namespace {

constexpr int kWidth = 70;
constexpr int kHeight = 41;
constexpr int kMargin = ScaleRows::kDifferenceMargin;
std::uint8_t pixels[kWidth * kHeight];
std::uint16_t light[kWidth * kHeight];
std::int16_t difference[kHeight][kWidth];
ScaleRows rows;

void fill_random() {
  Random random(4);
  for (std::uint8_t& p : pixels) p = static_cast<std::uint8_t>(random.below(256));
}

void run(int width, int height) {
  rows.start(packed_view<const std::uint8_t>(pixels, width, height));
  static std::int16_t nowhere[kWidth];
  for (int y = 0; y < height; ++y) {
    rows.next(light + y * width, y >= ScaleRows::kDelay ? difference[y - ScaleRows::kDelay] : nowhere);
  }
}

int clamp(int v, int most) { return v < 0 ? 0 : (v > most ? most : v); }

constexpr int kReach = 6;
using Taps = double[kReach + 1];
constexpr Taps kLight = {10.0 / 16, 3.0 / 16};
constexpr Taps kFine = {20.0 / 64, 15.0 / 64, 6.0 / 64, 1.0 / 64};
constexpr Taps kCoarse = {52.0 / 256, 46.0 / 256, 32.0 / 256, 17.0 / 256, 6.0 / 256, 1.0 / 256};

double brute_force(const Taps& tap, int width, int height, int x, int y) {
  double sum = 0.0;
  for (int j = -kReach; j <= kReach; ++j) {
    for (int i = -kReach; i <= kReach; ++i) {
      const double w = tap[i < 0 ? -i : i] * tap[j < 0 ? -j : j];
      sum += w * pixels[clamp(y + j, height - 1) * width + clamp(x + i, width - 1)];
    }
  }
  return 256.0 * sum;
}

double sigma_of(const Taps& tap) {
  double sum = 0.0;
  double second = 0.0;
  for (int i = -kReach; i <= kReach; ++i) {
    sum += tap[i < 0 ? -i : i];
    second += i * i * tap[i < 0 ? -i : i];
  }
  assert_near(sum, 1.0, 1.0e-12);
  return std::sqrt(second);
}

void test_sigmas_are_those_of_the_header(void**) {
  assert_near(sigma_of(kLight), 0.612, 0.001);
  assert_near(sigma_of(kFine), 1.225, 0.001);
  assert_near(sigma_of(kCoarse), 1.871, 0.001);
}

void test_against_brute_force(void**) {
  fill_random();
  for (const int width : {kWidth, kWidth - 1, 2 * kMargin, 2 * kMargin + 1}) {
    for (const int height : {kHeight, 2 * kMargin, 2 * kMargin + 1}) {
      run(width, height);
      double sum2 = 0.0;
      int count = 0;
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          assert_true(light[y * width + x] == brute_force(kLight, width, height, x, y));
          if (x < kMargin || y < kMargin || x >= width - kMargin || y >= height - kMargin) continue;
          const double exact =
              brute_force(kCoarse, width, height, x, y) - brute_force(kFine, width, height, x, y);
          const double off = difference[y][x] - exact;
          assert_near(off, 0.0, 24.0);  // rounded twice to 1/16 grey level
          sum2 += off * off;
          ++count;
        }
      }
      if (count > 500) assert_at_most(std::sqrt(sum2 / count), 8.0);
    }
  }
}

void test_flat_stays_flat(void**) {
  for (const int grey : {0, 1, 128, 255}) {
    std::memset(pixels, grey, sizeof pixels);
    run(kWidth, kHeight);
    for (const std::uint16_t s : light) assert_int_equal(s, 256 * grey);
    for (int y = kMargin; y < kHeight - kMargin; ++y) {
      for (int x = kMargin; x < kWidth - kMargin; ++x) assert_int_equal(difference[y][x], 0);
    }
  }
}

void test_the_largest_differences_fit(void**) {
  // White where the difference's kernel is positive, black where it is negative, and the reverse: about a
  // pixel of each half of the words.
  for (const int cx : {20, 50}) {
    for (const bool dark : {false, true}) {
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          const int i = x < cx ? cx - x : x - cx;
          const int j = y < 20 ? 20 - y : y - 20;
          const bool near = i <= kReach && j <= kReach && kCoarse[i] * kCoarse[j] < kFine[i] * kFine[j];
          pixels[y * kWidth + x] = near == dark ? 0 : 255;
        }
      }
      run(kWidth, kHeight);
      const double exact =
          brute_force(kCoarse, kWidth, kHeight, cx, 20) - brute_force(kFine, kWidth, kHeight, cx, 20);
      assert_true(std::fabs(exact) > 256.0 * 75.0);
      assert_near(difference[20][cx], exact, 24.0);
    }
  }
}

void test_stride_is_followed(void**) {
  fill_random();
  static std::uint16_t one[40 * 30];
  static std::int16_t unused[40];
  rows.start({pixels + 3 * kWidth + 7, 40, 30, kWidth});
  for (int y = 0; y < 30; ++y) rows.next(one + y * 40, unused);
  run(kWidth, kHeight);
  for (int y = 1; y < 29; ++y) {
    for (int x = 1; x < 39; ++x) assert_int_equal(one[y * 40 + x], light[(y + 3) * kWidth + x + 7]);
  }
}

void test_halved_is_that_of_the_means(void**) {
  fill_random();
  static std::uint8_t means[(kWidth / 2) * (kHeight / 2)];
  static std::uint16_t halved[(kWidth / 2) * (kHeight / 2)];
  static std::int16_t halved_difference[kHeight / 2][kWidth / 2];
  constexpr int kHalfWidth = kWidth / 2;
  constexpr int kHalfHeight = kHeight / 2;  // an odd row is left out
  for (int y = 0; y < kHalfHeight; ++y) {
    for (int x = 0; x < kHalfWidth; ++x) {
      const std::uint8_t* p = pixels + 2 * y * kWidth + 2 * x;
      means[y * kHalfWidth + x] =
          static_cast<std::uint8_t>((p[0] + p[1] + p[kWidth] + p[kWidth + 1] + 2) / 4);
    }
  }
  static std::int16_t nowhere[kWidth];
  rows.start(packed_view<const std::uint8_t>(pixels, kWidth, kHeight), true);
  for (int y = 0; y < kHalfHeight; ++y) {
    rows.next(halved + y * kHalfWidth,
              y >= ScaleRows::kDelay ? halved_difference[y - ScaleRows::kDelay] : nowhere);
  }
  std::memcpy(pixels, means, sizeof means);
  run(kHalfWidth, kHalfHeight);
  for (int y = 0; y < kHalfHeight; ++y) {
    for (int x = 0; x < kHalfWidth; ++x) {
      assert_int_equal(halved[y * kHalfWidth + x], light[y * kHalfWidth + x]);
      if (x < kMargin || y < kMargin || x >= kHalfWidth - kMargin || y >= kHalfHeight - kMargin) continue;
      assert_int_equal(halved_difference[y][x], difference[y][x]);
    }
  }
}

void test_sizes_without_room_assert(void**) {
  constexpr int kLeast = 2 * kMargin;
  assert_true(test::asserts([] { rows.start({pixels, cfg::kImageWidth + 1, 20, cfg::kImageWidth + 1}); }));
  assert_true(test::asserts([] { rows.start({pixels, kLeast - 1, kLeast, kLeast}); }));
  assert_true(test::asserts([] { rows.start({pixels, kLeast, kLeast - 1, kLeast}); }));
  assert_true(test::asserts([] { rows.start({nullptr, kLeast, kLeast, kLeast}); }));
  assert_false(test::asserts([] { rows.start({pixels, kLeast, kLeast, kLeast}); }));
}

void test_more_rows_than_the_image_has_assert(void**) {
  static std::int16_t unused[kWidth];
  rows.start(packed_view<const std::uint8_t>(pixels, kWidth, 2 * kMargin));
  for (int y = 0; y < 2 * kMargin; ++y) rows.next(light, unused);
  assert_true(test::asserts([] { rows.next(light, unused); }));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_sigmas_are_those_of_the_header),
      cmocka_unit_test(test_against_brute_force),
      cmocka_unit_test(test_flat_stays_flat),
      cmocka_unit_test(test_the_largest_differences_fit),
      cmocka_unit_test(test_stride_is_followed),
      cmocka_unit_test(test_halved_is_that_of_the_means),
      cmocka_unit_test(test_sizes_without_room_assert),
      cmocka_unit_test(test_more_rows_than_the_image_has_assert),
  };
  return cmocka_run_group_tests_name("gaussian", tests, nullptr, nullptr);
}
