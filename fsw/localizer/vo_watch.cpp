#include "localizer/vo_watch.hpp"

#include <cmath>

#include "core/crc32.hpp"
#include "core/factors.hpp"

namespace cairn {

void VoWatch::init(const WatchParams& params) {
  CAIRN_ASSERT(params.row_step >= 1);
  params_ = params;
  looked_ = Sums();
  for (Sums& sums : used_) sums = Sums();
  next_ = 0;
}

VoWatch::Sum VoWatch::sum_of(const ImageU8& image) const {
  if (image.data == nullptr || image.width <= 0) return {};
  std::uint32_t crc = 0;
  for (int v = params_.row_step / 2; v < image.height; v += params_.row_step)
    crc = crc32(image.row(v), static_cast<std::size_t>(image.width), crc);
  return {true, crc};
}

WatchStatus VoWatch::look(const ImageU8& left, const ImageU8& right) {
  looked_ = {sum_of(left), sum_of(right)};
  for (const Sums& used : used_) {
    if (looked_.left == used.left || looked_.right == used.right) return WatchStatus::kFrozen;
  }
  return WatchStatus::kClear;
}

void VoWatch::used() {
  used_[next_] = looked_;
  next_ = (next_ + 1) % kKept;
}

WatchStatus VoWatch::compare(const Pose3& vo_step, const Mat3& covariance, const Pose3& prior_step) const {
  const Pose2 between = planar(prior_step.inverse() * vo_step);
  const Vec3 d(between.x_m, between.y_m, between.yaw_rad);
  const double s = params_.watch_sigma_m + params_.prior_share * prior_step.t.norm();
  const double w = params_.watch_sigma_rad + params_.prior_share * quat_log(prior_step.q).norm();
  Mat3 C = params_.vo_sigma_factor * params_.vo_sigma_factor * covariance;
  C(0, 0) += s * s;
  C(1, 1) += s * s;
  C(2, 2) += w * w;
  const Vec3 pull = Factors(C).solve(d);
  return d.dot(pull) <= params_.gate_chi2 ? WatchStatus::kClear : WatchStatus::kContradicted;
}

}  // namespace cairn
