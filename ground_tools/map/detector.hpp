/// The paper's orbital boulder detector (METHOD B.1): raster in, boulder table out. Pure functions.
///
///   1. difference of each pixel from the mean of its surroundings (takes out albedo and slow shading);
///   2. adaptive Otsu: Otsu's threshold of that difference block by block, interpolated bilinearly between
///   the
///      block centres; what is darker is a boulder's shadow or shaded face. Pixels brighter than their
///      surroundings count as level ground, so that bright rocks do not draw the split to their own side;
///   3. median of the mask, 15x15 on 5 mm pixels; 4. 8-connected components; 5. area threshold; 6. centroids,
///      geo-registered.
///
/// Two guards stand where a block holds no shadow, so that Otsu splits its noise: the block's threshold stays
/// within half to one and a half of the whole image's, and at `noise_sigmas` or more of the ground's texture
/// (1.4826 times the median absolute difference of the block, or of the whole image where that is less); the
/// median then clears what texture goes beyond it.
///
/// The blobs are mostly cast shadow: centroids lie about a third of a diameter away from the sun. That is the
/// paper's detector; diameters are those of the blobs.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "map/boulder_table.hpp"
#include "map/raster.hpp"

namespace cairn::ground {

/// Lengths are in metres, so that one setting serves every resolution; each has a least number of pixels
/// below which it would stop working, which takes over on coarse images.
struct DetectorParams {
  double background_m = 1.5;  ///< side of the surroundings whose mean is taken, at least 61 px
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

using ShareDone = std::function<void(double share)>;

/// Boulders in the order of their first pixel, row by row. O(pixels). `done` hears 0 to 1.
std::vector<TableBoulder> detect_boulders(const Raster& raster, const DetectorParams& params,
                                          const ShareDone& done = {});

/// The ground that the image covers: the box of its corners.
MapExtent extent_of(const Raster& raster);

}  // namespace cairn::ground
