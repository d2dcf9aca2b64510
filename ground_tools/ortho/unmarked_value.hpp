/// Pixels without data that nothing marks as such: -9999 around a flown area, a white collar.
#pragma once

#include <optional>

#include "ortho/raster_source.hpp"

namespace cairn::ground {

/// Far from all others is what is so many times as far from the next as these span.
inline constexpr float kTimesFar = 4.0F;

/// An end of the range of values that fills more of an image than brightness does.
struct UnmarkedValue {
  float value = 0.0F;
  double share = 0.0;  ///< of the pixels looked at
  bool is_least = false;
  bool is_no_ground = false;  ///< by open_orthoimage's rule
};

/// From windows of 64 x 64 pixels all over the image, its corners among them; of an image up to 1024 x 1024
/// all of it. Time: at most what 32 Mpixel of the file's blocks take to read. Nothing where both ends
/// are as usual.
std::optional<UnmarkedValue> unmarked_value(RasterReader& reader, const RasterFacts& facts);

/// Share of the pixels, in windows as above, that are missing from a row between others that are there, at
/// most 32 of them: shadows, where black is taken for no data. A collar has no such gaps.
double share_in_gaps(RasterReader& reader, const RasterFacts& facts);

}  // namespace cairn::ground
