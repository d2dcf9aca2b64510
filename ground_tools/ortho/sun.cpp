#include "ortho/sun.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <string_view>

#include "base/tool_error.hpp"
#include "core/trig.hpp"

namespace cairn::ground {
namespace {

/// The whole of `text` as a number, spaces around it allowed; false where it is none.
bool read_number(std::string_view text, double& value) {
  const std::size_t first = text.find_first_not_of(' ');
  if (first == std::string_view::npos) return false;
  text = text.substr(first, text.find_last_not_of(' ') - first + 1);
  if (text.front() == '+') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

}  // namespace

Sun parse_sun(const std::string& text, const std::string& what) {
  const std::size_t comma = text.find(',');
  double elevation_deg = 0.0;
  double azimuth_deg = 0.0;
  if (comma == std::string::npos || !read_number(std::string_view(text).substr(0, comma), elevation_deg) ||
      !read_number(std::string_view(text).substr(comma + 1), azimuth_deg)) {
    throw ToolError("{}: \"{}\" is not ELEVATION,AZIMUTH; give degrees as in 45,135", what, text);
  }
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
