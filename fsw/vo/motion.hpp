/// Motion of the rig between two stereo frames, from points seen in both (METHOD section A).
///
/// Two stages in one job: RANSAC over minimal sets of three points by absolute orientation, inliers judged in
/// pixels in both images; then either the absolute orientation of all inliers (the paper) or refinement on
/// reprojection error (ours). The refinement minimises, over the motion, the robust sum of the
/// squared Mahalanobis residuals
///   r = (u, v, d)_measured - project(T p_ref),   cov(r) = sigma^2 (I' + j j^T),   j = d(project) / d(d_ref)
/// where the j term is the uncertainty of the reference point's own disparity, which matters as much as the
/// measurement. Cauchy weights times the pairs' own, brought to a mean of one; Gauss-Newton on a left
/// perturbation of T_cur_ref.
#pragma once

#include <cstdint>

#include "core/fixed_vector.hpp"
#include "core/nodiscard.hpp"
#include "core/random.hpp"
#include "core/work_budget.hpp"
#include "geometry/stereo_rig.hpp"
#include "mission_cfg.hpp"

namespace cairn {

/// One point: where it stands in the reference camera frame, and where the current frame sees it.
struct MotionPair {
  Vec3 p_ref_m = Vec3(0.0, 0.0, 0.0);
  double d_ref_px = 0.0;     ///< disparity in the reference frame, > 0
  StereoPixel seen;          ///< in the current frame, on its epipolar line, disparity > 0
  std::uint16_t source = 0;  ///< the caller's index
  float weight = 1.0F;       ///< information against the other pairs', > 0; any unit
};
using MotionPairs = FixedVector<MotionPair, cfg::kMaxFeatures>;

struct MotionParams {
  int max_hypotheses = 200;
  double inlier_px = 2.0;  ///< RANSAC, in each image
  int min_inliers = 12;
  double confidence = 0.999;  ///< early end of RANSAC
  double sigma_px = 0.15;  ///< of a refined match, each coordinate, at best; the median residual may raise it
  /// Residuals beyond this many sigmas lose weight. The likeliest for what alignment leaves (3D Student t) is
  /// 0.9 on road, 1.7 on rendered and 0.6 on indoor images: tails are heavy.
  double cauchy = 1.5;
  int iterations = 10;  ///< of the refinement, at most
  std::uint64_t seed = 1;
};

enum class CAIRN_NODISCARD MotionStatus : std::uint8_t {
  kIdle,
  kRunning,
  kEstimated,    ///< the only one to use
  kTooFewPairs,  ///< fewer pairs than min_inliers
  kNoConsensus,  ///< no hypothesis reached min_inliers
  kDegenerate,   ///< the inliers do not fix all six parameters
  kBadInput,     ///< a parameter or a pair out of its range
};

/// What a refinement tells of an offset of all disparities and of the lens (geometry/stereo_rig.hpp), both
/// frames', once the motion is left free: information, and that times what disparities want to be longer by
/// (px) and the lens to be stronger.
struct RigEvidence {
  double columns_information = 0.0;
  double columns_evidence = 0.0;
  double lens_information = 0.0;
  double lens_evidence = 0.0;
  double shared = 0.0;  ///< information of both: what one explains of the other
};

struct MotionResult {
  Pose3 T_cur_ref;                 ///< carries points of the reference camera into the current one
  Mat6 covariance = Mat6::Zero();  ///< of the left perturbation (rotation xyz rad, translation xyz m),
                                   ///< in the current camera
  int inliers = 0;
  int pairs = 0;
  double rms_px = 0.0;  ///< of the inliers' residuals in u, v, d
  RigEvidence rig;
};

/// RANSAC with absolute orientation.
class RansacMotionJob {
 public:
  static constexpr std::uint32_t unit_ops(std::size_t pairs) {
    return 4500U + 25U * static_cast<std::uint32_t>(pairs);
  }
  /// `pairs` is borrowed until done.
  MotionStatus start(const MotionParams& params, const StereoRig& rig, const MotionPairs& pairs);
  /// Unit: one hypothesis, or the final orientation of all inliers.
  Progress step(WorkBudget& budget);
  MotionStatus status() const { return status_; }
  const MotionResult& result() const { return result_; }
  bool is_inlier(std::size_t i) const { return inlier_[i]; }

 private:
  void try_hypothesis();
  int count_inliers(const Pose3& T_cur_ref, bool* flags) const;
  MotionStatus finish();

  MotionStatus status_ = MotionStatus::kIdle;
  MotionParams params_;
  StereoRig rig_;
  const MotionPairs* pairs_ = nullptr;
  Random random_;
  int hypothesis_ = 0;
  int needed_ = 0;
  int best_count_ = 0;
  Pose3 best_;
  MotionResult result_;
  Vec3 p_cur_m_[cfg::kMaxFeatures];  ///< triangulated; packed to the inliers' at the end
  Vec3 inlier_ref_m_[cfg::kMaxFeatures];
  bool inlier_[cfg::kMaxFeatures] = {};
};

/// Robust refinement from a start motion.
class RefineMotionJob {
 public:
  static constexpr std::size_t kUnitPairs = 40;
  /// Of a pair: 200 to measure its residual and 300 to add it up, 500 to judge it, or 800 to ask of the rig.
  static constexpr std::uint32_t kPairOps[4] = {200, 300, 500, 800};
  static constexpr std::uint32_t kMostUnitOps = 500 * kUnitPairs;

  /// `of_rig`: what the motion tells of columns and lens is asked for.
  MotionStatus start(const MotionParams& params, const StereoRig& rig, const MotionPairs& pairs,
                     const Pose3& T_cur_ref, bool of_rig = false);
  /// Unit: so many pairs, in one of an iteration's two passes or in the last ones.
  Progress step(WorkBudget& budget);
  MotionStatus status() const { return status_; }
  const MotionResult& result() const { return result_; }
  /// Within three sigmas at the solution.
  bool is_inlier(std::size_t i) const { return inlier_[i]; }

 private:
  /// Passes over all pairs: the first two are an iteration of Gauss and Newton.
  enum class Pass : std::uint8_t {
    kScale,       ///< how large the residuals are
    kAccumulate,  ///< normal equations
    kJudge,       ///< inliers and covariance at the solution
    kRig,         ///< what the motion tells of columns and lens
  };
  /// Residuals counted by size, of which the median is wanted: no sorting, bounded work.
  struct Histogram {
    static constexpr int kBins = 128;
    std::uint16_t bin[kBins] = {};
    int count = 0;
  };
  /// Of the last pass.
  struct Tail {
    double squares = 0.0;
    double weights = 0.0;
    double pulls2 = 0.0;  ///< squares of the weighted residuals, of one coordinate
    double slopes = 0.0;  ///< what a weighted residual changes by with its residual, of one coordinate
  };

  /// Normal equations of columns and lens: their own, and what they share with the motion.
  struct Rig {
    double own[2] = {};
    double shared = 0.0;
    double gradient[2] = {};
    Vec6 cross[2] = {Vec6::Zero(), Vec6::Zero()};
  };

  void begin_pass(Pass pass);
  void end_pass();
  void measure(std::size_t end);
  void accumulate_pairs(std::size_t end);
  void judge(std::size_t end);
  double residual_scale() const;
  /// True when converged.
  bool move();
  MotionStatus finish();
  void ask_of_rig(std::size_t end);
  void tell_of_rig();

  MotionStatus status_ = MotionStatus::kIdle;
  MotionParams params_;
  StereoRig rig_;
  const MotionPairs* pairs_ = nullptr;
  bool of_rig_ = false;
  int iteration_ = 0;
  Pass pass_ = Pass::kScale;
  std::size_t cursor_ = 0;
  Histogram histogram_;
  double sigma_px_ = 0.0;
  double unit_ = 1.0;   ///< of the weights: their mean is one in it
  double scale_ = 0.0;  ///< of the covariance, by what the residuals really were
  Pose3 T_cur_ref_;
  Mat6 information_ = Mat6::Zero();
  Vec6 gradient_ = Vec6::Zero();
  Tail tail_;
  Rig sums_;
  MotionResult result_;
  bool inlier_[cfg::kMaxFeatures] = {};
};

}  // namespace cairn
