#include "ortho/sun.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

#include "base/number_table.hpp"
#include "base/tool_error.hpp"
#include "core/trig.hpp"

namespace cairn::ground {
namespace {

/// A finite number, spaces around it allowed.
std::optional<double> read_number(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
  return to_finite(text.substr(0, text.find_last_not_of(' ') + 1));
}

}  // namespace

Sun parse_sun(const std::string& text, const std::string& what) {
  const std::vector<std::string_view> parts = split(text, ',');
  const std::optional<double> elevation = read_number(parts.front());
  const std::optional<double> azimuth = read_number(parts.back());
  if (parts.size() != 2 || !elevation || !azimuth) {
    throw ToolError("{}: \"{}\" is not ELEVATION,AZIMUTH; give degrees as in 45,135", what, text);
  }
  const double elevation_deg = *elevation;
  double azimuth_deg = *azimuth;
  if (!(elevation_deg >= 1.0 && elevation_deg <= 90.0)) {
    throw ToolError("{}: elevation {} is out of range; choose 1 to 90 degrees", what, elevation_deg);
  }
  if (!(azimuth_deg >= -360.0 && azimuth_deg <= 360.0)) {
    throw ToolError("{}: azimuth {} is out of range; choose 0 to 360 degrees, clockwise from north", what,
                    azimuth_deg);
  }
  if (azimuth_deg < 0.0) azimuth_deg += 360.0;
  if (azimuth_deg >= 360.0) azimuth_deg -= 360.0;
  return {elevation_deg * kRadPerDeg, azimuth_deg * kRadPerDeg};
}

std::string to_text(const Sun& sun) {
  const auto degrees = [](double rad) { return std::round(rad * kDegPerRad * 1000.0) / 1000.0; };
  return fmt::format("{},{}", degrees(sun.elevation_rad), degrees(sun.azimuth_rad));
}

Vec2 sun_direction_map(const Sun& sun) {
  const SinCos azimuth = sin_cos(sun.azimuth_rad);
  return {azimuth.sin, azimuth.cos};
}

Vec2 sun_direction_px(const Sun& sun, const GeoTransform& geo) {
  const Vec2 map = sun_direction_map(sun);
  const double* c = geo.c;
  const double determinant = c[1] * c[5] - c[2] * c[4];
  const Vec2 step((c[5] * map.x() - c[2] * map.y()) / determinant,
                  (c[1] * map.y() - c[4] * map.x()) / determinant);
  return step / step.norm();
}

}  // namespace cairn::ground
