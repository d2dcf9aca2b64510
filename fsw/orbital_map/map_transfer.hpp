/// Takes a new orbital map, or a delta to the one in use, as it comes up through a deep-space link: numbered
/// chunks in any order, with losses and repeats, into a bank that nobody reads; then checks it whole.
///
///   begin(plan, bank)   what comes, and where to
///   accept(chunk)       each chunk, as often as it comes; the last one missing makes it kComplete
///   verify(base)        the job: step(budget) until kDone
///   status() kReady     result() is a validated map in the bank; the owner switches to it and says so:
///   leave()
///
/// Nothing but the bank is ever written, so whatever fails leaves the map in use as it was. A map is written
/// to the front of its bank. A delta is written to the bank's end and applied from there to its front
/// (map_delta.hpp), so that one bank has room for both: it must hold the new map and the delta.
///
/// Chunk, big-endian (doc/ICD.md): upload id u32, number u16, data, CRC-32 of all before. The id is the
/// CRC-32 of the whole upload, so that it also proves the bytes once all are there. All chunks but the last
/// hold `chunk_bytes` bytes of data. A chunk has a CRC of its own, beside that of the packet it comes in: it
/// may be stored and carried in other ways, and what is written to the bank was checked last.
///
/// What must survive a reset is `record()`: plain data without pointers, which an owner may store and give
/// to `resume` with the bank that still holds the bytes (FlightApp does not: doc/adr/0007-two-map-banks.md).
/// A verification that was under way begins again; it reads the upload in the bank and never changes it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "core/enum_count.hpp"
#include "core/nodiscard.hpp"
#include "core/work_budget.hpp"
#include "mission_cfg.hpp"
#include "orbital_map/map_delta.hpp"
#include "orbital_map/orbital_map.hpp"

namespace cairn {

enum class UploadKind : std::uint8_t {
  kMap = 1,    ///< a whole `.cmap`
  kDelta = 2,  ///< a delta to the map in use
};

namespace chunk {
inline constexpr std::size_t kIdAt = 0;      // u32
inline constexpr std::size_t kNumberAt = 4;  // u16, from 0
inline constexpr std::size_t kDataAt = 6;
inline constexpr std::size_t kCrcBytes = 4;
inline constexpr std::size_t kOverheadBytes = kDataAt + kCrcBytes;
inline constexpr std::size_t kMinDataBytes = 16;    ///< of all chunks but the last
inline constexpr std::size_t kMaxDataBytes = 1024;  ///< bounds the work of accept()
}  // namespace chunk

/// What comes, as the command that announces it says; `begin` judges it.
struct UploadPlan {
  std::uint8_t kind = 0;  ///< UploadKind
  std::uint32_t id = 0;   ///< CRC-32 of the whole upload
  std::uint32_t bytes = 0;
  std::uint16_t chunk_bytes = 0;  ///< data of each chunk but the last

  friend bool operator==(const UploadPlan& a, const UploadPlan& b) {
    return a.kind == b.kind && a.id == b.id && a.bytes == b.bytes && a.chunk_bytes == b.chunk_bytes;
  }
};
/// Of a plan whose chunk_bytes is not 0.
std::uint32_t chunks_of(const UploadPlan& plan);

enum class CAIRN_NODISCARD BeginStatus : std::uint8_t {
  kBegun,          ///< afresh; what was under way before is given up
  kUnderWay,       ///< the same upload is under way, or ready: nothing changed
  kBadKind,        ///< from here on: refused, and what was under way goes on
  kBadChunkBytes,  ///< less than kMinDataBytes or more than kMaxDataBytes
  kEmpty,          ///< an upload of no bytes
  kTooManyChunks,  ///< more than cfg::kMaxMapChunks
  kNoRoom,         ///< there is no bank, or it is too small
};

enum class CAIRN_NODISCARD ChunkStatus : std::uint8_t {
  kTaken,        ///< new, and in the bank
  kRepeated,     ///< taken before, the same bytes
  kNoUpload,     ///< from here on: refused, the bank untouched. No upload was begun, or it is over
  kBadSize,      ///< not that of a chunk with this number
  kBadCrc,       ///< changed on its way
  kOtherUpload,  ///< its id is not that of the upload under way
  kOutOfRange,   ///< its number is beyond the last chunk
  kContradicts,  ///< taken before, with other bytes
};
inline constexpr std::size_t kChunkStatusCount = 8;
static_assert(enum_has<ChunkStatus, kChunkStatusCount>());

enum class CAIRN_NODISCARD TransferStatus : std::uint8_t {
  kIdle,       ///< no upload was begun
  kReceiving,  ///< chunks are missing
  kComplete,   ///< all chunks are there: call verify()
  kVerifying,  ///< call step() again
  kReady,      ///< the only status whose result() may be used
  kUploadCrc,  ///< failed: the bytes in the bank are not those of the upload's id
  kBadDelta,   ///< failed: detail() is the DeltaStatus
  kBadMap,     ///< failed: the map is not whole and good; detail() is the MapStatus
  kInUse,      ///< the owner has switched to the result: the upload is over
};

/// What must survive: see above.
struct TransferRecord {
  UploadPlan plan;
  TransferStatus status = TransferStatus::kIdle;
  std::uint8_t detail = 0;  ///< DeltaStatus where kBadDelta, MapStatus where kBadMap, kReady and kInUse
  std::uint16_t chunks = 0;
  std::uint16_t taken = 0;
  std::array<std::uint32_t, kChunkStatusCount> counts{};  ///< of chunks by ChunkStatus, since init
  std::uint8_t have[(cfg::kMaxMapChunks + 7) / 8] = {};   ///< chunk n: bit n % 8 (1 << n % 8) of byte n / 8
};
static_assert(std::is_trivially_copyable_v<TransferRecord>, "a record is stored as it is");

class MapTransfer {
 public:
  /// Gets ready for the chunks of an upload. `bank` is borrowed until the upload is over; nothing else may
  /// use it. Cost: clears the record.
  BeginStatus begin(const UploadPlan& plan, std::uint8_t* bank, std::size_t bank_bytes);
  /// Goes on after a reset with a record that was stored: what is missing is awaited, what was complete is to
  /// be verified again. Refuses as `begin` where the record's plan does not hold, kEmpty where it is of no
  /// upload under way or contradicts itself.
  BeginStatus resume(const TransferRecord& record, std::uint8_t* bank, std::size_t bank_bytes);

  /// One chunk as it came. Cost: some 5 operations a byte, at most 1034 bytes.
  ChunkStatus accept(const std::uint8_t* bytes, std::size_t size);

  /// Where the status is kComplete: begins to verify, with the map in use as base of a delta (null: none).
  /// `base` is borrowed until the job is done. Else nothing happens.
  TransferStatus verify(const std::uint8_t* base, std::size_t base_bytes);
  /// Units: 256 bytes of CRC, those of DeltaJob and of MapValidation.
  Progress step(WorkBudget& budget);

  TransferStatus status() const { return record_.status; }
  std::uint8_t detail() const { return record_.detail; }
  /// The new map where status() is kReady, else no map.
  const OrbitalMap& result() const;
  /// The owner uses the result from now on; or, in any other state, gives the upload up.
  void leave();

  const TransferRecord& record() const { return record_; }
  bool has(std::uint32_t number) const;
  /// The first chunk that is missing; the number of chunks where none is.
  std::uint32_t first_missing() const;

 private:
  enum class Phase : std::uint8_t { kCrc, kDelta, kMap };

  BeginStatus judge(const UploadPlan& plan, const std::uint8_t* bank, std::size_t bank_bytes) const;
  ChunkStatus judge(const std::uint8_t* bytes, std::size_t size) const;
  std::uint8_t* upload() const;
  void crc_unit();
  void start_delta();
  void start_map();
  void end_map();

  TransferRecord record_;
  std::uint8_t* bank_ = nullptr;
  std::size_t bank_bytes_ = 0;
  const std::uint8_t* base_ = nullptr;
  std::size_t base_bytes_ = 0;
  Phase phase_ = Phase::kCrc;
  std::uint32_t cursor_ = 0;
  std::uint32_t crc_ = 0;
  DeltaJob delta_;
  MapValidation validation_;
  OrbitalMap none_;
};

}  // namespace cairn
