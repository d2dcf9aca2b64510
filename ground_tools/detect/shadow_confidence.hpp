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
/// The model (shadow_weights.cpp) is made by `make shadow-weights`: fitted to fields of `cairn sim` from
/// named seeds (unit_tests/ground_tools/detect/shadow_fields.hpp: craters fresh to worn, boulders or none,
/// slopes, ripples, patches, suns of 14 to 60 degrees, told right and up to 16 degrees wrong), z then
/// stretched and shifted so that of what maps hold at a confidence so many are boulders. The goal judges the
/// model by fields that it was not fitted to, and fails where this source holds other numbers. They are the
/// same from run to run; another libm may change the last digit.
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
