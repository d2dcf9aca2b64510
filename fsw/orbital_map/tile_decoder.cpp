#include "orbital_map/tile_decoder.hpp"

#include "core/big_endian.hpp"
#include "core/crc32.hpp"

namespace cairn::cmap {
namespace {

constexpr std::uint64_t kLn2 = 0xB17217F7U;  // 2^32 ln 2, cut

/// Binary logarithm, cut; `k` comes as it was for the number before: little changes.
[[gnu::always_inline]] inline void follow_log2(unsigned& k, std::uint32_t value) {
  while (value >> k > 1U) ++k;
  while (value >> k == 0U) --k;
}

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
  last_state_ = models.any() ? 1U : 0U;
  attributes_ = payload + head;
  attributes_end_ = attributes_ + coded;
  in_ = BitReader(attributes_end_, payload + size);
  waiting_[0] = {0, 0, shape.width, shape.height, static_cast<std::uint16_t>(count_), 0};
  waiting_count_ = 1;
  block_left_ = 0;
  parameter_log2_ = 0;
  state_ = 0;
  while (state_ < kStateLow && attributes_ != attributes_end_) state_ = state_ << 8U | *attributes_++;
  corrupt_ = false;
  return true;
}

TileStep TileDecoder::corrupt() {
  corrupt_ = true;
  return TileStep::kCorrupt;
}

TileStep TileDecoder::read(const AttributeModels& models, TileBoulder* out, unsigned room, unsigned& given) {
  given = 0;
  if (corrupt_) return TileStep::kCorrupt;
  while (given < room && left_ > 0) {
    if (block_left_ == 0 && !next_block()) return corrupt();
    const unsigned run = block_left_ < room - given ? block_left_ : room - given;
    if (!read_run(out + given, run)) return corrupt();
    left_ -= run;
    given += run;
  }
  read_attributes(models, out, given);
  if (left_ > 0) return TileStep::kMore;
  const bool used = in_.spent() && attributes_ == attributes_end_ && state_ == last_state_;
  return used ? TileStep::kEnd : corrupt();
}

/// Boulders of the block at hand, which holds as many. What changes stays in registers.
bool TileDecoder::read_run(TileBoulder* out, unsigned count) {
  BitReader in = in_;
  unsigned k = parameter_log2_;
  const std::uint32_t width = block_width_;
  const std::uint32_t x = block_x_;
  const std::uint32_t y = block_y_;
  std::uint32_t cell = cell_;
  std::uint32_t cells_left = cells_left_;
  std::uint32_t boulders_left = block_left_;
  for (const TileBoulder* end = out + count; out != end; ++out) {
    const std::uint32_t room = cells_left - boulders_left;  // those after it need a cell each
    std::uint32_t gap = 0;
    std::uint32_t values = cells_left;
    if (boulders_left > 1U) {
      values = static_cast<std::uint32_t>(kLn2 * (cells_left / boulders_left) >> 32U);
      if (values == 0) values = 1;
      unsigned ones = 4;
      while (ones == 4U) {
        ones = in.ones();
        gap += ones * values;  // below 2^31: a block has 2^28 cells at most
        if (gap > room) return false;
      }
    }
    follow_log2(k, values);
    gap += in.truncated(values, k);
    if (gap > room) return false;
    cell += gap;
    const std::uint32_t row = cell / width;
    out->x = x + (cell - row * width);
    out->y = y + row;
    ++cell;
    cells_left -= gap + 1U;
    --boulders_left;
  }
  in_ = in;
  parameter_log2_ = k;
  cell_ = cell;
  cells_left_ = cells_left;
  block_left_ = boulders_left;
  return true;
}

/// The classes of `count` boulders.
void TileDecoder::read_attributes(const AttributeModels& models, TileBoulder* out, unsigned count) {
  const std::uint8_t* next = attributes_;
  const std::uint8_t* const end = attributes_end_;
  std::uint32_t state = state_;
  const auto take = [&](unsigned attribute) __attribute__((always_inline)) {
    const std::uint8_t c = models.take(attribute, state);
    if (state < kStateLow && next != end) {
      state = state << 8U | *next++;
      // Two bytes are enough: before, the state was 2^23 or more, or there were none left.
      if (state < kStateLow && next != end) state = state << 8U | *next++;
    }
    return c;
  };
  for (TileBoulder* last = out + count; out != last; ++out) {
    out->attribute[0] = take(0);
    out->attribute[1] = take(1);
    out->attribute[2] = take(2);
  }
  attributes_ = next;
  state_ = state;
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
    // The middle comes first, then one more, one less ...
    follow_log2(parameter_log2_, block.boulders + 1U);
    const std::uint32_t rank = in_.truncated(block.boulders + 1U, parameter_log2_);
    const std::uint32_t middle = block.boulders / 2U;
    const std::uint32_t first = (rank & 1U) != 0U ? middle + (rank + 1U) / 2U : middle - rank / 2U;
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

}  // namespace cairn::cmap
