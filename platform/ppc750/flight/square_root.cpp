// sqrt and sqrtf, correctly rounded, for a processor that has no such instruction but has a fused
// multiply-add. Some 100 cycles; the C library's, which goes bit by bit, takes 976 instructions. Being
// correctly rounded, it agrees with the instruction of the other targets in every bit. Part of the flight
// library on this target.
//
// With x = m 4^k, 1 <= m < 4: an estimate of 1 / sqrt(m) from the bits of m (within 3.5 %), four steps of
// Newton-Raphson (3.5e-2, 1.8e-3, 4.8e-6, 3.5e-11, then rounding errors alone), one of Heron for sqrt(m),
// which leaves it within an ulp; Tuckerman's test then tells which of the three neighbours is the rounded
// root. (P. Markstein, "Computation of elementary functions on the IBM RISC System/6000 processor", IBM J.
// Res. Dev. 34, 1990.)
#include <cstdint>
#include <cstring>

namespace {

std::uint64_t bits_of(double x) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &x, sizeof bits);
  return bits;
}

double of_bits(std::uint64_t bits) {
  double x = 0.0;
  std::memcpy(&x, &bits, sizeof x);
  return x;
}

constexpr std::uint32_t kBias = 1023;
constexpr double kUlp = 0x1p-52;  // of numbers from 1 to 2

/// m from 1 to below 4.
double root_of_mantissa(double m, std::uint32_t m_high) {
  const double half = 0.5 * m;
  double y = of_bits(static_cast<std::uint64_t>(0x5FE6EB50U - (m_high >> 1U)) << 32U);
  for (int i = 0; i < 4; ++i) y *= __builtin_fma(-half * y, y, 1.5);
  double s = m * y;
  s = __builtin_fma(__builtin_fma(-s, s, m), 0.5 * y, s);
  if (__builtin_fma(-s, s + kUlp, m) > 0.0) return s + kUlp;
  if (__builtin_fma(-s, s - kUlp, m) <= 0.0) return s - kUlp;
  return s;
}

}  // namespace

extern "C" double sqrt(double x) {
  std::uint64_t bits = bits_of(x);
  auto high = static_cast<std::uint32_t>(bits >> 32U);
  std::uint32_t bias = kBias;
  if (high - 0x00100000U >= 0x7FF00000U - 0x00100000U) {  // not a positive normal number
    if (x == 0.0 || x != x) return x;
    if (x < 0.0) return (x - x) / (x - x);
    if (high >= 0x7FF00000U) return x;
    bits = bits_of(x * 0x1p54);
    high = static_cast<std::uint32_t>(bits >> 32U);
    bias = kBias + 54;
  }
  const std::uint32_t exponent = (high >> 20U) + 2048U - bias;  // of x, above by an even number
  const std::uint32_t m_high = (high & 0x000FFFFFU) | (kBias + (exponent & 1U)) << 20U;
  const double s =
      root_of_mantissa(of_bits(static_cast<std::uint64_t>(m_high) << 32U | (bits & 0xFFFFFFFFU)), m_high);
  const std::uint64_t scale = static_cast<std::uint64_t>(exponent / 2U - 1024U + kBias) << 52U;
  return s * of_bits(scale);
}

// 53 bits are more than twice 24 and two: rounding twice is rounding once.
extern "C" float sqrtf(float x) { return static_cast<float>(sqrt(static_cast<double>(x))); }
