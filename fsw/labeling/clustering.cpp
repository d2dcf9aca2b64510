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
  const bool known = params.linkage == Linkage::kSingle || params.linkage == Linkage::kAverage;
  if (!known || !(params.cut_m >= 0.0 && params.cut_m <= kMaxCut_m))
    return status_ = ClusteringStatus::kBadInput;
  if (points.empty()) return status_ = ClusteringStatus::kNoPoints;
  for (const ClusterPoint& point : points) {
    for (int axis = 0; axis < 3; ++axis) {
      if (!(std::fabs(point.p_m[axis]) <= kMaxCoordinate_m)) return status_ = ClusteringStatus::kBadInput;
    }
    if (point.label > cfg::kMaxLabels) return status_ = ClusteringStatus::kBadInput;
  }
  if (params.linkage == Linkage::kAverage && points.size() > cfg::kMaxAverageLinkagePoints) {
    return status_ = ClusteringStatus::kTooManyPoints;
  }
  points_ = &points;
  for (std::size_t i = 0; i < points.size(); ++i) root_of_[i] = kNone;
  cursor_ = 0;
  queue_size_ = 0;
  seed_ = 0;
  phase_ = params.linkage == Linkage::kSingle ? Phase::kSpread : Phase::kMatrix;
  return status_ = ClusteringStatus::kRunning;
}

double ClusteringJob::distance2(std::size_t a, std::size_t b) const {
  return ((*points_)[a].p_m - (*points_)[b].p_m).squaredNorm();
}

// ---- single linkage: components of the graph of close points ----------------------------------------------

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

// ---- average linkage --------------------------------------------------------------------------------------

/// Mean distance of two clusters, in a triangle without its diagonal.
double& ClusteringJob::between(std::size_t a, std::size_t b) {
  const std::size_t low = a < b ? a : b;
  const std::size_t high = a < b ? b : a;
  return matrix_[high * (high - 1) / 2 + low];
}

void ClusteringJob::matrix_unit() {
  const std::size_t a = cursor_++;
  for (std::size_t b = 0; b < a; ++b) {
    const double d = between(a, b) = std::sqrt(distance2(a, b));
    if (nearest_[b] != kNone && d >= nearest_m_[b]) continue;
    nearest_[b] = static_cast<std::uint16_t>(a);
    nearest_m_[b] = d;
  }
  nearest_[a] = kNone;
  members_[a] = 1;
  root_of_[a] = static_cast<std::uint16_t>(a);
  if (cursor_ == points_->size()) phase_ = Phase::kMerge;
}

/// The nearest cluster above `a`; of equal ones the lowest.
void ClusteringJob::find_nearest(std::size_t a) {
  nearest_[a] = kNone;
  for (std::size_t b = a + 1; b < points_->size(); ++b) {
    if (members_[b] == 0) continue;
    const double d = between(a, b);
    if (nearest_[a] != kNone && d >= nearest_m_[a]) continue;
    nearest_[a] = static_cast<std::uint16_t>(b);
    nearest_m_[a] = d;
  }
}

/// Brings one stale nearest cluster up to date, or joins the two closest clusters.
/// False: none are within the cut.
bool ClusteringJob::merge_unit() {
  std::size_t a = kNone;
  for (std::size_t i = 0; i < points_->size(); ++i) {
    if (members_[i] == 0 || nearest_[i] == kNone) continue;
    if (nearest_[i] == kStale) {
      find_nearest(i);
      return true;
    }
    if (a == kNone || nearest_m_[i] < nearest_m_[a]) a = i;
  }
  if (a == kNone || nearest_m_[a] > params_.cut_m) return false;
  join(a, nearest_[a]);
  return true;
}

/// Cluster b goes into a; a < b.
void ClusteringJob::join(std::size_t a, std::size_t b) {
  const double weight_a = members_[a];
  const double weight_b = members_[b];
  for (std::size_t k = 0; k < points_->size(); ++k) {
    if (root_of_[k] == b) root_of_[k] = static_cast<std::uint16_t>(a);
    if (k == a || k == b || members_[k] == 0) continue;
    double& mean = between(a, k);
    mean = (weight_a * mean + weight_b * between(b, k)) / (weight_a + weight_b);
    // No other row's nearest can change: a mean is no nearer than the nearer of the two it is made of.
    if (nearest_[k] == a || nearest_[k] == b) nearest_[k] = kStale;
  }
  nearest_[a] = kStale;
  members_[a] = static_cast<std::uint16_t>(members_[a] + members_[b]);
  members_[b] = 0;
}

// ---- clusters and labels ----------------------------------------------------------------------------------

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
    case Phase::kMatrix:
      if (!budget.take(6U * n)) return false;
      matrix_unit();
      return true;
    case Phase::kMerge:
      if (!budget.take(6U * n)) return false;
      if (!merge_unit()) phase_ = Phase::kNumber;
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
