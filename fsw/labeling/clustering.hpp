/// Agglomerative clustering of 3D points by Euclidean distance, and the labels that it merges (METHOD section
/// B.2: mends over-segmentation; also joins boulders of the local map that lie within a merge distance).
///
/// Agglomeration starts with every point alone and joins the two closest clusters until none are closer than
/// the cut; the distance of two clusters is that of their closest points (single linkage). Its clusters at a
/// cut are the connected components of the graph that joins points within the cut, so that is what is
/// computed: O(n) memory, no merge order and so no ties. Points lie in strips as wide as the cut, so that one
/// is held against its own strip and the two beside it; n^2 distances where all lie in three. It follows long
/// shapes; a chain of stray points joins two boulders. Distances equal to the cut still join.
///
/// Merging of labels. Each point may carry a label (a region; 0 = none). A label belongs to the cluster that
/// holds most of its points (of equal ones the first), and labels of one cluster are one boulder, which takes
/// the lowest of them. By majority, because a few points that strayed off a region must not chain it
/// to its neighbour.
///
/// Cost: 4 operations for each point that is looked at, 2 n^2 at worst, units of one point, which looks at
/// those of its strips that nothing has reached; for the strips and the labels 4 n each, and 5 a label.
#pragma once

#include <cstdint>

#include "core/eigen.hpp"
#include "core/fixed_vector.hpp"
#include "core/nodiscard.hpp"
#include "core/work_budget.hpp"
#include "mission_cfg.hpp"

namespace cairn {

enum class CAIRN_NODISCARD ClusteringStatus : std::uint8_t {
  kIdle,      ///< never started
  kRunning,   ///< call step() again
  kDone,      ///< the result may be read
  kNoPoints,  ///< nothing to cluster
  kBadInput,  ///< a point not finite or beyond 1e7 m, label above kMaxLabels, cut outside [0, 1e6] m
};

struct ClusteringParams {
  double cut_m = 0.1;  ///< clusters farther apart stay apart
};

struct ClusterPoint {
  Vec3 p_m = Vec3(0.0, 0.0, 0.0);  ///< any frame
  std::uint8_t label = 0;          ///< 1 .. kMaxLabels; 0 = none
};
using ClusterPoints = FixedVector<ClusterPoint, cfg::kMaxClusterPoints>;

struct ClusteringResult {
  int clusters = 0;
  FixedVector<std::uint16_t, cfg::kMaxClusterPoints> cluster_of;  ///< by point; numbered as they first occur
  /// [label] = the label of its boulder (the lowest of those merged; itself where alone);
  /// 0: label without points.
  std::uint8_t merged_label[cfg::kMaxLabels + 1] = {};
  int labels_merged = 0;  ///< labels that gave way to a lower one
};

/// One clustering, resumable. The points are borrowed until it is done.
class ClusteringJob {
 public:
  static constexpr std::uint32_t kStrips = 64;  ///< a power of two; after the last comes the first again
  static constexpr std::uint32_t spread_ops(std::size_t far_points) {
    return 5U + 4U * static_cast<std::uint32_t>(far_points);
  }
  static constexpr std::uint32_t strips_ops(std::size_t points) {
    return kStrips + 4U * static_cast<std::uint32_t>(points);
  }
  static constexpr std::uint32_t number_ops(std::size_t points) {
    return cfg::kMaxLabels + 4U * static_cast<std::uint32_t>(points);
  }
  static constexpr std::uint32_t label_ops(std::size_t points) {
    return 5U + 4U * static_cast<std::uint32_t>(points);
  }
  /// kRunning, or what is wrong with the input.
  ClusteringStatus start(const ClusteringParams& params, const ClusterPoints& points);
  Progress step(WorkBudget& budget);  ///< the same result for every slicing
  ClusteringStatus status() const { return status_; }
  const ClusteringResult& result() const { return result_; }  ///< once done

 private:
  static constexpr std::uint16_t kNone = 0xFFFF;
  enum class Phase : std::uint8_t { kStrips, kSpread, kNumber, kLabels };

  [[gnu::cold]] void lay_in_strips();
  [[gnu::cold]] std::uint32_t spread_cost();
  void spread_unit();
  void number_clusters();
  void label_unit();
  bool unit(WorkBudget& budget);

  ClusteringParams params_;
  ClusteringStatus status_ = ClusteringStatus::kIdle;
  Phase phase_ = Phase::kSpread;
  std::size_t cursor_ = 0;
  const ClusterPoints* points_ = nullptr;

  struct LabelPoints {
    std::uint16_t last = kNone;  ///< before it comes next_ of it
    std::uint16_t count = 0;
  };

  std::uint16_t root_of_[cfg::kMaxClusterPoints] = {};  ///< lowest point of the cluster; kNone: not reached
  std::uint8_t strip_of_[cfg::kMaxClusterPoints] = {};
  std::uint16_t in_strip_[kStrips] = {};                ///< points there that nothing has reached ...
  std::uint16_t first_[kStrips] = {};                   ///< ... the first of them, kNone: none ...
  std::uint16_t further_[cfg::kMaxClusterPoints] = {};  ///< ... and the next
  std::size_t seed_ = 0;                                ///< all points before it are reached

  std::uint16_t queue_[cfg::kMaxClusterPoints] = {};  ///< points reached; seen to: those before cursor_
  std::size_t queue_size_ = 0;

  LabelPoints of_label_[cfg::kMaxLabels + 1] = {};
  std::uint16_t next_[cfg::kMaxClusterPoints] = {};  ///< the point of the same label before; kNone: none

  std::uint16_t tally_[cfg::kMaxClusterPoints] = {};       ///< points of one label by cluster
  std::uint8_t first_label_[cfg::kMaxClusterPoints] = {};  ///< lowest label of a cluster; 0: none yet

  ClusteringResult result_;
};

}  // namespace cairn
