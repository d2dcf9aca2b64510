#include "orbital_map/map_delta.hpp"

#include <cstring>

#include "core/big_endian.hpp"
#include "core/crc32.hpp"

namespace cairn {
namespace {

constexpr std::uint32_t kCopyUnitBytes = 256;
constexpr std::uint32_t kHeadAt = delta::kHeadAt;
constexpr std::uint32_t kLengthBytes = delta::kLengthBytes;

std::int32_t get_i16(const std::uint8_t* p) { return static_cast<std::int16_t>(be::get_u16(p)); }

std::uint32_t map_bytes(std::uint32_t tiles) { return (tiles + 7U) / 8U; }

}  // namespace

bool MapShape::read(const std::uint8_t* bytes, std::size_t size) {
  if (bytes == nullptr || size < cmap::kMinHeadBytes) return false;
  if (be::get_u32(bytes + cmap::kMagicAt) != cmap::kMagic || !cmap::is_known(bytes[cmap::kVersionAt]))
    return false;
  head_bytes = be::get_u16(bytes + cmap::kHeadBytesAt);
  file_bytes = be::get_u32(bytes + cmap::kFileBytesAt);
  entry_bytes = bytes[cmap::kOffsetBytesAt];
  const std::uint32_t side = be::get_u32(bytes + cmap::kTileSideAt);
  if (head_bytes < cmap::kMinHeadBytes || head_bytes > size || side == 0) return false;
  if (entry_bytes < 2 || entry_bytes > 4) return false;
  columns = cmap::tiles_along(be::get_u32(bytes + cmap::kExtentXAt), side);
  rows = cmap::tiles_along(be::get_u32(bytes + cmap::kExtentYAt), side);
  return std::uint64_t{columns} * rows <= cmap::kMaxTiles && payloads_at() <= file_bytes;
}

DeltaStatus DeltaJob::start(const std::uint8_t* delta, std::size_t delta_bytes, const std::uint8_t* base,
                            std::size_t base_bytes, std::uint8_t* out, std::size_t out_bytes) {
  delta_ = delta;
  base_ = base;
  out_ = out;
  left_ = tile_ = out_at_ = 0;
  sealing_ = false;
  status_ = check(delta_bytes, base_bytes, out_bytes);
  if (status_ != DeltaStatus::kApplying) return status_;
  std::memcpy(out_, delta_ + kHeadAt, shape_.head_bytes);  // less than 64 KiB, as 16 bits say; usually 100
  out_at_ = shape_.payloads_at();
  delta_at_ = kHeadAt + shape_.head_bytes + map_bytes(shape_.tiles());
  delta_end_ = static_cast<std::uint32_t>(delta_bytes);
  return status_;
}

DeltaStatus DeltaJob::check(std::size_t delta_bytes, std::size_t base_bytes, std::size_t out_bytes) {
  if (delta_ == nullptr || delta_bytes < kHeadAt || delta_bytes > UINT32_MAX) return DeltaStatus::kTruncated;
  if (be::get_u32(delta_ + delta::kMagicAt) != delta::kMagic) return DeltaStatus::kBadMagic;
  if (delta_[delta::kVersionAt] != delta::kVersion || delta_[delta::kZeroAt] != 0)
    return DeltaStatus::kUnknownVersion;
  if (!shape_.read(delta_ + kHeadAt, delta_bytes - kHeadAt)) return DeltaStatus::kBadHead;
  if (delta_bytes - kHeadAt - shape_.head_bytes < map_bytes(shape_.tiles())) return DeltaStatus::kTruncated;
  if (!base_shape_.read(base_, base_bytes) || base_shape_.file_bytes > base_bytes ||
      base_shape_.file_bytes != be::get_u32(delta_ + delta::kBaseBytesAt) ||
      be::get_u32(base_ + base_shape_.head_bytes - cmap::kCrcBytes) !=
          be::get_u32(delta_ + delta::kBaseHeadCrcAt)) {
    return DeltaStatus::kOtherBase;
  }
  return out_ == nullptr || shape_.file_bytes > out_bytes ? DeltaStatus::kNoRoom : DeltaStatus::kApplying;
}

Progress DeltaJob::step(WorkBudget& budget) {
  while (status_ == DeltaStatus::kApplying) {
    if (left_ > 0) {
      if (!budget.take(3 * kCopyUnitBytes)) return Progress::kMore;
      copy_unit();
    } else if (sealing_) {
      seal_tile();
    } else if (tile_ < shape_.tiles()) {
      if (!budget.take(32)) return Progress::kMore;
      begin_tile();
    } else if (out_at_ != shape_.file_bytes) {
      status_ = DeltaStatus::kBadSize;
    } else {
      status_ = delta_at_ == delta_end_ ? DeltaStatus::kApplied : DeltaStatus::kLeftOver;
    }
  }
  return Progress::kDone;
}

void DeltaJob::copy_unit() {
  const std::uint32_t bytes = left_ < kCopyUnitBytes ? left_ : kCopyUnitBytes;
  if (sealing_) crc_ = crc32(from_, bytes, crc_);
  std::memcpy(out_ + out_at_, from_, bytes);
  from_ += bytes;
  out_at_ += bytes;
  left_ -= bytes;
}

void DeltaJob::seal_tile() {
  be::put_u32(out_ + out_at_, crc_);
  out_at_ += cmap::kCrcBytes;
  sealing_ = false;
}

/// Sets up the copy of the next tile's payload, after all of it was found to lie within its bounds.
void DeltaJob::begin_tile() {
  const std::uint32_t tile = tile_++;
  put_entry(tile);
  const std::uint8_t* here = delta_ + kHeadAt + shape_.head_bytes;
  const bool in_delta = (here[tile / 8U] >> (7U - tile % 8U) & 1U) != 0;
  status_ = in_delta ? find_in_delta() : find_in_base(tile);
  if (status_ != DeltaStatus::kApplying) return;
  const std::uint32_t length = left_ + (sealing_ ? cmap::kCrcBytes : 0U);
  if (length > shape_.file_bytes - out_at_) status_ = DeltaStatus::kBadSize;
}

/// The directory's entry: where the payload begins that comes next.
void DeltaJob::put_entry(std::uint32_t tile) {
  std::uint8_t* entry = out_ + shape_.head_bytes + tile * shape_.entry_bytes;
  const std::uint32_t offset = out_at_ - shape_.payloads_at();
  for (std::uint32_t i = 0; i < shape_.entry_bytes; ++i)
    entry[i] = static_cast<std::uint8_t>(offset >> 8U * (shape_.entry_bytes - 1U - i));
}

DeltaStatus DeltaJob::find_in_delta() {
  if (delta_end_ - delta_at_ < kLengthBytes) return DeltaStatus::kTruncated;
  left_ = be::get_u16(delta_ + delta_at_);
  delta_at_ += kLengthBytes;
  if (left_ > delta_end_ - delta_at_) return DeltaStatus::kTruncated;
  from_ = delta_ + delta_at_;
  delta_at_ += left_;
  return DeltaStatus::kApplying;
}

DeltaStatus DeltaJob::find_in_base(std::uint32_t tile) {
  const auto columns = static_cast<std::int32_t>(base_shape_.columns);
  const auto rows = static_cast<std::int32_t>(base_shape_.rows);
  const std::int32_t column =
      static_cast<std::int32_t>(tile % shape_.columns) + get_i16(delta_ + delta::kColumnShiftAt);
  const std::int32_t row =
      static_cast<std::int32_t>(tile / shape_.columns) + get_i16(delta_ + delta::kRowShiftAt);
  if (column < 0 || row < 0 || column >= columns || row >= rows) return DeltaStatus::kApplying;
  const auto twin = static_cast<std::uint32_t>(row * columns + column);
  const std::uint32_t begin = base_offset(twin);
  const std::uint32_t end = base_offset(twin + 1U);
  if (end < begin || end > base_shape_.file_bytes - base_shape_.payloads_at()) return DeltaStatus::kBadBase;
  if (end == begin) return DeltaStatus::kApplying;
  if (end - begin <= cmap::kCrcBytes) return DeltaStatus::kBadBase;
  from_ = base_ + base_shape_.payloads_at() + begin;
  left_ = end - begin - cmap::kCrcBytes;
  sealing_ = true;
  std::uint8_t number[4];
  be::put_u32(number, tile);
  crc_ = crc32(number, sizeof number);
  return DeltaStatus::kApplying;
}

/// As it stands in the base's directory; after the last tile, the payloads' end.
std::uint32_t DeltaJob::base_offset(std::uint32_t tile) const {
  if (tile == base_shape_.tiles()) return base_shape_.file_bytes - base_shape_.payloads_at();
  const std::uint8_t* entry = base_ + base_shape_.head_bytes + tile * base_shape_.entry_bytes;
  std::uint32_t offset = 0;
  for (std::uint32_t i = 0; i < base_shape_.entry_bytes; ++i) offset = offset << 8U | entry[i];
  return offset;
}

}  // namespace cairn
