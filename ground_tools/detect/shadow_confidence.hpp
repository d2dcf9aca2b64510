/// How likely a fitted shape is a boulder, and not a hollow, a rim, a band, a ripple's crest or a dark patch:
/// what remains for the boulder when these have had their say. And where it stands then, and its size.
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
/// Place and size: the outline is half an ellipsoid's, and no narrower than 4 px. A stone of 2 px has one of
/// 4, laid about its shadow, whose middle lies too far towards the sun by up to a pixel, the more the higher
/// the sun stands; all of a coarse map would lie aside by it. A second network of the same form tells from
/// the same features how far the outline's middle lies towards the sun from the boulder's, and the logarithm
/// of the boulder's diameter over the outline's. From half widths of 2.5 to 5 px this fades: a wide outline
/// is as it was fitted, since there the pixels tell, and other ground may look otherwise than the fields.
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

/// One hidden layer: v_0 + sum over k of v_k s(w_k0 + sum over i of w_ki x_i), for each output.
template <std::size_t kOutputs>
struct ShadowNetwork {
  std::array<ShadowHidden, kShadowFeatures + 1> hidden;  ///< w, of the intercept and each x
  std::array<ShadowHidden, kOutputs> out;                ///< v_k
  std::array<double, kOutputs> out_0;                    ///< v_0
};

struct ShadowModel {
  ShadowFeatures middle;  ///< x = (feature - middle) / spread, within +-3
  ShadowFeatures spread;
  ShadowNetwork<1> boulder;  ///< z
  ShadowNetwork<2> body;     ///< as ShadowBody: towards_sun, log of size
};

ShadowFeatures shadow_features(const ShadowFit& fit, double tan_elevation);

/// 1, then x.
ShadowWeights scaled(const ShadowFeatures& features, const ShadowModel& model);
/// s of each of the hidden layer.
ShadowHidden hidden_layer(const ShadowWeights& x,
                          const std::array<ShadowHidden, kShadowFeatures + 1>& hidden);

template <std::size_t kOutputs>
std::array<double, kOutputs> outputs(const ShadowHidden& y, const ShadowNetwork<kOutputs>& network) {
  std::array<double, kOutputs> z = network.out_0;
  for (std::size_t o = 0; o < kOutputs; ++o)
    for (std::size_t k = 0; k < kShadowHidden; ++k) z[o] += network.out[o][k] * y[k];
  return z;
}

extern const ShadowModel kShadowModel;

double shadow_confidence(const ShadowFeatures& features, const ShadowModel& model = kShadowModel);

/// The boulder, if it is one, against its outline.
struct ShadowBody {
  double towards_sun = 0.0;  ///< the outline's middle from the boulder's, in mean half widths; -0.7 to 0.9
  double size = 1.0;         ///< the boulder's diameter over the outline's; 0.4 to 1.5
};
/// Mean half width of an outline, pixels of the image, from which on it stands for itself.
inline constexpr double kTrueOutline_px = 5.0;
ShadowBody shadow_body(const ShadowFeatures& features, double half_width_px,
                       const ShadowModel& model = kShadowModel);

}  // namespace cairn::ground
