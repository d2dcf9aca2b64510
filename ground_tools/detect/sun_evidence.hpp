/// What an image's dark spots say of the direction from which its light is thought to come.
///
/// A bowl under one sun looks like a dome under the opposite one, so that no single shape tells; but fits of
/// boulders and hollows (shadow_fit.hpp) look otherwise under a sun that is told wrong, on the whole: shadows
/// that are thrown end sharply and are as dark as any, shade fades; walls are gentle and stones are steep;
/// small stones are many and large bowls are; and across the light bodies and shadows do not line up at all.
/// A network of the form of shadow_confidence.hpp gives, by the same features, each fit's log odds that the
/// sun is where it is told, as against the opposite or any other direction that is 60 degrees off and more.
/// They are bounded, so that none decides alone; their sum over all fits of an image is the evidence. Fits
/// near each other say much the same: the sum is no probability.
///
/// The network (sun_weights.cpp) is made by `make sun-weights`, from fields of `cairn sim`.
#pragma once

#include "detect/shadow_confidence.hpp"
#include "detect/shadow_detector.hpp"

namespace cairn::ground {

extern const ShadowNetwork<1> kSunNetwork;

/// The largest boulder that is a witness; larger ones would take pixels from beyond a window.
inline constexpr double kMostWitness_px = 64.0;

/// Within +-3, of the fit that looks so.
double sun_log_odds(const ShadowFeatures& features, const ShadowNetwork<1>& network = kSunNetwork);

struct SunEvidence {
  double sum = 0.0;
  int fits = 0;
  double mean() const { return fits > 0 ? sum / fits : 0.0; }
};

/// Adds what a tile's dark spots say for the direction of `view`.
void add_evidence(const GreyTile& tile, const ShadowView& view, SunEvidence& evidence,
                  const ShadowNetwork<1>& network = kSunNetwork);

/// How much more speaks for one direction than for another.
struct SunMargin {
  double each = 0.0;      ///< mean log odds of a fit
  double together = 0.0;  ///< of all fits, over the root of their number
};
SunMargin margin(const SunEvidence& one, const SunEvidence& other);

}  // namespace cairn::ground
