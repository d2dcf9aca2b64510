#include "localizer/visual_odometry.hpp"

#include <cmath>

namespace cairn {
namespace {

constexpr int kPlaneIterations = 8;
constexpr float kMaxRowOffset = 1.5F;  // of a refined match, px: beyond it the rig is not rectified
constexpr double kRealignPx = 0.75;    // mean square shift of the predictions that asks for another alignment
constexpr double kMinDepth = 0.05;
constexpr float kIdentity[4] = {1.0F, 0.0F, 0.0F, 1.0F};

std::int16_t clamp_to(double v, int low, int high) {
  if (!(v > low)) return static_cast<std::int16_t>(low);
  return static_cast<std::int16_t>(v < high ? v : high);
}

/// Does the ground's plane hold at this point? A boulder or a hole keeps the frontal model.
bool on_plane(const Vec3& plane, const Feature& f, double d_px) {
  const double off = d_px - (plane[0] * f.iu + plane[1] * f.iv + plane[2]);
  return std::fabs(off) < 0.5 + 0.03 * d_px;
}

Vec3 reference_point(const StereoRig& rig, const Feature& f, const StereoPoint& p) {
  StereoPixel px;
  px.u_left = f.iu;
  px.v_left = px.v_right = p.v_px;
  px.u_right = f.iu - p.d_px;
  return triangulate(rig, px);
}

}  // namespace

bool VisualOdometry::init(const VoParams& params, const StereoRig& rig) {
  status_ = VoStatus::kIdle;
  have_reference_ = motion_known_ = false;
  T_ref_prev_ = predicted_step_ = T_cur_ref_ = Pose3();
  params_ = params;
  rig_ = rig;
  rectification_.init(params.rectification, rig);
  return is_valid(rig) && rig.width_px <= cfg::kImageWidth && rig.height_px <= cfg::kImageHeight;
}

VoStatus VisualOdometry::start(const ImageU8& left, const ImageU8& right, const Pose3* motion_prior) {
  result_ = {};
  cursor_ = 0;
  phase_ = Phase::kLeft;
  right_image_ = right;
  if (motion_prior != nullptr) {
    if (is_valid(*motion_prior)) {
      predicted_step_ = *motion_prior;
      motion_known_ = true;
    } else {
      ++bad_priors_;
    }
  }
  const bool sizes_fit = left.width == rig_.width_px && left.height == rig_.height_px &&
                         right.width == rig_.width_px && right.height == rig_.height_px &&
                         right.data != nullptr;
  if (!sizes_fit || current().left.start(left) != ExtractStatus::kRunning)
    return status_ = VoStatus::kBadImage;
  return status_ = VoStatus::kRunning;
}

Progress VisualOdometry::step(WorkBudget& budget) {
  while (status_ == VoStatus::kRunning) {
    if (!run_phase(budget)) return Progress::kMore;
  }
  return Progress::kDone;
}

bool VisualOdometry::run_phase(WorkBudget& budget) {
  Frame& frame = current();
  switch (phase_) {
    case Phase::kLeft:
      if (frame.left.step(budget) == Progress::kMore) return false;
      if (right_.start(right_image_) != ExtractStatus::kRunning) {
        finish(VoStatus::kBadImage);
        return true;
      }
      phase_ = Phase::kRight;
      return true;
    case Phase::kRight:
      if (right_.step(budget) == Progress::kMore) return false;
      begin_stereo_match();
      return true;
    case Phase::kStereoMatch:
      if (match_.step(budget) == Progress::kMore) return false;
      collect_stereo();
      return true;
    case Phase::kPlane:
      if (!budget.take(kPlaneIterations * 20U * static_cast<std::uint32_t>(frame.points.size() + 1)))
        return false;
      fit_plane();
      return true;
    case Phase::kStereoRefine:
      for (; cursor_ < frame.points.size(); ++cursor_) {
        if (!frame.points[cursor_].valid) continue;
        if (!budget.take(kTemplateOps + kAlignOps)) return false;
        refine_point(cursor_);
      }
      begin_match(!motion_known_);
      return true;
    case Phase::kMatch:
      if (match_.step(budget) == Progress::kMore) return false;
      begin_ransac();
      return true;
    case Phase::kRansac:
      if (ransac_.step(budget) == Progress::kMore) return false;
      begin_consensus();
      return true;
    case Phase::kConsensus:
      if (refine_.step(budget) == Progress::kMore) return false;
      begin_alignment(refine_.status() == MotionStatus::kEstimated ? refine_.result().T_cur_ref
                                                                   : ransac_.result().T_cur_ref);
      return true;
    case Phase::kAlign:
      for (; cursor_ < reference().points.size(); ++cursor_) {
        if (!reference().points[cursor_].valid) continue;
        if (!budget.take(kTemplateOps + 2U * kAlignOps)) return false;
        align_point(cursor_);
      }
      if (refine_.start(params_.motion, rig_, pairs_, T_cur_ref_) != MotionStatus::kRunning) {
        lose(VoStatus::kNoConsensus);
      }
      phase_ = Phase::kRefine;
      return true;
    case Phase::kRefine:
      if (refine_.step(budget) == Progress::kMore) return false;
      if (refine_.status() == MotionStatus::kEstimated) {
        if (!align_again()) accept(refine_.result());
      } else {
        lose(VoStatus::kNoConsensus);
      }
      return true;
  }
  return true;
}

void VisualOdometry::begin_stereo_match() {
  const FeatureSet& left = current().left.result();
  result_.features_left = static_cast<int>(left.features.size());
  result_.features_right = static_cast<int>(right_.result().features.size());
  if (current().left.status() != ExtractStatus::kFeatures || right_.status() != ExtractStatus::kFeatures) {
    finish(VoStatus::kFewFeatures);
    return;
  }
  windows_.clear();
  for (const Feature& f : left.features) {
    SearchWindow w;
    w.u0 = static_cast<std::int16_t>(f.iu - params_.max_disparity_px);
    w.u1 = static_cast<std::int16_t>(f.iu - params_.min_disparity_px);
    w.v0 = static_cast<std::int16_t>(f.iv - params_.epipolar_band_px);
    w.v1 = static_cast<std::int16_t>(f.iv + params_.epipolar_band_px);
    const bool fits = windows_.push_back(w);
    CAIRN_ASSERT(fits);
  }
  match_.start(params_.match, left, right_.result(), windows_);
  phase_ = Phase::kStereoMatch;
}

void VisualOdometry::collect_stereo() {
  Frame& frame = current();
  const FeatureSet& left = frame.left.result();
  frame.points.clear();
  std::size_t count = 0;
  for (std::size_t i = 0; i < left.features.size(); ++i) {
    StereoPoint point;
    const std::int16_t j = match_.partner(i);
    if (j != MatchJob::kNone) {
      const Feature& l = left.features[i];
      const Feature& r = right_.result().features[static_cast<std::size_t>(j)];
      point.keypoint = sampson_correct({l.u, l.v, r.u, r.v});
      point.d_px = point.keypoint.disparity_px();
      point.v_px = point.keypoint.v_left;
      point.valid = point.d_px >= params_.min_disparity_px;
      count += point.valid ? 1U : 0U;
    }
    const bool fits = frame.points.push_back(point);
    CAIRN_ASSERT(fits);
  }
  if (count < static_cast<std::size_t>(params_.motion.min_inliers)) {
    result_.stereo = static_cast<int>(count);
    finish(VoStatus::kFewStereo);
    return;
  }
  phase_ = Phase::kPlane;
}

void VisualOdometry::fit_plane() {
  Frame& frame = current();
  const double cu = 0.5 * rig_.width_px;
  const double cv = 0.5 * rig_.height_px;
  Vec3 plane(0.0, 0.0, 0.0);  // about the image centre, slopes per half width
  for (int iteration = 0; iteration < kPlaneIterations; ++iteration) {
    Mat3 A = Mat3::Identity() * 1.0e-9;
    Vec3 b(0.0, 0.0, 0.0);
    for (std::size_t i = 0; i < frame.points.size(); ++i) {
      const StereoPoint& p = frame.points[i];
      if (!p.valid) continue;
      const Vec3 x((p.keypoint.u_left - cu) / cu, (p.keypoint.v_left - cv) / cu, 1.0);
      const double r = p.d_px - plane.dot(x);
      const double w = iteration == 0 ? 1.0 : 1.0 / (1.0 + r * r);
      A.noalias() += w * x * x.transpose();
      b += (w * p.d_px) * x;
    }
    const Eigen::LDLT<Mat3> ldlt(A);
    plane = ldlt.solve(b);
  }
  frame.plane = Vec3(plane[0] / cu, plane[1] / cu, plane[2] - (plane[0] * cu + plane[1] * cv) / cu);
  plane_ = frame.plane;
  cursor_ = 0;
  frame.valid_points = 0;
  phase_ = Phase::kStereoRefine;
}

void VisualOdometry::refine_point(std::size_t i) {
  Frame& frame = current();
  StereoPoint& point = frame.points[i];
  const Feature& f = frame.left.result().features[i];
  if (params_.paper_exact) {
    ++frame.valid_points;
    return;
  }
  point.valid = false;
  PatchTemplate patch;
  if (cut_template(frame.left.smooth(), f.iu, f.iv, patch) != AlignStatus::kAligned) return;
  const bool sloped = on_plane(frame.plane, f, point.d_px);
  const float warp[4] = {sloped ? static_cast<float>(1.0 - frame.plane[0]) : 1.0F,
                         sloped ? static_cast<float>(-frame.plane[1]) : 0.0F, 0.0F, 1.0F};
  const Alignment a =
      align(patch, right_.smooth(), static_cast<float>(f.iu - point.d_px), f.iv, warp, params_.align);
  if (a.status != AlignStatus::kAligned) return;
  const StereoPixel measured = {static_cast<double>(f.iu), static_cast<double>(f.iv), a.u, a.v};
  rectification_.observe(measured);
  const StereoPixel px = sampson_correct(rectification_.correct(measured));
  if (std::fabs(a.v - static_cast<float>(f.iv)) > kMaxRowOffset ||
      px.disparity_px() < params_.min_disparity_px)
    return;
  point.d_px = px.disparity_px();
  point.v_px = px.v_left;
  point.valid = true;
  ++frame.valid_points;
}

void VisualOdometry::begin_match(bool wide) {
  result_.stereo = static_cast<int>(current().valid_points);
  const double least = params_.min_stereo_share * result_.features_left;
  if (result_.stereo < params_.motion.min_inliers || result_.stereo < least) {
    finish(VoStatus::kFewStereo);
    return;
  }
  if (!have_reference_) {
    renew_reference();
    finish(VoStatus::kFirstFrame);
    return;
  }
  wide_ = wide;
  const Pose3 T_cur_ref = (T_ref_prev_ * predicted_step_).inverse();
  const int radius = wide ? params_.first_search_radius_px : params_.search_radius_px;
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
      const Vec3 p = T_cur_ref * reference_point(rig_, f, point);
      if (!wide && p.z() > kMinDepth) {
        const StereoPixel px = project(rig_, p);
        u = px.u_left;
        v = px.v_left;
      }
      w.u0 = clamp_to(u - radius, 0, rig_.width_px);
      w.u1 = clamp_to(u + radius, -1, rig_.width_px - 1);
      w.v0 = clamp_to(v - radius, 0, rig_.height_px);
      w.v1 = clamp_to(v + radius, -1, rig_.height_px - 1);
    }
    const bool fits = windows_.push_back(w);
    CAIRN_ASSERT(fits);
  }
  match_.start(params_.match, ref, current().left.result(), windows_);
  phase_ = Phase::kMatch;
}

void VisualOdometry::begin_ransac() {
  const Frame& ref = reference();
  const Frame& cur = current();
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
    const bool fits = pairs_.push_back(pair);
    CAIRN_ASSERT(fits);
  }
  result_.matches = static_cast<int>(pairs_.size());
  const MotionStatus status = ransac_.start(params_.motion, rig_, pairs_);
  if (status != MotionStatus::kRunning) {
    if (!wide_) {
      begin_match(true);
    } else {
      lose(VoStatus::kFewMatches);
    }
    return;
  }
  phase_ = Phase::kRansac;
}

/// Absolute orientation weighs a point at 100 m, whose depth is uncertain by metres, like one at 5 m: its
/// motion may be off by more than patches can be aligned over. The same inliers on reprojection error come to
/// within a pixel.
void VisualOdometry::begin_consensus() {
  if (ransac_.status() != MotionStatus::kEstimated) {
    if (!wide_) {
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

void VisualOdometry::start_alignment() {
  ++alignments_;
  pairs_.clear();
  cursor_ = 0;
  phase_ = Phase::kAlign;
}

bool VisualOdometry::align_again() {
  constexpr int kMostAlignments = 2;
  if (alignments_ >= kMostAlignments) return false;
  const Pose3& refined = refine_.result().T_cur_ref;
  double sum2 = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < reference().points.size(); ++i) {
    const StereoPoint& point = reference().points[i];
    if (!point.valid) continue;
    const Vec3 p = reference_point(rig_, reference().left.result().features[i], point);
    const Vec3 a = T_cur_ref_ * p;
    const Vec3 b = refined * p;
    if (!(a.z() > kMinDepth) || !(b.z() > kMinDepth)) continue;
    const StereoPixel pa = project(rig_, a);
    const StereoPixel pb = project(rig_, b);
    const double du = pa.u_left - pb.u_left;
    const double dv = pa.v_left - pb.v_left;
    sum2 += du * du + dv * dv;
    ++count;
  }
  if (sum2 <= kRealignPx * kRealignPx * count) return false;
  T_cur_ref_ = refined;
  start_alignment();
  return true;
}

void VisualOdometry::align_point(std::size_t i) {
  const Frame& ref = reference();
  const StereoPoint& point = ref.points[i];
  const Feature& f = ref.left.result().features[i];
  const Vec3 p_ref = reference_point(rig_, f, point);
  const Vec3 p_cur = T_cur_ref_ * p_ref;
  if (!(p_cur.z() > kMinDepth)) return;
  const StereoPixel predicted = project(rig_, p_cur);
  PatchTemplate patch;
  if (cut_template(ref.left.smooth(), f.iu, f.iv, patch) != AlignStatus::kAligned) return;

  // The warps from the template into both images: where do neighbours on the ground's plane go?
  float warp_left[4] = {kIdentity[0], kIdentity[1], kIdentity[2], kIdentity[3]};
  float warp_right[4] = {kIdentity[0], kIdentity[1], kIdentity[2], kIdentity[3]};
  const bool sloped = on_plane(ref.plane, f, point.d_px);
  for (int axis = 0; axis < 2; ++axis) {
    constexpr double kStep = 4.0;
    const double slope = sloped ? ref.plane[axis] : 0.0;
    StereoPixel neighbour;
    neighbour.u_left = f.iu + (axis == 0 ? kStep : 0.0);
    neighbour.v_left = neighbour.v_right = point.v_px + (axis == 1 ? kStep : 0.0);
    neighbour.u_right = neighbour.u_left - point.d_px - slope * kStep;
    if (!(neighbour.disparity_px() > 0.5)) return;
    const Vec3 q = T_cur_ref_ * triangulate(rig_, neighbour);
    if (!(q.z() > kMinDepth)) return;
    const StereoPixel moved = project(rig_, q);
    warp_left[axis] = static_cast<float>((moved.u_left - predicted.u_left) / kStep);
    warp_left[2 + axis] = static_cast<float>((moved.v_left - predicted.v_left) / kStep);
    warp_right[axis] = static_cast<float>((moved.u_right - predicted.u_right) / kStep);
    warp_right[2 + axis] = static_cast<float>((moved.v_right - predicted.v_right) / kStep);
  }
  const Alignment l = align(patch, current().left.smooth(), static_cast<float>(predicted.u_left),
                            static_cast<float>(predicted.v_left), warp_left, params_.align);
  if (l.status != AlignStatus::kAligned) return;
  const Alignment r = align(patch, right_.smooth(), static_cast<float>(predicted.u_right),
                            static_cast<float>(predicted.v_right), warp_right, params_.align);
  if (r.status != AlignStatus::kAligned || std::fabs(r.v - l.v) > kMaxRowOffset) return;
  MotionPair pair;
  pair.p_ref_m = p_ref;
  pair.d_ref_px = point.d_px;
  pair.seen = sampson_correct(rectification_.correct({l.u, l.v, r.u, r.v}));
  pair.source = static_cast<std::uint16_t>(i);
  if (!(pair.seen.disparity_px() > 0.5)) return;
  const bool fits = pairs_.push_back(pair);
  CAIRN_ASSERT(fits);
}

void VisualOdometry::accept(const MotionResult& motion) {
  result_.inliers = motion.inliers;
  result_.rms_px = motion.rms_px;
  result_.covariance = motion.covariance;
  const Pose3 T_ref_cur = motion.T_cur_ref.inverse();
  const Pose3 T_prev_cur = T_ref_prev_.inverse() * T_ref_cur;
  if (!(T_prev_cur.t.norm() <= params_.max_step_m) ||
      !(quat_log(T_prev_cur.q).norm() <= params_.max_step_rad)) {
    lose(VoStatus::kImplausible);
    return;
  }
  result_.T_prev_cur = T_prev_cur;
  predicted_step_ = T_prev_cur;
  motion_known_ = true;
  T_ref_prev_ = T_ref_cur;
  ++reference_age_;
  const auto share = static_cast<double>(motion.inliers) / static_cast<double>(reference().valid_points);
  if (reference_age_ >= params_.max_reference_age || share < params_.min_reference_share) renew_reference();
  finish(VoStatus::kMotion);
}

void VisualOdometry::renew_reference() {
  reference_ = 1 - reference_;
  have_reference_ = true;
  reference_age_ = 0;
  T_ref_prev_ = Pose3();
  result_.reference_renewed = true;
}

void VisualOdometry::lose(VoStatus status) {
  renew_reference();
  finish(status);
}

void VisualOdometry::finish(VoStatus status) {
  rectification_.end_frame();
  status_ = status;
}

}  // namespace cairn
