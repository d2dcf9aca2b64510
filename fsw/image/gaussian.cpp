#include "image/gaussian.hpp"

namespace cairn {
namespace {

constexpr std::uint32_t kLow12 = 0x0FFF0FFFU;
constexpr std::uint32_t kRound = 0x00080008U;

std::uint32_t pair_of(std::uint32_t high, std::uint32_t low) { return (high << 16U) | low; }

/// 16 bits to 12 in both halves, rounded. The rounding carries into nothing: sums are at most 65280.
std::uint32_t cut(std::uint32_t w) { return ((w + kRound) >> 4U) & kLow12; }

}  // namespace

void ScaleRows::start(const ImageU8& image, bool halved) {
  image_ = image;
  halved_ = halved;
  width_ = halved ? image.width / 2 : image.width;
  height_ = halved ? image.height / 2 : image.height;
  CAIRN_ASSERT(image.data != nullptr && width_ >= 2 * kDifferenceMargin && image.width <= cfg::kImageWidth &&
               height_ >= 2 * kDifferenceMargin);
  half_ = (width_ + 1) / 2;
  y_ = 0;
  pack(0);
}

void ScaleRows::next(std::uint16_t* light, std::int16_t* difference) {
  const int y = y_++;
  CAIRN_ASSERT(y < height_);
  if (y + 1 < height_) pack(y + 1);
  smooth_columns(y, light);
  if (y >= 4) smooth_rows(y - 2);
  const int inside = y - kDelay;
  if (inside >= kDifferenceMargin && inside < height_ - kDifferenceMargin) subtract(inside, difference);
}

const std::uint8_t* ScaleRows::grey_row(int y) {
  if (!halved_) return image_.row(y);
  const std::uint8_t* upper = image_.row(2 * y);
  const std::uint8_t* lower = image_.row(2 * y + 1);
  for (int x = 0; x < width_; ++x) {
    const int sum = upper[2 * x] + upper[2 * x + 1] + lower[2 * x] + lower[2 * x + 1];
    mean_[x] = static_cast<std::uint8_t>((sum + 2) / 4);
  }
  return mean_;
}

void ScaleRows::pack(int y) {
  const std::uint8_t* row = grey_row(y);
  const std::uint8_t* right = row + half_;
  std::uint32_t* out = packed_[y % kRowRing] + kPad;
  const int both = width_ - half_;
  const std::uint32_t first = row[0];
  const std::uint32_t last = row[width_ - 1];
  for (int k = -kPad; k < 0; ++k) out[k] = pair_of(first, right[k]);
  for (int k = 0; k < both; ++k) out[k] = pair_of(row[k], right[k]);
  for (int k = both; k < half_ + kPad; ++k) out[k] = pair_of(row[k], last);
}

/// Three rows of the image to one of the light image and one of across_.
void ScaleRows::smooth_columns(int y, std::uint16_t* light) {
  const std::uint32_t* here = packed_[y % kRowRing];
  const std::uint32_t* above = y > 0 ? packed_[(y - 1) % kRowRing] : here;
  const std::uint32_t* below = y + 1 < height_ ? packed_[(y + 1) % kRowRing] : here;
  std::uint32_t* across = across_[y % kRing];
  std::uint16_t* light_right = light + half_;
  const int both = width_ - half_;
  // A running sum of neighbours for each factor [1 1]; what comes out is centred three words back.
  std::uint32_t d0 = 0, d1 = 0, d2 = 0, d3 = 0, d4 = 0, d5 = 0;
  std::uint32_t g0 = 0, g1 = 0;  // the last two sums of the light image's column
  const auto sums = [&](int k) {
    const std::uint32_t outer = above[k] + below[k];
    const std::uint32_t twice = here[k] << 1U;
    const std::uint32_t a0 = outer + twice;           // [1 2 1]
    const std::uint32_t g = 3U * a0 + (twice << 1U);  // [3 10 3]
    const std::uint32_t a1 = a0 + d0;
    const std::uint32_t a2 = a1 + d1;
    const std::uint32_t a3 = a2 + d2;
    const std::uint32_t a4 = a3 + d3;
    const std::uint32_t a5 = a4 + d4;
    const std::uint32_t a6 = a5 + d5;
    d0 = a0, d1 = a1, d2 = a2, d3 = a3, d4 = a4, d5 = a5;
    across[k >= 3 ? k - 3 : 0] = cut(a6);
    const std::uint32_t w = 3U * (g0 + g) + 10U * g1;
    g0 = g1;
    g1 = g;
    return w;
  };
  int k = 0;
  for (; k <= kPad; ++k) static_cast<void>(sums(k));
  for (int x = 0; x < both; ++x, ++k) {
    const std::uint32_t w = sums(k);
    light[x] = static_cast<std::uint16_t>(w >> 16U);
    light_right[x] = static_cast<std::uint16_t>(w & 0xFFFFU);
  }
  for (int x = both; x < half_; ++x, ++k) light[x] = static_cast<std::uint16_t>(sums(k) >> 16U);
  for (; k < half_ + 2 * kPad; ++k) static_cast<void>(sums(k));
}

/// Five rows of across_ to one of fine_ and one of wide_.
void ScaleRows::smooth_rows(int y) {
  const std::uint32_t* r0 = across_[(y - 2) % kRing];
  const std::uint32_t* r1 = across_[(y - 1) % kRing];
  const std::uint32_t* r2 = across_[y % kRing];
  const std::uint32_t* r3 = across_[(y + 1) % kRing];
  const std::uint32_t* r4 = across_[(y + 2) % kRing];
  std::uint32_t* fine = fine_[y % kRowRing];
  std::uint32_t* wide = wide_[y % kRing];
  std::uint32_t p0 = 0, p1 = 0;  // words before
  std::uint32_t t0 = 0, t1 = 0;  // sums of words two apart
  // Two words more on each side, where across_ still holds sums of whole neighbourhoods.
  for (int k = kPad - 2; k < half_ + kPad + 2; ++k) {
    const std::uint32_t middle = r2[k];
    const std::uint32_t sum = r0[k] + r4[k] + ((r1[k] + middle + r3[k]) << 2U) + (middle << 1U);
    const std::uint32_t f = cut(sum);
    fine[k] = f;
    const std::uint32_t t = f + p0;
    p0 = p1;
    p1 = f;
    wide[k - 2] = t + t0;
    t0 = t1;
    t1 = t;
  }
}

void ScaleRows::subtract(int y, std::int16_t* difference) const {
  const std::uint32_t* above = wide_[(y - 2) % kRing] + kPad;
  const std::uint32_t* here = wide_[y % kRing] + kPad;
  const std::uint32_t* below = wide_[(y + 2) % kRing] + kPad;
  const std::uint32_t* fine = fine_[y % kRowRing] + kPad;
  std::int16_t* right = difference + half_;
  const int both = width_ - half_;
  for (int k = 0; k < half_; ++k) {
    // The high half borrows what the low one is below zero.
    const std::uint32_t w = above[k] + (here[k] << 1U) + below[k] - (fine[k] << 4U);
    const auto low = static_cast<std::int16_t>(w & 0xFFFFU);
    difference[k] = static_cast<std::int16_t>((w - static_cast<std::uint32_t>(low)) >> 16U);
    if (k < both) right[k] = low;
  }
}

}  // namespace cairn
