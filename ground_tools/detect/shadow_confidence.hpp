/// How likely a fitted shape is a boulder, and not a hollow, a rim, a band, a ripple's crest or a dark patch:
/// what remains for the boulder when these have had their say.
///
/// Each rival speaks by features of the fit. A hollow: how much more of the picture a bowl explains, its dark
/// wall where the shadow was seen or its bright wall where the body was (HollowFit), how wide it is, how well
/// its two walls match. A band, scarp or gully wall: darkness and brightness that go on beside the shape.
/// Ripples and rough ground: what is left unexplained around it. A patch: no lit side, no step at the
/// terminator. And the fit's picture speaks for itself (ShadowFit::picture): what surrounds the shape, in its
/// own frame. Each feature is bounded, so that none decides alone, and brought to a common scale, x; then
///   confidence = 1 / (1 + exp(-z)),   z = v_0 + sum over k of v_k s(w_k0 + sum over i of w_ki x_i),
/// a network of one hidden layer, s(y) = y / (1 + |y|): what tells a boulder of 3 pixels from a pit is not
/// what tells one of 12, nor is it the same under a high and a low sun.
///
/// Its size: an outline has a least width, so that the fit to a stone of 2 pixels is one of 4. An outline of
/// less than 5 pixels is made smaller by the same features,
///   d = fitted diameter times exp(u_0 + sum of u_i x_i), at most 1,
/// a linear regression on the logarithm.
///
/// The model (shadow_weights.cpp) is made by `make shadow-weights`: fitted to fields of `cairn sim` from
/// named seeds (unit_tests/ground_tools/detect/shadow_fields.hpp: craters fresh to worn, boulders or none,
/// slopes, ripples, patches, gullies, suns of 14 to 60 degrees, told right and up to 16 degrees wrong), z
/// then stretched and shifted so that of what maps hold at a confidence so many are boulders. The goal judges
/// the model by fields that it was not fitted to, and fails where this source holds other numbers. They are
/// the same from run to run; another libm may change digits.
#pragma once

#include <array>

#include "detect/shadow_fit.hpp"

namespace cairn::ground {

inline constexpr std::size_t kShadowMeasures = 22;
inline constexpr std::size_t kShadowFeatures = kShadowMeasures + kPictureCells;
using ShadowFeatures = std::array<double, kShadowFeatures>;
inline constexpr std::size_t kShadowHidden = 16;
/// An intercept and a weight for each x.
using ShadowWeights = std::array<double, kShadowFeatures + 1>;

using ShadowHidden = std::array<double, kShadowHidden>;

struct ShadowModel {
  ShadowFeatures middle;  ///< x = (feature - middle) / spread, within +-3
  ShadowFeatures spread;
  std::array<ShadowHidden, kShadowFeatures + 1> hidden;  ///< w, of the intercept and each x
  double out_0;                                          ///< v_0
  ShadowHidden out;                                      ///< v_k
  ShadowWeights size;                                    ///< u
};

ShadowFeatures shadow_features(const ShadowFit& fit, double tan_elevation);

/// 1, then x.
ShadowWeights scaled(const ShadowFeatures& features, const ShadowModel& model);
/// s of each of the hidden layer.
ShadowHidden hidden_layer(const ShadowWeights& x, const ShadowModel& model);

extern const ShadowModel kShadowModel;

double shadow_confidence(const ShadowFeatures& features, const ShadowModel& model = kShadowModel);

/// Whether the outline is so small that its least width may be all that it tells.
bool shadow_size_is_bound(const ShadowFeatures& features);
/// Diameter over that of the fit, 0.4 to 1.
double shadow_size_factor(const ShadowFeatures& features, const ShadowModel& model = kShadowModel);

}  // namespace cairn::ground
