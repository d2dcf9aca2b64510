#include "orbital_map/map_transfer.hpp"

#include <cstring>

#include "core/assert.hpp"
#include "core/big_endian.hpp"
#include "core/crc32.hpp"

namespace cairn {
namespace {

/// Bytes of data in chunk `number`.
std::uint32_t data_bytes(const UploadPlan& plan, std::uint32_t number) {
  const std::uint32_t left = plan.bytes - number * plan.chunk_bytes;
  return left < plan.chunk_bytes ? left : plan.chunk_bytes;
}

/// memcmp would be one more function that the library asks its surroundings for.
bool same_bytes(const std::uint8_t* a, const std::uint8_t* b, std::size_t size) {
  unsigned difference = 0;
  for (std::size_t i = 0; i < size; ++i) difference |= static_cast<unsigned>(a[i] ^ b[i]);
  return difference == 0;
}

bool failed(TransferStatus status) {
  return status == TransferStatus::kUploadCrc || status == TransferStatus::kBadDelta ||
         status == TransferStatus::kBadMap;
}

/// Chunks are taken, or known again.
bool under_way(TransferStatus status) {
  return status != TransferStatus::kIdle && status != TransferStatus::kInUse && !failed(status);
}

}  // namespace

std::uint32_t chunks_of(const UploadPlan& plan) {
  return plan.bytes / plan.chunk_bytes + (plan.bytes % plan.chunk_bytes != 0 ? 1U : 0U);
}

BeginStatus MapTransfer::judge(const UploadPlan& plan, const std::uint8_t* bank,
                               std::size_t bank_bytes) const {
  if (plan.kind != static_cast<std::uint8_t>(UploadKind::kMap) &&
      plan.kind != static_cast<std::uint8_t>(UploadKind::kDelta)) {
    return BeginStatus::kBadKind;
  }
  if (plan.chunk_bytes < chunk::kMinDataBytes || plan.chunk_bytes > chunk::kMaxDataBytes)
    return BeginStatus::kBadChunkBytes;
  if (plan.bytes == 0) return BeginStatus::kEmpty;
  if (chunks_of(plan) > cfg::kMaxMapChunks) return BeginStatus::kTooManyChunks;
  return bank == nullptr || plan.bytes > bank_bytes ? BeginStatus::kNoRoom : BeginStatus::kBegun;
}

BeginStatus MapTransfer::begin(const UploadPlan& plan, std::uint8_t* bank, std::size_t bank_bytes) {
  if (under_way(record_.status) && plan == record_.plan) return BeginStatus::kUnderWay;
  const BeginStatus status = judge(plan, bank, bank_bytes);
  if (status != BeginStatus::kBegun) return status;
  record_.plan = plan;
  record_.status = TransferStatus::kReceiving;
  record_.detail = 0;
  record_.chunks = static_cast<std::uint16_t>(chunks_of(plan));
  record_.taken = 0;
  std::memset(record_.have, 0, sizeof record_.have);
  bank_ = bank;
  bank_bytes_ = bank_bytes;
  return status;
}

BeginStatus MapTransfer::resume(const TransferRecord& record, std::uint8_t* bank, std::size_t bank_bytes) {
  if (!under_way(record.status)) return BeginStatus::kEmpty;
  const BeginStatus status = judge(record.plan, bank, bank_bytes);
  if (status != BeginStatus::kBegun) return status;
  std::uint32_t taken = 0;
  for (std::uint32_t n = 0; n < 8 * sizeof record.have; ++n) {
    if ((record.have[n / 8] >> n % 8 & 1U) == 0) continue;
    if (n >= record.chunks) return BeginStatus::kEmpty;
    ++taken;
  }
  if (record.chunks != chunks_of(record.plan) || record.taken != taken) return BeginStatus::kEmpty;
  record_ = record;
  record_.status = taken == record.chunks ? TransferStatus::kComplete : TransferStatus::kReceiving;
  record_.detail = 0;
  bank_ = bank;
  bank_bytes_ = bank_bytes;
  return status;
}

bool MapTransfer::has(std::uint32_t number) const {
  return number < record_.chunks && (record_.have[number / 8] >> number % 8 & 1U) != 0;
}

std::uint32_t MapTransfer::first_missing() const {
  std::uint32_t number = 0;
  while (number < record_.chunks && has(number)) ++number;
  return number;
}

/// The upload in the bank: a map at its front, a delta at its end.
std::uint8_t* MapTransfer::upload() const {
  const bool at_end = record_.plan.kind == static_cast<std::uint8_t>(UploadKind::kDelta);
  return at_end ? bank_ + (bank_bytes_ - record_.plan.bytes) : bank_;
}

/// kTaken where the chunk is new, kRepeated where its number is not.
ChunkStatus MapTransfer::judge(const std::uint8_t* bytes, std::size_t size) const {
  if (!under_way(record_.status)) return ChunkStatus::kNoUpload;
  if (bytes == nullptr || size <= chunk::kOverheadBytes ||
      size > chunk::kOverheadBytes + chunk::kMaxDataBytes) {
    return ChunkStatus::kBadSize;
  }
  const std::size_t crc_at = size - chunk::kCrcBytes;
  if (crc32(bytes, crc_at) != be::get_u32(bytes + crc_at)) return ChunkStatus::kBadCrc;
  if (be::get_u32(bytes + chunk::kIdAt) != record_.plan.id) return ChunkStatus::kOtherUpload;
  const std::uint32_t number = be::get_u16(bytes + chunk::kNumberAt);
  if (number >= record_.chunks) return ChunkStatus::kOutOfRange;
  if (size != chunk::kOverheadBytes + data_bytes(record_.plan, number)) return ChunkStatus::kBadSize;
  return has(number) ? ChunkStatus::kRepeated : ChunkStatus::kTaken;
}

ChunkStatus MapTransfer::accept(const std::uint8_t* bytes, std::size_t size) {
  ChunkStatus status = judge(bytes, size);
  if (status == ChunkStatus::kTaken || status == ChunkStatus::kRepeated) {
    const std::uint32_t number = be::get_u16(bytes + chunk::kNumberAt);
    std::uint8_t* place = upload() + number * record_.plan.chunk_bytes;
    const std::size_t data = size - chunk::kOverheadBytes;
    if (status == ChunkStatus::kTaken) {
      std::memcpy(place, bytes + chunk::kDataAt, data);
      record_.have[number / 8] = static_cast<std::uint8_t>(record_.have[number / 8] | 1U << number % 8);
      if (++record_.taken == record_.chunks) record_.status = TransferStatus::kComplete;
    } else if (!same_bytes(place, bytes + chunk::kDataAt, data)) {
      status = ChunkStatus::kContradicts;
    }
  }
  ++record_.counts[static_cast<int>(status)];
  return status;
}

TransferStatus MapTransfer::verify(const std::uint8_t* base, std::size_t base_bytes) {
  if (record_.status != TransferStatus::kComplete) return record_.status;
  base_ = base;
  base_bytes_ = base_bytes;
  phase_ = Phase::kCrc;
  cursor_ = 0;
  crc_ = 0;
  record_.status = TransferStatus::kVerifying;
  return record_.status;
}

Progress MapTransfer::step(WorkBudget& budget) {
  while (record_.status == TransferStatus::kVerifying) {
    switch (phase_) {
      case Phase::kCrc:
        if (!budget.take(2 * kCrcUnitBytes)) return Progress::kMore;
        crc_unit();
        break;
      case Phase::kDelta:
        if (delta_.step(budget) == Progress::kMore) return Progress::kMore;
        if (delta_.status() == DeltaStatus::kApplied) {
          start_map();
        } else {
          record_.status = TransferStatus::kBadDelta;
          record_.detail = static_cast<std::uint8_t>(delta_.status());
        }
        break;
      case Phase::kMap:
        if (validation_.step(budget) == Progress::kMore) return Progress::kMore;
        end_map();
        break;
    }
  }
  return Progress::kDone;
}

void MapTransfer::crc_unit() {
  const std::uint32_t left = record_.plan.bytes - cursor_;
  const std::uint32_t bytes = left < kCrcUnitBytes ? left : kCrcUnitBytes;
  crc_ = crc32(upload() + cursor_, bytes, crc_);
  cursor_ += bytes;
  if (cursor_ < record_.plan.bytes) return;
  if (crc_ != record_.plan.id) {
    record_.status = TransferStatus::kUploadCrc;
  } else if (record_.plan.kind == static_cast<std::uint8_t>(UploadKind::kDelta)) {
    start_delta();
  } else {
    start_map();
  }
}

/// A delta that is refused at once ends in the next step.
void MapTransfer::start_delta() {
  phase_ = Phase::kDelta;
  static_cast<void>(delta_.start(upload(), record_.plan.bytes, base_, base_bytes_, bank_,
                                 bank_bytes_ - record_.plan.bytes));
}

/// The map is all of a whole upload, or what the delta made. One that is refused at once
/// ends in the next step.
void MapTransfer::start_map() {
  const bool whole = record_.plan.kind == static_cast<std::uint8_t>(UploadKind::kMap);
  phase_ = Phase::kMap;
  static_cast<void>(validation_.start(bank_, whole ? record_.plan.bytes : delta_.result_bytes()));
}

/// Only a map that is whole and good: one with a damaged tile was not sent so.
void MapTransfer::end_map() {
  const MapStatus status = validation_.status();
  record_.status = status == MapStatus::kUsable ? TransferStatus::kReady : TransferStatus::kBadMap;
  record_.detail = static_cast<std::uint8_t>(status);
}

const OrbitalMap& MapTransfer::result() const {
  return record_.status == TransferStatus::kReady ? validation_.result() : none_;
}

void MapTransfer::leave() {
  record_.status = record_.status == TransferStatus::kReady ? TransferStatus::kInUse : TransferStatus::kIdle;
}

}  // namespace cairn
