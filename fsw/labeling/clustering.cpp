#include "labeling/clustering.hpp"

#include <cmath>

namespace cairn {
namespace {

constexpr double kMaxCoordinate_m = 1.0e7;
constexpr double kMaxCut_m = 1.0e6;

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
  for (std::size_t i = 0; i < points.size(); ++i) root_of_[i] = kNone;
  cursor_ = 0;
  queue_size_ = 0;
  seed_ = 0;
  phase_ = Phase::kSpread;
  return status_ = ClusteringStatus::kRunning;
}

double ClusteringJob::distance2(std::size_t a, std::size_t b) const {
  return ((*points_)[a].p_m - (*points_)[b].p_m).squaredNorm();
}

/// Looks around from one reached point; where none is left, from the next point that nothing has reached.
void ClusteringJob::spread_unit() {
  if (cursor_ == queue_size_) {
    while (root_of_[seed_] != kNone) ++seed_;
    root_of_[seed_] = static_cast<std::uint16_t>(seed_);
    queue_[queue_size_++] = static_cast<std::uint16_t>(seed_);
  }
  const std::size_t at = queue_[cursor_++];
  const double cut2 = params_.cut_m * params_.cut_m;
  const ClusterPoint* points = points_->data();
  for (std::size_t i = seed_ + 1; i < points_->size(); ++i) {
    if (root_of_[i] != kNone) continue;
    const double dx = points[i].p_m.x() - points[at].p_m.x();
    if (dx * dx > cut2 || distance2(at, i) > cut2) continue;  // most are far off on the first axis
    root_of_[i] = root_of_[at];
    queue_[queue_size_++] = static_cast<std::uint16_t>(i);
  }
  if (cursor_ == points_->size()) phase_ = Phase::kNumber;
}

/// Roots are the lowest points, so numbering them as they come numbers the clusters as they first occur.
void ClusteringJob::number_clusters() {
  for (std::size_t i = 0; i < points_->size(); ++i) {
    const std::size_t root = root_of_[i];
    const auto number = root == i ? static_cast<std::uint16_t>(result_.clusters) : result_.cluster_of[root];
    if (root == i) {
      first_label_[number] = 0;
      ++result_.clusters;
    }
    tally_[number] = 0;
    result_.cluster_of.append(number);
  }
  cursor_ = 1;
  phase_ = Phase::kLabels;
}

/// One label: the cluster of most of its points, and the lowest label there.
void ClusteringJob::label_unit() {
  const std::size_t label = cursor_++;
  std::size_t best = kNone;
  for (std::size_t i = 0; i < points_->size(); ++i) {
    if ((*points_)[i].label == label) ++tally_[result_.cluster_of[i]];
  }
  for (std::size_t i = 0; i < points_->size(); ++i) {
    if ((*points_)[i].label != label) continue;
    const std::size_t cluster = result_.cluster_of[i];
    if (best == kNone || tally_[cluster] > tally_[best] ||
        (tally_[cluster] == tally_[best] && cluster < best)) {
      best = cluster;
    }
  }
  for (std::size_t i = 0; i < points_->size(); ++i) tally_[result_.cluster_of[i]] = 0;
  if (best != kNone) {
    if (first_label_[best] == 0) first_label_[best] = static_cast<std::uint8_t>(label);
    result_.merged_label[label] = first_label_[best];
    if (first_label_[best] != label) ++result_.labels_merged;
  }
  if (cursor_ > cfg::kMaxLabels) status_ = ClusteringStatus::kDone;
}

bool ClusteringJob::unit(WorkBudget& budget) {
  const auto n = static_cast<std::uint32_t>(points_->size());
  switch (phase_) {
    case Phase::kSpread:
      if (!budget.take(spread_ops(n))) return false;
      spread_unit();
      return true;
    case Phase::kNumber:
      if (!budget.take(2U * n)) return false;
      number_clusters();
      return true;
    case Phase::kLabels:
      if (!budget.take(3U * n)) return false;
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
