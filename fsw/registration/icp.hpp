/// Registration of the local map of ground boulders to the orbital map by iterative closest points
/// (METHOD section C; Besl & McKay, "A Method for Registration of 3-D Shapes", IEEE PAMI 14(2), 1992).
///
/// What it computes. The planar motion that carries `site` into `map`, near a prior: each iteration pairs
/// every local boulder with the nearest map boulder within the gate, drops the worst fraction of the pairs
/// (trimming), and solves
///   minimise sum |m_i - (t + s R(yaw) (p_i - pivot))|^2   over t, yaw (rigid: s = 1) and s (similarity)
/// in closed form (Horn 1987; Umeyama 1991; in the plane both are one arc tangent). Point to point, because a
/// boulder is a point here: there is no surface between boulders to slide along.
///
/// The pivot is the rover's position in `site`. The estimate is the pose of the pivot, so that yaw and
/// translation are as little correlated as the boulders allow, and a similarity's rigid part maps the pivot
/// exactly where the similarity does.
///
/// The prior. With `IcpPrior::use`, the estimate is the most probable one under a Gaussian prior about the
/// start, with `sigma_pair_m` as the error of a pair on each axis. The prior enters as two virtual pairs, at
/// +l and -l from the pivot and weight w each, with
///   l = sigma_xy / sigma_yaw,   w = sigma_pair^2 / (2 sigma_xy^2)
/// their information on translation is 1/sigma_xy^2, that on yaw 1/sigma_yaw^2. So the closed form stays
/// exact, and few or clumped pairs cannot swing the yaw. (In a similarity the same two pairs hold the scale,
/// to sigma_yaw_rad as a fraction.) Without it, it is the paper's plain ICP.
///
/// Extrapolation (Besl & McKay IV.C). The state is the vector (x, y, L yaw, L s), L = root mean square
/// distance of the local boulders from the pivot. Where the last three steps point the same way within
/// 10 degrees, the objective is fitted along them by a line and a parabola and the state moves on to the
/// nearer of the line's zero and the parabola's minimum, at most 25 steps ahead. If the objective is then
/// larger than before, the move is taken back. The objective is
///   (sum over kept pairs of r^2 + prior term + gate^2 for each local boulder without a kept pair) / n
///
/// Nearest neighbours come from a grid over the map boulders (boulder_grid.hpp) whose cells are at least one
/// gate wide: exactly the brute force's result (ties: lowest index) at the cost of nine cells.
///
/// Cost. start(): copies and checks the local map, about 10 operations a boulder. An iteration: n (420 + 4 c)
/// operations for n local boulders with c map boulders in nine cells. Units: 256 map boulders (index), one
/// local boulder (pairing), one estimate (400 n operations).
#pragma once

#include <cstdint>

#include "core/nodiscard.hpp"
#include "core/work_budget.hpp"
#include "geometry/boulder.hpp"
#include "geometry/pose2.hpp"
#include "registration/boulder_grid.hpp"

namespace cairn {

enum class CAIRN_NODISCARD IcpStatus : std::uint8_t {
  kIdle,             ///< never started
  kRunning,          ///< call step() again
  kConverged,        ///< the only status that may be fused
  kIterationLimit,   ///< result for telemetry only, as in all that follow
  kTooFewPairs,      ///< fewer than min_pairs after gate and trimming
  kWeakGeometry,     ///< pairs too close together to fix the yaw (lever below min_lever_m)
  kBeyondLimit,      ///< converged, but farther from the prior than allowed (or the scale ran away)
  kNoMapBoulders,    ///< nothing to register to
  kNoLocalBoulders,  ///< nothing to register
  kBadInput,         ///< NaN or infinity, a coordinate beyond 1e7 m, or a parameter out of its range
};

enum class IcpModel : std::uint8_t {
  kRigid,       ///< x, y, yaw
  kSimilarity,  ///< x, y, yaw, scale: the paper's
};

/// Parameters; ranges in brackets. Defaults come from the mission.
struct IcpParams {
  IcpModel model = IcpModel::kRigid;
  int max_iterations = cfg::kMission.icp_max_iterations;  ///< pairings, [1, 1000]
  double gate_start_m = cfg::kMission.icp_gate_start_m;   ///< [1e-3, 1e3]
  double gate_final_m = cfg::kMission.icp_gate_final_m;   ///< [1e-3, gate_start_m]
  double gate_shrink = cfg::kMission.icp_gate_shrink;  ///< per iteration, [0.01, 1]; 1 asks for equal gates
  double trim_fraction = cfg::kMission.icp_trim_fraction;  ///< of the pairs within the gate, [0, 0.8]
  int min_pairs = cfg::kMission.icp_min_pairs;             ///< [2, capacity]; with a prior [1, capacity]
  double min_lever_m = cfg::kMission.icp_min_lever_m;    ///< rms distance of pairs from their mean, [0, 1e3]
  double sigma_pair_m = cfg::kMission.icp_sigma_pair_m;  ///< error of a pair per axis, [1e-6, 1e3]
  bool extrapolate = true;
  bool one_to_one = true;       ///< a map boulder is paired with its closest local boulder only
  double max_size_ratio = 0.0;  ///< diameters of a pair differ by this factor at most, >= 1; 0: not looked at
  double step_m = 1.0e-5;    ///< converged when a step at the final gate moves the pivot by at most this ...
  double step_rad = 1.0e-6;  ///< ... and turns (or scales, as a fraction) by at most this; both [0, 1]
  double max_correction_m = cfg::kMission.icp_max_correction_m;      ///< of the pivot, [0, 1e6]
  double max_correction_rad = cfg::kMission.icp_max_correction_rad;  ///< [0, pi]
  double max_scale_change = cfg::kMission.icp_max_scale_change;      ///< |s - 1|, [0, 0.5]
};

/// What is known of the start: independent errors of the pivot's position (each axis) and of the yaw.
struct IcpPrior {
  bool use = false;
  double sigma_xy_m = 0.1;      ///< [1e-6, 1e6]
  double sigma_yaw_rad = 0.02;  ///< [1e-6, 10]
};

/// A pair that the result rests on.
struct IcpPair {
  std::uint16_t local = 0;  ///< index in the local map
  std::uint16_t map = 0;    ///< index in the map boulders
  float residual_m = 0.0F;  ///< after the registration
};

/// pairs_used + pairs_trimmed + pairs_gated = local boulders.
struct IcpResult {
  Pose2 T_map_site;    ///< rigid part
  double scale = 1.0;  ///< about the pivot: p_map = T_map_site * (pivot + scale (p_site - pivot))
  double dx_m = 0.0;   ///< correction of the pivot from the prior, frame map
  double dy_m = 0.0;
  double dyaw_rad = 0.0;
  /// Covariance of the pivot's pose in map, order x, y, yaw (m, m, rad), first order:
  ///   (J^T J / (v k) + prior information)^-1
  /// over the pairs used, a similarity's scale marginalised. v is the variance of a pair on an axis: that of
  /// the residuals, made consistent for trimming, and never below sigma_pair_m^2. k = p/A, p the kept
  /// fraction and A = p + (1-p) ln(1-p), is the loss by trimming. Both factors are exact for Gaussian pairs;
  /// where what was trimmed were outliers, the covariance is too large, by (p/A)^2 at most (2.8 at 20 %, 4.3
  /// at 30 %). Errors common to all boulders (a shifted map) are not in it.
  Mat3 covariance = Mat3::Zero();
  double rms_m = 0.0;      ///< root mean square of |residual| over the pairs used
  double lever_m = 0.0;    ///< rms distance of their local boulders from their mean
  int iterations = 0;      ///< pairings
  int extrapolations = 0;  ///< those that were kept
  int pairs_used = 0;
  int pairs_trimmed = 0;
  int pairs_gated = 0;  ///< local boulders without a partner: gate, size or one-to-one
  FixedVector<IcpPair, cfg::kMaxLocalBoulders>
      pairs;  ///< those used, in order of residual before the last estimate
};

/// One registration, resumable. The map's boulders are borrowed until step() has laid its grid over them, all
/// else is copied at start.
class IcpJob {
 public:
  static constexpr std::uint32_t kEstimateOps = 400;  ///< per local boulder

  /// kRunning, or what is wrong with the input; of the map's boulders step() tells.
  IcpStatus start(const IcpParams& params, const MapBoulders& map, const LocalMap& local,
                  const Pose2& T_map_site_prior, const Vec2& pivot_site_m,
                  const IcpPrior& prior = IcpPrior());
  Progress step(WorkBudget& budget);  ///< the same bits for every slicing
  IcpStatus status() const { return status_; }
  /// Complete once step() said kDone; after an input error the prior and no pairs.
  const IcpResult& result() const { return result_; }

 private:
  static constexpr std::uint16_t kNone = BoulderGrid::kNone;

  enum class Phase : std::uint8_t { kGrid, kPair, kEstimate };
  /// A correction of the prior: p = (x, y) + scale R(yaw) q, in map axes about the prior's pivot.
  struct State {
    double x = 0.0;
    double y = 0.0;
    double yaw = 0.0;
    double scale = 1.0;
  };
  struct Candidate {
    double r2 = 0.0;
    std::uint16_t local = 0;
    std::uint16_t map = kNone;
  };
  /// The last step to a state, as a vector whose components are all lengths, and the objective there.
  struct Milestone {
    double step[4] = {};
    double length = 0.0;
    double objective = 0.0;
  };
  /// Summed weight of the prior's two virtual pairs, and that times l^2; in units of one pair.
  struct Virtual {
    double weight;
    double inertia;
  };

  IcpStatus copy_inputs(const MapBoulders& map, const LocalMap& local);
  static GridPoint apply(const State& state, const GridPoint& q);
  void pair_unit(const BoulderQuery& query);

  void estimate_unit();
  void keep_one_to_one();
  void gather_and_trim();
  void next_iteration(const State& state);
  Virtual virtual_pairs() const;
  double sum_of_squares(const State& state) const;
  double objective(const State& state) const;
  double lever() const;
  State estimate() const;
  bool step_is_small(const State& from, const State& to) const;
  IcpStatus judge(const State& state) const;

  Milestone milestone(const State& from, const State& to) const;
  double overstep() const;
  State extrapolated(const State& next);
  bool trial_succeeds();

  void finish(IcpStatus status, const State& state);
  void fill_covariance(const State& state);

  IcpParams params_;
  IcpPrior prior_;
  Pose2 T_map_site_prior_;
  Vec2 pivot_site_m_ = Vec2(0.0, 0.0);
  Vec2 pivot_map_m_ = Vec2(0.0, 0.0);
  IcpStatus status_ = IcpStatus::kIdle;
  Phase phase_ = Phase::kGrid;
  std::uint32_t cursor_ = 0;

  BoulderGrid map_;                                       ///< about the prior's pivot, map axes
  FixedVector<GridPoint, cfg::kMaxLocalBoulders> local_;  ///< the same, prior applied
  double lever_all_m_ = 1.0;                              ///< L of the extrapolation

  std::uint16_t owner_[cfg::kMaxMapWindowBoulders] = {};  ///< local boulder that a map boulder belongs to

  State state_;
  double gate_m_ = 0.0;
  Candidate nearest_[cfg::kMaxLocalBoulders] = {};
  FixedVector<Candidate, cfg::kMaxLocalBoulders> kept_;
  int trimmed_ = 0;
  Milestone past_[3];  ///< newest first
  int past_count_ = 0;
  bool on_trial_ = false;  ///< state_ was extrapolated from fallback_
  State fallback_;
  double trial_length_ = 0.0;

  IcpResult result_;
};
static_assert(sizeof(IcpJob) <= cfg::kIcpJobMaxBytes, "raise icp_job_max_bytes in mission_cfg");

}  // namespace cairn
