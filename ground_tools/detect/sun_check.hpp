/// Whether an image agrees with the direction that its sun is said to have.
#pragma once

#include "ortho/raster_source.hpp"
#include "ortho/sun.hpp"

namespace cairn::ground {

/// Two witnesses. The first are boulders that the shadow detector is sure of, with the sun as told and with
/// the opposite one: a body and its shadow fit together in one order alone. Where they can't tell the two
/// apart, dark spots are asked on which side of them there is something else than ground, be it brighter or
/// darker. A boulder throws its shadow away from the sun, so that its body is on the sun's side.
/// Hollows read like boulders under the opposite sun, and boulders like hollows, though less well: nothing is
/// said where boulders and hollows together are clearly more with the sun as told (a tenth, and 1.5 standard
/// deviations). On ground of craters the opposite sun turns bowls into bodies, so that boulders are no
/// witness: there the finds are. On ground of sharp craters the wrong thing may still be said.
struct SunCheck {
  int boulders = 0;  ///< of confidence 0.8 and more with the sun as told
  int opposite = 0;  ///< and with the opposite one
  int finds = 0;     ///< boulders and hollows with the sun as told
  int opposite_finds = 0;
  int towards = 0;  ///< dark spots with a body towards the sun
  int away = 0;     ///< and with one away from it

  /// Ground of craters with the sun told the wrong way round: with the opposite one clearly more is found (a
  /// quarter, and 4 standard deviations), and of it less than a twentieth are boulders.
  bool hollows_are_reversed() const;
  /// Or hollows_are_reversed(). By the first witness that is clear: more than 1.5 times as many the wrong way
  /// as the right one, and 2.5 standard deviations of a fair coin.
  bool looks_reversed() const;
};

/// From up to nine windows of 512 x 512 pixels all over the image that are half full and more (else the
/// fullest of 64, for boulders alone), on four levels of a pyramid that begins at 1 cm a pixel or coarser;
/// no more windows are searched for boulders than it takes to find some hundred. `sun` in the axes of
/// `facts`. Time: up to two seconds.
SunCheck check_sun(RasterReader& reader, const RasterFacts& facts, const Sun& sun);

/// Where the sun stands by the image itself: the direction with which the shadow detector finds most,
/// boulders and hollows together. With a direction that is some 30 degrees off it finds less; with the
/// opposite one bodies turn into hollows and hollows into bodies, which fit less well. Where the two ways
/// come out within a tenth of each other, the one with more boulders is taken: among boulders that are close
/// to each other, the gaps read as hollows.
struct SunGuess {
  Sun sun;           ///< in the axes of the facts; azimuth to some 10 to 30 degrees
  int finds = 0;     ///< boulders of confidence 0.8 and more, and hollows, with it
  int opposite = 0;  ///< and with the opposite azimuth
  int boulders = 0;  ///< of them
  int opposite_boulders = 0;
  int rival = 0;  ///< most finds with any azimuth that is 120 degrees and more away
  int rival_boulders = 0;

  /// At least 20, and clearly more than any other direction gives: a third, and 2.5 standard deviations of a
  /// fair coin. Of the finds, or of the boulders where the finds are alike with the opposite azimuth. On
  /// slopes and ripples many directions give about as much.
  bool is_sure() const;
  bool finds_are_alike() const { return 10 * opposite > 9 * finds && 9 * opposite < 10 * finds; }
};

/// From up to four windows of 512 x 512 pixels. `elevation_rad` 0: not known, and the one of 15 to 55 degrees
/// with which most is found. Time: some seconds.
SunGuess guess_sun(RasterReader& reader, const RasterFacts& facts, double elevation_rad);

}  // namespace cairn::ground
