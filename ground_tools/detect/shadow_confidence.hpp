/// How likely a fitted shape is a boulder and not a band, a pit or a ripple, by what it looks like.
///
/// confidence = 1 / (1 + exp(-z)), z = weights . features - odds of a low sun. The features are the fit's
/// contrast over the ground's texture, darkness beside, beyond and before it, its lit side, roundness,
/// sharpness, spread and size in pixels, each bounded, so that none decides alone.
///
/// The weights are those of a logistic regression on fits in rendered fields. `make shadow-weights` makes
/// such weights from named seeds of `cairn sim`, and judges them and today's by fields that neither was
/// fitted to; it changes nothing by itself. Today's are older: their fields and their program were not kept,
/// and a fresh fit does not come near them digit by digit. On the goal's held-out fields (14418 fits) they
/// claim too little where they doubt (0.45 claimed, 0.89 seen; 0.95 claimed, 0.98 seen): log loss 0.57, Brier
/// score 0.143; of fresh ones 0.28 and 0.074. Today's stay all the same, so that maps stay the same to the
/// bit: rendered fields have no craters, whose rims get the low confidences, and weights that were not tried
/// on real ground are no improvement yet.
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
