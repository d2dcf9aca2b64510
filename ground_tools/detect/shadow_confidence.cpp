#include "detect/shadow_confidence.hpp"

#include <algorithm>
#include <cmath>

namespace cairn::ground {

const ShadowFeatures kShadowWeights = {-1.170, 1.861,  0.308,  -2.336, 0.478, 0.113,  -0.939, 1.910, 0.562,
                                       -2.464, -4.082, -0.594, -6.085, 0.203, -0.051, 0.408,  0.283, 0.777};

ShadowFeatures shadow_features(const ShadowFit& f, double tan_elevation) {
  const double contrast = f.ground - f.dark;
  const double x = std::log(contrast / f.noise);
  const double beside = std::clamp(f.beside, -0.5, 1.0);
  const double beyond = std::clamp(f.beyond, -0.5, 1.0);
  const double before = std::clamp(f.before, -1.0, 1.0);
  const double lit = std::clamp((f.lit - f.ground) / contrast, -1.0, 2.0);
  const double round = std::log(f.along_px / f.across_px);
  const double step = std::clamp(f.step, 0.0, 2.5);
  const double spread = std::min(f.spread, 1.0);
  const double reach = std::log(f.reach_px / f.along_px);
  // The lower the sun, the brighter what faces it.
  const double lower = std::min(1.0 / tan_elevation, 4.0) - 1.0;
  const double size = std::log(f.across_px);
  return {1.0,  x,         x * x,       beside,        beyond, before, before * before,
          lit,  lit * lit, round,       round * round, step,   spread, reach,
          size, size * x,  lit * lower, before * lower};
}

double odds_of_low_sun(double tan_elevation) { return 1.3 * std::clamp(1.0 / tan_elevation - 2.0, 0.0, 3.0); }

double shadow_confidence(const ShadowFeatures& features, double tan_elevation,
                         const ShadowFeatures& weights) {
  double z = -odds_of_low_sun(tan_elevation);
  for (std::size_t i = 0; i < kShadowFeatures; ++i) z += weights[i] * features[i];
  return 1.0 / (1.0 + std::exp(-z));
}

}  // namespace cairn::ground
