/// How likely a fitted shape is a boulder, and not a hollow, a rim, a band, a ripple's crest or a dark patch:
/// what remains for the boulder when these have had their say.
///
/// Each rival speaks by features of the fit. A hollow: how much more of the picture a bowl explains, its dark
/// wall where the shadow was seen or its bright wall where the body was (HollowFit), how wide it is, how well
/// its two walls match. A band, scarp or gully wall: darkness and brightness that go on beside the shape.
/// Ripples and rough ground: what is left unexplained around it. A patch: no lit side, no step at the
/// terminator. Each feature is bounded, so that none decides alone, brought to a common scale, and
///   confidence = 1 / (1 + exp(-z)),   z = sum over i <= j of w_ij x_i x_j,   x_0 = 1,
/// a logistic regression on the features and their products: what tells a boulder of 3 pixels from a pit is
/// not what tells one of 12, nor is it the same under a high and a low sun.
///
/// `make shadow-weights` fits such a model to named seeds of `cairn sim`, and judges it and today's by fields
/// that neither was fitted to; it changes nothing by itself. Today's (shadow_weights.cpp) was fitted to
/// seventy-odd scenes of 120 m at 0.3 m a pixel with craters, scarps, ripples, patches and boulders under
/// suns of 14 to 50 degrees, drawn by a program that was not kept, beside fields of `cairn sim`.
#pragma once

#include <array>

#include "detect/shadow_fit.hpp"

namespace cairn::ground {

inline constexpr std::size_t kShadowFeatures = 22;
using ShadowFeatures = std::array<double, kShadowFeatures>;
/// x_0 to x_22 by x_0 to x_22, i <= j, row by row.
inline constexpr std::size_t kShadowTerms = (kShadowFeatures + 1) * (kShadowFeatures + 2) / 2;
using ShadowTerms = std::array<double, kShadowTerms>;

struct ShadowModel {
  ShadowFeatures middle;  ///< x = (feature - middle) / spread, within +-3
  ShadowFeatures spread;
  ShadowTerms weights;
};

ShadowFeatures shadow_features(const ShadowFit& fit, double tan_elevation);

ShadowTerms shadow_terms(const ShadowFeatures& features, const ShadowModel& model);

extern const ShadowModel kShadowModel;

double shadow_confidence(const ShadowFeatures& features, const ShadowModel& model = kShadowModel);

}  // namespace cairn::ground
