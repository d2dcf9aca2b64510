/// Where the shadow-aware detector looks: a pyramid of means, and the dark spots of its levels.
#pragma once

#include <cstdint>
#include <vector>

#include "image/image_view.hpp"

namespace cairn::ground {

/// Pixels [x0, x0 + width) x [y0, y0 + height) of an image.
struct PixelRect {
  int x0 = 0;
  int y0 = 0;
  int width = 0;
  int height = 0;
  bool contains(int x, int y) const { return x >= x0 && y >= y0 && x - x0 < width && y - y0 < height; }
};

/// Pixels of a tile with its halo; `grey` and `valid` are packed views of rect's size, `valid` without data
/// where all are valid.
struct GreyTile {
  PixelRect rect;
  ImageU8 grey;
  ImageU8 valid;
};

/// A tile on the grid of one level of the pyramid: a pixel is the mean of 2^shift x 2^shift of the image's.
struct PyramidLevel {
  int shift = 0;
  GreyTile tile;  ///< of the two below, but for level 0, which is the detector's own tile
  std::vector<std::uint8_t> grey;
  std::vector<std::uint8_t> valid;

  PyramidLevel() = default;
  PyramidLevel(PyramidLevel&&) = default;  // moved vectors keep their memory; copies would not be seen
  PyramidLevel& operator=(PyramidLevel&&) = default;
};

/// The next level: means of 2 x 2, of those that are valid; blocks that reach over the rim are left out.
PyramidLevel halved(const PyramidLevel& level);

/// A dark spot, pixels of the tile's views.
struct Spot {
  int x, y;
};

/// Pixels around a spot that decide whether it is one, each way.
inline constexpr int kSpotReach_px = 8 + 2;

/// Local maxima of darkness in `where` (pixels of the views): the 3 x 3 mean below that of 17 x 17 by
/// more than `least_share` of the latter and 3 grey levels, largest over 5 x 5; of equals, the first by
/// row and column.
std::vector<Spot> dark_spots(const GreyTile& tile, const PixelRect& where, double least_share);

}  // namespace cairn::ground
