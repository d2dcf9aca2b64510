#include "orbital_map/tile_decoder.hpp"

#include "core/big_endian.hpp"
#include "core/crc32.hpp"

namespace cairn::cmap {
namespace {

constexpr std::uint64_t kLn2 = 0xB17217F7U;  // 2^32 ln 2, cut

}  // namespace

std::uint32_t tile_crc_start(std::uint32_t tile) {
  std::uint8_t number[4];
  be::put_u32(number, tile);
  return crc32(number, sizeof number);
}

bool TileDecoder::start(const AttributeModels& models, const TileShape& shape, const std::uint8_t* payload,
                        std::size_t size) {
  corrupt_ = true;
  const std::size_t head = kTileHeadBytes + (models.any() ? 2U : 0U);
  if (size < head) return false;
  count_ = left_ = be::get_u16(payload + kTileCountAt);
  depth_ = payload[kTileDepthAt];
  if (count_ == 0 || count_ > kMaxTileBoulders || depth_ > kMaxDepth) return false;
  const std::size_t coded = models.any() ? be::get_u16(payload + kAttributeBytesAt) : 0U;
  if (coded > size - head) return false;
  waiting_[0] = {0, 0, shape.width, shape.height, static_cast<std::uint16_t>(count_), 0};
  waiting_count_ = 1;
  block_left_ = 0;
  buffer_ = 0;
  held_ = beyond_ = 0;
  parameter_log2_ = 0;
  state_ = 0;
  last_state_ = models.any() ? 1U : 0U;
  attributes_ = payload + head;
  attributes_end_ = next_ = attributes_ + coded;
  end_ = payload + size;
  refill_state();
  corrupt_ = false;
  return true;
}

TileStep TileDecoder::next(const AttributeModels& models, TileBoulder& out) {
  if (corrupt_) return TileStep::kCorrupt;
  if (left_ == 0) return end();
  std::uint32_t skipped = 0;
  if ((block_left_ == 0 && !next_block()) || !gap(skipped)) {
    corrupt_ = true;
    return TileStep::kCorrupt;
  }
  const std::uint32_t cell = cell_ + skipped;
  cell_ = cell + 1U;
  cells_left_ -= skipped + 1U;
  --block_left_;
  --left_;
  const std::uint32_t row = cell / block_width_;
  out.x = block_x_ + (cell - row * block_width_);
  out.y = block_y_ + row;
  take_attributes(models, out);
  return TileStep::kBoulder;
}

bool TileDecoder::is_leaf(const Block& block) const {
  if (block.width > kMaxBlockSide || block.height > kMaxBlockSide) return false;
  return block.boulders == 1 || block.depth >= depth_ || (block.width == 1 && block.height == 1);
}

/// Goes on to the next block with its boulders, split after split. False: it holds more than it can.
bool TileDecoder::next_block() {
  if (waiting_count_ == 0) return false;
  Block block = waiting_[--waiting_count_];
  while (!is_leaf(block)) {
    const std::uint32_t first = first_half(block.boulders);
    ++block.depth;
    Block second = block;
    if (block.width >= block.height) {
      block.width /= 2U;
      second.x += block.width;
      second.width -= block.width;
    } else {
      block.height /= 2U;
      second.y += block.height;
      second.height -= block.height;
    }
    second.boulders = static_cast<std::uint16_t>(block.boulders - first);
    block.boulders = static_cast<std::uint16_t>(first);
    if (first == 0) {
      block = second;
    } else if (second.boulders > 0) {
      if (waiting_count_ > kMostSplits) return false;
      waiting_[waiting_count_++] = second;
    }
  }
  block_x_ = block.x;
  block_y_ = block.y;
  block_width_ = block.width;
  block_left_ = block.boulders;
  cells_left_ = block.width * block.height;
  cell_ = 0;
  return block_left_ <= cells_left_;
}

/// How many of a block's boulders its first half holds: the middle comes first, then one more, one less ...
std::uint32_t TileDecoder::first_half(std::uint32_t boulders) {
  const std::uint32_t rank = truncated(boulders + 1U);
  const std::uint32_t middle = boulders / 2U;
  return (rank & 1U) != 0U ? middle + (rank + 1U) / 2U : middle - rank / 2U;
}

/// Free cells before the next boulder; so few that those after it have room.
bool TileDecoder::gap(std::uint32_t& value) {
  if (block_left_ == 1) {
    value = truncated(cells_left_);
    return true;
  }
  const std::uint32_t room = cells_left_ - block_left_;
  auto parameter = static_cast<std::uint32_t>(kLn2 * (cells_left_ / block_left_) >> 32U);
  if (parameter == 0) parameter = 1;
  value = 0;
  while (bit()) {
    if (room - value < parameter) return false;
    value += parameter;
  }
  const std::uint32_t rest = truncated(parameter);
  if (room - value < rest) return false;
  value += rest;
  return true;
}

/// A number below `values` (at least 1): with k = floor(log2 values), the first 2^(k + 1) - values numbers
/// take k bits, the others one more.
std::uint32_t TileDecoder::truncated(std::uint32_t values) {
  while (values >> parameter_log2_ > 1U) ++parameter_log2_;  // little changes from boulder to boulder
  while (values >> parameter_log2_ == 0U) --parameter_log2_;
  const std::uint32_t shorter = (2U << parameter_log2_) - values;  // 2^32 is 0 here, and right
  const std::uint32_t value = bits(parameter_log2_);
  if (value < shorter) return value;
  return value + value - shorter + (bit() ? 1U : 0U);
}

/// At least 25 bits in the buffer; zeros from beyond the end are counted.
void TileDecoder::refill() {
  while (held_ <= 24U) {
    if (next_ != end_) {
      buffer_ |= static_cast<std::uint32_t>(*next_++) << (24U - held_);
    } else {
      beyond_ += 8U;
    }
    held_ += 8U;
  }
}

bool TileDecoder::bit() {
  if (held_ == 0) refill();
  const bool one = buffer_ >> 31U != 0U;
  buffer_ <<= 1U;
  --held_;
  return one;
}

/// The next `count` bits, 0 to 31.
std::uint32_t TileDecoder::bits(unsigned count) {
  std::uint32_t high = 0;
  if (count > 16U) {
    if (held_ < 16U) refill();
    high = buffer_ >> 16U;
    buffer_ <<= 16U;
    held_ -= 16U;
    count -= 16U;
  }
  if (count == 0) return high;
  if (held_ < count) refill();
  const std::uint32_t low = buffer_ >> (32U - count);
  buffer_ <<= count;
  held_ -= count;
  return high << count | low;
}

void TileDecoder::refill_state() {
  while (state_ < kStateLow && attributes_ != attributes_end_) state_ = state_ << 8U | *attributes_++;
}

void TileDecoder::take_attributes(const AttributeModels& models, TileBoulder& out) {
  for (unsigned a = 0; a < kAttributes; ++a) {
    out.attribute[a] = 0;
    if (!models.has(a)) continue;
    out.attribute[a] = static_cast<std::uint8_t>(models.take(a, state_));
    refill_state();
  }
}

/// All that is coded was used, and what fills the last byte is zero.
TileStep TileDecoder::end() {
  const unsigned real = held_ - beyond_;  // wraps where more was read than there is
  corrupt_ =
      next_ != end_ || real >= 8U || buffer_ != 0U || attributes_ != attributes_end_ || state_ != last_state_;
  return corrupt_ ? TileStep::kCorrupt : TileStep::kEnd;
}

}  // namespace cairn::cmap
