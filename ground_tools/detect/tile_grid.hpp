/// How an image is cut into tiles.
#pragma once

#include <cstdint>

#include "ortho/pixel_box.hpp"
#include "ortho/raster_source.hpp"

namespace cairn::ground {

/// Tiles of the same size, but for the last column and row; counted row by row.
struct TileGrid {
  PixelBox image;
  int tile_width = 0;
  int tile_height = 0;

  std::uint32_t columns() const { return pieces(image.width(), tile_width); }
  std::uint32_t rows() const { return pieces(image.height(), tile_height); }
  std::uint32_t size() const { return columns() * rows(); }
  bool starts_row(std::uint32_t tile) const { return tile % columns() == 0; }
  PixelBox box(std::uint32_t tile) const {
    const int x = static_cast<int>(tile % columns()) * tile_width;
    const int y = static_cast<int>(tile / columns()) * tile_height;
    return {x, y, std::min(x + tile_width, image.x1), std::min(y + tile_height, image.y1)};
  }

 private:
  static std::uint32_t pieces(int size, int piece) {
    return (static_cast<std::uint32_t>(size) + static_cast<std::uint32_t>(piece) - 1U) /
           static_cast<std::uint32_t>(piece);
  }
};

/// Squares of `side` pixels; 0 = what suits a file for windows that reach so far beyond a tile: as wide as
/// the image where the file keeps whole rows together, so that each is decoded once; else square.
TileGrid tiles_of(const RasterFacts& facts, int side, int reach);

}  // namespace cairn::ground
