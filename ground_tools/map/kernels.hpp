/// The image kernels of the paper's orbital detector (METHOD B.1), written here and checked against OpenCV's.
///
/// Pure functions on 8-bit views. Each looks at a bounded neighbourhood or works row by row, so that rasters
/// too large for memory can be cut into tiles with a halo around the same functions.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "image/image_view.hpp"

namespace cairn::ground {

using Histogram = std::array<std::uint64_t, 256>;

/// Called after each row with the number of rows done.
using RowDone = std::function<void(int rows_done)>;

/// Otsu's threshold (IEEE Trans. SMC 9(1), 1979): the value up to which, inclusive, a pixel belongs to the
/// dark class so that the variance between the classes is largest; the lowest of equally good ones. Splits
/// pixels as cv::threshold with THRESH_OTSU does. A histogram of one value gives that value. O(256).
int otsu_threshold(const Histogram& histogram);

/// Difference of each pixel from the mean of its surroundings, plus 128, clamped to 0..255 (128 where `valid`
/// is 0). The mean is taken over the valid pixels of the square of 2 `radius` + 1 pixels that lie in the
/// image. `valid.data` null: every pixel is. Running sums: O(pixels), whatever the radius.
void difference_from_surroundings(const ImageU8& grey, const ImageU8& valid, int radius,
                                  const MutableImageU8& out, const RowDone& done = {});

/// Median filter of side `side` (odd) on a mask of zeros and non-zeros; the border is replicated, as in
/// cv::medianBlur. Gives 0 and 255. Running sums: O(pixels), whatever the side. `out` must not overlap
/// `mask`.
void median_of_mask(const ImageU8& mask, int side, const MutableImageU8& out, const RowDone& done = {});

/// One 8-connected component of a mask, as sums from which centroid and second moments follow.
struct Component {
  std::uint64_t area_px = 0;
  std::uint64_t sum_x = 0;
  std::uint64_t sum_y = 0;
  std::uint64_t sum_xx = 0;
  std::uint64_t sum_xy = 0;
  std::uint64_t sum_yy = 0;
  std::uint64_t sum_value = 0;  ///< of the `values` image over the component
  int min_x = 0;
  int min_y = 0;
  int max_x = 0;
  int max_y = 0;

  double mean_x() const { return static_cast<double>(sum_x) / static_cast<double>(area_px); }
  double mean_y() const { return static_cast<double>(sum_y) / static_cast<double>(area_px); }
};

/// The 8-connected components of the non-zero pixels, in the order of their first pixel (row by row). Runs of
/// each row are joined to the row above by union-find: no label image, memory grows with the runs of two rows
/// and with the components. `values` (same size) is summed over each component.
std::vector<Component> connected_components(const ImageU8& mask, const ImageU8& values,
                                            const RowDone& done = {});

}  // namespace cairn::ground
