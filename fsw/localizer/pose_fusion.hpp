/// How uncertain the pose is, how far a fix moves it, and what fixes tell of VO's own errors.
///
/// VO's errors are of two kinds. Its covariance tells what its matches scatter. What it cannot see is
/// systematic: a baseline that is off, a toe-in, a bias of its matches; so two rates are estimated, k, by
/// which each step is too short, and w, the turn per metre that it lacks. Fixes have errors in common, too: a
/// map that lies aside, boulders whose sunlit side alone was seen. These are states, so that a hundred fixes
/// over the same map are not believed a hundred times. An extended Kalman filter on the errors e = (x, y,
/// yaw, k, w, c_x, c_y, c_yaw) of the rover in `map`:
///
///   step       displacement D (map, m), length ds, turn da, covariance V of VO (x, y, yaw, in map):
///              x += k D_x - yaw D_y,  y += k D_y + yaw D_x,  yaw += w ds,
///              c *= a = 1 / (1 + ds / common_length),  P = F P F' + f^2 V + diag(q),
///              q = noise_xy^2 ds, the same, noise_yaw^2 ds + noise_turn^2 |da|, scale_walk^2 ds,
///                  turn_walk^2 ds, (1 - a^2) common^2
///   fix        z = (x, y, yaw) + c + n,  cov(n) = R / fresh: `fresh` is the share of what it was made of
///              that no fix before it used
///   gate       d = u' S^-1 u,  u = z - c with c as it was estimated,  S = H P H' + R / fresh. Beyond
///              gate_chi2 the fix is inconsistent and nothing changes. Beyond surprise_chi2 errors are
///              larger than was believed (VO's rates are far outside their prior, say): first P of pose and
///              rates is taken d / surprise_chi2 times.
///
/// The first fix after a start meets a pose that somebody claimed. The claim counts no more than
///     P_ii >= n_i / 2,  n_i = R_ii + C_ii for x, y and yaw    (C: of c)
/// and only where they agree, d <= claim_chi2; else the fix stands alone. Whatever was claimed, the pose then
/// lies sqrt(2 claim_chi2) of the sigmas that come out from where the fix is, at most, fewer than three:
/// a false claim that passes pulls by n (d / (P + n))^(1/2), and the variance is P n / (P + n). That fix
/// teaches no rates: what the start was off would be taken for what VO drifted since, and grow again.
///
/// A fix lands at its own time. `snapshot` keeps P; steps since then gather the transition F and the noise Q;
/// the update is made on the kept P and carried forward, P_now = F P' F' + Q. That is what a filter would
/// give that had the fix at once.
///
/// A heading (of a sun sensor, say) measures yaw alone and at once, with a gate of its own. It must not come
/// between a snapshot and its update, which knows of steps alone: the localizer keeps it until then.
///
/// Frames that VO does not measure. What the rover does in them is bounded and not random: it goes on, or it
/// stands. So their sigmas add up as they are, not as roots of sums of squares; 3 sigma is the bound. They
/// are kept beside P as `hidden`, since VO may yet measure the whole way from its reference: then it was
/// never hidden (`caught_up`). Where the reference is lost it goes into P (`give_up`) as
/// (run + hidden)^2 - run^2, where run is all that went there since the last sound step; and so does what VO
/// and a motion prior differ by (`doubt`). A fix in the meantime speaks of the reference: the boulders were
/// seen before it.
///
/// A pose that is given up (`lose`) has sigmas of 10 km and of any heading, and nothing in common with the
/// rates; so has the one that a fix finds anew (`relocate`) before that fix.
///
/// Source: Kalman filter, e.g. Maybeck 1979, chapter 5; late measurements by a kept state as in stochastic
/// cloning (Roumeliotis and Burdick 2002); states of errors in common as in Schmidt 1966, but estimated. The
/// paper takes each fix whole (CorrectionMode::kWhole, which does not come here).
#pragma once

#include "core/nodiscard.hpp"
#include "geometry/pose3.hpp"
#include "mission_cfg.hpp"

namespace cairn {

struct FusionParams {
  double sigma_scale = cfg::kMission.drift_scale;                   ///< of k at the start
  double sigma_turn_rad_per_m = cfg::kMission.drift_yaw_rad_per_m;  ///< of w at the start
  double max_scale = cfg::kMission.max_drift_scale;                 ///< |k| is never beyond it
  double max_turn_rad_per_m = cfg::kMission.max_drift_yaw_rad_per_m;
  double scale_walk = 0.0003;  ///< of k, per square root of a metre
  double turn_walk_rad_per_m = 0.00003;
  double vo_sigma_factor = cfg::kVoSigmaFactor;        ///< f: errors of VO's steps over what it says
  double noise_xy_m = cfg::kMission.drift_noise_xy_m;  ///< of one metre, beside VO's covariance
  double noise_yaw_rad = cfg::kMission.drift_noise_yaw_rad;
  double noise_turn = cfg::kMission.drift_noise_turn;  ///< of one radian turned
  double common_xy_m = cfg::kMission.fix_common_xy_m;  ///< of c
  double common_yaw_rad = cfg::kMission.fix_common_yaw_rad;
  double common_length_m = cfg::kMission.fix_common_length_m;
  double gate_chi2 = 27.9;      ///< three degrees of freedom: 4e-6 of the good are refused
  double surprise_chi2 = 11.3;  ///< 1 %
  double claim_chi2 = 4.1;      ///< three degrees of freedom: a quarter of the true starts counts for nothing
  double heading_gate_chi2 = 21.3;  ///< one degree of freedom: 4e-6 of the good are refused
  double unseen_step_m = cfg::kMission.unseen_step_m;  ///< sigma of what a frame without VO and prior hides
  double unseen_step_rad = cfg::kMission.unseen_step_rad;
  double prior_share = cfg::kMission.prior_share;          ///< of a motion prior's length and turn
  double prior_sigma_rad = cfg::kMission.prior_sigma_rad;  ///< and of its yaw, each frame
};

/// x, y, yaw, k, w, and what fixes have in common: c_x, c_y, c_yaw.
using ErrorVector = Eigen::Matrix<double, 8, 1>;
using ErrorCovariance = Eigen::Matrix<double, 8, 8>;

/// A step of VO as the map sees it.
struct PlanarStep {
  Vec2 d_map_m = Vec2(0.0, 0.0);
  double turn_rad = 0.0;
  Mat3 covariance = Mat3::Zero();  ///< x, y, yaw, in map
  bool sound = true;               ///< nothing speaks against it
};
/// From VO's covariance (vo/motion.hpp, right of the step in the camera) that of the rover's x, y and
/// yaw in map.
Mat3 planar_covariance(const Mat6& of_camera, const Pose3& T_rover_cam, const Pose3& T_map_rover);

/// A registration on its own, without prior: correction of the snapshot's pose (x, y, yaw in map)
/// and its covariance.
struct FixOffset {
  Vec3 offset = Vec3(0.0, 0.0, 0.0);
  Mat3 covariance = Mat3::Identity();
};

// ---- the filter's three equations, for the forecast as well ------------------------------------------

ErrorCovariance errors_at_start(const FusionParams& params, double sigma_xy_m, double sigma_yaw_rad);
struct ErrorGrowth {
  ErrorCovariance F = ErrorCovariance::Identity();
  ErrorCovariance Q = ErrorCovariance::Zero();
};
ErrorGrowth growth(const FusionParams& params, const PlanarStep& step);
/// F P F' + Q, symmetric to the bit.
ErrorCovariance grown(const ErrorCovariance& P, const ErrorGrowth& growth);
struct ErrorUpdate {
  ErrorVector e = ErrorVector::Zero();
  ErrorCovariance P = ErrorCovariance::Zero();
  double chi2 = 0.0;
};
/// By a fix with `covariance` = R / fresh.
ErrorUpdate updated(const ErrorCovariance& P, const Vec3& offset, const Mat3& covariance);

// ---- the filter --------------------------------------------------------------------------------------

enum class CAIRN_NODISCARD FusionStatus : std::uint8_t {
  kFused,         ///< the correction is to be made
  kInconsistent,  ///< beyond the gate: nothing changed
  kBadInput,      ///< not finite, a covariance that is none, or a share not in (0, 1]: nothing changed
};

struct FusionResult {
  FusionStatus status = FusionStatus::kBadInput;
  double chi2 = 0.0;  ///< of the offset, three degrees of freedom
  Pose2 at_snapshot;  ///< turn about where the rover was at the snapshot, and shift, in map ...
  Pose2 since;        ///< ... and then about where it is now: what the rates change of the steps since
};

class PoseFusion {
 public:
  static constexpr double kAnywhere_m = 1.0e4;  ///< sigma of a pose that is lost

  void init(const FusionParams& params, double sigma_xy_m, double sigma_yaw_rad);

  /// From now on fixes are by another map, whose own error is of this sigma and has nothing to do with what
  /// fixes had in common before.
  void other_map(double common_xy_m);

  /// The step (rover frame, T_prev_cur) as the rates say it really was.
  Pose3 calibrated(const Pose3& step) const;
  /// VO measured a step (calibrated) from the last frame that it measured or gave up.
  void propagate(const PlanarStep& step);
  /// Frames that went by without VO or prior.
  void hold(std::uint32_t frames);
  /// A frame without VO, moved by a motion prior (any frame; length and angle count).
  void coast(const Pose3& prior_step);
  /// The step that VO is about to measure may be off by so much.
  void doubt(double xy_m, double yaw_rad);
  /// VO is about to measure from its reference: what was hidden since comes to nothing.
  void caught_up();
  /// VO's reference is lost: what was hidden stays in P.
  void give_up();
  /// The pose may be anywhere, at any heading: it was refuted, or it is given up for lost.
  void lose();

  /// Sigma of all that was hidden or doubted since the last sound step.
  double unsound_xy_m() const { return run_.xy_m + hidden_.xy_m; }
  double sigma_xy_m() const;  ///< root of the mean variance of x and y
  double sigma_yaw_rad() const;
  /// Of the rover's x, y and yaw in `map`, with what is hidden ...
  Mat3 covariance() const;
  /// ... and of the snapshot's pose, which the next fix speaks of.
  Mat3 covariance_at_snapshot() const;
  /// That of a pose which was known with `covariance` at the snapshot, by the steps since.
  Mat3 carried(const Mat3& covariance) const;
  /// What a local map that reaches `far_m` from the pose is aside by rates that are not known: k shifts it by
  /// k far, w turns it by w far and shifts it by half of w far^2. Taken for an error of its own.
  Mat3 bend(double far_m) const;
  double scale() const { return rates_.scale; }                    ///< k
  double turn_rad_per_m() const { return rates_.turn_rad_per_m; }  ///< w

  /// The pose that the next fix speaks of is the present one, or the last one before it that is not hidden.
  void snapshot();
  /// Takes in a registration of the snapshot's pose.
  FusionResult update(const FixOffset& fix, double fresh);
  /// The same of a start that no fix has proven.
  FusionResult prove(const FixOffset& fix);
  /// Found anew: the pose before counts for nothing, and the rates fall back to those before the last fix,
  /// which is disowned. kFused or kBadInput.
  FusionResult relocate(const FixOffset& fix);
  /// Takes in that yaw is off by `offset_rad`, where the rover is now (at_snapshot is of the present pose,
  /// `since` is nothing). Not between a snapshot and its update.
  FusionResult heading(double offset_rad, double variance_rad2);

 private:
  struct Rates {
    double scale = 0.0;
    double turn_rad_per_m = 0.0;
  };
  struct Unseen {
    double xy_m = 0.0;
    double yaw_rad = 0.0;
  };
  double hidden_variance_m2() const;
  double hidden_variance_rad2() const;
  ErrorCovariance anywhere(const ErrorCovariance& P) const;
  FusionResult fuse(const FixOffset& fix, double fresh, double gate_chi2);
  FusionResult take(const ErrorUpdate& update, bool with_rates);
  void correct_rates(const ErrorVector& e);

  FusionParams params_;
  ErrorCovariance P_ = ErrorCovariance::Zero();
  Rates rates_;
  Rates rates_before_fix_;
  Unseen hidden_;               ///< since VO's reference
  Unseen run_;                  ///< given up or doubted since the last sound step: in P
  Vec3 common_ = Vec3::Zero();  ///< c, as it was estimated
  Vec3 snapshot_common_ = Vec3::Zero();
  ErrorCovariance snapshot_P_ = ErrorCovariance::Zero();
  ErrorGrowth since_snapshot_;
};

}  // namespace cairn
