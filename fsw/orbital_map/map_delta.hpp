/// A new version of a map made from the one in use and from what changed: tile by tile, in slices.
///
/// A delta names its base, carries the new map's head, and for each tile of the new map either its payload or
/// nothing, where it is that of a tile of the base. The new map comes out byte for byte as the ground has it,
/// which its own CRCs prove: the job checks what memory safety asks for, and the owner then validates the
/// result whole (MapValidation). The directory follows from the payloads. A tile's CRC holds its number, so
/// that the job makes it anew for tiles of the base; the head's CRC of all these CRCs, which came with the
/// delta, tells where one was damaged.
///
/// Bits, big-endian (doc/ICD.md): the fields below; the new map's head; one bit a tile (1: its payload is in
/// the delta), first tile first, most significant bit first, zeros up to a byte; for each such tile in order
/// the payload's length u16 (0: the tile is empty) and the payload. All other tiles are those of the base:
/// the one of the new map's tile (column, row) is (column + column shift, row + row shift), so that maps of
/// neighbouring stretches share tiles, too; beyond the base's grid, they are empty.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/nodiscard.hpp"
#include "core/work_budget.hpp"
#include "orbital_map/cmap_format.hpp"

namespace cairn {

namespace delta {
inline constexpr std::uint32_t kMagic = 0x43444C54U;  // "CDLT"
inline constexpr std::uint8_t kVersion = 1;
inline constexpr std::size_t kMagicAt = 0;         // u32
inline constexpr std::size_t kVersionAt = 4;       // u8
inline constexpr std::size_t kZeroAt = 5;          // u8, 0
inline constexpr std::size_t kColumnShiftAt = 6;   // i16, tiles
inline constexpr std::size_t kRowShiftAt = 8;      // i16, tiles
inline constexpr std::size_t kBaseBytesAt = 10;    // u32, file size of the base
inline constexpr std::size_t kBaseHeadCrcAt = 14;  // u32, its head CRC, which answers for the whole base
inline constexpr std::size_t kHeadAt = 18;         // the new map's head
inline constexpr std::size_t kLengthBytes = 2;     // of a payload's length
}  // namespace delta

enum class CAIRN_NODISCARD DeltaStatus : std::uint8_t {
  kIdle,            ///< no delta was begun
  kApplying,        ///< call step() again
  kApplied,         ///< the new map is there; validate it
  kTruncated,       ///< fewer bytes than its parts take
  kBadMagic,        ///< not a delta
  kUnknownVersion,  ///< a delta of another version
  kBadHead,         ///< the new map's head is none, or contradicts itself
  kOtherBase,       ///< no map in use, or not the one that the delta names
  kNoRoom,          ///< the new map does not fit
  kBadBase,         ///< the base's directory does not rise, or leads beyond the base
  kBadSize,         ///< the tiles do not add up to the new map's size
  kLeftOver,        ///< bytes after the last payload
};

/// What the job needs of a map's head, each number within what the head's bytes can mean.
struct MapShape {
  std::uint32_t head_bytes = 0;
  std::uint32_t file_bytes = 0;
  std::uint32_t columns = 0;
  std::uint32_t rows = 0;
  std::uint32_t entry_bytes = 0;

  std::uint32_t tiles() const { return columns * rows; }
  /// Where the first payload begins; at most file_bytes.
  std::uint32_t payloads_at() const { return head_bytes + tiles() * entry_bytes; }
  /// False where `bytes` does not begin with a whole head.
  bool read(const std::uint8_t* bytes, std::size_t size);
};

class DeltaJob {
 public:
  /// All bytes are borrowed until the job is done; `out` overlaps nothing. kApplying, or why not.
  DeltaStatus start(const std::uint8_t* delta, std::size_t delta_bytes, const std::uint8_t* base,
                    std::size_t base_bytes, std::uint8_t* out, std::size_t out_bytes);
  /// Units: 256 bytes copied, or a tile looked up; at most 800 operations each.
  Progress step(WorkBudget& budget);
  DeltaStatus status() const { return status_; }
  /// Size of the new map, where start() said kApplying.
  std::uint32_t result_bytes() const { return shape_.file_bytes; }

 private:
  DeltaStatus check(std::size_t delta_bytes, std::size_t base_bytes, std::size_t out_bytes);
  void begin_tile();
  DeltaStatus find_in_delta();
  DeltaStatus find_in_base(std::uint32_t tile);
  std::uint32_t base_offset(std::uint32_t tile) const;
  void put_entry(std::uint32_t tile);
  void copy_unit();
  void seal_tile();

  const std::uint8_t* delta_ = nullptr;
  const std::uint8_t* base_ = nullptr;
  std::uint8_t* out_ = nullptr;
  MapShape shape_;
  MapShape base_shape_;
  std::uint32_t tile_ = 0;  ///< that comes next
  std::uint32_t out_at_ = 0;
  std::uint32_t delta_at_ = 0;  ///< the next payload in the delta
  std::uint32_t delta_end_ = 0;
  const std::uint8_t* from_ = nullptr;  ///< of the copy under way
  std::uint32_t left_ = 0;              ///< bytes of it
  std::uint32_t crc_ = 0;               ///< of the base's tile that is copied
  bool sealing_ = false;                ///< its CRC follows the copy
  DeltaStatus status_ = DeltaStatus::kIdle;
};

}  // namespace cairn
