/// What speaks against visual odometry, though it found a motion: pictures that are none of now, and motion
/// that another sensor contradicts.
///
/// Frozen pictures. No two pictures of a camera are alike to the bit, for its noise. Where a CRC over every
/// `row_step`-th row of a side is that of one of the last kKept pairs used, the camera or a buffer delivered
/// an old picture: VO would measure a rover that stands, or goes back.
///
/// Motion prior. With T = prior^-1 vo, seen from above, d = (x, y, yaw) of it and
///
///   C = f^2 V + diag(s^2, s^2, w^2)
///   s = watch_sigma_m + prior_share |prior's way|,  w = watch_sigma_rad + prior_share |prior's turn|
///
/// d' C^-1 d is chi-squared with three degrees of freedom where both tell the truth. Beyond `gate_chi2` one
/// of them does not, and it is not told which (a wheel that slips, a VO that follows the rover's own shadow):
/// the pose stays VO's, and what they differ by goes into its uncertainty.
///
/// A view that mostly stands still. Points that stand still while others move are the rover's own hardware,
/// and VO leaves them out. Where they are the majority they may as well be the ground, and what moves an arm
/// or dust: the pose stays VO's, and its whole step goes into its uncertainty, unless a motion prior agrees
/// with VO and not with a rover that stands.
///
/// Source: innovation test, as in pose_fusion.hpp.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/enum_count.hpp"
#include "core/nodiscard.hpp"
#include "geometry/pose3.hpp"
#include "image/image_view.hpp"
#include "mission_cfg.hpp"

namespace cairn {

enum class CAIRN_NODISCARD WatchStatus : std::uint8_t {
  kClear,         ///< nothing speaks against it
  kFrozen,        ///< a picture is the one before's: the pair is not used
  kContradicted,  ///< the motion prior tells of another motion
  kOwnHardware,   ///< points stand still in the picture while the others move: they were left out
  kMostlyStill,   ///< these are most of what is seen: perhaps the rover stands, and something else moves
  kJumped,        ///< boulders in view are not where they were (boulder_tracks.hpp): VO missed a motion
};
inline constexpr std::size_t kWatchStatusCount = 6;
static_assert(enum_has<WatchStatus, kWatchStatusCount>());

struct WatchParams {
  int row_step = 16;  ///< at least 1
  double vo_sigma_factor = cfg::kVoSigmaFactor;
  double prior_share = cfg::kMission.prior_share;
  double watch_sigma_m = cfg::kMission.watch_sigma_m;
  double watch_sigma_rad = cfg::kMission.watch_sigma_rad;
  double gate_chi2 = 27.9;  ///< 4e-6 of the true ones
};

class VoWatch {
 public:
  static constexpr int kKept = 8;

  void init(const WatchParams& params);
  /// kClear or kFrozen; a picture that is missing is not frozen.
  WatchStatus look(const ImageU8& left, const ImageU8& right);
  /// VO used the pair that was looked at last.
  void used();
  /// kClear or kContradicted. Steps of the rover; `covariance` is VO's, of x, y and yaw.
  WatchStatus compare(const Pose3& vo_step, const Mat3& covariance, const Pose3& prior_step) const;

 private:
  struct Sum {
    bool any = false;
    std::uint32_t crc = 0;
    bool operator==(const Sum& b) const { return any && b.any && crc == b.crc; }
  };
  struct Sums {
    Sum left;
    Sum right;
  };
  Sum sum_of(const ImageU8& image) const;

  WatchParams params_;
  Sums looked_;
  Sums used_[kKept];  ///< a ring
  int next_ = 0;
};

}  // namespace cairn
