// Separable smoothing against a brute-force convolution in double precision; kernels against the exponential.
#include "image/gaussian.hpp"

#include <cstring>

#include "core/random.hpp"
#include "support/cmocka.hpp"
#include "support/death.hpp"

using namespace cairn;

namespace {

constexpr int kWidth = 70;
constexpr int kHeight = 41;
std::uint8_t pixels[kWidth * kHeight];
std::uint16_t smooth[kWidth * kHeight];
RowBlur blur;

void fill_random() {
  Random random(4);
  for (std::uint8_t& p : pixels) p = static_cast<std::uint8_t>(random.below(256));
}

/// As a caller streams: feed what a row asks for, take the row. `lead`: rows fed beyond what is asked for.
void run(const BlurKernel& kernel, int width, int height, int lead = 0) {
  blur.start(kernel, width, height);
  int fed = 0;
  for (int y = 0; y < height; ++y) {
    for (; fed <= y + kernel.radius + lead && fed < height; ++fed) blur.feed(pixels + fed * width, fed);
    blur.finish(y, smooth + y * width);
  }
}

int clamp(int v, int most) { return v < 0 ? 0 : (v > most ? most : v); }

double brute_force(const BlurKernel& kernel, int width, int height, int x, int y) {
  double sum = 0.0;
  for (int j = -kernel.radius; j <= kernel.radius; ++j) {
    for (int i = -kernel.radius; i <= kernel.radius; ++i) {
      const double w = kernel.tap[i < 0 ? -i : i] / 256.0 * kernel.tap[j < 0 ? -j : j] / 256.0;
      sum += w * pixels[clamp(y + j, height - 1) * width + clamp(x + i, width - 1)];
    }
  }
  return 256.0 * sum;
}

void test_kernels(void**) {
  for (int i = 50; i <= 260; ++i) {
    const double sigma = i / 100.0;
    const BlurKernel kernel = make_blur_kernel(sigma);
    assert_int_equal(kernel.radius, static_cast<int>(3.0 * sigma + 0.5));
    assert_true(kernel.radius <= kMaxBlurRadius);
    int sum = kernel.tap[0];
    double exact = 1.0;
    for (int k = 1; k <= kernel.radius; ++k) {
      sum += 2 * kernel.tap[k];
      exact += 2.0 * std::exp(-0.5 * k * k / (sigma * sigma));
      assert_true(kernel.tap[k] <= kernel.tap[k - 1]);
    }
    assert_int_equal(sum, 256);
    for (int k = 1; k <= kernel.radius; ++k) {
      assert_near(kernel.tap[k], 256.0 * std::exp(-0.5 * k * k / (sigma * sigma)) / exact, 0.51);
    }
    for (int k = kernel.radius + 1; k <= kMaxBlurRadius; ++k) assert_int_equal(kernel.tap[k], 0);
  }
}

void test_against_brute_force(void**) {
  fill_random();
  for (const double sigma : {0.5, 0.6, 1.2, 1.92, 2.6}) {
    const BlurKernel kernel = make_blur_kernel(sigma);
    run(kernel, kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        // Rows are summed exactly, columns rounded once.
        assert_near(smooth[y * kWidth + x], brute_force(kernel, kWidth, kHeight, x, y), 0.5);
      }
    }
  }
}

void test_images_smaller_than_the_kernel(void**) {
  fill_random();
  const BlurKernel kernel = make_blur_kernel(2.6);
  for (const int size : {1, 2, 5}) {
    run(kernel, size, size + 1);
    for (int y = 0; y <= size; ++y) {
      for (int x = 0; x < size; ++x) {
        assert_near(smooth[y * size + x], brute_force(kernel, size, size + 1, x, y), 0.5);
      }
    }
  }
}

void test_flat_stays_flat(void**) {
  for (const int grey : {0, 1, 128, 255}) {
    std::memset(pixels, grey, sizeof pixels);
    run(make_blur_kernel(1.92), kWidth, kHeight);
    for (const std::uint16_t s : smooth) assert_int_equal(s, 256 * grey);
  }
}

void test_rows_may_be_fed_ahead(void**) {
  // A caller that runs several kernels side by side feeds all of them as far as the widest asks for.
  fill_random();
  const BlurKernel kernel = make_blur_kernel(0.6);
  static std::uint16_t expected[kWidth * kHeight];
  run(kernel, kWidth, kHeight);
  std::memcpy(expected, smooth, sizeof smooth);
  run(kernel, kWidth, kHeight, kMaxBlurRadius - kernel.radius);
  assert_memory_equal(smooth, expected, sizeof smooth);
}

void test_sizes_without_room_assert(void**) {
  static const BlurKernel kernel = make_blur_kernel(1.0);
  assert_true(test::asserts([] { blur.start(kernel, cfg::kImageWidth + 1, 10); }));
  assert_true(test::asserts([] { blur.start(kernel, 0, 10); }));
  assert_true(test::asserts([] { blur.start(kernel, 10, 0); }));
  assert_false(test::asserts([] { blur.start(kernel, cfg::kImageWidth, 1); }));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_kernels),
      cmocka_unit_test(test_against_brute_force),
      cmocka_unit_test(test_images_smaller_than_the_kernel),
      cmocka_unit_test(test_flat_stays_flat),
      cmocka_unit_test(test_rows_may_be_fed_ahead),
      cmocka_unit_test(test_sizes_without_room_assert),
  };
  return cmocka_run_group_tests_name("gaussian", tests, nullptr, nullptr);
}
