/// The orbital boulder map, read in place: a view of a caller's bytes, without copy or decoding ahead of
/// need.
///
/// Map bytes come through a deep-space link and stand in memory for months, so nothing of them is believed
/// before `MapValidation` has been through all of them. It alone makes a usable `OrbitalMap`; from then on
/// the bytes must stay as they are (a new map goes into another bank, is validated there, and takes over).
///
/// Format: orbital_map/cmap_format.hpp and doc/ICD.md. The interface here says nothing of how boulders are
/// coded.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/eigen.hpp"
#include "core/work_budget.hpp"
#include "geometry/boulder.hpp"

namespace cairn {

enum class [[nodiscard]] MapStatus : std::uint8_t{
    kIdle,            ///< no validation was started
    kChecking,        ///< call step() again
    kUsable,          ///< the only status whose map may be used
    kNoMap,           ///< null or empty
    kTruncated,       ///< fewer bytes than a header, or than the header says
    kBadMagic,        ///< not a map
    kUnknownVersion,  ///< a map of a version, or a header size, that this reader does not know
    kHeaderCrc,       ///< the header was changed on its way
    kBadHeader,       ///< the header's CRC holds, but its fields are out of range or contradict each other
    kPayloadCrc,      ///< what follows the header was changed on its way
    kBadDirectory,    ///< all CRCs hold, but the tile directory does not rise from 0 to the count
    kBadBoulder,      ///< all CRCs hold, but a boulder lies outside its tile or has no size
    kNoBoulders,      ///< a good map without a boulder: nothing to register with
};

enum class [[nodiscard]] WindowStatus : std::uint8_t{
    kUsable,      ///< every boulder within the radius was appended, at least one
    kWindowFull,  ///< no room for all: those that fit were appended; ask again with a smaller radius
    kNoneNear,    ///< no boulder within the radius
    kNoMap,       ///< the map is not a validated one
    kBadInput,    ///< position not finite, or radius not finite or negative
};

/// A validated map. Trivially copyable; borrows the bytes given to MapValidation::start.
class OrbitalMap {
 public:
  OrbitalMap() = default;  ///< no map: window() says kNoMap, every number is 0

  bool usable() const { return bytes_ != nullptr; }
  std::uint32_t count() const { return count_; }
  double quantum_m() const { return quantum_m_; }  ///< step of the positions
  Vec2 origin_map_m() const {
    return {origin_x_m_, origin_y_m_};
  }  ///< south-west corner of the mapped ground
  Vec2 extent_m() const {
    return {extent_x_m_, extent_y_m_};
  }  ///< mapped ground: so far east and north of it
  /// CRC-32 of the parameters that the map was prepared with; tells maps apart in telemetry. 0 without map.
  std::uint32_t parameter_hash() const { return parameter_hash_; }
  /// Zero-terminated ASCII inside the map's bytes, e.g. "EPSG:32633"; "" without map.
  const char* reference_system() const;

  /// Appends the boulders within `radius_m` of `p_map_m` to `out`, in a fixed order: tiles row by row from
  /// the south-west, in a tile as in the file. Not cleared before. Positions and distances are doubles from
  /// integers, the same bits on every target.
  ///
  /// Cost: one operation a tile that the circle's box touches, about ten a boulder in these tiles; stops when
  /// `out` is full. Tiles hold 32 boulders on average.
  WindowStatus window(const Vec2& p_map_m, double radius_m, MapBoulders& out) const;

 private:
  friend class MapValidation;
  struct Span {
    std::uint32_t first = 0;
    std::uint32_t end = 0;
  };

  static Span tiles_between(double low_m, double high_m, double tile_m, std::uint32_t tiles);
  Span boulders_of_tile(std::uint32_t tile) const;
  const std::uint8_t* boulder_at(std::uint32_t index) const;
  MapStatus read_header(const std::uint8_t* bytes, std::size_t size);
  MapStatus check_header() const;

  const std::uint8_t* bytes_ = nullptr;
  double origin_x_m_ = 0.0;
  double origin_y_m_ = 0.0;
  double extent_x_m_ = 0.0;
  double extent_y_m_ = 0.0;
  double quantum_m_ = 0.0;
  std::uint32_t count_ = 0;
  std::uint32_t columns_ = 0;
  std::uint32_t rows_ = 0;
  std::uint32_t tile_side_ = 0;
  std::uint32_t file_bytes_ = 0;
  std::uint32_t parameter_hash_ = 0;
};

/// Checks a whole map in slices of bounded work, before its first use. A job.
///
/// Order: presence, header (magic, version, CRC, ranges), length, CRC of the payload, tile directory,
/// boulders. Any single flipped bit is found by magic, version or a CRC-32. Bytes beyond the file's own
/// length (a bank larger than the map) are not looked at.
class MapValidation {
 public:
  /// Looks at the header (bounded: 176 bytes) and gets ready for the rest: kChecking, or why not. `bytes` is
  /// borrowed until the validation is done, and as long as the resulting map is used.
  MapStatus start(const std::uint8_t* bytes, std::size_t size);
  /// Units: 256 bytes of CRC, 64 directory entries or 32 boulders; at most 600 operations each.
  Progress step(WorkBudget& budget);
  MapStatus status() const { return status_; }
  /// The map where status() is kUsable, else no map.
  const OrbitalMap& result() const { return result_; }

 private:
  enum class Phase : std::uint8_t { kPayloadCrc, kDirectory, kBoulders };

  void check_payload_unit();
  void check_directory_unit();
  void check_boulder_unit();

  OrbitalMap candidate_;
  OrbitalMap result_;
  MapStatus status_ = MapStatus::kIdle;
  Phase phase_ = Phase::kPayloadCrc;
  std::uint32_t cursor_ = 0;  ///< byte, directory entry or boulder that comes next
  std::uint32_t crc_ = 0;
};

}  // namespace cairn
