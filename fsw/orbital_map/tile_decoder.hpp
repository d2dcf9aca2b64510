/// The boulders of one tile of a flight map, one after another, out of its payload in place.
///
/// Bits (doc/ICD.md tells the whole). The tile is a block of n boulders at depth 0. A block is halved across
/// its longer side (eastward where both are the same; the western or southern half is the smaller where they
/// differ), the western or southern half comes first, while it
///   has a side of more than 16384 cells, or
///   holds more than one boulder and more than one cell, at a depth less than the tile's.
/// Each split tells how many of the n the first half holds: the numbers from 0 to n, ordered from the middle
/// outward, in truncated binary. That is the density prior of clustered ground, near to the code for halves
/// whose share is spread as a parabola between none and all; uniform ground takes depth 0.
/// A block that is not split: n boulders in c cells, row-major; for each the number g of free cells since
/// the one before:
///   n > 1   Golomb code of parameter M = max(1, floor(2977044471 floor(c / n) / 2^32)), c and n of what
///           is left: ones for floor(g / M), a zero, the remainder in truncated binary
///   n = 1   truncated binary out of c
/// Gaps of uniform ground are geometric, for which Golomb codes are the best prefix codes (Gallager and van
/// Voorhis, 1975), some 0.03 bit above the entropy; M follows from what is left, so that no
/// parameter is sent.
///
/// Attributes are one rANS stream of 32-bit states: x starts as 0, reads bytes while x < 2^23 and any are
/// left, gives size, height and confidence class of the boulder (orbital_map/attribute_model.hpp), reads on.
/// It must end as 1, its bytes used up.
///
/// Nothing of a payload is believed: each read is bounded, contradictions end the tile as corrupt, a tile
/// ends after at most 4096 boulders. What came before a contradiction must then be thrown away.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/nodiscard.hpp"
#include "orbital_map/attribute_model.hpp"
#include "orbital_map/bit_reader.hpp"

namespace cairn::cmap {

/// Cells of a tile, after the cut at the map's edge.
struct TileShape {
  std::uint32_t width = 1;  ///< 1 to kMaxTileSide
  std::uint32_t height = 1;
};

/// The CRC-32 that a payload ends with begins with the tile's number, so that no tile passes for another.
std::uint32_t tile_crc_start(std::uint32_t tile);

/// A boulder in its tile: cells east and north of the south-west corner, classes of its attributes (0 where
/// the map has none).
struct TileBoulder {
  std::uint32_t x = 0;
  std::uint32_t y = 0;
  std::uint8_t attribute[kAttributes] = {};
};

enum class CAIRN_NODISCARD TileStep : std::uint8_t {
  kMore,     ///< call read() again
  kEnd,      ///< these were the last, and all bits of the payload are accounted for
  kCorrupt,  ///< the payload contradicts itself; stays so
};

/// Reads a payload whose CRC the caller has checked. Borrows the bytes; a kilobyte itself.
class TileDecoder {
 public:
  /// False where the payload's head is out of its ranges (read() then says kCorrupt).
  /// `size` is without the CRC.
  [[nodiscard]] bool start(const AttributeModels& models, const TileShape& shape, const std::uint8_t* payload,
                           std::size_t size);
  std::uint32_t count() const { return count_; }
  /// The next boulders, at most `room`, at least one unless corrupt. `models` as at start. Cost: usually some
  /// 100 instructions a boulder; at most 42 splits for each, and in all 3 bits of unary codes a boulder
  /// of the tile.
  TileStep read(const AttributeModels& models, TileBoulder* out, unsigned room, unsigned& given);

 private:
  static constexpr unsigned kMostSplits = 42;  ///< from 2^21 cells a side to one
  struct Block {
    std::uint32_t x;
    std::uint32_t y;
    std::uint32_t width;
    std::uint32_t height;
    std::uint16_t boulders;
    std::uint16_t depth;
  };

  bool is_leaf(const Block& block) const;
  bool next_block();
  bool read_run(TileBoulder* out, unsigned count);
  void read_attributes(const AttributeModels& models, TileBoulder* out, unsigned count);
  TileStep corrupt();

  BitReader in_;                              ///< position bits
  const std::uint8_t* attributes_ = nullptr;  ///< rANS bytes
  const std::uint8_t* attributes_end_ = nullptr;
  std::uint32_t state_ = 0;
  std::uint32_t last_state_ = 0;  ///< in which the attributes must end
  std::uint32_t count_ = 0;
  std::uint32_t left_ = 0;          ///< boulders of the tile
  unsigned depth_ = 0;              ///< to which blocks are split
  Block waiting_[kMostSplits + 1];  ///< second halves, the last one comes next
  unsigned waiting_count_ = 0;
  std::uint32_t block_x_ = 0;  ///< south-west corner of the block
  std::uint32_t block_y_ = 0;
  std::uint32_t block_width_ = 1;
  std::uint32_t cell_ = 0;        ///< of the block, comes next
  std::uint32_t cells_left_ = 0;  ///< of the block
  std::uint32_t block_left_ = 0;  ///< boulders of the block
  unsigned parameter_log2_ = 0;   ///< of the last truncated binary code
  bool corrupt_ = true;
};

}  // namespace cairn::cmap
