/// How far the pose may be believed, by what it was made of. Sigma tells how large the error may be if all is
/// as modelled; trust tells whether it is. A pose that is refuted (kFixRefuted) or lost has the sigma of one
/// that may be anywhere, at any heading (PoseFusion::lose).
///
/// Latched: once a step was guessed, good steps after it do not make the pose good again, since an error
/// stays. What does is a fix, or a start pose by command; and where VO bridges frames without a picture from
/// a reference before them, nothing was guessed after all.
///
/// A start pose is a claim from the ground and confirms nothing: until a fix is accepted, what the table
/// calls confirmed is kClaimed, and sigma is the claim's, as wrong as that may be. One that claims less than
/// the mission drives by (TrustParams) is not even so.
/// Nor does it weigh as a measurement: where its own sigmas hold no fix, the first one is looked for
/// `doubt` farther than they say, and what the claim then counts is told in pose_fusion.hpp.
///
/// | event            | confirmed   | coasting    | unconfirmed | lost      |
/// |------------------|-------------|-------------|-------------|-----------|
/// | kStartGiven      | claimed     | claimed     | claimed     | claimed   |
/// | kStartWide       | unconfirmed | unconfirmed | unconfirmed | unconfirmed |
/// | kStartUnknown    | lost        | lost        | lost        | lost      |
/// | kStepMeasured    |             |             |             |           |
/// | kCaughtUp        |             | confirmed   |             |           |
/// | kHeld            | coasting    |             |             |           |
/// | kGuessed         | unconfirmed | unconfirmed |             |           |
/// | kDoubted         | unconfirmed | unconfirmed |             |           |
/// | kFixAccepted     | confirmed   |             | confirmed   | confirmed |
/// | kFixInconsistent | unconfirmed | unconfirmed |             |           |
/// | kFixDeclined     |             |             |             |           |
/// | kFixUndecided    |             |             |             |           |
/// | kFixRefuted      | unconfirmed | unconfirmed | lost        |           |
///
/// (an empty place: stays as it is). `lost_after` events of kFixDeclined and kFixInconsistent without
/// kFixAccepted or a command between them: lost, from any state. kFixUndecided neither counts nor
/// ends the row.
///
/// A fix speaks of the frame of its snapshot or, where that was held, of the last one before it that was not.
/// Frames that were held or guessed between that and its arrival it does not confirm: kFixAccepted then leads
/// to where these frames would have led from a confirmed pose.
#pragma once

#include <cstdint>

#include "core/eigen.hpp"
#include "core/enum_count.hpp"
#include "mission_cfg.hpp"

namespace cairn {

enum class Trust : std::uint8_t {
  kConfirmed,    ///< every step since the last fix was measured
  kCoasting,     ///< no usable pair now: held, or moved by motion priors; VO may yet bridge it
  kUnconfirmed,  ///< the start was wide, a step was guessed or doubted, or a fix contradicts
  kLost,         ///< where the rover is, is not known: only a fix or a start pose ends this
  kClaimed,      ///< every step since the start was measured, and no fix has confirmed the start
};
inline constexpr std::size_t kTrustCount = 5;
static_assert(enum_has<Trust, kTrustCount>());

enum class TrustEvent : std::uint8_t {
  kStartGiven,       ///< by command
  kStartWide,        ///< by command, with a sigma beyond TrustParams
  kStartUnknown,     ///< by command
  kStepMeasured,     ///< VO, from the pair before
  kCaughtUp,         ///< VO, over all that was held or missed since its reference
  kHeld,             ///< a pair that VO cannot use; its reference stands
  kGuessed,          ///< VO's reference is lost: the step is the motion prior's or the last one's, for good
  kDoubted,          ///< VO's step contradicts the motion prior (localizer/vo_watch.hpp)
  kFixAccepted,      ///< the map confirms the snapshot's pose, corrected or found anew
  kFixInconsistent,  ///< the map agrees with a pose that sigma does not allow, or boulders in view do not
  kFixDeclined,      ///< evidence was there to decide, and it did not speak for the pose
  kFixUndecided,     ///< too little evidence, no map, not in time: tells nothing
  kFixRefuted,  ///< too little evidence again and again, where it speaks against the pose; and after that
                ///< nothing in the whole map either
};
inline constexpr int kTrustEvents = 13;

struct TrustParams {
  int lost_after = cfg::kMission.lost_after_fixes;  ///< at least 1
  /// The widest start pose that is taken at its word, standard deviations.
  double start_sigma_xy_m = cfg::kMission.confirmed_start_xy_m;
  double start_sigma_yaw_rad = cfg::kMission.confirmed_start_yaw_rad;
  /// What a start pose may be off beside its own sigmas, standard deviations.
  double doubt_xy_m = 0.25;
  double doubt_yaw_rad = 0.03;
};

class TrustState {
 public:
  /// kLost: no start pose yet.
  void init(const TrustParams& params);
  /// kStartGiven or kStartWide.
  TrustEvent start_of(double sigma_xy_m, double sigma_yaw_rad) const;
  /// The frame that the next fix speaks of.
  void snapshot() { since_ = held_ ? Trust::kCoasting : Trust::kConfirmed; }
  void on(TrustEvent event);

  Trust state() const { return claimed_ && state_ == Trust::kConfirmed ? Trust::kClaimed : state_; }
  /// No fix was accepted since the start.
  bool unproven() const { return claimed_; }
  /// Covariance of x, y and yaw that is added to the pose's own, to look for a fix farther away.
  Mat3 doubt() const;

 private:
  TrustParams params_;
  Trust state_ = Trust::kLost;       ///< the table's
  bool claimed_ = true;              ///< unproven
  Trust since_ = Trust::kConfirmed;  ///< the state, were the pose of the snapshot confirmed
  bool held_ = false;                ///< frames since VO's reference, whatever the state
  std::uint32_t refusals_ = 0;       ///< kFixDeclined and kFixInconsistent in a row
};

}  // namespace cairn
