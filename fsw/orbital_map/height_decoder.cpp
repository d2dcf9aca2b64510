#include "orbital_map/height_decoder.hpp"

namespace cairn::cmap {

bool HeightDecoder::start(std::uint32_t columns, std::uint32_t rows, const std::uint8_t* bytes,
                          std::size_t size) {
  rows_left_ = 0;
  if (size == 0) return false;
  rice_ = bytes[0] & static_cast<std::uint8_t>(~kHoles);
  if (rice_ > kMaxRice) return false;
  holes_ = (bytes[0] & kHoles) != 0;
  in_ = BitReader(bytes + 1, bytes + size);
  columns_ = static_cast<std::uint16_t>(columns);
  rows_left_ = static_cast<std::uint16_t>(rows);
  first_ = true;
  return true;
}

HeightStep HeightDecoder::corrupt() {
  rows_left_ = 0;
  return HeightStep::kCorrupt;
}

HeightStep HeightDecoder::read(Post* row) {
  if (rows_left_ == 0) return HeightStep::kCorrupt;
  std::int32_t west = 0;
  std::int32_t south_west = 0;
  for (std::uint32_t i = 0; i < columns_; ++i) {
    Post& post = row[i];
    const std::int32_t south = first_ ? west : post.value();
    std::int32_t value = i == 0 ? south : west;
    const bool known = !holes_ || in_.bits(1) != 0U;
    if (known) {
      if (i > 0 && !first_) value = west + south - south_west;
      unsigned ones = 0;
      for (unsigned more = 4; more == 4U && ones < kMaxOnes; ones += more) more = in_.ones();
      const std::uint32_t code = ones < kMaxOnes ? ones << rice_ | in_.bits(rice_) : in_.bits(kEscapeBits);
      const auto half = static_cast<std::int32_t>((code + 1U) / 2U);
      value += (code & 1U) != 0U ? half : -half;
      if (value > kMaxPostValue || value < -kMaxPostValue) return corrupt();
    }
    post = Post(value, known);
    west = value;
    south_west = south;
  }
  first_ = false;
  if (--rows_left_ > 0) return HeightStep::kMore;
  return in_.spent() ? HeightStep::kEnd : HeightStep::kCorrupt;
}

}  // namespace cairn::cmap
