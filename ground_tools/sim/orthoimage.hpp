/// Orthoimages of a simulated site, as GeoTIFF.
///
/// The site is rendered once, at the finest resolution (at most 5 mm a pixel, or a sixteenth of the smallest
/// product's; four samples each), row by row. Each product averages that radiance over its own pixels' area,
/// blurs it as optics do (Gaussian of half a pixel), and turns it into 8 bits as the cameras do:
///   DN = 255 sqrt(radiance / white_radiance), with noise of 1 DN
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

/// Writes the products, whole or not at all. Upper left corner at the site's; pixels that would reach over
/// its east and south edges are left out. Throws ToolError as `check` does, and where a file cannot be
/// written. `done` hears 0 to 1.
void write_orthoimages(const World& world, const std::vector<OrthoProduct>& products,
                       const std::function<void(double)>& done);

/// The bare ground's heights every 5 cm as GeoTIFF (float, metres); rocks are not in it.
void write_dem(const World& world, const std::filesystem::path& path);

}  // namespace cairn::ground::sim
