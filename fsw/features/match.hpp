/// Matching by nearest / second-nearest ratio (METHOD section A), one job for left to right and for t to t+1:
/// under the chi-squared distance of descriptors; or under the difference of sparse patches, which cost a
/// tenth and do where windows hold few, as along an epipolar line.
///
/// A match is kept where the best distance is at most `max_distance` and at most `ratio` times the second
/// best in the window. Each partner is used once: of the queries that chose it so, the nearest keeps it (the
/// first of equals). Blobs match blobs of the same sign.
#pragma once

#include <cstdint>

#include "core/work_budget.hpp"
#include "features/feature_set.hpp"
#include "features/sparse_patch.hpp"

namespace cairn {

/// Pixels in which a partner may lie, inclusive; empty where u0 > u1.
struct SearchWindow {
  std::int16_t u0 = 0;
  std::int16_t u1 = -1;
  std::int16_t v0 = 0;
  std::int16_t v1 = -1;
};

struct MatchParams {
  float ratio = 0.8F;  ///< Lowe's ratio, in (0, 1]
  /// Chi-squared in 1/256 (unrelated patches: about 2500 * 256), or SparsePatch::difference().
  std::uint32_t max_distance = 1600 * 256;
};

class MatchJob {
 public:
  static constexpr std::int16_t kNone = -1;
  static constexpr std::uint32_t kUnitTargets = 95;
  /// `first`: of the query feature.
  static constexpr std::uint32_t unit_ops(std::uint32_t targets, bool first, bool by_patches) {
    return (first ? (by_patches ? 700U : 8U) : 0U) + (by_patches ? 200U : 100U) * targets;
  }

  /// Query i of `query` looks in windows[i] of `target`. All are borrowed until done. With images, those that
  /// the features were found in, patches are compared; without, what isn't described has no partner.
  void start(const MatchParams& params, const FeatureSet& query, const FeatureSet& target,
             const FixedVector<SearchWindow, cfg::kMaxFeatures>& windows, const SmoothImage& query_image = {},
             const SmoothImage& target_image = {});
  /// Unit: one query feature, against so many of the target.
  Progress step(WorkBudget& budget);
  /// Index of the partner of query i, or kNone. Valid when done.
  std::int16_t partner(std::size_t i) const { return partner_[i]; }
  std::size_t count() const { return count_; }

 private:
  /// Of one query feature.
  struct Search {
    std::size_t at = 0;  ///< in the target
    std::size_t end = 0;
    std::uint32_t best = UINT32_MAX;
    std::uint32_t second = UINT32_MAX;
    std::uint32_t stop = 0;
    std::size_t best_index = 0;
  };

  bool by_patches() const { return query_image_.data != nullptr; }
  void open();
  void look(std::size_t end);
  [[gnu::cold]] void decide();

  MatchParams params_;
  const FeatureSet* query_ = nullptr;
  const FeatureSet* target_ = nullptr;
  const FixedVector<SearchWindow, cfg::kMaxFeatures>* windows_ = nullptr;
  std::size_t next_ = 0;
  bool opened_ = false;      ///< its search has begun
  SmoothImage query_image_;  ///< without data: by descriptors
  SmoothImage target_image_;
  SparsePatch patch_;  ///< of the query feature
  Search search_;
  std::size_t count_ = 0;
  std::int16_t partner_[cfg::kMaxFeatures] = {};
  std::int16_t taken_by_[cfg::kMaxFeatures] = {};  ///< query that holds target j, or kNone
  std::uint32_t taken_distance_[cfg::kMaxFeatures] = {};
};

}  // namespace cairn
