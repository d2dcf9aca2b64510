/// The orbital boulder map, read in place: a view of a caller's bytes, without copy or decoding
/// ahead of need.
///
/// Map bytes come through a deep-space link and stand in memory for months, so nothing of them is believed
/// before `MapValidation` has been through all of them. It alone makes a usable `OrbitalMap`; a new map goes
/// into another bank, is validated there, and takes over. Later upsets cost a tile, not the map: `window`
/// checks the CRC of each tile that it reads.
///
/// Format: orbital_map/cmap_format.hpp and doc/ICD.md.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/eigen.hpp"
#include "core/enum_count.hpp"
#include "core/nodiscard.hpp"
#include "core/work_budget.hpp"
#include "geometry/boulder.hpp"
#include "orbital_map/attribute_model.hpp"
#include "orbital_map/height_decoder.hpp"
#include "orbital_map/tile_decoder.hpp"

namespace cairn {

enum class CAIRN_NODISCARD MapStatus : std::uint8_t {
  kIdle,            ///< no validation was started
  kChecking,        ///< call step() again
  kUsable,          ///< whole and good
  kNoMap,           ///< null or empty
  kTruncated,       ///< fewer bytes than a head, or than the head says
  kBadMagic,        ///< not a map
  kUnknownVersion,  ///< a map of a version that this reader does not know
  kHeaderCrc,       ///< the head was changed on its way
  kBadHeader,       ///< the head's CRC holds, but its fields are out of range or contradict each other
  kPayloadCrc,      ///< no tile is good, or good tiles are not those that the head was made for
  kBadDirectory,    ///< its CRC holds, but offsets fall, lead beyond the file, or boulders are not as many
                    ///< as the head says
  kDamaged,         ///< some tiles are bad; the rest may be used, the bad ones are left out
  kNoBoulders,      ///< a good map without a boulder: nothing to register with
  kDirectoryCrc,    ///< the tile directory was changed on its way
};
inline constexpr std::size_t kMapStatusCount = 14;
static_assert(enum_has<MapStatus, kMapStatusCount>());

/// Whether a validation that ended so has a map.
constexpr bool may_be_used(MapStatus status) {
  return status == MapStatus::kUsable || status == MapStatus::kDamaged;
}

enum class CAIRN_NODISCARD WindowStatus : std::uint8_t {
  kUsable,      ///< every boulder within the radius was appended, at least one
  kWindowFull,  ///< no room for all: those that fit were appended; ask again with a smaller radius
  kNoneNear,    ///< no boulder within the radius
  kNoMap,       ///< the map is not a validated one
  kBadInput,    ///< position not finite, or radius not finite or negative
  kDamaged,     ///< a tile there is bad: its boulders are missing, those of the others were appended
};

/// A tile in the map's bytes.
struct MapTile {
  const std::uint8_t* payload = nullptr;  ///< null where the tile holds nothing
  std::uint32_t bytes = 0;                ///< with its CRC; 0 where it holds nothing
  std::uint32_t heights_at = 0;           ///< in the payload: what HeightDecoder reads
  std::uint32_t height_bytes = 0;         ///< 0 where it has none
  std::uint32_t boulders_at = 0;          ///< and TileDecoder
  std::uint32_t boulder_bytes = 0;
  std::uint32_t first_x = 0;  ///< cell of its south-west corner
  std::uint32_t first_y = 0;
  cmap::TileShape shape;

  const std::uint8_t* heights() const { return payload + heights_at; }
  const std::uint8_t* boulders() const { return payload + boulders_at; }
  bool heights_alone() const { return boulder_bytes == 0 && height_bytes > 0; }
};

/// The ground's heights as a map carries them: posts on a square grid, the surface bilinear between.
struct MapHeights {
  std::uint32_t spacing = 0;  ///< cells from post to post; 0: the map has none
  float sigma_m = 0.0F;       ///< of the ground against the surface, from place to place
  float common_m = 0.0F;      ///< what places near each other share of the surface's error
  double quantum_m = 0.0;
  double base_m = 0.0;  ///< frame `map`: a post stands at base + value * quantum

  /// Along a side of so many cells.
  std::uint32_t posts(std::uint32_t cells) const { return (cells - 1U) / spacing + 2U; }
};

/// A validated map. Trivially copyable, some 600 bytes; borrows the bytes given to MapValidation::start.
class OrbitalMap {
 public:
  OrbitalMap() = default;  ///< no map: window() says kNoMap, every number is 0

  bool usable() const { return bytes_ != nullptr; }
  std::uint32_t count() const { return count_; }  ///< boulders in good tiles
  /// Tiles that validation found bad.
  std::uint32_t damaged_tiles() const { return damaged_tiles_; }
  double quantum_m() const { return quantum_m_; }  ///< step of the positions
  double pixel_m() const { return pixel_m_; }      ///< of the orthoimage; 0 where nobody knows
  Vec2 origin_map_m() const {
    return {origin_x_m_, origin_y_m_};
  }  ///< south-west corner of the mapped ground
  /// Mapped ground: so far east and north of the origin.
  Vec2 extent_m() const;
  /// CRC-32 of the parameters that the map was prepared with; tells maps apart in telemetry. 0 without map.
  std::uint32_t parameter_hash() const { return parameter_hash_; }
  /// The CRC-32 at the end of its head, which answers for the whole file; 0 without map.
  std::uint32_t head_crc() const { return head_crc_; }
  /// Whether a bank whose content is no longer good still holds this map, with upsets: it lies there whole,
  /// and one of the two CRCs that tell it from any other map, of head and tiles, stands as it was validated.
  /// Then it may go on: what was read from the head is not read again, and each tile is held to its CRC.
  bool still_in(const std::uint8_t* bank, std::size_t size) const;

  std::uint32_t tiles() const { return columns_ * rows_; }
  std::uint32_t columns() const { return columns_; }
  const cmap::AttributeModels& models() const { return models_; }
  const MapHeights& heights() const { return heights_; }
  /// Where tile `index` (below tiles()) lies. False where the directory has come to lead astray.
  [[nodiscard]] bool tile(std::uint32_t index, MapTile& out) const;
  /// Whether the CRC of tile `index`, as given by tile(), holds. Cost: its bytes, at most 65535.
  static bool tile_holds(std::uint32_t index, const MapTile& tile);

  /// Appends the boulders within `radius_m` of `p_map_m` to `out`, in a fixed order: tiles row by row from
  /// the south-west, in a tile as in the file. Not cleared before. Positions and distances are doubles from
  /// integers, the same bits on every target. A tile whose CRC does not hold is left out whole.
  ///
  /// Cost: the tiles that the circle's box touches, (2 radius / tile side + 2)^2 at most, times what a tile
  /// holds: some 500 boulders as the encoder sizes them, 4096 and 65535 bytes at most. Reading takes some 170
  /// instructions a boulder on a PowerPC 750 (CRC, position, three attributes), choosing and handing over one
  /// that lies within 50 more. Stops after the tile that fills `out`.
  WindowStatus window(const Vec2& p_map_m, double radius_m, MapBoulders& out) const;

  /// The same in slices is MapReader's (orbital_map/map_reader.hpp). What the two share: tiles first ... end
  /// - 1 of an axis, whether a centre and a radius make a circle, and a boulder of a tile as it was decoded.
  struct Span {
    std::uint32_t first = 0;
    std::uint32_t end = 0;
  };
  static bool is_circle(const Vec2& p_map_m, double radius_m);
  void tiles_about(const Vec2& p_map_m, double radius_m, Span& columns, Span& rows) const;
  MapBoulder boulder(const MapTile& tile, const cmap::TileBoulder& coded) const;

 private:
  friend class MapValidation;
  enum class Taken : std::uint8_t { kAll, kFull, kCorrupt };

  static Span tiles_between(double low_m, double high_m, double tile_m, std::uint32_t tiles);
  std::uint32_t offset(std::uint32_t tile) const;
  std::uint32_t payload_bytes() const { return file_bytes_ - payloads_at_; }
  Taken take_tile(std::uint32_t index, const Vec2& p_map_m, double radius_m, MapBoulders& out) const;
  MapStatus read_head(const std::uint8_t* bytes, std::size_t size);
  MapStatus read_fields(std::uint32_t head_bytes);
  bool read_heights(const std::uint8_t* fields);

  const std::uint8_t* bytes_ = nullptr;
  double origin_x_m_ = 0.0;
  double origin_y_m_ = 0.0;
  double quantum_m_ = 0.0;
  double pixel_m_ = 0.0;
  std::uint32_t extent_x_ = 0;  ///< cells
  std::uint32_t extent_y_ = 0;
  std::uint32_t tile_side_ = 1;
  std::uint32_t columns_ = 0;
  std::uint32_t rows_ = 0;
  std::uint32_t count_ = 0;
  std::uint32_t damaged_tiles_ = 0;
  std::uint32_t file_bytes_ = 0;
  std::uint32_t directory_at_ = 0;
  std::uint32_t payloads_at_ = 0;
  std::uint32_t offset_bytes_ = 0;
  std::uint32_t parameter_hash_ = 0;
  std::uint32_t head_crc_ = 0;
  std::uint32_t tiles_crc_ = 0;
  cmap::AttributeModels models_;
  MapHeights heights_;
};

/// Checks a whole map in slices of bounded work, before its first use. A job.
///
/// Order: presence, head (magic, version, CRC, ranges), length, directory, tiles one by one (CRC, then each
/// height and boulder decoded), CRC over the tiles' CRCs, boulders' number. Any one or two flipped bits are
/// found by magic, version or a CRC-32. Bytes beyond the file's own length (a bank larger than the map) are
/// not looked at.
class MapValidation {
 public:
  /// Looks at the head (bounded: 404 bytes) and gets ready for the rest: kChecking, or why not. `bytes` is
  /// borrowed until the validation is done, and as long as the resulting map is used.
  MapStatus start(const std::uint8_t* bytes, std::size_t size);
  /// Units: 64 directory entries, a tile's place, 256 bytes of its CRC, a row of its heights, 32 of its
  /// boulders; 800 operations each, and 1024 more once a tile where it passes over empty blocks.
  Progress step(WorkBudget& budget);
  MapStatus status() const { return status_; }
  /// The map where may_be_used(status()), else no map.
  const OrbitalMap& result() const { return result_; }

 private:
  enum class Phase : std::uint8_t { kDirectory, kNextTile, kTileCrc, kHeights, kBoulders };

  void check_directory_unit();
  void begin_tile();
  void check_tile_crc_unit();
  void check_height_row();
  void begin_boulders();
  void check_boulder_unit();
  void tile_is_done();
  void leave_out_tile();
  void conclude();

  OrbitalMap candidate_;
  OrbitalMap result_;
  cmap::TileDecoder decoder_;
  cmap::HeightDecoder heights_;
  cmap::Post posts_[cmap::kMaxPosts];
  MapTile tile_;
  MapStatus status_ = MapStatus::kIdle;
  Phase phase_ = Phase::kDirectory;
  bool falls_ = false;        ///< the directory
  std::uint32_t index_ = 0;   ///< directory entry, then tile that comes next
  std::uint32_t cursor_ = 0;  ///< byte of the tile that comes next
  std::uint32_t crc_ = 0;     ///< of the directory, then of the tile
  std::uint32_t tiles_crc_ = 0;
  std::uint32_t good_boulders_ = 0;
};

}  // namespace cairn
