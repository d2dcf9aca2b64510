/// How uncertain height and tilt (pitch and roll) are, and what a measured direction of gravity says of them.
///
/// VO's tilt drifts, and a tilt makes the way climb that does not: height is off by the tilt times the way.
/// A rover that stands measures gravity, and a map that carries heights tells both. An extended Kalman
/// filter on the errors e = (z, a_x, a_y, b_roll, b_pitch): height; a small turn a about the axes of `map`,
/// so that R_true = exp(a) R_map_rover; and the turn per metre that VO lacks about the rover's forward and
/// left axes. x, y and yaw are those of pose_fusion.hpp; what would couple the two filters, a slope times a
/// turn, is of second order.
///
///   step       displacement D (map, m), length ds, heading psi, covariance V of VO (z, a_x, a_y, in map):
///              z += a_x D_y - a_y D_x,  a += Rz(psi) b ds,  P = F P F' + f^2 V + ds diag(q)
///   q          noise_z^2, noise_tilt^2, noise_tilt^2, turn_walk^2, turn_walk^2
///   gravity    `up` in the rover frame, sigma (rad, about any horizontal axis): v = R_map_rover up is
///              (-a_y, a_x, 1) but for noise, so (v_y, -v_x) = a + n. Its length is 1 to kUpLengthError:
///              what is farther off was not gravity alone
///   gate       d = r' S^-1 r with two degrees of freedom. Beyond gate_chi2 nothing changes
///   ground     z and a against the map's ground (ground_height.hpp), r with covariance R: r = (z, a) + n,
///              gated likewise with three.
///              What the map's heights are off is the same for many measurements and averages out in none:
///              g, the share that the map has in z and a, grows by each gain; sigmas have g times it on top.
///              Ground that surprises says that the map contradicts itself, or that the pose is lost: from
///              then on the map is believed no better than by as much as it was off, a little less with each
///              ground that is taken
///
/// The height's error is that since the start: of the start's own height nothing is known here, until the
/// first ground is measured. From then on it is that in `map`; before it the start's own sigma is added.
///
/// Frames that VO does not measure hide a tilt and a climb, as in pose_fusion.hpp: kept apart until VO has
/// measured the whole way (`caught_up`) or its reference is lost (`give_up`). Here they are simply added.
///
/// Without a measurement nothing is corrected, and `calibrated` gives the step back to the bit.
///
/// Source: Kalman filter, e.g. Maybeck 1979, chapter 5; error states as in Sola 2017, "Quaternion kinematics
/// for the error-state Kalman filter", section 7 (global angular errors). Cost: some 600 multiplications a
/// step, the same for a measurement.
#pragma once

#include "core/enum_count.hpp"
#include "core/nodiscard.hpp"
#include "geometry/pose3.hpp"
#include "mission_cfg.hpp"

namespace cairn {

struct TiltParams {
  /// Of the start's pitch and roll, each: 0.2 degrees, an accelerometer's reading.
  double sigma_start_rad = 0.0035;
  /// Of b at the start: four times what rendered drives gave with an exact calibration.
  double sigma_turn_rad_per_m = 0.0004;
  double max_turn_rad_per_m = cfg::kMission.max_drift_yaw_rad_per_m;  ///< |b| is never beyond it
  double turn_walk_rad_per_m = 0.00003;                               ///< of b, per square root of a metre
  double vo_sigma_factor = cfg::kVoSigmaFactor;                       ///< f
  double noise_tilt_rad = cfg::kMission.drift_noise_yaw_rad;          ///< of one metre
  double noise_z_m = cfg::kMission.drift_noise_xy_m;                  ///< of one metre
  double sigma_start_z_m = 1.0;        ///< of the start's height in `map`, where the map tells heights
  double ground_gate_chi2 = 28.5;      ///< three degrees of freedom: 3e-6 of the good are refused
  double ground_surprise_chi2 = 11.3;  ///< likewise, one in a hundred
  double gate_chi2 = 24.9;             ///< two degrees of freedom: 4e-6 of the good are refused
  double unseen_step_m = cfg::kMission.unseen_step_m;  ///< sigma of what a frame without VO and prior hides
  double unseen_step_rad = cfg::kMission.unseen_step_rad;
  double prior_share = cfg::kMission.prior_share;  ///< of a motion prior's length and turn
  double prior_sigma_rad = cfg::kMission.prior_sigma_rad;
};

/// A step of VO, as height and tilt see it.
struct TiltStep {
  Vec2 d_map_m = Vec2(0.0, 0.0);
  double yaw_rad = 0.0;            ///< of the rover in map, after it
  Mat3 covariance = Mat3::Zero();  ///< z, a_x, a_y, in map
};
/// From VO's covariance (vo/motion.hpp, right of the step in the camera) that of the rover's z, a_x and a_y.
Mat3 tilt_covariance(const Mat6& of_camera, const Pose3& T_rover_cam, const Pose3& T_map_rover);

/// What became of a measured attitude: gravity's or a heading's.
enum class CAIRN_NODISCARD AttitudeStatus : std::uint8_t {
  kNone,          ///< none came
  kFused,         ///< the pose was corrected
  kWaiting,       ///< of a heading: a fix is under way, and it is taken when that is done
  kPassedOver,    ///< of a heading that waited: a newer one came, or the pose was guessed
  kInconsistent,  ///< farther off than sigma allows: nothing changed
  kNoPose,        ///< VO has not told the pose of this frame
  kPaper,         ///< the paper's variant takes none
  kBadInput,      ///< not finite, no unit vector, or a sigma out of its range
};
inline constexpr std::size_t kAttitudeStatusCount = 8;
static_assert(enum_has<AttitudeStatus, kAttitudeStatusCount>());

/// A sigma may be from better than any star tracker to a radian, where small angles end.
inline constexpr double kLeastAttitudeSigma_rad = 1e-4;
inline constexpr double kMostAttitudeSigma_rad = 1.0;
inline constexpr double kUpLengthError = 0.01;

struct TiltResult {
  AttitudeStatus status = AttitudeStatus::kBadInput;
  double chi2 = 0.0;
  double z_m = 0.0;                ///< to be added to the height, and ...
  Vec2 turn_map = Vec2(0.0, 0.0);  ///< ... a: exp(a) to be put to the left of the attitude in map
};

class AttitudeFusion {
 public:
  void init(const TiltParams& params);

  /// The step (rover frame, T_prev_cur) with the turn that VO lacks.
  Pose3 calibrated(const Pose3& step) const;
  /// VO measured a step (calibrated) from the last frame that it measured or gave up.
  void propagate(const TiltStep& step);
  void hold(std::uint32_t frames);
  void coast(const Pose3& prior_step);
  void doubt(double xyz_m, double turn_rad);
  void caught_up();
  void give_up();

  /// Gravity, measured where the rover stands now; nothing may be hidden. Takes in what it returns.
  TiltResult gravity(const Quat& R_map_rover, const Vec3& up_rover, double sigma_rad);

  /// The ground in view stands by `offset` (z, a) off where it is on the map. Nothing may be hidden. Takes in
  /// what it returns. `least`: sigmas that are in `covariance` and in all other such measurements alike.
  TiltResult ground(const Vec3& offset, const Mat3& covariance, const Vec3& least);
  /// The rover is elsewhere than it was thought to be, or the map another: its height there is not known.
  void leave_ground() { on_map_ = false; }

  double sigma_z_m() const;       ///< since the start; with what is hidden
  double sigma_tilt_rad() const;  ///< root of the mean variance of a_x and a_y; with what is hidden
  double roll_rad_per_m() const { return turn_[0]; }
  double pitch_rad_per_m() const { return turn_[1]; }

 private:
  double variance_of_map(int i) const;

  using Covariance = Eigen::Matrix<double, 5, 5>;

  TiltParams params_;
  Covariance P_ = Covariance::Zero();
  Vec2 turn_ = Vec2(0.0, 0.0);  ///< b
  double hidden_m_ = 0.0;       ///< since VO's reference
  double hidden_rad_ = 0.0;
  bool on_map_ = false;                      ///< the height is that of the map
  Vec3 map_share_ = Vec3(0.0, 0.0, 0.0);     ///< g, of z and a
  Vec3 map_variance_ = Vec3(0.0, 0.0, 0.0);  ///< what the map says to be off (m2, rad2)
  Vec3 contradicted_ = Vec3(0.0, 0.0, 0.0);  ///< and what it was seen to be off
};

}  // namespace cairn
