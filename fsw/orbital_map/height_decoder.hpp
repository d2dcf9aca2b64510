/// The ground's heights of one tile of a flight map, row by row of posts, out of its payload in place.
///
/// Posts stand on the corners of squares of `spacing` cells, from the tile's south-west corner on, so far
/// that the tile is covered: ceil(cells / spacing) + 1 along a side. Neighbouring tiles each have the posts
/// of the edge between them, so that none needs another. Row-major, eastward, then northward.
///
/// Bits (doc/ICD.md): a byte, 0 to 20 for k, beside it kHoles where posts may be missing; then for each post,
/// under kHoles first a bit, 1 where it is known. A known one tells its value less the one predicted:
///     west + south - south-west;  in the first row the western, in the first column the southern, at first 0
/// by Golomb-Rice codes of parameter k (of 2 d - 1 for d > 0, else -2 d; floor(. / 2^k) ones, a zero, k
/// bits), from 16 ones on, which have no zero, by 27 bits. A plane costs a bit and a half a post, ground
/// little more. A missing post predicts as the western does (in the first column the southern, at first 0).
///
/// Nothing is believed: each read is bounded, values beyond 2^23 and bits that are left end it as corrupt.
/// What came before must then be thrown away.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/nodiscard.hpp"
#include "orbital_map/bit_reader.hpp"
#include "orbital_map/cmap_format.hpp"

namespace cairn::cmap {

inline constexpr std::uint8_t kHoles = 0x80;
inline constexpr unsigned kMaxRice = 20;
inline constexpr unsigned kMaxOnes = 16;
inline constexpr unsigned kEscapeBits = 27;

/// Quanta above the base, and whether it is known; else what it predicts.
class Post {
 public:
  Post() = default;
  Post(std::int32_t value, bool known) : packed_(2 * value + (known ? 1 : 0)) {}
  std::int32_t value() const { return (packed_ - (packed_ & 1)) / 2; }
  bool known() const { return (packed_ & 1) != 0; }

 private:
  std::int32_t packed_ = 0;
};

enum class CAIRN_NODISCARD HeightStep : std::uint8_t {
  kMore,     ///< a row; call read() again
  kEnd,      ///< the last row, and all bits are accounted for
  kCorrupt,  ///< stays so
};

class HeightDecoder {
 public:
  /// Borrows the bytes, whose CRC the caller has checked. `columns`, `rows`: posts, 2 to kMaxPosts. False
  /// where the first byte is out of its range (read() then says kCorrupt).
  [[nodiscard]] bool start(std::uint32_t columns, std::uint32_t rows, const std::uint8_t* bytes,
                           std::size_t size);
  /// The next row of posts, written over `row`, which holds the one before. Cost: 12 operations a post.
  HeightStep read(Post* row);

 private:
  HeightStep corrupt();

  BitReader in_;
  std::uint16_t columns_ = 0;
  std::uint16_t rows_left_ = 0;
  std::uint8_t rice_ = 0;
  bool first_ = true;
  bool holes_ = false;
};

}  // namespace cairn::cmap
