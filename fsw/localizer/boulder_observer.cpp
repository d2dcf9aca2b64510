#include "localizer/boulder_observer.hpp"

#include <cmath>

#include "core/rounding.hpp"

namespace cairn {
namespace {

constexpr double kNearestBoulder_m = 0.3;  // where one is said to be nearer, its outline is widened as there
constexpr double kNearestPoint_m = 0.05;   // in front of the camera, for a point to be projected

}  // namespace

void BoulderObserver::init(const BoulderParams& params, const StereoRig& rig) {
  params_ = params;
  rig_ = rig;
  status_ = ObserveStatus::kIdle;
  sightings_.clear();
  last_members_.clear();
  last_sightings_ = 0;
}

ObserveStatus BoulderObserver::start(const ImageU8& left, const ImageU8& right, const Vec3& plane,
                                     const Pose3& T_site_cam, const ImageOffset& offset) {
  counts_ = {};
  sightings_.clear();
  cursor_ = 0;
  spent_ops_ = 0;
  phase_ = Phase::kSegment;
  left_ = left;
  right_ = right;
  plane_ = plane;
  offset_ = offset;
  T_site_cam_ = T_site_cam;
  const Vec3 seen(plane[0], plane[1], plane[2] - offset.columns_px);
  const int lower_px = rounded(offset.rows_px);
  const bool fit = is_valid(T_site_cam) &&
                   probe_.start(params_.probe, left, right, seen, lower_px) == ProbeStatus::kRunning;
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
  const std::uint64_t before = budget.spent();
  const bool done = work(budget);
  spent_ops_ += budget.spent() - before;
  if (done) next_phase();
  return done;
}

bool BoulderObserver::work(WorkBudget& budget) {
  switch (phase_) {
    case Phase::kSegment: return segmentation_.step(budget) == Progress::kDone;
    case Phase::kProbe: return probe_.step(budget) == Progress::kDone;
    case Phase::kEvidence: return evidence_.step(budget) == Progress::kDone;
    case Phase::kCluster: return clustering_.step(budget) == Progress::kDone;
    case Phase::kVote: return voting_.step(budget) == Progress::kDone;
    default: break;
  }
  do {
    if (!budget.take(unit_ops())) return false;
  } while (!unit());
  return true;
}

std::uint32_t BoulderObserver::unit_ops() const {
  const auto raised = static_cast<std::uint32_t>(raised_.size());
  switch (phase_) {
    case Phase::kLift: return kLiftOps;
    case Phase::kCollect: return cursor_ > 0 ? kCollectOps : start_ops(raised);
    case Phase::kSort: return sort_ops(raised);
    case Phase::kDescribe:
      return describe_ops(std::uint32_t{cluster_begin_[cursor_ + 1U]} - cluster_begin_[cursor_]);
    case Phase::kPaint: return paint_ops(raised);
    case Phase::kCarry: return kCarryOps;
    case Phase::kKeep: return keep_ops(raised);
    default: return 0;
  }
}

/// True when the phase is done.
bool BoulderObserver::unit() {
  switch (phase_) {
    case Phase::kLift:
      if (cursor_ < probe_.result().size()) lift(probe_.result()[cursor_++]);
      return cursor_ == probe_.result().size();
    case Phase::kCollect: return collect();
    case Phase::kSort: sort_by_cluster(); return true;
    case Phase::kDescribe: return observe_cluster();
    case Phase::kPaint: paint_sightings(); return true;
    case Phase::kCarry: return carry();
    case Phase::kKeep: keep(); return true;
    default: return true;
  }
}

void BoulderObserver::next_phase() {
  if (status_ != ObserveStatus::kRunning) return;
  const Phase before = phase_;
  phase_ = static_cast<Phase>(static_cast<std::uint8_t>(phase_) + 1U);
  cursor_ = 0;
  switch (before) {
    case Phase::kSegment:
      if (segmentation_.status() != SegmentationStatus::kDone) finish(ObserveStatus::kNoRegions);
      begin_probes();
      break;
    case Phase::kProbe: surface_.clear(); break;
    case Phase::kLift: begin_evidence(); break;
    case Phase::kEvidence: begin_clustering(); break;
    case Phase::kCarry: (void)voting_.associate(); break;
    case Phase::kKeep:
      finish(sightings_.empty() ? ObserveStatus::kNoBoulders : ObserveStatus::kBoulders);
      break;
    default: break;
  }
}

bool BoulderObserver::ray_of(const StereoProbe& probe, Vec3& ray_m) const {
  StereoPixel px;
  px.u_left = probe.u - 0.5;  // centre of an even window
  px.v_left = px.v_right = probe.v - 0.5;
  px.u_right = px.u_left - (static_cast<double>(probe.d_px) + offset_.columns_px);
  if (params_.own.covers(px.u_left, px.v_left)) return false;
  px = without_lens(rig_, offset_.lens, px);
  if (!(px.disparity_px() > 0.0)) return false;
  ray_m = T_site_cam_.q * triangulate(rig_, px);
  return true;
}

void BoulderObserver::lift(const StereoProbe& probe) {
  Vec3 ray;
  if (!ray_of(probe, ray)) return;
  if (ray.x() * ray.x() + ray.y() * ray.y() > params_.max_range_m * params_.max_range_m) return;
  SurfacePoint point;
  point.p_site_m = ray + T_site_cam_.t;
  point.sigma_height_m = static_cast<float>(std::fabs(ray.z()) * params_.probe_sigma_px /
                                            (static_cast<double>(probe.d_px) + offset_.columns_px));
  point.u = probe.u;
  point.v = probe.v;
  point.label = segmentation_.labels().label_at(probe.u - 0.5, probe.v - 0.5);
  surface_.append(point);
}

/// Landmarks are made of the whole ground, boulders of what is about the regions.
void BoulderObserver::begin_probes() {
  probe_.allow_for_gain(segmentation_.gain_q8());
  probe_.plan(spent_ops_ < params_.plan_ops ? params_.plan_ops - static_cast<std::uint32_t>(spent_ops_) : 0U);
  boxes_.clear();
  close_by_.clear();
  surroundings_.clear();
  for (const Region& r : segmentation_.regions()) {
    const RegionBox box = {r.label, static_cast<std::int16_t>(r.u_min_px),
                           static_cast<std::int16_t>(r.u_max_px), static_cast<std::int16_t>(r.v_min_px),
                           static_cast<std::int16_t>(r.v_max_px)};
    boxes_.append(box);
    close_by_.append(RegionEvidenceJob::close_by(box));
    surroundings_.append(RegionEvidenceJob::surroundings(box));
  }
  if (!cfg::kHaveLandmarks) probe_.attend_to(close_by_, surroundings_);
}

void BoulderObserver::begin_evidence() {
  counts_.probes = static_cast<int>(surface_.size());
  counts_.thinned_rows = probe_.thinned_rows();
  counts_.regions = static_cast<int>(segmentation_.regions().size());
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
  cursor_ = surface_.size();
}

/// From the bottom of the image upwards: where there is no room for all, the near ones stay.
bool BoulderObserver::collect() {
  if (cursor_ == 0) {
    if (clustering_.start(params_.clustering, raised_) != ClusteringStatus::kRunning)
      finish(ObserveStatus::kNoBoulders);
    return true;
  }
  const std::size_t end = cursor_ > kRun ? cursor_ - kRun : 0;
  while (cursor_ > end) {
    const SurfacePoint& p = surface_[--cursor_];
    if (!p.raised) continue;
    ++counts_.raised;
    if (!raised_.push_back({p.p_site_m, p.label}) ||
        !raised_surface_.push_back(static_cast<std::uint16_t>(cursor_))) {
      ++counts_.dropped_points;
    }
  }
  return false;
}

void BoulderObserver::sort_by_cluster() {
  const ClusteringResult& clusters = clustering_.result();
  for (int c = 0; c <= clusters.clusters; ++c) cluster_begin_[c] = 0;
  for (std::size_t i = 0; i < raised_.size(); ++i) ++cluster_begin_[clusters.cluster_of[i]];
  std::uint16_t end = 0;
  for (int c = 0; c <= clusters.clusters; ++c) {
    end = static_cast<std::uint16_t>(end + cluster_begin_[c]);
    cluster_begin_[c] = end;
  }
  // From ends to begins: the last point first, so that points ascend within a cluster.
  for (std::size_t i = raised_.size(); i-- > 0;)
    by_cluster_[--cluster_begin_[clusters.cluster_of[i]]] = static_cast<std::uint16_t>(i);
}

bool BoulderObserver::observe_cluster() {
  const std::size_t c = cursor_++;
  const std::uint16_t* const members = by_cluster_ + cluster_begin_[c];
  const int points = cluster_begin_[c + 1] - cluster_begin_[c];
  bool labelled = false;
  for (int k = 0; k < points; ++k) labelled |= raised_[members[k]].label != 0;
  sighting_of_[c] = 0;
  if (points >= params_.min_points && labelled) {
    if (sightings_.push_back(describe(members, points))) {
      sighting_of_[c] = static_cast<std::uint8_t>(sightings_.size());
    } else {
      ++counts_.dropped_boulders;
    }
  }
  return cursor_ == static_cast<std::size_t>(clustering_.result().clusters);
}

BoulderSighting BoulderObserver::describe(const std::uint16_t* members, int points) const {
  Vec3 mean(0.0, 0.0, 0.0);
  for (int k = 0; k < points; ++k) mean += raised_[members[k]].p_m;
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
  for (int k = 0; k < points; ++k) {
    const Vec3 off = raised_[members[k]].p_m - mean;
    const double a = along.x() * off.x() + along.y() * off.y();
    const double c = across.x() * off.x() + across.y() * off.y();
    near = a < near ? a : near;
    left = c < left ? c : left;
    right = c > right ? c : right;
    sum2 += off.squaredNorm();
  }
  // Probes are samples: the outline lies half a spacing beyond the outermost.
  const double depth = range > kNearestBoulder_m ? range : kNearestBoulder_m;
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

void BoulderObserver::paint_sightings() {
  for (std::uint8_t& cell : grid_) cell = 0;
  for (std::size_t i = 0; i < raised_.size(); ++i) {
    const SurfacePoint& p = surface_[raised_surface_[i]];
    grid_[(p.v / StereoProbeJob::kSpacing) * kGridColumns + p.u / StereoProbeJob::kSpacing] =
        sighting_of_[clustering_.result().cluster_of[i]];
  }
  // Where they cannot be counted there are no votes, and all boulders are new ones.
  const VotingStatus begun =
      voting_.start(last_sightings_, static_cast<int>(sightings_.size()), params_.min_votes);
  if (begun != VotingStatus::kCollecting) last_members_.clear();
}

bool BoulderObserver::carry() {
  const Pose3 T_cam_site = T_site_cam_.inverse();
  const std::size_t left = last_members_.size() - cursor_;
  const std::size_t end = cursor_ + (left < kCarried ? left : kCarried);
  for (; cursor_ < end; ++cursor_) {
    const Member& m = last_members_[cursor_];
    const Vec3 p = T_cam_site * m.p_site_m;
    if (!(p.z() > kNearestPoint_m)) continue;
    const StereoPixel px = project(rig_, p);
    if (!(px.u_left >= 0.0 && px.v_left >= 0.0 && px.u_left < rig_.width_px && px.v_left < rig_.height_px))
      continue;
    const std::uint8_t now = grid_[static_cast<int>(px.v_left) / StereoProbeJob::kSpacing * kGridColumns +
                                   static_cast<int>(px.u_left) / StereoProbeJob::kSpacing];
    if (now == 0) continue;
    const bool voted = voting_.add_vote(m.sighting, now);
    CAIRN_ASSERT(voted);
  }
  return cursor_ == last_members_.size();
}

void BoulderObserver::keep() {
  if (sightings_.empty()) return;
  last_members_.clear();
  last_sightings_ = static_cast<int>(sightings_.size());
  for (std::size_t i = 0; i < raised_.size(); ++i) {
    const std::uint8_t sighting = sighting_of_[clustering_.result().cluster_of[i]];
    if (sighting != 0) last_members_.append({raised_[i].p_m, sighting});
  }
}

void BoulderObserver::finish(ObserveStatus status) {
  status_ = status;
  if (status != ObserveStatus::kBoulders) return;
  for (std::size_t i = 0; i < sightings_.size(); ++i) {
    sightings_[i].previous = voting_.result().previous_of[i + 1];
    counts_.matched += sightings_[i].previous != 0 ? 1 : 0;
  }
}

}  // namespace cairn
