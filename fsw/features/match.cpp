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
                     const FixedVector<SearchWindow, cfg::kMaxFeatures>& windows) {
  CAIRN_ASSERT(windows.size() == query.features.size());
  params_ = params;
  query_ = &query;
  target_ = &target;
  windows_ = &windows;
  next_ = 0;
  count_ = 0;
  for (std::size_t i = 0; i < cfg::kMaxFeatures; ++i) partner_[i] = taken_by_[i] = kNone;
}

Progress MatchJob::step(WorkBudget& budget) {
  for (; next_ < query_->features.size(); ++next_) {
    const SearchWindow& w = (*windows_)[next_];
    const bool empty = w.u0 > w.u1 || w.v0 > w.v1;
    const auto band =
        empty ? 0U
              : static_cast<std::uint32_t>(target_->first_of_row(w.v1 + 1) - target_->first_of_row(w.v0));
    if (!budget.take(8U + 100U * band)) return Progress::kMore;
    if (!empty) match_one(next_);
  }
  return Progress::kDone;
}

void MatchJob::match_one(std::size_t i) {
  const SearchWindow& w = (*windows_)[i];
  const Feature& query = query_->features[i];
  const Descriptor& descriptor = query_->descriptors[i];
  std::uint32_t best = UINT32_MAX;
  std::uint32_t second = UINT32_MAX;
  std::uint32_t stop = no_rival(params_.max_distance, params_.ratio);
  std::size_t best_index = 0;
  const std::size_t end = target_->first_of_row(w.v1 + 1);
  for (std::size_t j = target_->first_of_row(w.v0); j < end; ++j) {
    const Feature& candidate = target_->features[j];
    if (candidate.iu < w.u0 || candidate.iu > w.u1) continue;
    if ((candidate.response < 0) != (query.response < 0)) continue;
    const std::uint32_t distance = chi_squared(descriptor, target_->descriptors[j], stop);
    if (distance < best) {
      second = best;
      best = distance;
      best_index = j;
      const std::uint32_t bound = no_rival(best, params_.ratio);
      if (bound < stop) stop = bound;
    } else if (distance < second) {
      second = distance;
    }
    if (second < stop) stop = second;
  }
  if (best > params_.max_distance) return;
  if (second != UINT32_MAX && static_cast<float>(best) > params_.ratio * static_cast<float>(second)) return;
  const std::int16_t rival = taken_by_[best_index];
  if (rival != kNone) {
    if (taken_distance_[best_index] <= best) return;
    partner_[rival] = kNone;
    --count_;
  }
  taken_by_[best_index] = static_cast<std::int16_t>(i);
  taken_distance_[best_index] = best;
  partner_[i] = static_cast<std::int16_t>(best_index);
  ++count_;
}

}  // namespace cairn
