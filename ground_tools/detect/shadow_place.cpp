#include "detect/shadow_place.hpp"

#include <algorithm>
#include <cmath>

namespace cairn::ground {
namespace {

constexpr double kAtLeast = 1.05;  // times the least width: the fit's last steps are shares of it
constexpr double kLeastSlope = 0.3;

}  // namespace

ShadowPlace place_terms(double along_px, double reach_px, double tan_elevation) {
  const double stretch = reach_px / along_px;
  const double slope = std::sqrt(std::max(kLeastSlope * kLeastSlope, stretch * stretch - 1.0));
  return {1.0, tan_elevation, 1.0 / slope};
}

double shift_from_sun_px(double across_px, double along_px, double reach_px, double tan_elevation,
                         const ShadowPlace& place) {
  if (across_px > kAtLeast * kLeastOutline_px) return 0.0;
  const ShadowPlace terms = place_terms(along_px, reach_px, tan_elevation);
  double shift = 0.0;
  for (std::size_t i = 0; i < terms.size(); ++i) shift += place[i] * terms[i];
  return std::clamp(shift, -0.5, 1.5);
}

}  // namespace cairn::ground
