/// Whether an image agrees with the direction that its sun is said to have, and which one it tells itself.
#pragma once

#include "detect/sun_evidence.hpp"
#include "ortho/raster_source.hpp"
#include "ortho/sun.hpp"

namespace cairn::ground {

/// What dark spots say for the sun as told, and for the opposite one.
struct SunCheck {
  SunEvidence told;
  SunEvidence opposite;

  /// The opposite one is clearly better: a margin of 0.06 each, and of 5 together. Where the ground is scarps
  /// and gullies alone, neither is.
  bool looks_reversed() const;
};

/// From up to nine windows of 512 x 512 pixels all over the image that are half full and more (else the
/// fullest of 64), no more than it takes to fit some thousand dark spots. `sun` in the axes of `facts`. Time:
/// up to two seconds of one thread; unless `threads` is 1, each direction has its own.
SunCheck check_sun(RasterReader& reader, const RasterFacts& facts, const Sun& sun, int threads);

/// Where the sun stands by the image itself: of twelve directions, the one that most speaks for.
struct SunGuess {
  Sun sun;            ///< in the axes of the facts; azimuth to some 10 degrees
  SunEvidence best;   ///< for it
  SunEvidence rival;  ///< for the best that is 90 degrees and more away
  SunEvidence opposite;

  /// Clearly better than the rival, as in SunCheck, by 50 fits and more.
  bool is_sure() const;
};

/// From up to four windows of 512 x 512 pixels. `elevation_rad` 0: not known, and the one of 15 to 55 degrees
/// with which most boulders and hollows are found. Time: some seconds, 17 where craters are dense.
SunGuess guess_sun(RasterReader& reader, const RasterFacts& facts, double elevation_rad);

}  // namespace cairn::ground
