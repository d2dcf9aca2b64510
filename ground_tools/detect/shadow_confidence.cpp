#include "detect/shadow_confidence.hpp"

#include <algorithm>
#include <cmath>

namespace cairn::ground {
namespace {

constexpr double kMostDeviation = 3.0;

/// How the hollow stands against the boulder: log of the ratio of what they explain.
double against(const HollowFit& hollow, double pair) {
  const double least = 0.02 * pair + 1e-9;
  return std::clamp(std::log((hollow.explained + least) / (pair + least)), -3.0, 3.0);
}

/// Of its two walls; 1 where they differ from the ground by the same.
double balance(const HollowFit& h) {
  return h.explained > 0.0 ? std::min(h.dark, h.lit) / std::max(h.dark, h.lit) : 0.0;
}

double width(const HollowFit& h, double across_px) {
  return h.explained > 0.0 ? std::clamp(std::log(h.radius_px / across_px), -1.0, 2.0) : 0.0;
}

}  // namespace

ShadowFeatures shadow_features(const ShadowFit& f, double tan_elevation) {
  const double contrast = f.ground - f.dark;
  return {
      std::log(contrast / f.noise),
      contrast / std::max(1.0, f.ground),
      std::clamp(f.beside, -0.5, 1.0),
      std::clamp(f.beyond, -0.5, 1.0),
      std::clamp(-f.beyond, 0.0, 2.0),
      std::clamp(f.before, -1.0, 1.0),
      std::clamp((f.lit - f.ground) / contrast, -1.0, 2.0),
      std::log(f.along_px / f.across_px),
      std::clamp(f.step, 0.0, 2.5),
      std::min(f.spread, 1.0),
      std::log(f.reach_px / f.along_px),
      std::log(f.across_px),
      std::min(1.0 / tan_elevation, 4.0),
      against(f.beyond_rim, f.pair),
      against(f.far_wall, f.pair),
      balance(f.beyond_rim),
      balance(f.far_wall),
      width(f.beyond_rim, f.across_px),
      width(f.far_wall, f.across_px),
      std::min(f.clutter, 1.5),
      std::clamp(f.band, -0.5, 1.0),
      std::clamp(f.ridge, -1.0, 2.0),
  };
}

ShadowTerms shadow_terms(const ShadowFeatures& features, const ShadowModel& model) {
  std::array<double, kShadowFeatures + 1> x;
  x[0] = 1.0;
  for (std::size_t i = 0; i < kShadowFeatures; ++i)
    x[i + 1] = std::clamp((features[i] - model.middle[i]) / model.spread[i], -kMostDeviation, kMostDeviation);
  ShadowTerms terms;
  std::size_t k = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    for (std::size_t j = i; j < x.size(); ++j) terms[k++] = x[i] * x[j];
  return terms;
}

double shadow_confidence(const ShadowFeatures& features, const ShadowModel& model) {
  const ShadowTerms terms = shadow_terms(features, model);
  double z = 0.0;
  for (std::size_t i = 0; i < kShadowTerms; ++i) z += model.weights[i] * terms[i];
  return 1.0 / (1.0 + std::exp(-z));
}

}  // namespace cairn::ground
