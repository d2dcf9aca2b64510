// The light image and the difference of Gaussians against OpenCV: its separable filter with the same kernels,
// and its Gaussians of the same sigmas.
#include "image/gaussian.hpp"

#include <opencv2/imgproc.hpp>

#include "core/random.hpp"
#include "support/cmocka.hpp"
#include "support/image_file.hpp"

using namespace cairn;

namespace {

constexpr int kMargin = ScaleRows::kDifferenceMargin;
std::uint8_t pixels[cfg::kImagePixels];
std::uint16_t light[cfg::kImagePixels];
std::int16_t difference[cfg::kImagePixels];
ScaleRows rows;
cv::Mat wide;
cv::Mat fine;
cv::Mat coarse;

void run(const ImageU8& image) {
  static std::int16_t nowhere[cfg::kImageWidth];
  rows.start(image);
  for (int y = 0; y < image.height; ++y) {
    const int told = y - ScaleRows::kDelay;
    rows.next(light + y * image.width, told >= 0 ? difference + told * image.width : nowhere);
  }
}

/// Largest difference in grey levels from `expected`; the light image everywhere,
/// the difference within its margin.
double worst_light(const ImageU8& image, const cv::Mat& expected) {
  double worst = 0.0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x)
      worst = std::fmax(worst, std::fabs(light[y * image.width + x] / 256.0 - expected.at<double>(y, x)));
  }
  return worst;
}
double worst_difference(const ImageU8& image) {
  double worst = 0.0;
  for (int y = kMargin; y < image.height - kMargin; ++y) {
    for (int x = kMargin; x < image.width - kMargin; ++x) {
      const double expected = coarse.at<double>(y, x) - fine.at<double>(y, x);
      worst = std::fmax(worst, std::fabs(difference[y * image.width + x] / 256.0 - expected));
    }
  }
  return worst;
}

cv::Mat filtered(const cv::Mat& taps) {
  cv::Mat out;
  cv::sepFilter2D(wide, out, CV_64F, taps, taps, cv::Point(-1, -1), 0.0, cv::BORDER_REPLICATE);
  return out;
}
cv::Mat gaussian(double sigma) {
  cv::Mat out;
  cv::GaussianBlur(wide, out, cv::Size(15, 15), sigma, sigma, cv::BORDER_REPLICATE);
  return out;
}

void compare(const ImageU8& image, double light_bound, double difference_bound) {
  cv::Mat(image.height, image.width, CV_8U, const_cast<std::uint8_t*>(image.data),
          static_cast<std::size_t>(image.stride))
      .convertTo(wide, CV_64F);
  run(image);
  assert_true(worst_light(image, filtered((cv::Mat_<double>(3, 1) << 3, 10, 3) / 16)) == 0.0);
  fine = filtered((cv::Mat_<double>(7, 1) << 1, 6, 15, 20, 15, 6, 1) / 64);
  coarse = filtered((cv::Mat_<double>(11, 1) << 1, 6, 17, 32, 46, 52, 46, 32, 17, 6, 1) / 256);
  assert_at_most(worst_difference(image), 0.1);

  const double light_off = worst_light(image, gaussian(0.612));
  fine = gaussian(1.225);
  coarse = gaussian(1.871);
  const double difference_off = worst_difference(image);
  print_message("from cv::GaussianBlur, at most, grey levels: light %.3f, difference %.3f\n", light_off,
                difference_off);
  assert_at_most(light_off, light_bound);
  assert_at_most(difference_off, difference_bound);
}

void test_noise(void**) {
  Random random(6);
  for (std::uint8_t& p : pixels) p = static_cast<std::uint8_t>(random.below(256));
  compare(packed_view<const std::uint8_t>(pixels, cfg::kImageWidth, cfg::kImageHeight), 20.0, 5.0);
  compare({pixels, 101, 67, cfg::kImageWidth}, 20.0, 5.0);
}

void test_picture(void**) {
  const MutableImageU8 image = test::read_image(
      CAIRN_SOURCE_DIR "/unit_tests/integration/sample/left/000040.jpg", pixels, sizeof pixels);
  assert_non_null(image.data);
  compare({image.data, image.width, image.height, image.stride}, 5.0, 2.5);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_noise),
      cmocka_unit_test(test_picture),
  };
  return cmocka_run_group_tests_name("gaussian against OpenCV", tests, nullptr, nullptr);
}
