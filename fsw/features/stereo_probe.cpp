#include "features/stereo_probe.hpp"

#include <cmath>

namespace cairn {
namespace {

constexpr int kSide = 8;
constexpr int kHalf = kSide / 2;
constexpr int kMaxRange = 256;

/// Sum of absolute differences of two 8 x 8 windows.
std::uint32_t difference(const std::uint8_t* a, int a_stride, const std::uint8_t* b, int b_stride) {
  std::uint32_t sum = 0;
  for (int j = 0; j < kSide; ++j) {
    for (int i = 0; i < kSide; ++i) {
      const int d = static_cast<int>(a[i]) - static_cast<int>(b[i]);
      sum += static_cast<std::uint32_t>(d < 0 ? -d : d);
    }
    a += a_stride;
    b += b_stride;
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
                      params.above >= 0.0;
  if (!sizes || !ranges || !std::isfinite(plane.squaredNorm())) return status_ = ProbeStatus::kBadInput;
  params_ = params;
  left_ = left;
  right_ = right;
  plane_ = plane;
  u_ = v_ = kHalf;
  return status_ = ProbeStatus::kRunning;
}

Progress StereoProbeJob::step(WorkBudget& budget) {
  while (status_ == ProbeStatus::kRunning) {
    const Range range = search_range(u_, v_);
    const int steps = range.high - range.low + 1;
    if (!budget.take(16U + (steps > 0 ? 64U * static_cast<std::uint32_t>(steps) : 0U)))
      return Progress::kMore;
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
  const std::uint8_t* target = right_.row(v - kHalf) + (u - kHalf);
  std::uint32_t sums[kMaxRange];
  int best = range.low;
  for (int d = range.low; d <= range.high; ++d) {
    sums[d - range.low] = difference(window, left_.stride, target - d, right_.stride);
    if (sums[d - range.low] < sums[best - range.low]) best = d;
  }
  if (best == range.low || best == range.high) return;
  std::uint32_t rival = UINT32_MAX;
  for (int d = range.low; d <= range.high; ++d) {
    const bool apart = d < best - 2 || d > best + 2;
    if (apart && sums[d - range.low] < rival) rival = sums[d - range.low];
  }
  const std::uint32_t s0 = sums[best - range.low];
  if (rival != UINT32_MAX && static_cast<double>(s0) >= params_.uniqueness * static_cast<double>(rival))
    return;
  const auto before = static_cast<float>(sums[best - 1 - range.low]);
  const auto after = static_cast<float>(sums[best + 1 - range.low]);
  const float steeper = before > after ? before - static_cast<float>(s0) : after - static_cast<float>(s0);
  const float offset = steeper > 0.0F ? 0.5F * (before - after) / steeper : 0.0F;
  const StereoProbe found = {static_cast<std::int16_t>(u), static_cast<std::int16_t>(v),
                             static_cast<float>(best) + offset};
  const bool fits = probes_.push_back(found);
  CAIRN_ASSERT(fits);
}

}  // namespace cairn
