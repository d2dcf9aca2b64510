/// A lost rover found again, or told that it is not: the whole map is read, the local map is looked for in it
/// at any heading (registration/lost_search.hpp), and the best poses are weighed by the verdict of every
/// other fix (registration/verdict.hpp). A job; the rover may keep driving while it runs, since the answer is
/// where the site lies in the map.
///
/// The prior is flat: anywhere in the map's ground, or in the region that was given. The other poses that the
/// search came upon are its decoys: what this local map scores on this map where it is not.
///
/// Scale. The poses that the search came upon are weighed once more, with the map's scale left free within
/// `scale_sigma`: the metre of a projection is not always one. The result is the first weighing's, unless the
/// second alone is accepted, or is kScaleMargin nats likelier.
///
/// Order: read the map, index it, search, weigh up to LostSearch::kHits poses, judge. Where the region holds
/// more boulders than the wide map has room for, the answer is kMapTooLarge: a smaller one has to be given.
///
/// Cost. 25 operations a boulder to read, some 150 to index, then the search's; units as those of its parts.
#pragma once

#include <cstdint>

#include "core/nodiscard.hpp"
#include "orbital_map/map_reader.hpp"
#include "registration/lost_search.hpp"
#include "registration/pose_search.hpp"
#include "registration/verdict.hpp"

namespace cairn {

enum class CAIRN_NODISCARD RelocationStatus : std::uint8_t {
  kIdle,            ///< never started
  kRunning,         ///< call step() again
  kJudged,          ///< the verdict says whether to believe the pose
  kNotFound,        ///< no pose with enough evidence to be weighed
  kNoMap,           ///< no usable map, or no boulder in the region
  kMapTooLarge,     ///< more boulders in the region than the wide map holds
  kTooFewBoulders,  ///< local ones
  kBadInput,
};

struct RelocationParams {
  LostSearchParams search;
  EvidenceParams evidence;
  VerdictParams verdict;
  double scale_sigma = 0.03;  ///< of the map's scale, [0, 0.2]; 0: not looked for
};

struct RelocationResult {
  Verdict verdict;
  Evidence best;
  Pose2 T_map_site;                ///< of best: the pivot is mapped exactly
  Mat3 covariance = Mat3::Zero();  ///< of the pivot's x, y and of yaw, in map
  double scale = 1.0;              ///< lengths of the map over those of the local map
  double scale_sigma = 0.0;        ///< 0: not looked for
  std::uint32_t hypotheses = 0;    ///< looked at
  int decoys = 0;
};

class Relocation {
 public:
  /// Room that other searches use too: borrowed from start() until done, whatever it holds.
  struct Room {
    MapBoulders& window;
    Ground& ground;
  };
  /// `map`'s bytes are borrowed until done; the local map is copied.
  RelocationStatus start(const RelocationParams& params, const OrbitalMap& map, const LocalMap& local,
                         const Vec2& pivot_site_m, const SearchRegion& region, const Room& room);
  Progress step(WorkBudget& budget);  ///< the same bits for every slicing
  RelocationStatus status() const { return status_; }
  const RelocationResult& result() const { return result_; }
  const LostSearch& search() const { return search_; }
  const Sightings& sightings() const { return sightings_; }  ///< that the poses were weighed by
  std::uint32_t map_boulders() const { return static_cast<std::uint32_t>(wide_map_.size()); }

 private:
  enum class Phase : std::uint8_t { kRead, kIndex, kSearch, kWindow, kGround, kSight, kWeigh, kAgain };

  void begin_search();
  void begin_window();
  void begin_ground();
  void sight_next();
  void next_hit();
  void judge_all();
  void judged();

  RelocationParams params_;
  OrbitalMap map_;
  LocalMap local_;
  Vec2 pivot_site_m_ = Vec2(0.0, 0.0);
  SearchRegion region_;
  RelocationStatus status_ = RelocationStatus::kIdle;
  Phase phase_ = Phase::kRead;
  double reach_m_ = 0.0;  ///< of the farthest local boulder from the pivot
  MapReader reader_;
  WideMap wide_map_;
  LostSearch search_;
  std::size_t hit_ = 0;
  MapBoulders* window_ = nullptr;  ///< borrowed, as is ground_
  Vec2 window_centre_m_ = Vec2(0.0, 0.0);
  double window_radius_m_ = 0.0;
  bool window_full_ = false;
  Ground* ground_ = nullptr;
  Sightings sightings_;
  std::size_t sighted_ = 0;  ///< local boulders looked at
  PosePrior prior_;
  EvidenceJob evidence_;
  struct Weighed {
    Evidence evidence;
    Vec2 centre_map_m = Vec2(0.0, 0.0);
  };
  FixedVector<Weighed, LostSearch::kHits> weighed_;
  RelocationResult result_;
};

}  // namespace cairn
