#include "labeling/evidence.hpp"

#include <cmath>

namespace cairn {
namespace {

// Half of the planes settle in three, one in a hundred takes fifteen.
constexpr int kMostPlaneIterations = 15;
constexpr std::size_t kEnoughGround = 128;  // points for a plane: a tenth of the roughness
constexpr double kSettled = 0.04;           // root mean square change of heights, of the ground's roughness

PixelBounds widen(const RegionBox& box, double share, int least) {
  const int du = static_cast<int>(share * (box.u_max - box.u_min + 1));
  const int dv = static_cast<int>(share * (box.v_max - box.v_min + 1));
  const int margin_u = du > least ? du : least;
  const int margin_v = dv > least ? dv : least;
  return {static_cast<std::int16_t>(box.u_min - margin_u), static_cast<std::int16_t>(box.u_max + margin_u),
          static_cast<std::int16_t>(box.v_min - margin_v), static_cast<std::int16_t>(box.v_max + margin_v)};
}

}  // namespace

PixelBounds RegionEvidenceJob::close_by(const RegionBox& region) { return widen(region, 0.375, 9); }
PixelBounds RegionEvidenceJob::surroundings(const RegionBox& region) { return widen(region, 0.5, 12); }

RegionEvidenceStatus RegionEvidenceJob::start(const RegionEvidenceParams& params, const RegionBoxes& regions,
                                              SurfacePoints& points) {
  params_ = params;
  regions_ = &regions;
  points_ = &points;
  next_ = 0;
  boulders_ = untested_ = 0;
  if (points.empty()) return status_ = RegionEvidenceStatus::kNoPoints;
  row_ = 0;
  enter(Phase::kIndex, 0, points.size());
  return status_ = RegionEvidenceStatus::kRunning;
}

Progress RegionEvidenceJob::step(WorkBudget& budget) {
  if (status_ != RegionEvidenceStatus::kRunning) return Progress::kDone;
  while (phase_ == Phase::kIndex || next_ < regions_->size()) {
    if (phase_ == Phase::kOpen) {
      if (!budget.take(kOpenOps)) return Progress::kMore;
      open();
      continue;
    }
    if (cursor_ < end_) {
      const Span span = next_span();
      const std::uint32_t each = phase_ == Phase::kIndex ? 4U : phase_ == Phase::kGather ? kMostEach : 9U;
      if (!budget.take(unit_ops(span.end - span.begin, each))) return Progress::kMore;
      unit(span);
    }
    if (cursor_ == end_) next_phase();
  }
  status_ = RegionEvidenceStatus::kDone;
  return Progress::kDone;
}

/// The points of the next unit. Of a region: those of one row between its box's sides.
RegionEvidenceJob::Span RegionEvidenceJob::next_span() const {
  if (phase_ == Phase::kIndex || phase_ == Phase::kFit)
    return {cursor_, end_ - cursor_ < kUnitPoints ? end_ : cursor_ + kUnitPoints};
  const PixelBounds& box = phase_ == Phase::kGather ? wide_ : near_;
  const std::size_t row_end = first_at_or_below((*points_)[cursor_].v + 1);
  const std::size_t begin = first_right_of(box.u_min - 1, cursor_, row_end);
  return {begin, first_right_of(box.u_max, begin, row_end)};
}

/// Among the points of one row, which ascend.
std::size_t RegionEvidenceJob::first_right_of(int u, std::size_t begin, std::size_t end) const {
  while (begin < end) {
    const std::size_t middle = begin + (end - begin) / 2;
    if ((*points_)[middle].u <= u) {
      begin = middle + 1;
    } else {
      end = middle;
    }
  }
  return begin;
}

std::size_t RegionEvidenceJob::first_at_or_below(int v) const {
  return row_begin_[v < 0 ? 0 : (v > cfg::kImageHeight ? cfg::kImageHeight : v)];
}

void RegionEvidenceJob::open() {
  wide_ = surroundings(region());
  near_ = widen(region(), 0.25, 6);
  near_begin_ = first_at_or_below(near_.v_min);
  near_end_ = first_at_or_below(near_.v_max + 1);
  ground_.clear();
  plane_ = {};
  labelled_ = iteration_ = own_ = 0;
  top_m_ = 0.0;
  if (params_.test_height) {
    enter(Phase::kGather, first_at_or_below(wide_.v_min), first_at_or_below(wide_.v_max + 1));
  } else {
    enter(Phase::kOwn, near_begin_, near_end_);
  }
}

void RegionEvidenceJob::enter(Phase phase, std::size_t begin, std::size_t end) {
  phase_ = phase;
  cursor_ = begin;
  end_ = end;
}

void RegionEvidenceJob::next_region() {
  ++next_;
  phase_ = Phase::kOpen;
}

void RegionEvidenceJob::next_phase() {
  switch (phase_) {
    case Phase::kGather: after_gather(); break;
    case Phase::kFit: after_iteration(); break;
    case Phase::kOwn:
      if (own_ < params_.min_raised || top_m_ < params_.min_top_m) {
        next_region();
        break;
      }
      ++boulders_;
      enter(Phase::kMark, near_begin_, near_end_);
      break;
    case Phase::kIndex:
      for (; row_ <= cfg::kImageHeight; ++row_) row_begin_[row_] = static_cast<std::uint16_t>(end_);
      phase_ = Phase::kOpen;
      break;
    case Phase::kOpen:
    case Phase::kMark: next_region(); break;
  }
}

void RegionEvidenceJob::after_gather() {
  if (static_cast<int>(ground_.size()) < params_.min_ground_points) {
    ++untested_;
    next_region();
  } else if (labelled_ < params_.min_raised) {
    next_region();  // the plane is not needed
  } else {
    thin_ground();
    const Vec3& middle = (*points_)[ground_[ground_.size() / 2]].p_site_m;
    plane_.x0 = middle.x();
    plane_.y0 = middle.y();
    sums_ = {};
    enter(Phase::kFit, 0, ground_.size());
  }
}

/// Each second point, third point ..., as many as are enough.
void RegionEvidenceJob::thin_ground() {
  const std::size_t each = (ground_.size() + kEnoughGround - 1) / kEnoughGround;
  if (each < 2) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < ground_.size(); i += each) ground_[kept++] = ground_[i];
  ground_.resize(kept);
}

void RegionEvidenceJob::after_iteration() {
  const GroundPlane before = plane_;
  sums_.solve(plane_);
  const double least = kSettled * params_.plane_scale_m;
  const bool settled = iteration_ > 0 && sums_.mean_square_between(before, plane_) < least * least;
  sums_ = {};
  if (++iteration_ < kMostPlaneIterations && !settled) {
    enter(Phase::kFit, 0, ground_.size());
  } else {
    enter(Phase::kOwn, near_begin_, near_end_);
  }
}

void RegionEvidenceJob::unit(const Span& span) {
  SurfacePoint* const points = points_->data();
  switch (phase_) {
    case Phase::kIndex: index(span.end); return;
    case Phase::kFit: fit(span.end); return;
    case Phase::kGather:
      for (std::size_t i = span.begin; i < span.end; ++i) gather(i);
      break;
    case Phase::kOwn:
      for (std::size_t i = span.begin; i < span.end; ++i) {
        if (label_[i] == region().label) own(points[i]);
      }
      break;
    case Phase::kMark:
      for (std::size_t i = span.begin; i < span.end; ++i) mark(points[i]);
      break;
    case Phase::kOpen: return;
  }
  cursor_ = first_at_or_below(points[cursor_].v + 1);
}

void RegionEvidenceJob::index(std::size_t end) {
  for (; cursor_ < end; ++cursor_) {
    SurfacePoint& p = (*points_)[cursor_];
    p.raised = false;
    label_[cursor_] = p.label;
    for (; row_ <= p.v && row_ <= cfg::kImageHeight; ++row_)
      row_begin_[row_] = static_cast<std::uint16_t>(cursor_);
  }
}

void RegionEvidenceJob::gather(std::size_t index) {
  if (label_[index] == region().label) {
    labelled_ += index >= near_begin_ && index < near_end_ ? 1 : 0;
    return;
  }
  ground_.append(static_cast<std::uint16_t>(index));
}

/// What the loop takes and adds to is a copy, which can stay in registers.
void RegionEvidenceJob::fit(std::size_t end) {
  const SurfacePoint* const points = points_->data();
  const GroundPlane plane = plane_;
  const double per_scale = 1.0 / params_.plane_scale_m;
  PlaneSums sums = sums_;
  for (; cursor_ < end; ++cursor_) {
    const Vec3& p = points[ground_[cursor_]].p_site_m;
    double w = 1.0;
    if (iteration_ > 0) {
      const double r = plane.height(p) * per_scale;
      w = ground_weight(r);
    }
    sums.add(w, p.x() - plane.x0, p.y() - plane.y0, p.z());
  }
  sums_ = sums;
}

bool RegionEvidenceJob::is_raised(const SurfacePoint& p) const {
  if (!params_.test_height) return p.label == region().label;
  const double h = plane_.height(p.p_site_m);
  return h >= params_.min_height_m && h >= 3.0 * static_cast<double>(p.sigma_height_m);
}

void RegionEvidenceJob::own(const SurfacePoint& p) {
  if (!is_raised(p)) return;
  ++own_;
  const double h = params_.test_height ? plane_.height(p.p_site_m) : params_.min_top_m;
  if (h > top_m_) top_m_ = h;
}

void RegionEvidenceJob::mark(SurfacePoint& p) const {
  if ((p.label == region().label || p.label == 0) && is_raised(p)) p.raised = true;
}

}  // namespace cairn
