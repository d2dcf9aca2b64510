#include "features/sparse_patch.hpp"

#include <cmath>

namespace cairn {
namespace {

constexpr int kDown = 6;  // sums of four to 12 bits and a sign: products of all of them add up in 32

/// Sum of products, less what the means have in it.
float central(std::int32_t products, float sum, float other_sum) {
  return static_cast<float>(products) - sum * other_sum * (1.0F / SparsePatch::kSamples);
}

}  // namespace

void SparsePatch::cut(const SmoothImage& image, int iu, int iv) {
  constexpr int kHalf = kSide / 2;
  const auto four = [](const std::uint16_t* p, const std::uint16_t* q) { return p[0] + p[1] + q[0] + q[1]; };
  const std::int32_t middle = four(image.row(iv) + iu, image.row(iv + 1) + iu);
  std::int32_t total = 0;
  std::int32_t squares = 0;
  std::int32_t* out = value;
  for (int j = -kHalf; j <= kHalf; ++j) {
    const std::uint16_t* p = image.row(iv + 2 * j) + iu - 2 * kHalf;
    const std::uint16_t* q = p + image.stride;
    for (int i = 0; i < kSide; ++i, p += 2, q += 2) {
      const std::int32_t x = (four(p, q) - middle) >> kDown;
      total += x;
      squares += x * x;
      *out++ = x;
    }
  }
  sum = static_cast<float>(total);
  spread = central(squares, sum, sum);
}

std::uint32_t SparsePatch::difference(const SparsePatch& other) const {
  const float both = spread * other.spread;
  if (!(both > 0.0F)) return kUnlike;
  std::int32_t products = 0;
  for (int k = 0; k < kSamples; ++k) products += value[k] * other.value[k];
  const float correlation = central(products, sum, other.sum) / std::sqrt(both);
  return correlation < 1.0F ? static_cast<std::uint32_t>(65536.0F * (1.0F - correlation)) : 0U;
}

}  // namespace cairn
