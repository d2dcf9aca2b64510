#include "localizer/relocation.hpp"

#include <cmath>

namespace cairn {
namespace {

// Of the raster: a boulder farther from its mark is a miss. Farther ones tell less by a hit than they make
// hits by chance.
constexpr double kReachSigmas = 2.3;
constexpr double kMarginM = 2.0;     // of a window about the local map, for the density around it
constexpr double kGateSigmas = 6.0;  // least bucket of the window's grid
constexpr double kSamePoseM = 0.5;   // poses nearer than this, and turned less, are one
constexpr double kSamePoseRad = 0.1;
constexpr double kNoSecond = -1.0e3;  // as judge() has it

double whole_map_radius(const OrbitalMap& map) { return map.extent_m().norm() + 1.0; }

}  // namespace

RelocationStatus Relocation::start(const RelocationParams& params, const OrbitalMap& map,
                                   const LocalMap& local, const Vec2& pivot_site_m,
                                   const SearchRegion& region, const Room& room) {
  params_ = params;
  map_ = map;
  local_ = local;
  pivot_site_m_ = pivot_site_m;
  region_ = region;
  window_ = &room.window;
  ground_ = &room.ground;
  result_ = {};
  weighed_.clear();
  hit_ = 0;
  phase_ = Phase::kRead;
  if (!map.usable()) return status_ = RelocationStatus::kNoMap;
  if (local.size() < 4) return status_ = RelocationStatus::kTooFewBoulders;
  if (!std::isfinite(pivot_site_m.x()) || !std::isfinite(pivot_site_m.y()) ||
      !params_are_good(params.evidence))
    return status_ = RelocationStatus::kBadInput;
  reach_m_ = 0.0;
  for (const LocalBoulder& b : local) {
    const double far = (b.p_site_m - pivot_site_m).norm();
    if (!(far <= 1.0e5)) return status_ = RelocationStatus::kBadInput;
    reach_m_ = far > reach_m_ ? far : reach_m_;
  }
  const double raster_reach = kReachSigmas * params.search.sigma_pair_m;
  Vec2 extent = map.extent_m();
  extent.x() += map.quantum_m();
  extent.y() += map.quantum_m();
  const bool read =
      region.anywhere ? reader_.start(map, map.origin_map_m(), whole_map_radius(map)) == WindowStatus::kUsable
                      : reader_.start(map, region.centre_map_m, region.radius_m + reach_m_ + kMarginM) ==
                            WindowStatus::kUsable;
  if (!read || !wide_map_.begin(map.origin_map_m(), extent, raster_reach))
    return status_ = RelocationStatus::kBadInput;
  return status_ = RelocationStatus::kRunning;
}

Progress Relocation::step(WorkBudget& budget) {
  MapReader::Chunk chunk;
  while (status_ == RelocationStatus::kRunning) {
    Progress progress = Progress::kDone;
    switch (phase_) {
      case Phase::kRead:
        progress = reader_.step(budget, chunk);
        for (const MapBoulder& b : chunk) {
          if (!wide_map_.add(b)) status_ = RelocationStatus::kMapTooLarge;
        }
        if (progress == Progress::kMore && chunk.empty()) return Progress::kMore;
        if (progress == Progress::kDone) phase_ = Phase::kIndex;
        break;
      case Phase::kIndex:
        if (wide_map_.step(budget) == Progress::kMore) return Progress::kMore;
        if (!budget.take(LostSearch::start_ops(local_.size()))) return Progress::kMore;
        begin_search();
        break;
      case Phase::kSearch:
        if (search_.step(budget) == Progress::kMore) return Progress::kMore;
        begin_window();
        break;
      case Phase::kWindow:
        progress = reader_.step(budget, chunk);
        for (const MapBoulder& b : chunk) window_full_ = !window_->push_back(b) || window_full_;
        if (progress == Progress::kMore && chunk.empty()) return Progress::kMore;
        if (progress == Progress::kDone) begin_ground();
        break;
      case Phase::kGround:
        if (ground_->step(budget) == Progress::kMore) return Progress::kMore;
        if (ground_->status() != GridStatus::kReady) {
          next_hit();
          break;
        }
        phase_ = Phase::kSight;
        sightings_.clear();
        sighted_ = 0;
        break;
      case Phase::kSight:
        if (!budget.take(30U + 3U * static_cast<std::uint32_t>(sightings_.size()))) return Progress::kMore;
        sight_next();
        break;
      case Phase::kWeigh:
        if (evidence_.step(budget) == Progress::kMore) return Progress::kMore;
        next_hit();
        break;
      case Phase::kAgain: begin_window(); break;
    }
  }
  return Progress::kDone;
}

void Relocation::begin_search() {
  const LostStatus search = search_.start(params_.search, wide_map_, local_, pivot_site_m_, region_);
  switch (search) {
    case LostStatus::kRunning: phase_ = Phase::kSearch; break;
    case LostStatus::kNoMap: status_ = RelocationStatus::kNoMap; break;
    case LostStatus::kTooFewBoulders: status_ = RelocationStatus::kTooFewBoulders; break;
    default: status_ = RelocationStatus::kBadInput; break;
  }
}

/// The ground about the next pose to be weighed.
void Relocation::begin_window() {
  if (hit_ == search_.hits().size()) {
    judge_all();
    return;
  }
  window_centre_m_ = search_.hits()[hit_].T_map_site * pivot_site_m_;
  window_radius_m_ = reach_m_ + kMarginM;
  window_->clear();
  window_full_ = false;
  const bool read = reader_.start(map_, window_centre_m_, window_radius_m_) == WindowStatus::kUsable;
  CAIRN_ASSERT(read);  // the map is usable, the search's poses are finite
  phase_ = Phase::kWindow;
}

void Relocation::begin_ground() {
  const GridStatus ground = ground_->start(*window_, window_centre_m_, window_radius_m_,
                                           kGateSigmas * params_.evidence.sigma_pair_m,
                                           kCrowdSigmas * params_.evidence.sigma_pair_m);
  phase_ = Phase::kGround;
  // What cannot be weighed is no evidence for anything.
  if (window_full_ || ground != GridStatus::kRunning) next_hit();
}

/// Local boulders as evidence, one at a time; then the pose is weighed.
void Relocation::sight_next() {
  const Sighted sighted = sight(params_.evidence, *ground_, local_, sighted_, pivot_site_m_, sightings_);
  if (sighted == Sighted::kBad) {
    status_ = RelocationStatus::kBadInput;
    return;
  }
  if (++sighted_ < local_.size()) return;
  const Hypothesis hypothesis{0.0, 0.0, search_.hits()[hit_].T_map_site.yaw_rad, 1.0};
  const double area = region_.anywhere ? wide_map_.area_m2() : kPi * region_.radius_m * region_.radius_m;
  prior_ = flat_prior(hypothesis, area, 2.0 * region_.half_sector_rad);
  phase_ = Phase::kWeigh;
  if (evidence_.start(params_.evidence, *ground_, sightings_, prior_, hypothesis) !=
      EvidenceStatus::kRunning) {
    next_hit();
  }
}

void Relocation::next_hit() {
  if (phase_ == Phase::kWeigh && evidence_.status() == EvidenceStatus::kDone) {
    const bool room = weighed_.push_back({evidence_.result(), window_centre_m_});
    CAIRN_ASSERT(room);
  }
  ++hit_;
  begin_window();
}

void Relocation::judge_all() {
  std::size_t first = 0;
  for (std::size_t k = 1; k < weighed_.size(); ++k) {
    if (weighed_[k].evidence.log_ratio > weighed_[first].evidence.log_ratio) first = k;
  }
  if (weighed_.empty()) {
    judged();
    return;
  }
  const Weighed& best = weighed_[first];
  const auto place = [](const Weighed& w) -> Vec2 {
    return w.centre_map_m + Vec2(w.evidence.pose.x_m, w.evidence.pose.y_m);
  };
  Decoys decoys;
  decoys.log_volume = prior_.log_volume;
  double second = kNoSecond;
  for (std::size_t k = 0; k < weighed_.size(); ++k) {
    const Weighed& w = weighed_[k];
    const double turned = std::fabs(wrap_angle(w.evidence.pose.yaw_rad - best.evidence.pose.yaw_rad));
    if ((place(w) - place(best)).norm() < kSamePoseM && turned < kSamePoseRad) continue;
    if (w.evidence.log_ratio > second) second = w.evidence.log_ratio;
    const bool room = decoys.scores.push_back(w.evidence.S);
    CAIRN_ASSERT(room);
  }
  Verdict verdict = judge(params_.verdict, best.evidence, second, prior_, decoys);
  if (verdict.status == VerdictStatus::kAccepted && !holds(region_, place(best), best.evidence.pose.yaw_rad))
    verdict.status = VerdictStatus::kInconsistentWithPrior;
  const double better = result_.verdict.status == VerdictStatus::kAccepted ? kScaleMargin : -1.0e3;
  if (params_.evidence.scale_sigma > 0.0 && (verdict.status != VerdictStatus::kAccepted ||
                                             verdict.log_ratio < result_.verdict.log_ratio + better)) {
    judged();  // as it was without
    return;
  }
  result_.best = best.evidence;
  result_.decoys = static_cast<int>(decoys.scores.size());
  result_.verdict = verdict;
  result_.scale = best.evidence.pose.scale;
  result_.scale_sigma = std::sqrt(best.evidence.covariance(3, 3));
  result_.covariance = best.evidence.covariance.topLeftCorner<3, 3>();
  const double yaw = wrap_angle(best.evidence.pose.yaw_rad);
  const SinCos r = sin_cos(yaw);
  const Vec2 at = place(best);
  result_.T_map_site = {at.x() - (r.cos * pivot_site_m_.x() - r.sin * pivot_site_m_.y()),
                        at.y() - (r.sin * pivot_site_m_.x() + r.cos * pivot_site_m_.y()), yaw};
  judged();
}

/// Once with the scale as it is, once with the scale left free.
void Relocation::judged() {
  result_.hypotheses = search_.hypotheses();
  const bool none = result_.verdict.status == VerdictStatus::kNone;
  const bool decided = result_.verdict.status == VerdictStatus::kAmbiguous ||
                       result_.verdict.status == VerdictStatus::kChanceAgreement;
  if (!decided && params_.evidence.scale_sigma == 0.0 && params_.scale_sigma > 0.0 &&
      !search_.hits().empty()) {
    params_.evidence.scale_sigma = params_.scale_sigma;
    weighed_.clear();
    hit_ = 0;
    phase_ = Phase::kAgain;
    return;
  }
  status_ = none ? RelocationStatus::kNotFound : RelocationStatus::kJudged;
}

}  // namespace cairn
