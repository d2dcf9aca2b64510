// Descriptors of real images against OpenCV's SIFT at the same keypoints, upright and at our scale.
#include <algorithm>
#include <opencv2/features2d.hpp>
#include <vector>

#include "features/extractor.hpp"
#include "features/sift_descriptor.hpp"
#include "support/cmocka.hpp"
#include "support/data.hpp"
#include "support/image_file.hpp"
#include "support/slices.hpp"

using namespace cairn;

namespace {

std::uint8_t pixels[cfg::kImagePixels];
FeatureExtractor extractor;

double cosine(const Descriptor& ours, const float* theirs) {
  double ab = 0.0;
  double aa = 0.0;
  double bb = 0.0;
  for (int i = 0; i < kDescriptorSize; ++i) {
    const double a = ours.bin[i];
    const double b = static_cast<double>(theirs[i / 8 * 8 + (8 - i % 8) % 8]);  // OpenCV's angles have v up
    ab += a * b;
    aa += a * a;
    bb += b * b;
  }
  return ab / std::sqrt(aa * bb);
}

void compare(const MutableImageU8& image) {
  assert_non_null(image.data);
  assert_status(extractor.start({image.data, image.width, image.height, image.stride}),
                ExtractStatus::kRunning);
  assert_true(test::run_whole(extractor));
  assert_status(extractor.status(), ExtractStatus::kFeatures);

  // OpenCV smooths its base image from the picture's 0.5 px up to `sigma`: by the extractor's 0.6 px. Octave
  // and layer 0 are that image; cells are 3/2 of the size.
  static cv::Ptr<cv::SIFT> sift;
  static std::vector<cv::KeyPoint> keypoints;
  static cv::Mat theirs;
  sift = cv::SIFT::create(0, 3, 0.04, 10, std::sqrt(0.6 * 0.6 + 0.5 * 0.5));
  keypoints.clear();
  const FeatureSet& set = extractor.result();
  for (const Feature& f : set.features) {
    keypoints.emplace_back(static_cast<float>(f.iu), static_cast<float>(f.iv), 2.0F * kCellPx / 3.0F, 0.0F,
                           1.0F, 0);
  }
  sift->compute(cv::Mat(image.height, image.width, CV_8U, image.data), keypoints, theirs);
  assert_int_equal(theirs.rows, set.features.size());
  static std::vector<double> agreement;
  agreement.clear();
  for (std::size_t i = 0; i < set.features.size(); ++i) {
    agreement.push_back(cosine(set.descriptors[i], theirs.ptr<float>(static_cast<int>(i))));
  }
  std::sort(agreement.begin(), agreement.end());
  const std::size_t n = agreement.size();
  print_message("%zu keypoints: cosine median %.5f, 1 %% below %.5f, least %.5f\n", n, agreement[n / 2],
                agreement[n / 100], agreement[0]);
  assert_at_least(agreement[n / 2], 0.994);
  assert_at_least(agreement[n / 100], 0.98);
  assert_at_least(agreement[0], 0.97);
}

void test_sample(void**) {
  compare(test::read_image(CAIRN_SOURCE_DIR "/unit_tests/integration/sample/left/000040.jpg", pixels,
                           sizeof pixels));
}

void test_real_image(void**) {
  const std::string path = test::find_data("oracles/vlfeat/box.pgm");
  SKIP_WITHOUT(path, "oracles/vlfeat/box.pgm");
  compare(test::read_image(path, pixels, sizeof pixels));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_sample),
      cmocka_unit_test(test_real_image),
  };
  return cmocka_run_group_tests_name("SIFT descriptor against OpenCV", tests, nullptr, nullptr);
}
