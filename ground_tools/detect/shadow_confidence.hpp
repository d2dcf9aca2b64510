/// How likely a fitted shape is a boulder and not a band, a pit or a ripple, by what it looks like.
///
/// confidence = 1 / (1 + exp(-z)), z = weights . features - odds of a low sun. The features are the fit's
/// contrast over the ground's texture, darkness beside, beyond and before it, its lit side, roundness,
/// sharpness, spread and size in pixels, each bounded, so that none decides alone.
///
/// The weights are those of a logistic regression on fits in rendered fields. Those of today were made on
/// fields of 5, 10, 20 mm and 25 cm a pixel under four suns, rendered for it and not kept, by a program that
/// was not kept either: they cannot be made again to the digit.
#pragma once

#include <array>

#include "detect/shadow_fit.hpp"

namespace cairn::ground {

inline constexpr std::size_t kShadowFeatures = 18;
using ShadowFeatures = std::array<double, kShadowFeatures>;

ShadowFeatures shadow_features(const ShadowFit& fit, double tan_elevation);

extern const ShadowFeatures kShadowWeights;

/// What is taken off z. Below some 27 degrees every rise and hollow of the ground shades itself, and what
/// looks like a boulder is one more seldom: 1.3 per unit of 1 / tan e above 2, and 3.9 at most. Chosen on the
/// even frames of a lunar surface at 18 degrees.
double odds_of_low_sun(double tan_elevation);

double shadow_confidence(const ShadowFeatures& features, double tan_elevation,
                         const ShadowFeatures& weights = kShadowWeights);

}  // namespace cairn::ground
