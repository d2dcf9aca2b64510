#include "registration/pose_search.hpp"

#include <cmath>

#include "core/arithmetic.hpp"
#include "core/exp_log.hpp"
#include "core/heap_sort.hpp"

namespace cairn {
namespace {

constexpr double kBasin = 4.0;       // sigmas between distinct poses
constexpr double kRoughly = 0.2;     // of sigma_pair: a decoy whose step is less has settled; its S by 0.1
constexpr double kLookSigmas = 3.5;  // beyond it a look is a miss whatever the density

bool good(const PoseSearchParams& p) {
  const VerdictParams& v = p.verdict;
  return params_are_good(p.evidence) && in_range(p.reach_sigmas, 4.0, 8.0) && p.max_pairs >= 1 &&
         p.max_pairs <= 4096 && in_range(p.give_up, -100.0, 0.0) && in_range(p.ring, 0.0, 10.0) &&
         in_range(p.least_ring, 0.0, 10.0) && in_range(p.scale_sigma, 0.0, 0.2) &&
         in_range(v.ln_threshold, 0.0, 100.0) && in_range(v.prior_log_odds, 0.0, 13.0) &&
         in_range(v.second_margin, 0.0, 100.0) && in_range(v.innovation2_limit, 0.0, 1.0e3) && v.tail >= 2 &&
         v.tail <= static_cast<int>(Decoys::kCapacity);
}

Vec2 laid(const Hypothesis& pose, const Vec2& q) {
  const SinCos r = sin_cos(pose.yaw_rad);
  return {pose.x_m + pose.scale * (r.cos * q.x() - r.sin * q.y()),
          pose.y_m + pose.scale * (r.sin * q.x() + r.cos * q.y())};
}

}  // namespace

SearchStatus PoseSearchJob::start(const PoseSearchParams& params, const MapBoulders& map,
                                  double window_radius_m, const LocalMap& local,
                                  const Pose2& T_map_site_prior, const Vec2& pivot_site_m,
                                  const Mat3& covariance) {
  params_ = params;
  result_ = SearchResult();
  result_.T_map_site = T_map_site_prior;
  T_map_site_prior_ = T_map_site_prior;
  pivot_site_m_ = pivot_site_m;
  phase_ = Phase::kGround;
  inside_.clear();
  outside_.clear();
  weighed_.clear();
  decoys_.clear();
  refining_ = 0;
  step_d_ = 0;
  step_i_ = 0;
  seen_ = 0;
  status_ = SearchStatus::kBadInput;
  if (!good(params) || !is_finite(T_map_site_prior) || !(pivot_site_m.norm() <= 1.0e7)) return status_;
  pivot_map_m_ = T_map_site_prior * pivot_site_m;
  Hypothesis mean;
  mean.yaw_rad = wrap_angle(T_map_site_prior.yaw_rad);
  if (!gaussian_prior(mean, covariance, prior_)) return status_;
  // Of the larger axis of x and y.
  const double a = covariance(0, 0);
  const double b = covariance(1, 1);
  const double c = covariance(0, 1);
  sigma_max_m_ = std::sqrt(0.5 * (a + b + std::sqrt((a - b) * (a - b) + 4.0 * c * c)));
  reach_rad_ = params.reach_sigmas * std::sqrt(covariance(2, 2));
  if (reach_rad_ > kPi) reach_rad_ = kPi;
  cos_reach_ = reach_rad_ < kPi ? sin_cos(reach_rad_).cos : -2.0;
  prior_turn_ = sin_cos(mean.yaw_rad);
  if (!(sigma_max_m_ <= 1.0e4)) return status_;
  if (map.empty()) return status_ = SearchStatus::kNoMapBoulders;
  if (local.size() < 2) return status_ = SearchStatus::kNoLocalBoulders;
  local_ = local;
  const GridStatus laid_out = ground_.start(map, pivot_map_m_, window_radius_m, params.evidence.sigma_pair_m,
                                            kCrowdSigmas * params.evidence.sigma_pair_m);
  if (laid_out != GridStatus::kRunning) return status_;
  sightings_.clear();
  sighted_ = 0;
  return status_ = SearchStatus::kRunning;
}

void PoseSearchJob::sight_next() {
  const bool left_out = params_.fresh_only && local_[sighted_].counted;
  if (!left_out &&
      sight(params_.evidence, ground_, local_, sighted_, pivot_site_m_, sightings_) == Sighted::kBad) {
    status_ = SearchStatus::kBadInput;
    return;
  }
  if (++sighted_ < local_.size()) return;
  phase_ = Phase::kPair;
  const SearchStatus surveyed = survey();
  if (surveyed != SearchStatus::kRunning) status_ = surveyed;
}

/// What there is to be laid where.
SearchStatus PoseSearchJob::survey() {
  result_.sightings = static_cast<int>(sightings_.size());
  if (sightings_.size() < 2) return SearchStatus::kNoLocalBoulders;
  const auto n = static_cast<double>(sightings_.size());
  middle_ = Vec2(0.0, 0.0);
  farthest_m_ = 0.0;
  for (const Sighting& s : sightings_) {
    middle_ += Vec2(s.x_m, s.y_m) / n;
    const double d = std::sqrt(s.x_m * s.x_m + s.y_m * s.y_m);
    if (d > farthest_m_) farthest_m_ = d;
  }
  double sum = 0.0;
  for (const Sighting& s : sightings_) sum += (Vec2(s.x_m, s.y_m) - middle_).squaredNorm();
  rms_radius_m_ = std::sqrt(sum / n);
  const double spacing = 1.0 / std::sqrt(ground_.mean_density());
  const double room = ground_.radius_m() - farthest_m_;
  const double prior_reach = params_.reach_sigmas * sigma_max_m_;
  double ring = room - prior_reach;
  if (ring > params_.ring * spacing) ring = params_.ring * spacing;
  if (ring < 0.0) ring = 0.0;
  result_.ring_m = ring;
  reach_m_ = prior_reach + ring;
  if (room < 4.0 * sigma_max_m_ || reach_m_ < params_.least_ring * spacing)
    return SearchStatus::kNoSearchRoom;
  miss_ = ln(1.0 - params_.evidence.match_share);
  sizes_.max_ratio = params_.evidence.size_sigma > 0.0 ? exp(3.0 * params_.evidence.size_sigma) : 0.0;
  anywhere_ = flat_prior(prior_.mean, kPi * reach_m_ * reach_m_, 2.0 * reach_rad_);
  roughly_ = params_.evidence;
  roughly_.settled = kRoughly;
  Candidate mean;
  mean.pose = prior_.mean;
  mean.middle_m = laid(mean.pose, middle_);
  mean.score = -1.0e3;
  inside_.append(mean);
  return SearchStatus::kRunning;
}

// ---- hypotheses -------------------------------------------------------------------------------------------

/// The next pair of local boulders of a good length, differences of indices in scattered order; false
/// at the end.
bool PoseSearchJob::next_pair() {
  const int n = static_cast<int>(sightings_.size());
  const int differences = n / 2;
  if (result_.pairs >= params_.max_pairs || step_d_ >= differences) return false;
  // 7919 is a prime beyond any number of differences: each comes once.
  const int d = 1 + step_d_ * 7919 % differences;
  i_ = static_cast<std::uint16_t>(step_i_);
  j_ = static_cast<std::uint16_t>((step_i_ + d) % n);
  const bool twice = 2 * d == n && 2 * step_i_ >= n;
  if (++step_i_ == n) {
    step_i_ = 0;
    ++step_d_;
  }
  const double dx = sightings_[j_].x_m - sightings_[i_].x_m;
  const double dy = sightings_[j_].y_m - sightings_[i_].y_m;
  length_m_ = std::sqrt(dx * dx + dy * dy);
  const double least = 10.0 * params_.evidence.sigma_pair_m;
  if (twice || length_m_ < 0.5 * rms_radius_m_ || length_m_ > 2.0 * rms_radius_m_ || length_m_ < least) {
    length_m_ = 0.0;  // none
    return true;
  }
  ++result_.pairs;
  // 3.5 sigmas of a length, and of the scale.
  const double own2 =
      sightings_[i_].sigma_m * sightings_[i_].sigma_m + sightings_[j_].sigma_m * sightings_[j_].sigma_m;
  play_m_ = 3.5 * std::sqrt(own2) + 4.0 * params_.evidence.scale_sigma * length_m_;
  ranked_.clear();
  order_.clear();
  sighted_ = 0;
  return true;
}

/// The other local boulders, from the cursor on.
void PoseSearchJob::rank(std::size_t end) {
  const double mx = 0.5 * (sightings_[i_].x_m + sightings_[j_].x_m);
  const double my = 0.5 * (sightings_[i_].y_m + sightings_[j_].y_m);
  const double p = params_.evidence.match_share;
  const double at_one = ln(p / (2.0 * kPi * ground_.density(0.0, 0.0)));
  for (std::size_t k = sighted_; k < end; ++k) {
    if (k == i_ || k == j_) continue;
    const Sighting& s = sightings_[k];
    Ranked r;
    r.sighting = static_cast<std::uint16_t>(k);
    r.d2 = (s.x_m - mx) * (s.x_m - mx) + (s.y_m - my) * (s.y_m - my);
    const double t2 = s.sigma_m * s.sigma_m * (1.5 + 2.0 * r.d2 / (length_m_ * length_m_));
    r.c = at_one - ln(t2);
    r.half_info = 0.5 / t2;
    double radius2 = (r.c - miss_) * 2.0 * t2;
    if (radius2 > kLookSigmas * kLookSigmas * t2) radius2 = kLookSigmas * kLookSigmas * t2;
    r.radius = radius2 > 0.0 ? std::sqrt(radius2) : 0.0;
    order_.append(static_cast<std::uint16_t>(ranked_.size()));
    ranked_.append(r);
  }
  sighted_ = end;
}

/// Nearest to the pair's middle first.
void PoseSearchJob::sort_ranked() {
  heap_sort(order_.data(), static_cast<int>(order_.size()), [this](std::uint16_t a, std::uint16_t b) {
    return ranked_[a].d2 < ranked_[b].d2 || (ranked_[a].d2 == ranked_[b].d2 && a < b);
  });
}

/// About where the pair's first one may lie.
BoulderQuery PoseSearchJob::firsts_query() const {
  const Sighting& s = sightings_[i_];
  const Vec2 at = laid(prior_.mean, Vec2(s.x_m, s.y_m));
  GridPoint point;
  point.x_m = at.x();
  point.y_m = at.y();
  const double turn = reach_rad_ < 2.0 ? reach_rad_ : 2.0;
  const double radius = reach_m_ + turn * std::sqrt(s.x_m * s.x_m + s.y_m * s.y_m) + 3.0 * s.sigma_m;
  return ground_.grid().query(point, radius);
}

void PoseSearchJob::gather_firsts(const BoulderQuery& piece) {
  ground_.grid().for_each_near(piece, [this](std::uint16_t index, double) { firsts_.append(index); });
}

/// Where the second one would lie with the first one laid on firsts_[first_], and how far from there it may:
/// l long and turned by a, it lies (l - L)^2 + 2 l L (1 - cos a) off, squared.
BoulderQuery PoseSearchJob::seconds_query() const {
  const double most = length_m_ + play_m_;
  const GridPoint& m = ground_.grid()[firsts_[first_]];
  const SinCos& r = prior_turn_;
  const double dx = sightings_[j_].x_m - sightings_[i_].x_m;
  const double dy = sightings_[j_].y_m - sightings_[i_].y_m;
  GridPoint at;
  at.x_m = m.x_m + r.cos * dx - r.sin * dy;
  at.y_m = m.y_m + r.sin * dx + r.cos * dy;
  const double apart2 = play_m_ * play_m_ + 2.0 * most * length_m_ * (1.0 - cos_reach_);
  return ground_.grid().query(at, std::sqrt(apart2));
}

/// Those of a length and direction that the pair may have.
void PoseSearchJob::gather_seconds(const BoulderQuery& query) {
  const GridPoint& m = ground_.grid()[firsts_[first_]];
  const double least2 = (length_m_ - play_m_) * (length_m_ - play_m_);
  const double most2 = (length_m_ + play_m_) * (length_m_ + play_m_);
  const Vec2 straight(query.at.x_m - m.x_m, query.at.y_m - m.y_m);  // by the prior's yaw
  const double turned = cos_reach_ * std::fabs(cos_reach_) * length_m_ * length_m_;
  const BoulderGrid& grid = ground_.grid();
  grid.for_each_near(query, [&](std::uint16_t index, double) {
    const double mx = grid[index].x_m - m.x_m;
    const double my = grid[index].y_m - m.y_m;
    const double l2 = mx * mx + my * my;
    if (l2 < least2 || l2 > most2 || index == firsts_[first_]) return;
    const double along = mx * straight.x() + my * straight.y();
    if (along * std::fabs(along) < turned * l2) return;
    if (!seconds_.push_back(index)) ++result_.cut;
  });
}

/// The pose of the pair laid on firsts_[first_] and `second`; false where that is out of reach, or nothing
/// is left to look at.
bool PoseSearchJob::hypothesise(std::uint16_t second) {
  const GridPoint& a = ground_.grid()[firsts_[first_]];
  const GridPoint& b = ground_.grid()[second];
  const Sighting& i = sightings_[i_];
  const Sighting& j = sightings_[j_];
  const double ux = j.x_m - i.x_m;
  const double uy = j.y_m - i.y_m;
  const double vx = b.x_m - a.x_m;
  const double vy = b.y_m - a.y_m;
  const double dot = ux * vx + uy * vy;
  const double cross = ux * vy - uy * vx;
  const double norm = std::sqrt(dot * dot + cross * cross);
  if (!(norm > 0.0)) return false;
  cos_ = dot / norm;
  sin_ = cross / norm;
  Hypothesis& h = current_.pose;
  h.scale = 1.0;
  if (params_.evidence.scale_sigma > 0.0) {
    const double ratio = norm / (length_m_ * length_m_);
    const double prior = params_.evidence.scale_sigma * params_.evidence.scale_sigma;
    const double pair = (i.sigma_m * i.sigma_m + j.sigma_m * j.sigma_m) / (length_m_ * length_m_);
    h.scale = 1.0 + (ratio - 1.0) * prior / (prior + pair);
  }
  const double mx = 0.5 * (i.x_m + j.x_m);
  const double my = 0.5 * (i.y_m + j.y_m);
  h.x_m = 0.5 * (a.x_m + b.x_m) - h.scale * (cos_ * mx - sin_ * my);
  h.y_m = 0.5 * (a.y_m + b.y_m) - h.scale * (sin_ * mx + cos_ * my);
  if (h.x_m * h.x_m + h.y_m * h.y_m > reach_m_ * reach_m_) return false;
  ++result_.hypotheses;
  looking_ = 0;
  current_.score = 0.0;
  if (!ranked_.empty()) return true;
  file();  // two boulders, and all seen
  return false;
}

BoulderQuery PoseSearchJob::look_query() const {
  const Ranked& r = ranked_[order_[looking_]];
  const Sighting& s = sightings_[r.sighting];
  const Hypothesis& h = current_.pose;
  GridPoint at;
  at.x_m = h.x_m + h.scale * (cos_ * s.x_m - sin_ * s.y_m);
  at.y_m = h.y_m + h.scale * (sin_ * s.x_m + cos_ * s.y_m);
  at.diameter_m = static_cast<float>(s.diameter_m);
  return ground_.grid().query(at, r.radius);
}

/// One local boulder under the hypothesis; false where that is given up or all are seen.
bool PoseSearchJob::look(const NearestBoulder& near) {
  const Ranked& r = ranked_[order_[looking_]];
  ++result_.looks;
  current_.score += near.index == BoulderGrid::kNone ? miss_ : r.c - near.r2_m2 * r.half_info;
  if (current_.score < params_.give_up) return false;
  if (++looking_ < ranked_.size()) return true;
  file();
  return false;
}

bool PoseSearchJob::distinct(const Hypothesis& a, const Hypothesis& b) const {
  Candidate first;
  first.pose = a;
  first.middle_m = laid(a, middle_);
  Candidate second;
  second.pose = b;
  second.middle_m = laid(b, middle_);
  return distinct(first, second);
}

bool PoseSearchJob::distinct(const Candidate& a, const Candidate& b) const {
  const double apart = kBasin * params_.evidence.sigma_pair_m;
  return (a.middle_m - b.middle_m).squaredNorm() > apart * apart ||
         std::fabs(wrap_angle(a.pose.yaw_rad - b.pose.yaw_rad)) * rms_radius_m_ > apart;
}

bool PoseSearchJob::inside(const Hypothesis& pose) const {
  const Vec3 off(pose.x_m, pose.y_m, wrap_angle(pose.yaw_rad - prior_.mean.yaw_rad));
  return off.dot(prior_.information * off) <= params_.reach_sigmas * params_.reach_sigmas;
}

/// Into a list of distinct ones, the best that there is room for.
template <std::size_t N>
void PoseSearchJob::keep(FixedVector<Candidate, N>& list, const Candidate& candidate) const {
  std::size_t worst = 0;
  for (std::size_t k = 0; k < list.size(); ++k) {
    if (!distinct(list[k], candidate)) {
      if (candidate.score > list[k].score) list[k] = candidate;
      return;
    }
    if (list[k].score < list[worst].score) worst = k;
  }
  if (list.push_back(candidate)) return;
  if (candidate.score > list[worst].score) list[worst] = candidate;
}

/// Its angle is asked for here: few hypotheses come so far.
void PoseSearchJob::file() {
  current_.pose.yaw_rad = atan2(sin_, cos_);
  current_.middle_m = laid(current_.pose, middle_);
  if (inside(current_.pose)) {
    keep(inside_, current_);
  } else {
    keep(outside_, current_);
  }
}

// ---- refinement and verdict -------------------------------------------------------------------------------

void PoseSearchJob::start_refining() {
  if (refining_ == inside_.size() + outside_.size()) return conclude();
  const bool in = refining_ < inside_.size();
  const Candidate& c = in ? inside_[refining_] : outside_[refining_ - inside_.size()];
  const EvidenceStatus started =
      evidence_.start(in ? params_.evidence : roughly_, ground_, sightings_, in ? prior_ : anywhere_, c.pose);
  CAIRN_ASSERT(started == EvidenceStatus::kRunning);
}

void PoseSearchJob::refined() {
  const bool in = refining_ < inside_.size();
  ++refining_;
  ++result_.refined;
  const bool weighed =
      evidence_.status() == EvidenceStatus::kDone || evidence_.status() == EvidenceStatus::kNotSettled;
  if (weighed && in) weighed_.append(evidence_.result());
  if (weighed && !in) {
    bool fresh = !inside(evidence_.result().pose);
    for (const Evidence& d : decoys_) fresh = fresh && distinct(d.pose, evidence_.result().pose);
    if (fresh) decoys_.append(evidence_.result());
  }
  start_refining();
}

/// The best pose outside the prior's reach; true where it would have been accepted, had the
/// prior allowed it.
bool PoseSearchJob::look_elsewhere() {
  double second = -1.0e3;
  for (const Evidence& d : decoys_) {
    if (d.S > result_.elsewhere.S) {
      second = result_.elsewhere.log_ratio;
      result_.elsewhere = d;
    } else if (d.log_ratio > second) {
      second = d.log_ratio;
    }
  }
  return result_.elsewhere.log_ratio >= params_.verdict.ln_threshold &&
         result_.elsewhere.log_ratio - second >= params_.verdict.second_margin;
}

void PoseSearchJob::conclude() {
  status_ = SearchStatus::kDone;
  SearchResult& r = result_;
  const bool elsewhere = look_elsewhere();
  if (weighed_.empty()) {
    r.verdict.status = elsewhere ? VerdictStatus::kInconsistentWithPrior : VerdictStatus::kNoHypothesis;
    r.verdict.log_ratio = evidence_of_misses(sightings_.size());
    r.verdict.chance_log = 0.0;
    return;
  }
  std::size_t first = 0;
  for (std::size_t k = 1; k < weighed_.size(); ++k) {
    if (weighed_[k].log_ratio > weighed_[first].log_ratio) first = k;
  }
  r.best = weighed_[first];
  double second = -1.0e3;
  Decoys decoys;
  decoys.log_volume = anywhere_.log_volume;
  for (const Evidence& e : decoys_) {
    if (distinct(e.pose, r.best.pose)) decoys.scores.append(e.S);
  }
  for (std::size_t k = 0; k < weighed_.size(); ++k) {
    bool fresh = distinct(weighed_[k].pose, r.best.pose);
    for (std::size_t m = 0; m < k && fresh; ++m) fresh = distinct(weighed_[k].pose, weighed_[m].pose);
    if (!fresh) continue;
    if (weighed_[k].log_ratio > second) second = weighed_[k].log_ratio;
    decoys.scores.append(weighed_[k].S);
  }
  r.decoys = static_cast<int>(decoys.scores.size());
  r.verdict = judge(params_.verdict, r.best, second, prior_, decoys);
  if (elsewhere && r.verdict.status != VerdictStatus::kAccepted &&
      r.elsewhere.S > r.best.S + params_.verdict.second_margin) {
    r.verdict.status = VerdictStatus::kInconsistentWithPrior;
  }
  tell_pose();
  if (r.verdict.status != VerdictStatus::kAccepted || params_.scale_sigma == 0.0) return;
  EvidenceParams free = params_.evidence;
  free.scale_sigma = params_.scale_sigma;
  if (evidence_.start(free, ground_, sightings_, prior_, r.best.pose) != EvidenceStatus::kRunning) return;
  phase_ = Phase::kScale;
  status_ = SearchStatus::kRunning;
}

void PoseSearchJob::scaled() {
  status_ = SearchStatus::kDone;
  const Evidence& e = evidence_.result();
  if (evidence_.status() != EvidenceStatus::kDone || e.log_ratio < result_.best.log_ratio + kScaleMargin)
    return;
  result_.best = e;
  result_.verdict.log_ratio = e.log_ratio;
  tell_pose();
}

/// The best one, as seen from the site.
void PoseSearchJob::tell_pose() {
  SearchResult& r = result_;
  r.density = ground_.density(r.best.pose.x_m, r.best.pose.y_m);
  r.covariance = r.best.covariance.topLeftCorner<3, 3>();
  r.scale = r.best.pose.scale;
  r.scale_sigma = std::sqrt(r.best.covariance(3, 3));
  r.T_map_site.yaw_rad = wrap_angle(r.best.pose.yaw_rad);
  const SinCos turn = sin_cos(r.T_map_site.yaw_rad);
  const Vec2& p = pivot_site_m_;
  r.T_map_site.x_m = pivot_map_m_.x() + r.best.pose.x_m - (turn.cos * p.x() - turn.sin * p.y());
  r.T_map_site.y_m = pivot_map_m_.y() + r.best.pose.y_m - (turn.sin * p.x() + turn.cos * p.y());
}

// ---- the cursor -------------------------------------------------------------------------------------------

/// True after the last piece of a question.
bool PoseSearchJob::all_seen(const BoulderQuery& piece, bool last) {
  seen_ = last ? 0 : seen_ + piece.candidates;
  return last;
}

/// One unit of a pair's hypotheses.
Progress PoseSearchJob::follow_pair(WorkBudget& budget) {
  switch (phase_) {
    case Phase::kGather: {
      BoulderQuery query = firsts_query();
      const bool last = query.cut(seen_);
      if (!budget.take(gather_ops(query.ops()))) return Progress::kMore;
      gather_firsts(query);
      if (!all_seen(query, last)) break;
      seconds_.clear();
      phase_ = Phase::kFirst;
      break;
    }
    case Phase::kFirst: {
      if (first_ == firsts_.size()) {
        phase_ = Phase::kPair;
        break;
      }
      BoulderQuery query = seconds_query();
      const bool last = query.cut(seen_);
      if (!budget.take(first_ops(query.ops()))) return Progress::kMore;
      gather_seconds(query);
      if (!all_seen(query, last)) break;
      second_ = 0;
      phase_ = Phase::kSecond;
      break;
    }
    case Phase::kSecond:
      if (second_ == seconds_.size()) {
        ++first_;
        seconds_.clear();
        phase_ = Phase::kFirst;
        break;
      }
      if (!budget.take(kSecondOps)) return Progress::kMore;
      if (hypothesise(seconds_[second_++])) phase_ = Phase::kLook;
      break;
    case Phase::kLook:
      while (phase_ == Phase::kLook) {
        BoulderQuery query = look_query();
        const bool last = query.cut(seen_);
        if (!budget.take(look_ops(query.ops()))) return Progress::kMore;
        if (seen_ == 0) near_ = BoulderGrid::none(query);
        ground_.grid().nearest(query, sizes_, near_);
        if (all_seen(query, last) && !look(near_)) phase_ = Phase::kSecond;
      }
      break;
    default: break;
  }
  return Progress::kDone;
}

Progress PoseSearchJob::step(WorkBudget& budget) {
  while (status_ == SearchStatus::kRunning) {
    switch (phase_) {
      case Phase::kGround:
        if (ground_.step(budget) == Progress::kMore) return Progress::kMore;
        if (ground_.status() != GridStatus::kReady) status_ = SearchStatus::kBadInput;
        phase_ = Phase::kSight;
        break;
      case Phase::kSight:
        if (!budget.take(sight_ops(sightings_.size()))) return Progress::kMore;
        sight_next();
        break;
      case Phase::kPair:
        if (!budget.take(kPairOps)) return Progress::kMore;
        if (!next_pair()) {
          phase_ = Phase::kRefine;
          start_refining();
        } else if (length_m_ > 0.0) {
          phase_ = Phase::kRank;
        }
        break;
      case Phase::kRank: {
        const std::size_t left = sightings_.size() - sighted_;
        const std::size_t count = left < kRankUnit ? left : kRankUnit;
        if (!budget.take(rank_ops(count))) return Progress::kMore;
        rank(sighted_ + count);
        if (sighted_ == sightings_.size()) phase_ = Phase::kSort;
        break;
      }
      case Phase::kSort:
        if (!budget.take(sort_ops(sightings_.size()))) return Progress::kMore;
        sort_ranked();
        firsts_.clear();
        first_ = 0;
        phase_ = Phase::kGather;
        break;
      case Phase::kGather:
      case Phase::kFirst:
      case Phase::kSecond:
      case Phase::kLook:
        if (follow_pair(budget) == Progress::kMore) return Progress::kMore;
        break;
      case Phase::kRefine:
        if (evidence_.step(budget) == Progress::kMore) return Progress::kMore;
        refined();
        break;
      case Phase::kScale:
        if (evidence_.step(budget) == Progress::kMore) return Progress::kMore;
        scaled();
        break;
    }
  }
  return Progress::kDone;
}

}  // namespace cairn
