/// The craters of a simulated site: bowls with a raised rim, from fresh to nearly levelled.
///
/// With r the distance from the middle over the radius, d the depth and h the rim's height,
///   bowl    a(r) = -d + (d + h) r^p,   p from 2 (a bowl) to 3 (a flat floor), drawn
///   rim     b(r) = h max(r, 1/2)^-3, fading out from r = 2 to 3
/// a crater adds the lesser of the two to the ground's height, the edge between them rounded over 1 +- s:
///   height = a + t (b - a) - w t (1 - t),   t = clamp(1/2 + (a - b) / (2 w), 0, 1),  w = s (p (d + h) + 3 h)
/// Degradation g, 0 to 1, makes it shallow and soft: d and h shrink by 1 - 0.85 g, and s = 0.04 + 0.3 g. Its
/// outline is a circle of the diameter with drawn waves of a few per cent. Craters are added one to the other
/// where they overlap. A fresh one is 0.2 of its diameter deep from crest to floor by default, as lunar ones
/// are (Pike 1977).
#pragma once

#include <vector>

#include "core/eigen.hpp"
#include "sim/scene.hpp"

namespace cairn::ground::sim {

struct Crater {
  Vec2 p_map_m = Vec2(0.0, 0.0);
  double diameter_m = 0.0;
  double depth_m = 0.0;  ///< of the floor's middle below the ground around
  double rim_m = 0.0;    ///< of the crest above it, where r = 1
  double degradation = 0.0;
  double crest_m = 0.0;  ///< h: what rim_m were without rounding
  double round_m = 0.0;  ///< w
  double power = 2.0;    ///< p
  /// The outline's waves: radius (1 + two . (cos 2a, sin 2a) + three . (cos 3a, sin 3a)).
  Vec2 two = Vec2(0.0, 0.0);
  Vec2 three = Vec2(0.0, 0.0);
};

/// How far a crater reaches, in radii of its own, its outline's waves included.
inline constexpr double kCraterReach = 3.8;

/// Mean number of craters on the site.
double craters_expected(const Craters& law, const Site& site);

/// The scene's craters, the largest first. Their middles are uniform in the site.
std::vector<Crater> make_craters(const Scene& scene);

/// What the crater adds to the ground's height at `off_m` from its middle.
double crater_height_m(const Crater& crater, const Vec2& off_m);

}  // namespace cairn::ground::sim
