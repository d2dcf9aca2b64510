/// Cuts from a map what the next drive needs, and makes an upload of it.
///
/// Boulders outside the path's corridor (corridor.hpp) are left out; those inside are kept by tiles. The use
/// of a tile is the sum over its boulders of the way on which each is within reach, halved from the path's
/// start to its end (1 / (1 + s / length), s where the tile comes within reach), since far ground can be sent
/// later. Where there is a budget, boulders of the least worth (worth.hpp) are left out; of a cut with a
/// base, whose tiles are to stay as they are, whole tiles of the least use a byte. The grid covers the
/// corridor's box in whole tiles, and lies on that of the map that is cut, or of the base, so that later cuts
/// share tiles with this one.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/telecommand.hpp"
#include "cmap/cmap_file.hpp"
#include "cmap/corridor.hpp"
#include "cmap/upload_packets.hpp"

namespace cairn::ground {

/// Boulders a tile that the cut aims at, at the corridor's density.
inline constexpr double kBouldersPerCutTile = 100.0;

struct UplinkParams : CorridorParams {
  std::size_t budget_bytes = 0;  ///< on the link, packets and all; 0: no limit
  std::size_t chunk_bytes = app::kMaxChunkDataBytes;
  /// Probability that the rover finds a boulder that it passes: for the budget.
  std::function<double(const TableBoulder&)> found = [](const TableBoulder& b) { return b.confidence; };
  double tile_m = 0.0;  ///< 0: as the corridor's density suggests; that of the base where there is one
};

/// The map in use, and its name for messages.
struct BaseMap {
  std::vector<std::uint8_t> bytes;
  std::string name;
};

/// A tile of the cut's grid with boulders in the corridor.
struct RankedTile {
  std::uint32_t tile = 0;
  std::size_t boulders = 0;
  std::size_t bytes = 0;    ///< of its payload
  double way_m = 0.0;       ///< sum over its boulders of the way within reach
  double first_s_m = 0.0;   ///< way after which the first of them comes within reach
  double use_per_byte = 0;  ///< m
  bool kept = false;
};

struct Cut {
  std::vector<std::uint8_t> map;  ///< that will be in use
  Upload upload;                  ///< of it: whole, or a delta
  bool is_delta = false;
  bool unchanged = false;       ///< a delta without a tile of its own that leaves none out: nothing to send
  std::size_t whole_bytes = 0;  ///< of the map sent whole
  std::size_t delta_bytes = 0;  ///< of a delta to the base; 0 without base
  std::size_t tiles_of_base = 0;
  std::vector<RankedTile> tiles;  ///< best first; those kept come first
  std::vector<std::size_t> rank_of_tile;
  CmapLayout layout;
  std::size_t boulders = 0;           ///< sent
  std::size_t corridor_boulders = 0;  ///< within reach
  std::size_t map_boulders = 0;       ///< of the map that was cut
  std::size_t map_bytes = 0;          ///< of the map that was cut
  double length_m = 0.0;
  MapExtent box;  ///< of the corridor
};

/// Throws ToolError: a parameter out of its range, a way-point outside the map, no boulder within reach, a
/// budget too small for one tile, a base of another grid or reference system, more tiles than a map may have.
Cut cut_corridor(const std::vector<std::uint8_t>& map, const std::string& name, const PlannedPath& path,
                 const UplinkParams& params, const std::optional<BaseMap>& base);

/// What was cut, as JSON text.
std::string to_json(const Cut& cut, const UplinkParams& params, std::uint32_t next_sequence);

}  // namespace cairn::ground
