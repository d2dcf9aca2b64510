#include "features/stereo_probe.hpp"

#include <cmath>

namespace cairn {
namespace {

constexpr int kSide = 8;  // told out in difference()
constexpr int kHalf = kSide / 2;
constexpr int kMaxRange = 256;

constexpr std::uint32_t kLanes = 0x00010001U;

/// Sum of absolute differences of two 8 x 8 windows, or of their first rows once that is above `limit`. A
/// word holds two rows' pixels, so that each step takes two: with 256 added to the left one, bit 8 of a lane
/// tells the difference's sign, and the lanes never borrow.
std::uint32_t difference(const std::uint32_t* left, const std::uint32_t* right, std::uint32_t limit) {
  std::uint32_t folded = 0;    // of each lane: 511 - |difference| where not negative, else 256 - |difference|
  std::uint32_t positive = 0;  // how many of the first kind
  std::uint32_t sum = 0;
  const auto add = [&](int i) {
    const std::uint32_t t = left[i] - right[i];
    const std::uint32_t sign = t & (kLanes << 8U);
    const std::uint32_t one = sign >> 8U;
    folded += t ^ (sign - one);
    positive += one;
  };
  for (std::uint32_t words = kSide; words <= kSide * kHalf && sum <= limit; words += kSide) {
    add(0), add(1), add(2), add(3), add(4), add(5), add(6), add(7);
    const std::uint32_t lanes = (kLanes << 8U) * words + (positive << 8U) - positive - folded;
    sum = (lanes >> 16U) + (lanes & 0xFFFFU);
    left += cfg::kImageWidth;
    right += cfg::kImageWidth;
  }
  return sum;
}

int texture(const std::uint8_t* a, int stride) {
  int sum = 0;
  for (int j = 0; j < kSide; ++j, a += stride) {
    for (int i = 0; i + 1 < kSide; ++i) {
      const int d = static_cast<int>(a[i + 1]) - static_cast<int>(a[i]);
      sum += d < 0 ? -d : d;
    }
  }
  return sum;
}

}  // namespace

ProbeStatus StereoProbeJob::start(const StereoProbeParams& params, const ImageU8& left, const ImageU8& right,
                                  const Vec3& plane) {
  probes_.clear();
  const bool sizes = left.data != nullptr && right.data != nullptr && left.width == right.width &&
                     left.height == right.height && left.width >= 64 && left.height >= 64 &&
                     left.width <= cfg::kImageWidth && left.height <= cfg::kImageHeight &&
                     left.stride >= left.width && right.stride >= right.width;
  const bool ranges = params.min_disparity_px >= 1 && params.max_disparity_px > params.min_disparity_px &&
                      params.max_disparity_px < cfg::kImageWidth && params.below >= 0.0 &&
                      params.above >= 0.0 && params.uniqueness >= 0.01;
  if (!sizes || !ranges || !std::isfinite(plane.squaredNorm())) return status_ = ProbeStatus::kBadInput;
  params_ = params;
  left_ = left;
  right_ = right;
  plane_ = plane;
  u_ = v_ = kHalf;
  last_ = 0;
  const double margin = 256.0 / params.uniqueness - 256.0;
  rival_margin_ = margin > 0.0 ? static_cast<std::uint32_t>(margin) + 1U : 0U;
  return status_ = ProbeStatus::kRunning;
}

Progress StereoProbeJob::step(WorkBudget& budget) {
  while (status_ == ProbeStatus::kRunning) {
    const Range range = search_range(u_, v_);
    const int steps = range.high - range.low + 1;
    const std::uint32_t row_ops = u_ == kHalf ? 8U * static_cast<std::uint32_t>(left_.width) : 0U;
    if (!budget.take(16U + row_ops + (steps > 0 ? 64U * static_cast<std::uint32_t>(steps) : 0U)))
      return Progress::kMore;
    if (u_ == kHalf) pack_rows();
    if (steps >= 4) probe(u_, v_, range);
    u_ += kSpacing;
    if (u_ + kHalf > left_.width) {
      u_ = kHalf;
      v_ += kSpacing;
      if (v_ + kHalf > left_.height) status_ = ProbeStatus::kDone;
    }
  }
  return Progress::kDone;
}

void StereoProbeJob::pack_rows() {
  for (int j = 0; j < kHalf; ++j) {
    const std::uint8_t* left = left_.row(v_ - kHalf + j);
    const std::uint8_t* left_below = left_.row(v_ + j);
    const std::uint8_t* right = right_.row(v_ - kHalf + j);
    const std::uint8_t* right_below = right_.row(v_ + j);
    for (int x = 0; x < left_.width; ++x) {
      left_words_[j][x] = (static_cast<std::uint32_t>(left[x]) << 16U) + left_below[x] + (kLanes << 8U);
      right_words_[j][x] = (static_cast<std::uint32_t>(right[x]) << 16U) + right_below[x];
    }
  }
}

StereoProbeJob::Range StereoProbeJob::search_range(int u, int v) const {
  const double d = plane_[0] * u + plane_[1] * v + plane_[2];
  double low = d * (1.0 - params_.below) - 2.0;
  double high = d * (1.0 + params_.above) + 2.0;
  const auto most =
      static_cast<double>(u - kHalf < params_.max_disparity_px ? u - kHalf : params_.max_disparity_px);
  if (!(low > params_.min_disparity_px)) low = params_.min_disparity_px;
  if (!(high < most)) high = most;
  if (!(high > low)) return {0, -1};
  const Range range = {static_cast<int>(low), static_cast<int>(high)};
  return {range.low, range.high - range.low < kMaxRange ? range.high : range.low + kMaxRange - 1};
}

void StereoProbeJob::probe(int u, int v, const Range& range) {
  const std::uint8_t* window = left_.row(v - kHalf) + (u - kHalf);
  if (texture(window, left_.stride) < params_.min_texture) return;
  const std::uint32_t* window_words = left_words_[0] + (u - kHalf);
  const std::uint32_t* target_words = right_words_[0] + (u - kHalf);
  const auto difference_at = [&](int d, std::uint32_t limit) {
    return difference(window_words, target_words - d, limit);
  };
  // A difference matters as far as it may be the least or its rival: the one before is a good guess of the
  // least, and most others end after a few rows.
  const int guess = last_ < range.low ? range.low : (last_ > range.high ? range.high : last_);
  std::uint32_t sums[kMaxRange];
  std::uint32_t least = sums[guess - range.low] = difference_at(guess, UINT32_MAX);
  for (int d = range.low; d <= range.high; ++d) {
    if (d == guess) continue;
    const std::uint32_t sum = difference_at(d, least + ((least * rival_margin_) >> 8U));
    sums[d - range.low] = sum;
    if (sum < least) least = sum;
  }
  int best = range.low;
  while (sums[best - range.low] != least) ++best;
  last_ = best;
  if (best == range.low || best == range.high) return;
  std::uint32_t rival = UINT32_MAX;
  for (int d = range.low; d <= range.high; ++d) {
    const bool apart = d < best - 2 || d > best + 2;
    if (apart && sums[d - range.low] < rival) rival = sums[d - range.low];
  }
  const std::uint32_t s0 = least;
  if (rival != UINT32_MAX && static_cast<double>(s0) >= params_.uniqueness * static_cast<double>(rival))
    return;
  const auto before = static_cast<float>(difference_at(best - 1, UINT32_MAX));
  const auto after = static_cast<float>(difference_at(best + 1, UINT32_MAX));
  const float steeper = before > after ? before - static_cast<float>(s0) : after - static_cast<float>(s0);
  const float offset = steeper > 0.0F ? 0.5F * (before - after) / steeper : 0.0F;
  const StereoProbe found = {static_cast<std::int16_t>(u), static_cast<std::int16_t>(v),
                             static_cast<float>(best) + offset};
  const bool fits = probes_.push_back(found);
  CAIRN_ASSERT(fits);
}

}  // namespace cairn
