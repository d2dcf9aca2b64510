// Smoothing against OpenCV: its separable filter with the same kernel, and its Gaussian of the same sigma.
#include "image/gaussian.hpp"

#include <opencv2/imgproc.hpp>

#include "core/random.hpp"
#include "support/cmocka.hpp"
#include "support/image_file.hpp"

using namespace cairn;

namespace {

std::uint8_t pixels[cfg::kImagePixels];
std::uint16_t smooth[cfg::kImagePixels];
RowBlur blur;
cv::Mat expected;

void run(const BlurKernel& kernel, const ImageU8& image) {
  blur.start(kernel, image.width, image.height);
  int fed = 0;
  for (int y = 0; y < image.height; ++y) {
    for (; fed <= y + kernel.radius && fed < image.height; ++fed) blur.feed(image.row(fed), fed);
    blur.finish(y, smooth + y * image.width);
  }
}

double largest_difference(const ImageU8& image) {
  double worst = 0.0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      worst = std::fmax(worst, std::fabs(smooth[y * image.width + x] - 256.0 * expected.at<double>(y, x)));
    }
  }
  return worst;
}

void compare(const ImageU8& image, double gaussian_bound_grey) {
  const cv::Mat grey(image.height, image.width, CV_8U, const_cast<std::uint8_t*>(image.data),
                     static_cast<std::size_t>(image.stride));
  for (const double sigma : {0.5, 0.6, 1.2, 1.92, 2.6}) {
    const BlurKernel kernel = make_blur_kernel(sigma);
    run(kernel, image);
    const int side = 2 * kernel.radius + 1;
    cv::Mat taps(side, 1, CV_64F);
    for (int i = 0; i < side; ++i) taps.at<double>(i) = kernel.tap[std::abs(i - kernel.radius)] / 256.0;
    cv::sepFilter2D(grey, expected, CV_64F, taps, taps, cv::Point(-1, -1), 0.0, cv::BORDER_REPLICATE);
    assert_at_most(largest_difference(image), 0.5);
    cv::Mat wide;
    grey.convertTo(wide, CV_64F);
    cv::GaussianBlur(wide, expected, cv::Size(side, side), sigma, sigma, cv::BORDER_REPLICATE);
    const double worst = largest_difference(image) / 256.0;
    print_message("sigma %.2f: within %.3f grey levels of cv::GaussianBlur\n", sigma, worst);
    assert_at_most(worst, gaussian_bound_grey);
  }
}

void test_noise(void**) {
  Random random(6);
  for (std::uint8_t& p : pixels) p = static_cast<std::uint8_t>(random.below(256));
  compare(packed_view<const std::uint8_t>(pixels, cfg::kImageWidth, cfg::kImageHeight), 2.0);
  compare({pixels, 101, 67, cfg::kImageWidth}, 2.0);
}

void test_picture(void**) {
  const MutableImageU8 image = test::read_image(
      CAIRN_SOURCE_DIR "/unit_tests/integration/sample/left/000040.jpg", pixels, sizeof pixels);
  assert_non_null(image.data);
  compare({image.data, image.width, image.height, image.stride}, 1.0);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_noise),
      cmocka_unit_test(test_picture),
  };
  return cmocka_run_group_tests_name("gaussian against OpenCV", tests, nullptr, nullptr);
}
