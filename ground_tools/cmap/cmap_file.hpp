/// Flight maps on the ground: encoding a table, reading a whole map or a tile of it back. The bits are those
/// of orbital_map/cmap_format.hpp; validation and decoding are the flight code's own.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/boulder_table.hpp"
#include "cmap/height_grid.hpp"
#include "cmap/tile_encoder.hpp"
#include "orbital_map/cmap_format.hpp"
#include "orbital_map/orbital_map.hpp"

namespace cairn::ground {

inline constexpr double kMicrometresPerMetre = 1e6;  // a map's quantum is told in micrometres

struct CmapSource {
  cmap::Method method = cmap::Method::kTable;
  double pixel_m = 0.0;    ///< of the orthoimage, 0 where there was none
  std::string parameters;  ///< text whose CRC-32 becomes the parameter hash
  std::string reference_system = "local";
  std::uint32_t site = 0;
  std::uint32_t epoch_s = 0;  ///< of the image, seconds since J2000 (2000-01-01T12:00:00 TT), 0 = unknown
  std::uint16_t revision = 0;
};

/// What two revisions of a map must share so that tiles without a change are the same bytes: mapped ground,
/// cells, tiles, models of the attributes.
struct CmapLayout {
  double origin_x_m = 0.0;
  double origin_y_m = 0.0;
  std::uint32_t extent_x = 1;  ///< cells
  std::uint32_t extent_y = 1;
  std::uint32_t quantum_um = 0;
  std::uint32_t tile_side = 1;  ///< cells
  AttributeTables tables;

  std::uint32_t columns() const { return cmap::tiles_along(extent_x, tile_side); }
  std::uint32_t rows() const { return cmap::tiles_along(extent_y, tile_side); }
};

/// The cells of a map of this extent, before its tiles are chosen; throws as encode_cmap.
CmapLayout cells_of(const MapExtent& extent, double quantum_m);

/// The layout of a map that holds (kUsable, kDamaged or kNoBoulders); throws ToolError else.
CmapLayout layout_of(const std::vector<std::uint8_t>& bytes, const std::string& name);

struct CmapOptions {
  bool positions_only = false;     ///< no sizes, heights and confidences
  double boulders_per_tile = 500;  ///< on average; smaller tiles where they would be too full somewhere
  /// Take the grid of this map instead of the extent and the quantum given, and its attribute tables unless a
  /// boulder lies off them. Boulders must lie within its extent.
  const CmapLayout* like = nullptr;
  /// Heights over the map's cells (a map of version 3), null for none (version 2). Tiles are whole steps of
  /// its spacing then.
  const HeightGrid* heights = nullptr;
  const std::vector<bool>* tiles_with_heights = nullptr;  ///< of all tiles; null: all
};

/// What the encoder did beside encoding.
struct CmapReport {
  std::size_t boulders = 0;  ///< encoded
  std::size_t merged = 0;    ///< left out: in the cell of a larger one
  bool like_base = false;    ///< the tables of CmapOptions::like served
};

/// The step of the positions that suits an orthoimage: the largest of 1, 2, 5 times a power of ten
/// millimetres that is at most a quarter of a pixel, 2 mm to 1 m; 2 mm for `pixel_m` 0. Rounding to it moves
/// a centroid by at most an eighth of a pixel along each axis, a third of what the best detector errs; and
/// registration weighs a pair by 6 cm (icp_sigma_pair_m), so that nothing finer than 2 mm is worth its bits.
double suitable_quantum_m(double pixel_m);

/// Encodes the boulders, which lie within `extent`: the same boulders in any order give the same bytes. Of
/// boulders in one cell the largest is kept. A confidence below 0 or above 1 counts as 0 or 1, a height that
/// is not positive as unknown.
///
/// Throws ToolError: quantum out of its range, a boulder outside the extent or larger or higher than 65.5 m,
/// more than 65536 tiles, cells that 31 bits do not count, 4 GiB, coordinates beyond 1e8 m. A reference
/// system of more than 255 characters is cut.
std::vector<std::uint8_t> encode_cmap(const std::vector<TableBoulder>& boulders, const MapExtent& extent,
                                      double quantum_m, const CmapSource& source,
                                      const CmapOptions& options = {}, CmapReport* report = nullptr);

/// A tile of a map.
struct CmapTile {
  std::uint32_t index = 0;
  MapExtent extent;                 ///< m, frame `map`: from its first cell to its last
  std::size_t offset = 0;           ///< of the payload in the file
  std::uint32_t bytes = 0;          ///< of the payload with its CRC
  std::uint32_t crc = 0;            ///< as the payload says; 0 for an empty tile
  std::uint32_t count = 0;          ///< boulders, 0 where it is bad
  std::uint32_t heights_bytes = 0;  ///< of the payload, with their length
  bool good = true;                 ///< empty, or CRC holds and every boulder decodes
};

struct CmapContent {
  std::vector<TableBoulder> boulders;  ///< of the good tiles, tile by tile
  std::vector<CmapTile> tiles;
  CmapLayout layout;
  MapExtent extent;
  HeightGrid heights;
  double quantum_m = 0.0;
  double pixel_m = 0.0;
  cmap::Method method = cmap::Method::kTable;
  std::uint32_t parameter_hash = 0;
  std::uint32_t site = 0;
  std::uint32_t epoch_s = 0;
  std::uint16_t revision = 0;
  std::uint32_t head_crc = 0;  ///< answers for the whole file: tells maps apart
  unsigned columns = 0;
  unsigned rows = 0;
  double tile_m = 0.0;
  std::string reference_system;
  std::uint32_t damaged_tiles = 0;
};

/// One line on what a status means and how to mend it.
std::string explain(MapStatus status);

/// Validates with the flight code, whole. `map`, where given, takes the validated map; it borrows `bytes`.
MapStatus validate_cmap(const std::vector<std::uint8_t>& bytes, OrbitalMap* map = nullptr);

/// Reads a whole map (kUsable or kNoBoulders, and kDamaged where `salvage`), else throws ToolError with
/// `name` and the reason.
CmapContent decode_cmap(const std::vector<std::uint8_t>& bytes, const std::string& name,
                        bool salvage = false);

}  // namespace cairn::ground
