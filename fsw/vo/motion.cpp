#include "vo/motion.hpp"

#include <cmath>

#include "core/factors.hpp"
#include "vo/absolute_orientation.hpp"

namespace cairn {
namespace {

constexpr double kMinDepth = 0.05;
constexpr double kBinsPerUnit = 4.0;  // of the histogram of residuals

bool usable(const MotionPairs& pairs) {
  for (const MotionPair& p : pairs) {
    const bool finite = std::isfinite(p.p_ref_m.squaredNorm()) && std::isfinite(p.seen.u_left) &&
                        std::isfinite(p.seen.v_left) && std::isfinite(p.seen.u_right) &&
                        std::isfinite(p.d_ref_px);
    if (!finite || !(p.p_ref_m.z() > kMinDepth) || !(p.d_ref_px > 0.0) || !(p.seen.disparity_px() > 0.0) ||
        !(p.weight > 0.0F))
      return false;
  }
  return true;
}

bool usable(const MotionParams& p) {
  return p.max_hypotheses > 0 && p.inlier_px > 0.0 && p.min_inliers >= 3 && p.confidence > 0.0 &&
         p.confidence < 1.0 && p.sigma_px > 0.0 && p.cauchy > 0.0 && p.iterations > 0;
}

MotionStatus check(const MotionParams& params, const StereoRig& rig, const MotionPairs& pairs) {
  if (!is_valid(rig) || !usable(params) || !usable(pairs)) return MotionStatus::kBadInput;
  if (pairs.size() < static_cast<std::size_t>(params.min_inliers)) return MotionStatus::kTooFewPairs;
  return MotionStatus::kRunning;
}

/// Hypotheses after which a clean triple was drawn with the wanted confidence: log(1 - c) / log(1 - w^3),
/// counted up by multiplication since flight code has no logarithm.
int hypotheses_needed(double inlier_share, double confidence, int most) {
  const double miss = 1.0 - inlier_share * inlier_share * inlier_share;
  double all_missed = 1.0;
  int n = 0;
  while (n < most && all_missed > 1.0 - confidence) {
    all_missed *= miss;
    ++n;
  }
  return n;
}

/// Variances in units of sigma^2: u_left and v as measured, d the difference of two.
constexpr double kVarU = 1.0;
constexpr double kVarV = 1.0;
constexpr double kVarD = 1.5;

/// A motion as its pairs see it: the matrix once, not the quaternion for each point.
struct Motion {
  Mat3 R;
  Vec3 t;
  double unit;  // of the pairs' weights
  Motion(const Pose3& T, double weight_unit) : R(T.q.toRotationMatrix()), t(T.t), unit(weight_unit) {}
};

/// Residual of one pair at a motion, and the information it holds: diag(1 / kVar) - k aj aj^T, the inverse of
/// diag(kVar) + kVarD j j^T by Sherman and Morrison, j = d(prediction) / d(d_ref). Plain numbers, and no
/// products with the zeros of the Jacobians: this is the inner loop of the refinement.
struct Residual {
  double x, y, z, iz;           // the point in the current camera
  double u, v, d;               // measured - predicted
  double hu, hv, hux, hvy, hd;  // prediction by point: (hu, 0, hux), (0, hv, hvy), (0, 0, hd)
  double aj_u, aj_v, aj_d, k;
  double aj_r;     // aj^T r
  double weight;   // of the pair
  double squared;  // r^T information r times weight, in units of sigma^2
};

/// False where the point lies behind the camera.
bool residual_of(const StereoRig& rig, const MotionPair& pair, const Motion& m, Residual& o) {
  const double px = pair.p_ref_m[0];
  const double py = pair.p_ref_m[1];
  const double pz = pair.p_ref_m[2];
  const double rx = m.R(0, 0) * px + m.R(0, 1) * py + m.R(0, 2) * pz;
  const double ry = m.R(1, 0) * px + m.R(1, 1) * py + m.R(1, 2) * pz;
  const double rz = m.R(2, 0) * px + m.R(2, 1) * py + m.R(2, 2) * pz;
  o.x = rx + m.t[0];
  o.y = ry + m.t[1];
  o.z = rz + m.t[2];
  if (!(o.z > kMinDepth)) return false;
  o.iz = 1.0 / o.z;
  o.hu = rig.fx_px * o.iz;
  o.hv = rig.fy_px * o.iz;
  const double u = o.hu * o.x;
  const double v = o.hv * o.y;
  const double d = o.hu * rig.baseline_m;
  o.hux = -u * o.iz;
  o.hvy = -v * o.iz;
  o.hd = -d * o.iz;
  o.u = pair.seen.u_left - (u + rig.cx_px);
  o.v = pair.seen.v_left - (v + rig.cy_px);
  o.d = pair.seen.disparity_px() - d;
  const double s = -1.0 / pair.d_ref_px;  // p_ref is proportional to 1 / d_ref
  const double ju = (o.hu * rx + o.hux * rz) * s;
  const double jv = (o.hv * ry + o.hvy * rz) * s;
  const double jd = o.hd * rz * s;
  o.aj_u = ju * (1.0 / kVarU);
  o.aj_v = jv * (1.0 / kVarV);
  o.aj_d = jd * (1.0 / kVarD);
  o.k = kVarD / (1.0 + kVarD * (ju * o.aj_u + jv * o.aj_v + jd * o.aj_d));
  o.aj_r = o.aj_u * o.u + o.aj_v * o.v + o.aj_d * o.d;
  o.weight = m.unit * static_cast<double>(pair.weight);
  o.squared = o.weight * (o.u * o.u * (1.0 / kVarU) + o.v * o.v * (1.0 / kVarV) + o.d * o.d * (1.0 / kVarD) -
                          o.k * o.aj_r * o.aj_r);
  return true;
}

/// Of the prediction by the left perturbation (rotation, translation): d(exp(w) p) = w x p.
struct Jacobian {
  double u[6], v[6], d[6];
  explicit Jacobian(const Residual& o)
      : u{o.hux * o.y, o.hu * o.z - o.hux * o.x, -o.hu * o.y, o.hu, 0.0, o.hux},
        v{o.hvy * o.y - o.hv * o.z, -o.hvy * o.x, o.hv * o.x, 0.0, o.hv, o.hvy},
        d{o.hd * o.y, -o.hd * o.x, 0.0, 0.0, 0.0, o.hd} {}
};

/// Adds one pair's J^T W J (lower half) and J^T W r to the normal equations, W = weight * information.
void accumulate(const Residual& o, double weight, Mat6& information, Vec6& gradient) {
  const Jacobian J(o);
  const double wu = weight * (1.0 / kVarU);
  const double wv = weight * (1.0 / kVarV);
  const double wd = weight * (1.0 / kVarD);
  const double wk = weight * o.k;
  double g[6];
  for (int i = 0; i < 6; ++i) g[i] = o.aj_u * J.u[i] + o.aj_v * J.v[i] + o.aj_d * J.d[i];
  for (int i = 0; i < 6; ++i) {
    const double cu = wu * J.u[i];
    const double cv = wv * J.v[i];
    const double cd = wd * J.d[i];
    const double cg = wk * g[i];
    for (int j = 0; j <= i; ++j) information(i, j) += cu * J.u[j] + cv * J.v[j] + cd * J.d[j] - cg * g[j];
    gradient[i] += cu * o.u + cv * o.v + cd * o.d - cg * o.aj_r;
  }
}

/// How the residual of a pair changes by a parameter, sign reversed.
struct Shift {
  double u, v, d;
};

double dot(const Shift& a, const Shift& b) { return a.u * b.u + a.v * b.v + a.d * b.d; }

/// The residual's information times a shift.
Shift weigh(const Shift& h, double weight, const Residual& o) {
  const double aj_h = o.aj_u * h.u + o.aj_v * h.v + o.aj_d * h.d;
  return {weight * (h.u * (1.0 / kVarU) - o.k * aj_h * o.aj_u),
          weight * (h.v * (1.0 / kVarV) - o.k * aj_h * o.aj_v),
          weight * (h.d * (1.0 / kVarD) - o.k * aj_h * o.aj_d)};
}

/// What a stronger lens takes off (geometry/stereo_rig.hpp) of a point, by its place from the middle.
Shift lens_of(const StereoRig& rig, double u, double v, double d) {
  const double x2 = 1.0 / (rig.fx_px * rig.fx_px);
  const double y2 = v * v / (rig.fy_px * rig.fy_px);
  const double right = u - d;
  const double left_r2 = u * u * x2 + y2;
  const double right_r2 = right * right * x2 + y2;
  return {-u * left_r2, -0.5 * v * (left_r2 + right_r2), right * right_r2 - u * left_r2};
}

/// Both what is measured and the reference's point move, that one with its prediction.
Shift lens_shift(const StereoRig& rig, const MotionPair& pair, const Motion& m, const Residual& o) {
  const Vec3& p = pair.p_ref_m;
  const Shift now =
      lens_of(rig, pair.seen.u_left - rig.cx_px, pair.seen.v_left - rig.cy_px, pair.seen.disparity_px());
  const Shift then = lens_of(rig, rig.fx_px * p.x() / p.z(), rig.fy_px * p.y() / p.z(), pair.d_ref_px);
  const double x = p.z() * then.u / rig.fx_px;
  const double y = p.z() * then.v / rig.fy_px;
  const double moved_x = m.R(0, 0) * x + m.R(0, 1) * y;
  const double moved_y = m.R(1, 0) * x + m.R(1, 1) * y;
  const double moved_z = m.R(2, 0) * x + m.R(2, 1) * y;
  return {o.hu * moved_x + o.hux * moved_z + o.aj_u * kVarU * then.d - now.u,
          o.hv * moved_y + o.hvy * moved_z + o.aj_v * kVarV * then.d - now.v,
          o.hd * moved_z + o.aj_d * kVarD * then.d - now.d};
}

}  // namespace

MotionStatus RansacMotionJob::start(const MotionParams& params, const StereoRig& rig,
                                    const MotionPairs& pairs) {
  result_ = {};
  result_.pairs = static_cast<int>(pairs.size());
  status_ = check(params, rig, pairs);
  if (status_ != MotionStatus::kRunning) return status_;
  params_ = params;
  rig_ = rig;
  pairs_ = &pairs;
  random_ = Random(params.seed);
  hypothesis_ = 0;
  needed_ = params.max_hypotheses;
  best_count_ = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) p_cur_m_[i] = triangulate(rig, pairs[i].seen);
  return status_;
}

Progress RansacMotionJob::step(WorkBudget& budget) {
  if (status_ != MotionStatus::kRunning) return Progress::kDone;
  const std::uint32_t unit = unit_ops(pairs_->size());
  while (hypothesis_ < needed_) {
    if (!budget.take(unit)) return Progress::kMore;
    try_hypothesis();
    ++hypothesis_;
  }
  if (!budget.take(unit)) return Progress::kMore;
  status_ = finish();
  return Progress::kDone;
}

void RansacMotionJob::try_hypothesis() {
  const auto n = static_cast<std::uint32_t>(pairs_->size());
  std::uint32_t pick[3];
  pick[0] = random_.below(n);
  pick[1] = random_.below(n - 1);
  if (pick[1] >= pick[0]) ++pick[1];
  pick[2] = random_.below(n - 2);
  const std::uint32_t low = pick[0] < pick[1] ? pick[0] : pick[1];
  const std::uint32_t high = pick[0] < pick[1] ? pick[1] : pick[0];
  if (pick[2] >= low) ++pick[2];
  if (pick[2] >= high) ++pick[2];
  Vec3 from[3];
  Vec3 to[3];
  for (int i = 0; i < 3; ++i) {
    from[i] = (*pairs_)[pick[i]].p_ref_m;
    to[i] = p_cur_m_[pick[i]];
  }
  Pose3 T;
  if (absolute_orientation(from, to, 3, T) != OrientationStatus::kSolved) return;
  const int count = count_inliers(T, nullptr);
  if (count <= best_count_) return;
  best_count_ = count;
  best_ = T;
  const int needed =
      hypotheses_needed(static_cast<double>(count) / n, params_.confidence, params_.max_hypotheses);
  needed_ = needed > hypothesis_ ? needed : hypothesis_;
}

int RansacMotionJob::count_inliers(const Pose3& T_cur_ref, bool* flags) const {
  const Mat3 R = T_cur_ref.q.toRotationMatrix();
  const double gate2 = params_.inlier_px * params_.inlier_px;
  int count = 0;
  for (std::size_t i = 0; i < pairs_->size(); ++i) {
    const MotionPair& pair = (*pairs_)[i];
    const Vec3 p = R * pair.p_ref_m + T_cur_ref.t;
    bool in = p.z() > kMinDepth;
    if (in) {
      const StereoPixel px = project(rig_, p);
      const double du = px.u_left - pair.seen.u_left;
      const double dv = px.v_left - pair.seen.v_left;
      const double du_right = px.u_right - pair.seen.u_right;
      in = du * du + dv * dv <= gate2 && du_right * du_right + dv * dv <= gate2;
    }
    count += in ? 1 : 0;
    if (flags != nullptr) flags[i] = in;
  }
  return count;
}

MotionStatus RansacMotionJob::finish() {
  for (bool& flag : inlier_) flag = false;
  if (best_count_ < params_.min_inliers) return MotionStatus::kNoConsensus;
  result_.inliers = count_inliers(best_, inlier_);
  // Orientation of all inliers, in fixed order. p_cur_m_ is packed in place: inlier k is never
  // behind index k.
  std::size_t n = 0;
  for (std::size_t i = 0; i < pairs_->size(); ++i) {
    if (!inlier_[i]) continue;
    inlier_ref_m_[n] = (*pairs_)[i].p_ref_m;
    p_cur_m_[n] = p_cur_m_[i];
    ++n;
  }
  if (absolute_orientation(inlier_ref_m_, p_cur_m_, n, result_.T_cur_ref) != OrientationStatus::kSolved) {
    return MotionStatus::kDegenerate;
  }
  return MotionStatus::kEstimated;
}

MotionStatus RefineMotionJob::start(const MotionParams& params, const StereoRig& rig,
                                    const MotionPairs& pairs, const Pose3& T_cur_ref, bool of_rig) {
  result_ = {};
  result_.pairs = static_cast<int>(pairs.size());
  status_ = is_valid(T_cur_ref) ? check(params, rig, pairs) : MotionStatus::kBadInput;
  if (status_ != MotionStatus::kRunning) return status_;
  params_ = params;
  rig_ = rig;
  pairs_ = &pairs;
  T_cur_ref_ = T_cur_ref;
  of_rig_ = of_rig;
  double sum = 0.0;
  for (const MotionPair& pair : pairs) sum += static_cast<double>(pair.weight);
  unit_ = static_cast<double>(pairs.size()) / sum;
  iteration_ = 0;
  begin_pass(Pass::kScale);
  return status_;
}

Progress RefineMotionJob::step(WorkBudget& budget) {
  while (status_ == MotionStatus::kRunning) {
    const std::uint32_t each = kPairOps[static_cast<std::size_t>(pass_)];
    const std::size_t left = pairs_->size() - cursor_;
    const std::size_t most = pass_ == Pass::kRig ? kMostUnitOps / each : kUnitPairs;
    const std::size_t count = left < most ? left : most;
    if (!budget.take(each * static_cast<std::uint32_t>(count))) return Progress::kMore;
    const std::size_t end = cursor_ + count;
    switch (pass_) {
      case Pass::kScale: measure(end); break;
      case Pass::kAccumulate: accumulate_pairs(end); break;
      case Pass::kJudge: judge(end); break;
      case Pass::kRig: ask_of_rig(end); break;
    }
    cursor_ = end;
    if (cursor_ == pairs_->size()) end_pass();
  }
  return Progress::kDone;
}

void RefineMotionJob::begin_pass(Pass pass) {
  pass_ = pass;
  cursor_ = 0;
  histogram_ = {};
  tail_ = {};
  sums_ = {};
}

void RefineMotionJob::end_pass() {
  switch (pass_) {
    case Pass::kScale:
      sigma_px_ = params_.sigma_px * residual_scale();
      information_.setZero();
      gradient_.setZero();
      begin_pass(Pass::kAccumulate);
      break;
    case Pass::kAccumulate: {
      ++iteration_;
      const bool converged = move();
      begin_pass(converged || iteration_ == params_.iterations ? Pass::kJudge : Pass::kScale);
      break;
    }
    case Pass::kJudge: {
      const MotionStatus status = finish();
      if (of_rig_ && status == MotionStatus::kEstimated) {
        begin_pass(Pass::kRig);
      } else {
        status_ = status;
      }
      break;
    }
    case Pass::kRig:
      tell_of_rig();
      status_ = MotionStatus::kEstimated;
      break;
  }
}

void RefineMotionJob::measure(std::size_t end) {
  constexpr int kLast = Histogram::kBins - 1;
  const Motion motion(T_cur_ref_, unit_);
  for (std::size_t i = cursor_; i < end; ++i) {
    Residual o;
    if (!residual_of(rig_, (*pairs_)[i], motion, o)) continue;
    const double m = std::sqrt(o.squared > 0.0 ? o.squared : 0.0) / params_.sigma_px;
    ++histogram_.bin[m * kBinsPerUnit < kLast ? static_cast<int>(m * kBinsPerUnit) : kLast];
    ++histogram_.count;
  }
}

/// How many times sigma_px the residuals really are: the median of the Mahalanobis distances over that of a
/// chi distribution with three degrees of freedom, at least 1.
double RefineMotionJob::residual_scale() const {
  constexpr double kChiMedian = 1.538;
  int below = 0;
  int bin = 0;
  while (bin < Histogram::kBins - 1 && 2 * (below + histogram_.bin[bin]) < histogram_.count)
    below += histogram_.bin[bin++];
  const double scale = (bin + 0.5) / kBinsPerUnit / kChiMedian;
  return scale > 1.0 ? scale : 1.0;
}

void RefineMotionJob::accumulate_pairs(std::size_t end) {
  const double s2 = sigma_px_ * sigma_px_;
  const double c2 = params_.cauchy * params_.cauchy;
  const Motion motion(T_cur_ref_, unit_);
  for (std::size_t i = cursor_; i < end; ++i) {
    Residual o;
    if (!residual_of(rig_, (*pairs_)[i], motion, o)) continue;
    accumulate(o, o.weight / (s2 + o.squared / c2), information_, gradient_);
  }
}

bool RefineMotionJob::move() {
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < i; ++j) information_(j, i) = information_(i, j);
  }
  const Factors factors(information_);
  if (!factors.positive() || !(factors.pivot(5) > 1.0e-9 * factors.pivot(0))) {
    status_ = MotionStatus::kDegenerate;
    return false;
  }
  const Vec6 step = factors.solve(gradient_);
  const Vec3 w(step[0], step[1], step[2]);
  const Quat dq = quat_exp(w);
  T_cur_ref_.t = dq * T_cur_ref_.t + Vec3(step[3], step[4], step[5]);
  T_cur_ref_.q = (dq * T_cur_ref_.q).normalized();
  if (!is_valid(T_cur_ref_)) {
    status_ = MotionStatus::kDegenerate;
    return false;
  }
  constexpr double kConverged = 1.0e-3;  // squares of sigmas: 3 % of one, and shrinking
  return step.dot(gradient_) < kConverged;
}

void RefineMotionJob::judge(std::size_t end) {
  const double s2 = sigma_px_ * sigma_px_;
  const double c2 = params_.cauchy * params_.cauchy;
  const Motion motion(T_cur_ref_, unit_);
  for (std::size_t i = cursor_; i < end; ++i) {
    inlier_[i] = false;
    Residual o;
    if (!residual_of(rig_, (*pairs_)[i], motion, o)) continue;
    const double m2 = o.squared / s2;
    const double w = 1.0 / (1.0 + m2 / c2);
    tail_.weights += w;
    tail_.pulls2 += w * w * m2 / 3.0;
    tail_.slopes += w - 2.0 * w * w * m2 / (3.0 * c2);
    if (m2 > 9.0 * 3.0) continue;
    inlier_[i] = true;
    ++result_.inliers;
    tail_.squares += o.u * o.u + o.v * o.v + o.d * o.d;
  }
}

MotionStatus RefineMotionJob::finish() {
  result_.T_cur_ref = T_cur_ref_;
  if (result_.inliers < params_.min_inliers) return MotionStatus::kNoConsensus;
  result_.rms_px = std::sqrt(tail_.squares / (3.0 * result_.inliers));
  // Covariance of an M-estimator (Huber 1981, 6.3) from what the residuals really were: sigma_px is a guess,
  // and weights that spare outliers also spare some of the good. information_ holds the weights once.
  const double scale = tail_.pulls2 * tail_.weights / (tail_.slopes * tail_.slopes);
  result_.covariance = Factors(information_).inverse() * (scale > 1.0e-6 ? scale : 1.0e-6);
  scale_ = scale;
  return MotionStatus::kEstimated;
}

/// Two more parameters, of which the first iteration is taken. Disparities longer by one in both frames move
/// the prediction by j, and the measured disparity by one; what a lens moves is told by bend().
void RefineMotionJob::ask_of_rig(std::size_t end) {
  const double s2 = sigma_px_ * sigma_px_;
  const double c2 = params_.cauchy * params_.cauchy;
  const Motion motion(T_cur_ref_, unit_);
  for (std::size_t i = cursor_; i < end; ++i) {
    Residual o;
    if (!residual_of(rig_, (*pairs_)[i], motion, o)) continue;
    const double weight = o.weight / (s2 + o.squared / c2);
    const Jacobian J(o);
    const Shift columns{o.aj_u * kVarU, o.aj_v * kVarV, o.aj_d * kVarD - 1.0};
    const Shift lens = lens_shift(rig_, (*pairs_)[i], motion, o);
    const Shift of_columns = weigh(columns, weight, o);
    const Shift of_lens = weigh(lens, weight, o);
    sums_.own[0] += dot(columns, of_columns);
    sums_.own[1] += dot(lens, of_lens);
    sums_.shared += dot(columns, of_lens);
    sums_.gradient[0] += o.u * of_columns.u + o.v * of_columns.v + o.d * of_columns.d;
    sums_.gradient[1] += o.u * of_lens.u + o.v * of_lens.v + o.d * of_lens.d;
    for (int k = 0; k < 6; ++k) {
      sums_.cross[0][k] += J.u[k] * of_columns.u + J.v[k] * of_columns.v + J.d[k] * of_columns.d;
      sums_.cross[1][k] += J.u[k] * of_lens.u + J.v[k] * of_lens.v + J.d[k] * of_lens.d;
    }
  }
}

/// The motion eliminated (Schur complement). The gradient stays: at the solution the motion's own is zero. A
/// wall that moves sideways is as well one at another distance: where next to nothing is left, that is
/// rounding. Images without noise make residuals small, and columns no better known.
void RefineMotionJob::tell_of_rig() {
  const Factors factors(information_);
  const Vec6 moved = factors.solve(sums_.cross[0]);
  const double left = sums_.own[0] - sums_.cross[0].dot(moved);
  constexpr double kLeastLeft = 1.0e-3;  // of what there was: in drives some 0.03
  constexpr double kLeastScale = 0.05;   // in drives 0.2 and more
  if (!(left > kLeastLeft * sums_.own[0])) return;
  const double scale = scale_ > kLeastScale ? scale_ : kLeastScale;
  result_.rig.columns_information = left / scale;
  result_.rig.columns_evidence = sums_.gradient[0] / scale;
  const double shared = sums_.shared - sums_.cross[1].dot(moved);
  const Vec6 moved_lens = factors.solve(sums_.cross[1]);
  const double left_lens = sums_.own[1] - sums_.cross[1].dot(moved_lens);
  if (!(left_lens > kLeastLeft * sums_.own[1])) return;
  result_.rig.lens_information = left_lens / scale;
  result_.rig.lens_evidence = sums_.gradient[1] / scale;
  result_.rig.shared = shared / scale;
}

}  // namespace cairn
