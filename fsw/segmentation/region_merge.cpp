#include "segmentation/region_merge.hpp"

namespace cairn {
namespace {

constexpr std::uint32_t kNoNeighbour = UINT32_MAX;  // no difference of means reaches its upper half

std::uint16_t difference(std::uint16_t a, std::uint16_t b) {
  return static_cast<std::uint16_t>(a > b ? a - b : b - a);
}

}  // namespace

RegionMergeStatus RegionMergeJob::start(const RegionMergeParams& params, RegionMap& map) {
  status_ = RegionMergeStatus::kBadInput;
  if (params.merge_grey < 0 || params.merge_grey > 255 || params.min_area_px < 0 ||
      params.first_level_grey < 0 || params.first_level_grey > params.merge_grey || map.numbers() < 1)
    return status_;
  params_ = params;
  map_ = &map;
  phase_ = Phase::kBegin;
  cursor_ = 0;
  regions_ = 0;
  pairs_fit_ = false;
  level_grey_ = params.first_level_grey;
  pruning_ = false;
  joined_in_pass_ = 0;
  status_ = RegionMergeStatus::kRunning;
  return status_;
}

Progress RegionMergeJob::step(WorkBudget& budget) {
  while (status_ == RegionMergeStatus::kRunning) {
    if (!budget.take(unit_ops(by_rows() ? map_->width() : kRun))) return Progress::kMore;
    do_unit();
  }
  return Progress::kDone;
}

int RegionMergeJob::phase_end() const {
  if (by_rows()) return map_->height();
  if (phase_ == Phase::kBegin || phase_ == Phase::kCompress) return map_->numbers();
  return phase_ == Phase::kPairs ? pairs_ : regions_;
}

void RegionMergeJob::do_unit() {
  const int end = phase_end();
  const int most = by_rows() ? 1 : kRun;
  const int last = end - cursor_ < most ? end : cursor_ + most;
  switch (phase_) {
    case Phase::kBegin: begin(cursor_, last); break;
    case Phase::kScan: scan_row(cursor_); break;
    case Phase::kJoin: join(cursor_, last); break;
    case Phase::kPrepare: prepare(cursor_, last); break;
    case Phase::kPairs: go_over_pairs(cursor_, last); break;
    case Phase::kCompress: map_->compress(cursor_, last); break;
    case Phase::kFlatten: map_->flatten_row(cursor_); break;
  }
  cursor_ = last;
  if (cursor_ < end) return;
  cursor_ = 0;
  switch (phase_) {
    case Phase::kBegin: begin_pairs(); break;
    case Phase::kScan: phase_ = Phase::kJoin; break;
    case Phase::kJoin: end_pass(); break;
    case Phase::kPrepare:
      regions_ = kept_;
      begin_pairs();
      break;
    case Phase::kPairs:
      pairs_ = kept_;
      phase_ = Phase::kJoin;
      break;
    case Phase::kCompress: phase_ = Phase::kFlatten; break;
    case Phase::kFlatten: status_ = RegionMergeStatus::kDone; break;
  }
}

void RegionMergeJob::begin(int first, int last) {
  map_->compress(first, last);
  for (int i = first; i < last; ++i) {
    const auto number = static_cast<std::uint16_t>(i);
    if (!map_->is_root(number)) continue;
    region_[regions_++] = number;
    nearest_[number] = kNoNeighbour;
  }
}

/// What was joined in the last pass points at its root, and leaves the list.
void RegionMergeJob::prepare(int first, int last) {
  for (int i = first; i < last; ++i) {
    const std::uint16_t number = region_[i];
    if (map_->shorten(number) != number) continue;
    region_[kept_++] = number;
    nearest_[number] = kNoNeighbour;
  }
}

void RegionMergeJob::begin_pairs() {
  for (std::uint32_t& pair : recent_) pair = 0;  // of no two regions
  kept_ = 0;
  phase_ = pairs_fit_ ? Phase::kPairs : Phase::kScan;
  if (pairs_fit_) return;
  pairs_fit_ = true;
  pairs_ = 0;
}

/// False: the pair was looked at a short while ago.
inline bool RegionMergeJob::compare(std::uint16_t low_number, std::uint16_t high_number) {
  const std::uint32_t low = low_number;
  const std::uint32_t high = high_number;
  const std::uint32_t pair = low << 16U | high;
  std::uint32_t& recent = recent_[(low ^ (high << 2U)) % kRecentPairs];
  if (recent == pair) return false;
  recent = pair;
  const std::uint32_t mean_low = map_->mean_q8(low_number);
  const std::uint32_t mean_high = map_->mean_q8(high_number);
  const std::uint32_t shifted = (mean_low > mean_high ? mean_low - mean_high : mean_high - mean_low) << 16U;
  if ((shifted | high) < nearest_[low]) nearest_[low] = shifted | high;
  if ((shifted | low) < nearest_[high]) nearest_[high] = shifted | low;
  return true;
}

void RegionMergeJob::scan_row(int y) {
  if (y == 0) map_->flatten_row(0);
  const bool has_below = y + 1 < map_->height();
  if (has_below) map_->flatten_row(y + 1);
  const std::uint16_t* row = map_->row(y);
  const std::uint16_t* below = has_below ? map_->row(y + 1) : row;
  for (int x = 0; x + 1 < map_->width(); ++x) {
    if (row[x] != row[x + 1]) look_at(row[x], row[x + 1]);
  }
  for (int x = 0; x < map_->width(); ++x) {
    if (row[x] != below[x]) look_at(row[x], below[x]);
  }
}

/// Two neighbours, found in the image.
void RegionMergeJob::look_at(std::uint16_t a, std::uint16_t b) {
  const std::uint16_t low = a < b ? a : b;
  const std::uint16_t high = a < b ? b : a;
  if (!compare(low, high)) return;
  if (pairs_ == static_cast<int>(kMaxPairs)) {
    pairs_fit_ = false;
  } else {
    pair_[pairs_++] = std::uint32_t{low} << 16U | high;
  }
}

/// What the loop counts is a copy, which can stay in a register.
void RegionMergeJob::go_over_pairs(int first, int last) {
  std::uint32_t* kept = pair_ + kept_;
  for (int i = first; i < last; ++i) {
    const std::uint32_t pair = pair_[i];
    const std::uint16_t a = map_->parent(static_cast<std::uint16_t>(pair >> 16U));
    const std::uint16_t b = map_->parent(static_cast<std::uint16_t>(pair));
    if (a < b) {
      if (compare(a, b)) *kept++ = std::uint32_t{a} << 16U | b;
    } else if (b < a) {
      if (compare(b, a)) *kept++ = std::uint32_t{b} << 16U | a;
    }
  }
  kept_ = static_cast<int>(kept - pair_);
}

void RegionMergeJob::join(int first, int last) {
  for (int i = first; i < last; ++i) {
    const std::uint16_t root = region_[i];
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
// ends the job.
void RegionMergeJob::end_pass() {
  phase_ = Phase::kPrepare;
  kept_ = 0;
  const bool quiet = joined_in_pass_ == 0;
  joined_in_pass_ = 0;
  if (!pruning_ && level_grey_ < params_.merge_grey) {
    level_grey_ += kLevelStep_grey;
    if (level_grey_ > params_.merge_grey) level_grey_ = params_.merge_grey;
  } else if (quiet && !pruning_) {
    pruning_ = true;
  } else if (quiet) {
    phase_ = Phase::kCompress;
  }
}

}  // namespace cairn
