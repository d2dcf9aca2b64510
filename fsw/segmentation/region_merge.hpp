/// Iterative merging of neighbouring regions of similar intensity, then elimination of small ones (METHOD
/// B.2).
///
/// A pass finds, for each region, the neighbour whose mean grey value is nearest (ties: the smaller number),
/// then goes through the regions in ascending order and joins each one to that neighbour where their means,
/// as they are by then, differ by at most the level of the pass. The level goes up by one grey level a pass
/// to `merge_grey` and stays there until a pass joins nothing: the most similar ones go first, as in
/// agglomerative merging, without a sorted list of edges. After that, each region below `min_area_px` joins
/// its nearest neighbour whatever the difference, until none is left (unless the whole image is one):
/// speckles and holes go to what is around them.
///
/// Every pass but the first `merge_grey` + 2 joins at least one region, so that the work is bounded; some 20
/// passes are usual. Cost: about 4 operations a pixel and 4 a region number for each pass. Deterministic: no
/// order but that of numbers and rows enters.
#pragma once

#include <cstdint>

#include "core/work_budget.hpp"
#include "segmentation/region_map.hpp"

namespace cairn {

struct RegionMergeParams {
  int merge_grey = 14;   ///< largest difference of means that is merged, 0 to 255 grey levels
  int min_area_px = 12;  ///< smaller regions are given to a neighbour. 0 or 1: none
};

enum class [[nodiscard]] RegionMergeStatus : std::uint8_t{
    kIdle,      ///< never started
    kRunning,   ///< call step() again
    kDone,      ///< the map holds the merged regions, its rows flattened
    kBadInput,  ///< a parameter out of its range, or an empty map
};

/// The unit of work is a row or a run of region numbers.
class RegionMergeJob {
 public:
  /// `map`: connected in all its rows. Borrowed until the job is done.
  RegionMergeStatus start(const RegionMergeParams& params, RegionMap& map);
  Progress step(WorkBudget& budget);
  RegionMergeStatus status() const { return status_; }
  /// Passes over the image so far.
  int passes() const { return passes_; }

 private:
  enum class Phase : std::uint8_t { kPrepare, kScan, kJoin };

  std::uint32_t unit_cost() const;
  void do_unit();
  void prepare(int first, int last);
  void scan_row(int y);
  void compare(std::uint16_t a, std::uint16_t b);
  void join(int first, int last);
  bool may_join(std::uint16_t root, std::uint16_t partner) const;
  void end_pass();

  RegionMergeParams params_;
  RegionMap* map_ = nullptr;
  RegionMergeStatus status_ = RegionMergeStatus::kIdle;
  Phase phase_ = Phase::kPrepare;
  int cursor_ = 0;  ///< next row or region number of the phase
  int level_grey_ = 0;
  bool pruning_ = false;
  int joined_in_pass_ = 0;
  int passes_ = 0;
  /// Difference of means (1/256 grey) times 2^16 plus the neighbour: the smallest is the nearest, ties
  /// included.
  std::uint32_t nearest_[kMaxRegionNumbers] = {};
};

}  // namespace cairn
