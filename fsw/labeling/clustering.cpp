#include "labeling/clustering.hpp"

#include <cmath>

#include "core/rounding.hpp"

namespace cairn {
namespace {

constexpr double kMaxCoordinate_m = 1.0e7;
constexpr double kMaxCut_m = 1.0e6;
constexpr double kLeastStrip_m = 0.01;  // so that strips are counted in 32 bits
constexpr double kWider = 1.001;

}  // namespace

ClusteringStatus ClusteringJob::start(const ClusteringParams& params, const ClusterPoints& points) {
  params_ = params;
  result_ = ClusteringResult();
  if (!(params.cut_m >= 0.0 && params.cut_m <= kMaxCut_m)) return status_ = ClusteringStatus::kBadInput;
  if (points.empty()) return status_ = ClusteringStatus::kNoPoints;
  for (const ClusterPoint& point : points) {
    for (int axis = 0; axis < 3; ++axis) {
      if (!(std::fabs(point.p_m[axis]) <= kMaxCoordinate_m)) return status_ = ClusteringStatus::kBadInput;
    }
    if (point.label > cfg::kMaxLabels) return status_ = ClusteringStatus::kBadInput;
  }
  points_ = &points;
  cursor_ = 0;
  queue_size_ = 0;
  seed_ = 0;
  phase_ = Phase::kStrips;
  return status_ = ClusteringStatus::kRunning;
}

/// A little wider than the cut, so that rounding leaves no point beyond the strip beside its neighbour's.
void ClusteringJob::lay_in_strips() {
  const double width_m = params_.cut_m > kLeastStrip_m ? kWider * params_.cut_m : kWider * kLeastStrip_m;
  const double per_width = 1.0 / width_m;
  for (std::uint32_t s = 0; s < kStrips; ++s) {
    first_[s] = kNone;
    in_strip_[s] = 0;
  }
  for (std::size_t i = points_->size(); i-- > 0;) {
    const int at = rounded((*points_)[i].p_m.x() * per_width);
    const std::uint32_t strip = static_cast<std::uint32_t>(at) % kStrips;
    strip_of_[i] = static_cast<std::uint8_t>(strip);
    further_[i] = first_[strip];
    first_[strip] = static_cast<std::uint16_t>(i);
    ++in_strip_[strip];
    root_of_[i] = kNone;
  }
  phase_ = Phase::kSpread;
}

/// Where nothing is left to look around from, a new cluster begins with the lowest point not reached.
std::uint32_t ClusteringJob::spread_cost() {
  if (cursor_ == queue_size_) {
    while (root_of_[seed_] != kNone) ++seed_;
    root_of_[seed_] = static_cast<std::uint16_t>(seed_);
    queue_[queue_size_++] = static_cast<std::uint16_t>(seed_);
  }
  const std::uint32_t own = strip_of_[queue_[cursor_]];
  std::size_t looked = 0;
  for (std::uint32_t k = 0; k < 3; ++k) looked += in_strip_[(own + kStrips - 1 + k) % kStrips];
  return spread_ops(looked);
}

/// Looks around from one reached point. What is reached leaves its strip.
void ClusteringJob::spread_unit() {
  const std::size_t at = queue_[cursor_++];
  const std::uint16_t root = root_of_[at];
  const Vec3 here = (*points_)[at].p_m;
  const double cut2 = params_.cut_m * params_.cut_m;
  const ClusterPoint* points = points_->data();
  for (std::uint32_t k = 0; k < 3; ++k) {
    const std::uint32_t strip = (strip_of_[at] + kStrips - 1 + k) % kStrips;
    std::uint16_t* link = &first_[strip];
    while (*link != kNone) {
      const std::uint16_t i = *link;
      const bool is_seed = root_of_[i] != kNone;  // it was queued when its cluster began
      if (!is_seed && (points[i].p_m - here).squaredNorm() > cut2) {
        link = &further_[i];
        continue;
      }
      *link = further_[i];
      --in_strip_[strip];
      if (is_seed) continue;
      root_of_[i] = root;
      queue_[queue_size_++] = i;
    }
  }
  if (cursor_ == points_->size()) phase_ = Phase::kNumber;
}

/// Roots are the lowest points, so numbering them as they come numbers the clusters as they first occur.
void ClusteringJob::number_clusters() {
  for (LabelPoints& points : of_label_) points = LabelPoints();
  for (std::size_t i = 0; i < points_->size(); ++i) {
    const std::size_t root = root_of_[i];
    const auto number = root == i ? static_cast<std::uint16_t>(result_.clusters) : result_.cluster_of[root];
    if (root == i) {
      first_label_[number] = 0;
      ++result_.clusters;
    }
    tally_[number] = 0;
    result_.cluster_of.append(number);
    LabelPoints& alike = of_label_[(*points_)[i].label];
    next_[i] = alike.last;
    alike.last = static_cast<std::uint16_t>(i);
    ++alike.count;
  }
  cursor_ = 1;
  phase_ = Phase::kLabels;
}

/// One label: the cluster of most of its points, and the lowest label there.
void ClusteringJob::label_unit() {
  const std::size_t label = cursor_++;
  const std::uint16_t last = of_label_[label].last;
  for (std::uint16_t i = last; i != kNone; i = next_[i]) ++tally_[result_.cluster_of[i]];
  std::size_t best = kNone;
  for (std::uint16_t i = last; i != kNone; i = next_[i]) {
    const std::size_t cluster = result_.cluster_of[i];
    if (best == kNone || tally_[cluster] > tally_[best] ||
        (tally_[cluster] == tally_[best] && cluster < best)) {
      best = cluster;
    }
  }
  for (std::uint16_t i = last; i != kNone; i = next_[i]) tally_[result_.cluster_of[i]] = 0;
  if (best != kNone) {
    if (first_label_[best] == 0) first_label_[best] = static_cast<std::uint8_t>(label);
    result_.merged_label[label] = first_label_[best];
    if (first_label_[best] != label) ++result_.labels_merged;
  }
  if (cursor_ > cfg::kMaxLabels) status_ = ClusteringStatus::kDone;
}

bool ClusteringJob::unit(WorkBudget& budget) {
  switch (phase_) {
    case Phase::kStrips:
      if (!budget.take(strips_ops(points_->size()))) return false;
      lay_in_strips();
      return true;
    case Phase::kSpread:
      if (!budget.take(spread_cost())) return false;
      spread_unit();
      return true;
    case Phase::kNumber:
      if (!budget.take(number_ops(points_->size()))) return false;
      number_clusters();
      return true;
    case Phase::kLabels:
      if (!budget.take(label_ops(of_label_[cursor_].count))) return false;
      label_unit();
      return true;
  }
  return true;
}

Progress ClusteringJob::step(WorkBudget& budget) {
  while (status_ == ClusteringStatus::kRunning) {
    if (!unit(budget)) return Progress::kMore;
  }
  return Progress::kDone;
}

}  // namespace cairn
