#include "segmentation/region_merge.hpp"

namespace cairn {
namespace {

constexpr int kRun = 256;                           // region numbers of one unit of work
constexpr std::uint32_t kNoNeighbour = UINT32_MAX;  // no difference of means reaches its upper half

std::uint16_t difference(std::uint16_t a, std::uint16_t b) {
  return static_cast<std::uint16_t>(a > b ? a - b : b - a);
}

}  // namespace

RegionMergeStatus RegionMergeJob::start(const RegionMergeParams& params, RegionMap& map) {
  status_ = RegionMergeStatus::kBadInput;
  if (params.merge_grey < 0 || params.merge_grey > 255 || params.min_area_px < 0 || map.numbers() < 1)
    return status_;
  params_ = params;
  map_ = &map;
  phase_ = Phase::kPrepare;
  cursor_ = 0;
  level_grey_ = 0;
  pruning_ = false;
  joined_in_pass_ = 0;
  passes_ = 0;
  status_ = RegionMergeStatus::kRunning;
  return status_;
}

Progress RegionMergeJob::step(WorkBudget& budget) {
  while (status_ == RegionMergeStatus::kRunning) {
    if (!budget.take(unit_cost())) return Progress::kMore;
    do_unit();
  }
  return Progress::kDone;
}

std::uint32_t RegionMergeJob::unit_cost() const {
  return phase_ == Phase::kScan ? 4U * static_cast<std::uint32_t>(map_->width()) : 2U * kRun;
}

void RegionMergeJob::do_unit() {
  const int end = phase_ == Phase::kScan ? map_->height() : map_->numbers();
  const int last = phase_ == Phase::kScan ? cursor_ + 1 : (end - cursor_ < kRun ? end : cursor_ + kRun);
  switch (phase_) {
    case Phase::kPrepare: prepare(cursor_, last); break;
    case Phase::kScan: scan_row(cursor_); break;
    case Phase::kJoin: join(cursor_, last); break;
  }
  cursor_ = last;
  if (cursor_ < end) return;
  cursor_ = 0;
  switch (phase_) {
    case Phase::kPrepare: phase_ = Phase::kScan; break;
    case Phase::kScan: phase_ = Phase::kJoin; break;
    case Phase::kJoin: end_pass(); break;
  }
}

void RegionMergeJob::prepare(int first, int last) {
  map_->compress(first, last);
  for (int i = first; i < last; ++i) nearest_[i] = kNoNeighbour;
}

void RegionMergeJob::scan_row(int y) {
  if (y == 0) map_->flatten_row(0);
  const bool has_below = y + 1 < map_->height();
  if (has_below) map_->flatten_row(y + 1);
  const std::uint16_t* row = map_->row(y);
  const std::uint16_t* below = has_below ? map_->row(y + 1) : row;
  for (int x = 0; x + 1 < map_->width(); ++x) {
    if (row[x] != row[x + 1]) compare(row[x], row[x + 1]);
  }
  for (int x = 0; x < map_->width(); ++x) {
    if (row[x] != below[x]) compare(row[x], below[x]);
  }
}

void RegionMergeJob::compare(std::uint16_t a, std::uint16_t b) {
  const std::uint32_t difference_q8 = difference(map_->mean_q8(a), map_->mean_q8(b));
  const std::uint32_t offer_to_a = difference_q8 << 16U | b;
  const std::uint32_t offer_to_b = difference_q8 << 16U | a;
  if (offer_to_a < nearest_[a]) nearest_[a] = offer_to_a;
  if (offer_to_b < nearest_[b]) nearest_[b] = offer_to_b;
}

void RegionMergeJob::join(int first, int last) {
  for (int i = first; i < last; ++i) {
    const auto root = static_cast<std::uint16_t>(i);
    if (!map_->is_root(root) || nearest_[root] == kNoNeighbour) continue;
    const std::uint16_t partner = map_->root_of(static_cast<std::uint16_t>(nearest_[root] & 0xFFFFU));
    if (partner == root || !may_join(root, partner)) continue;
    map_->merge(root, partner);
    ++joined_in_pass_;
  }
}

bool RegionMergeJob::may_join(std::uint16_t root, std::uint16_t partner) const {
  if (pruning_) return map_->area_px(root) < static_cast<std::uint32_t>(params_.min_area_px);
  return difference(map_->mean_q8(root), map_->mean_q8(partner)) <= level_grey_ * 256;
}

// A pass that joins nothing at the last level ends the merging, and one that joins nothing of the pruning
// ends the job: its scan has flattened the rows since the last merge.
void RegionMergeJob::end_pass() {
  ++passes_;
  phase_ = Phase::kPrepare;
  const bool quiet = joined_in_pass_ == 0;
  joined_in_pass_ = 0;
  if (!pruning_ && level_grey_ < params_.merge_grey) {
    ++level_grey_;
  } else if (quiet && !pruning_) {
    pruning_ = true;
  } else if (quiet) {
    status_ = RegionMergeStatus::kDone;
  }
}

}  // namespace cairn
