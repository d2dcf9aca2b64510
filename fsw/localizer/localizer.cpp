#include "localizer/localizer.hpp"

#include <cmath>

namespace cairn {
namespace {

FixStatus fix_status(IcpStatus status) {
  switch (status) {
    case IcpStatus::kConverged: return FixStatus::kApplied;
    case IcpStatus::kIterationLimit: return FixStatus::kIterationLimit;
    case IcpStatus::kTooFewPairs: return FixStatus::kTooFewPairs;
    case IcpStatus::kWeakGeometry: return FixStatus::kWeakGeometry;
    case IcpStatus::kBeyondLimit: return FixStatus::kBeyondLimit;
    case IcpStatus::kNoMapBoulders: return FixStatus::kNoMapBoulders;
    case IcpStatus::kNoLocalBoulders: return FixStatus::kNoLocalBoulders;
    case IcpStatus::kIdle:
    case IcpStatus::kRunning: return FixStatus::kLate;
    case IcpStatus::kBadInput: break;
  }
  return FixStatus::kBadInput;
}

FixStatus fix_status(MapFixStatus status) {
  switch (status) {
    case MapFixStatus::kAccepted: return FixStatus::kApplied;
    case MapFixStatus::kNoMap: return FixStatus::kNoMap;
    case MapFixStatus::kNoMapBoulders: return FixStatus::kNoMapBoulders;
    case MapFixStatus::kNoLocalBoulders: return FixStatus::kNoLocalBoulders;
    case MapFixStatus::kNoSearchRoom: return FixStatus::kNoSearchRoom;
    case MapFixStatus::kNoHypothesis: return FixStatus::kNoHypothesis;
    case MapFixStatus::kViewDisagrees:
    case MapFixStatus::kInconsistent: return FixStatus::kInconsistent;
    case MapFixStatus::kTooLittleEvidence: return FixStatus::kTooLittleEvidence;
    case MapFixStatus::kAmbiguous: return FixStatus::kAmbiguous;
    case MapFixStatus::kChanceAgreement: return FixStatus::kChanceAgreement;
    case MapFixStatus::kWeakGeometry: return FixStatus::kWeakGeometry;
    case MapFixStatus::kIdle:
    case MapFixStatus::kRunning: return FixStatus::kLate;
    case MapFixStatus::kBadInput: break;
  }
  return FixStatus::kBadInput;
}

// Of way. On the mast rig a third of what the relief holds beyond what is seen.
constexpr double kSurveyEvery_m = Relief::kSurveyCells * cfg::kMission.relief_cell_m;
// Of disparity: a cell and a half of the relief, as columns.
constexpr double kAtSide = 1.5 * cfg::kMission.relief_cell_m / cfg::kMission.baseline_m;
constexpr double kRefuted = 6.9;   // nats against the pose: odds of 1000 to 1
constexpr double kSlide = 2.0;     // longest steps of VO: sigma of a slide
constexpr double kWorthIt = 1.0;   // nats for a pose that is carried along
constexpr std::size_t kFresh = 4;  // boulders that make a window
constexpr double kUnproven = 2.0;  // sigma of a move without a proof, in such moves: rates turned, too
constexpr double kProved = 13.0;   // odds, as their logarithm: the most that a verdict takes

/// What a fix says of the pose. Evidence that was not to be expected tells nothing by its absence.
TrustEvent trust_event(FixStatus status, bool proof_expected) {
  switch (status) {
    case FixStatus::kApplied: return TrustEvent::kFixAccepted;
    case FixStatus::kInconsistent: return TrustEvent::kFixInconsistent;
    case FixStatus::kNoHypothesis:
    case FixStatus::kTooLittleEvidence:
      return proof_expected ? TrustEvent::kFixDeclined : TrustEvent::kFixUndecided;
    default: return TrustEvent::kFixUndecided;
  }
}

}  // namespace

LocalizerParams paper_params() {
  LocalizerParams p;
  p.vo.paper_exact = true;
  p.vo.max_reference_age = 1;
  p.vo.rectification.enabled = false;
  p.boulders.evidence.test_height = false;
  p.boulders.centre = BoulderCentre::kMean;
  p.tracks.window_frames = 30;
  p.icp.model = IcpModel::kSimilarity;
  p.icp.one_to_one = false;
  p.icp.trim_fraction = 0.3;
  p.correction = CorrectionMode::kWhole;
  return p;
}

LocalizerStatus Localizer::init(const LocalizerParams& params, const StereoRig& rig) {
  params_ = params;
  rig_ = rig;
  health_ = {};
  T_map_site_ = T_map_site_start_ = Pose2();
  T_site_rover_ = at_reference_ = Track();
  unseen_ = 0;
  fusion_.init(params.fusion, 0.0, 0.0);
  tilt_.init(params.tilt);
  gravity_status_ = heading_status_ = AttitudeStatus::kNone;
  heading_ = {};
  heights_due_ = false;
  trust_.init(params.trust);
  watch_.init(params.watch);
  watch_status_ = WatchStatus::kClear;
  stage_ = FrameStage::kNoStart;
  pose_source_ = PoseSource::kNone;
  fix_ = {};
  carried_.reset();
  observer_.init(params.boulders, rig);
  tracks_.init(params.tracks);
  relief_.init(params.relief, relief_grid_.grid());
  landmarks_.init(params.landmarks);
  return vo_.init(params.vo, rig) ? LocalizerStatus::kReady : LocalizerStatus::kBadRig;
}

LocalizerStatus Localizer::set_start(const Pose3& T_map_rover, double sigma_xy_m, double sigma_yaw_rad) {
  const auto positive = [](double v) { return v > 0.0 && std::isfinite(v); };
  if (!is_valid(T_map_rover) || !positive(sigma_xy_m) || !positive(sigma_yaw_rad))
    return LocalizerStatus::kBadPose;
  begin_site(T_map_rover, sigma_xy_m, sigma_yaw_rad);
  const bool unknown = sigma_xy_m >= kUnknownStart_m;
  trust_.on(unknown ? TrustEvent::kStartUnknown : trust_.start_of(sigma_xy_m, sigma_yaw_rad));
  return LocalizerStatus::kReady;
}

void Localizer::begin_site(const Pose3& T_map_rover, double sigma_xy_m, double sigma_yaw_rad) {
  // The site's origin lies at the start, its axes are the map's as far as the start pose knows them.
  T_map_site_start_ = {T_map_rover.t.x(), T_map_rover.t.y(), 0.0};
  T_map_site_ = T_map_site_start_;
  const Pose3 T_site_rover = lift(T_map_site_start_).inverse() * T_map_rover;
  T_site_rover_ = at_reference_ = {T_site_rover, T_site_rover};
  unseen_ = 0;
  primed_ = true;
  watch_.init(params_.watch);
  watch_status_ = WatchStatus::kClear;
  fusion_.init(params_.fusion, sigma_xy_m, sigma_yaw_rad);
  expect_of_map();
  tilt_.init(params_.tilt);
  heights_due_ = false;
  gravity_status_ = heading_status_ = AttitudeStatus::kNone;
  if (heading_.waiting) pass_over_heading();
  trust_.init(params_.trust);
  against_nats_ = 0.0;
  stage_ = FrameStage::kDone;
  pose_source_ = PoseSource::kNone;
  fix_ = {};
  fix_created_ = applied_created_ = 0;
  local_map_.clear();
  carried_.reset();
  observer_.init(params_.boulders, rig_);
  tracks_.init(params_.tracks);
  relief_.init(params_.relief, relief_grid_.grid());
  landmarks_.init(params_.landmarks);
  way_m_ = surveyed_way_m_ = 0.0;
  const bool valid = vo_.init(params_.vo, rig_);
  CAIRN_ASSERT(valid);  // Localizer::init refused a rig that is not
}

LocalizerStatus Localizer::set_trim(const StepTrim& trim) {
  if (!(trim.scale >= StepTrim::kLeastScale && trim.scale <= StepTrim::kMostScale) ||
      !(std::fabs(trim.yaw_rad_per_m) <= StepTrim::kMostTurn_rad_per_m)) {
    return LocalizerStatus::kBadTrim;
  }
  trim_ = trim;
  return LocalizerStatus::kReady;
}

LocalizerStatus Localizer::begin_frame(const ImageU8& left, const ImageU8& right, const Pose3* motion_prior) {
  if (stage_ == FrameStage::kNoStart) return LocalizerStatus::kNoStart;
  const bool unfinished = stage_ != FrameStage::kDone && stage_ != FrameStage::kVo;
  if (unfinished) ++health_.abandoned_boulders;
  observer_.abandon();
  tracks_.abandon();
  left_ = left;
  right_ = right;
  motion_prior = checked(motion_prior);
  have_prior_ = motion_prior != nullptr;
  if (have_prior_) prior_ = *motion_prior;
  primed_ = primed_ && have_prior_;
  ++health_.frames;
  gravity_status_ = heading_status_ = AttitudeStatus::kNone;
  stage_ = FrameStage::kVo;
  watch_status_ = watch_.look(left, right);
  const bool frozen = watch_status_ == WatchStatus::kFrozen;
  const VoStatus started = vo_.start(frozen ? ImageU8() : left, frozen ? ImageU8() : right, motion_prior);
  if (started != VoStatus::kRunning) take_vo_result();
  return LocalizerStatus::kReady;
}

void Localizer::miss(std::uint32_t pairs, const Pose3* motion_prior) {
  if (pairs == 0 || pose_source_ == PoseSource::kNone) return;
  motion_prior = checked(motion_prior);
  vo_.miss(pairs, motion_prior);
  hidden(pairs, motion_prior);
}

const Pose3* Localizer::checked(const Pose3* motion_prior) {
  if (motion_prior == nullptr || is_valid(*motion_prior)) return motion_prior;
  ++health_.bad_priors;
  return nullptr;
}

Progress Localizer::step_vo(WorkBudget& budget) {
  if (!vo_open()) return Progress::kDone;
  if (vo_.step(budget) == Progress::kMore) return Progress::kMore;
  take_vo_result();
  return Progress::kDone;
}

void Localizer::take_vo_result() {
  const VoStatus status = vo_.status();
  ++health_.vo[static_cast<std::size_t>(status)];
  health_.halved += vo_.halved() ? 1U : 0U;
  switch (status) {
    case VoStatus::kMotion: pose_source_ = measured() ? PoseSource::kVo : PoseSource::kDoubted; break;
    case VoStatus::kFirstFrame:
      if (unseen_ > 0) trust_.on(TrustEvent::kGuessed);  // what went by since the start pose
      mark_reference();
      pose_source_ = PoseSource::kStart;
      break;
    case VoStatus::kFewMatches:
    case VoStatus::kNoConsensus:
    case VoStatus::kImplausible:
      guessed();
      pose_source_ = PoseSource::kExtrapolated;
      ++health_.extrapolated;
      break;
    default:
      hidden(1, have_prior_ ? &prior_ : nullptr);
      pose_source_ = have_prior_ ? PoseSource::kPrior : PoseSource::kHeld;
      break;
  }
  ++health_.watch[static_cast<std::size_t>(watch_status_)];
  const bool usable = pose_source_ != PoseSource::kHeld && pose_source_ != PoseSource::kPrior;
  stage_ = usable ? FrameStage::kBoulders : FrameStage::kDone;
}

Pose3 Localizer::rover_step(const Pose3& T_prev_cur) const {
  return rig_.T_rover_cam * T_prev_cur * rig_.T_rover_cam.inverse();
}

/// From VO's reference on, whatever the frames since were taken for.
bool Localizer::measured() {
  T_site_rover_ = at_reference_;
  fusion_.caught_up();
  tilt_.caught_up();
  Pose3 step = rover_step(vo_.result().T_prev_cur);
  const double distance = step.t.norm();
  step.t *= trim_.scale;
  step.q = (step.q * lift({0.0, 0.0, trim_.yaw_rad_per_m * distance}).q).normalized();
  T_site_rover_.vo = T_site_rover_.vo * step;
  const Pose2 before = planar(T_map_rover());
  T_site_rover_.corrected = T_site_rover_.corrected * tilt_.calibrated(fusion_.calibrated(step));
  const Pose3 now = T_map_rover();
  const Pose2 after = planar(now);
  PlanarStep planar_step;
  planar_step.d_map_m = after.translation() - before.translation();
  planar_step.turn_rad = wrap_angle(after.yaw_rad - before.yaw_rad);
  way_m_ += std::sqrt(planar_step.d_map_m.squaredNorm());
  planar_step.covariance = planar_covariance(vo_.result().covariance, rig_.T_rover_cam, now);
  planar_step.sound = nothing_against();
  fusion_.propagate(planar_step);
  tilt_.propagate(
      {planar_step.d_map_m, after.yaw_rad, tilt_covariance(vo_.result().covariance, rig_.T_rover_cam, now)});
  if (heading_.waiting) {
    heading_.variance_rad2 += growth(params_.fusion, planar_step).Q(2, 2);
    heading_.way_m += std::sqrt(planar_step.d_map_m.squaredNorm());
  }
  trust_.on(unseen_ > 0 ? TrustEvent::kCaughtUp : TrustEvent::kStepMeasured);
  if (!planar_step.sound) trust_.on(TrustEvent::kDoubted);
  mark_reference();
  return planar_step.sound;
}

/// Over all frames since VO's reference. Where motion prior and VO differ nobody knows who is right; where
/// most of what is seen stands still and VO does not, a prior that agrees with VO alone can tell. Of a rover
/// that stands, both say the same.
bool Localizer::nothing_against() {
  const Pose3 step = rover_step(vo_.result().T_prev_cur);
  const Pose3 prior_step = rover_step(vo_.predicted());
  const Mat3 covariance = planar_covariance(vo_.result().covariance, rig_.T_rover_cam, Pose3());
  const auto agrees = [&](const Pose3& s) {
    return watch_.compare(s, covariance, prior_step) == WatchStatus::kClear;
  };
  if (vo_.result().own_points > 0) watch_status_ = WatchStatus::kOwnHardware;
  if (primed_ && !agrees(step)) {
    watch_status_ = WatchStatus::kContradicted;
    doubt_step(prior_step.inverse() * step);
    return false;
  }
  const bool stands = watch_.compare(step, covariance, Pose3()) == WatchStatus::kClear;
  if (vo_.result().mostly_own && !stands && !(primed_ && !agrees(Pose3()))) {
    watch_status_ = WatchStatus::kMostlyStill;
    doubt_step(step);
    return false;
  }
  return true;
}

void Localizer::doubt_step(const Pose3& between) {
  fusion_.doubt(between.t.norm(), quat_log(between.q).norm());
  tilt_.doubt(between.t.norm(), quat_log(between.q).norm());
  if (heading_.waiting) pass_over_heading();
  tear_local_map();
}

/// Frames that VO cannot use, or that never came.
void Localizer::hidden(std::uint32_t frames, const Pose3* motion_prior) {
  if (motion_prior != nullptr) {
    const Pose3 step = rover_step(*motion_prior);
    T_site_rover_ = {T_site_rover_.corrected * step, T_site_rover_.vo * step};
    fusion_.coast(step);
    tilt_.coast(step);
  } else {
    fusion_.hold(frames);
    tilt_.hold(frames);
  }
  primed_ = primed_ && motion_prior != nullptr;
  unseen_ += frames;
  trust_.on(TrustEvent::kHeld);
}

/// VO lost its way: from its old reference on, as it was predicted. It saw ground enough; that it could not
/// follow may be for a slide, of which a prior alone can tell, and none where VO saw more than may be.
void Localizer::guessed() {
  const Pose3 step = rover_step(vo_.predicted());
  T_site_rover_ = {at_reference_.corrected * step, at_reference_.vo * step};
  if (have_prior_ && vo_.status() != VoStatus::kImplausible) {
    fusion_.coast(rover_step(prior_));
    tilt_.coast(rover_step(prior_));
  } else {
    slid(1);
  }
  if (heading_.waiting) pass_over_heading();
  tear_local_map();
  trust_.on(TrustEvent::kGuessed);
  mark_reference();
}

/// Boulders seen before a step that may be far off do not lie where those seen after it will: a fix of both
/// would be right about one half, and about the rover wrong.
void Localizer::tear_local_map() {
  if (!(fusion_.unsound_xy_m() > params_.map_fix.search.evidence.sigma_pair_m)) return;
  tracks_.forget_all();
  forget_relief();
  carried_.reset();
}

void Localizer::forget_relief() {
  if (!cfg::kHaveLandmarks) return;
  relief_.clear();
  landmarks_.clear();
}

void Localizer::mark_reference() {
  at_reference_ = T_site_rover_;
  spanned_ = unseen_ + 1;
  watch_.used();
  fusion_.give_up();
  tilt_.give_up();
  unseen_ = 0;
  primed_ = true;
}

/// kNone where an attitude may be taken.
AttitudeStatus Localizer::may_take() const {
  if (params_.correction == CorrectionMode::kWhole) return AttitudeStatus::kPaper;
  const bool known = pose_source_ != PoseSource::kNone && unseen_ == 0 && !vo_open();
  return known ? AttitudeStatus::kNone : AttitudeStatus::kNoPose;
}

AttitudeStatus Localizer::take_gravity(const Vec3& up_rover, double sigma_rad) {
  gravity_status_ = may_take();
  if (gravity_status_ == AttitudeStatus::kNone) {
    const TiltResult r = tilt_.gravity(T_map_rover().q, up_rover, sigma_rad);
    gravity_status_ = r.status;
    if (r.status == AttitudeStatus::kFused) correct_tilt(r);
  }
  ++health_.gravity[static_cast<std::size_t>(gravity_status_)];
  return gravity_status_;
}

void Localizer::correct_tilt(const TiltResult& r) {
  const Vec2 turn_site = Pose2{0.0, 0.0, -T_map_site_.yaw_rad} * r.turn_map;
  Pose3& pose = T_site_rover_.corrected;
  pose.q = (quat_exp(Vec3(turn_site.x(), turn_site.y(), 0.0)) * pose.q).normalized();
  pose.t.z() += r.z_m;
  at_reference_.corrected = pose;  // nothing is unseen: the two are one
}

/// Boulders and tracks of the frame are done: what comes next. Points that were seen from another pose than
/// the one that stands now (gravity came between) say nothing of it.
void Localizer::observed() {
  stage_ = cfg::kHaveLandmarks ? FrameStage::kRelief : FrameStage::kDone;
  if (!heights_due_ || may_take() != AttitudeStatus::kNone) return;
  const Vec3 camera = (T_site_rover_.corrected * rig_.T_rover_cam).t;
  if ((camera - observer_.camera_site_m()).squaredNorm() > 0.0) return;
  const GroundHeightStatus status = ground_.start(params_.ground, map_, observer_.surface(),
                                                  lift(T_map_site_), T_map_rover().t, fusion_.sigma_xy_m());
  if (status == GroundHeightStatus::kRunning) stage_ = FrameStage::kHeights;
}

void Localizer::take_heights() {
  stage_ = cfg::kHaveLandmarks ? FrameStage::kRelief : FrameStage::kDone;
  if (ground_.status() != GroundHeightStatus::kFitted || may_take() != AttitudeStatus::kNone) return;
  heights_due_ = false;
  const GroundOffset& seen = ground_.result();
  const TiltResult r = tilt_.ground(seen.offset, seen.covariance, seen.least);
  if (r.status == AttitudeStatus::kFused) correct_tilt(r);
  ++health_.heights[static_cast<std::size_t>(r.status)];
}

AttitudeStatus Localizer::take_heading(double yaw_rad, double sigma_rad) {
  const bool good = std::fabs(yaw_rad) <= 2.0 * kPi && sigma_rad >= kLeastAttitudeSigma_rad &&
                    sigma_rad <= kMostAttitudeSigma_rad;
  AttitudeStatus status = may_take();
  if (status == AttitudeStatus::kNone && !good) status = AttitudeStatus::kBadInput;
  if (status == AttitudeStatus::kNone) {
    if (heading_.waiting) pass_over_heading();
    heading_.yaw_map_site_rad = yaw_rad - planar(T_site_rover_.corrected).yaw_rad;
    heading_.variance_rad2 = sigma_rad * sigma_rad;
    heading_.way_m = 0.0;
    heading_.waiting = fix_.status == FixStatus::kRunning;
    status = heading_.waiting ? AttitudeStatus::kWaiting : use_heading();
  }
  heading_status_ = status;
  ++health_.headings[static_cast<std::size_t>(status)];
  return status;
}

AttitudeStatus Localizer::use_heading() {
  heading_.waiting = false;
  const double of_rates = heading_.way_m * params_.fusion.sigma_turn_rad_per_m;
  const FusionResult r = fusion_.heading(wrap_angle(heading_.yaw_map_site_rad - T_map_site_.yaw_rad),
                                         heading_.variance_rad2 + of_rates * of_rates);
  if (r.status == FusionStatus::kBadInput) return AttitudeStatus::kBadInput;
  if (r.status == FusionStatus::kInconsistent) return AttitudeStatus::kInconsistent;
  turn_about(T_map_site_ * planar(at_reference_.corrected).translation(), r.at_snapshot);
  return AttitudeStatus::kFused;
}

void Localizer::use_waiting_heading() {
  if (!heading_.waiting) return;
  heading_status_ = use_heading();
  ++health_.headings[static_cast<std::size_t>(heading_status_)];
}

void Localizer::pass_over_heading() {
  heading_.waiting = false;
  ++health_.headings[static_cast<std::size_t>(AttitudeStatus::kPassedOver)];
}

Progress Localizer::step_boulders(WorkBudget& budget) {
  if (stage_ == FrameStage::kBoulders) {
    const Pose3 T_site_cam = T_site_rover_.corrected * rig_.T_rover_cam;
    const ObserveStatus status =
        observer_.start(left_, right_, vo_.disparity_plane(), T_site_cam, vo_.offset());
    const bool refused = status == ObserveStatus::kBadInput;
    if (refused) ++health_.boulders[static_cast<std::size_t>(status)];
    stage_ = refused ? FrameStage::kDone : FrameStage::kObserving;
  }
  if (stage_ == FrameStage::kObserving) {
    if (observer_.step(budget) == Progress::kMore) return Progress::kMore;
    ++health_.boulders[static_cast<std::size_t>(observer_.status())];
    laid_ = 0;
    if (observer_.status() == ObserveStatus::kBoulders) {
      tracks_.start(observer_.result(), health_.frames,
                    pose_source_ == PoseSource::kVo ? vo_.result().inliers : 0);
      stage_ = FrameStage::kTracking;
    } else {
      stage_ = cfg::kHaveLandmarks ? FrameStage::kRelief : FrameStage::kDone;
    }
  }
  if (stage_ == FrameStage::kTracking) {
    if (tracks_.step(budget) == Progress::kMore) return Progress::kMore;
    if (heights_due_ && !budget.take(GroundHeightJob::kStartOps)) return Progress::kMore;
    health_.dropped_tracks = tracks_.dropped();
    if (tracks_.jumped()) jumped();
    observed();
  }
  if (stage_ == FrameStage::kHeights) {
    if (ground_.step(budget) == Progress::kMore) return Progress::kMore;
    take_heights();
  }
  return cfg::kHaveLandmarks ? step_relief(budget) : Progress::kDone;
}

/// What a rover may have done in steps that VO missed. 3 sigma is the bound, as of frames without a motion:
/// what was measured and what was driven may each turn as far as VO holds possible; ground that gives way
/// may carry it three times as far.
void Localizer::slid(std::uint32_t steps) {
  const double xy = kSlide * steps * params_.vo.max_step_m;
  const double yaw = 2.0 / 3.0 * steps * params_.vo.max_step_rad;
  fusion_.doubt(xy, yaw);
  tilt_.doubt(xy, yaw);
}

/// Over all frames that VO measured at once.
void Localizer::jumped() {
  slid(spanned_);
  if (heading_.waiting) pass_over_heading();
  tracks_.forget_before(health_.frames);
  forget_relief();
  carried_.reset();
  pose_source_ = PoseSource::kDoubted;
  --health_.watch[static_cast<std::size_t>(watch_status_)];
  watch_status_ = WatchStatus::kJumped;
  ++health_.watch[static_cast<std::size_t>(watch_status_)];
  trust_.on(TrustEvent::kDoubted);
}

Progress Localizer::step_relief(WorkBudget& budget) {
  if (stage_ == FrameStage::kRelief && relief_.surveying()) stage_ = FrameStage::kSurvey;
  while (stage_ == FrameStage::kRelief) {
    if (!budget.take(kLayOps)) return Progress::kMore;
    lay_in_relief();
    if (laid_ < observer_.probes().size()) continue;
    stage_ = FrameStage::kDone;
    if (way_m_ - surveyed_way_m_ < kSurveyEvery_m) continue;
    surveyed_way_m_ = way_m_;
    relief_.start(planar(T_site_rover_.corrected).translation(), way_m_);
    stage_ = FrameStage::kSurvey;
  }
  if (stage_ == FrameStage::kSurvey) {
    if (relief_.step(budget) == Progress::kMore) return Progress::kMore;
    landmarks_.start(relief_.result(), relief_.centre_site_m(), relief_.way_m(), relief_.sure_m(),
                     relief_.stale_m());
    stage_ = FrameStage::kLandmarks;
  }
  if (stage_ != FrameStage::kLandmarks) return Progress::kDone;
  if (landmarks_.step(budget) == Progress::kMore) return Progress::kMore;
  stage_ = FrameStage::kDone;
  return Progress::kDone;
}

void Localizer::lay_in_relief() {
  const StereoProbeJob::Probes& probes = observer_.probes();
  const std::size_t end = probes.size() - laid_ < kLaid ? probes.size() : laid_ + kLaid;
  for (; laid_ < end; ++laid_) {
    const StereoProbe& probe = probes[laid_];
    Vec3 ray;
    if (!observer_.ray_of(probe, ray)) continue;
    const auto d = static_cast<int>(probe.d_px);
    const int side = static_cast<int>(kAtSide * d);
    const bool inside = probe.u - d > side && probe.u + side < left_.width;  // of both pictures
    relief_.add(observer_.camera_site_m() + ray, ray, way_m_, inside);
  }
}

void Localizer::set_map(const OrbitalMap& map) {
  if (fix_.status == FixStatus::kRunning) finish_fix(FixStatus::kLate);
  carried_.reset();
  heights_due_ = false;
  tilt_.leave_ground();
  map_ = map;
  expect_of_map();
}

/// Which boulders it is matched by, and how far it may lie aside as a whole.
void Localizer::expect_of_map() {
  if (!cfg::kHaveLandmarks) return;
  applied_created_ = 0;  // tracks and landmarks are numbered apart
  const double by_pixel = landmarks_.common_m(map_.pixel_m());
  const double usual = params_.fusion.common_xy_m;
  fusion_.other_map(by_landmarks() && by_pixel > usual ? by_pixel : usual);
}

Progress Localizer::prepare_fix(WorkBudget& budget) {
  tracks_.forget(health_.frames);
  return tracks_.settle(budget);
}

void Localizer::begin_fix() {
  tracks_.forget(health_.frames);
  if (by_landmarks()) {
    landmarks_.build(map_.pixel_m(), way_m_, local_map_);
  } else {
    tracks_.build(local_map_);
  }
  // One that is open stays so, its search done or not, until its result is taken. One that looks far and wide
  // and isn't done begins anew where there is much more to be looked for by now.
  const bool open = fix_.status == FixStatus::kRunning && params_.correction == CorrectionMode::kWeighted;
  const bool grown = 2 * local_map_.size() >= 3U * fix_.local_boulders;
  if (open && !(goes_on() && map_fix_.lost() && grown)) return;
  use_waiting_heading();
  fix_ = {};
  fix_.frame = health_.frames;
  fix_.status = FixStatus::kRunning;
  fix_.local_boulders = static_cast<std::uint16_t>(local_map_.size());
  fix_created_ = by_landmarks() ? landmarks_.created() : tracks_.created();
  fix_pivot_site_m_ = planar(at_reference_.corrected).translation();
  fix_pivot_map_m_ = T_map_site_ * fix_pivot_site_m_;
  carried_.carry(fusion_, T_map_site_.yaw_rad, params_.map_fix.wide_xy_m, params_.map_fix.wide_yaw_rad);
  fusion_.snapshot();
  trust_.snapshot();
  if (params_.correction == CorrectionMode::kWeighted) {
    begin_map_fix();
  } else {
    begin_registration();
  }
}

void Localizer::begin_registration() {
  map_fix_.lend_window().clear();
  const WindowStatus window = map_reader_.start(map_, fix_pivot_map_m_, params_.map_window_radius_m);
  reading_ = window == WindowStatus::kUsable;
  if (reading_) return;
  finish_fix(window == WindowStatus::kNoMap ? FixStatus::kNoMap : FixStatus::kBadInput);
}

/// Up to its end, or until no more boulders fit.
Progress Localizer::read_window(WorkBudget& budget) {
  MapReader::Chunk chunk;
  MapBoulders& window = map_fix_.lend_window();
  for (;;) {
    const Progress progress = map_reader_.step(budget, chunk);
    for (const MapBoulder& b : chunk) {
      if (!window.push_back(b)) fix_.map_window_full = true;
    }
    if (progress == Progress::kDone || fix_.map_window_full) break;
    if (chunk.empty()) return Progress::kMore;
  }
  reading_ = false;
  window_read();
  return Progress::kDone;
}

void Localizer::window_read() {
  const MapBoulders& window = map_fix_.lend_window();
  fix_.map_boulders = static_cast<std::uint16_t>(window.size());
  const IcpStatus status = icp_.start(params_.icp, window, local_map_, T_map_site_, fix_pivot_site_m_);
  if (status != IcpStatus::kRunning) finish_fix(fix_status(status));
}

void Localizer::begin_map_fix() {
  fix_.lost = trust_.state() == Trust::kLost || against_nats_ <= -kRefuted;
  fix_odds_ = trust_.state() == Trust::kConfirmed ? params_.track_log_odds : 0.0;
  const bool fresh = carried_.alive() && carried_.mark(local_map_, fix_pivot_site_m_) >= kFresh;
  const FixStage first = fresh ? FixStage::kConfirm : FixStage::kSearch;
  const MapFixStatus status = start_stage(first, local_map_);
  if (status != MapFixStatus::kRunning) finish_fix(fix_status(status));
}

MapFixStatus Localizer::start_stage(FixStage stage, const LocalMap& local) {
  fix_stage_ = stage;
  MapFixParams params = params_.map_fix;
  VerdictParams& verdict = params.search.verdict;
  verdict.prior_log_odds = stage == FixStage::kTake ? kProved : fix_odds_;
  if (by_landmarks()) {
    params.search.evidence.sigma_pair_m = landmarks_.sigma_pair_m(map_.pixel_m());
    params.lost.sigma_pair_m = params.search.evidence.sigma_pair_m;
    verdict.view_limit = params_.landmarks.view_nats;
  }
  params.search.fresh_only = stage == FixStage::kConfirm;
  if (stage == FixStage::kConfirm || stage == FixStage::kTake)
    return map_fix_.start_tracked(params, map_, local, carried_.T_map_site(), fix_pivot_site_m_,
                                  carried_.covariance());
  if (fix_.lost)
    return map_fix_.start_lost(params, map_, local, T_map_site_, fix_pivot_site_m_, SearchRegion());
  Mat3 prior = fusion_.covariance_at_snapshot();
  if (stage == FixStage::kDoubt) prior += trust_.doubt();
  return map_fix_.start_tracked(params, map_, local, T_map_site_, fix_pivot_site_m_, prior);
}

/// After a search about the pose that found nothing. Fixes whose boulders are likelier unrelated to the map
/// than on it speak against the pose, and add up. A search of the whole map settles it: it finds the pose, or
/// there is nothing to be found and the count begins anew. Of a claim the first search speaks: what is found
/// beyond the claim says nothing for it.
bool Localizer::look_farther() {
  const MapFixResult& result = map_fix_.result();
  const bool claim = fix_stage_ == FixStage::kSearch && trust_.unproven();
  if (fix_stage_ == FixStage::kSearch && result.verdict.log_ratio < 0.0)
    against_nats_ += result.verdict.log_ratio;
  if (!claim && against_nats_ > -kRefuted) return false;
  fix_.hypotheses += result.hypotheses;
  if (!claim) {
    fix_.lost = true;
    fix_odds_ = 0.0;
    trust_.on(TrustEvent::kFixRefuted);
    fusion_.lose();
  }
  (void)start_stage(claim ? FixStage::kDoubt : FixStage::kAnywhere, map_fix_.local());
  return true;
}

/// Once a stage is done; false after the last one.
bool Localizer::next_stage() {
  const bool about = fix_stage_ == FixStage::kSearch || fix_stage_ == FixStage::kDoubt;
  // A claim beyond the map's ground: whoever sends a map and a start means them for each other.
  const bool off_map = map_fix_.status() == MapFixStatus::kNoMapBoulders && trust_.unproven() &&
                       map_fix_.result().verdict.log_ratio < 0.0;
  if (about && !fix_.lost && (off_map || may_lie_farther(map_fix_.status()))) return look_farther();
  if (fix_stage_ != FixStage::kConfirm) return false;
  const MapFixResult& window = map_fix_.result();
  fix_.hypotheses += window.hypotheses;
  if (window.verdict.status != VerdictStatus::kNone)
    carried_.add(window.verdict, window.T_map_site, window.posterior, map_fix_.local());
  VerdictParams params = params_.map_fix.search.verdict;
  params.prior_log_odds = fix_odds_;
  const bool proved = carried_.alive() && carried_.sum().verdict(params) == VerdictStatus::kAccepted;
  (void)start_stage(proved ? FixStage::kTake : FixStage::kSearch, map_fix_.local());
  return true;
}

/// Of the pose that the stage looks about, from the one before the fix.
Vec3 Localizer::start_of_stage() const {
  if (searched()) return Vec3(0.0, 0.0, 0.0);
  const Pose2& about = carried_.T_map_site();
  const Vec2 moved = about * fix_pivot_site_m_ - fix_pivot_map_m_;
  return {moved.x(), moved.y(), wrap_angle(about.yaw_rad - T_map_site_.yaw_rad)};
}

/// What is declined for want of evidence is carried along, the better one of two. A fix ends it.
void Localizer::carry_on(FixStatus status) {
  const MapFixResult& result = map_fix_.result();
  const bool poor = status == FixStatus::kTooLittleEvidence || status == FixStatus::kChanceAgreement;
  const double to_beat = carried_.alive() ? carried_.sum().log_ratio() : kWorthIt;
  if (searched() && status == FixStatus::kApplied) carried_.reset();
  if (params_.add_windows && searched() && poor && result.verdict.log_ratio > to_beat)
    carried_.begin(result.verdict, result.T_map_site, result.posterior, map_fix_.local());
  const EvidenceSum& sum = carried_.sum();
  fix_.windows = static_cast<std::uint8_t>(sum.windows() < UINT8_MAX ? sum.windows() : UINT8_MAX);
  fix_.windows_log_ratio = sum.log_ratio();
  if (status != FixStatus::kApplied) return;
  if (searched()) {
    fix_.windows = 1;
    fix_.windows_log_ratio = fix_.log_ratio;
  } else {
    fix_.log_ratio = sum.log_ratio();
    fix_.chance_log = sum.chance_log();
  }
  carried_.reset();
}

/// In the next major frame: the result is of its snapshot, whenever it comes.
bool Localizer::goes_on() const {
  return fix_.status == FixStatus::kRunning && params_.correction == CorrectionMode::kWeighted &&
         map_fix_.status() == MapFixStatus::kRunning;
}

Progress Localizer::step_fix(WorkBudget& budget) {
  if (fix_.status != FixStatus::kRunning) return Progress::kDone;
  if (params_.correction == CorrectionMode::kWhole) {
    if (reading_ && read_window(budget) == Progress::kMore) return Progress::kMore;
    return icp_.step(budget);
  }
  do {
    if (map_fix_.step(budget) == Progress::kMore) return Progress::kMore;
  } while (next_stage());
  return Progress::kDone;
}

void Localizer::apply_fix() {
  if (fix_.status != FixStatus::kRunning) return;
  if (goes_on()) return;
  const bool weighted = params_.correction == CorrectionMode::kWeighted;
  const Pose2 before = planar(T_map_rover());
  const FixStatus status = weighted ? take_map_fix() : take_registration();
  const Pose2 after = planar(T_map_rover());
  fix_.correction = {after.x_m - before.x_m, after.y_m - before.y_m,
                     wrap_angle(after.yaw_rad - before.yaw_rad)};
  finish_fix(status);
}

FixStatus Localizer::take_registration() {
  const FixStatus status = reading_ ? FixStatus::kLate : fix_status(icp_.status());
  if (status == FixStatus::kLate) return status;
  const IcpResult& result = icp_.result();
  fix_.scale = result.scale;
  fix_.rms_m = result.rms_m;
  fix_.pairs = static_cast<std::uint16_t>(result.pairs_used);
  fix_.trimmed = static_cast<std::uint16_t>(result.pairs_trimmed);
  fix_.gated = static_cast<std::uint16_t>(result.pairs_gated);
  fix_.iterations = static_cast<std::uint16_t>(result.iterations);
  if (status == FixStatus::kApplied)
    turn_about(fix_pivot_map_m_, {result.dx_m, result.dy_m, result.dyaw_rad});
  return status;
}

FixStatus Localizer::take_map_fix() {
  FixStatus status = fix_status(map_fix_.status());
  if (status == FixStatus::kLate) return status;
  const MapFixResult& result = map_fix_.result();
  fix_.scale = result.scale;
  fix_.rms_m = result.rms_m;
  fix_.pairs = static_cast<std::uint16_t>(result.pairs + 0.5);
  fix_.gated = static_cast<std::uint16_t>(result.sightings > fix_.pairs ? result.sightings - fix_.pairs : 0);
  fix_.map_boulders = result.map_boulders;
  fix_.log_ratio = result.verdict.log_ratio;
  fix_.second_log_ratio = result.verdict.second_log_ratio;
  fix_.chance_log = result.verdict.chance_log;
  fix_.hypotheses += result.hypotheses;
  if (status == FixStatus::kApplied) {
    const bool start = fix_.lost || trust_.unproven();
    const bool fresh_alone = by_landmarks() && !start;
    FixOffset told{start_of_stage() + (fresh_alone ? result.fresh_offset : result.offset),
                   fresh_alone ? result.fresh_covariance : result.covariance};
    if (by_landmarks()) told.covariance += fusion_.bend(result.far_m);
    const double fresh = fresh_alone ? 1.0 : fresh_share(map_fix_.local(), applied_created_);
    const FusionResult r = fix_.lost ? fusion_.relocate(told)
                           : start   ? fusion_.prove(told)
                                     : fusion_.update(told, fresh);
    fix_.chi2 = r.chi2;
    if (r.status == FusionStatus::kFused) {
      if (fresh_alone && result.fresh_unproven)
        fusion_.doubt(kUnproven * r.at_snapshot.translation().norm(),
                      kUnproven * std::fabs(r.at_snapshot.yaw_rad));
      turn_about(fix_pivot_map_m_, r.at_snapshot);
      turn_about(planar(T_map_rover()).translation(), r.since);
      applied_created_ = fix_created_;
      if (by_landmarks()) landmarks_.used(map_fix_.local(), map_.pixel_m());
      heights_due_ = true;
      if (fix_.lost) tilt_.leave_ground();
    } else {
      status = r.status == FusionStatus::kInconsistent ? FixStatus::kInconsistent : FixStatus::kBadInput;
    }
  }
  carry_on(status);
  if (map_fix_.status() == MapFixStatus::kViewDisagrees) slipped();
  TrustEvent event = trust_event(status, result.proof_expected);
  const bool refuted = fix_.lost && against_nats_ <= -kRefuted;  // and this one looked in the whole map
  if (status == FixStatus::kApplied || fix_.lost) against_nats_ = 0.0;
  const bool declined = event == TrustEvent::kFixUndecided || event == TrustEvent::kFixDeclined;
  if (declined && refuted) event = TrustEvent::kFixRefuted;
  const bool lost = trust_.state() == Trust::kLost;
  trust_.on(event);
  if (!lost && trust_.state() == Trust::kLost) fusion_.lose();
  return status;
}

/// At a time that nobody knows, since the oldest boulder of the local map was seen last.
void Localizer::slipped() {
  tracks_.forget_before(fix_.frame);
  forget_relief();
  carried_.reset();
  const double frames = params_.tracks.window_frames;
  fusion_.doubt(frames * params_.fusion.unseen_step_m, frames * params_.fusion.unseen_step_rad);
  tilt_.doubt(frames * params_.tilt.unseen_step_m, frames * params_.tilt.unseen_step_rad);
}

/// Turns the site about a point of the map, and shifts it.
void Localizer::turn_about(const Vec2& pivot_map_m, const Pose2& correction) {
  const Pose2 to_pivot{-pivot_map_m.x(), -pivot_map_m.y(), 0.0};
  const Pose2 turn{0.0, 0.0, correction.yaw_rad};
  const Pose2 from_pivot{pivot_map_m.x() + correction.x_m, pivot_map_m.y() + correction.y_m, 0.0};
  T_map_site_ = from_pivot * turn * to_pivot * T_map_site_;
}

void Localizer::finish_fix(FixStatus status) {
  fix_.status = status;
  fix_.sigma_xy_m = fusion_.sigma_xy_m();
  fix_.sigma_yaw_rad = fusion_.sigma_yaw_rad();
  ++health_.fixes[static_cast<std::size_t>(status)];
  use_waiting_heading();
}

Pose3 Localizer::vo_T_map_cam() const {
  return lift(T_map_site_start_) * T_site_rover_.vo * rig_.T_rover_cam;
}

Pose3 Localizer::T_map_rover() const { return lift(T_map_site_) * T_site_rover_.corrected; }

Pose3 Localizer::T_map_cam() const { return T_map_rover() * rig_.T_rover_cam; }

}  // namespace cairn
