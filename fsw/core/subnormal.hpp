/// Subnormal numbers are refused where they could come in. They are told by their bits: a comparison would
/// stop some floating-point units, and see a zero on others.
#pragma once

#include <cstdint>
#include <cstring>

namespace cairn {

inline bool is_subnormal(double x) {
  constexpr std::uint64_t kExponent = 0x7FF0000000000000ULL;
  constexpr std::uint64_t kFraction = 0x000FFFFFFFFFFFFFULL;
  std::uint64_t bits = 0;
  std::memcpy(&bits, &x, sizeof bits);
  return (bits & kExponent) == 0 && (bits & kFraction) != 0;
}

}  // namespace cairn
