// The mean-shift filter equals cv::pyrMeanShiftFiltering without pyramid, and connected regions equal
// cv::connectedComponents of the filtered image.
#include "segmentation/mean_shift.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "core/random.hpp"
#include "segmentation/region_map.hpp"
#include "support/cmocka.hpp"
#include "support/data.hpp"
#include "support/image_file.hpp"

using namespace cairn;

namespace {

std::uint8_t input[cfg::kImagePixels];
std::uint8_t output[cfg::kImagePixels];
MeanShiftJob job;
RegionMap map;

ImageU8 synthetic() {
  constexpr int kWidth = 200;
  constexpr int kHeight = 150;
  Random random(19);
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const int x = i % kWidth;
    const int y = i / kWidth;
    const int disc = (x - 70) * (x - 70) + (y - 80) * (y - 80) < 900 ? 60 : 0;
    input[i] = static_cast<std::uint8_t>(60 + x / 4 + disc + static_cast<int>(random.below(31)));
  }
  return packed_view<const std::uint8_t>(input, kWidth, kHeight);
}

void filter(const MeanShiftParams& params, const ImageU8& image) {
  assert_status(job.start(params, image, packed_view(output, image.width, image.height)),
                MeanShiftStatus::kRunning);
  WorkBudget budget = WorkBudget::unlimited();
  assert_status(job.step(budget), Progress::kDone);
}

/// Share of pixels that are equal. OpenCV takes colour images and sums the squared differences of the
/// channels: three equal channels ask for a radius longer by sqrt(3), and leave our rule for resting as it is
/// at convergence 1.
double agreement(const MeanShiftParams& params, const ImageU8& image) {
  filter(params, image);
  const cv::Mat grey(image.height, image.width, CV_8U, const_cast<std::uint8_t*>(image.data));
  cv::Mat colour;
  cv::Mat expected;
  cv::cvtColor(grey, colour, cv::COLOR_GRAY2BGR);
  const cv::TermCriteria rest(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, params.max_iterations, 1.0);
  cv::pyrMeanShiftFiltering(colour, expected, params.spatial_radius_px,
                            params.range_radius_grey * std::sqrt(3.0), 0, rest);
  const int count = image.width * image.height;
  int equal = 0;
  for (int i = 0; i < count; ++i) equal += output[i] == expected.data[3 * i] ? 1 : 0;
  return static_cast<double>(equal) / count;
}

void test_equals_opencv_on_synthetic_images(void**) {
  // All but means that lie just between two integers: OpenCV multiplies by the rounded reciprocal
  // of the count.
  double least = 1.0;
  const ImageU8 image = synthetic();
  for (const int spatial : {1, 2, 3, 5, 9}) {
    for (const int range : {4, 8, 16, 40}) {
      for (const int iterations : {1, 5, 20}) {
        least = std::min(least, agreement({spatial, range, iterations, 1}, image));
      }
    }
  }
  print_message("least share of equal pixels: %.6f\n", least);
  assert_at_least(least, 0.9995);
}

void check_file(const char* relative) {
  const std::string path = test::find_data(relative);
  SKIP_WITHOUT(path, relative);
  const MutableImageU8 image = test::read_image(path, input, sizeof input);
  assert_non_null(image.data);
  const ImageU8 view{image.data, image.width, image.height, image.stride};
  assert_near(agreement({}, view), 1.0, 0.0);
  assert_near(agreement({4, 8, 5, 1}, view), 1.0, 0.0);
}

void test_equals_opencv_on_mars(void**) { check_file("rendered_dev/left/000150.jpg"); }
void test_equals_opencv_on_box(void**) { check_file("oracles/vlfeat/box.pgm"); }

void test_regions_equal_connected_components(void**) {
  ImageU8 image = synthetic();
  image.height = 60;
  filter({}, image);
  const ImageU8 filtered = packed_view<const std::uint8_t>(output, image.width, image.height);
  map.clear(image.width, image.height);
  for (int y = 0; y < image.height; ++y) assert_true(map.connect_row(filtered, y, 0));
  map.compress(0, map.numbers());
  int regions = 0;
  for (int n = 0; n < map.numbers(); ++n) regions += map.is_root(static_cast<std::uint16_t>(n)) ? 1 : 0;
  const cv::Mat grey(image.height, image.width, CV_8U, output);
  int components = 0;
  for (int level = 0; level < 256; ++level) {
    cv::Mat labels;
    cv::Mat stats;
    cv::Mat centroids;
    const cv::Mat mask = grey == level;
    const int found = cv::connectedComponentsWithStats(mask, labels, stats, centroids, 4) - 1;
    components += found;
    for (int i = 0; i < image.width * image.height; ++i) {
      const int label = reinterpret_cast<const int*>(labels.data)[i];
      if (label == 0) continue;
      const std::uint16_t root = map.root_of(map.row(i / image.width)[i % image.width]);
      assert_int_equal(map.area_px(root), stats.at<int>(label, cv::CC_STAT_AREA));
      assert_int_equal(map.mean_q8(root), level * 256);
    }
  }
  assert_int_equal(regions, components);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_equals_opencv_on_synthetic_images),
      cmocka_unit_test(test_equals_opencv_on_mars),
      cmocka_unit_test(test_equals_opencv_on_box),
      cmocka_unit_test(test_regions_equal_connected_components),
  };
  return cmocka_run_group_tests_name("opencv/mean_shift", tests, nullptr, nullptr);
}
