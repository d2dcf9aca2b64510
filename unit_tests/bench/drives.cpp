#include "bench/drives.hpp"

#include <algorithm>

namespace cairn::bench {
namespace {

constexpr std::uint32_t kFrames = 1000;
constexpr double kStep_m = 0.06;
constexpr std::uint32_t kFixEvery = 30;
constexpr double kRefuted = 6.9;  // as in localizer/localizer.cpp

// What is seen: a disc ahead; some 14 of the map's boulders in a local map, and 6 others.
constexpr double kAhead_m = 2.5;
constexpr double kSees_m = 3.5;
constexpr double kSwath_m2 = 63.0;  // of a local map's frames
constexpr double kTrue = 14.0;
constexpr double kClutter = 0.3;

// Together 0.045 m a pair.
constexpr double kMapNoise_m = 0.040;
constexpr double kCoarse_m = 0.1;
constexpr double kFaceNoise_m = 0.020;  // of the sides of a boulder that are seen: the same in all frames
constexpr double kSightNoise_m = 0.015;
constexpr double kDiameter_m = 0.15;

// VO's own matches, a step.
constexpr double kVoNoise_m = 0.0003;
constexpr double kVoNoise_rad = 0.0001;

Vec2 at_random(Rng& rng, double length) {
  const double a = uniform(rng, -kPi, kPi);
  return length * Vec2(std::cos(a), std::sin(a));
}

/// S-shaped.
std::vector<Pose2> path() {
  std::vector<Pose2> out{Pose2{0.0, 0.0, 0.0}};
  for (std::uint32_t f = 1; f <= kFrames; ++f) {
    const double turn = 0.015 * std::sin(2.0 * kPi * f / 500.0);
    out.push_back(out.back() * Pose2{kStep_m, 0.0, turn});
  }
  return out;
}

}  // namespace

void DrivenRover::lay(Rng& rng) {
  const DriveCase& c = case_;
  path_ = path();
  Vec2 low = path_[0].translation();
  Vec2 high = low;
  for (const Pose2& p : path_) {
    low = low.cwiseMin(p.translation());
    high = high.cwiseMax(p.translation());
  }
  low -= Vec2(14.0, 14.0);
  high += Vec2(14.0, 14.0);
  const Vec2 size = high - low;
  const double area = size.x() * size.y();
  const double seen = std::min(0.8, kTrue / (kSwath_m2 * c.per_m2));
  const FusionParams& model = model_;
  // The map's shift, by its way along the drive; it is the same for whatever is near.
  std::vector<Vec2> shift{c.common_share * model.common_xy_m * Vec2(gauss(rng), gauss(rng))};
  const double keep = 1.0 / (1.0 + 1.0 / model.common_length_m);
  for (int m = 1; m <= 100; ++m) {
    const double fresh = c.common_share * model.common_xy_m * std::sqrt(1.0 - keep * keep);
    shift.push_back(keep * shift.back() + fresh * Vec2(gauss(rng), gauss(rng)));
  }
  std::vector<MapBoulder> map;
  rocks_.clear();
  const auto anywhere = [&] {
    return Vec2(uniform(rng, low.x(), high.x()), uniform(rng, low.y(), high.y()));
  };
  const double noise = c.coarse ? kCoarse_m : kMapNoise_m;
  const int boulders = static_cast<int>(c.per_m2 * area);
  for (int i = 0; i < boulders; ++i) {
    const Vec2 p = anywhere();
    const double way = std::clamp(p.x() - path_[0].x_m, 0.0, 99.0);
    MapBoulder b;
    b.p_map_m = p + shift[static_cast<std::size_t>(way)] + noise * Vec2(gauss(rng), gauss(rng));
    b.p_map_m = b.p_map_m.cwiseMax(low).cwiseMin(high);
    map.push_back(b);
    if (uniform(rng, 0.0, 1.0) < seen) rocks_.push_back({p + kFaceNoise_m * Vec2(gauss(rng), gauss(rng))});
  }
  const int others = static_cast<int>(kClutter / (1.0 - kClutter) * seen * c.per_m2 * area);
  for (int i = 0; i < others; ++i) rocks_.push_back({anywhere()});
  std::shuffle(rocks_.begin(), rocks_.end(), rng);
  encoded_.encode(map, low, high);
}

void DrivenRover::drive(const DriveCase& c, std::uint64_t seed, DriveResult& out) {
  Rng rng(seed);
  rng.discard(8);
  case_ = c;
  model_ = {};
  if (c.coarse) model_.common_xy_m = kCoarse_m;
  lay(rng);
  const FusionParams& model = model_;
  truth_ = path_[0];
  scale_ = c.vo_share * model.sigma_scale * gauss(rng);
  turn_rad_per_m_ = c.vo_share * model.sigma_turn_rad_per_m * gauss(rng);
  const Vec2 off = c.start_error_m >= 0.0 ? at_random(rng, c.start_error_m)
                                          : Vec2(c.start_sigma_m * Vec2(gauss(rng), gauss(rng)));
  T_site_rover_ = {};
  T_map_site_ = {truth_.x_m + off.x(), truth_.y_m + off.y(),
                 wrap_angle(truth_.yaw_rad + c.start_sigma_rad * gauss(rng))};
  fusion_.init(model, c.start_sigma_m, c.start_sigma_rad);
  tracks_.init(TrackParams());
  trust_.init(TrustParams());
  trust_.on(TrustEvent::kStartGiven);
  fix_created_ = 0;
  applied_created_ = 0;
  open_ = false;
  against_nats_ = 0.0;
  out = {};
  double next_m = 1.0;
  for (std::uint32_t frame = 1; frame <= c.frames; ++frame) {
    step(rng, frame);
    look(rng, frame);
    if (frame % kFixEvery == kFixEvery - 1) apply_fix(out);
    if (frame % kFixEvery == 0) begin_fix(frame);
    if (frame * kStep_m < next_m - 1e-9) continue;
    next_m += 1.0;
    out.poses.push_back(pose());
  }
}

/// A measured step is too short by k and lacks w; what it scatters beside is as the filter has it.
void DrivenRover::step(Rng& rng, std::uint32_t frame) {
  const DriveCase& c = case_;
  const FusionParams& model = model_;
  const Pose2 real = path_[frame - 1].inverse() * path_[frame];
  truth_ = path_[frame];
  if (c.slip_m > 0.0 && frame == kFrames / 2) {
    const Vec2 slip = at_random(rng, c.slip_m);
    for (std::uint32_t f = frame; f <= kFrames; ++f) {
      path_[f].x_m += slip.x();
      path_[f].y_m += slip.y();
    }
    truth_ = path_[frame];
  }
  const double ds = real.translation().norm();
  const double root = std::sqrt(ds);
  scale_ += c.vo_share * model.scale_walk * root * gauss(rng);
  turn_rad_per_m_ += c.vo_share * model.turn_walk_rad_per_m * root * gauss(rng);
  const double xy = c.vo_share * std::hypot(kVoNoise_m, model.noise_xy_m * root);
  const double yaw =
      c.vo_share * std::sqrt(kVoNoise_rad * kVoNoise_rad + model.noise_yaw_rad * model.noise_yaw_rad * ds +
                             model.noise_turn * model.noise_turn * std::fabs(real.yaw_rad));
  const Pose2 vo{real.x_m / (1.0 + scale_) + xy * gauss(rng), real.y_m / (1.0 + scale_) + xy * gauss(rng),
                 real.yaw_rad - turn_rad_per_m_ * ds + yaw * gauss(rng)};
  const Pose2 before = T_map_rover();
  T_site_rover_ = T_site_rover_ * planar(fusion_.calibrated(lift(vo)));
  const Pose2 after = T_map_rover();
  PlanarStep planar_step;
  planar_step.d_map_m = after.translation() - before.translation();
  planar_step.turn_rad = wrap_angle(after.yaw_rad - before.yaw_rad);
  const double claimed = kVoNoise_m / model.vo_sigma_factor;
  const double claimed_rad = kVoNoise_rad / model.vo_sigma_factor;
  planar_step.covariance = Vec3(claimed * claimed, claimed * claimed, claimed_rad * claimed_rad).asDiagonal();
  fusion_.propagate(planar_step);
  trust_.on(TrustEvent::kStepMeasured);
}

void DrivenRover::look(Rng& rng, std::uint32_t frame) {
  const Vec2 middle = truth_ * Vec2(kAhead_m, 0.0);
  const Pose2 T_rover_map = truth_.inverse();
  BoulderSightings seen;
  for (Rock& rock : rocks_) {
    const bool sees = (rock.p_map_m - middle).norm() <= kSees_m && seen.size() < seen.capacity();
    if (!sees) {
      rock.last = 0;
      continue;
    }
    const Vec2 p_rover = T_rover_map * rock.p_map_m + kSightNoise_m * Vec2(gauss(rng), gauss(rng));
    const Vec2 p_site = T_site_rover_ * p_rover;
    BoulderSighting s;
    s.p_site_m = Vec3(p_site.x(), p_site.y(), 0.0);
    s.diameter_m = static_cast<float>(kDiameter_m);
    s.range_m = static_cast<float>(p_rover.norm());
    s.points = 20;
    // Votes are of points that lie on one another (localizer/boulder_observer.hpp).
    s.previous = (p_site - rock.last_site_m).norm() < kDiameter_m ? rock.last : 0;
    (void)seen.push_back(s);
    rock.last_site_m = p_site;
    rock.last = static_cast<std::uint8_t>(seen.size());
  }
  tracks_.start(seen, frame);
  WorkBudget all = WorkBudget::unlimited();
  (void)tracks_.step(all);
  if (!tracks_.jumped()) return;
  fusion_.doubt(2.0 * cfg::kMission.max_step_m, 2.0 / 3.0 * cfg::kMission.max_step_rad);
  tracks_.forget_before(frame);
  trust_.on(TrustEvent::kDoubted);
}

void DrivenRover::begin_fix(std::uint32_t frame) {
  tracks_.forget(frame);
  tracks_.build(local_);
  fix_created_ = tracks_.created();
  fix_frame_ = frame;
  pivot_map_m_ = T_map_rover().translation();
  fusion_.snapshot();
  trust_.snapshot();
  fix_lost_ = trust_.state() == Trust::kLost || against_nats_ <= -kRefuted;
  MapFixParams params;
  if (case_.coarse) params.search.evidence.sigma_pair_m = params.lost.sigma_pair_m = kCoarse_m;
  if (trust_.state() == Trust::kConfirmed)
    params.search.verdict.prior_log_odds = cfg::kMission.track_log_odds;
  const Vec2 pivot_site = T_site_rover_.translation();
  const MapFixStatus begun =
      fix_lost_ ? fix_.start_lost(params, encoded_.map(), local_, T_map_site_, pivot_site, SearchRegion())
                : fix_.start_tracked(params, encoded_.map(), local_, T_map_site_, pivot_site,
                                     fusion_.covariance_at_snapshot());
  open_ = begun == MapFixStatus::kRunning;
  WorkBudget all = WorkBudget::unlimited();
  if (open_) (void)fix_.step(all);
  if (!open_ || fix_lost_) return;
  if (may_lie_farther(fix_.status()) && fix_.result().verdict.log_ratio < 0.0)
    against_nats_ += fix_.result().verdict.log_ratio;
  if (may_lie_farther(fix_.status()) && trust_.unproven()) {
    const Mat3 doubted = fusion_.covariance_at_snapshot() + trust_.doubt();
    (void)fix_.start_tracked(params, encoded_.map(), fix_.local(), T_map_site_, pivot_site, doubted);
    (void)fix_.step(all);
  }
  if (!may_lie_farther(fix_.status()) || against_nats_ > -kRefuted) return;
  trust_.on(TrustEvent::kFixRefuted);
  fusion_.lose();
  fix_lost_ = true;
  params.search.verdict.prior_log_odds = 0.0;
  (void)fix_.start_lost(params, encoded_.map(), fix_.local(), T_map_site_, pivot_site, SearchRegion());
  (void)fix_.step(all);
}

void DrivenRover::apply_fix(DriveResult& out) {
  if (!open_) return;
  open_ = false;
  const MapFixResult& result = fix_.result();
  bool applied = false;
  bool inconsistent = false;
  if (fix_.status() == MapFixStatus::kAccepted) {
    const double fresh = fresh_share(fix_.local(), applied_created_);
    const FixOffset offset{result.offset, result.covariance};
    const FusionResult r = fix_lost_           ? fusion_.relocate(offset)
                           : trust_.unproven() ? fusion_.prove(offset)
                                               : fusion_.update(offset, fresh);
    applied = r.status == FusionStatus::kFused;
    inconsistent = r.status == FusionStatus::kInconsistent;
    if (applied) {
      turn_about(pivot_map_m_, r.at_snapshot);
      turn_about(T_map_rover().translation(), r.since);
      applied_created_ = fix_created_;
      ++out.fixes;
    }
  }
  const bool declined =
      fix_.status() == MapFixStatus::kNoHypothesis || fix_.status() == MapFixStatus::kTooLittleEvidence;
  if (fix_.status() == MapFixStatus::kViewDisagrees) {
    tracks_.forget_before(fix_frame_);
    const FusionParams& model = model_;
    const double frames = TrackParams().window_frames;
    fusion_.doubt(frames * model.unseen_step_m, frames * model.unseen_step_rad);
    inconsistent = true;
  }
  const bool refuted = fix_lost_ && against_nats_ <= -kRefuted;
  if (applied || fix_lost_) against_nats_ = 0.0;
  TrustEvent event = TrustEvent::kFixUndecided;
  if (applied) event = TrustEvent::kFixAccepted;
  if (inconsistent) event = TrustEvent::kFixInconsistent;
  if (declined && result.proof_expected) event = TrustEvent::kFixDeclined;
  if (fix_.status() == MapFixStatus::kInconsistent) event = TrustEvent::kFixInconsistent;
  const bool tells_nothing = event == TrustEvent::kFixUndecided || event == TrustEvent::kFixDeclined;
  if (tells_nothing && refuted) event = TrustEvent::kFixRefuted;
  const bool lost = trust_.state() == Trust::kLost;
  trust_.on(event);
  if (!lost && trust_.state() == Trust::kLost) fusion_.lose();
}

void DrivenRover::turn_about(const Vec2& pivot_map_m, const Pose2& correction) {
  const Pose2 to_pivot{-pivot_map_m.x(), -pivot_map_m.y(), 0.0};
  const Pose2 turn{0.0, 0.0, correction.yaw_rad};
  const Pose2 from_pivot{pivot_map_m.x() + correction.x_m, pivot_map_m.y() + correction.y_m, 0.0};
  T_map_site_ = from_pivot * turn * to_pivot * T_map_site_;
}

DrivePose DrivenRover::pose() const {
  const Vec2 off = T_map_rover().translation() - truth_.translation();
  const Mat2 c = fusion_.covariance().topLeftCorner<2, 2>();
  DrivePose p;
  p.error_m = off.norm();
  p.sigma_m = std::sqrt(c.trace());
  p.nees2 = off.dot(Vec2(c.inverse() * off));
  p.lost = trust_.state() == Trust::kLost;
  p.confirmed = trust_.state() == Trust::kConfirmed;
  p.claimed = trust_.state() == Trust::kClaimed;
  return p;
}

}  // namespace cairn::bench
