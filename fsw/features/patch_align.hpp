/// Sub-pixel alignment of an image patch: where does what stands at a pixel of one image lie in another?
///
/// Independently found keypoints are biased (by some 0.02 px, which became 0.7 degrees of rotation in 25 m),
/// so each match is refined on the images: inverse-compositional Gauss-Newton (Baker & Matthews 2004) for a
/// translation, under a given affine distortion (the caller knows the ground's slope and the motion) and an
/// unknown gain and offset of brightness. The template stands at a whole pixel, so it is never interpolated;
/// both images are smoothed (sigma 0.6 px), so that bilinear interpolation of the target has little bias.
///
/// Gain and both shifts are linear in the target's samples, and an offset drops out of weights that sum to
/// zero. So an iteration is three integer sums over the samples, with 16-bit weights that the template holds:
/// a 750 converts integers to floating point through memory, some ten cycles each. Samples come in two
/// interlaced halves (a chequerboard): the first, coarse iterations take one half.
#pragma once

#include <cstdint>

#include "core/eigen.hpp"
#include "core/nodiscard.hpp"
#include "features/feature_set.hpp"

namespace cairn {

/// The patch is a disc, told by half the columns of each row. Smaller than a square of 13 x 13 under a window
/// like a Gaussian's, and with more weight at its rim: 3/5 of the time, and less drift where ground is rocky.
inline constexpr int kPatchRadius = 5;
inline constexpr int kPatchSide = 2 * kPatchRadius + 1;
inline constexpr std::int8_t kPatchHalfWidth[kPatchSide] = {2, 3, 4, 5, 5, 5, 5, 5, 4, 3, 2};
inline constexpr int kPatchSamples = 97;
/// Operations of one template and of one alignment (at most), for work budgets.
inline constexpr std::uint32_t kTemplateOps = 12U * kPatchSamples;
inline constexpr std::uint32_t kAlignOps = 100U * kPatchSamples;

/// A patch about a whole pixel, ready to be found elsewhere.
struct PatchTemplate {
  /// What a sample of the target adds to the sums.
  struct Weights {
    std::int16_t gain;
    std::int16_t u;
    std::int16_t v;
  };
  /// Step from the sums: with the first half of the samples, or with both.
  struct Solution {
    float gain;            ///< sum at gain 1
    float u, v;            ///< sums of the template itself, at gain 1
    float uu, uv, vu, vv;  ///< shift of one unit of the sums
  };
  Weights weights[kPatchSamples];  ///< half by half, row by row; each half of each kind sums to zero
  Solution half;
  Solution whole;
  float variance;  ///< weighted mean square, (grey levels x 64)^2
};

enum class CAIRN_NODISCARD AlignStatus : std::uint8_t {
  kAligned,       ///< the only one to use
  kOutside,       ///< the patch leaves an image
  kFlat,          ///< too little texture to fix both directions
  kNotConverged,  ///< still moving after the last iteration, or moved further than allowed
  kDifferent,     ///< converged on something that does not look like the template
};

struct AlignParams {
  int max_iterations = 12;
  float converged_px = 0.03F;  ///< last step: each is some five times shorter than the one before
  float max_shift_px = 3.0F;   ///< from the start position
  /// What is no match has some 0.3. A bound near what good patches have picks those that noise, JPEG or a
  /// new view happen to spare: 0.85 cost a tenth more drift, and every third point at noise of 10 DN.
  float min_correlation = 0.6F;
};

struct Alignment {
  AlignStatus status = AlignStatus::kOutside;
  float u = 0.0F;
  float v = 0.0F;
  float correlation = 0.0F;  ///< of template and target, weighted; told where converged
};

/// Cuts the template about pixel (iu, iv); kOutside or kFlat where there is none, else kAligned.
AlignStatus cut_template(const SmoothImage& image, int iu, int iv, PatchTemplate& out);

/// Finds the template in `target` near (u, v). `warp` carries offsets from the template's pixel to offsets in
/// the target (2x2, row-major); the identity where nothing is known.
Alignment align(const PatchTemplate& patch, const SmoothImage& target, float u, float v,
                const float (&warp)[4], const AlignParams& params);

}  // namespace cairn
