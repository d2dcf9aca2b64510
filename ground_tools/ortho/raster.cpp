#include "ortho/raster.hpp"

#include <algorithm>

namespace cairn::ground {

MapExtent extent_of(const GeoTransform& geo, int width, int height) {
  MapExtent e;
  for (int i = 0; i < 4; ++i) {
    const Vec2 p = geo.to_map(i % 2 == 0 ? -0.5 : width - 0.5, i / 2 == 0 ? -0.5 : height - 0.5);
    e = i == 0 ? MapExtent{p.x(), p.y(), p.x(), p.y()}
               : MapExtent{std::min(e.min_x_m, p.x()), std::min(e.min_y_m, p.y()), std::max(e.max_x_m, p.x()),
                           std::max(e.max_y_m, p.y())};
  }
  return e;
}

}  // namespace cairn::ground
