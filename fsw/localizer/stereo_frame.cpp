#include "localizer/stereo_frame.hpp"

#include <cmath>

#include "core/factors.hpp"
#include "core/rounding.hpp"
#include "features/sift_descriptor.hpp"

namespace cairn {
namespace {

constexpr std::size_t kPlaneIterations = 8;
constexpr int kMostSearches = 8;        // of rows, in pairs: what never shows is not looked for for good
constexpr int kMostSearchRows = 16;     // up and down
constexpr double kLeastRows_px = 0.25;  // as keypoints tell them
constexpr int kFewPoints = 150;         // rivals must have descriptors, too
constexpr double kOnRow_px = 0.5;
constexpr double kRowBias = 1.0 / 6.0;  // w^2 / 6
constexpr int kRowsSigma = 4;
constexpr double kFoundShare = 0.3;  // of the features, in three neighbouring rows: good images have 60 %

/// What linear interpolation adds to the row of the right image that a whole row's template is found at. At a
/// part f of a pixel it moves a wave of w radians a pixel too little, so that the place is read
/// w^2/6 f (1 - f) (1 - 2 f) too far from the nearer row (the phase to third order; w = 1: camera images).
/// In later frames f is any, and the bias has no mean. In a reference f is what the two rows are off by: it
/// is the same in each, and a camera that is rolled a little would roll the pose a little at each.
float row_bias(float row_px) {
  const double row = row_px;
  const double e = row - rounded(row);
  const double out = std::fabs(e);
  return static_cast<float>(kRowBias * e * (1.0 - out) * (1.0 - 2.0 * out));
}

}  // namespace

Vec3 StereoFrame::point_m(const StereoRig& rig, std::size_t i) const {
  StereoPixel px;
  px.u_left = points[i].u_px;
  px.v_left = px.v_right = points[i].v_px;
  px.u_right = px.u_left - points[i].d_px;
  return triangulate(rig, px);
}

bool StereoFrame::on_plane(std::size_t i) const {
  const Feature& f = feature(i);
  const double d_px = points[i].d_px;
  const double off = d_px - (plane[0] * f.iu + plane[1] * f.iv + plane[2]);
  return std::fabs(off) < 0.5 + 0.03 * d_px;
}

void StereoPoint::take(const StereoPixel& corrected) {
  const StereoPixel px = sampson_correct(corrected);
  d_px = px.disparity_px();
  u_px = px.u_left;
  v_px = px.v_left;
}

void StereoFrame::correct(const RectificationEstimator& rectification, const ImageOffset& before) {
  plane[2] += rectification.offset().columns_px - before.columns_px;
  for (std::size_t i = 0; i < points.size(); ++i) {
    StereoPoint& point = points[i];
    if (!point.valid) continue;
    const Feature& f = feature(i);
    point.take(rectification.correct(
        {static_cast<double>(f.iu), static_cast<double>(f.iv), point.found_u_px, point.found_v_px}));
    if (point.d_px > 0.5) continue;
    point.valid = false;
    --valid_points;
  }
}

void StereoFrameJob::init(const StereoFrameParams& params, const StereoRig& rig, int min_points) {
  params_ = params;
  whole_rig_ = rig_ = rig;
  halved_ = false;
  min_disparity_px_ = params.min_disparity_px;
  max_disparity_px_ = params.max_disparity_px;
  min_points_ = min_points;
  status_ = StereoStatus::kIdle;
  RectificationParams rest = params.rectification;
  rest.enabled = rest.enabled && !params.paper_exact;
  rectification_.init(rest, rig);
  searches_left_ = rest.enabled ? kMostSearches : 0;
}

void StereoFrameJob::look(bool halved) {
  if (halved == halved_) return;
  halved_ = halved;
  rig_ = halved ? cairn::halved(whole_rig_) : whole_rig_;
  min_disparity_px_ = halved ? (params_.min_disparity_px + 1) / 2 : params_.min_disparity_px;
  max_disparity_px_ = halved ? (params_.max_disparity_px + 1) / 2 : params_.max_disparity_px;
  rectification_.rescale(rig_, halved ? 0.5 : 2.0);
}

bool StereoFrameJob::is_own(double u, double v) const {
  return halved_ ? params_.own.covers(from_halved(u), from_halved(v)) : params_.own.covers(u, v);
}

StereoStatus StereoFrameJob::start(const ImageU8& left, const ImageU8& right, StereoFrame& frame) {
  cursor_ = 0;
  phase_ = Phase::kLeft;
  worked_ = false;
  features_left_ = features_right_ = points_ = 0;
  aligned_ = on_row_ = 0;
  wide_ = searched_ = false;
  right_image_ = right;
  frame_ = &frame;
  const auto fits = [this](const ImageU8& image) {
    return image.data != nullptr && image.width == whole_rig_.width_px &&
           image.height == whole_rig_.height_px;
  };
  const bool started = fits(left) && fits(right) &&
                       frame.left.start(left, halved_, params_.paper_exact) == ExtractStatus::kRunning;
  return status_ = started ? StereoStatus::kRunning : StereoStatus::kBadImage;
}

Progress StereoFrameJob::step(WorkBudget& budget) {
  while (status_ == StereoStatus::kRunning) {
    if (!run_phase(budget)) return Progress::kMore;
  }
  return Progress::kDone;
}

bool StereoFrameJob::run_phase(WorkBudget& budget) {
  if (!worked_ && work(budget) == Progress::kMore) return false;
  worked_ = true;
  if (!budget.take(kOverPointsOps)) return false;
  worked_ = false;
  next_phase();
  return true;
}

Progress StereoFrameJob::work(WorkBudget& budget) {
  const FixedVector<StereoPoint, cfg::kMaxFeatures>& points = frame_->points;
  switch (phase_) {
    case Phase::kLeft: return frame_->left.step(budget);
    case Phase::kRight: return right_.step(budget);
    case Phase::kMatch: return match_.step(budget);
    case Phase::kPlane:
      for (; cursor_ < kPlaneIterations; ++cursor_) {
        if (!budget.take(plane_ops(points.size()))) return Progress::kMore;
        fit_plane(cursor_ == 0);
      }
      break;
    case Phase::kRefine:
      for (; cursor_ < points.size(); ++cursor_) {
        if (!points[cursor_].valid) continue;
        if (!budget.take(kTemplateOps + kAlignOps)) return Progress::kMore;
        refine_point(cursor_);
      }
      break;
    case Phase::kDescribe:
      for (; cursor_ < points.size(); ++cursor_) {
        if (!points[cursor_].valid && !describe_all_) continue;
        if (!budget.take(kDescriptorOps)) return Progress::kMore;
        frame_->left.describe(cursor_);
      }
      break;
  }
  return Progress::kDone;
}

void StereoFrameJob::next_phase() {
  switch (phase_) {
    case Phase::kLeft:
      if (right_.start(right_image_, halved_, params_.paper_exact) != ExtractStatus::kRunning)
        status_ = StereoStatus::kBadImage;
      phase_ = Phase::kRight;
      break;
    case Phase::kRight: begin_match(); break;
    case Phase::kMatch:
      if (!search_rows()) collect();
      break;
    case Phase::kPlane: take_plane(); break;
    case Phase::kRefine: count_points(); break;
    case Phase::kDescribe: status_ = StereoStatus::kPoints; break;
  }
}

void StereoFrameJob::begin_match() {
  const FeatureSet& left = frame_->left.result();
  features_left_ = static_cast<int>(left.features.size());
  features_right_ = static_cast<int>(right_.result().features.size());
  if (frame_->left.status() != ExtractStatus::kFeatures || right_.status() != ExtractStatus::kFeatures) {
    status_ = StereoStatus::kFewFeatures;
    return;
  }
  windows_.clear();
  const int band = wide_ ? params_.search_band_px : params_.epipolar_band_px;
  const int columns = rounded(rectification_.offset().columns_px);
  const int rows = rounded(rectification_.offset().rows_px);
  for (const Feature& f : left.features) {
    SearchWindow w;
    w.u0 = static_cast<std::int16_t>(f.iu - max_disparity_px_ + columns);
    w.u1 = static_cast<std::int16_t>(f.iu - min_disparity_px_ + columns);
    w.v0 = static_cast<std::int16_t>(f.iv - band + rows);
    w.v1 = static_cast<std::int16_t>(f.iv + band + rows);
    windows_.append(w);
  }
  if (params_.paper_exact) {
    match_.start(params_.match, left, right_.result(), windows_);
  } else {
    match_.start(params_.match_patches, left, right_.result(), windows_, frame_->left.smooth(),
                 right_.smooth());
  }
  phase_ = Phase::kMatch;
}

/// The three neighbouring rows that hold most of the matches: their mean is where the right image lies. Where
/// the narrow band holds too few, the wide one is tried, and what that finds is matched in the narrow one.
/// True where the pair is matched once more.
bool StereoFrameJob::search_rows() {
  if (searches_left_ == 0 || searched_) return false;
  const FeatureSet& left = frame_->left.result();
  int count[2 * kMostSearchRows + 1] = {};
  double sum[2 * kMostSearchRows + 1] = {};
  int all = 0;
  for (std::size_t i = 0; i < left.features.size(); ++i) {
    const std::int16_t j = match_.partner(i);
    if (j == MatchJob::kNone) continue;
    const double dv = static_cast<double>(right_.result().features[static_cast<std::size_t>(j)].v) -
                      static_cast<double>(left.features[i].v);
    const int row = rounded(dv) + kMostSearchRows;
    ++all;
    if (row < 0 || row > 2 * kMostSearchRows) continue;
    ++count[row];
    sum[row] += dv;
  }
  int best = 1;
  const auto near = [&count](int k) { return count[k - 1] + count[k] + count[k + 1]; };
  for (int k = 2; k < 2 * kMostSearchRows; ++k) {
    if (near(k) > near(best)) best = k;
  }
  const bool enough =
      near(best) >= min_points_ && near(best) >= (wide_ ? 0.5 * all : kFoundShare * features_left_);
  if (enough) {
    const double rows_px = (sum[best - 1] + sum[best] + sum[best + 1]) / near(best);
    if (std::fabs(rows_px) > kLeastRows_px) rectification_.set_rows(rows_px);
    searches_left_ = 0;
  }
  if (enough && !wide_) return false;
  searched_ = wide_;
  if (wide_ && !enough) --searches_left_;
  wide_ = !wide_;
  begin_match();
  return true;
}

void StereoFrameJob::collect() {
  const FeatureSet& left = frame_->left.result();
  frame_->points.clear();
  for (std::size_t i = 0; i < left.features.size(); ++i) {
    StereoPoint point;
    const bool own = is_own(left.features[i].u, left.features[i].v);
    const std::int16_t j = match_.partner(i);
    if (j != MatchJob::kNone) {
      const Feature& l = left.features[i];
      const Feature& r = right_.result().features[static_cast<std::size_t>(j)];
      const ImageOffset& offset = rectification_.offset();
      point.keypoint = sampson_correct(to_ideal(rig_, offset, {l.u, l.v, r.u, r.v}));
      point.d_px = point.keypoint.disparity_px();
      point.u_px = l.iu;  // of what follows keypoints alone
      point.v_px = point.keypoint.v_left;
      point.valid = point.d_px >= min_disparity_px_ && !own;
      points_ += point.valid ? 1 : 0;
    }
    frame_->points.append(point);
  }
  if (points_ < min_points_) {
    status_ = StereoStatus::kFewPoints;
    return;
  }
  phase_ = Phase::kPlane;
  cursor_ = 0;
  plane_ = Vec3(0.0, 0.0, 0.0);
}

/// One iteration, from the plane before.
void StereoFrameJob::fit_plane(bool first) {
  const double cu = 0.5 * rig_.width_px;
  const double cv = 0.5 * rig_.height_px;
  Mat3 A = Mat3::Identity() * 1.0e-9;
  Vec3 b(0.0, 0.0, 0.0);
  for (const StereoPoint& p : frame_->points) {
    if (!p.valid) continue;
    const Vec3 x((p.keypoint.u_left - cu) / cu, (p.keypoint.v_left - cv) / cu, 1.0);
    const double r = p.d_px - plane_.dot(x);
    const double w = first ? 1.0 : 1.0 / (1.0 + r * r);
    A.noalias() += w * x * x.transpose();
    b += (w * p.d_px) * x;
  }
  plane_ = Factors(A).solve(b);
}

void StereoFrameJob::take_plane() {
  const double cu = 0.5 * rig_.width_px;
  const double cv = 0.5 * rig_.height_px;
  frame_->plane = Vec3(plane_[0] / cu, plane_[1] / cu, plane_[2] - (plane_[0] * cu + plane_[1] * cv) / cu);
  frame_->valid_points = 0;
  frame_->patch_variance = 0.0F;
  cursor_ = 0;
  phase_ = Phase::kRefine;
}

void StereoFrameJob::refine_point(std::size_t i) {
  StereoPoint& point = frame_->points[i];
  const Feature& f = frame_->feature(i);
  if (params_.paper_exact) {
    ++frame_->valid_points;
    return;
  }
  point.valid = false;
  PatchTemplate patch;
  if (cut_template(frame_->left.smooth(), f.iu, f.iv, patch) != AlignStatus::kAligned) return;
  const bool sloped = frame_->on_plane(i);
  const float warp[4] = {sloped ? static_cast<float>(1.0 - frame_->plane[0]) : 1.0F,
                         sloped ? static_cast<float>(-frame_->plane[1]) : 0.0F, 0.0F, 1.0F};
  const ImageOffset& offset = rectification_.offset();
  const double u = f.iu;
  const double v = f.iv;
  StereoPixel guess = without_lens(rig_, offset.lens, {u, v, u, v});
  guess.u_right = guess.u_left - point.d_px;
  guess = to_seen(rig_, offset, guess);
  const Alignment a = align(patch, right_.smooth(), static_cast<float>(guess.u_right),
                            static_cast<float>(guess.v_right), warp, params_.align);
  if (a.status != AlignStatus::kAligned) return;
  point.found_u_px = a.u;
  point.found_v_px = a.v - row_bias(a.v);
  const StereoPixel measured = {u, v, point.found_u_px, point.found_v_px};
  rectification_.observe(measured);
  const StereoPixel corrected = rectification_.correct(measured);
  ++aligned_;
  if (!(std::fabs(corrected.v_right - corrected.v_left) <= kOnRow_px)) return;
  ++on_row_;
  point.take(corrected);
  if (point.d_px < min_disparity_px_) return;
  point.valid = true;
  frame_->patch_variance += patch.variance;
  ++frame_->valid_points;
}

/// By chance, up to half of what is found lies on its row (a right image of another time, 0.06 m away; of
/// sides that are swapped a third): an excess over that of so many sigmas is no chance.
bool StereoFrameJob::rows_agree() const {
  const int excess = 2 * on_row_ - aligned_;
  return excess > 0 && excess * excess >= kRowsSigma * kRowsSigma * aligned_;
}

void StereoFrameJob::count_points() {
  points_ = static_cast<int>(frame_->valid_points);
  if (points_ > 0) frame_->patch_variance /= static_cast<float>(points_);
  const bool good = points_ >= min_points_ && (params_.paper_exact || rows_agree());
  if (!good) status_ = StereoStatus::kFewPoints;
  describe_all_ = points_ < kFewPoints;
  phase_ = Phase::kDescribe;
  cursor_ = 0;
}

}  // namespace cairn
