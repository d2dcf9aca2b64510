#include "localizer/carried_hypothesis.hpp"

#include <cmath>

namespace cairn {
namespace {

/// The covariance of x, y and yaw in axes that are turned by -`angle`.
Mat3 turned(const Mat3& covariance, double angle_rad) {
  const SinCos r = sin_cos(angle_rad);
  Mat3 R = Mat3::Identity();
  R(0, 0) = R(1, 1) = r.cos;
  R(0, 1) = -r.sin;
  R(1, 0) = r.sin;
  const Mat3 RC = R.lazyProduct(covariance);
  return RC.lazyProduct(R.transpose());
}

double sigma_of(const Mat3& covariance) { return std::sqrt(0.5 * (covariance(0, 0) + covariance(1, 1))); }

}  // namespace

/// Field by field: a fresh one of its own would take 2 kB of stack.
void CarriedHypothesis::reset() {
  sum_.reset();
  T_map_site_ = Pose2();
  covariance_ = Mat3::Zero();
  drift_m_ = 0.0;
  drift_rad_ = 0.0;
  places_.clear();
}

void CarriedHypothesis::begin(const Verdict& window, const Pose2& T_map_site, const Mat3& covariance,
                              const LocalMap& local) {
  reset();
  sum_.add(window);
  T_map_site_ = T_map_site;
  covariance_ = covariance;
  for (const LocalBoulder& b : local) {
    if (places_.push_back({static_cast<float>(b.p_site_m.x()), static_cast<float>(b.p_site_m.y())})) continue;
    reset();
    return;
  }
}

void CarriedHypothesis::carry(const PoseFusion& fusion, double yaw_rad, double most_xy_m,
                              double most_yaw_rad) {
  if (!alive()) return;
  const Mat3 drift = fusion.carried(Mat3::Zero());
  drift_m_ += sigma_of(drift);
  drift_rad_ += std::sqrt(drift(2, 2));
  // The steps are those of the pose, whose heading in the map may be another.
  const double angle = wrap_angle(T_map_site_.yaw_rad - yaw_rad);
  covariance_ = turned(fusion.carried(turned(covariance_, -angle)), angle);
  if (!(sigma_of(covariance_) <= most_xy_m && covariance_(2, 2) <= most_yaw_rad * most_yaw_rad)) reset();
}

std::size_t CarriedHypothesis::mark(LocalMap& local, const Vec2& rover_site_m) const {
  std::size_t fresh = 0;
  for (LocalBoulder& b : local) {
    const double far = std::sqrt((b.p_site_m - rover_site_m).squaredNorm());
    const double reach = kSameBoulder_m + 3.0 * (drift_m_ + drift_rad_ * far);
    b.counted = false;
    for (const Place& p : places_) {
      const double dx = b.p_site_m.x() - static_cast<double>(p.x_m);
      const double dy = b.p_site_m.y() - static_cast<double>(p.y_m);
      b.counted = b.counted || dx * dx + dy * dy <= reach * reach;
    }
    fresh += b.counted ? 0U : 1U;
  }
  return fresh;
}

void CarriedHypothesis::add(const Verdict& window, const Pose2& T_map_site, const Mat3& covariance,
                            const LocalMap& local) {
  sum_.add(window);
  if (window.status != VerdictStatus::kNoHypothesis) {
    T_map_site_ = T_map_site;
    covariance_ = covariance;
  }
  bool room = true;
  for (const LocalBoulder& b : local) {
    if (b.counted) continue;
    const Place place{static_cast<float>(b.p_site_m.x()), static_cast<float>(b.p_site_m.y())};
    room = places_.push_back(place) && room;
  }
  if (!room || sum_.drop() || window.status == VerdictStatus::kInconsistentWithPrior) reset();
}

}  // namespace cairn
