// Probes of a real pair against its measured disparity (Middlebury's aloe).
#include "features/stereo_probe.hpp"

#include <opencv2/imgproc.hpp>

#include "support/cmocka.hpp"
#include "support/data.hpp"
#include "support/image_file.hpp"
#include "support/slices.hpp"

using namespace cairn;

namespace {

constexpr int kWidth = cfg::kImageWidth;
constexpr int kHeight = cfg::kImageHeight;
std::uint8_t file_pixels[1300 * 1200];
StereoProbeJob job;

/// A picture at half its size; empty where it cannot be read.
cv::Mat half_size(const char* name, int interpolation) {
  const MutableImageU8 image = test::read_image(test::find_data(name), file_pixels, sizeof file_pixels);
  cv::Mat half;
  if (image.data != nullptr) {
    cv::resize(cv::Mat(image.height, image.width, CV_8U, image.data), half, cv::Size(), 0.5, 0.5,
               interpolation);
  }
  return half;
}

ImageU8 piece(const cv::Mat& image, int u, int v) {
  return {image.ptr(v) + u, kWidth, kHeight, static_cast<int>(image.step)};
}

void test_aloe(void**) {
  SKIP_WITHOUT(test::find_data("oracles/stereo/aloeGT.png"), "oracles/stereo/aloeGT.png");
  static cv::Mat left;
  static cv::Mat right;
  static cv::Mat truth;
  left = half_size("oracles/stereo/aloeL.jpg", cv::INTER_AREA);
  right = half_size("oracles/stereo/aloeR.jpg", cv::INTER_AREA);
  truth = half_size("oracles/stereo/aloeGT.png", cv::INTER_NEAREST);
  assert_false(left.empty() || right.empty() || truth.empty());

  StereoProbeParams params;
  params.min_disparity_px = 8;
  params.max_disparity_px = 120;
  params.below = 0.8;
  params.above = 1.0;
  int known = 0;
  int within = 0;
  const int offsets[2][2] = {{0, 0}, {left.cols - kWidth, left.rows - kHeight}};
  for (const auto& offset : offsets) {
    // The plane is no more than the middle of the search.
    assert_status(job.start(params, piece(left, offset[0], offset[1]), piece(right, offset[0], offset[1]),
                            Vec3(0.0, 0.0, 55.0)),
                  ProbeStatus::kRunning);
    assert_true(test::run_whole(job));
    for (const StereoProbe& p : job.result()) {
      // Full-size pixels, 0 = unknown.
      const int d2 = truth.at<std::uint8_t>(offset[1] + p.v, offset[0] + p.u);
      if (d2 == 0) continue;
      ++known;
      within += std::fabs(static_cast<double>(p.d_px) - 0.5 * d2) <= 1.0 ? 1 : 0;
    }
  }
  print_message("%d probes with truth, %.1f %% within 1 px\n", known, 100.0 * within / known);
  assert_true(known > 5000);
  assert_at_least(within, 0.85 * known);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_aloe),
  };
  return cmocka_run_group_tests_name("stereo_probe against measured disparities", tests, nullptr, nullptr);
}
