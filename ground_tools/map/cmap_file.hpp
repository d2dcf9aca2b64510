/// Flight maps on the ground: encoding a table, reading a whole map back. The bits are those of
/// orbital_map/cmap_format.hpp; validation is the flight code's own.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "map/boulder_table.hpp"
#include "orbital_map/cmap_format.hpp"
#include "orbital_map/orbital_map.hpp"

namespace cairn::ground {

struct CmapSource {
  cmap::Method method = cmap::Method::kTable;
  double pixel_m = 0.0;    ///< of the orthoimage, 0 where there was none
  std::string parameters;  ///< text whose CRC-32 becomes the parameter hash
  std::string reference_system = "local";
};

/// The step of the positions that suits an orthoimage: the largest of 1, 2, 5 times a power of ten
/// millimetres that is at most a quarter of a pixel, 1 mm to 1 m. 1 mm for `pixel_m` 0.
double suitable_quantum_m(double pixel_m);

/// Encodes the boulders, which lie within `extent`, tile by tile, in a tile by y, then x, then diameter: the
/// same boulders in any order give the same bytes. Tiles are sized to hold 32 boulders on average.
///
/// Throws ToolError: quantum out of its range, a boulder outside the extent or larger than 65 m, a map larger
/// than 65535 tiles a side or 4 GiB, coordinates beyond 1e8 m. A reference system of more than 95 characters
/// is cut.
std::vector<std::uint8_t> encode_cmap(const std::vector<TableBoulder>& boulders, const MapExtent& extent,
                                      double quantum_m, const CmapSource& source);

struct CmapContent {
  std::vector<TableBoulder> boulders;
  MapExtent extent;
  double quantum_m = 0.0;
  double pixel_m = 0.0;
  cmap::Method method = cmap::Method::kTable;
  std::uint32_t parameter_hash = 0;
  unsigned columns = 0;
  unsigned rows = 0;
  double tile_m = 0.0;
  std::string reference_system;
};

/// One line on what a status means and how to mend it.
std::string explain(MapStatus status);

/// Validates with the flight code, whole.
MapStatus validate_cmap(const std::vector<std::uint8_t>& bytes);

/// Reads a whole map (kUsable or kNoBoulders), else throws ToolError with `name` and the reason.
CmapContent decode_cmap(const std::vector<std::uint8_t>& bytes, const std::string& name);

}  // namespace cairn::ground
