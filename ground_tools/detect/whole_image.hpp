/// The detector's kernels on whole images in memory, one call each: what kernels.hpp and components.hpp do
/// row by row, for callers with a small image in hand and for tests.
#pragma once

#include <vector>

#include "detect/components.hpp"
#include "image/image_view.hpp"

namespace cairn::ground {

/// DifferenceRows over the image. `valid.data` null: every pixel is; otherwise 0 = no data.
void difference_from_surroundings(const ImageU8& grey, const ImageU8& valid, int radius,
                                  const MutableImageU8& out);

/// MedianRows of side `side` (odd, at most 15) over a mask of zeros and non-zeros; gives 0 and 255.
void median_of_mask(const ImageU8& mask, int side, const MutableImageU8& out);

/// The 8-connected components of the non-zero pixels, in the order of their first pixel (row by row).
/// `values` (same size) is summed over each.
std::vector<Component> connected_components(const ImageU8& mask, const ImageU8& values);

}  // namespace cairn::ground
