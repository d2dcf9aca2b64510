/// The paper's orbital boulder detector (METHOD B.1), tile by tile.
///
///   1. difference of each pixel from the mean of its surroundings (takes out albedo and slow shading);
///   2. adaptive Otsu: Otsu's threshold of that difference block by block, interpolated bilinearly between
///      the block centres; what is darker is a boulder's shadow or shaded face. Pixels brighter than their
///      surroundings count as level ground, so that bright rocks do not draw the split to their own side;
///   3. median of the mask, 15x15 on 5 mm pixels;
///   4. 8-connected components;
///   5. area threshold;
///   6. centroids, geo-registered.
///
/// Two guards stand where a block holds no shadow, so that Otsu splits its noise: the block's threshold stays
/// within half to one and a half of the whole image's, and at `noise_sigmas` or more of the ground's texture
/// (1.4826 times the median absolute difference of the block, or of the whole image where that is less); the
/// median then clears what texture goes beyond it.
///
/// The thresholds need the whole image, so that there are two rounds over it: statistics
/// (block_thresholds.hpp), then boulders. map_build.hpp leads both.
///
/// The blobs are mostly cast shadow: centroids lie about a third of a diameter away from the sun. That is the
/// paper's detector; diameters are those of the blobs.
#pragma once

#include <string>
#include <vector>

#include "base/boulder_table.hpp"
#include "detect/block_thresholds.hpp"
#include "detect/components.hpp"
#include "ortho/raster_source.hpp"

namespace cairn::ground {

/// Lengths are in metres, so that one setting serves every resolution; each has a least number of pixels
/// below which it would stop working, which takes over on coarse images.
struct DetectorParams {
  double background_m = 1.5;  ///< side of the surroundings whose mean is taken, 61 to 2801 px
  double block_m = 8.0;       ///< side of Otsu's blocks, at least 128 px
  /// Otsu's threshold lies half-way from sunlit ground to full shadow. This share of it takes in the shaded
  /// faces, which are less dark than the cast shadow and nearer to the boulder's centre.
  double threshold_scale = 0.55;
  double noise_sigmas = 1.5;
  double median_m = 0.075;  ///< side of the median, 3 to 15 px (odd): 15 px on the paper's 5 mm pixels
  double min_area_m2 = 0.0035;
  int min_area_px = 10;
};

/// Throws ToolError that names the option, where a value is out of its range.
void check(const DetectorParams& params);

/// The parameters as one line of text, e.g. for the map's parameter hash.
std::string to_text(const DetectorParams& params);

/// The parameters on an image's pixels.
struct DetectorPixels {
  int radius = 0;         ///< of the surroundings
  int block = 0;          ///< side
  int median_radius = 0;  ///< at most MedianRows::kMostRadius
  /// How far the result at a pixel may depend on the image around it.
  int reach() const { return radius + median_radius; }
};

/// Throws ToolError: surroundings of more than 2801 px.
DetectorPixels on_pixels(const DetectorParams& params, double pixel_m);

/// A boulder and the pixel that orders it among the others of its image: whatever tile it was found in.
struct FoundBoulder {
  int y = 0;
  int x = 0;
  TableBoulder boulder;
  bool crater = false;  ///< it is a crater
};

/// A tile of the second round: the components of its part of the mask, after the median; `sum_value` is of
/// the difference image. Memory: a few rows as wide as the tile; time O(pixels).
TileComponents dark_components(RasterReader& reader, const GreyRange& range, const RasterFacts& facts,
                               const BlockGrid& grid, const BlockDarkness& darkness,
                               const DetectorPixels& pixels, const PixelBox& tile);

/// The components that are large enough, as boulders.
std::vector<FoundBoulder> boulders_of(const std::vector<Component>& components, const DetectorParams& params,
                                      const GeoTransform& geo);

}  // namespace cairn::ground
