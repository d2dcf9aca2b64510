/// Upright SIFT descriptor 4 x 4 x 8 at one fixed scale (Lowe 2004, section 6, without orientation
/// normalisation; METHOD section A).
///
/// Gradients are central differences of the smoothed image. Each of 19 x 19 samples about the keypoint's
/// pixel votes with its magnitude times a Gaussian window (sigma = half the descriptor's width) into the
/// nearest 2 x 2 cells and 2 orientations (tri-linear). The vector is normalised, cut at 0.2, normalised
/// again and multiplied by 512 (at most 255). Cells are `kCellPx` wide: that of a SIFT keypoint of scale
/// kCellPx / 3.
///
/// Orientation comes from a quadratic approximation of the arc tangent (error below 0.004 rad) and magnitude
/// from a polynomial (error below 0.5 %): a 750 has neither instruction, and the bins are 0.79 rad wide.
#pragma once

#include "features/feature_set.hpp"

namespace cairn {

inline constexpr int kCellPx = 4;
/// A keypoint nearer to the border than this has no descriptor.
inline constexpr int kDescriptorMargin = 2 * kCellPx + kCellPx / 2 + 1;
/// Operations of one descriptor, for work budgets.
inline constexpr std::uint32_t kDescriptorOps = 8000;

/// The descriptor at pixel (iu, iv), at least kDescriptorMargin inside the image. A flat patch gives all
/// zeros.
Descriptor describe(const SmoothImage& image, int iu, int iv);

/// Chi-squared distance of two byte histograms: sum (a - b)^2 / (a + b), in 1/256 (METHOD section A), by a
/// table of reciprocals. Stops early and returns a value of at least `stop` once the sum reaches it.
std::uint32_t chi_squared(const Descriptor& a, const Descriptor& b, std::uint32_t stop);

}  // namespace cairn
