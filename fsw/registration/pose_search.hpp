/// The pose of the local map looked for in all of what the prior leaves room for, and the verdict on it.
///
/// How. Pairs of local boulders (0.5 to 2 rms radii apart, each boulder in as many as the others) are laid
/// on pairs of map boulders of the same length and direction within reach: `reach_sigmas` of the prior in
/// x, y and yaw, and around that a ring that gives decoys (registration/verdict.hpp). Each such hypothesis
/// is looked at boulder by boulder, nearest to the pair's middle first, where it is surest: with t^2 = s^2
/// (1.5 + 2 d^2 / L^2) at distance d from the middle of a pair of length L,
///     sum of max( ln(1-p), ln(p / (2 pi lambda t^2)) - r^2 / (2 t^2) )
/// with r the distance to the nearest boulder; given up where that falls below `give_up`. The best distinct
/// ones, inside and outside of the prior's reach, are refined and weighed (EvidenceJob); then judge(). No
/// luck is needed: a true pair among the pairs looked at is enough, and of 32 pairs of boulders of which
/// half are true, none is with a probability of 1e-4.
///
/// Where the prior's reach holds nothing acceptable, and the ring around it a pose that would have been
/// accepted there, unique and second_margin better, the verdict is kInconsistentWithPrior, and
/// `elsewhere` that pose.
///
/// Scale. The metre of a map's projection is not always one, nor is VO's. An accepted pose is refined once
/// more with the map's scale left free within scale_sigma; where that is kScaleMargin nats likelier, its
/// volume paid for, it is the result, and tells the scale.
///
/// Distinct: the local map's middle farther than 4 s apart, or turned by more than 4 s over its rms radius.
///
/// Room. The map window must hold the local map wherever the search looks: window radius at least 4 sigma
/// and the farthest local boulder, and the poses looked at must reach `least_ring` mean spacings far, else
/// what chance does on this map is not known: kNoSearchRoom. To give the ring its whole width, a window
/// should have reach_sigmas sigma + farthest local boulder + ring / sqrt(density).
///
/// Cost. start(): copies the local map, start_ops(), for who calls it. Then map boulders within
/// reach times pairs, some 10 looks each; no unit above 5,000 operations, or sort_ops(), which is more from
/// 264 local boulders on. Static memory: sizeof(PoseSearchJob), under kPoseSearchMaxBytes.
#pragma once

#include <cstdint>

#include "core/nodiscard.hpp"
#include "core/trig.hpp"
#include "core/work_budget.hpp"
#include "registration/verdict.hpp"

namespace cairn {

struct PoseSearchParams {
  EvidenceParams evidence;
  VerdictParams verdict;
  double reach_sigmas = 5.0;  ///< [4, 8]
  int max_pairs = 32;         ///< of local boulders, [1, 4096]
  double give_up = -8.0;      ///< nats, [-100, 0]
  double ring = 2.0;          ///< width of the decoys' ring in mean spacings, [0, 10]
  double least_ring = 1.5;    ///< [0, 10]
  double scale_sigma = 0.03;  ///< of the map's scale about 1, [0, 0.2]; 0: not looked at
  bool fresh_only = false;    ///< local boulders that counted before are left out
};
inline constexpr double kScaleMargin = 3.0;  ///< nats

enum class CAIRN_NODISCARD SearchStatus : std::uint8_t {
  kIdle,
  kRunning,
  kDone,  ///< the verdict tells
  kNoMapBoulders,
  kNoLocalBoulders,  ///< fewer than two, near duplicates left out
  kNoSearchRoom,     ///< the map window is too small for the prior's sigma and the local map
  kBadInput,
};

struct SearchResult {
  Verdict verdict;
  Evidence best;                   ///< inside the prior's reach; in axes of map about the prior's pivot
  Pose2 T_map_site;                ///< of best, rigid part: the pivot is mapped exactly
  Mat3 covariance = Mat3::Zero();  ///< of the pivot's x, y and of yaw, in map
  double scale = 1.0;
  double scale_sigma = 0.0;      ///< 0: the scale is taken as 1
  Evidence elsewhere;            ///< best distinct pose outside the prior's reach; S = 0 where there is none
  std::uint32_t hypotheses = 0;  ///< looked at
  std::uint32_t looks = 0;       ///< at one local boulder each
  std::uint32_t cut = 0;         ///< partners that there was no room to list
  int pairs = 0;                 ///< of local boulders
  int refined = 0;
  int sightings = 0;  ///< local boulders less duplicates
  int decoys = 0;
  double density = 0.0;  ///< boulders a square metre at the pose
  double ring_m = 0.0;
};

class PoseSearchJob {
 public:
  static constexpr std::uint32_t start_ops(std::size_t local_boulders) {
    return 15U * static_cast<std::uint32_t>(local_boulders);
  }
  static constexpr std::uint32_t sight_ops(std::size_t sightings) {
    return 30U + 5U * static_cast<std::uint32_t>(sightings);
  }
  static constexpr std::uint32_t kPairOps = 40;
  static constexpr std::size_t kRankUnit = 64;  ///< sightings of a unit
  static constexpr std::uint32_t rank_ops(std::size_t sightings) {
    return 50U * static_cast<std::uint32_t>(sightings);
  }
  static constexpr std::uint32_t sort_ops(std::size_t sightings) {
    return 19U * static_cast<std::uint32_t>(sightings);
  }
  static constexpr std::uint32_t gather_ops(std::uint32_t query) { return 30U + query; }
  static constexpr std::uint32_t first_ops(std::uint32_t query) { return 40U + query; }
  static constexpr std::uint32_t kSecondOps = 60;
  static constexpr std::uint32_t look_ops(std::uint32_t query) { return 12U + query; }

  /// `window_radius_m`: the map boulders are all those within it about the prior's pivot.
  /// `covariance`: of the pivot's x, y and of yaw in map (m, m, rad), positive definite. The map
  /// is borrowed until step() has copied it, the local map is copied.
  SearchStatus start(const PoseSearchParams& params, const MapBoulders& map, double window_radius_m,
                     const LocalMap& local, const Pose2& T_map_site_prior, const Vec2& pivot_site_m,
                     const Mat3& covariance);
  Progress step(WorkBudget& budget);  ///< the same bits for every slicing
  SearchStatus status() const { return status_; }
  const SearchResult& result() const { return result_; }
  const Sightings& sightings() const { return sightings_; }
  /// Lent to other work until the next start(): a search that is under way ends.
  Ground& lend_ground() {
    status_ = SearchStatus::kIdle;
    return ground_;
  }

 private:
  static constexpr std::size_t kInside = 12;
  static constexpr std::size_t kOutside = 12;
  static constexpr std::size_t kSeconds = 128;
  enum class Phase : std::uint8_t {
    kGround,
    kSight,
    kPair,
    kRank,
    kSort,
    kGather,
    kFirst,
    kSecond,
    kLook,
    kRefine,
    kScale
  };

  struct Candidate {
    Hypothesis pose;
    Vec2 middle_m = Vec2(0.0, 0.0);  ///< of the local map, laid so
    double score = 0.0;
  };
  struct Ranked {
    std::uint16_t sighting = 0;
    double d2 = 0.0;         ///< squared distance from the pair's middle
    double c = 0.0;          ///< ln(p / (2 pi lambda t^2))
    double half_info = 0.0;  ///< 1 / (2 t^2)
    double radius = 0.0;     ///< beyond it a look is a miss
  };

  void sight_next();
  SearchStatus survey();
  bool next_pair();
  void rank(std::size_t end);
  void sort_ranked();
  BoulderQuery firsts_query() const;
  void gather_firsts(const BoulderQuery& piece);
  BoulderQuery seconds_query() const;
  void gather_seconds(const BoulderQuery& piece);
  bool hypothesise(std::uint16_t second);
  BoulderQuery look_query() const;
  bool all_seen(const BoulderQuery& piece, bool last);
  Progress follow_pair(WorkBudget& budget);
  bool look(const NearestBoulder& near);
  bool distinct(const Hypothesis& a, const Hypothesis& b) const;
  bool distinct(const Candidate& a, const Candidate& b) const;
  template <std::size_t N>
  void keep(FixedVector<Candidate, N>& list, const Candidate& candidate) const;
  void file();
  bool inside(const Hypothesis& pose) const;
  void start_refining();
  void refined();
  bool look_elsewhere();
  void conclude();
  void scaled();
  void tell_pose();

  PoseSearchParams params_;
  SearchStatus status_ = SearchStatus::kIdle;
  Phase phase_ = Phase::kGround;
  Pose2 T_map_site_prior_;
  Vec2 pivot_site_m_ = Vec2(0.0, 0.0);
  Vec2 pivot_map_m_ = Vec2(0.0, 0.0);
  PosePrior prior_;
  SinCos prior_turn_{0.0, 1.0};  ///< of its yaw
  PosePrior anywhere_;           ///< flat, for decoys
  EvidenceParams roughly_;       ///< for decoys: what they score is wanted, not where
  LocalMap local_;
  Ground ground_;
  Sightings sightings_;
  Vec2 middle_ = Vec2(0.0, 0.0);  ///< of the sightings
  double rms_radius_m_ = 1.0;
  double farthest_m_ = 0.0;
  double reach_m_ = 0.0;  ///< of the pivot from the prior's, ring included
  double reach_rad_ = 0.0;
  double cos_reach_ = -2.0;  ///< what the cosine of a turn within reach is at least
  double sigma_max_m_ = 0.0;

  std::size_t sighted_ = 0;  ///< cursor over the local map, and over those to be ranked
  int step_d_ = 0;           ///< cursor over pairs: difference of indices, and the first one
  int step_i_ = 0;
  std::uint16_t i_ = 0;
  std::uint16_t j_ = 0;
  double length_m_ = 0.0;  ///< 0: the pair is not to be looked at
  double play_m_ = 0.0;    ///< how much longer or shorter it may be in the map
  FixedVector<Ranked, cfg::kMaxLocalBoulders> ranked_;
  /// Of ranked_, the nearest to the pair's middle first.
  FixedVector<std::uint16_t, cfg::kMaxLocalBoulders> order_;
  FixedVector<std::uint16_t, cfg::kMaxMapWindowBoulders> firsts_;
  std::size_t first_ = 0;
  FixedVector<std::uint16_t, kSeconds> seconds_;
  std::size_t second_ = 0;
  Candidate current_;
  std::size_t looking_ = 0;  ///< cursor over order_
  std::uint32_t seen_ = 0;   ///< map boulders of the question under way
  NearestBoulder near_;      ///< among them
  double miss_ = 0.0;        ///< ln(1 - p)
  SizeRule sizes_;
  double cos_ = 1.0;
  double sin_ = 0.0;

  FixedVector<Candidate, kInside> inside_;
  FixedVector<Candidate, kOutside> outside_;
  std::size_t refining_ = 0;
  EvidenceJob evidence_;
  FixedVector<Evidence, kInside> weighed_;
  FixedVector<Evidence, kOutside> decoys_;
  SearchResult result_;
};
static_assert(sizeof(PoseSearchJob) <= cfg::kPoseSearchMaxBytes,
              "raise pose_search_max_bytes in mission_cfg");

}  // namespace cairn
