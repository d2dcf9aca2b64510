/// Where the pixels of an orthoimage lie on the ground.
#pragma once

#include <cmath>

#include "base/boulder_table.hpp"
#include "core/eigen.hpp"

namespace cairn::ground {

/// Affine map from pixels to frame `map` (projected east, north, metres), with GDAL's coefficients: GDAL
/// counts from the outer corner of the top-left pixel, so that this pixel's centre is (0.5, 0.5) there and
/// (0, 0) here.
struct GeoTransform {
  double c[6] = {0, 1, 0, 0, 0, -1};

  /// Frame `map` position of (u, v), pixel centres at integers.
  Vec2 to_map(double u_px, double v_px) const {
    const double col = u_px + 0.5;
    const double row = v_px + 0.5;
    return {c[0] + col * c[1] + row * c[2], c[3] + col * c[4] + row * c[5]};
  }
  double pixel_area_m2() const { return std::fabs(c[1] * c[5] - c[2] * c[4]); }
  /// Side of the square pixel of the same area.
  double pixel_m() const { return std::sqrt(pixel_area_m2()); }
};

/// The ground that an image covers: the box of its corners.
MapExtent extent_of(const GeoTransform& geo, int width, int height);

}  // namespace cairn::ground
