/// Boulders of an orthoimage by their shadows: sunlit body and cast shadow are paired along the sun's
/// direction, so that the place is the boulder's and not that of its dark blob.
///
/// 1. Pyramid: each level halves the one before (means of 2 x 2 pixels, aligned with the image), so that
///    boulders of every size are 4 to 16 px wide on one of them.
/// 2. Seeds: on each level, local maxima of darkness (3 x 3 mean below the mean of 17 x 17;
///    shadow_spots.hpp).
/// 3. Fit: at each seed, half an ellipsoid with its shadow (shadow_fit.hpp), to the level of the ground far
///    around; on the image itself, where boulders of 4 px and more are asked for, to that of the ground close
///    by as well: among patches and hollows the former loses the smallest.
/// 4. Of fits that overlap, the one that explains most stays, each against those that were not beaten yet.
///    What was fitted to the ground close by and lies at the rim of a larger fit, no less sure, is a part of
///    that boulder, and goes.
/// 5. Confidence, place and diameter: by how the fit looks (shadow_confidence.hpp). What is below
///    `min_confidence` or outside the range of diameters is left out.
/// 6. Craters: where the hollow wins at a dark spot and its walls match, it is kept, of hollows that overlap
///    the one that explains most.
///
/// All of it depends on pixels within shadow_reach_px() of a boulder alone: the table does not depend on how
/// the image is cut into tiles.
#pragma once

#include <string>
#include <vector>

#include "base/boulder_table.hpp"
#include "detect/shadow_confidence.hpp"
#include "detect/shadow_spots.hpp"
#include "image/image_view.hpp"
#include "ortho/raster.hpp"
#include "ortho/sun.hpp"

namespace cairn::ground {

struct ShadowParams {
  double min_diameter_m = 0.09;    ///< smaller boulders are left out,
  double min_diameter_px = 3.0;    ///< and those of fewer pixels
  double max_diameter_m = 15.0;    ///< the largest looked for,
  double max_diameter_px = 256.0;  ///< and no more pixels than this: it sets the reach
  double seed_contrast = 0.10;     ///< least darkness of a spot, share of the grey level around it
  double min_confidence = 0.5;     ///< what is less likely a boulder is left out

  /// The same, but where smaller boulders are asked for by name: these, too, of kLeastDiameter_px and more.
  ShadowParams with_boulders_of(double diameter_m, double pixel_m) const;
};

/// Of smaller ones, place and size are guesses. Those of less than 3 px are as often right as larger ones
/// where boulders abound; but rims of craters are of this size, too, so that they must be asked for.
inline constexpr double kLeastDiameter_px = 2.4;

/// Throws ToolError where a parameter is out of its range.
void check(const ShadowParams& params);

/// "method=shadow sun=45,135 min_diameter_m=..." for the map's parameter hash.
std::string to_text(const ShadowParams& params, const Sun& sun);

/// What the detector knows of the light and the scale.
struct ShadowView {
  Vec2 towards_sun_px = Vec2(1.0, 0.0);  ///< unit vector in the pixel grid (sun_direction_px)
  double tan_elevation = 1.0;
  double pixel_m = 1.0;
};
ShadowView shadow_view(const Sun& sun, const GeoTransform& geo);

/// A boulder in pixels of the image, centres at integers.
struct ShadowBoulder {
  double u_px = 0.0;  ///< centroid of the outline from above
  double v_px = 0.0;
  double diameter_px = 0.0;  ///< of the disc of the outline's area, made true (shadow_body)
  double elongation = 1.0;
  double contrast = 0.0;  ///< shadow's darkness below the ground, share of the 8-bit range
  double height_px = 0.0;
  double confidence = 0.0;
};

/// How far from a boulder's centroid pixels matter, each way.
int shadow_reach_px(const ShadowView& view, const ShadowParams& params);

/// A hollow in pixels of the image: no boulder, but a landmark.
struct ShadowCrater {
  double u_px = 0.0;
  double v_px = 0.0;
  double diameter_px = 0.0;
  double contrast = 0.0;    ///< of its dark wall, share of the 8-bit range
  double confidence = 0.0;  ///< that no boulder makes this shadow
};

/// A fit that may be a boulder, pixels of the image, before it is held against those that overlap it; or a
/// hollow, whose radius is `across`, `along` and `reach` then, without features.
struct ShadowCandidate {
  double u_px, v_px;
  double across_px, along_px, reach_px;  ///< as ShadowFit
  double towards_sun_px;                 ///< of the outline's middle from the boulder's own
  double diameter_px;                    ///< its own
  bool near_ground;                      ///< fitted to the level of the ground close by
  double explained;
  double contrast;
  double confidence;
  std::size_t fit;  ///< its features, where they were asked for
};

struct ShadowCandidates {
  std::vector<ShadowCandidate> boulders;
  std::vector<ShadowCandidate> hollows;
};

/// All that may matter to `core`, from all levels, each once, by row and column: boulders of confidence
/// `min_confidence` and more, but of any diameter. `tile` as for detect_by_shadow. `features`: those of each
/// boulder's fit, ten times what the rest of it takes.
ShadowCandidates shadow_candidates(const GreyTile& tile, const PixelRect& core, const ShadowView& view,
                                   const ShadowParams& params,
                                   std::vector<ShadowFeatures>* features = nullptr);

/// Of those that overlap, the one that explains most, by row and column; `candidates` are so ordered.
std::vector<ShadowCandidate> strongest(const std::vector<ShadowCandidate>& candidates, const ShadowView& view,
                                       const ShadowParams& params);

struct ShadowFinds {
  std::vector<ShadowBoulder> boulders;
  std::vector<ShadowCrater> craters;
};

/// Those whose centre, rounded to a pixel, lies in `core`, by row and column. `tile` holds all of the image's
/// pixels within shadow_reach_px() of `core`. The result is the union over any partition into cores, to the
/// bit. Cost: some 100 us a spot, 0.13 s a megapixel with 170 boulders, 1.3 s where there are most.
ShadowFinds detect_by_shadow(const GreyTile& tile, const PixelRect& core, const ShadowView& view,
                             const ShadowParams& params);
/// The boulders alone.
std::vector<ShadowBoulder> detect_boulders_by_shadow(const GreyTile& tile, const PixelRect& core,
                                                     const ShadowView& view, const ShadowParams& params);

TableBoulder table_boulder(const ShadowBoulder& boulder, const GeoTransform& geo);
TableBoulder table_crater(const ShadowCrater& crater, const GeoTransform& geo);

}  // namespace cairn::ground
