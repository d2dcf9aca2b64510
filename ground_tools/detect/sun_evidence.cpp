#include "detect/sun_evidence.hpp"

#include <algorithm>
#include <cmath>

namespace cairn::ground {
namespace {

constexpr double kMostLogOdds = 3.0;

}  // namespace

double sun_log_odds(const ShadowFeatures& features, const ShadowNetwork<1>& network) {
  const double z = outputs(hidden_layer(scaled(features, kShadowModel), network.hidden), network)[0];
  return std::clamp(z, -kMostLogOdds, kMostLogOdds);
}

void add_evidence(const GreyTile& tile, const ShadowView& view, SunEvidence& evidence,
                  const ShadowNetwork<1>& network) {
  ShadowParams params;
  params.max_diameter_px = kMostWitness_px;
  params.min_confidence = 0.0;
  std::vector<ShadowFeatures> fits;
  shadow_candidates(tile, tile.rect, view, params, &fits);
  for (const ShadowFeatures& fit : fits) evidence.sum += sun_log_odds(fit, network);
  evidence.fits += static_cast<int>(fits.size());
}

SunMargin margin(const SunEvidence& one, const SunEvidence& other) {
  const double fits = std::max(1, one.fits + other.fits);
  return {one.mean() - other.mean(), (one.mean() - other.mean()) * 0.5 * std::sqrt(fits)};
}

}  // namespace cairn::ground
