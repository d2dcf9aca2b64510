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
  for (std::size_t i = 0; i < points.size(); ++i) far_[i] = static_cast<std::uint16_t>(i);
  far_size_ = points.size();
  cursor_ = 0;
  queue_size_ = 0;
  phase_ = Phase::kSpread;
  return status_ = ClusteringStatus::kRunning;
}

double ClusteringJob::distance2(std::size_t a, std::size_t b) const {
  return ((*points_)[a].p_m - (*points_)[b].p_m).squaredNorm();
}

/// Looks around from one reached point; where none is left, from the first point that nothing has reached.
void ClusteringJob::spread_unit() {
  std::size_t next = 0;
  if (cursor_ == queue_size_) {
    const std::uint16_t seed = far_[next++];
    root_of_[seed] = seed;
    queue_[queue_size_++] = seed;
  }
  const std::size_t at = queue_[cursor_++];
  const double cut2 = params_.cut_m * params_.cut_m;
  const ClusterPoint* points = points_->data();
  std::size_t still = 0;
  for (; next < far_size_; ++next) {
    const std::uint16_t i = far_[next];
    const double dx = points[i].p_m.x() - points[at].p_m.x();
    if (dx * dx > cut2 || distance2(at, i) > cut2) {  // most are far off on the first axis
      far_[still++] = i;
      continue;
    }
    root_of_[i] = root_of_[at];
    queue_[queue_size_++] = i;
  }
  far_size_ = still;
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
    case Phase::kSpread:
      if (!budget.take(spread_ops(far_size_))) return false;
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
