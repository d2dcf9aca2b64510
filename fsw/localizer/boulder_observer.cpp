#include "localizer/boulder_observer.hpp"

#include <cmath>

namespace cairn {

void BoulderObserver::init(const BoulderParams& params, const StereoRig& rig) {
  params_ = params;
  rig_ = rig;
  status_ = ObserveStatus::kIdle;
  sightings_.clear();
  last_members_.clear();
  last_sightings_ = 0;
}

ObserveStatus BoulderObserver::start(const ImageU8& left, const ImageU8& right, const Vec3& plane,
                                     const Pose3& T_site_cam) {
  counts_ = {};
  sightings_.clear();
  cursor_ = 0;
  phase_ = Phase::kSegment;
  left_ = left;
  right_ = right;
  plane_ = plane;
  T_site_cam_ = T_site_cam;
  const bool fit =
      is_valid(T_site_cam) && probe_.start(params_.probe, left, right, plane) == ProbeStatus::kRunning;
  if (!fit) return status_ = ObserveStatus::kBadInput;
  switch (segmentation_.start(params_.segmentation, left)) {
    case SegmentationStatus::kRunning: return status_ = ObserveStatus::kRunning;
    case SegmentationStatus::kNoRegions:
    case SegmentationStatus::kTooManyRegions: return status_ = ObserveStatus::kNoRegions;
    default: return status_ = ObserveStatus::kBadInput;
  }
}

void BoulderObserver::abandon() {
  status_ = ObserveStatus::kIdle;
  sightings_.clear();
  counts_ = {};
}

Progress BoulderObserver::step(WorkBudget& budget) {
  while (status_ == ObserveStatus::kRunning) {
    if (!run_phase(budget)) return Progress::kMore;
  }
  return Progress::kDone;
}

bool BoulderObserver::run_phase(WorkBudget& budget) {
  switch (phase_) {
    case Phase::kSegment:
      if (segmentation_.step(budget) == Progress::kMore) return false;
      if (segmentation_.status() != SegmentationStatus::kDone) {
        finish(ObserveStatus::kNoRegions);
        return true;
      }
      phase_ = Phase::kProbe;
      return true;
    case Phase::kProbe:
      if (probe_.step(budget) == Progress::kMore) return false;
      surface_.clear();
      cursor_ = 0;
      phase_ = Phase::kLift;
      return true;
    case Phase::kLift:
      for (; cursor_ < probe_.result().size(); ++cursor_) {
        if (!budget.take(60U)) return false;
        lift(probe_.result()[cursor_]);
      }
      begin_evidence();
      return true;
    case Phase::kEvidence:
      if (evidence_.step(budget) == Progress::kMore) return false;
      begin_clustering();
      return true;
    case Phase::kCluster:
      if (clustering_.step(budget) == Progress::kMore) return false;
      phase_ = Phase::kObserve;
      return true;
    case Phase::kObserve:
      if (!budget.take(100U * static_cast<std::uint32_t>(raised_.size() + cfg::kMaxLabels))) return false;
      observe_clusters();
      begin_vote();
      return true;
    case Phase::kVote:
      if (voting_.step(budget) == Progress::kMore) return false;
      finish(sightings_.empty() ? ObserveStatus::kNoBoulders : ObserveStatus::kBoulders);
      return true;
  }
  return true;
}

void BoulderObserver::lift(const StereoProbe& probe) {
  const double d = static_cast<double>(probe.d_px);
  StereoPixel px;
  px.u_left = probe.u - 0.5;  // centre of an even window
  px.v_left = px.v_right = probe.v - 0.5;
  px.u_right = px.u_left - d;
  if (params_.own.covers(px.u_left, px.v_left)) return;
  const Vec3 p_cam = triangulate(rig_, px);
  const Vec3 ray = T_site_cam_.q * p_cam;
  if (ray.x() * ray.x() + ray.y() * ray.y() > params_.max_range_m * params_.max_range_m) return;
  SurfacePoint point;
  point.p_site_m = ray + T_site_cam_.t;
  point.sigma_height_m = static_cast<float>(std::fabs(ray.z()) * params_.probe_sigma_px / d);
  point.u = probe.u;
  point.v = probe.v;
  point.label = segmentation_.labels().label_at(px.u_left, px.v_left);
  surface_.append(point);
}

void BoulderObserver::begin_evidence() {
  counts_.probes = static_cast<int>(surface_.size());
  counts_.regions = static_cast<int>(segmentation_.regions().size());
  boxes_.clear();
  for (const Region& r : segmentation_.regions()) {
    boxes_.append({r.label, static_cast<std::int16_t>(r.u_min_px), static_cast<std::int16_t>(r.u_max_px),
                   static_cast<std::int16_t>(r.v_min_px), static_cast<std::int16_t>(r.v_max_px)});
  }
  if (evidence_.start(params_.evidence, boxes_, surface_) != RegionEvidenceStatus::kRunning) {
    finish(ObserveStatus::kNoPoints);
    return;
  }
  phase_ = Phase::kEvidence;
}

void BoulderObserver::begin_clustering() {
  counts_.evident = evidence_.boulders();
  raised_.clear();
  raised_surface_.clear();
  // From the bottom of the image upwards: where there is no room for all, the near ones stay.
  for (std::size_t i = surface_.size(); i-- > 0;) {
    if (!surface_[i].raised) continue;
    ++counts_.raised;
    if (!raised_.push_back({surface_[i].p_site_m, surface_[i].label}) ||
        !raised_surface_.push_back(static_cast<std::uint16_t>(i))) {
      ++counts_.dropped_points;
    }
  }
  if (clustering_.start(params_.clustering, raised_) != ClusteringStatus::kRunning) {
    finish(ObserveStatus::kNoBoulders);
    return;
  }
  phase_ = Phase::kCluster;
}

void BoulderObserver::observe_clusters() {
  const ClusteringResult& clusters = clustering_.result();
  std::uint16_t count[cfg::kMaxClusterPoints] = {};
  bool labelled[cfg::kMaxClusterPoints] = {};
  for (std::size_t i = 0; i < raised_.size(); ++i) {
    ++count[clusters.cluster_of[i]];
    labelled[clusters.cluster_of[i]] |= raised_[i].label != 0;
  }
  for (int c = 0; c < clusters.clusters; ++c) {
    sighting_of_[c] = 0;
    if (count[c] < params_.min_points || !labelled[c]) continue;
    if (!sightings_.push_back(describe_cluster(c, count[c]))) {
      ++counts_.dropped_boulders;
      continue;
    }
    sighting_of_[c] = static_cast<std::uint8_t>(sightings_.size());
  }
}

BoulderSighting BoulderObserver::describe_cluster(int cluster, int points) const {
  const ClusteringResult& clusters = clustering_.result();
  Vec3 mean(0.0, 0.0, 0.0);
  for (std::size_t i = 0; i < raised_.size(); ++i) {
    if (clusters.cluster_of[i] == cluster) mean += raised_[i].p_m;
  }
  mean /= points;
  // Along the line of sight (seen from above) and across it.
  const double gx = mean.x() - T_site_cam_.t.x();
  const double gy = mean.y() - T_site_cam_.t.y();
  const double range = std::sqrt(gx * gx + gy * gy) + 1.0e-6;
  const Vec2 along(gx / range, gy / range);
  const Vec2 across(-along.y(), along.x());
  double near = 1.0e9;
  double left = 1.0e9;
  double right = -1.0e9;
  double sum2 = 0.0;
  for (std::size_t i = 0; i < raised_.size(); ++i) {
    if (clusters.cluster_of[i] != cluster) continue;
    const Vec3 off = raised_[i].p_m - mean;
    const double a = along.x() * off.x() + along.y() * off.y();
    const double c = across.x() * off.x() + across.y() * off.y();
    near = a < near ? a : near;
    left = c < left ? c : left;
    right = c > right ? c : right;
    sum2 += off.squaredNorm();
  }
  // Probes are samples: the outline lies half a spacing beyond the outermost.
  const double depth = range > 0.3 ? range : 0.3;
  const double width = right - left + StereoProbeJob::kSpacing * depth / rig_.fx_px;
  BoulderSighting s;
  s.p_site_m = mean;
  if (params_.centre == BoulderCentre::kFootprint) {
    const Vec2 shift = along * (near + 0.5 * width) + across * (0.5 * (left + right));
    s.p_site_m.x() += shift.x();
    s.p_site_m.y() += shift.y();
  }
  s.diameter_m = static_cast<float>(width);
  s.spread_m = static_cast<float>(std::sqrt(sum2 / points));
  s.range_m = static_cast<float>(range);
  s.points = static_cast<std::uint16_t>(points);
  return s;
}

void BoulderObserver::begin_vote() {
  for (std::uint8_t& cell : grid_) cell = 0;
  for (std::size_t i = 0; i < raised_.size(); ++i) {
    const SurfacePoint& p = surface_[raised_surface_[i]];
    grid_[(p.v / StereoProbeJob::kSpacing) * kGridColumns + p.u / StereoProbeJob::kSpacing] =
        sighting_of_[clustering_.result().cluster_of[i]];
  }
  phase_ = Phase::kVote;
  if (voting_.start(last_sightings_, static_cast<int>(sightings_.size()), params_.min_votes) !=
      VotingStatus::kCollecting) {
    return;
  }
  const Pose3 T_cam_site = T_site_cam_.inverse();
  for (const Member& m : last_members_) {
    const Vec3 p = T_cam_site * m.p_site_m;
    if (!(p.z() > 0.05)) continue;
    const StereoPixel px = project(rig_, p);
    if (!(px.u_left >= 0.0 && px.v_left >= 0.0 && px.u_left < rig_.width_px && px.v_left < rig_.height_px))
      continue;
    const std::uint8_t now = grid_[static_cast<int>(px.v_left) / StereoProbeJob::kSpacing * kGridColumns +
                                   static_cast<int>(px.u_left) / StereoProbeJob::kSpacing];
    if (now == 0) continue;
    const bool voted = voting_.add_vote(m.sighting, now);
    CAIRN_ASSERT(voted);
  }
  const VotingStatus begun = voting_.associate();
  CAIRN_ASSERT(begun != VotingStatus::kBadInput);
}

void BoulderObserver::finish(ObserveStatus status) {
  status_ = status;
  if (status != ObserveStatus::kBoulders) return;
  for (std::size_t i = 0; i < sightings_.size(); ++i) {
    sightings_[i].previous = voting_.result().previous_of[i + 1];
    counts_.matched += sightings_[i].previous != 0 ? 1 : 0;
  }
  last_members_.clear();
  last_sightings_ = static_cast<int>(sightings_.size());
  for (std::size_t i = 0; i < raised_.size(); ++i) {
    const std::uint8_t sighting = sighting_of_[clustering_.result().cluster_of[i]];
    if (sighting != 0) last_members_.append({raised_[i].p_m, sighting});
  }
}

}  // namespace cairn
