#include "localizer/map_fix.hpp"

#include <cmath>

#include "core/arithmetic.hpp"
#include "core/exp_log.hpp"
#include "core/factors.hpp"

namespace cairn {
namespace {

MapFixStatus status_of(VerdictStatus verdict) {
  switch (verdict) {
    case VerdictStatus::kAccepted: return MapFixStatus::kAccepted;
    case VerdictStatus::kInconsistentWithPrior: return MapFixStatus::kInconsistent;
    case VerdictStatus::kTooLittleEvidence: return MapFixStatus::kTooLittleEvidence;
    case VerdictStatus::kViewDisagrees: return MapFixStatus::kViewDisagrees;
    case VerdictStatus::kAmbiguous: return MapFixStatus::kAmbiguous;
    case VerdictStatus::kChanceAgreement: return MapFixStatus::kChanceAgreement;
    case VerdictStatus::kNone:
    case VerdictStatus::kNoHypothesis: break;
  }
  return MapFixStatus::kNoHypothesis;
}

MapFixStatus status_of(SearchStatus search) {
  switch (search) {
    case SearchStatus::kRunning: return MapFixStatus::kRunning;
    case SearchStatus::kNoMapBoulders: return MapFixStatus::kNoMapBoulders;
    case SearchStatus::kNoLocalBoulders: return MapFixStatus::kNoLocalBoulders;
    case SearchStatus::kNoSearchRoom: return MapFixStatus::kNoSearchRoom;
    case SearchStatus::kIdle:
    case SearchStatus::kDone:
    case SearchStatus::kBadInput: break;
  }
  return MapFixStatus::kBadInput;
}

MapFixStatus status_of(RelocationStatus relocation) {
  switch (relocation) {
    case RelocationStatus::kRunning: return MapFixStatus::kRunning;
    case RelocationStatus::kNotFound: return MapFixStatus::kNoHypothesis;
    case RelocationStatus::kNoMap: return MapFixStatus::kNoMap;
    case RelocationStatus::kMapTooLarge: return MapFixStatus::kNoSearchRoom;
    case RelocationStatus::kTooFewBoulders: return MapFixStatus::kNoLocalBoulders;
    case RelocationStatus::kIdle:
    case RelocationStatus::kJudged:
    case RelocationStatus::kBadInput: break;
  }
  return MapFixStatus::kBadInput;
}

/// The inverse of a symmetric positive definite matrix; false where it is none, or is so by a hair.
bool inverse(const Mat3& m, Mat3& out) {
  const Factors factors(m);
  if (!factors.positive()) return false;
  out = factors.inverse();
  for (int k = 0; k < 3; ++k) {
    if (!(out(k, k) > 0.0 && out(k, k) < 1.0e12)) return false;
  }
  return true;
}

double farthest(const LocalMap& local, const Vec2& pivot_site_m) {
  double far = 0.0;
  for (const LocalBoulder& b : local) {
    const double r = (b.p_site_m - pivot_site_m).norm();
    far = r > far ? r : far;
  }
  return far;
}

/// Of their places in the local map, on an axis, in the mean.
double own_variance(const LocalMap& local) {
  double sum = 0.0;
  for (const LocalBoulder& b : local) sum += square(static_cast<double>(b.sigma_m));
  return local.empty() ? 0.0 : sum / static_cast<double>(local.size());
}

/// Along x or y, the larger one.
double sigma_xy(const Mat3& covariance) {
  return std::sqrt(covariance(0, 0) > covariance(1, 1) ? covariance(0, 0) : covariance(1, 1));
}

}  // namespace

bool prior_is_wide(const MapFixParams& params, const Mat3& covariance, double per_m2) {
  const double sigma = sigma_xy(covariance);
  const double reach = params.search.reach_sigmas * sigma;
  const bool near = sigma <= params.wide_xy_m || kPi * reach * reach * per_m2 <= params.wide_boulders;
  return !(near && covariance(2, 2) <= params.wide_yaw_rad * params.wide_yaw_rad);
}

void MapFix::begin(const MapFixParams& params, const OrbitalMap& map, const LocalMap& local,
                   const Pose2& T_map_site, const Vec2& pivot_site_m) {
  params_ = params;
  map_ = map;
  if (&local != &local_) local_ = local;
  T_map_site_ = T_map_site;
  pivot_site_m_ = pivot_site_m;
  pivot_map_m_ = T_map_site * pivot_site_m;
  result_ = {};
  result_.T_map_site = T_map_site;
}

MapFixStatus MapFix::start_tracked(const MapFixParams& params, const OrbitalMap& map, const LocalMap& local,
                                   const Pose2& T_map_site, const Vec2& pivot_site_m,
                                   const Mat3& covariance) {
  begin(params, map, local, T_map_site, pivot_site_m);
  prior_covariance_ = covariance;
  phase_ = Phase::kWindow;
  if (!map.usable()) return status_ = MapFixStatus::kNoMap;
  if (local.size() < 2) return status_ = MapFixStatus::kNoLocalBoulders;
  if (!covariance.allFinite()) return status_ = MapFixStatus::kBadInput;
  const Vec2 extent = map.extent_m();
  const double density =
      (map.count() + 1.0) / ((extent.x() + map.quantum_m()) * (extent.y() + map.quantum_m()));
  if (prior_is_wide(params, covariance, density)) return look_widely();
  const double radius = params.search.reach_sigmas * sigma_xy(covariance) + farthest(local, pivot_site_m) +
                        params.search.ring / std::sqrt(density);
  window_radius_m_ = radius > params.map_window_radius_m ? radius : params.map_window_radius_m;
  window_.clear();
  const bool reads = reader_.start(map, pivot_map_m_, window_radius_m_) == WindowStatus::kUsable;
  return status_ = reads ? MapFixStatus::kRunning : MapFixStatus::kBadInput;
}

MapFixStatus MapFix::start_lost(const MapFixParams& params, const OrbitalMap& map, const LocalMap& local,
                                const Pose2& T_map_site, const Vec2& pivot_site_m,
                                const SearchRegion& region) {
  begin(params, map, local, T_map_site, pivot_site_m);
  return relocate(region);
}

MapFixStatus MapFix::relocate(const SearchRegion& region) {
  phase_ = Phase::kRelocate;
  RelocationParams params{params_.lost, params_.search.evidence, params_.search.verdict,
                          params_.search.scale_sigma};
  const double own = own_variance(local_);
  if (own > 0.0) params.search.sigma_pair_m = std::sqrt(own + square(params_.lost.sigma_pair_m));
  const Relocation::Room room{window_, search_.lend_ground()};
  return status_ = status_of(relocation_.start(params, map_, local_, pivot_site_m_, region, room));
}

MapFixStatus MapFix::look_widely() {
  return params_.search.fresh_only ? status_ = MapFixStatus::kNoSearchRoom : relocate(region_of_prior());
}

/// All that the prior leaves room for, as a disc and a sector.
SearchRegion MapFix::region_of_prior() const {
  const double reach = params_.search.reach_sigmas;
  const double xy = std::sqrt(prior_covariance_(0, 0) + prior_covariance_(1, 1));
  const double yaw = reach * std::sqrt(prior_covariance_(2, 2));
  SearchRegion region;
  region.anywhere = false;
  region.centre_map_m = pivot_map_m_;
  region.radius_m = reach * xy > 0.01 ? reach * xy : 0.01;
  region.yaw_rad = T_map_site_.yaw_rad;
  region.half_sector_rad = yaw > 0.01 ? (yaw < kPi ? yaw : kPi) : 0.01;
  return region;
}

Progress MapFix::step(WorkBudget& budget) {
  while (status_ == MapFixStatus::kRunning) {
    switch (phase_) {
      case Phase::kWindow:
        if (read_window(budget) == Progress::kMore) return Progress::kMore;
        break;
      case Phase::kLay:
        if (!budget.take(PoseSearchJob::start_ops(local_.size()))) return Progress::kMore;
        begin_search();
        break;
      case Phase::kSearch:
        if (search_.step(budget) == Progress::kMore) return Progress::kMore;
        take_search();
        break;
      case Phase::kRelocate:
        if (relocation_.step(budget) == Progress::kMore) return Progress::kMore;
        take_relocation();
        break;
    }
  }
  return Progress::kDone;
}

Progress MapFix::read_window(WorkBudget& budget) {
  MapReader::Chunk chunk;
  for (;;) {
    const Progress progress = reader_.step(budget, chunk);
    for (const MapBoulder& b : chunk) {
      if (window_.push_back(b)) continue;
      status_ = look_widely();  // more than there is room for here
      return Progress::kDone;
    }
    if (progress == Progress::kDone) break;
    if (chunk.empty()) return Progress::kMore;
  }
  phase_ = Phase::kLay;
  return Progress::kDone;
}

/// Whether the evidence of `boulders` of which two fifths are the map's would pass the threshold in
/// nearly every case:
///   n [ p (ln(p / (2 pi density s^2)) - 1) + (1 - p) ln(1 - p) ] - 2 sqrt(n p) > threshold + volume,
/// with the volume term that a fix of a few centimetres in a prior of a few decimetres, or in a
/// whole map, costs.
bool MapFix::expects_proof(std::size_t boulders, double density) const {
  constexpr double kTrueShare = 0.4;
  constexpr double kVolumeTracked = 6.0;
  constexpr double kVolumeLost = 18.0;
  const double s = params_.search.evidence.sigma_pair_m;
  const auto n = static_cast<double>(boulders);
  const double each = kTrueShare * (ln(kTrueShare / (2.0 * kPi * density * s * s)) - 1.0) +
                      (1.0 - kTrueShare) * ln(1.0 - kTrueShare);
  const double volume = phase_ == Phase::kRelocate ? kVolumeLost : kVolumeTracked;
  return n * each - 2.0 * std::sqrt(n * kTrueShare) > params_.search.verdict.ln_threshold + volume;
}

void MapFix::begin_search() {
  result_.map_boulders = static_cast<std::uint16_t>(window_.size());
  phase_ = Phase::kSearch;
  status_ = status_of(search_.start(params_.search, window_, window_radius_m_, local_, T_map_site_,
                                    pivot_site_m_, prior_covariance_));
  // Where the map's ground ends it is the pose that does not fit; within it boulders may be few.
  if (status_ == MapFixStatus::kNoMapBoulders && off_map())
    result_.verdict.log_ratio = evidence_of_misses(local_.size());
}

bool MapFix::off_map() const {
  const Vec2 in = pivot_map_m_ - map_.origin_map_m();
  const Vec2 extent = map_.extent_m();
  return in.x() < 0.0 || in.y() < 0.0 || in.x() > extent.x() || in.y() > extent.y();
}

void MapFix::take_search() {
  if (search_.status() == SearchStatus::kBadInput) {
    status_ = MapFixStatus::kBadInput;
    return;
  }
  const SearchResult& r = search_.result();
  const bool again = result_.hypotheses > 0;
  result_.hypotheses += r.hypotheses;
  if (again && r.verdict.status != VerdictStatus::kAccepted) {
    status_ = status_of(result_.verdict.status);
    return;
  }
  result_.scale = r.scale;
  result_.scale_sigma = r.scale_sigma;
  result_.rms_m = r.best.rms_m;
  result_.pairs = r.best.matched;
  result_.sightings = static_cast<std::uint16_t>(r.sightings);
  result_.proof_expected = r.density > 0.0 && expects_proof(static_cast<std::size_t>(r.sightings), r.density);
  Mat3 information;
  if (!inverse(prior_covariance_, information)) {
    status_ = MapFixStatus::kBadInput;
    return;
  }
  const Hypothesis& pose = r.best.pose;
  if (r.verdict.status != VerdictStatus::kNoHypothesis) result_.T_map_site = r.T_map_site;
  const Vec3 offset(pose.x_m, pose.y_m, wrap_angle(pose.yaw_rad - T_map_site_.yaw_rad));
  judged(r.verdict, offset, r.covariance, information);
  if (status_ == MapFixStatus::kAccepted) tell_fresh(r.best, offset);
  if (!again && status_ == MapFixStatus::kTooLittleEvidence && result_.hypotheses > 0 &&
      params_.search.evidence.scale_sigma == 0.0 && params_.search.scale_sigma > 0.0) {
    params_.search.evidence.scale_sigma = params_.search.scale_sigma;
    status_ = MapFixStatus::kRunning;
    phase_ = Phase::kLay;
  }
}

/// Where they leave a direction open, its variance is large and the offset nothing.
void MapFix::tell_fresh(const Evidence& best, const Vec3& offset) {
  constexpr double kNothing_m = 1.0e3;
  const Mat3 information = best.fresh_information + 1.0 / (kNothing_m * kNothing_m) * Mat3::Identity();
  result_.fresh_covariance = Factors(information).inverse();
  result_.fresh_offset = offset + result_.fresh_covariance * best.fresh_pull;
  result_.fresh_unproven = fresh_may_be_chance(best, information);
  mark_used(best, search_.sightings());
}

bool MapFix::fresh_may_be_chance(const Evidence& best, const Mat3& fresh_information) const {
  const bool alone = best.fresh_log == best.S;  // then they prove the fix
  const bool speak = best.fresh_information(0, 0) > 0.0;
  if (alone || !speak) return false;
  const Factors apart(Mat3(prior_covariance_ + result_.fresh_covariance));
  const Factors known(fresh_information);
  double room2 = 1.0;  // det(1 + P F)
  for (int k = 0; k < 3; ++k) room2 *= apart.pivot(k) * known.pivot(k);
  const double gain2 = best.fresh_pull.dot(result_.fresh_covariance * best.fresh_pull);
  const double chi2 = result_.fresh_offset.dot(apart.solve(result_.fresh_offset));
  return !(best.fresh_log + 0.5 * (gain2 - chi2 - ln(room2)) >= 0.0);  // nor where it is no number
}

void MapFix::mark_used(const Evidence& best, const Sightings& sightings) {
  double far_m = 0.0;
  double used = 0.0;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if ((best.on_map[i / 32] >> (i % 32) & 1U) == 0U) continue;
    LocalBoulder& boulder = local_[sightings[i].local];
    boulder.fresh = 0.0F;
    far_m += std::sqrt((boulder.p_site_m - pivot_site_m_).squaredNorm());
    used += 1.0;
  }
  if (used > 0.0) result_.far_m = far_m / used;
}

void MapFix::take_relocation() {
  const std::uint32_t boulders = relocation_.map_boulders();
  result_.map_boulders = static_cast<std::uint16_t>(boulders < 0xFFFFU ? boulders : 0xFFFFU);
  result_.sightings = static_cast<std::uint16_t>(local_.size());
  const Vec2 extent = map_.extent_m();
  const double area = (extent.x() + 1.0) * (extent.y() + 1.0);
  result_.proof_expected = expects_proof(local_.size(), (map_.count() + 1.0) / area);
  if (relocation_.status() != RelocationStatus::kJudged) {
    status_ = status_of(relocation_.status());
    // As where a prior that is not wide leaves nothing to be weighed.
    if (status_ == MapFixStatus::kNoHypothesis && relocation_.search().hits().empty())
      result_.verdict.log_ratio = evidence_of_misses(local_.size());
    return;
  }
  const RelocationResult& r = relocation_.result();
  result_.rms_m = r.best.rms_m;
  result_.pairs = r.best.matched;
  result_.scale = r.scale;
  result_.scale_sigma = r.scale_sigma;
  result_.hypotheses = r.hypotheses;
  result_.T_map_site = r.T_map_site;
  const Vec2 moved = r.T_map_site * pivot_site_m_ - pivot_map_m_;
  judged(r.verdict, Vec3(moved.x(), moved.y(), wrap_angle(r.T_map_site.yaw_rad - T_map_site_.yaw_rad)),
         r.covariance, Mat3::Zero());
  if (status_ != MapFixStatus::kAccepted) return;
  result_.fresh_offset = result_.offset;
  result_.fresh_covariance = result_.covariance;
  mark_used(r.best, relocation_.sightings());
}

void MapFix::judged(const Verdict& verdict, const Vec3& offset, const Mat3& with_prior,
                    const Mat3& prior_information) {
  result_.verdict = verdict;
  result_.posterior = with_prior;
  status_ = status_of(verdict.status);
  if (status_ != MapFixStatus::kAccepted) return;
  Mat3 information;
  if (!inverse(with_prior, information) || !inverse(information - prior_information, result_.covariance)) {
    status_ = MapFixStatus::kWeakGeometry;
    return;
  }
  result_.offset = offset + result_.covariance * (prior_information * offset);
}

}  // namespace cairn
