#include "localizer/visual_odometry.hpp"

#include <cmath>

#include "core/arithmetic.hpp"

namespace cairn {
namespace {

constexpr double kRealignPx = 0.75;  // mean square shift of the predictions that asks for another alignment
constexpr double kMinDepth = 0.05;
constexpr float kLeastDoubt = 1.0F / 32.0F;  // of a point, in its frame's mean contrast
constexpr float kContrast = 1.0F / 8.0F;
constexpr std::uint32_t kRefinedOps = 3'400;  // of a point, in all rounds together
constexpr std::uint32_t kLeastAligned = 60;
constexpr double kStill_px = 0.5;   // between two pictures, of a point that does not move
constexpr double kMoves_px = 3.0;   // of one that the motion moves
constexpr int kMostElapsed = 1000;  // frames; over more than that no reference lasts
// Difference of Gaussians (image/gaussian.hpp) of white noise of 1, and how much more than that deviation the
// strongest extrema of each cell have on the average.
constexpr double kNoiseResponse = 0.112;
constexpr double kStrongest = 2.7;
constexpr double kLeastNoise = 3.0;  // grey levels; good cameras have 1
constexpr double kHalve = 1.3;       // contrast without noise, in the whole image's noise: less is halved ...
constexpr double kWhole = 1.8;       // ... and more is not any more
constexpr float kIdentity[4] = {1.0F, 0.0F, 0.0F, 1.0F};

std::int16_t clamp_to(double v, int low, int high) {
  if (!(v > low)) return static_cast<std::int16_t>(low);
  return static_cast<std::int16_t>(v < high ? v : high);
}

/// Statuses after which the next frame is measured from this one.
bool settles(VoStatus status) {
  return status == VoStatus::kFirstFrame || status == VoStatus::kMotion || status == VoStatus::kFewMatches ||
         status == VoStatus::kNoConsensus || status == VoStatus::kImplausible;
}

Pose3 share_of(const Pose3& motion, double share) {
  return {quat_exp(quat_log(motion.q) * share), motion.t * share};
}

}  // namespace

bool VisualOdometry::init(const VoParams& params, const StereoRig& rig) {
  status_ = VoStatus::kIdle;
  have_reference_ = motion_known_ = prediction_known_ = false;
  settled_ = true;
  elapsed_ = 0;
  T_ref_prev_ = last_step_ = predicted_ = T_cur_ref_ = Pose3();
  params_ = params;
  rig_ = rig;
  looked_again_ = false;
  stereo_.init(params, rig, params.motion.min_inliers);
  return is_valid(rig) && rig.width_px <= cfg::kImageWidth && rig.height_px <= cfg::kImageHeight;
}

void VisualOdometry::miss(std::uint32_t pairs, const Pose3* motion_prior) {
  for (std::uint32_t i = 0; i < pairs && i < kMostElapsed; ++i) predict(motion_prior);
}

/// To the bit the step itself where it is the first.
void VisualOdometry::predict(const Pose3* motion_prior) {
  const bool valid = motion_prior == nullptr || is_valid(*motion_prior);
  CAIRN_ASSERT(valid);
  const bool known = motion_known_ || motion_prior != nullptr;
  const Pose3& step = motion_prior != nullptr ? *motion_prior : last_step_;
  if (settled_) {
    elapsed_ = 1;
    predicted_ = step;
    prediction_known_ = known;
  } else if (elapsed_ < kMostElapsed) {
    ++elapsed_;
    predicted_ = predicted_ * step;
    prediction_known_ = prediction_known_ && known;
  }
  settled_ = false;
}

VoStatus VisualOdometry::start(const ImageU8& left, const ImageU8& right, const Pose3* motion_prior) {
  result_ = {};
  phase_ = params_.paper_exact ? Phase::kStereo : Phase::kNoise;
  worked_ = looked_again_ = false;
  spent_ops_ = second_look_ops_ = 0;
  predict(motion_prior);
  const bool started = stereo_.start(left, right, current()) == StereoStatus::kRunning;
  left_image_ = left;
  right_image_ = right;
  noise_.start(left, right);
  return status_ = started ? VoStatus::kRunning : VoStatus::kBadImage;
}

Progress VisualOdometry::step(WorkBudget& budget) {
  while (status_ == VoStatus::kRunning) {
    if (!run_phase(budget)) return Progress::kMore;
  }
  return Progress::kDone;
}

bool VisualOdometry::run_phase(WorkBudget& budget) {
  const std::uint64_t before = budget.spent();
  worked_ = worked_ || work(budget) == Progress::kDone;
  const bool done = worked_ && budget.take(kOverPointsOps);
  spent_ops_ += static_cast<std::uint32_t>(budget.spent() - before);
  if (!done) return false;
  worked_ = false;
  next_phase();
  return true;
}

Progress VisualOdometry::work(WorkBudget& budget) {
  switch (phase_) {
    case Phase::kNoise: return noise_.step(budget);
    case Phase::kStereo: return stereo_.step(budget);
    case Phase::kMatch: return match_.step(budget);
    case Phase::kRansac: return ransac_.step(budget);
    case Phase::kConsensus:
    case Phase::kRefine: return refine_.step(budget);
    case Phase::kAlign:
      for (; cursor_ < reference().points.size(); ++cursor_) {
        if (!reference().points[cursor_].valid || !is_chosen(cursor_)) continue;
        if (!aligned_.half) {
          if (!budget.take(kTemplateOps + kAlignOps)) return Progress::kMore;
          if (!align_left(cursor_)) continue;
          aligned_.half = true;
        }
        if (!budget.take(kAlignOps)) return Progress::kMore;
        align_right(cursor_);
        aligned_.half = false;
      }
      break;
  }
  return Progress::kDone;
}

void VisualOdometry::next_phase() {
  switch (phase_) {
    case Phase::kNoise: phase_ = Phase::kStereo; break;
    case Phase::kStereo:
      if (looked_again_) {
        end_second_look();
      } else {
        take_stereo();
      }
      break;
    case Phase::kMatch: begin_ransac(); break;
    case Phase::kRansac: begin_consensus(); break;
    case Phase::kConsensus:
      begin_alignment(refine_.status() == MotionStatus::kEstimated ? refine_.result().T_cur_ref
                                                                   : ransac_.result().T_cur_ref);
      break;
    case Phase::kAlign:
      if (refine_.start(params_.motion, rig_, pairs_, T_cur_ref_, true) != MotionStatus::kRunning) {
        lose(VoStatus::kNoConsensus);
      }
      phase_ = Phase::kRefine;
      break;
    case Phase::kRefine:
      if (refine_.status() == MotionStatus::kEstimated) {
        if (!align_again()) accept(refine_.result());
      } else {
        lose(VoStatus::kNoConsensus);
      }
      break;
  }
}

void VisualOdometry::take_stereo() {
  result_.features_left = stereo_.features_left();
  result_.features_right = stereo_.features_right();
  result_.stereo = stereo_.points();
  const FixedVector<Feature, cfg::kMaxFeatures>& features = current().left.result().features;
  double sum = 0.0;
  for (const Feature& f : features) sum += std::fabs(static_cast<double>(f.response));
  contrast_ = features.empty() ? 0.0 : sum / (256.0 * kStrongest * static_cast<double>(features.size()));
  if (halved_is_better() != halved()) second_look_ops_ = halved() ? 4 * spent_ops_ : spent_ops_ / 3;
  switch (stereo_.status()) {
    case StereoStatus::kPoints: break;
    case StereoStatus::kFewFeatures: return finish(VoStatus::kFewFeatures);
    case StereoStatus::kFewPoints: return finish(VoStatus::kFewStereo);
    default: return finish(VoStatus::kBadImage);
  }
  take_plane();
  if (have_reference_) return begin_match(!prediction_known_);
  renew_reference();
  finish(VoStatus::kFirstFrame);
}

void VisualOdometry::take_plane() {
  plane_ = current().plane;
  if (halved()) plane_[2] = 2.0 * plane_[2] - 0.5 * (plane_[0] + plane_[1]);
}

ImageOffset VisualOdometry::offset() const {
  ImageOffset offset = rectification().offset();
  if (halved()) {
    offset.rows_px *= 2.0;
    offset.columns_px *= 2.0;
  }
  return offset;
}

bool VisualOdometry::halved_is_better() const {
  constexpr int kLeastSide = 2 * FeatureExtractor::kLeastSide;
  if (left_image_.width < kLeastSide || left_image_.height < kLeastSide) return false;
  const double noise = noise_.noise();
  if (params_.paper_exact || noise < kLeastNoise) return false;
  const double whole2 = square(kNoiseResponse * noise);
  const double texture2 = square(contrast_) - (halved() ? 0.25 * whole2 : whole2);
  return texture2 < square(halved() ? kWhole : kHalve) * whole2;
}

void VisualOdometry::look_again() {
  first_look_ = status_;
  looked_again_ = true;
  stereo_.look(!halved());
  rig_ = stereo_.rig();
  const bool started = stereo_.start(left_image_, right_image_, current()) == StereoStatus::kRunning;
  CAIRN_ASSERT(started);
  phase_ = Phase::kStereo;
  status_ = VoStatus::kRunning;
}

/// Where it shows no more, all stays as the first look left it.
void VisualOdometry::end_second_look() {
  status_ = first_look_;
  if (stereo_.status() != StereoStatus::kPoints) {
    stereo_.look(!halved());
    rig_ = stereo_.rig();
    return;
  }
  if (!settles(first_look_)) status_ = have_reference_ ? VoStatus::kFewMatches : VoStatus::kFirstFrame;
  take_plane();
  renew_reference();
  settled_ = true;
}

void VisualOdometry::begin_match(bool wide) {
  wide_ = wide;
  const Pose3 T_cur_ref = (T_ref_prev_ * predicted_).inverse();
  const int radius = (wide ? params_.first_search_radius_px : params_.search_radius_px) / (halved() ? 2 : 1);
  const FeatureSet& ref = reference().left.result();
  const std::size_t stride = wide && !params_.paper_exact ? 2 : 1;
  windows_.clear();
  for (std::size_t i = 0; i < ref.features.size(); ++i) {
    SearchWindow w;
    const StereoPoint& point = reference().points[i];
    const Feature& f = ref.features[i];
    if (point.valid && i % stride == 0) {
      double u = f.iu;
      double v = f.iv;
      const Vec3 p = T_cur_ref * reference().point_m(rig_, i);
      if (!wide && p.z() > kMinDepth) {
        const StereoPixel px = with_lens(rig_, rectification().offset().lens, project(rig_, p));
        u = px.u_left;
        v = px.v_left;
      }
      w.u0 = clamp_to(u - radius, 0, rig_.width_px);
      w.u1 = clamp_to(u + radius, -1, rig_.width_px - 1);
      w.v0 = clamp_to(v - radius, 0, rig_.height_px);
      w.v1 = clamp_to(v + radius, -1, rig_.height_px - 1);
    }
    windows_.append(w);
  }
  match_.start(params_.match, ref, current().left.result(), windows_);
  phase_ = Phase::kMatch;
}

void VisualOdometry::begin_ransac() {
  const StereoFrame& ref = reference();
  const StereoFrame& cur = current();
  pairs_.clear();
  for (std::size_t i = 0; i < ref.points.size(); ++i) {
    const std::int16_t j = match_.partner(i);
    if (j == MatchJob::kNone || !cur.points[static_cast<std::size_t>(j)].valid) continue;
    const StereoPoint& a = ref.points[i];
    const StereoPoint& b = cur.points[static_cast<std::size_t>(j)];
    StereoPixel from = a.keypoint;
    from.u_right = from.u_left - a.d_px;
    MotionPair pair;
    pair.p_ref_m = triangulate(rig_, from);
    pair.d_ref_px = a.d_px;
    pair.seen = b.keypoint;
    pair.seen.u_right = pair.seen.u_left - b.d_px;
    pair.source = static_cast<std::uint16_t>(i);
    pairs_.append(pair);
  }
  result_.matches = static_cast<int>(pairs_.size());
  still_pairs_ = 0;
  if (!params_.paper_exact) split_still_pairs();
  const MotionStatus status = ransac_.start(params_.motion, rig_, pairs_);
  if (status != MotionStatus::kRunning) {
    if (may_search_wide()) {
      begin_match(true);
    } else {
      lose(VoStatus::kFewMatches);
    }
    return;
  }
  phase_ = Phase::kRansac;
}

/// Those that move come first, in their order; the others stay behind the end.
void VisualOdometry::split_still_pairs() {
  const auto stands = [this](const MotionPair& pair) {
    const StereoPixel before = project(rig_, pair.p_ref_m);
    return std::fabs(before.u_left - pair.seen.u_left) < kStill_px &&
           std::fabs(before.v_left - pair.seen.v_left) < kStill_px &&
           std::fabs(before.u_right - pair.seen.u_right) < kStill_px;
  };
  std::size_t still = 0;
  for (const MotionPair& pair : pairs_) still += stands(pair) ? 1U : 0U;
  const auto least = static_cast<std::size_t>(params_.motion.min_inliers);
  if (still < least || pairs_.size() - still < least) return;
  std::size_t moving = 0;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    if (stands(pairs_[i])) continue;
    const MotionPair pair = pairs_[i];
    pairs_[i] = pairs_[moving];
    pairs_[moving++] = pair;
  }
  still_pairs_ = still;
  pairs_.resize(moving);
}

void VisualOdometry::leave_out_own_points(const Pose3& T_cur_ref) {
  const std::size_t moving = pairs_.size();
  pairs_.resize(moving + still_pairs_);
  const auto is_own = [&](const MotionPair& pair) {
    const Vec3 p = T_cur_ref * pair.p_ref_m;
    if (!(p.z() > kMinDepth)) return false;
    const StereoPixel moved = project(rig_, p);
    const double du = moved.u_left - pair.seen.u_left;
    const double dv = moved.v_left - pair.seen.v_left;
    return du * du + dv * dv > kMoves_px * kMoves_px;
  };
  int own = 0;
  for (std::size_t i = moving; i < pairs_.size(); ++i) own += is_own(pairs_[i]) ? 1 : 0;
  if (own >= params_.motion.min_inliers) {
    result_.own_points = own;
    for (std::size_t i = moving; i < pairs_.size(); ++i) {
      if (is_own(pairs_[i])) reference().points[pairs_[i].source].valid = false;
    }
    reference().valid_points -= static_cast<std::size_t>(own);
  }
  pairs_.resize(moving);
}

/// Absolute orientation weighs a point at 100 m, whose depth is uncertain by metres, like one at 5 m: its
/// motion may be off by more than patches can be aligned over. The same inliers on reprojection error come to
/// within a pixel.
void VisualOdometry::begin_consensus() {
  if (ransac_.status() != MotionStatus::kEstimated && still_pairs_ > 0) {
    // What moves is no motion of the rig's: a rover that stands, and matches gone wrong.
    pairs_.resize(pairs_.size() + still_pairs_);
    still_pairs_ = 0;
    const MotionStatus again = ransac_.start(params_.motion, rig_, pairs_);
    CAIRN_ASSERT(again == MotionStatus::kRunning);
    phase_ = Phase::kRansac;
    return;
  }
  if (ransac_.status() != MotionStatus::kEstimated) {
    if (may_search_wide()) {
      begin_match(true);
    } else {
      lose(VoStatus::kNoConsensus);
    }
    return;
  }
  if (params_.paper_exact) {
    accept(ransac_.result());
    return;
  }
  leave_out_own_points(ransac_.result().T_cur_ref);
  std::size_t n = 0;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    if (ransac_.is_inlier(i)) pairs_[n++] = pairs_[i];  // packed in place
  }
  pairs_.resize(n);
  if (refine_.start(params_.motion, rig_, pairs_, ransac_.result().T_cur_ref) != MotionStatus::kRunning) {
    begin_alignment(ransac_.result().T_cur_ref);
    return;
  }
  phase_ = Phase::kConsensus;
}

void VisualOdometry::begin_alignment(const Pose3& T_cur_ref) {
  T_cur_ref_ = T_cur_ref;
  alignments_ = 0;
  start_alignment();
}

/// Of a second look's pair the motion is worth less than that look.
bool VisualOdometry::may_search_wide() const { return !wide_ && second_look_ops_ == 0; }

/// With what refining takes, by a point. The most where there is no end to the plan.
std::uint32_t VisualOdometry::affordable_points() const {
  constexpr std::uint32_t kPointOps = kTemplateOps + 2 * kAlignOps + kRefinedOps;
  const std::uint32_t taken = spent_ops_ + second_look_ops_;
  return taken < params_.plan_ops ? (params_.plan_ops - taken) / kPointOps : 0;
}

/// Evenly over all, which come by rows.
bool VisualOdometry::is_chosen(std::size_t i) const {
  const std::size_t valid = reference().valid_points;
  return most_aligned_ >= valid || (i + 1) * most_aligned_ / valid != i * most_aligned_ / valid;
}

void VisualOdometry::start_alignment() {
  const std::uint32_t affordable = affordable_points();
  most_aligned_ = affordable > kLeastAligned ? affordable : kLeastAligned;
  ++alignments_;
  pairs_.clear();
  cursor_ = 0;
  aligned_.half = false;
  phase_ = Phase::kAlign;
}

bool VisualOdometry::apart(const Pose3& T_a_ref, const Pose3& T_b_ref, double least_px) {
  const double enough2 = least_px * least_px * static_cast<double>(reference().valid_points);
  double sum2 = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < reference().points.size() && !(sum2 > enough2); ++i) {
    const StereoPoint& point = reference().points[i];
    if (!point.valid) continue;
    const Vec3 p = reference().point_m(rig_, i);
    const Vec3 a = T_a_ref * p;
    const Vec3 b = T_b_ref * p;
    if (!(a.z() > kMinDepth) || !(b.z() > kMinDepth)) continue;
    const StereoPixel pa = project(rig_, a);
    const StereoPixel pb = project(rig_, b);
    const double du = pa.u_left - pb.u_left;
    const double dv = pa.v_left - pb.v_left;
    sum2 += du * du + dv * dv;
    ++count;
  }
  return sum2 > least_px * least_px * count;
}

bool VisualOdometry::align_again() {
  constexpr int kMostAlignments = 2;
  const Pose3& refined = refine_.result().T_cur_ref;
  if (alignments_ >= kMostAlignments || affordable_points() < kLeastAligned) return false;
  if (!apart(T_cur_ref_, refined, kRealignPx)) return false;
  T_cur_ref_ = refined;
  start_alignment();
  return true;
}

bool VisualOdometry::align_left(std::size_t i) {
  const StereoFrame& ref = reference();
  const StereoPoint& point = ref.points[i];
  const Feature& f = ref.feature(i);
  const Vec3 p_cur = T_cur_ref_ * ref.point_m(rig_, i);
  if (!(p_cur.z() > kMinDepth)) return false;
  const StereoPixel predicted = project(rig_, p_cur);
  const StereoPixel expected = aligned_.expected = to_seen(rig_, rectification().offset(), predicted);
  if (stereo_.is_own(expected.u_left, expected.v_left)) return false;
  if (cut_template(ref.left.smooth(), f.iu, f.iv, aligned_.patch) != AlignStatus::kAligned) return false;

  // The warps from the template into both images: where do neighbours on the ground's plane go?
  float warp_left[4] = {kIdentity[0], kIdentity[1], kIdentity[2], kIdentity[3]};
  float* const warp_right = aligned_.warp_right;
  for (int k = 0; k < 4; ++k) warp_right[k] = kIdentity[k];
  const bool sloped = ref.on_plane(i);
  for (int axis = 0; axis < 2; ++axis) {
    constexpr double kStep = 4.0;
    const double slope = sloped ? ref.plane[axis] : 0.0;
    StereoPixel neighbour;
    neighbour.u_left = point.u_px + (axis == 0 ? kStep : 0.0);
    neighbour.v_left = neighbour.v_right = point.v_px + (axis == 1 ? kStep : 0.0);
    neighbour.u_right = neighbour.u_left - point.d_px - slope * kStep;
    if (!(neighbour.disparity_px() > 0.5)) return false;
    const Vec3 q = T_cur_ref_ * triangulate(rig_, neighbour);
    if (!(q.z() > kMinDepth)) return false;
    const StereoPixel moved = project(rig_, q);
    warp_left[axis] = static_cast<float>((moved.u_left - predicted.u_left) / kStep);
    warp_left[2 + axis] = static_cast<float>((moved.v_left - predicted.v_left) / kStep);
    warp_right[axis] = static_cast<float>((moved.u_right - predicted.u_right) / kStep);
    warp_right[2 + axis] = static_cast<float>((moved.v_right - predicted.v_right) / kStep);
  }
  aligned_.left = align(aligned_.patch, current().left.smooth(), static_cast<float>(expected.u_left),
                        static_cast<float>(expected.v_left), warp_left, params_.align);
  return aligned_.left.status == AlignStatus::kAligned;
}

/// What of the patch looks otherwise now, a rock's side or the rim of its shadow above all, has moved
/// otherwise: the more of it, the less the point says. Such patches are those of much contrast, and what
/// interpolation blurs of any patch is a share of its contrast: that counts a little, too, up to the mean.
/// It is a bias, not noise: all points of a kind lean one way, so that they count by the square. All in the
/// reference's mean contrast: what is much on lunar soil is little on a road.
float VisualOdometry::weight_of(float correlation) const {
  const float contrast = aligned_.patch.variance / reference().patch_variance;
  const float unlike = std::fabs(1.0F - correlation * correlation) * contrast;
  const float doubt = kLeastDoubt + kContrast * (contrast < 1.0F ? contrast : 1.0F) + unlike;
  return 1.0F / (doubt * doubt);
}

void VisualOdometry::align_right(std::size_t i) {
  const Alignment& l = aligned_.left;
  const ImageOffset& offset = rectification().offset();
  const Alignment r =
      align(aligned_.patch, stereo_.right().smooth(), static_cast<float>(aligned_.expected.u_right),
            static_cast<float>(aligned_.expected.v_right), aligned_.warp_right, params_.align);
  if (r.status != AlignStatus::kAligned) return;
  if (std::fabs(r.v - static_cast<float>(offset.rows_px) - l.v) > kMaxRowOffset_px) return;
  MotionPair pair;
  pair.p_ref_m = reference().point_m(rig_, i);
  pair.d_ref_px = reference().points[i].d_px;
  pair.seen = sampson_correct(rectification().correct({l.u, l.v, r.u, r.v}));
  pair.source = static_cast<std::uint16_t>(i);
  pair.weight = weight_of(l.correlation < r.correlation ? l.correlation : r.correlation);
  if (!(pair.seen.disparity_px() > 0.5)) return;
  pairs_.append(pair);
}

void VisualOdometry::accept(const MotionResult& motion) {
  result_.inliers = motion.inliers;
  result_.rms_px = motion.rms_px;
  result_.covariance = motion.covariance;
  const Pose3 T_ref_cur = motion.T_cur_ref.inverse();
  const Pose3 T_prev_cur = T_ref_prev_.inverse() * T_ref_cur;
  result_.frames = elapsed_;
  const int others = result_.matches - result_.own_points;
  reference_own_points_ += result_.own_points;
  result_.own_points = reference_own_points_;
  result_.mostly_own = reference_own_points_ > others;
  const Pose3 step_rover = rig_.T_rover_cam * T_prev_cur * rig_.T_rover_cam.inverse();
  if (!(step_rover.t.norm() <= params_.max_step_m * elapsed_) ||
      !(quat_log(T_prev_cur.q).norm() <= params_.max_step_rad * elapsed_)) {
    lose(VoStatus::kImplausible);
    return;
  }
  stereo_.rectification().observe_motion(motion.rig);
  result_.T_prev_cur = T_prev_cur;
  last_step_ = elapsed_ == 1 ? T_prev_cur : share_of(T_prev_cur, 1.0 / elapsed_);
  motion_known_ = true;
  T_ref_prev_ = T_ref_cur;
  ++reference_age_;
  const auto share = static_cast<double>(motion.inliers) / static_cast<double>(reference().valid_points);
  // A rover that stands does not drift.
  const bool old = reference_age_ >= params_.max_reference_age &&
                   (params_.paper_exact || apart(Pose3(), motion.T_cur_ref, kStill_px));
  if (old || share < params_.min_reference_share) renew_reference();
  finish(VoStatus::kMotion);
}

void VisualOdometry::renew_reference() {
  reference_ = 1 - reference_;
  have_reference_ = true;
  reference_age_ = 0;
  reference_own_points_ = 0;
  T_ref_prev_ = Pose3();
  result_.reference_renewed = true;
}

void VisualOdometry::lose(VoStatus status) {
  renew_reference();
  finish(status);
}

void VisualOdometry::finish(VoStatus status) {
  const ImageOffset before = rectification().offset();
  stereo_.end_frame();
  // The next motion takes one estimate for both of its frames.
  const ImageOffset& now = rectification().offset();
  const bool bent = now.columns_px != before.columns_px || now.lens != before.lens;
  if (have_reference_ && bent) reference().correct(rectification(), before);
  status_ = status;
  settled_ = settles(status);
  if (halved_is_better() != halved()) look_again();
}

}  // namespace cairn
