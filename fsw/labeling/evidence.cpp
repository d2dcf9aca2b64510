#include "labeling/evidence.hpp"

#include <cmath>

namespace cairn {
namespace {

constexpr int kPlaneIterations = 10;

RegionBox widen(const RegionBox& box, double share, int least) {
  const int du = static_cast<int>(share * (box.u_max - box.u_min + 1));
  const int dv = static_cast<int>(share * (box.v_max - box.v_min + 1));
  const int margin_u = du > least ? du : least;
  const int margin_v = dv > least ? dv : least;
  RegionBox wide = box;
  wide.u_min = static_cast<std::int16_t>(box.u_min - margin_u);
  wide.u_max = static_cast<std::int16_t>(box.u_max + margin_u);
  wide.v_min = static_cast<std::int16_t>(box.v_min - margin_v);
  wide.v_max = static_cast<std::int16_t>(box.v_max + margin_v);
  return wide;
}

/// Least squares for a plane, with weights. Solved by Cramer's rule: three unknowns, always well scaled here.
struct PlaneSums {
  double w = 0, x = 0, y = 0, z = 0, xx = 0, xy = 0, yy = 0, xz = 0, yz = 0;

  void add(double weight, double px, double py, double pz) {
    w += weight;
    x += weight * px;
    y += weight * py;
    z += weight * pz;
    xx += weight * px * px;
    xy += weight * px * py;
    yy += weight * py * py;
    xz += weight * px * pz;
    yz += weight * py * pz;
  }
  /// Slopes about the centroid, held to zero by a prior of (0.01 m)^2 on the spread: few points in a row
  /// fix no tilt.
  void solve(double& a, double& b, double& c) const {
    const double mx = x / w;
    const double my = y / w;
    const double sxx = xx / w - mx * mx + 1.0e-4;
    const double syy = yy / w - my * my + 1.0e-4;
    const double sxy = xy / w - mx * my;
    const double sxz = xz / w - mx * z / w;
    const double syz = yz / w - my * z / w;
    const double det = sxx * syy - sxy * sxy;
    a = (sxz * syy - syz * sxy) / det;
    b = (syz * sxx - sxz * sxy) / det;
    c = z / w - a * mx - b * my;
  }
};

}  // namespace

RegionEvidenceStatus RegionEvidenceJob::start(const RegionEvidenceParams& params, const RegionBoxes& regions,
                                              SurfacePoints& points) {
  params_ = params;
  regions_ = &regions;
  points_ = &points;
  next_ = 0;
  boulders_ = untested_ = 0;
  if (points.empty()) return status_ = RegionEvidenceStatus::kNoPoints;
  std::size_t i = 0;
  for (int v = 0; v <= cfg::kImageHeight; ++v) {
    while (i < points.size() && points[i].v < v) ++i;
    row_begin_[v] = static_cast<std::uint16_t>(i);
  }
  for (SurfacePoint& p : points) p.raised = false;
  return status_ = RegionEvidenceStatus::kRunning;
}

Progress RegionEvidenceJob::step(WorkBudget& budget) {
  if (status_ != RegionEvidenceStatus::kRunning) return Progress::kDone;
  for (; next_ < regions_->size(); ++next_) {
    const RegionBox wide = widen((*regions_)[next_], 0.5, 12);
    const auto points =
        static_cast<std::uint32_t>(first_at_or_below(wide.v_max + 1) - first_at_or_below(wide.v_min));
    if (!budget.take(50U + 40U * points)) return Progress::kMore;
    judge((*regions_)[next_]);
  }
  status_ = RegionEvidenceStatus::kDone;
  return Progress::kDone;
}

std::size_t RegionEvidenceJob::first_at_or_below(int v) const {
  return row_begin_[v < 0 ? 0 : (v > cfg::kImageHeight ? cfg::kImageHeight : v)];
}

void RegionEvidenceJob::judge(const RegionBox& region) {
  const RegionBox wide = widen(region, 0.5, 12);
  const RegionBox near = widen(region, 0.25, 6);
  const std::size_t begin = first_at_or_below(near.v_min);
  const std::size_t end = first_at_or_below(near.v_max + 1);
  Plane ground{};
  if (params_.test_height) {
    gather_ground(wide, region.label);
    if (static_cast<int>(ground_.size()) < params_.min_ground_points) {
      ++untested_;
      return;
    }
    if (points_of(region.label, begin, end) < params_.min_raised) return;  // the plane is not needed
    fit_ground(ground);
  }
  const auto is_raised = [&](const SurfacePoint& p) {
    if (!params_.test_height) return p.label == region.label;
    const double h = ground.height(p.p_site_m);
    return h >= params_.min_height_m && h >= 3.0 * static_cast<double>(p.sigma_height_m);
  };
  int own = 0;
  double top = 0.0;
  for (std::size_t i = begin; i < end; ++i) {
    const SurfacePoint& p = (*points_)[i];
    if (p.label != region.label || !is_raised(p)) continue;
    ++own;
    const double h = params_.test_height ? ground.height(p.p_site_m) : params_.min_top_m;
    if (h > top) top = h;
  }
  if (own < params_.min_raised || top < params_.min_top_m) return;
  ++boulders_;
  for (std::size_t i = begin; i < end; ++i) {
    SurfacePoint& p = (*points_)[i];
    const bool candidate =
        p.label == region.label || (p.label == 0 && p.u >= near.u_min && p.u <= near.u_max);
    if (candidate && is_raised(p)) p.raised = true;
  }
}

void RegionEvidenceJob::gather_ground(const RegionBox& widened, std::uint8_t label) {
  const std::size_t end = first_at_or_below(widened.v_max + 1);
  ground_.clear();
  for (std::size_t i = first_at_or_below(widened.v_min); i < end; ++i) {
    const SurfacePoint& p = (*points_)[i];
    if (p.label == label || p.u < widened.u_min || p.u > widened.u_max) continue;
    ground_.append(static_cast<std::uint16_t>(i));
  }
}

int RegionEvidenceJob::points_of(std::uint8_t label, std::size_t begin, std::size_t end) const {
  int count = 0;
  for (std::size_t i = begin; i < end; ++i) count += (*points_)[i].label == label ? 1 : 0;
  return count;
}

void RegionEvidenceJob::fit_ground(Plane& plane) const {
  plane = {};
  const SurfacePoint* points = points_->data();
  for (const std::uint16_t i : ground_) {
    plane.x0 += points[i].p_site_m.x();
    plane.y0 += points[i].p_site_m.y();
  }
  plane.x0 /= static_cast<double>(ground_.size());
  plane.y0 /= static_cast<double>(ground_.size());
  for (int iteration = 0; iteration < kPlaneIterations; ++iteration) {
    PlaneSums sums;
    for (const std::uint16_t i : ground_) {
      const Vec3& p = points[i].p_site_m;
      double w = 1.0;
      if (iteration > 0) {
        const double r = plane.height(p) / params_.plane_scale_m;
        const double above = 1.0 + r * r;
        w = r > 0.0 ? 1.0 / (above * above) : 1.0 / (1.0 + 0.25 * r * r);
      }
      sums.add(w, p.x() - plane.x0, p.y() - plane.y0, p.z());
    }
    sums.solve(plane.a, plane.b, plane.c);
  }
}

}  // namespace cairn
