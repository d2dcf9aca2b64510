/// A pose that the evidence speaks for and does not prove, carried along until later windows prove it.
///
/// Where a window's evidence is too little for a proof, its best pose is kept as a hypothesis of where the
/// site lies in the map. Odometry carries it: it stays where it is in `site`, and its covariance grows with
/// the steps. It is the prior for what later windows see of boulders that no window before them held, and
/// their evidence adds up (registration/evidence_sum.hpp). Another one takes its place only with more
/// evidence in one window than this one has in all, so that each is a draw of its own.
///
/// No boulder counts twice, nor does one beside it: blocks of a cluster are one coincidence. The places in
/// `site` of those that counted are kept; a local boulder is fresh where it lies farther from each than
///     kSameBoulder_m + 3 (drift + drift of yaw times its distance from the rover)
/// drift: sum of what each stretch between two windows adds to sigma, so that a boulder that is met again on
/// the way back is known, too.
///
/// It ends where its evidence speaks against it (EvidenceSum::drop), where the map agrees with another pose
/// next to it, where it has grown as uncertain as a start that is not known, and where there is no room for
/// more places. The caller ends it with a fix, a start pose, another map, and where VO lost its way.
///
/// Cost of mark(): 5 operations for each local boulder and place.
#pragma once

#include "geometry/boulder.hpp"
#include "localizer/pose_fusion.hpp"
#include "registration/evidence_sum.hpp"

namespace cairn {

class CarriedHypothesis {
 public:
  static constexpr double kSameBoulder_m = 0.5;  ///< blocks that fell together agree or fail together
  static constexpr std::size_t kPlaces = cfg::kMaxLocalBoulders;

  void reset();
  bool alive() const { return sum_.windows() > 0; }
  /// From a window's best pose; `covariance` of the rover's x, y and of yaw in map.
  void begin(const Verdict& window, const Pose2& T_map_site, const Mat3& covariance, const LocalMap& local);
  /// To the present, over the steps since the fusion's last snapshot; ends beyond these sigmas. `yaw_rad`: of
  /// the fusion's T_map_site.
  void carry(const PoseFusion& fusion, double yaw_rad, double most_xy_m, double most_yaw_rad);
  /// Tells each local boulder whether it has counted; returns how many have not.
  std::size_t mark(LocalMap& local, const Vec2& rover_site_m) const;
  /// What a window says of it, searched with it as the prior over the boulders of `local` that are fresh.
  void add(const Verdict& window, const Pose2& T_map_site, const Mat3& covariance, const LocalMap& local);

  const EvidenceSum& sum() const { return sum_; }
  const Pose2& T_map_site() const { return T_map_site_; }
  const Mat3& covariance() const { return covariance_; }

 private:
  struct Place {
    float x_m = 0.0F;
    float y_m = 0.0F;
  };

  EvidenceSum sum_;
  Pose2 T_map_site_;
  Mat3 covariance_ = Mat3::Zero();
  double drift_m_ = 0.0;
  double drift_rad_ = 0.0;
  FixedVector<Place, kPlaces> places_;
};

}  // namespace cairn
