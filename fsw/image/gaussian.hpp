/// Separable Gaussian smoothing in integers, a row at a time, so that a caller can stream an image through a
/// few rows of cache instead of keeping whole intermediate images.
///
/// Samples: u8 grey in; u16 with 8 fraction bits out (65280 = grey 255). Weights are integers that sum to
/// 256, so the result is exact and the same on every target. Rows and columns beyond the border repeat the
/// border pixel.
#pragma once

#include <cstdint>

#include "image/image_view.hpp"
#include "mission_cfg.hpp"

namespace cairn {

inline constexpr int kMaxBlurRadius = 8;

/// Half of a symmetric kernel: tap[0] is the centre; tap[0] + 2 sum(tap[1..radius]) = 256.
struct BlurKernel {
  int radius = 0;
  std::uint16_t tap[kMaxBlurRadius + 1] = {};
};

/// Kernel for a standard deviation of 0.5 to 2.6 px, cut at 3 sigma. Meant for compile time.
constexpr BlurKernel make_blur_kernel(double sigma_px) {
  BlurKernel kernel;
  kernel.radius = static_cast<int>(3.0 * sigma_px + 0.5);
  double weight[kMaxBlurRadius + 1] = {};
  double sum = 0.0;
  for (int i = 0; i <= kernel.radius; ++i) {
    // exp(-x) as exp(-x/64)^64 by its series: constexpr and the same bits everywhere.
    const double x = 0.5 * i * i / (sigma_px * sigma_px) / 64.0;
    double e = 1.0 - x + x * x / 2.0 - x * x * x / 6.0 + x * x * x * x / 24.0 - x * x * x * x * x / 120.0;
    for (int k = 0; k < 6; ++k) e *= e;
    weight[i] = e;
    sum += i == 0 ? e : 2.0 * e;
  }
  int total = 0;
  for (int i = 1; i <= kernel.radius; ++i) {
    kernel.tap[i] = static_cast<std::uint16_t>(256.0 * weight[i] / sum + 0.5);
    total += 2 * kernel.tap[i];
  }
  kernel.tap[0] = static_cast<std::uint16_t>(256 - total);
  return kernel;
}

/// Streams an image through the kernel: feed rows 0, 1, 2, ... and take finished rows `radius` behind.
class RowBlur {
 public:
  void start(const BlurKernel& kernel, int width, int height);
  /// Smooths row `y` of the image horizontally into the ring. Rows must come in order.
  void feed(const std::uint8_t* row, int y);
  /// Row `y` of the smoothed image into `out` (width samples). Asks for rows up to min(y + radius, height -
  /// 1) fed.
  void finish(int y, std::uint16_t* out) const;
  int radius() const { return kernel_.radius; }

 private:
  static constexpr int kRing = 2 * kMaxBlurRadius + 1;
  BlurKernel kernel_;
  int width_ = 0;
  int height_ = 0;
  std::uint16_t ring_[kRing][cfg::kImageWidth] = {};
};

}  // namespace cairn
