#include "core/exp_log.hpp"

#include <cstdint>
#include <cstring>
#include <limits>

namespace cairn {
namespace {

constexpr double kLn2High = 6.93147180369123816490e-01;  // upper 33 bits: k * kLn2High is exact
constexpr double kLn2Low = 1.90821492927058770002e-10;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::uint64_t bits_of(double x) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &x, sizeof bits);
  return bits;
}
double from_bits(std::uint64_t bits) {
  double x = 0.0;
  std::memcpy(&x, &bits, sizeof x);
  return x;
}

}  // namespace

double exp(double x) {
  if (!(x == x)) return x;
  if (x < -708.3) return 0.0;
  if (x > 709.7) return kInfinity;
  const double halves = x * 1.44269504088896338700 + (x >= 0.0 ? 0.5 : -0.5);
  const auto k = static_cast<std::int32_t>(halves);
  const double high = x - k * kLn2High;
  const double low = k * kLn2Low;
  const double r = high - low;
  // Taylor series on |r| <= ln(2)/2: the first term left out is below 5e-18. Even and odd terms apart: two
  // short chains take less time than a long one.
  const double r2 = r * r;
  double even = 1.0 / 87178291200.0;
  double odd = 1.0 / 6227020800.0;
  even = 1.0 / 479001600.0 + r2 * even;
  odd = 1.0 / 39916800.0 + r2 * odd;
  even = 1.0 / 3628800.0 + r2 * even;
  odd = 1.0 / 362880.0 + r2 * odd;
  even = 1.0 / 40320.0 + r2 * even;
  odd = 1.0 / 5040.0 + r2 * odd;
  even = 1.0 / 720.0 + r2 * even;
  odd = 1.0 / 120.0 + r2 * odd;
  even = 1.0 / 24.0 + r2 * even;
  odd = 1.0 / 6.0 + r2 * odd;
  even = 0.5 + r2 * even;
  const double s = even + r * odd;
  const double y = 1.0 + (high + (r2 * s - low));
  // k is -1022 ... 1024; y is in (0.7, 1.42). Two factors, so that each is a normal number.
  const std::int32_t half = k / 2;
  return y * from_bits(static_cast<std::uint64_t>(half + 1023) << 52U) *
         from_bits(static_cast<std::uint64_t>(k - half + 1023) << 52U);
}

double ln(double x) {
  constexpr std::uint64_t kMantissa = 0x000FFFFFFFFFFFFFULL;
  if (!(x == x) || x == kInfinity) return x;
  if (x < 0.0) return std::numeric_limits<double>::quiet_NaN();
  if (x < std::numeric_limits<double>::min()) return -kInfinity;
  const std::uint64_t bits = bits_of(x);
  auto k = static_cast<std::int32_t>(bits >> 52U) - 1023;
  double m = from_bits((bits & kMantissa) | 0x3FF0000000000000ULL);
  if (m > 1.41421356237309504880) {
    m *= 0.5;
    ++k;
  }
  // m = 1 + f in (0.707, 1.415]: ln m = 2 atanh(f / (2 + f)) = f - f^2/2 + y (f^2/2 + R), the first terms
  // apart so that their rounding does not count. |y| <= 0.1716; the term left out is below 1e-18.
  const double f = m - 1.0;
  const double y = f / (2.0 + f);
  const double y2 = y * y;
  const double y4 = y2 * y2;
  double even = 2.0 / 23.0;
  double odd = 2.0 / 21.0;
  even = 2.0 / 19.0 + y4 * even;
  odd = 2.0 / 17.0 + y4 * odd;
  even = 2.0 / 15.0 + y4 * even;
  odd = 2.0 / 13.0 + y4 * odd;
  even = 2.0 / 11.0 + y4 * even;
  odd = 2.0 / 9.0 + y4 * odd;
  even = 2.0 / 7.0 + y4 * even;
  odd = 2.0 / 5.0 + y4 * odd;
  even = 2.0 / 3.0 + y4 * even;
  const double s = y2 * (even + y2 * odd);
  const double half = 0.5 * f * f;
  return k * kLn2High - ((half - (y * (half + s) + k * kLn2Low)) - f);
}

}  // namespace cairn
