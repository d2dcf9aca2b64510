// Otsu, median, components and local mean of the orbital detector against OpenCV's.
#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "core/random.hpp"
#include "detect/kernels.hpp"
#include "detect/tile_grid.hpp"
#include "ground_tools/raster_in_memory.hpp"
#include "support/cmocka.hpp"
#include "support/data.hpp"

using namespace cairn;
using namespace cairn::ground;
using test::connected_components;
using test::difference_from_surroundings;
using test::median_of_mask;
using test::Raster;
using test::read_orthoimage;

namespace {

ImageU8 view_of(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<int>(image.step)};
}
MutableImageU8 mutable_view(cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<int>(image.step)};
}

/// Blobs: noise smoothed by `blur` (odd; 1 = white noise).
cv::Mat random_image(std::uint64_t seed, int width, int height, int blur) {
  Random random(seed);
  cv::Mat image(height, width, CV_8U);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x)
      image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(random.below(256));
  }
  if (blur > 1) cv::GaussianBlur(image, image, cv::Size(blur, blur), 0);
  return image;
}

/// The sample orthoimage, which comes with the project.
cv::Mat real_image() {
  static Raster raster;
  raster = read_orthoimage(CAIRN_SOURCE_DIR "/unit_tests/integration/sample/ortho_5mm.tif");
  return cv::Mat(raster.height, raster.width, CV_8U, raster.grey.data());
}

std::vector<cv::Mat> images;
cv::Mat expected;
cv::Mat actual;

int setup(void**) {
  for (const int blur : {1, 5, 31}) {
    for (const auto& [width, height] : {std::pair{1, 1}, {7, 3}, {3, 40}, {64, 48}, {301, 203}}) {
      images.push_back(random_image(static_cast<std::uint64_t>(17 * blur + width), width, height, blur));
    }
  }
  images.push_back(real_image());
  return 0;
}

cv::Mat mask_of(const cv::Mat& image) {
  static cv::Mat mask;
  cv::threshold(image, mask, 127, 255, cv::THRESH_BINARY);
  return mask.clone();
}

void test_otsu(void**) {
  for (const cv::Mat& image : images) {
    Histogram histogram{};
    double low = 0.0;
    double high = 0.0;
    cv::minMaxLoc(image, &low, &high);
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) ++histogram[image.at<std::uint8_t>(y, x)];
    }
    const int threshold = otsu_threshold(histogram);
    if (low == high) {
      assert_int_equal(threshold, static_cast<int>(low));
      continue;
    }
    cv::threshold(image, expected, 0, 255, cv::THRESH_BINARY | cv::THRESH_OTSU);
    cv::threshold(image, actual, threshold, 255,
                  cv::THRESH_BINARY);  // same split, whatever empty bins between
    assert_int_equal(cv::countNonZero(expected != actual), 0);
  }
}

void test_median(void**) {
  for (const cv::Mat& image : images) {
    const cv::Mat mask = mask_of(image);
    for (const int side : {1, 3, 7, 15}) {
      actual = cv::Mat(mask.size(), CV_8U);
      median_of_mask(view_of(mask), side, mutable_view(actual));
      if (side == 1)
        expected = mask.clone();
      else
        cv::medianBlur(mask, expected, side);
      assert_int_equal(cv::countNonZero(expected != actual), 0);
    }
  }
}

using Row = std::tuple<int, int, int, int, int, double, double>;
std::vector<Row> rows_expected;
std::vector<Row> rows_actual;

void test_components(void**) {
  for (const cv::Mat& image : images) {
    const cv::Mat mask = mask_of(image);
    static cv::Mat labels;
    static cv::Mat stats;
    static cv::Mat centroids;
    const int count = cv::connectedComponentsWithStats(mask, labels, stats, centroids, 8, CV_32S);
    rows_expected.clear();
    rows_actual.clear();
    for (int i = 1; i < count; ++i) {
      rows_expected.emplace_back(stats.at<int>(i, cv::CC_STAT_TOP), stats.at<int>(i, cv::CC_STAT_LEFT),
                                 stats.at<int>(i, cv::CC_STAT_WIDTH), stats.at<int>(i, cv::CC_STAT_HEIGHT),
                                 stats.at<int>(i, cv::CC_STAT_AREA), centroids.at<double>(i, 0),
                                 centroids.at<double>(i, 1));
    }
    static std::vector<Component> found;
    found = connected_components(view_of(mask), view_of(image));
    std::uint64_t bright = 0;
    for (const Component& c : found) {
      rows_actual.emplace_back(c.min_y, c.min_x, c.max_x - c.min_x + 1, c.max_y - c.min_y + 1,
                               static_cast<int>(c.area_px), c.mean_x(), c.mean_y());
      bright += c.sum_value;
    }
    for (std::size_t i = 1; i < found.size(); ++i) assert_true(found[i - 1].min_y <= found[i].min_y);
    std::sort(rows_expected.begin(), rows_expected.end());
    std::sort(rows_actual.begin(), rows_actual.end());
    assert_int_equal(rows_actual.size(), rows_expected.size());
    assert_true(rows_actual == rows_expected);
    assert_near(static_cast<double>(bright), cv::mean(image, mask)[0] * cv::countNonZero(mask), 0.5);
  }
}

/// Components that tiles of all sizes cut, against those of the whole mask.
void test_components_in_tiles(void**) {
  for (const cv::Mat& image : images) {
    const cv::Mat mask = mask_of(image) / 255;
    static cv::Mat labels;
    static cv::Mat stats;
    static cv::Mat centroids;
    const int count = cv::connectedComponentsWithStats(mask, labels, stats, centroids, 8, CV_32S);
    rows_expected.clear();
    for (int i = 1; i < count; ++i) {
      rows_expected.emplace_back(stats.at<int>(i, cv::CC_STAT_TOP), stats.at<int>(i, cv::CC_STAT_LEFT),
                                 stats.at<int>(i, cv::CC_STAT_WIDTH), stats.at<int>(i, cv::CC_STAT_HEIGHT),
                                 stats.at<int>(i, cv::CC_STAT_AREA), centroids.at<double>(i, 0),
                                 centroids.at<double>(i, 1));
    }
    std::sort(rows_expected.begin(), rows_expected.end());
    for (const int side : {5, 32, 1000}) {
      const TileGrid grid{{0, 0, mask.cols, mask.rows}, side, side + 3};
      TileJoiner joiner;
      static std::vector<Component> found;
      found.clear();
      for (std::uint32_t i = 0; i < grid.size(); ++i) {
        const PixelBox box = grid.box(i);
        TileLabeller labeller(box, grid.image);
        for (int y = box.y0; y < box.y1; ++y) labeller.push(mask.ptr(y) + box.x0, image.ptr(y) + box.x0);
        const TileComponents tile = labeller.finish();
        found.insert(found.end(), tile.closed.begin(), tile.closed.end());
        joiner.add(tile, grid.starts_row(i));
      }
      const std::vector<Component> shared = joiner.finish();
      found.insert(found.end(), shared.begin(), shared.end());
      rows_actual.clear();
      for (const Component& c : found) {
        rows_actual.emplace_back(c.min_y, c.min_x, c.max_x - c.min_x + 1, c.max_y - c.min_y + 1,
                                 static_cast<int>(c.area_px), c.mean_x(), c.mean_y());
      }
      std::sort(rows_actual.begin(), rows_actual.end());
      assert_true(rows_actual == rows_expected);
    }
  }
}

void test_second_moments(void**) {
  const cv::Mat mask = mask_of(images[14]);
  cv::Mat one(mask.size(), CV_8U);
  cv::Mat labels;
  cv::connectedComponents(mask, labels, 8, CV_32S);
  for (const Component& c : connected_components(view_of(mask), view_of(mask))) {
    int label = 0;
    for (int x = c.min_x; label == 0; ++x) label = labels.at<int>(c.min_y, x);
    one = labels == label;
    const cv::Moments m = cv::moments(one, true);
    if (std::fabs(m.m00 - static_cast<double>(c.area_px)) > 0.5)
      continue;  // another component starts in this row
    assert_near(static_cast<double>(c.sum_xx), m.m20, 1e-6 * m.m20);
    assert_near(static_cast<double>(c.sum_xy), m.m11, 1e-6 * m.m11);
    assert_near(static_cast<double>(c.sum_yy), m.m02, 1e-6 * m.m02);
  }
}

void test_difference_from_surroundings(void**) {
  for (const cv::Mat& image : images) {
    for (const int radius : {1, 8, 60}) {
      actual = cv::Mat(image.size(), CV_8U);
      difference_from_surroundings(view_of(image), {}, radius, mutable_view(actual));
      const cv::Size window(2 * radius + 1, 2 * radius + 1);
      static cv::Mat wide;
      static cv::Mat sum;
      static cv::Mat count;
      image.convertTo(wide, CV_64F);
      cv::boxFilter(wide, sum, CV_64F, window, cv::Point(-1, -1), false, cv::BORDER_CONSTANT);
      cv::boxFilter(cv::Mat::ones(image.size(), CV_64F), count, CV_64F, window, cv::Point(-1, -1), false,
                    cv::BORDER_CONSTANT);
      for (int y = 0; y < image.rows; ++y) {
        for (int x = 0; x < image.cols; ++x) {
          const double difference =
              image.at<std::uint8_t>(y, x) - sum.at<double>(y, x) / count.at<double>(y, x);
          const double level = std::clamp(128.0 + difference, 0.0, 255.0);
          assert_near(actual.at<std::uint8_t>(y, x), level, 0.5 + 1e-6);
        }
      }
    }
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_otsu),           cmocka_unit_test(test_median),
      cmocka_unit_test(test_components),     cmocka_unit_test(test_components_in_tiles),
      cmocka_unit_test(test_second_moments), cmocka_unit_test(test_difference_from_surroundings),
  };
  return cmocka_run_group_tests_name("opencv/orbital_kernels", tests, setup, nullptr);
}
