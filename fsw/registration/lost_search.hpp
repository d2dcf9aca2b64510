/// Where in the map is a rover that does not know? A job: the local map of ground boulders is looked for in a
/// wide map (doc/PAPER.md, unknown start), at any heading, or within a disc and a sector.
///
/// Method. A pair of local boulders fixes a pose for each pair of map boulders as far apart. Local pairs come
/// in the order of how few such map pairs there are to be expected (by length, and by size where both sides
/// have sizes), each boulder used less the more it has been used already. Up to kAtOnce of nearly the same
/// length go through the map together: its pairs are found once for all of them, by going through half of the
/// ring of buckets around each boulder, so that no table of pairs is stored. Each hypothesis is
/// looked at by Wald's sequential likelihood ratio test: local boulders, nearest to the pair's middle first,
/// are looked up in the map's raster, a hit adds ln(P(hit | same ground) / q), a miss ln(P(miss | same
/// ground) / (1 - q)), q the share of set cells around there; it is dropped once the sum is below
/// `floor_nats`, or what kChanceLooks looks cost an unrelated place, where that is less. What is left is
/// fitted to the map's points (three rounds of closest points within a shrinking gate) and scored by the
/// marginal likelihood ratio of 'same ground' against 'unrelated boulders of the density around here':
///   score = sum over all local boulders of ln[(1 - p) + (p / lambda) sum over map boulders of N(r; 0, s^2)]
///           + ln[(2 pi)^1.5 sqrt(det C) / V],
/// p the share of local boulders that the map holds, s the error of a pair on each axis, C the covariance of
/// the fitted pose, V the volume of all poses that were to be looked for. The boulders that made the
/// hypothesis need no exception: the volume pays for them. s grows with the distance from the middle, as
/// `drift` says. Where that is more than sigma_pair_m, what was fitted is fitted and scored once more without
/// drift, and the better of the two counts: good odometry is not to look like none.
///
/// The best poses that differ are kept. Where the best one passes `accept_nats`, its rivals are looked for:
/// what repeats itself agrees elsewhere nearly as well, with nearly the same local boulders, and a pair finds
/// it there where both of its boulders do. So the pairs that come next are of those that agree with the best
/// pose, and the search ends when kRivalPairs of them have been through the whole map, or kSincePairs of any;
/// or when pairs or work run out. Rivals count up to kEdge_m and kEdge_rad beyond the region as well: at its
/// edge the best pose has most of them there. It says where, not whether to believe it: the caller has its
/// own verdict, and `behind_nats()` for it.
///
/// Cost. Units: some boulders of the ring, a hypothesis, a local boulder of the fit. In 1 km2 with 10,000
/// boulders some 0.75 million operations a local pair, over 77 m with 8,500 some 6 million.
#pragma once

#include <cstdint>

#include "core/nodiscard.hpp"
#include "core/work_budget.hpp"
#include "geometry/boulder.hpp"
#include "geometry/pose2.hpp"
#include "registration/wide_map.hpp"

namespace cairn {

enum class CAIRN_NODISCARD LostStatus : std::uint8_t {
  kIdle,            ///< never started
  kRunning,         ///< call step() again
  kFound,           ///< the best pose passed accept_nats and lies margin_nats before the next
  kAmbiguous,       ///< it passed, and another place is nearly as good
  kNotFound,        ///< pairs or work ran out without a pose that passes
  kTooFewBoulders,  ///< fewer than four local boulders, or no two of them far enough apart
  kNoMap,           ///< the wide map is not ready, or empty
  kBadInput,        ///< NaN or infinity, or a parameter out of its range
};

/// Ranges in brackets.
struct LostSearchParams {
  double sigma_pair_m = 0.06;  ///< error of a pair on each axis, [1e-3, 1]
  double drift = 0.01;         ///< error of a distance in the local map, as a fraction, [0, 0.1]
  double true_share = 0.35;    ///< of local boulders that the map holds, as the tests expect it, [0.05, 0.95]
  double sigma_size = 0.25;    ///< of ln(diameter) of a pair, [0.01, 2]; 0: sizes are not looked at
  double accept_nats = 13.8;   ///< [0, 100]
  double margin_nats = 9.0;    ///< [0, 100]
  double floor_nats = 2.5;     ///< below minus this a hypothesis is dropped, lower on sparse ground, [1, 20]
  int max_pairs = 64;          ///< local pairs, [1, 10000]
  std::uint64_t max_ops = 4'000'000'000;
};

/// Where the rover may be; the default is anywhere in the map, at any heading.
struct SearchRegion {
  bool anywhere = true;
  Vec2 centre_map_m = Vec2(0.0, 0.0);  ///< of the disc for the pivot
  double radius_m = 0.0;               ///< [0.01, 1e5]
  double yaw_rad = 0.0;                ///< middle of the sector for the yaw of T_map_site
  double half_sector_rad = kPi;        ///< [0.01, pi]
};

/// A pose of the pivot in the map that the region allows.
bool holds(const SearchRegion& region, const Vec2& pivot_map_m, double yaw_rad);

/// A pose that was found, best first.
struct SearchHit {
  Pose2 T_map_site;
  double score_nats = 0.0;
  int pairs = 0;  ///< local boulders with a map boulder within the gate
};

class LostSearch {
 public:
  static constexpr std::size_t kAtOnce = 8;   ///< local pairs that go through the map together
  static constexpr std::uint32_t kScan = 32;  ///< map boulders of a unit
  /// Of a pair's length. One in twenty is missed, of many; wider, chance ones grow faster than true ones.
  static constexpr double kLengthSigmas = 2.0;
  /// Hypotheses that a map boulder and another may give, and room for them.
  static constexpr std::size_t kMostOfTwo = 2 * kAtOnce;
  static constexpr std::size_t kMaxQueue = 128;
  /// Map boulders about a local one; more are not looked at.
  static constexpr std::uint32_t kMostAbout = 490;
  static constexpr std::uint32_t choose_ops(std::size_t others) {
    return 10U + 10U * static_cast<std::uint32_t>(others);
  }
  static constexpr std::uint32_t sort_ops(std::size_t boulders) {
    return 20U + 18U * static_cast<std::uint32_t>(boulders);
  }
  static constexpr std::uint32_t start_ops(std::size_t boulders) {
    return 500U + 12U * static_cast<std::uint32_t>(boulders);
  }
  static constexpr std::uint32_t kSizeOps = 120;  ///< of a local boulder's diameter
  static constexpr std::uint32_t kBeginOps = 12;
  static constexpr std::size_t kMaxRing = 256;  ///< rows of buckets, two pieces each
  static constexpr std::uint32_t kSpanOps = 3;
  static constexpr std::uint32_t sweep_ops(std::uint32_t boulders, std::uint32_t hypotheses) {
    return 3U * boulders + 4U * hypotheses;
  }
  static constexpr std::uint32_t most_sweep_ops() {
    return kBeginOps + kSpanOps * kMaxRing + sweep_ops(kScan, kMaxQueue);
  }
  /// Before it is known how many looks decide, and of them.
  static constexpr std::uint32_t kLookOps = 40;
  static constexpr std::uint32_t looks_ops(std::uint32_t looks) { return 2U * looks; }
  static constexpr std::uint32_t fit_ops(std::uint32_t boulders) { return 60U + 10U * boulders; }

  static constexpr std::size_t kHits = 12;
  /// Where 0.85 of the boulders agree with a rival as well, one pair finds it in three of five cases, all of
  /// these miss it in one of 1500.
  static constexpr int kRivalPairs = 8;
  static constexpr int kSincePairs = 16;
  static constexpr double kEdge_m = 0.5;
  static constexpr double kEdge_rad = 0.05;

  /// On no budget: the caller pays start_ops(). `map` is borrowed until done. `pivot_site_m`: the
  /// rover, whose place the region speaks of.
  LostStatus start(const LostSearchParams& params, const WideMap& map, const LocalMap& local,
                   const Vec2& pivot_site_m, const SearchRegion& region);
  Progress step(WorkBudget& budget);  ///< the same result for every slicing
  LostStatus status() const { return status_; }

  const FixedVector<SearchHit, kHits>& hits() const { return hits_; }
  /// How far the second best pose is behind the best; the best's own score where there is no second.
  double behind_nats() const;
  std::uint32_t hypotheses() const { return hypotheses_; }
  int pairs_tried() const { return pairs_tried_; }
  std::uint64_t ops() const { return ops_; }

 private:
  static constexpr int kShareLevels = 32;
  static constexpr std::size_t kShares = 5;  ///< that the score averages over
  static constexpr double kShare[kShares] = {0.15, 0.3, 0.5, 0.7, 0.9};
  static constexpr std::int32_t kUnits = 64;   ///< of a raster cell
  static constexpr std::int32_t kOne = 16384;  ///< of cosines

  enum class Phase : std::uint8_t { kSizes, kChoose, kSort, kSweep, kLook, kFit };
  struct Point {
    float x = 0.0F;  ///< about the middle of the local map
    float y = 0.0F;
    float size = 0.0F;       ///< ln(diameter), or kNoSize; the diameter until its turn in kSizes
    float among_map = 0.0F;  ///< share of the map's boulders that look as large, per unit of ln(diameter)
    std::uint16_t used = 0;
    bool on_best = false;  ///< agrees with the best pose, which passes
  };
  struct Look {
    std::int32_t x = 0;  ///< about the middle of the pair, raster cell / kUnits
    std::int32_t y = 0;
  };
  /// A local pair that is under way, from its first boulder to its second.
  struct Pair {
    double dx = 0.0;
    double dy = 0.0;
    double low2 = 0.0;  ///< of the square of its length in the map
    double high2 = 0.0;
    double inverse2 = 0.0;  ///< 1 / length^2
    double middle_x = 0.0;  ///< from the middle of the local map
    double middle_y = 0.0;
    double least_m[2] = {};  ///< diameters that its boulders may have in the map
    double most_m[2] = {};
    bool on_best = false;  ///< both boulders
  };
  struct Hypothesis {
    std::int32_t x = 0;  ///< middle of the map's pair, raster cell / kUnits
    std::int32_t y = 0;
    std::int32_t cos = kOne;
    std::int32_t sin = 0;
    std::uint32_t pair = 0;  ///< of pairs_
  };
  /// Buckets of the ring side by side, from the boulder's own.
  struct Span {
    std::int8_t dx0;
    std::int8_t dx1;
    std::int8_t dy;
  };
  /// Pose of the middle of the local map, in the wide map.
  struct Fit {
    double x = 0.0;
    double y = 0.0;
    double yaw = 0.0;
  };

  LostStatus take_local(const LocalMap& local, const Vec2& pivot_site_m);
  void account(const WorkBudget& budget);
  bool sizes_step(WorkBudget& budget);  ///< false: the budget ran out, here and below
  bool choose_step(WorkBudget& budget);
  void choose_row(std::size_t i);
  static double rarity(const Point& p);
  bool was_tried(std::size_t i, std::size_t j) const;
  void take_pair();
  void sort_looks(double mx, double my);
  bool passes_yet() const { return !hits_.empty() && hits_[0].score_nats >= params_.accept_nats; }
  bool wants_more_pairs() const;
  void begin_sweep();
  void lay_ring();
  bool sweep_step(WorkBudget& budget);
  bool begin_boulder();
  static bool size_agrees(const Pair& pair, int end, double diameter_m);
  double size_ratio(const Point& local, std::uint32_t map_index) const;
  std::uint32_t sweep_spans();
  std::uint32_t scan(std::uint32_t first, std::uint32_t end, bool own);
  void propose(std::uint32_t pair, double mx, double my, double length2, bool forth, bool back);
  void end_sweep();
  bool enough() const;
  void conclude();
  bool look_step(WorkBudget& budget);
  bool passes(const Hypothesis& h, std::uint32_t& looks) const;
  void begin_fit(const Hypothesis& h);
  void begin_round();
  bool without_drift();
  bool fit_step(WorkBudget& budget);
  /// Where local boulder `fit_at_` comes to lie, and the buckets within its gate.
  struct Place {
    double x, y, variance, gate;
    int column0, column1, row0, row1;
  };
  Place place() const;
  std::uint32_t boulders_about(const Place& place) const;
  void take_nearest(const Place& place);
  void score(const Place& place, double likelihood);
  void estimate();
  double log_of_mean() const;
  void keep();
  void mark_best();
  bool near_region() const;

  LostSearchParams params_;
  const WideMap* map_ = nullptr;
  SearchRegion region_;
  LostStatus status_ = LostStatus::kIdle;
  Phase phase_ = Phase::kChoose;
  std::uint64_t ops_ = 0;
  std::uint64_t spent_before_ = 0;  ///< of the budget in hand, by what ops_ has
  std::uint32_t hypotheses_ = 0;
  int pairs_tried_ = 0;
  int pairs_since_best_ = 0;
  int rival_pairs_ = 0;      ///< of those since, that were of boulders on the best pose
  bool best_moved_ = false;  ///< since the pairs in hand began
  double log_volume_ = 0.0;
  double sector_cos_ = 1.0;
  double sector_sin_ = 0.0;
  double sector_edge_ = -2.0;  ///< cosine of half the sector; below -1: all headings

  FixedVector<Point, cfg::kMaxLocalBoulders> local_;
  Vec2 middle_site_m_ = Vec2(0.0, 0.0);
  double pivot_x_ = 0.0;  ///< about the middle
  double pivot_y_ = 0.0;
  double reach2_ = 0.0;  ///< of a local boulder from the region's centre, squared
  double min_length_m_ = 0.0;
  double max_length_m_ = 0.0;

  // The local pairs in hand.
  std::size_t row_ = 0;
  double best_cost_ = 0.0;
  std::uint16_t pair_i_ = 0;
  std::uint16_t pair_j_ = 0;
  FixedVector<Pair, kAtOnce> pairs_;
  FixedVector<Look, cfg::kMaxLocalBoulders> looks_[kAtOnce];  ///< nearest to the pair's middle first
  double shortest_m_ = 0.0;                                   ///< of those that may go with the first one
  double longest_m_ = 0.0;
  double low2_ = 0.0;  ///< of all of them
  double high2_ = 0.0;
  /// Pairs that were tried, a bit each.
  std::uint32_t tried_[(cfg::kMaxLocalBoulders * cfg::kMaxLocalBoulders / 2 + 31) / 32] = {};
  std::int16_t hit_[kShareLevels] = {};  ///< 1/64 nat, by share of set cells
  std::int16_t miss_[kShareLevels] = {};
  std::int16_t floor_[kShareLevels] = {};

  // The sweep.
  FixedVector<Span, kMaxRing> ring_;
  std::uint32_t boulder_ = 0;
  bool ring_begun_ = false;
  std::size_t ring_at_ = 0;
  std::uint32_t span_at_ = 0;  ///< boulders of the span that were seen
  int column_ = 0;
  int bucket_row_ = 0;
  double ax_ = 0.0;  ///< the boulder
  double ay_ = 0.0;
  std::uint32_t as_first_ = 0;  ///< pairs that it may be the first one of, a bit each
  std::uint32_t as_second_ = 0;
  FixedVector<Hypothesis, kMaxQueue> queue_;
  std::size_t queue_at_ = 0;

  // The fit.
  Fit fit_;
  double drift_ = 0.0;  ///< of this fit
  double fit_cos_ = 1.0;
  double fit_sin_ = 0.0;
  int round_ = 0;
  std::size_t fit_at_ = 0;
  int fit_pairs_ = 0;
  std::uint32_t matched_[(cfg::kMaxLocalBoulders + 31) / 32] = {};  ///< of this round, a bit each
  double sum_[8] = {};
  double log_sum_[kShares] = {};
  FixedVector<SearchHit, kHits> hits_;
};

}  // namespace cairn
