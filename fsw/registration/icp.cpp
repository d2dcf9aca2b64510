#include "registration/icp.hpp"

#include <cmath>

#include "core/arithmetic.hpp"
#include "core/heap_sort.hpp"
#include "core/trig.hpp"

namespace cairn {
namespace {

constexpr double kMaxScaleOnTheWay = 2.0;  // a similarity beyond it, or below its inverse, is collapsing

bool params_are_good(const IcpParams& p, const IcpPrior& prior) {
  const int fewest = prior.use ? 1 : 2;
  const bool model_known = p.model == IcpModel::kRigid || p.model == IcpModel::kSimilarity;
  const bool gates = in_range(p.gate_start_m, 1.0e-3, 1.0e3) &&
                     in_range(p.gate_final_m, 1.0e-3, p.gate_start_m) && in_range(p.gate_shrink, 0.01, 1.0) &&
                     (p.gate_shrink < 1.0 || p.gate_final_m == p.gate_start_m);
  const bool pairs = in_range(p.trim_fraction, 0.0, 0.8) && p.min_pairs >= fewest &&
                     p.min_pairs <= static_cast<int>(cfg::kMaxLocalBoulders) &&
                     in_range(p.min_lever_m, 0.0, 1.0e3) && in_range(p.sigma_pair_m, 1.0e-6, 1.0e3);
  const bool sizes = p.max_size_ratio == 0.0 || in_range(p.max_size_ratio, 1.0, 1.0e6);
  const bool end = p.max_iterations >= 1 && p.max_iterations <= 1000 && in_range(p.step_m, 0.0, 1.0) &&
                   in_range(p.step_rad, 0.0, 1.0);
  const bool limits = in_range(p.max_correction_m, 0.0, 1.0e6) && in_range(p.max_correction_rad, 0.0, kPi) &&
                      in_range(p.max_scale_change, 0.0, 0.5);
  return model_known && gates && pairs && sizes && end && limits;
}

bool prior_is_good(const IcpPrior& prior) {
  return !prior.use ||
         (in_range(prior.sigma_xy_m, 1.0e-6, 1.0e6) && in_range(prior.sigma_yaw_rad, 1.0e-6, 10.0));
}

bool point_is_good(const Vec2& p) {
  return std::fabs(p.x()) <= BoulderGrid::kMaxCoordinate_m &&
         std::fabs(p.y()) <= BoulderGrid::kMaxCoordinate_m;
}

/// ln x for 0 < x <= 1, to 1e-12: x = m 2^-k with m in (1/2, 1], and the series of the
/// inverse hyperbolic tangent.
double natural_log(double x) {
  constexpr double kLn2 = 0.69314718055994530942;
  double halvings = 0.0;
  for (int i = 0; i < 64 && x <= 0.5; ++i) {
    x *= 2.0;
    halvings += 1.0;
  }
  const double y = (x - 1.0) / (x + 1.0);
  double sum = 0.0;
  for (int n = 25; n >= 1; n -= 2) sum = 1.0 / n + y * y * sum;
  return 2.0 * y * sum - halvings * kLn2;
}

/// p/A of the header: how much smaller the mean square of the kept residuals is than that of all, Gaussian in
/// two axes, where the share p of smallest ones is kept.
double trimming_factor(int kept, int trimmed) {
  if (trimmed == 0) return 1.0;
  const double q = static_cast<double>(trimmed) / static_cast<double>(kept + trimmed);
  const double p = 1.0 - q;
  return p / (p + q * natural_log(q));
}

}  // namespace

// ---- start ------------------------------------------------------------------------------------------------

IcpStatus IcpJob::start(const IcpParams& params, const MapBoulders& map, const LocalMap& local,
                        const Pose2& T_map_site_prior, const Vec2& pivot_site_m, const IcpPrior& prior) {
  params_ = params;
  prior_ = prior;
  result_ = IcpResult();
  state_ = State();
  kept_.clear();
  trimmed_ = 0;
  past_count_ = 0;
  on_trial_ = false;
  status_ = IcpStatus::kBadInput;
  if (!params_are_good(params, prior) || !prior_is_good(prior) || !is_finite(T_map_site_prior) ||
      !point_is_good(T_map_site_prior.translation()) || !point_is_good(pivot_site_m)) {
    return status_;
  }
  T_map_site_prior_ = T_map_site_prior;
  pivot_site_m_ = pivot_site_m;
  pivot_map_m_ = T_map_site_prior * pivot_site_m;
  result_.T_map_site = T_map_site_prior;
  status_ = copy_inputs(map, local);
  if (status_ != IcpStatus::kRunning) return status_;
  gate_m_ = params.gate_start_m;
  phase_ = Phase::kGrid;
  cursor_ = 0;
  return status_;
}

IcpStatus IcpJob::copy_inputs(const MapBoulders& map, const LocalMap& local) {
  if (map.empty()) return IcpStatus::kNoMapBoulders;
  if (local.empty()) return IcpStatus::kNoLocalBoulders;
  if (map_.start(map, pivot_map_m_, params_.gate_start_m) != GridStatus::kRunning)
    return IcpStatus::kBadInput;
  for (std::uint16_t& owner : owner_) owner = kNone;
  local_.clear();
  const SinCos r = sin_cos(T_map_site_prior_.yaw_rad);
  double sum = 0.0;
  for (const LocalBoulder& b : local) {
    if (!point_is_good(b.p_site_m) || !std::isfinite(b.diameter_m)) return IcpStatus::kBadInput;
    const Vec2 q = b.p_site_m - pivot_site_m_;
    sum += q.squaredNorm();
    local_.append({r.cos * q.x() - r.sin * q.y(), r.sin * q.x() + r.cos * q.y(), b.diameter_m});
  }
  lever_all_m_ = std::sqrt(sum / static_cast<double>(local_.size()));
  if (lever_all_m_ < 1.0e-3) lever_all_m_ = 1.0e-3;
  return IcpStatus::kRunning;
}

// ---- pairing ----------------------------------------------------------------------------------------------

GridPoint IcpJob::apply(const State& state, const GridPoint& q) {
  const SinCos r = sin_cos(state.yaw);
  return {state.x + state.scale * (r.cos * q.x_m - r.sin * q.y_m),
          state.y + state.scale * (r.sin * q.x_m + r.cos * q.y_m), q.diameter_m};
}

/// The nearest map boulder of one local boulder, within the gate; of equal ones the lowest index.
void IcpJob::pair_unit(const BoulderQuery& query) {
  const NearestBoulder best = map_.nearest(query, {params_.max_size_ratio});
  nearest_[cursor_] = {best.r2_m2, static_cast<std::uint16_t>(cursor_), best.index};
  ++cursor_;
}

/// Of the local boulders that chose one map boulder, the closest keeps it (of equal ones the lowest index).
void IcpJob::keep_one_to_one() {
  for (std::size_t i = 0; i < local_.size(); ++i) {
    Candidate& mine = nearest_[i];
    if (mine.map == kNone) continue;
    std::uint16_t& owner = owner_[mine.map];
    if (owner == kNone) {
      owner = mine.local;
    } else if (mine.r2 < nearest_[owner].r2) {
      nearest_[owner].map = kNone;
      owner = mine.local;
    } else {
      mine.map = kNone;
    }
  }
  for (std::size_t i = 0; i < local_.size(); ++i) {
    if (nearest_[i].map != kNone) owner_[nearest_[i].map] = kNone;
  }
}

void IcpJob::gather_and_trim() {
  kept_.clear();
  for (std::size_t i = 0; i < local_.size(); ++i) {
    if (nearest_[i].map != kNone) kept_.append(nearest_[i]);
  }
  heap_sort(kept_.data(), static_cast<int>(kept_.size()), [](const Candidate& a, const Candidate& b) {
    return a.r2 < b.r2 || (a.r2 == b.r2 && a.local < b.local);
  });
  trimmed_ = static_cast<int>(params_.trim_fraction * static_cast<double>(kept_.size()));
  kept_.resize(kept_.size() - static_cast<std::size_t>(trimmed_));
}

// ---- the estimate -----------------------------------------------------------------------------------------

double IcpJob::sum_of_squares(const State& state) const {
  double sum = 0.0;
  for (const Candidate& c : kept_) {
    const GridPoint p = apply(state, local_[c.local]);
    const GridPoint& m = map_[c.map];
    sum += (m.x_m - p.x_m) * (m.x_m - p.x_m) + (m.y_m - p.y_m) * (m.y_m - p.y_m);
  }
  return sum;
}

double IcpJob::objective(const State& state) const {
  const auto n = static_cast<double>(local_.size());
  double sum = sum_of_squares(state) + (n - static_cast<double>(kept_.size())) * gate_m_ * gate_m_;
  if (prior_.use) {
    const Virtual v = virtual_pairs();
    const double s = state.scale;
    sum += v.weight * (state.x * state.x + state.y * state.y) +
           v.inertia * (1.0 + s * s - 2.0 * s * sin_cos(state.yaw).cos);
  }
  return sum / n;
}

/// Root mean square distance of the kept local boulders from their mean.
double IcpJob::lever() const {
  double x = 0.0;
  double y = 0.0;
  for (const Candidate& c : kept_) {
    x += local_[c.local].x_m;
    y += local_[c.local].y_m;
  }
  const auto n = static_cast<double>(kept_.size());
  x /= n;
  y /= n;
  double sum = 0.0;
  for (const Candidate& c : kept_) {
    const GridPoint& q = local_[c.local];
    sum += (q.x_m - x) * (q.x_m - x) + (q.y_m - y) * (q.y_m - y);
  }
  return std::sqrt(sum / n);
}

IcpJob::Virtual IcpJob::virtual_pairs() const {
  if (!prior_.use) return {0.0, 0.0};
  const double by_xy = params_.sigma_pair_m / prior_.sigma_xy_m;
  const double by_yaw = params_.sigma_pair_m / prior_.sigma_yaw_rad;
  return {by_xy * by_xy, by_yaw * by_yaw};
}

/// Closed form over the kept pairs and the prior's virtual ones, whose weighted sums about
/// the pivot are zero.
IcpJob::State IcpJob::estimate() const {
  const Virtual v = virtual_pairs();
  const double weight = static_cast<double>(kept_.size()) + v.weight;
  Vec2 q_mean(0.0, 0.0);
  Vec2 m_mean(0.0, 0.0);
  for (const Candidate& c : kept_) {
    q_mean += Vec2(local_[c.local].x_m, local_[c.local].y_m);
    m_mean += Vec2(map_[c.map].x_m, map_[c.map].y_m);
  }
  q_mean /= weight;
  m_mean /= weight;
  double dot = v.inertia + v.weight * q_mean.dot(m_mean);
  double cross = v.weight * (q_mean.x() * m_mean.y() - q_mean.y() * m_mean.x());
  double spread = v.inertia + v.weight * q_mean.squaredNorm();
  for (const Candidate& c : kept_) {
    const Vec2 q = Vec2(local_[c.local].x_m, local_[c.local].y_m) - q_mean;
    const Vec2 m = Vec2(map_[c.map].x_m, map_[c.map].y_m) - m_mean;
    dot += q.dot(m);
    cross += q.x() * m.y() - q.y() * m.x();
    spread += q.squaredNorm();
  }
  State next;
  next.yaw = atan2(cross, dot);
  if (params_.model == IcpModel::kSimilarity) next.scale = std::sqrt(dot * dot + cross * cross) / spread;
  const SinCos r = sin_cos(next.yaw);
  next.x = m_mean.x() - next.scale * (r.cos * q_mean.x() - r.sin * q_mean.y());
  next.y = m_mean.y() - next.scale * (r.sin * q_mean.x() + r.cos * q_mean.y());
  return next;
}

/// Absolute, so that a perfect start (no residual, no step) converges too.
bool IcpJob::step_is_small(const State& from, const State& to) const {
  const double dx = to.x - from.x;
  const double dy = to.y - from.y;
  return dx * dx + dy * dy <= params_.step_m * params_.step_m &&
         std::fabs(wrap_angle(to.yaw - from.yaw)) <= params_.step_rad &&
         std::fabs(to.scale - from.scale) <= params_.step_rad;
}

/// Of a fixed point: may it be used?
IcpStatus IcpJob::judge(const State& state) const {
  const double moved2 = state.x * state.x + state.y * state.y;
  const bool near = moved2 <= params_.max_correction_m * params_.max_correction_m &&
                    std::fabs(state.yaw) <= params_.max_correction_rad &&
                    std::fabs(state.scale - 1.0) <= params_.max_scale_change;
  return near ? IcpStatus::kConverged : IcpStatus::kBeyondLimit;
}

/// One iteration from pairs to the next state, or to the end.
void IcpJob::estimate_unit() {
  ++result_.iterations;
  if (params_.one_to_one) keep_one_to_one();
  gather_and_trim();
  if (on_trial_ && !trial_succeeds()) return next_iteration(fallback_);
  if (static_cast<int>(kept_.size()) < params_.min_pairs) return finish(IcpStatus::kTooFewPairs, state_);
  const double lever_m = lever();
  if (lever_m < params_.min_lever_m || (lever_m == 0.0 && !prior_.use)) {
    return finish(IcpStatus::kWeakGeometry, state_);
  }
  const State next = estimate();
  if (next.scale > kMaxScaleOnTheWay || next.scale * kMaxScaleOnTheWay < 1.0) {
    return finish(IcpStatus::kBeyondLimit, state_);
  }
  const bool final_gate = gate_m_ <= params_.gate_final_m;
  if (final_gate && step_is_small(state_, next)) return finish(judge(next), next);
  if (result_.iterations >= params_.max_iterations) return finish(IcpStatus::kIterationLimit, next);
  if (!final_gate) {
    gate_m_ *= params_.gate_shrink;
    if (gate_m_ < params_.gate_final_m) gate_m_ = params_.gate_final_m;
    return next_iteration(next);
  }
  next_iteration(params_.extrapolate ? extrapolated(next) : next);
}

void IcpJob::next_iteration(const State& state) {
  state_ = state;
  phase_ = Phase::kPair;
  cursor_ = 0;
}

// ---- extrapolation ----------------------------------------------------------------------------------------

IcpJob::Milestone IcpJob::milestone(const State& from, const State& to) const {
  Milestone m;
  m.objective = objective(to);
  const double step[4] = {to.x - from.x, to.y - from.y, lever_all_m_ * (to.yaw - from.yaw),
                          lever_all_m_ * (to.scale - from.scale)};
  double sum = 0.0;
  for (int i = 0; i < 4; ++i) {
    m.step[i] = step[i];
    sum += step[i] * step[i];
  }
  m.length = std::sqrt(sum);
  return m;
}

/// Besl & McKay's choice between line and parabola, as a multiple of the newest step;
/// 0 where neither is to be had.
double IcpJob::overstep() const {
  constexpr double kCos10Deg = 0.98480775301220802;
  constexpr double kFarthest = 25.0;
  if (past_count_ < 3) return 0.0;
  for (int k = 0; k < 2; ++k) {
    double dot = 0.0;
    for (int i = 0; i < 4; ++i) dot += past_[k].step[i] * past_[k + 1].step[i];
    if (!(dot > kCos10Deg * past_[k].length * past_[k + 1].length))
      return 0.0;  // also where a step has no length
  }
  const double v1 = -past_[0].length;
  const double v2 = v1 - past_[1].length;
  const double d0 = past_[0].objective;
  const double d1 = past_[1].objective;
  const double d2 = past_[2].objective;
  const double v_mean = (v1 + v2) / 3.0;
  const double d_mean = (d0 + d1 + d2) / 3.0;
  const double vv = v_mean * v_mean + (v1 - v_mean) * (v1 - v_mean) + (v2 - v_mean) * (v2 - v_mean);
  const double vd = -v_mean * (d0 - d_mean) + (v1 - v_mean) * (d1 - d_mean) + (v2 - v_mean) * (d2 - d_mean);
  const double slope = vd / vv;
  const double slope01 = (d0 - d1) / -v1;
  const double slope12 = (d1 - d2) / (v1 - v2);
  const double curvature = (slope01 - slope12) / -v2;
  const double farthest = kFarthest * past_[0].length;
  const double zero = slope < 0.0 ? v_mean - d_mean / slope : 0.0;  // of the line; 0 = none
  // Of the parabola.
  const double least = curvature > 0.0 ? -(slope01 - curvature * v1) / (2.0 * curvature) : 0.0;
  if (least > 0.0 && least < farthest && (zero <= 0.0 || least < zero)) return least / past_[0].length;
  if (zero > 0.0 && zero < farthest) return zero / past_[0].length;
  return zero > 0.0 && least > 0.0 ? kFarthest : 0.0;
}

/// Where to pair next: `next`, or a state beyond it on trial.
IcpJob::State IcpJob::extrapolated(const State& next) {
  past_[2] = past_[1];
  past_[1] = past_[0];
  past_[0] = milestone(state_, next);
  if (past_count_ < 3) ++past_count_;
  const bool room = result_.iterations + 2 <= params_.max_iterations;  // for the trial and for going back
  const double more = room ? overstep() : 0.0;
  if (more == 0.0) return next;
  const State beyond = {next.x + more * (next.x - state_.x), next.y + more * (next.y - state_.y),
                        next.yaw + more * (next.yaw - state_.yaw),
                        next.scale + more * (next.scale - state_.scale)};
  on_trial_ = true;
  fallback_ = next;
  trial_length_ = (1.0 + more) * past_[0].length;
  return beyond;
}

/// Has the extrapolation lowered the objective? If not, the past is forgotten: it has misled.
bool IcpJob::trial_succeeds() {
  on_trial_ = false;
  const double reached = objective(state_);
  if (reached > past_[0].objective) {
    past_count_ = 0;
    return false;
  }
  for (double& component : past_[0].step) component *= trial_length_ / past_[0].length;
  past_[0].length = trial_length_;
  past_[0].objective = reached;
  ++result_.extrapolations;
  return true;
}

// ---- the result -------------------------------------------------------------------------------------------

void IcpJob::finish(IcpStatus status, const State& state) {
  status_ = status;
  result_.dx_m = state.x;
  result_.dy_m = state.y;
  result_.dyaw_rad = state.yaw;
  result_.scale = state.scale;
  result_.T_map_site.yaw_rad = wrap_angle(T_map_site_prior_.yaw_rad + state.yaw);
  const SinCos r = sin_cos(result_.T_map_site.yaw_rad);
  const Vec2 p = pivot_site_m_;
  result_.T_map_site.x_m = pivot_map_m_.x() + state.x - (r.cos * p.x() - r.sin * p.y());
  result_.T_map_site.y_m = pivot_map_m_.y() + state.y - (r.sin * p.x() + r.cos * p.y());
  result_.pairs_used = static_cast<int>(kept_.size());
  result_.pairs_trimmed = trimmed_;
  result_.pairs_gated = static_cast<int>(local_.size()) - result_.pairs_used - trimmed_;
  for (const Candidate& c : kept_) {
    const GridPoint at = apply(state, local_[c.local]);
    const double dx = map_[c.map].x_m - at.x_m;
    const double dy = map_[c.map].y_m - at.y_m;
    result_.pairs.append({c.local, c.map, static_cast<float>(std::sqrt(dx * dx + dy * dy))});
  }
  if (kept_.empty()) return;
  result_.rms_m = std::sqrt(sum_of_squares(state) / static_cast<double>(kept_.size()));
  result_.lever_m = lever();
  fill_covariance(state);
}

/// The inverse of the information matrix, written out: with W the summed information of a translation, c the
/// information-weighted mean of the boulders about the pivot and S the information of a turn about that mean,
///   yaw          1/S
///   pivot        I/W + n n^T / S, n = c turned by 90 degrees (similarity: + c c^T / S)
///   pivot, yaw   -n/S
void IcpJob::fill_covariance(const State& state) {
  const auto n = static_cast<double>(kept_.size());
  const double unknowns = params_.model == IcpModel::kSimilarity ? 4.0 : 3.0;
  const double loss = trimming_factor(result_.pairs_used, result_.pairs_trimmed);
  double variance = params_.sigma_pair_m * params_.sigma_pair_m;
  if (2.0 * n > unknowns) {
    const double seen = loss * sum_of_squares(state) / (2.0 * n - unknowns);
    if (seen > variance) variance = seen;
  }
  const double info = 1.0 / (variance * loss);
  const double info_xy = prior_.use ? 1.0 / (prior_.sigma_xy_m * prior_.sigma_xy_m) : 0.0;
  const double info_yaw = prior_.use ? 1.0 / (prior_.sigma_yaw_rad * prior_.sigma_yaw_rad) : 0.0;
  Vec2 sum(0.0, 0.0);
  double inertia = 0.0;
  const State turn = {0.0, 0.0, state.yaw, state.scale};
  for (const Candidate& c : kept_) {
    const GridPoint d = apply(turn, local_[c.local]);
    sum += Vec2(d.x_m, d.y_m);
    inertia += d.x_m * d.x_m + d.y_m * d.y_m;
  }
  const double W = info * n + info_xy;
  const Vec2 c = sum * (info / W);
  const double S = info * inertia + info_yaw - W * c.squaredNorm();
  if (!(S > 0.0)) return;  // a point-like set of pairs without a prior: no covariance to be had
  const Vec2 normal(-c.y(), c.x());
  Mat2 pivot = Mat2::Identity() / W + normal * normal.transpose() / S;
  if (params_.model == IcpModel::kSimilarity) pivot += c * c.transpose() / S;
  result_.covariance.topLeftCorner<2, 2>() = pivot;
  result_.covariance.topRightCorner<2, 1>() = -normal / S;
  result_.covariance.bottomLeftCorner<1, 2>() = -normal.transpose() / S;
  result_.covariance(2, 2) = 1.0 / S;
}

// ---- the cursor -------------------------------------------------------------------------------------------

Progress IcpJob::step(WorkBudget& budget) {
  while (status_ == IcpStatus::kRunning) {
    const auto n = static_cast<std::uint32_t>(local_.size());
    if (phase_ == Phase::kGrid) {
      if (map_.step(budget) == Progress::kMore) return Progress::kMore;
      if (map_.status() != GridStatus::kReady) status_ = IcpStatus::kBadInput;
      phase_ = Phase::kPair;
    } else if (phase_ == Phase::kPair) {
      const BoulderQuery query = map_.query(apply(state_, local_[cursor_]), gate_m_);
      if (!budget.take(query.ops())) return Progress::kMore;
      pair_unit(query);
      if (cursor_ == n) phase_ = Phase::kEstimate;
    } else {
      if (!budget.take(kEstimateOps * n)) return Progress::kMore;
      estimate_unit();
    }
  }
  return Progress::kDone;
}

}  // namespace cairn
