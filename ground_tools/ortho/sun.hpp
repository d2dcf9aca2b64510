/// Where the sun stood when an orthoimage was taken.
#pragma once

#include <string>

#include "core/eigen.hpp"
#include "ortho/raster.hpp"

namespace cairn::ground {

struct Sun {
  double elevation_rad = 0.0;  ///< above the horizontal, in (0, pi/2]
  double azimuth_rad = 0.0;    ///< towards the sun, clockwise from the y axis of the map, in [0, 2 pi)
};

/// "ELEVATION,AZIMUTH" in degrees: "45,135". Elevation 1 to 90; azimuth -360 to 360, taken modulo 360.
/// Throws ToolError that names `what` (an option or a label) and the text.
Sun parse_sun(const std::string& text, const std::string& what = "--sun");

/// "ELEVATION,AZIMUTH" in degrees, to 0.001, as parse_sun reads it.
std::string to_text(const Sun& sun);

/// Horizontal unit vector towards the sun, frame `map`.
Vec2 sun_direction_map(const Sun& sun);

/// The step in the pixel grid (u right, v down), of length 1 px, that leads towards the sun.
/// The geo-transform must be invertible (raster.hpp refuses others).
Vec2 sun_direction_px(const Sun& sun, const GeoTransform& geo);

}  // namespace cairn::ground
