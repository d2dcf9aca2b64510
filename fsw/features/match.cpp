#include "features/match.hpp"

#include "features/sift_descriptor.hpp"

namespace cairn {
namespace {

/// A distance from which on a rival no longer matters to a best one of `best`, nor to a better one.
std::uint32_t no_rival(std::uint32_t best, float ratio) {
  const float bound = static_cast<float>(best) / ratio + 4.0F;  // 4: more than floats of this size round
  return bound < 16777216.0F ? static_cast<std::uint32_t>(bound) : UINT32_MAX;
}

}  // namespace

void MatchJob::start(const MatchParams& params, const FeatureSet& query, const FeatureSet& target,
                     const FixedVector<SearchWindow, cfg::kMaxFeatures>& windows,
                     const SmoothImage& query_image, const SmoothImage& target_image) {
  CAIRN_ASSERT(windows.size() == query.features.size());
  params_ = params;
  query_ = &query;
  target_ = &target;
  windows_ = &windows;
  next_ = 0;
  query_image_ = query_image;
  target_image_ = target_image;
  opened_ = false;
  count_ = 0;
  for (std::size_t i = 0; i < cfg::kMaxFeatures; ++i) partner_[i] = taken_by_[i] = kNone;
}

Progress MatchJob::step(WorkBudget& budget) {
  while (next_ < query_->features.size()) {
    if (!opened_) open();
    const std::size_t left = search_.end - search_.at;
    const auto targets = static_cast<std::uint32_t>(left < kUnitTargets ? left : kUnitTargets);
    if (!budget.take(unit_ops(targets, !opened_, by_patches()))) return Progress::kMore;
    opened_ = true;
    look(search_.at + targets);
    if (search_.at < search_.end) continue;
    decide();
    ++next_;
    opened_ = false;
  }
  return Progress::kDone;
}

void MatchJob::open() {
  const SearchWindow& w = (*windows_)[next_];
  search_ = {};
  search_.stop = no_rival(params_.max_distance, params_.ratio);
  if (w.u0 > w.u1 || w.v0 > w.v1) return;
  search_.at = target_->first_of_row(w.v0);
  search_.end = target_->first_of_row(w.v1 + 1);
  const Feature& query = query_->features[next_];
  if (!by_patches() && !query.described) search_.end = search_.at;
  if (by_patches() && search_.at < search_.end) patch_.cut(query_image_, query.iu, query.iv);
}

void MatchJob::look(std::size_t end) {
  const SearchWindow& w = (*windows_)[next_];
  const Feature& query = query_->features[next_];
  Search s = search_;
  for (; s.at < end; ++s.at) {
    const Feature& candidate = target_->features[s.at];
    if (candidate.iu < w.u0 || candidate.iu > w.u1) continue;
    if ((candidate.response < 0) != (query.response < 0)) continue;
    if (!by_patches() && !candidate.described) continue;
    std::uint32_t distance;
    if (by_patches()) {
      SparsePatch patch;
      patch.cut(target_image_, candidate.iu, candidate.iv);
      distance = patch_.difference(patch);
    } else {
      distance = chi_squared(query_->descriptors[next_], target_->descriptors[s.at], s.stop);
    }
    if (distance < s.best) {
      s.second = s.best;
      s.best = distance;
      s.best_index = s.at;
      const std::uint32_t bound = no_rival(s.best, params_.ratio);
      if (bound < s.stop) s.stop = bound;
    } else if (distance < s.second) {
      s.second = distance;
    }
    if (s.second < s.stop) s.stop = s.second;
  }
  search_ = s;
}

void MatchJob::decide() {
  const Search& s = search_;
  if (s.best > params_.max_distance) return;
  if (s.second != UINT32_MAX && static_cast<float>(s.best) > params_.ratio * static_cast<float>(s.second))
    return;
  const std::int16_t rival = taken_by_[s.best_index];
  if (rival != kNone) {
    if (taken_distance_[s.best_index] <= s.best) return;
    partner_[rival] = kNone;
    --count_;
  }
  taken_by_[s.best_index] = static_cast<std::int16_t>(next_);
  taken_distance_[s.best_index] = s.best;
  partner_[next_] = static_cast<std::int16_t>(s.best_index);
  ++count_;
}

}  // namespace cairn
