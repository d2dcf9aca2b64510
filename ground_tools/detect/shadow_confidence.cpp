#include "detect/shadow_confidence.hpp"

#include <algorithm>
#include <cmath>

namespace cairn::ground {
namespace {

constexpr double kMostDeviation = 3.0;
constexpr double kBoundOutline_px = 2.5;  // half width, to which its least width may be all that it tells
constexpr double kLeastTowards = -0.7, kMostTowards = 0.9;
constexpr double kLeastLogSize = -0.9, kMostLogSize = 0.4;

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
  ShadowFeatures features = {
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
  std::copy(f.picture.begin(), f.picture.end(), features.begin() + kShadowMeasures);
  return features;
}

ShadowWeights scaled(const ShadowFeatures& features, const ShadowModel& model) {
  ShadowWeights x;
  x[0] = 1.0;
  for (std::size_t i = 0; i < kShadowFeatures; ++i)
    x[i + 1] = std::clamp((features[i] - model.middle[i]) / model.spread[i], -kMostDeviation, kMostDeviation);
  return x;
}

ShadowHidden hidden_layer(const ShadowWeights& x,
                          const std::array<ShadowHidden, kShadowFeatures + 1>& hidden) {
  ShadowHidden y{};
  for (std::size_t i = 0; i < x.size(); ++i)
    for (std::size_t k = 0; k < kShadowHidden; ++k) y[k] += hidden[i][k] * x[i];
  for (double& of : y) of /= 1.0 + std::fabs(of);
  return y;
}

double shadow_confidence(const ShadowFeatures& features, const ShadowModel& model) {
  const double z = outputs(hidden_layer(scaled(features, model), model.boulder.hidden), model.boulder)[0];
  return 1.0 / (1.0 + std::exp(-z));
}

ShadowBody shadow_body(const ShadowFeatures& features, double half_width_px, const ShadowModel& model) {
  const double share =
      std::clamp((kTrueOutline_px - half_width_px) / (kTrueOutline_px - kBoundOutline_px), 0.0, 1.0);
  const auto [towards, log_size] =
      outputs(hidden_layer(scaled(features, model), model.body.hidden), model.body);
  return {share * std::clamp(towards, kLeastTowards, kMostTowards),
          std::exp(share * std::clamp(log_size, kLeastLogSize, kMostLogSize))};
}

}  // namespace cairn::ground
