/// From radiance to the 8-bit image: optics, dust, exposure, square-root transfer, noise.
#pragma once

#include <cstdint>
#include <vector>

#include "dataset/image.hpp"
#include "sim/scene.hpp"

namespace cairn::ground::sim {

struct FloatImage {
  int width = 0;
  int height = 0;
  std::vector<float> pixels;  ///< row-major, packed
};

enum class Side { kLeft, kRight };

///   out = clamp(round(255 sqrt(g v d (G * radiance) / white_radiance) + noise))
/// with
///   G      Gaussian blur of blur_px (separable, cut at 3 sigma, edges repeated);
///   v      vignetting: 1 - vignetting r^2, r = 1 in the centre of a corner pixel;
///   d      dust: soft dark spots, fixed for (seed, side);
///   g      exposure_gain(): the same for both cameras;
///   noise  normal, noise_dn, from (seed, frame, side, pixel) alone: the two cameras share none.
/// Radiance below 0 or NaN counts as 0. Pure, to be called from any thread; the same bytes in any order.
/// `out` is made to size. About 2 ms for 512 x 384.
void expose(const FloatImage& radiance, const Camera& camera, std::uint64_t seed, int frame, Side side,
            Image& out);

/// Exposure against nominal in a frame: 1 until the first step, then 1 + exposure_step_size u, u uniform in
/// -1 .. 1, drawn anew at each step.
double exposure_gain(const Camera& camera, std::uint64_t seed, int frame);

}  // namespace cairn::ground::sim
