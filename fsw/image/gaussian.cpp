#include "image/gaussian.hpp"

#include <cstring>

namespace cairn {

void RowBlur::start(const BlurKernel& kernel, int width, int height) {
  CAIRN_ASSERT(width > 0 && width <= cfg::kImageWidth && height > 0 && kernel.radius <= kMaxBlurRadius);
  kernel_ = kernel;
  width_ = width;
  height_ = height;
}

void RowBlur::feed(const std::uint8_t* row, int y) {
  const int r = kernel_.radius;
  std::uint8_t padded[cfg::kImageWidth + 2 * kMaxBlurRadius];
  std::memset(padded, row[0], static_cast<std::size_t>(r));
  std::memcpy(padded + r, row, static_cast<std::size_t>(width_));
  std::memset(padded + r + width_, row[width_ - 1], static_cast<std::size_t>(r));

  std::uint16_t* out = ring_[y % kRing];
  for (int x = 0; x < width_; ++x) out[x] = static_cast<std::uint16_t>(kernel_.tap[0] * padded[x + r]);
  for (int i = 1; i <= r; ++i) {
    const std::uint16_t w = kernel_.tap[i];
    const std::uint8_t* a = padded + r - i;
    const std::uint8_t* b = padded + r + i;
    for (int x = 0; x < width_; ++x) out[x] = static_cast<std::uint16_t>(out[x] + w * (a[x] + b[x]));
  }
}

void RowBlur::finish(int y, std::uint16_t* out) const {
  std::uint32_t sum[cfg::kImageWidth];
  const std::uint16_t* centre = ring_[y % kRing];
  for (int x = 0; x < width_; ++x) sum[x] = 128U + static_cast<std::uint32_t>(kernel_.tap[0]) * centre[x];
  for (int i = 1; i <= kernel_.radius; ++i) {
    const std::uint32_t w = kernel_.tap[i];
    const std::uint16_t* a = ring_[(y - i < 0 ? 0 : y - i) % kRing];
    const std::uint16_t* b = ring_[(y + i >= height_ ? height_ - 1 : y + i) % kRing];
    for (int x = 0; x < width_; ++x) sum[x] += w * (static_cast<std::uint32_t>(a[x]) + b[x]);
  }
  for (int x = 0; x < width_; ++x) out[x] = static_cast<std::uint16_t>(sum[x] >> 8U);
}

}  // namespace cairn
