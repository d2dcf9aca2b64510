/// Deterministic pseudo-random numbers (PCG-style 64-bit LCG with xorshift output) for RANSAC sampling.
/// The same seed gives the same sequence on every target. Not for cryptography.
#pragma once

#include <cstdint>

namespace cairn {

class Random {
 public:
  explicit constexpr Random(std::uint64_t seed = 1) : state_(seed * 2U + 1U) {}

  std::uint32_t next() {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    const auto x = static_cast<std::uint32_t>(((state_ >> 18U) ^ state_) >> 27U);
    const auto rot = static_cast<std::uint32_t>(state_ >> 59U);
    return (x >> rot) | (x << ((32U - rot) & 31U));
  }
  /// Uniform in 0 .. bound-1, without the modulo's bias that matters (bound < 2^16 here).
  std::uint32_t below(std::uint32_t bound) {
    return static_cast<std::uint32_t>((static_cast<std::uint64_t>(next()) * bound) >> 32U);
  }

 private:
  std::uint64_t state_;
};

}  // namespace cairn
