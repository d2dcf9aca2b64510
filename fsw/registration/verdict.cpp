#include "registration/verdict.hpp"

#include <cmath>

#include "core/arithmetic.hpp"
#include "core/exp_log.hpp"
#include "core/factors.hpp"

namespace cairn {
namespace {

constexpr double kLn2Pi = 1.83787706640934548356;
constexpr double kReach = 4.0;  // sigmas within which a map boulder is looked for
constexpr int kMaxIterations = 12;
constexpr double kFarthest_m = 1.0e5;
constexpr int kShareCount = 4;
constexpr double kShares[kShareCount] = {0.25, 0.5, 0.75, 0.92};
constexpr double kSizeOutliers = 0.1;
constexpr double kLargestPivot = 1.0e300;
constexpr double kLeastScale = 0.7;  // beyond these a fit has run away
constexpr double kMostScale = 1.4;
constexpr double kLeastFactor = 0.25;  // of the variance of pairs over sigma_pair's: half the sigma ...
constexpr double kMostFactor = 9.0;    // ... to three times

/// ln det of a positive matrix by its pivots; false where it is not positive.
template <int N>
bool log_det(const Factors<N>& factors, double& out) {
  if (!factors.positive()) return false;
  out = 0.0;
  for (int k = 0; k < N; ++k) {
    if (!(factors.pivot(k) < kLargestPivot)) return false;
    out += ln(factors.pivot(k));
  }
  return true;
}

/// ln of the mean of exp.
double mean_over_shares(const double (&sums)[kShareCount]) {
  double most = sums[0];
  for (const double sum : sums) most = sum > most ? sum : most;
  double mean = 0.0;
  for (const double sum : sums) mean += exp(sum - most) / kShareCount;
  return most + ln(mean);
}

}  // namespace

double evidence_of_misses(std::size_t count) {
  double sums[kShareCount] = {};
  for (int k = 0; k < kShareCount; ++k) sums[k] = static_cast<double>(count) * ln(1.0 - kShares[k]);
  return mean_over_shares(sums);
}

bool params_are_good(const EvidenceParams& p) {
  return in_range(p.sigma_pair_m, 1.0e-3, 10.0) &&
         (p.size_sigma == 0.0 || in_range(p.size_sigma, 0.02, 3.0)) && in_range(p.scale_sigma, 0.0, 0.2) &&
         in_range(p.match_share, 0.05, 0.95) && in_range(p.settled, 1.0e-4, 1.0);
}

Sighted sight(const EvidenceParams& params, const Ground& ground, const LocalMap& local, std::size_t index,
              const Vec2& pivot_site_m, Sightings& out) {
  const LocalBoulder& boulder = local[index];
  const auto own = static_cast<double>(boulder.sigma_m);
  Sighting s;
  s.x_m = boulder.p_site_m.x() - pivot_site_m.x();
  s.y_m = boulder.p_site_m.y() - pivot_site_m.y();
  if (!(std::fabs(s.x_m) <= kFarthest_m) || !(std::fabs(s.y_m) <= kFarthest_m)) return Sighted::kBad;
  if (!in_range(own, 0.0, 1.0e3)) return Sighted::kBad;
  s.sigma_m = std::sqrt(params.sigma_pair_m * params.sigma_pair_m + own * own);
  s.local = static_cast<std::uint16_t>(index);
  s.in_view = boulder.in_view;
  s.fresh = boulder.fresh;
  const auto diameter = static_cast<double>(boulder.diameter_m);
  if (params.size_sigma > 0.0 && in_range(diameter, 1.0e-3, 1.0e3)) {
    s.diameter_m = diameter;
    s.size_density = ground.size_density(diameter);
  }
  const double apart2 = 4.0 * params.sigma_pair_m * params.sigma_pair_m;
  const double link2 = kCrowdSigmas * kCrowdSigmas * params.sigma_pair_m * params.sigma_pair_m;
  s.cluster = static_cast<std::uint16_t>(out.size());
  std::uint64_t joined[(cfg::kMaxLocalBoulders + 63) / 64] = {};  // clusters that this one links
  for (const Sighting& other : out) {
    const double dx = other.x_m - s.x_m;
    const double dy = other.y_m - s.y_m;
    const double r2 = dx * dx + dy * dy;
    if (r2 < apart2) return Sighted::kNear;
    if (r2 > link2) continue;
    joined[other.cluster / 64U] |= std::uint64_t{1} << (other.cluster % 64U);
    if (other.cluster < s.cluster) s.cluster = other.cluster;
  }
  for (Sighting& other : out) {
    if (((joined[other.cluster / 64U] >> (other.cluster % 64U)) & 1U) != 0) other.cluster = s.cluster;
  }
  out.append(s);
  return Sighted::kTaken;
}

bool gaussian_prior(const Hypothesis& mean, const Mat3& covariance, PosePrior& out) {
  for (int i = 0; i < 3; ++i) {
    if (!in_range(covariance(i, i), 1.0e-16, 1.0e12)) return false;
  }
  const Factors factors(covariance);
  double log_det_covariance = 0.0;
  if (!log_det(factors, log_det_covariance)) return false;
  out.mean = mean;
  out.information = factors.inverse();
  out.log_volume = 1.5 * kLn2Pi + 0.5 * log_det_covariance;
  return true;
}

PosePrior flat_prior(const Hypothesis& mean, double area_m2, double sector_rad) {
  PosePrior prior;
  prior.mean = mean;
  prior.log_volume = ln(area_m2 * sector_rad);
  return prior;
}

// ---- one hypothesis ---------------------------------------------------------------------------------------

EvidenceJob::EvidenceJob() = default;

EvidenceStatus EvidenceJob::start(const EvidenceParams& params, const Ground& ground,
                                  const Sightings& sightings, const PosePrior& prior,
                                  const Hypothesis& hypothesis) {
  params_ = params;
  ground_ = &ground;
  sightings_ = &sightings;
  prior_ = prior;
  pose_ = hypothesis;
  if (params.scale_sigma == 0.0) pose_.scale = 1.0;
  result_ = Evidence();
  result_.pose = pose_;
  cursor_ = 0;
  inflation_ = 2.0;
  last_ = settled_ = false;
  share_ = -1;
  begin_look();
  missing_.setZero();
  begin_pass();
  turn_ = sin_cos(pose_.yaw_rad);
  const bool pose_good = in_range(pose_.x_m, -kFarthest_m, kFarthest_m) &&
                         in_range(pose_.y_m, -kFarthest_m, kFarthest_m) &&
                         in_range(pose_.yaw_rad, -1.0e3, 1.0e3) && in_range(pose_.scale, 0.5, 2.0);
  const bool good =
      params_are_good(params) && pose_good && ground.status() == GridStatus::kReady && !sightings.empty();
  status_ = good ? EvidenceStatus::kRunning : EvidenceStatus::kBadInput;
  return status_;
}

void EvidenceJob::begin_pass() {
  for (Pairs& pairs : pairs_) pairs = Pairs();
  sum_w_ = sum_wr2_ = sum_r2_m2_ = 0.0;
}

void EvidenceJob::begin_look() {
  seen_ = 0;
  // Field by field: a copy of the whole is a call.
  near_.density = near_.best = near_.x = near_.y = near_.xx = near_.xy = near_.yy = 0.0;
  near_.best_map = kNone;
}

BoulderQuery EvidenceJob::query(const Sighting& s) const {
  GridPoint at;
  at.x_m = pose_.x_m + pose_.scale * (turn_.cos * s.x_m - turn_.sin * s.y_m);
  at.y_m = pose_.y_m + pose_.scale * (turn_.sin * s.x_m + turn_.cos * s.y_m);
  return ground_->grid().query(at, kReach * inflation_ * s.sigma_m);
}

/// One local boulder, or some of the map's near it: the density at it, and what it pulls at.
void EvidenceJob::look(const Sighting& s, const BoulderQuery& query) {
  const double variance = s.sigma_m * s.sigma_m * inflation_ * inflation_;
  const double peak = 1.0 / (2.0 * kPi * variance);
  Near& near = near_;
  const BoulderGrid& grid = ground_->grid();
  grid.for_each_near(query, [&](std::uint16_t index, double r2) {
    double part = peak * exp(-0.5 * r2 / variance);
    const GridPoint& m = grid[index];
    const auto diameter = static_cast<double>(m.diameter_m);
    if (s.size_density > 0.0 && diameter > 0.0) {
      const double u = ln(s.diameter_m / diameter) / params_.size_sigma;
      const double agree = exp(-0.5 * (u * u + kLn2Pi)) / params_.size_sigma;
      part *= kSizeOutliers + (1.0 - kSizeOutliers) * agree / s.size_density;
    }
    near.density += part;
    if (part > near.best) {
      near.best = part;
      near.best_map = index;
    }
    const double ux = m.x_m - query.at.x_m;
    const double uy = m.y_m - query.at.y_m;
    near.x += part * ux;
    near.y += part * uy;
    near.xx += part * ux * ux;
    near.xy += part * ux * uy;
    near.yy += part * uy * uy;
  });
}

/// All of them were seen.
void EvidenceJob::looked(const Sighting& s, const BoulderQuery& query) {
  const double density = near_.density;
  const bool nothing = density <= 0.0;
  if (!nothing || last_) {
    const double null = ground_->density(query.at.x_m, query.at.y_m);
    if (last_) say_[cursor_] = {density / null, near_.best_map};
    const double all = (1.0 - params_.match_share) * null + params_.match_share * density;
    if (!nothing) add(s, Vec2(query.at.x_m - pose_.x_m, query.at.y_m - pose_.y_m), params_.match_share / all);
  }
  begin_look();
}

/// With J = [1 0 -d_y d_x/scale; 0 1 d_x d_y/scale], by what a local boulder at d moves with the pose.
void EvidenceJob::add(const Sighting& s, const Vec2& d, double to_weight) {
  const double info = 1.0 / (s.sigma_m * s.sigma_m * inflation_ * inflation_);
  const double weight = near_.density * to_weight;
  const double x = near_.x * to_weight;
  const double y = near_.y * to_weight;
  const double r2 = (near_.xx + near_.yy) * to_weight;
  sum_w_ += weight;
  sum_wr2_ += info * r2;
  sum_r2_m2_ += r2;
  const bool on_map = last_ && weight > 0.5;
  if (on_map) result_.on_map[cursor_ / 32] |= 1U << (cursor_ % 32);
  for (int k = kAll; k <= (on_map && s.fresh > 0.0F ? kFresh : kAll); ++k) {
    Pairs& pairs = pairs_[k];
    const double told = k == kFresh ? info * static_cast<double>(s.fresh) : info;
    pairs.weight += weight * told;
    pairs.x += weight * told * d.x();
    pairs.y += weight * told * d.y();
    pairs.d2 += weight * told * d.squaredNorm();
    pairs.pull[0] += told * x;
    pairs.pull[1] += told * y;
    pairs.pull[2] += told * (d.x() * y - d.y() * x);
    pairs.pull[3] += told * (d.x() * x + d.y() * y) * per_scale();
  }
  if (!last_) return;
  const double xx = info * info * (near_.xx * to_weight - x * x);
  const double xy = info * info * (near_.xy * to_weight - x * y);
  const double yy = info * info * (near_.yy * to_weight - y * y);
  const Vec2 J[4] = {{1.0, 0.0}, {0.0, 1.0}, {-d.y(), d.x()}, d * per_scale()};
  for (int c = 0; c < 4; ++c) {
    const Vec2 column(xx * J[c].x() + xy * J[c].y(), xy * J[c].x() + yy * J[c].y());
    for (int r = 0; r < 4; ++r) missing_(r, c) += J[r].dot(column);
  }
}

/// J^T J, summed.
Mat4 EvidenceJob::information(const Pairs& pairs) const {
  const double x = pairs.x * per_scale();
  const double y = pairs.y * per_scale();
  Mat4 info;
  info << pairs.weight, 0.0, -pairs.y, x,  //
      0.0, pairs.weight, pairs.x, y,       //
      -pairs.y, pairs.x, pairs.d2, 0.0,    //
      x, y, 0.0, pairs.d2 * per_scale() * per_scale();
  return info;
}

/// The scale is a fourth unknown with a prior of its own, or fixed: then its row is the identity's.
Mat4 EvidenceJob::prior_information() const {
  Mat4 info = Mat4::Zero();
  info.topLeftCorner<3, 3>() = prior_.information;
  info(3, 3) = params_.scale_sigma > 0.0 ? 1.0 / (params_.scale_sigma * params_.scale_sigma) : 1.0;
  return info;
}

Vec4 EvidenceJob::from_prior() const {
  return {pose_.x_m - prior_.mean.x_m, pose_.y_m - prior_.mean.y_m,
          wrap_angle(pose_.yaw_rad - prior_.mean.yaw_rad), pose_.scale - 1.0};
}

/// A pass over all local boulders is done: a step of Gauss and Newton, or the end.
void EvidenceJob::end_pass() {
  cursor_ = 0;
  ++result_.iterations;
  if (last_) {
    assign();
    share_ = 0;
    return;
  }
  const Mat4 prior = prior_information();
  const Factors factors(Mat4(information(pairs_[kAll]) + prior));
  const bool positive = sum_w_ > 1.0e-3 && factors.positive();
  const Vec4 step =
      positive ? factors.solve(Vec4(pairs_[kAll].pull) - prior * from_prior()) : Vec4(Vec4::Zero());
  const double lever_m = sum_w_ > 0.0 ? std::sqrt(pairs_[kAll].d2 / (pairs_[kAll].weight + 1.0e-300)) : 1.0;
  const double moved =
      std::fabs(step(0)) + std::fabs(step(1)) + lever_m * (std::fabs(step(2)) + std::fabs(step(3)));
  if (!positive || !(moved < 1.0e3)) {
    status_ = EvidenceStatus::kDiverged;
    return;
  }
  pose_.x_m += step(0);
  pose_.y_m += step(1);
  pose_.yaw_rad = wrap_angle(pose_.yaw_rad + step(2));
  pose_.scale += step(3);
  if (!in_range(pose_.scale, kLeastScale, kMostScale)) {
    status_ = EvidenceStatus::kDiverged;
    return;
  }
  turn_ = sin_cos(pose_.yaw_rad);
  settled_ = inflation_ == 1.0 && moved < params_.settled * params_.sigma_pair_m;
  last_ = settled_ || result_.iterations + 1 >= kMaxIterations;
  inflation_ = last_ || result_.iterations >= 2 ? 1.0 : 1.4;
  begin_pass();
}

/// Each map boulder counts once, for the local boulder that leans on it most.
void EvidenceJob::assign() {
  const std::size_t n = sightings_->size();
  for (std::size_t i = 0; i < n; ++i) {
    if (say_[i].map != kNone) owner_[say_[i].map] = kNone;
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (say_[i].map == kNone) continue;
    std::uint16_t& owner = owner_[say_[i].map];
    if (owner == kNone) {
      owner = static_cast<std::uint16_t>(i);
    } else if (say_[i].ratio > say_[owner].ratio) {
      say_[owner].ratio = 0.0;
      owner = static_cast<std::uint16_t>(i);
    } else {
      say_[i].ratio = 0.0;
    }
  }
  for (std::size_t i = 0; i < n; ++i) best_of_[(*sightings_)[i].cluster] = static_cast<std::uint16_t>(i);
  for (std::size_t i = 0; i < n; ++i) {
    std::uint16_t& best = best_of_[(*sightings_)[i].cluster];
    if (say_[i].ratio > say_[best].ratio) best = static_cast<std::uint16_t>(i);
  }
  constexpr double kUsual = 1.5;  // crowding that scattered boulders may show
  constexpr double kLeastEcho = 0.4;
  echo_ = ground_->crowding() > kUsual ? kUsual / ground_->crowding() : 1.0;
  if (echo_ < kLeastEcho) echo_ = kLeastEcho;
}

void EvidenceJob::multiply(std::size_t end) {
  const double p = kShares[share_];
  double sum = cursor_ == 0 ? 0.0 : sums_[share_];
  double before = cursor_ == 0 ? 0.0 : before_[share_];
  double used = cursor_ == 0 ? 0.0 : used_[share_];
  for (std::size_t i = cursor_; i < end; ++i) {
    const double term = ln(1.0 - p + p * say_[i].ratio);
    const bool echo = term > 0.0 && best_of_[(*sightings_)[i].cluster] != i;
    const double counts = echo ? echo_ * term : term;
    sum += counts;
    before += (*sightings_)[i].in_view ? 0.0 : counts;
    used += (1.0 - static_cast<double>((*sightings_)[i].fresh)) * counts;
  }
  sums_[share_] = sum;
  before_[share_] = before;
  used_[share_] = used;
  cursor_ = end;
}

void EvidenceJob::weigh() {
  const Mat4 prior = prior_information();
  const Vec4 off = from_prior();
  Evidence& r = result_;
  r.pose = pose_;
  r.S = mean_over_shares(sums_);
  r.view_log = mean_over_shares(before_) - r.S;
  r.fresh_log = r.S - mean_over_shares(used_);
  const Vec4 held = prior * off;
  r.chi2 = off.dot(held);
  r.matched = sum_w_;
  r.rms_m = sum_w_ > 0.0 ? std::sqrt(sum_r2_m2_ / sum_w_) : 0.0;
  // Observed information; where the matches are too uncertain for it to be positive, half of the complete.
  const Mat4 complete = information(pairs_[kAll]);
  Mat4 seen = complete - missing_;
  double log_det_fix = 0.0;
  Mat4 known = Mat4::Zero();  // keeps a fixed scale's row regular
  if (params_.scale_sigma == 0.0) known(3, 3) = 1.0;
  double log_det_seen = 0.0;
  if (!log_det(Factors(Mat4(seen + known)), log_det_seen)) seen = 0.5 * complete;
  if (!log_det(Factors(Mat4(seen + prior)), log_det_fix)) {
    status_ = EvidenceStatus::kDiverged;
    return;
  }
  r.log_volume = 1.5 * kLn2Pi - 0.5 * log_det_fix;
  const double log_scale_prior = params_.scale_sigma > 0.0 ? ln(params_.scale_sigma) : 0.0;
  r.log_ratio = r.S - 0.5 * r.chi2 + r.log_volume - log_scale_prior - prior_.log_volume;
  // Innovation: the fix alone lies at pose + seen^-1 prior (pose - mean).
  const Mat4 firm = seen + known + 1.0e-9 * Mat4::Identity();
  r.innovation2 = r.chi2 + held.dot(Factors(firm).solve(held));
  constexpr double kPriorFreedom = 10.0;
  const double freedom = 2.0 * sum_w_ - (params_.scale_sigma > 0.0 ? 4.0 : 3.0);
  double factor = (kPriorFreedom + sum_wr2_) / (kPriorFreedom + (freedom > 0.0 ? freedom : 0.0));
  factor = factor < kLeastFactor ? kLeastFactor : factor > kMostFactor ? kMostFactor : factor;
  r.covariance = Factors(Mat4(seen / factor + prior)).inverse();
  if (params_.scale_sigma == 0.0) r.covariance(3, 3) = 0.0;
  tell_fresh(factor);
  status_ = settled_ ? EvidenceStatus::kDone : EvidenceStatus::kNotSettled;
}

/// The scale is left to all of them.
void EvidenceJob::tell_fresh(double factor) {
  result_.fresh_information = information(pairs_[kFresh]).topLeftCorner<3, 3>() / factor;
  result_.fresh_pull = Vec3(pairs_[kFresh].pull) / factor;
}

Progress EvidenceJob::step(WorkBudget& budget) {
  while (status_ == EvidenceStatus::kRunning) {
    if (share_ >= 0) {
      const std::size_t left = sightings_->size() - cursor_;
      const std::size_t count = left < kUnitSightings ? left : kUnitSightings;
      if (!budget.take(share_ops(count))) return Progress::kMore;
      multiply(cursor_ + count);
      if (cursor_ < sightings_->size()) continue;
      cursor_ = 0;
      if (++share_ == kShareCount) weigh();
      continue;
    }
    const Sighting& s = (*sightings_)[cursor_];
    BoulderQuery q = query(s);
    const bool last = q.cut(seen_);
    if (!budget.take(look_ops(q.ops()))) return Progress::kMore;
    look(s, q);
    seen_ += q.candidates;
    if (!last) continue;
    looked(s, q);
    if (++cursor_ == sightings_->size()) end_pass();
  }
  return Progress::kDone;
}

// ---- the verdict ------------------------------------------------------------------------------------------

namespace {

/// The tail that the decoys show: 1 or more.
double tail_of(const Decoys& decoys, double chance_best, int tail) {
  constexpr double kPriorDecoys = 4.0;
  double top[Decoys::kCapacity] = {};  // descending
  std::size_t count = 0;
  for (const double score : decoys.scores) {
    if (score <= chance_best) continue;
    std::size_t at = count++;
    for (; at > 0 && top[at - 1] < score; --at) top[at] = top[at - 1];
    top[at] = score;
  }
  const auto most = static_cast<std::size_t>(tail);
  const std::size_t k = count < most ? count : most;
  const double from = count > most ? top[most] : chance_best;
  double excess = 0.0;
  for (std::size_t i = 0; i < k; ++i) excess += top[i] - from;
  const double theta = (kPriorDecoys + excess) / (kPriorDecoys + static_cast<double>(k));
  return theta > 1.0 ? theta : 1.0;
}

}  // namespace

Verdict judge(const VerdictParams& params, const Evidence& best, double second_log_ratio,
              const PosePrior& prior, const Decoys& decoys) {
  Verdict v;
  v.log_ratio = best.log_ratio;
  v.view_log = best.view_log;
  v.second_log_ratio = second_log_ratio;
  v.theta = tail_of(decoys, decoys.log_volume - best.log_volume, params.tail);
  const double score = best.S - 0.5 * best.chi2;
  double false_ones = 0.0;
  for (const double decoy : decoys.scores) {
    const double behind = (decoy - score) / v.theta;
    false_ones += exp(behind < 600.0 ? behind : 600.0);
  }
  const double inside = prior.log_volume > best.log_volume ? prior.log_volume : best.log_volume;
  double share = inside - decoys.log_volume;
  if (share > 0.0) share = 0.0;
  if (false_ones > 0.0) {
    v.beyond_decoys = -ln(false_ones);
    v.chance_log = v.beyond_decoys - share;
  }
  const double needed = params.ln_threshold - params.prior_log_odds;
  const double have = v.log_ratio + params.calibration;
  if (best.innovation2 > params.innovation2_limit && have + 0.5 * best.chi2 >= needed) {
    v.status = VerdictStatus::kInconsistentWithPrior;
  } else if (best.view_log > params.view_limit && have + best.view_log >= needed) {
    v.status = VerdictStatus::kViewDisagrees;
  } else if (have < needed) {
    v.status = VerdictStatus::kTooLittleEvidence;
  } else if (v.log_ratio - second_log_ratio < params.second_margin) {
    v.status = VerdictStatus::kAmbiguous;
  } else if (v.chance_log < needed) {
    v.status = VerdictStatus::kChanceAgreement;
  } else {
    v.status = VerdictStatus::kAccepted;
  }
  return v;
}

}  // namespace cairn
