/// Orthoimages: where their pixels lie on the ground, and small ones whole in memory.
#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/boulder_table.hpp"
#include "core/eigen.hpp"
#include "image/image_view.hpp"

namespace cairn::ground {

/// Affine map from pixels to frame `map` (projected east, north, metres), with GDAL's coefficients: GDAL
/// counts from the outer corner of the top-left pixel, so that this pixel's centre is (0.5, 0.5) there and
/// (0, 0) here.
struct GeoTransform {
  double c[6] = {0, 1, 0, 0, 0, -1};

  /// Frame `map` position of (u, v), pixel centres at integers.
  Vec2 to_map(double u_px, double v_px) const {
    const double col = u_px + 0.5;
    const double row = v_px + 0.5;
    return {c[0] + col * c[1] + row * c[2], c[3] + col * c[4] + row * c[5]};
  }
  double pixel_area_m2() const { return std::fabs(c[1] * c[5] - c[2] * c[4]); }
  /// Side of the square pixel of the same area.
  double pixel_m() const { return std::sqrt(pixel_area_m2()); }
};

struct Raster {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> grey;
  std::vector<std::uint8_t> valid;  ///< 0 = no data; empty where every pixel is valid
  GeoTransform geo;
  std::string reference_system;  ///< a text as in map/reference_system.hpp

  ImageU8 grey_view() const { return packed_view(grey.data(), width, height); }
  ImageU8 valid_view() const { return valid.empty() ? ImageU8{} : packed_view(valid.data(), width, height); }
};

/// Reads an orthoimage whole, as raster_source.hpp says. `cairn map build` never does: it goes tile by tile.
Raster read_orthoimage(const std::filesystem::path& path, int band = 0);

/// The ground that an image covers: the box of its corners.
MapExtent extent_of(const GeoTransform& geo, int width, int height);
MapExtent extent_of(const Raster& raster);

}  // namespace cairn::ground
