/// Iterative merging of neighbouring regions of similar intensity, then elimination of small
/// ones (METHOD B.2).
///
/// A pass finds, for each region, the neighbour whose mean grey value is nearest (ties: the smaller number),
/// then goes through the regions in ascending order and joins each one to that neighbour where their means,
/// as they are by then, differ by at most the level of the pass. The level goes up by `kLevelStep_grey` a
/// pass to `merge_grey` and stays there until a pass joins nothing: the most similar ones go first, as in
/// agglomerative merging, without a sorted list of edges. (Steps of one grey level gave no better boulders
/// and took twice the passes.) After that, each region below `min_area_px` joins its nearest neighbour
/// whatever the difference, until none is left (unless the whole image is one): speckles and holes go to what
/// is around them.
///
/// The first pass scans the image and notes which regions are neighbours. Later ones go over these notes,
/// from which pairs that became one region are taken out, and most pairs that became the same one. Where
/// there are more pairs than there is room for, as with noise, the next pass scans the image again.
///
/// Every pass but the first `merge_grey` / `kLevelStep_grey` + 3 joins at least one region, so that the work
/// is bounded; some 10 passes are usual. Cost: for each pass about 8 operations a pair of neighbours (in the
/// first one, 8 a pixel) and 8 a region; at the end 8 a region number and 8 a pixel. Deterministic: no order
/// but that of numbers and rows enters.
#pragma once

#include <cstdint>

#include "core/nodiscard.hpp"
#include "core/work_budget.hpp"
#include "segmentation/region_map.hpp"

namespace cairn {

struct RegionMergeParams {
  int merge_grey = 14;       ///< largest difference of means that is merged, 0 to 255 grey levels
  int min_area_px = 12;      ///< smaller regions are given to a neighbour. 0 or 1: none
  int first_level_grey = 0;  ///< of the first pass, 0 to merge_grey
};

enum class CAIRN_NODISCARD RegionMergeStatus : std::uint8_t {
  kIdle,      ///< never started
  kRunning,   ///< call step() again
  kDone,      ///< the map holds the merged regions, its rows flattened
  kBadInput,  ///< a parameter out of its range, or an empty map
};

/// The unit of work is a row, or a run of regions or pairs.
class RegionMergeJob {
 public:
  static constexpr int kRun = 256;  ///< regions or pairs of a unit
  static constexpr int kLevelStep_grey = 4;
  static constexpr std::uint32_t unit_ops(int items) { return 8U * static_cast<std::uint32_t>(items); }

  /// `map`: connected in all its rows. Borrowed until the job is done.
  RegionMergeStatus start(const RegionMergeParams& params, RegionMap& map);
  Progress step(WorkBudget& budget);
  RegionMergeStatus status() const { return status_; }

 private:
  enum class Phase : std::uint8_t { kBegin, kScan, kJoin, kPrepare, kPairs, kCompress, kFlatten };
  static constexpr std::size_t kMaxPairs = 2 * kMaxRegionNumbers;
  static constexpr std::size_t kRecentPairs = 256;

  bool by_rows() const { return phase_ == Phase::kScan || phase_ == Phase::kFlatten; }
  int phase_end() const;
  void do_unit();
  void begin(int first, int last);
  void prepare(int first, int last);
  void begin_pairs();
  void scan_row(int y);
  void look_at(std::uint16_t a, std::uint16_t b);
  void go_over_pairs(int first, int last);
  bool compare(std::uint16_t low, std::uint16_t high);
  void join(int first, int last);
  bool may_join(std::uint16_t root, std::uint16_t partner) const;
  void end_pass();

  RegionMergeParams params_;
  RegionMap* map_ = nullptr;
  RegionMergeStatus status_ = RegionMergeStatus::kIdle;
  Phase phase_ = Phase::kBegin;
  int cursor_ = 0;  ///< next row, region number, region or pair of the phase
  int level_grey_ = 0;
  bool pruning_ = false;
  int joined_in_pass_ = 0;
  int regions_ = 0;                               ///< in region_
  int pairs_ = 0;                                 ///< in pair_
  int kept_ = 0;                                  ///< of the regions or pairs that the phase went over
  bool pairs_fit_ = false;                        ///< all pairs of neighbours are in pair_
  std::uint16_t region_[kMaxRegionNumbers] = {};  ///< ascending; those joined in the last pass among them
  std::uint32_t pair_[kMaxPairs] = {};            ///< the smaller number times 2^16 plus the larger one
  std::uint32_t recent_[kRecentPairs] = {};       ///< pairs looked at in this pass, by a hash
  /// Difference of means (1/256 grey) times 2^16 plus the neighbour: the smallest is the
  /// nearest, ties included.
  std::uint32_t nearest_[kMaxRegionNumbers] = {};
};

}  // namespace cairn
