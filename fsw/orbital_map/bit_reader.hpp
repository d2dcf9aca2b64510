/// Bits of a byte range, the most significant of each byte first. Reads beyond the end give zeros and are
/// counted, so that decoding needs no test at each bit: `spent()` tells at the end.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/big_endian.hpp"

namespace cairn::cmap {

class BitReader {
 public:
  BitReader() = default;
  BitReader(const std::uint8_t* next, const std::uint8_t* end) : next_(next), end_(end) {}

  /// The ones before the next zero, at most 4: the zero is read, too, where there are fewer.
  unsigned ones() {
    if (held_ < 5U) refill();
    const unsigned count = kOnes[buffer_ >> 28U];
    const unsigned read = count < 4U ? count + 1U : 4U;
    buffer_ <<= read;
    held_ -= read;
    return count;
  }
  /// The next `count` bits, 0 to 31.
  std::uint32_t bits(unsigned count) {
    std::uint32_t high = 0;
    if (count > kSurelyHeld) {
      high = bits_held(16);
      count -= 16U;
    }
    return count == 0 ? high : high << count | bits_held(count);
  }
  /// A number below `values` (at least 1, at most 2^28): with k = floor(log2 values), the first
  /// 2^(k + 1) - values numbers take k bits, the others one more.
  [[gnu::always_inline]] std::uint32_t truncated(std::uint32_t values, unsigned k) {
    const std::uint32_t shorter = (2U << k) - values;
    if (k >= kSurelyHeld) {
      const std::uint32_t value = bits(k);
      return value < shorter ? value : value + value - shorter + bits(1);
    }
    if (held_ <= k) refill();
    const std::uint32_t longer = buffer_ >> (31U - k);  // k + 1 bits
    const bool is_short = longer >> 1U < shorter;
    const unsigned read = is_short ? k : k + 1U;
    buffer_ <<= read;
    held_ -= read;
    return is_short ? longer >> 1U : longer - shorter;
  }
  /// All bits were read but those that fill the last byte, which are zero; and none beyond.
  bool spent() const { return next_ == end_ && held_ - beyond_ < 8U && buffer_ == 0U; }

 private:
  static constexpr unsigned kSurelyHeld = 24;
  static constexpr std::uint8_t kOnes[16] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 3, 4};

  std::uint32_t bits_held(unsigned count) {
    if (held_ < count) refill();
    const std::uint32_t value = buffer_ >> (32U - count);
    buffer_ <<= count;
    held_ -= count;
    return value;
  }
  /// To 24 bits or more, from 23 or fewer. Behind those that count the buffer may hold the same bits that it
  /// is given again.
  void refill() {
    if (end_ - next_ >= 4) {
      const std::uint32_t bytes = (31U - held_) >> 3U;
      buffer_ |= be::get_u32(next_) >> held_;
      next_ += bytes;
      held_ += 8U * bytes;
      return;
    }
    for (; held_ < kSurelyHeld; held_ += 8U) {
      if (next_ != end_) {
        buffer_ |= static_cast<std::uint32_t>(*next_++) << (24U - held_);
      } else {
        beyond_ += 8U;
      }
    }
  }

  const std::uint8_t* next_ = nullptr;
  const std::uint8_t* end_ = nullptr;
  std::uint32_t buffer_ = 0;  ///< the next bits, left-aligned
  unsigned held_ = 0;         ///< bits of it that count
  unsigned beyond_ = 0;       ///< of these, zeros from beyond the end
};

}  // namespace cairn::cmap
