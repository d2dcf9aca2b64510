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
  T_site_rover_ = T_site_rover_vo_ = Pose3();
  fusion_.init(params.fusion, 0.0, 0.0);
  stage_ = FrameStage::kNoStart;
  pose_source_ = PoseSource::kNone;
  fix_ = {};
  observer_.init(params.boulders, rig);
  tracks_.init(params.tracks);
  return vo_.init(params.vo, rig) ? LocalizerStatus::kReady : LocalizerStatus::kBadRig;
}

LocalizerStatus Localizer::set_start(const Pose3& T_map_rover, double sigma_xy_m, double sigma_yaw_rad) {
  const auto positive = [](double v) { return v > 0.0 && std::isfinite(v); };
  if (!is_valid(T_map_rover) || !positive(sigma_xy_m) || !positive(sigma_yaw_rad))
    return LocalizerStatus::kBadPose;
  // The site's origin lies at the start, its axes are the map's as far as the start pose knows them.
  T_map_site_start_ = {T_map_rover.t.x(), T_map_rover.t.y(), 0.0};
  T_map_site_ = T_map_site_start_;
  T_site_rover_ = lift(T_map_site_start_).inverse() * T_map_rover;
  T_site_rover_vo_ = T_site_rover_;
  fusion_.init(params_.fusion, sigma_xy_m, sigma_yaw_rad);
  last_step_ = Pose3();
  stage_ = FrameStage::kDone;
  pose_source_ = PoseSource::kNone;
  fix_ = {};
  local_map_.clear();
  observer_.init(params_.boulders, rig_);
  tracks_.init(params_.tracks);
  const bool valid = vo_.init(params_.vo, rig_);
  CAIRN_ASSERT(valid);  // Localizer::init refused a rig that is not
  return LocalizerStatus::kReady;
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
  if (stage_ == FrameStage::kBoulders || stage_ == FrameStage::kObserving) ++health_.abandoned_boulders;
  observer_.abandon();
  left_ = left;
  right_ = right;
  if (motion_prior != nullptr && !is_valid(*motion_prior)) {
    motion_prior = nullptr;
    ++health_.bad_priors;
  }
  expected_step_ = motion_prior != nullptr ? *motion_prior : last_step_;
  ++health_.frames;
  stage_ = FrameStage::kVo;
  if (vo_.start(left, right, motion_prior) != VoStatus::kRunning) take_vo_result();
  return LocalizerStatus::kReady;
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
  switch (status) {
    case VoStatus::kMotion:
      last_step_ = vo_.result().T_prev_cur;
      move(last_step_);
      pose_source_ = PoseSource::kVo;
      break;
    case VoStatus::kFirstFrame: pose_source_ = PoseSource::kStart; break;
    case VoStatus::kFewMatches:
    case VoStatus::kNoConsensus:
    case VoStatus::kImplausible:
      move(expected_step_);
      pose_source_ = PoseSource::kExtrapolated;
      ++health_.extrapolated;
      break;
    default: pose_source_ = PoseSource::kHeld; break;
  }
  stage_ = pose_source_ == PoseSource::kHeld ? FrameStage::kDone : FrameStage::kBoulders;
}

void Localizer::move(const Pose3& T_prev_cur) {
  Pose3 step = rig_.T_rover_cam * T_prev_cur * rig_.T_rover_cam.inverse();
  const double distance = step.t.norm();
  step.t *= trim_.scale;
  step.q = (step.q * lift({0.0, 0.0, trim_.yaw_rad_per_m * distance}).q).normalized();
  T_site_rover_vo_ = T_site_rover_vo_ * step;
  const Vec3 before = T_map_rover().t;
  T_site_rover_ = T_site_rover_ * fusion_.calibrated(step);
  const Vec3 moved = T_map_rover().t - before;
  fusion_.propagate(Vec2(moved.x(), moved.y()));
}

Progress Localizer::step_boulders(WorkBudget& budget) {
  if (stage_ == FrameStage::kBoulders) {
    const Pose3 T_site_cam = T_site_rover_ * rig_.T_rover_cam;
    const ObserveStatus status = observer_.start(left_, right_, vo_.disparity_plane(), T_site_cam);
    const bool refused = status == ObserveStatus::kBadInput;
    if (refused) ++health_.boulders[static_cast<std::size_t>(status)];
    stage_ = refused ? FrameStage::kDone : FrameStage::kObserving;
  }
  if (stage_ != FrameStage::kObserving) return Progress::kDone;
  if (observer_.step(budget) == Progress::kMore) return Progress::kMore;
  stage_ = FrameStage::kDone;
  ++health_.boulders[static_cast<std::size_t>(observer_.status())];
  if (observer_.status() == ObserveStatus::kBoulders) tracks_.update(observer_.result(), health_.frames);
  health_.dropped_tracks = tracks_.dropped();
  return Progress::kDone;
}

void Localizer::begin_fix() {
  fix_ = {};
  fix_.frame = health_.frames;
  fix_.status = FixStatus::kRunning;
  tracks_.forget(health_.frames);
  tracks_.build(local_map_);
  map_window_.clear();
  const Pose2 rover_map = planar(T_map_rover());
  const WindowStatus window = map_.window(rover_map.translation(), params_.map_window_radius_m, map_window_);
  fix_.local_boulders = static_cast<std::uint16_t>(local_map_.size());
  fix_.map_boulders = static_cast<std::uint16_t>(map_window_.size());
  fix_.map_window_full = window == WindowStatus::kWindowFull;
  if (window == WindowStatus::kNoMap) {
    finish_fix(FixStatus::kNoMap);
    return;
  }
  fix_prior_.use = params_.correction == CorrectionMode::kWeighted;
  fix_prior_.sigma_xy_m = fusion_.sigma_xy_m();
  fix_prior_.sigma_yaw_rad = fusion_.sigma_yaw_rad();
  fix_pivot_map_m_ = rover_map.translation();
  const Vec2 pivot_site_m = planar(T_site_rover_).translation();
  const IcpStatus status =
      icp_.start(params_.icp, map_window_, local_map_, T_map_site_, pivot_site_m, fix_prior_);
  if (status != IcpStatus::kRunning) finish_fix(fix_status(status));
}

Progress Localizer::step_fix(WorkBudget& budget) {
  return fix_.status == FixStatus::kRunning ? icp_.step(budget) : Progress::kDone;
}

void Localizer::apply_fix() {
  if (fix_.status != FixStatus::kRunning) return;
  const FixStatus status = fix_status(icp_.status());
  const IcpResult& result = icp_.result();
  if (status != FixStatus::kLate) {
    fix_.scale = result.scale;
    fix_.rms_m = result.rms_m;
    fix_.pairs = static_cast<std::uint16_t>(result.pairs_used);
    fix_.trimmed = static_cast<std::uint16_t>(result.pairs_trimmed);
    fix_.gated = static_cast<std::uint16_t>(result.pairs_gated);
    fix_.iterations = static_cast<std::uint16_t>(result.iterations);
  }
  if (status == FixStatus::kApplied) {
    const Pose2 before = planar(T_map_rover());
    correct({result.dx_m, result.dy_m, result.dyaw_rad}, result.covariance);
    const Pose2 after = planar(T_map_rover());
    fix_.correction = {after.x_m - before.x_m, after.y_m - before.y_m,
                       wrap_angle(after.yaw_rad - before.yaw_rad)};
  }
  finish_fix(status);
}

void Localizer::correct(const Pose2& registered, const Mat3& covariance) {
  Pose2 c = registered;
  if (params_.correction == CorrectionMode::kWeighted) {
    c = fusion_.update(registered, covariance, fix_prior_.sigma_xy_m, fix_prior_.sigma_yaw_rad);
  }
  // Turn about where the rover was at the snapshot, then shift.
  const Pose2 to_pivot{-fix_pivot_map_m_.x(), -fix_pivot_map_m_.y(), 0.0};
  const Pose2 turn{0.0, 0.0, c.yaw_rad};
  const Pose2 from_pivot{fix_pivot_map_m_.x() + c.x_m, fix_pivot_map_m_.y() + c.y_m, 0.0};
  T_map_site_ = from_pivot * turn * to_pivot * T_map_site_;
}

void Localizer::finish_fix(FixStatus status) {
  fix_.status = status;
  fix_.sigma_xy_m = fusion_.sigma_xy_m();
  fix_.sigma_yaw_rad = fusion_.sigma_yaw_rad();
  ++health_.fixes[static_cast<std::size_t>(status)];
}

Pose3 Localizer::vo_T_map_cam() const {
  return lift(T_map_site_start_) * T_site_rover_vo_ * rig_.T_rover_cam;
}

Pose3 Localizer::T_map_rover() const { return lift(T_map_site_) * T_site_rover_; }

Pose3 Localizer::T_map_cam() const { return T_map_rover() * rig_.T_rover_cam; }

}  // namespace cairn
