/// The ground's heights on a map's grid of posts: fitted, coded, cut. fsw/orbital_map/height_decoder.hpp
/// reads what is coded here.
#pragma once

#include <cstdint>
#include <vector>

#include "orbital_map/cmap_format.hpp"
#include "orbital_map/orbital_map.hpp"

namespace cairn::ground {

/// Posts at every `spacing` cells from the map's origin on, row by row from the south-west, so far that the
/// mapped ground is covered.
struct HeightGrid {
  std::uint32_t spacing = 0;  ///< cells; 0: no heights
  std::uint32_t quantum_um = 0;
  double base_m = 0.0;
  double sigma_m = 0.0;   ///< of the ground against the surface between the posts
  double common_m = 0.0;  ///< what places near each other share of its error
  std::uint32_t columns = 0;
  std::uint32_t rows = 0;
  std::vector<cmap::Post> posts;

  bool present() const { return spacing > 0; }
  double quantum_m() const { return 1e-6 * quantum_um; }
  std::size_t known() const;
  /// Bilinear, `x` and `y` in cells from the origin; NaN off the posts, or beside one that is not known.
  double at(double x, double y) const;
  void put_head(std::vector<std::uint8_t>& head) const;
};

/// Along an extent of so many cells.
inline std::uint32_t posts_along(std::uint32_t cells, std::uint32_t spacing) {
  return (cells - 1U) / spacing + 2U;
}

/// What is known of the ground between the posts: `fine` x `fine` samples to a square, row by row, those on
/// posts among them; (posts - 1) * fine + 1 along a side; m, NaN where unknown.
struct HeightSamples {
  std::uint32_t fine = 1;
  std::uint32_t columns = 0;
  std::uint32_t rows = 0;
  std::vector<double> z_m;
};

/// The posts whose bilinear surface is nearest to the samples, by its mean square (steps of Landweber's
/// iteration, whose rest is far below a quantum), sigma as measured there. The quantum is half of sigma, 1 mm
/// to 1 m; quantum and base are those of `like` where it has heights. Throws ToolError where no sample is
/// known, or heights are beyond what is coded.
HeightGrid fit_heights(const HeightSamples& samples, std::uint32_t spacing, double common_m,
                       const HeightGrid& like = {});

/// The heights of a tile, without their length; empty where no post of it is known.
std::vector<std::uint8_t> encode_heights(const HeightGrid& grid, std::uint32_t first_x, std::uint32_t first_y,
                                         const cmap::TileShape& shape);

/// Those of a whole map that was validated, of its good tiles.
HeightGrid read_heights(const OrbitalMap& map, std::uint32_t extent_x, std::uint32_t extent_y);

/// The posts of another grid, whose origin lies `east` and `north` cells from the grid's own.
HeightGrid moved(const HeightGrid& grid, std::int64_t east, std::int64_t north, std::uint32_t extent_x,
                 std::uint32_t extent_y);

}  // namespace cairn::ground
