/// Where a boulder stands whose outline is no wider than the least that is fitted.
///
/// No outline of less than 4 px is fitted to an image (shadow_detector.hpp). A boulder of 2 to 4 px has one
/// of 4, laid about its shadow, and the middle of that lies too far towards the sun: by two thirds of a pixel
/// under a high sun, by none under a low one, on whatever ground. All of a coarse map would be shifted by it.
/// Away from the sun it goes by
///   p_0 + p_1 tan e + p_2 / slope   px,
/// e the sun's elevation, slope the fitted shadow's reach on the ground over the body's half length. Wider
/// outlines have no such shift and are left alone.
///
/// The numbers are a linear regression on rendered fields, made by `make shadow-places`, which judges them by
/// fields that they were not fitted to.
#pragma once

#include <array>

namespace cairn::ground {

inline constexpr double kLeastOutline_px = 2.0;  ///< half width across the sun, on the image itself

using ShadowPlace = std::array<double, 3>;
inline constexpr ShadowPlace kShadowPlace = {-0.34, 0.286, 0.7};

/// 1, tan e, 1 / slope; of a fit with half length `along` and reach `reach`.
ShadowPlace place_terms(double along_px, double reach_px, double tan_elevation);

/// How far away from the sun the boulder stands from the middle of its outline, -0.5 to 1.5 px; 0 where the
/// outline is wider than the least.
double shift_from_sun_px(double across_px, double along_px, double reach_px, double tan_elevation,
                         const ShadowPlace& place = kShadowPlace);

}  // namespace cairn::ground
