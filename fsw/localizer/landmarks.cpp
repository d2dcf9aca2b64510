#include "localizer/landmarks.hpp"

#include <cmath>

namespace cairn {

void Landmarks::init(const LandmarkParams& params) {
  params_ = params;
  next_id_ = 0;
  clear();
}

void Landmarks::clear() {
  landmarks_.clear();
  survey_ = nullptr;
}

void Landmarks::start(const Relief::Boulders& survey, const Vec2& rover, double way_m, double radius_m,
                      double fresh_m) {
  survey_ = &survey;
  rover_site_m_ = rover;
  way_m_ = way_m;
  radius_m_ = radius_m;
  fresh_m_ = fresh_m;
  cursor_ = 0;
  for (Landmark& l : landmarks_) l.found = false;
}

Progress Landmarks::step(WorkBudget& budget) {
  while (survey_ != nullptr) {
    if (!budget.take(take_ops(landmarks_.size()))) return Progress::kMore;
    if (cursor_ < survey_->size()) {
      take((*survey_)[cursor_++]);
    } else {
      conclude();
    }
  }
  return Progress::kDone;
}

void Landmarks::take(const ReliefBoulder& b) {
  if (!(b.range_m <= radius_m_) || b.diameter_m < params_.min_diameter_m) return;
  const double reach = 0.4 * b.diameter_m > params_.same_m ? 0.4 * b.diameter_m : params_.same_m;
  Landmark* best = nullptr;
  Landmark* oldest = nullptr;
  double best2 = reach * reach;
  for (Landmark& l : landmarks_) {
    if (oldest == nullptr || l.seen.way_m < oldest->seen.way_m) oldest = &l;
    const double d2 = (l.seen.p_site_m - b.p_site_m).squaredNorm();
    if (l.found || d2 >= best2) continue;
    best = &l;
    best2 = d2;
  }
  if (best == nullptr) {
    Landmark fresh;
    fresh.id = next_id_++;
    if (landmarks_.push_back(fresh)) {
      best = &landmarks_.back();
    } else {
      if (oldest == nullptr) return;  // room for none
      best = oldest;
      *best = fresh;
    }
  }
  if (best->surveys == 0 || b.range_m < best->nearest_m) best->nearest_m = b.range_m;
  best->seen = b;
  best->found = true;
  if (best->surveys < UINT16_MAX) ++best->surveys;
}

/// Forgets what should have been found, and what lies too far back.
void Landmarks::conclude() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    const Landmark& l = landmarks_[i];
    const double since = way_m_ - l.seen.way_m;
    const bool near = (l.seen.p_site_m - rover_site_m_).norm() <= radius_m_ && since <= fresh_m_;
    if (since > params_.window_m || (near && !l.found)) continue;
    if (kept != i) landmarks_[kept] = l;
    ++kept;
  }
  landmarks_.resize(kept);
  survey_ = nullptr;
}

void Landmarks::used(const LocalMap& local, double pixel_m) {
  for (const LocalBoulder& b : local) {
    if (b.fresh > 0.0F) continue;
    const double tells = information(b, pixel_m);
    for (Landmark& l : landmarks_) {
      if (l.id == b.id && tells > l.told) l.told = tells;
    }
  }
}

double Landmarks::common_m(double pixel_m) const {
  const double of_map = params_.common_share * pixel_m;
  return std::sqrt(of_map * of_map + params_.common_own_m * params_.common_own_m);
}

/// Of a pair with the map, on an axis.
double Landmarks::information(const LocalBoulder& b, double pixel_m) const {
  const auto own = static_cast<double>(b.sigma_m);
  const double pair = sigma_pair_m(pixel_m);
  return 1.0 / (own * own + pair * pair);
}

void Landmarks::build(double pixel_m, double way_m, LocalMap& out) const {
  out.clear();
  for (const Landmark& l : landmarks_) {
    const double diameter = l.seen.diameter_m - params_.rims_m;
    if (diameter < params_.least_px * pixel_m || l.seen.open_share > params_.max_open) continue;
    const double since = way_m - l.seen.way_m;
    const double drift = params_.drift_share * since;
    LocalBoulder b;
    b.p_site_m = l.seen.p_site_m;
    b.z_site_m = l.seen.z_site_m;
    b.diameter_m = static_cast<float>(diameter);
    b.spread_m = static_cast<float>(0.25 * l.seen.diameter_m);
    const double far = params_.range_share * l.nearest_m;
    b.sigma_m = static_cast<float>(std::sqrt(l.seen.sigma_m * l.seen.sigma_m + far * far +
                                             params_.noise_m * params_.noise_m * since + drift * drift));
    b.id = l.id;
    b.sightings = l.surveys;
    b.in_view = since <= 1.0;
    const double tells = information(b, pixel_m);
    b.fresh = l.told < tells ? static_cast<float>(1.0 - l.told / tells) : 0.0F;
    if (!out.push_back(b)) return;
  }
}

}  // namespace cairn
