/// Upright SIFT descriptor 4 x 4 x 8 at one fixed scale (Lowe 2004, section 6, without orientation
/// normalisation; METHOD section A).
///
/// Gradients are central differences of the smoothed image. Each second one of 19 x 19 samples about the
/// keypoint's pixel, as on a chessboard, votes into the nearest 2 x 2 cells, linearly in u and v, and into
/// the axis (0, 2, 4, 6) and the diagonal (1, 3, 5, 7) on both sides of its direction. (All of them match as
/// well; a quarter of them, 9 x 9, lose 3 % of the matches.) The cells are multiplied by a Gaussian window
/// (sigma = half the descriptor's width) at their centres; the vector is normalised, cut at 0.2, normalised
/// again and multiplied by 512 (at most 255). Cells are `kCellPx` wide: that of a SIFT keypoint of scale
/// kCellPx / 3.
///
/// A gradient whose components have magnitudes l >= s gives l - s to the axis and 11/8 s to the diagonal: its
/// decomposition along the two, but for 1.375 in place of 1.414, which evens the total out (within 7 % of the
/// magnitude at any angle). That and the window at the cells (the 'flat window' of VLFeat's dense SIFT) leave
/// integers alone and no division, arc tangent or product a sample, at a cosine of 0.99 to Lowe's formula;
/// the matches of the sample traverse are as many.
#pragma once

#include "features/feature_set.hpp"

namespace cairn {

inline constexpr int kCellPx = 4;
/// A keypoint nearer to the border than this has no descriptor.
inline constexpr int kDescriptorMargin = 2 * kCellPx + kCellPx / 2 + 1;
/// Operations of one descriptor, for work budgets.
inline constexpr std::uint32_t kDescriptorOps = 6000;

/// The descriptor at pixel (iu, iv), at least kDescriptorMargin inside the image. A flat patch
/// gives all zeros.
Descriptor describe(const SmoothImage& image, int iu, int iv);

/// Chi-squared distance of two byte histograms: sum (a - b)^2 / (a + b), in 1/256 (METHOD section A), by a
/// table of reciprocals. Stops early and returns a value of at least `stop` once the sum reaches it.
std::uint32_t chi_squared(const Descriptor& a, const Descriptor& b, std::uint32_t stop);

}  // namespace cairn
