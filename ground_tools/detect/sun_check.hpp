/// Whether an image agrees with the direction that its sun is said to have.
#pragma once

#include "ortho/raster_source.hpp"
#include "ortho/sun.hpp"

namespace cairn::ground {

/// Dark spots of an image by which side of them is lit. A boulder is lit towards the sun and throws its
/// shadow away from it, so that beside its dark spot the brighter side is the sun's. Hollows are the other
/// way round inside and lit at their rims: on ground full of craters both sides come out alike,
/// and nothing is said.
struct SunCheck {
  int towards = 0;  ///< spots that are brighter towards the sun
  int away = 0;     ///< and away from it

  /// More than 1.5 times as many the wrong way as the right one, and 2.5 standard deviations of a fair coin.
  bool looks_reversed() const;
};

/// From up to nine windows of 512 x 512 pixels all over the image, on four levels of a pyramid that begins at
/// 1 cm a pixel or coarser. `sun` in the axes of `facts`. Time: some tenths of a second.
SunCheck check_sun(RasterReader& reader, const RasterFacts& facts, const Sun& sun);

}  // namespace cairn::ground
