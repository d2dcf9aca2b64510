/// The proof of a fix: how probable is it that unrelated boulders agree this well?
///
/// Evidence. At a hypothesis of the pose, refined to the most probable one near by, for local boulders x_i:
///     S = ln mean over p of  prod_i [ (1 - p) + (p / lambda_i) sum_k z_ik N(x_i; m_k, s_i^2) ]
/// the log likelihood ratio of 'same ground' (a local boulder is one of the map's with probability p, error
/// s_i on an axis, else clutter) against 'unrelated boulders as dense as around here' (lambda_i, of
/// registration/ground.hpp). p is not known and is averaged over 0.25, 0.5, 0.75, 0.92. z_ik is the ratio
/// of sizes: N(ln d_i - ln d_k; 0, size_sigma^2) over the map's own density of ln d, mixed with 1/10 of
/// one; 1 where either diameter is unknown or size_sigma is 0. A map boulder is evidence for one local
/// boulder alone, the one that it agrees with best; for others that lean on it the sum counts as zero.
/// Local boulders closer to one another than 2 s are taken as one (sight()). Both only lower S.
///
/// Clusters. Where the map's boulders crowd (Ground::crowding() above 1.5), a cluster of local boulders
/// that happens to lie on one of the map's agrees in all its members at once. Of local boulders that hang
/// together (links of 8 sigma_pair, kCrowdSigmas) the best then counts whole, each other one that speaks
/// for the pose by the share 1.5 / crowding, at least 0.4. That, too, only lowers S.
///
/// Log ratio. The marginal likelihood over the pose, by Laplace's method at the most probable pose:
///     log_ratio = S - chi2/2 + ln( (2 pi)^(d/2) sqrt(det C) ) - ln V
/// chi2: distance from the prior, C: covariance after the fix, V = (2 pi)^(d/2) sqrt(det P): volume of the
/// Gaussian prior (d = 3; 4 with scale). The volume pays for every hypothesis that the prior leaves room
/// for, so that it does not matter how many were looked at, nor how this one was found. Under the null of
/// scattered boulders P(log_ratio > t) <= e^-t (Markov's inequality: the ratio's mean is 1).
///
/// In view. Where the rover slipped and nothing told of it, boulders seen before agree with a pose that no
/// longer is the rover's. With S_before the same S over those that are not in view at the snapshot,
///     view_log = S_before - S
/// is the log likelihood ratio of 'those in view are unrelated to the map at this pose' against 'they are on
/// it as all others'. At the right pose P(view_log > t) <= e^-t.
///
/// Chance agreement, measured. Lattices, rows and clusters of another place agree better than scattered
/// boulders do. What the same local map scores at *decoys*, poses that cannot be right (outside what the
/// prior allows, or second to the best), tells by how much. With decoys D_j found in a volume V_d of poses,
/// the expected number of wrong poses within the prior that score as well as this one is
///     F = (V_p / V_d) sum_j exp( -(S - chi2/2 - D_j) / theta )
/// V_p: volume of the prior, not below that of the fix. theta: 1, the tail of scattered boulders; larger
/// where decoys score more than ln(V_d / volume of the fix), which scattered boulders hardly reach: then
/// the mean excess of the best twelve of those over it, or over the thirteenth of them (four decoys' worth
/// of theta = 1 mixed in). chance_log = -ln F is held against the same threshold.
///
/// Verdict, first that applies: inconsistent with the prior (evidence enough but for chi2, and chi-squared
/// of the innovation, 3 degrees of freedom, beyond its limit), view disagrees (view_log beyond its limit,
/// and evidence enough but for those in view), too little evidence (log_ratio + calibration below what is
/// needed), ambiguous (second best less than second_margin behind), chance agreement (chance_log below what
/// is needed), accepted. Needed is ln_threshold - prior_log_odds: what is known besides that this is the
/// right map and prior (fixes before). calibration: e^-t is a bound, a loose one. Importance sampling,
///     P0(log_ratio > t) = E1[e^-log_ratio; log_ratio > t]
/// over trials of the same ground, puts the rate of false fixes 3 to 4.6 nats below it; `make bench-fix`
/// shows it beside what wrong sites give.
///
/// Everything in axes of `map` about the Ground's centre; angles in radians.
///
/// Cost of EvidenceJob: an iteration takes n (60 + 3 query) operations for n local boulders, in units of
/// one, or a piece of its question; 4 to 12 iterations. In the end 170 n, in five units.
#pragma once

#include <cstdint>

#include "core/nodiscard.hpp"
#include "core/work_budget.hpp"
#include "geometry/boulder.hpp"
#include "geometry/pose2.hpp"
#include "registration/ground.hpp"

namespace cairn {

using Mat4 = Eigen::Matrix<double, 4, 4>;
using Vec4 = Eigen::Matrix<double, 4, 1>;

/// A local boulder as evidence: axes of `site` about the pivot.
struct Sighting {
  double x_m = 0.0;
  double y_m = 0.0;
  double sigma_m = 0.05;      ///< of a pair with it, on an axis
  double diameter_m = 0.0;    ///< 0 = unknown
  double size_density = 0.0;  ///< Ground::size_density of it; 0 = sizes are not looked at
  std::uint16_t local = 0;    ///< index in the LocalMap
  bool in_view = false;       ///< LocalBoulder::in_view
  float fresh = 1.0F;         ///< LocalBoulder::fresh
  std::uint16_t cluster = 0;  ///< the same for those that hang together: the lowest index among them
};
using Sightings = FixedVector<Sighting, cfg::kMaxLocalBoulders>;

inline constexpr double kCrowdSigmas = 8.0;  ///< what Ground's crowd_m is in sigma_pair

struct EvidenceParams {
  double sigma_pair_m = cfg::kMission.icp_sigma_pair_m;  ///< of a pair per axis, [1e-3, 10]
  double size_sigma = 0.0;   ///< of ln(diameter seen / diameter in the map), [0.02, 3]; 0 = not looked at
  double scale_sigma = 0.0;  ///< of the map's scale about 1, [0, 0.2]; 0 = the scale is known
  double match_share = 0.5;  ///< p of search and refinement, [0.05, 0.95]
  double settled = 0.01;     ///< step in sigma_pair that ends the refinement, [1e-4, 1]
};
bool params_are_good(const EvidenceParams& params);

/// One more local boulder as evidence, about the pivot: its sigma is that of a pair and its own in the
/// local map, added in squares. Left out where it lies within 2 sigma_pair of one that is there (kNear): a
/// duplicate. Operations: 3 for each that is there, and 30.
enum class CAIRN_NODISCARD Sighted : std::uint8_t {
  kTaken,
  kNear,
  kBad,  ///< not finite, farther than 1e5 m from the pivot, or a sigma beyond 1e3 m
};
Sighted sight(const EvidenceParams& params, const Ground& ground, const LocalMap& local, std::size_t index,
              const Vec2& pivot_site_m, Sightings& out);

/// A pose of the local map: where the pivot lies, how the site's axes are turned, how much larger
/// the map is.
struct Hypothesis {
  double x_m = 0.0;
  double y_m = 0.0;
  double yaw_rad = 0.0;
  double scale = 1.0;  ///< p = (x, y) + scale R(yaw) q
};

/// What is known of the pose before.
struct PosePrior {
  Hypothesis mean;
  Mat3 information = Mat3::Zero();  ///< x, y, yaw; zero: nothing known but the volume
  double log_volume = 0.0;          ///< ln of the volume in m^2 rad
};
/// Of a Gaussian: information = covariance^-1, volume (2 pi)^1.5 sqrt(det covariance). False where the
/// covariance is not finite and positive.
bool gaussian_prior(const Hypothesis& mean, const Mat3& covariance, PosePrior& out);
/// Flat: anywhere in an area, heading within a sector (2 pi: unknown).
PosePrior flat_prior(const Hypothesis& mean, double area_m2, double sector_rad);

struct Evidence {
  Hypothesis pose;  ///< the most probable near the hypothesis
  /// Of pose, order x, y, yaw, scale (scale: 0 where it is known). First order: the observed information
  /// (of the mixture: an uncertain match counts for less) and the prior's. The pairs' variance is their
  /// own, weighed against sigma_pair's with 10 degrees of freedom, within a factor of 1/4 to 9 of it.
  Mat4 covariance = Mat4::Zero();
  double S = 0.0;            ///< evidence at the pose, nats
  double view_log = 0.0;     ///< of 'those in view are unrelated' against 'as all others'
  double fresh_log = 0.0;    ///< of 'the fresh ones are on it as all others' against 'they are unrelated'
  double chi2 = 0.0;         ///< of the pose about the prior's mean
  double innovation2 = 0.0;  ///< chi-squared of the fix without the prior about the prior
  double log_volume = 0.0;   ///< of the fix, as PosePrior::log_volume
  double log_ratio = 0.0;    ///< of 'same ground' against 'chance'
  double matched = 0.0;      ///< expected number of true pairs
  double rms_m = 0.0;        ///< of their residuals, weighted
  int iterations = 0;
  /// What the fresh ones alone say, without the prior: information about x, y, yaw, and the pull at `pose`.
  Mat3 fresh_information = Mat3::Zero();
  Vec3 fresh_pull = Vec3::Zero();
  /// Sightings that are likelier on the map than not, a bit each.
  std::uint32_t on_map[(cfg::kMaxLocalBoulders + 31) / 32] = {};
};

enum class CAIRN_NODISCARD EvidenceStatus : std::uint8_t {
  kIdle,
  kRunning,
  kDone,        ///< converged: the evidence is that of a mode
  kNotSettled,  ///< iterations ran out; the evidence is that of where it was
  kDiverged,    ///< no information left: no boulder near enough
  kBadInput,
};

/// Refines one hypothesis and weighs it. Ground and sightings are borrowed until it is done.
class EvidenceJob {
 public:
  static constexpr std::size_t kUnitSightings = 120;  ///< of a share, in one unit
  static constexpr std::uint32_t share_ops(std::size_t sightings) {
    return 40U * static_cast<std::uint32_t>(sightings);
  }
  static constexpr std::uint32_t look_ops(std::uint32_t query) { return 60U + 3U * query; }

  EvidenceJob();  ///< not inline: it is large, and two jobs hold one
  EvidenceStatus start(const EvidenceParams& params, const Ground& ground, const Sightings& sightings,
                       const PosePrior& prior, const Hypothesis& hypothesis);
  Progress step(WorkBudget& budget);  ///< the same bits for every slicing
  EvidenceStatus status() const { return status_; }
  const Evidence& result() const { return result_; }

 private:
  static constexpr std::uint16_t kNone = 0xFFFF;
  /// The last pass: what a local boulder says.
  struct Say {
    double ratio = 0.0;  ///< density at it over the null's
    std::uint16_t map = kNone;
  };
  /// Of the boulder under way: sums over the map boulders near it, at u from it.
  struct Near {
    double density = 0.0;
    double best = 0.0;  ///< the largest part of the density, and whose it is
    std::uint16_t best_map = kNone;
    double x = 0.0, y = 0.0;              ///< density times u
    double xx = 0.0, xy = 0.0, yy = 0.0;  ///< and times u u^T
  };
  /// What pairs say together, each by its inverse variance, with d as seen from the pivot in axes of map.
  struct Pairs {
    double weight = 0.0;
    double x = 0.0, y = 0.0;  ///< weight times d
    double d2 = 0.0;          ///< and times d^2
    double pull[4] = {};      ///< gradient: x, y, yaw, scale
  };

  BoulderQuery query(const Sighting& s) const;
  void begin_pass();
  void begin_look();
  void look(const Sighting& s, const BoulderQuery& piece);
  void looked(const Sighting& s, const BoulderQuery& query);
  void add(const Sighting& s, const Vec2& d, double to_weight);
  double per_scale() const { return params_.scale_sigma > 0.0 ? 1.0 / pose_.scale : 0.0; }
  Mat4 information(const Pairs& pairs) const;
  void tell_fresh(double factor);
  void end_pass();
  Mat4 prior_information() const;
  Vec4 from_prior() const;
  void assign();
  void multiply(std::size_t end);
  void weigh();

  EvidenceParams params_;
  const Ground* ground_ = nullptr;
  const Sightings* sightings_ = nullptr;
  PosePrior prior_;
  EvidenceStatus status_ = EvidenceStatus::kIdle;
  std::size_t cursor_ = 0;
  double inflation_ = 1.0;  ///< of sigma, while it settles
  bool last_ = false;       ///< the pass that weighs
  bool settled_ = false;
  int share_ = -1;  ///< cursor over the shares p, in the end; -1 before
  double sums_[4] = {};
  double before_[4] = {};  ///< the same, of those that are not in view
  double used_[4] = {};    ///< and of those that are not fresh
  Hypothesis pose_;
  SinCos turn_ = {0.0, 1.0};
  enum : int { kAll, kFresh };
  Pairs pairs_[2];               ///< all of them, and the fresh ones of the last pass that are on the map
  Mat4 missing_ = Mat4::Zero();  ///< what the uncertainty of the matches takes of the information; last pass
  double sum_w_ = 0.0;
  double sum_wr2_ = 0.0;  ///< over sigma^2
  double sum_r2_m2_ = 0.0;
  std::uint32_t seen_ = 0;  ///< of the map boulders near the one under way
  Near near_;
  Say say_[cfg::kMaxLocalBoulders] = {};
  std::uint16_t best_of_[cfg::kMaxLocalBoulders] = {};  ///< of a cluster, by its lowest index
  double echo_ = 1.0;                                   ///< what the others of a cluster count
  std::uint16_t owner_[cfg::kMaxMapWindowBoulders] = {};
  Evidence result_;
};

/// S of `count` local boulders that agree with nothing.
double evidence_of_misses(std::size_t count);

// ---- the verdict ------------------------------------------------------------------------------------------

enum class VerdictStatus : std::uint8_t {
  kNone,                   ///< none yet
  kAccepted,               ///< the only one that may be fused
  kNoHypothesis,           ///< nothing in reach agrees at all
  kInconsistentWithPrior,  ///< what agrees is not where the prior says
  kTooLittleEvidence,      ///< unrelated boulders could agree as well
  kViewDisagrees,          ///< boulders seen before agree, those in view do not
  kAmbiguous,              ///< another pose agrees nearly as well
  kChanceAgreement,        ///< this map agrees as well at poses that are wrong
};

struct VerdictParams {
  double ln_threshold = 13.815510557964274;  ///< ln 1e6: one false fix in a million, at most
  double prior_log_odds = 0.0;               ///< that map and prior are right, beyond even; [0, 13]
  double calibration = 3.0;                  ///< nats by which log_ratio is known to be low, [0, 4.6]
  double second_margin = 6.907755278982137;  ///< nats that the second best must be behind
  double innovation2_limit = 21.108;         ///< of 3 degrees of freedom: 1e-4
  double view_limit = 4.605170185988091;     ///< nats of view_log: 100 to 1
  int tail = 12;                             ///< decoys that theta is taken from
};

/// Scores of the same local map where it cannot be right.
struct Decoys {
  static constexpr std::size_t kCapacity = 48;
  FixedVector<double, kCapacity> scores;  ///< S at distinct poses, in any order
  double log_volume = 0.0;                ///< ln of the volume of poses that they were the best of, m^2 rad
};

struct Verdict {
  VerdictStatus status = VerdictStatus::kNone;
  double log_ratio = 0.0;
  double second_log_ratio = -1.0e3;  ///< of the second best distinct pose; -1000: none
  double chance_log = 1.0e3;         ///< -ln F; 1000: no decoy scores at all
  double view_log = 0.0;             ///< of the boulders in view, as in Evidence
  double beyond_decoys = 1.0e3;  ///< the same without the volumes: how far it is before all decoys together
  double theta = 1.0;
};

/// `second_log_ratio`: -1000 where there is none.
Verdict judge(const VerdictParams& params, const Evidence& best, double second_log_ratio,
              const PosePrior& prior, const Decoys& decoys);

}  // namespace cairn
