/// Orthoimages of a simulated site, as GeoTIFF.
///
/// The site is rendered once, at the finest resolution (at most 5 mm a pixel, or as many across the
/// smallest product's pixel as are asked for; four samples each), row by row. Each product averages that
/// radiance over its own pixels' area, blurs it as optics do, and turns it into 8 bits (OrthoCamera):
///   DN = 255 (radiance / white_radiance)^gamma, with noise
/// Memory does not grow with the image's height.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "sim/world.hpp"

namespace cairn::ground::sim {

struct OrthoProduct {
  std::filesystem::path path;
  double pixel_m = 0.005;
};

/// ortho_5mm.tif and the like.
std::string ortho_name(double pixel_m);

/// Throws ToolError where a pixel is not in 1 mm .. 10 m or is larger than the site.
void check(const Site& site, const std::vector<OrthoProduct>& products);

/// Across the smallest product's pixel: more would show in no grey level. 4 leave a grey level or two of
/// noise at edges, and are ten times as fast.
inline constexpr int kOrthoSamples = 16;

/// Writes the products, whole or not at all. Upper left corner at the site's; pixels that would reach over
/// its east and south edges are left out. Throws ToolError as `check` does, and where a file cannot be
/// written. `done` hears 0 to 1.
void write_orthoimages(const World& world, const std::vector<OrthoProduct>& products,
                       const std::function<void(double)>& done, int most_samples = kOrthoSamples);

/// The bare ground's heights every 5 cm as GeoTIFF (float, metres); rocks are not in it.
void write_dem(const World& world, const std::filesystem::path& path);

}  // namespace cairn::ground::sim
