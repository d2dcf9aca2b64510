/// What the fuzz targets share: input taken apart, maps whose CRCs are made to hold, so that the fuzzer gets
/// past them, and memory that is exactly as large as it may be used.
///
/// `make fuzz RUNS=...` runs them; `make check-fuzz` for a short while. A target gets bytes from libFuzzer
/// and must neither crash nor hang nor break an invariant that it checks by CAIRN_ASSERT.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>

#include "core/assert.hpp"
#include "core/big_endian.hpp"
#include "core/crc32.hpp"
#include "orbital_map/map_delta.hpp"
#include "orbital_map/orbital_map.hpp"

namespace cairn::fuzz {

/// The input, taken from its front; zeros where it has ended.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : next_(data), left_(size) {}
  std::size_t left() const { return left_; }
  std::uint8_t u8() {
    if (left_ == 0) return 0;
    --left_;
    return *next_++;
  }
  std::uint16_t u16() {
    const unsigned high = u8();
    return static_cast<std::uint16_t>(high << 8U | u8());
  }
  std::uint32_t u32() {
    const std::uint32_t high = u16();
    return high << 16U | u16();
  }

 private:
  const std::uint8_t* next_;
  std::size_t left_;
};

/// Memory on the heap, so that the address sanitizer sees the first byte beyond it.
class Block {
 public:
  explicit Block(std::size_t size) : bytes_(new std::uint8_t[size]()), size_(size) {}
  Block(Input& in, std::size_t size) : Block(std::min(size, in.left())) {
    for (std::size_t i = 0; i < size_; ++i) bytes_[i] = in.u8();
  }
  Block(const std::uint8_t* from, std::size_t size) : Block(size) {
    if (size > 0) std::memcpy(bytes_.get(), from, size);
  }
  std::uint8_t* data() { return bytes_.get(); }
  const std::uint8_t* data() const { return bytes_.get(); }
  std::size_t size() const { return size_; }

 private:
  std::unique_ptr<std::uint8_t[]> bytes_;
  std::size_t size_;
};

/// Makes size and CRCs of a map hold as far as its head can be read, whatever else it holds.
inline void repair_map(std::uint8_t* map, std::size_t size) {
  MapShape shape;
  if (size < cmap::kMinHeadBytes || size > UINT32_MAX) return;
  be::put_u32(map + cmap::kMagicAt, cmap::kMagic);
  if (!cmap::is_known(map[cmap::kVersionAt])) map[cmap::kVersionAt] = cmap::kVersion;
  be::put_u32(map + cmap::kFileBytesAt, static_cast<std::uint32_t>(size));
  if (shape.read(map, size)) {
    std::uint32_t crc_of_crcs = 0;
    const std::uint32_t payloads = static_cast<std::uint32_t>(size) - shape.payloads_at();
    const auto offset = [&](std::uint32_t tile) {
      if (tile == shape.tiles()) return payloads;
      const std::uint8_t* entry = map + shape.head_bytes + tile * shape.entry_bytes;
      std::uint32_t value = 0;
      for (std::uint32_t i = 0; i < shape.entry_bytes; ++i) value = value << 8U | entry[i];
      return value;
    };
    for (std::uint32_t tile = 0; tile < shape.tiles(); ++tile) {
      const std::uint32_t begin = offset(tile);
      const std::uint32_t end = offset(tile + 1);
      if (end > payloads || begin > end || end - begin < cmap::kCrcBytes) continue;
      std::uint8_t* payload = map + shape.payloads_at() + begin;
      const std::size_t coded = end - begin - cmap::kCrcBytes;
      std::uint8_t number[4];
      be::put_u32(number, tile);
      be::put_u32(payload + coded, crc32(payload, coded, crc32(number, sizeof number)));
      crc_of_crcs = crc32(payload + coded, cmap::kCrcBytes, crc_of_crcs);
    }
    be::put_u32(map + cmap::kTilesCrcAt, crc_of_crcs);
    be::put_u32(map + cmap::kDirectoryCrcAt,
                crc32(map + shape.head_bytes, shape.payloads_at() - shape.head_bytes));
  }
  const std::size_t head_bytes = be::get_u16(map + cmap::kHeadBytesAt);
  if (head_bytes < cmap::kMinHeadBytes || head_bytes > size) return;
  const std::size_t crc_at = head_bytes - cmap::kCrcBytes;
  be::put_u32(map + crc_at, crc32(map, crc_at));
}

/// The job to its end, in steps of `ops`.
template <typename Job>
void run(Job& job, std::uint32_t ops) {
  for (;;) {
    WorkBudget budget(ops);
    if (job.step(budget) == Progress::kDone) return;
    CAIRN_ASSERT(budget.spent() > 0);
  }
}

/// Validates; the map where it may be used.
inline MapStatus validate(const Block& map, std::uint32_t ops, OrbitalMap& out) {
  static MapValidation validation;
  if (validation.start(map.data(), map.size()) == MapStatus::kChecking) run(validation, ops);
  CAIRN_ASSERT(validation.status() != MapStatus::kChecking);
  CAIRN_ASSERT(may_be_used(validation.status()) == validation.result().usable());
  out = validation.result();
  return validation.status();
}

}  // namespace cairn::fuzz
