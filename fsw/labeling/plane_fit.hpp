/// A plane through points by weighted least squares,
///   z = a (x - x0) + b (y - y0) + c,
/// about an origin that the caller chooses near the points.
#pragma once

#include "core/eigen.hpp"

namespace cairn {

struct GroundPlane {
  double a, b, c, x0, y0;
  double at(double x, double y) const { return a * (x - x0) + b * (y - y0) + c; }
  double height(const Vec3& p) const { return p.z() - (a * (p.x() - x0) + b * (p.y() - y0) + c); }
};

/// Sums of the fit; x, y about the plane's origin.
struct PlaneSums {
  double w = 0, x = 0, y = 0, z = 0, xx = 0, xy = 0, yy = 0, xz = 0, yz = 0;

  void add(double weight, double px, double py, double pz) {
    const double wx = weight * px;
    const double wy = weight * py;
    w += weight;
    x += wx;
    y += wy;
    z += weight * pz;
    xx += wx * px;
    xy += wx * py;
    yy += wy * py;
    xz += wx * pz;
    yz += wy * pz;
  }

  /// Solved by Cramer's rule: three unknowns, always well scaled here. Slopes about the centroid, held to
  /// zero by a prior of (0.01 m)^2 on the spread: few points in a row fix no tilt.
  void solve(GroundPlane& plane) const {
    const double mx = x / w;
    const double my = y / w;
    const double sxx = xx / w - mx * mx + 1.0e-4;
    const double syy = yy / w - my * my + 1.0e-4;
    const double sxy = xy / w - mx * my;
    const double sxz = xz / w - mx * z / w;
    const double syz = yz / w - my * z / w;
    const double det = sxx * syy - sxy * sxy;
    plane.a = (sxz * syy - syz * sxy) / det;
    plane.b = (syz * sxx - sxz * sxy) / det;
    plane.c = z / w - plane.a * mx - plane.b * my;
  }

  /// Of the heights of two planes of one origin at the points.
  double mean_square_between(const GroundPlane& p, const GroundPlane& q) const {
    const double a = q.a - p.a;
    const double b = q.b - p.b;
    const double c = q.c - p.c;
    return (a * (a * xx + 2.0 * (b * xy + c * x)) + b * (b * yy + 2.0 * c * y)) / w + c * c;
  }
};

/// One-sided: what is not ground stands above it. `r`: height above the plane in scales of its roughness. A
/// division of floats takes half the time, and no weight need be better known.
inline double ground_weight(double r) {
  const double above = 1.0 + r * r;
  const double inverse = r > 0.0 ? above * above : 1.0 + 0.25 * r * r;
  return static_cast<double>(1.0F / static_cast<float>(inverse));
}

}  // namespace cairn
