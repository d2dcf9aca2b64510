/// One fix by the map, as a job: the orbital boulders near the rover are read, the pose is looked for, and
/// the verdict says whether to believe it. Where the rover is lost, the same with the whole map.
///
///   kTracked  a Gaussian prior about the pose: window, registration/pose_search.hpp
///   kLost     no prior: localizer/relocation.hpp
///
/// The window holds the local map wherever the prior leaves room for it, and a ring around that for decoys:
///   radius = reach_sigmas sigma + farthest local boulder + ring / sqrt(density of the whole map)
/// Where it does not fit, or the prior is wide (`wide_xy_m` with more than `wide_boulders` in reach, or
/// `wide_yaw_rad`), the pose is looked for as when lost, in the disc and the sector that the prior allows:
/// pairs of boulders, rarest first, cost a hundredth of going through all poses there. With
/// search.fresh_only it is not: kNoSearchRoom.
///
/// Scale. Where the evidence is too little, the pose is looked for once more with the map's scale left free
/// within search.scale_sigma. What is accepted then has paid for it; else the result is the first one.
///
/// The result is what the map alone says, without the prior: a filter that weighs it against the pose must
/// not count the prior twice. With C the covariance that came out with the prior P, and off the offset from
/// the prior's mean,
///   information J = C^-1 - P^-1,  offset = off + J^-1 P^-1 off.
///
/// Fresh ones, which no fix before was made of, may be few beside those that prove the fix, and clutter.
/// Their own proof is the log likelihood ratio of 'they are on the map' against 'they are unrelated', with F
/// and off' their information and offset, the room that the prior left them paid for:
///   fresh_log + gain of their best over the fix's pose - 1/2 off'^T (P + F^-1)^-1 off' - 1/2 ln det(1 + P F)
/// Below zero, and where there are others, they are `fresh_unproven`.
///
/// Cost. Reading: 25 operations a boulder of the tiles that the window touches; then that of the parts.
#pragma once

#include <cstdint>

#include "core/enum_count.hpp"
#include "core/nodiscard.hpp"
#include "localizer/relocation.hpp"
#include "orbital_map/map_reader.hpp"
#include "registration/pose_search.hpp"

namespace cairn {

enum class CAIRN_NODISCARD MapFixStatus : std::uint8_t {
  kIdle,
  kRunning,            ///< call step() again
  kAccepted,           ///< the only one that may be fused
  kNoMap,              ///< no usable orbital map
  kNoMapBoulders,      ///< none near the rover
  kNoLocalBoulders,    ///< too few to register
  kNoSearchRoom,       ///< the map holds more boulders there than there is room for
  kNoHypothesis,       ///< nothing in reach agrees at all
  kInconsistent,       ///< what agrees is not where the prior says
  kTooLittleEvidence,  ///< unrelated boulders could agree as well
  kAmbiguous,          ///< another pose agrees nearly as well
  kChanceAgreement,    ///< this map agrees as well at poses that are wrong
  kWeakGeometry,       ///< accepted, but the pairs leave the pose too uncertain to weigh
  kBadInput,           ///< a prior that is not finite, or what the search refuses
  kViewDisagrees,      ///< boulders seen before agree, those in view do not: odometry missed a motion
};
inline constexpr std::size_t kMapFixStatusCount = 15;
static_assert(enum_has<MapFixStatus, kMapFixStatusCount>());
/// Nothing is proved where the prior leaves room for it, so that it may be the prior that is wrong.
constexpr bool may_lie_farther(MapFixStatus status) {
  return status == MapFixStatus::kInconsistent || status == MapFixStatus::kNoHypothesis ||
         status == MapFixStatus::kTooLittleEvidence;
}

struct MapFixParams {
  PoseSearchParams search;
  LostSearchParams lost;
  double map_window_radius_m = cfg::kMission.map_window_radius_m;  ///< at least
  double wide_xy_m = 0.3;                                          ///< sigma from which on the prior is wide
  double wide_boulders = 28.0;  ///< where more of the map's are in reach: as at wide_xy_m with 4 per m2
  double wide_yaw_rad = 0.1;
};
/// `covariance` of x, y, yaw; `per_m2`: boulders of the map.
bool prior_is_wide(const MapFixParams& params, const Mat3& covariance, double per_m2);

struct MapFixResult {
  Verdict verdict;
  Pose2 T_map_site;               ///< the best pose, with the prior, believed or not; the start's without one
  Mat3 posterior = Mat3::Zero();  ///< its covariance, of the pivot's x, y and of yaw in map
  Vec3 offset = Vec3(0.0, 0.0, 0.0);  ///< x, y, yaw of the pivot in map: what the map says, less the start
  Mat3 covariance = Mat3::Zero();     ///< of it, without the prior
  Vec3 fresh_offset = Vec3(0.0, 0.0, 0.0);  ///< what its fresh boulders alone say; found widely, all of them
  Mat3 fresh_covariance = Mat3::Zero();
  bool fresh_unproven = false;  ///< others prove the fix; what the fresh ones say may well be chance
  double far_m = 0.0;           ///< mean distance from the pivot of the boulders an accepted one was made of
  double scale = 1.0;           ///< lengths of the map over those of the local map
  double scale_sigma = 0.0;     ///< 0: not looked for
  double rms_m = 0.0;
  double pairs = 0.0;  ///< expected number of true ones
  std::uint32_t hypotheses = 0;
  std::uint16_t map_boulders = 0;  ///< in the window; 0xFFFF for more
  std::uint16_t sightings = 0;     ///< local boulders less duplicates
  /// The boulders are so many that, were the map's ground this ground, a proof was to be expected.
  bool proof_expected = false;
};

class MapFix {
 public:
  /// `T_map_site` and `pivot_site_m`: the pose before, of the rover at the snapshot. `covariance`: of the
  /// pivot's x, y and of yaw in map. The local map is copied, the map's bytes are borrowed until done.
  MapFixStatus start_tracked(const MapFixParams& params, const OrbitalMap& map, const LocalMap& local,
                             const Pose2& T_map_site, const Vec2& pivot_site_m, const Mat3& covariance);
  /// The same with no prior but the region.
  MapFixStatus start_lost(const MapFixParams& params, const OrbitalMap& map, const LocalMap& local,
                          const Pose2& T_map_site, const Vec2& pivot_site_m, const SearchRegion& region);
  Progress step(WorkBudget& budget);  ///< the same bits for every slicing
  MapFixStatus status() const { return status_; }
  const MapFixResult& result() const { return result_; }
  /// That of the last start; `fresh` falls where an accepted fix was made of a boulder.
  const LocalMap& local() const { return local_; }
  /// The fix that runs or ran last looks for the pose without the prior's help.
  bool lost() const { return phase_ == Phase::kRelocate; }
  /// Room for a window of the map, lent to other work until the next start: a fix that is under way ends.
  MapBoulders& lend_window() {
    status_ = MapFixStatus::kIdle;
    return window_;
  }

 private:
  enum class Phase : std::uint8_t { kWindow, kLay, kSearch, kRelocate };

  void begin(const MapFixParams& params, const OrbitalMap& map, const LocalMap& local,
             const Pose2& T_map_site, const Vec2& pivot_site_m);
  MapFixStatus relocate(const SearchRegion& region);
  MapFixStatus look_widely();
  SearchRegion region_of_prior() const;
  Progress read_window(WorkBudget& budget);
  void begin_search();
  bool off_map() const;  ///< the rover, by the pose before
  void take_search();
  void take_relocation();
  void tell_fresh(const Evidence& best, const Vec3& offset);
  bool fresh_may_be_chance(const Evidence& best, const Mat3& fresh_information) const;
  void mark_used(const Evidence& best, const Sightings& sightings);
  bool expects_proof(std::size_t boulders, double density) const;
  void judged(const Verdict& verdict, const Vec3& offset, const Mat3& with_prior,
              const Mat3& prior_information);

  MapFixParams params_;
  OrbitalMap map_;
  LocalMap local_;
  Pose2 T_map_site_;
  Vec2 pivot_site_m_ = Vec2(0.0, 0.0);
  Vec2 pivot_map_m_ = Vec2(0.0, 0.0);
  Mat3 prior_covariance_ = Mat3::Zero();
  double window_radius_m_ = 0.0;
  MapFixStatus status_ = MapFixStatus::kIdle;
  Phase phase_ = Phase::kWindow;
  MapReader reader_;
  MapBoulders window_;
  PoseSearchJob search_;
  Relocation relocation_;
  MapFixResult result_;
};

static_assert(sizeof(MapFix) <= cfg::kMapFixMaxBytes, "raise map_fix_max_bytes in mission_cfg");

}  // namespace cairn
