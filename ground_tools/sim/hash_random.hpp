/// Random numbers without a state: a hash of (seed, stream, a, b). Whoever asks for the same numbers gets the
/// same answer, in any order, on any thread and machine. Different streams are independent.
///
/// The hash chains the finaliser of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014; constants of Stafford's
/// mix 13) over its arguments, so each of them, and their order, matters. Some 5 ns a call.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace cairn::ground::sim {

/// What a number is for. Users of different streams never share numbers. Add yours at the end: a changed
/// value changes every scene.
enum class Stream : std::uint64_t {
  kRelief = 1,
  kRipples,
  kTexture,
  kPatches,
  kRocks,
  kPebbles,
  kSlip,
  kNoise,
  kExposure,
  kDust,
  kOrtho,
  kCampaign,
  kTrouble,
  kCraters,
  kGravity,
  kHeading,
};

constexpr std::uint64_t mix(std::uint64_t x) {
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27U)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31U);
}

/// Continues a hash by one more number.
constexpr std::uint64_t chain(std::uint64_t h, std::uint64_t x) {
  return mix((h ^ x) + 0x9E3779B97F4A7C15ULL);
}

/// 64 random bits. Negative coordinates: cast from int64 to uint64.
constexpr std::uint64_t hash(std::uint64_t seed, Stream stream, std::uint64_t a = 0, std::uint64_t b = 0) {
  return chain(chain(chain(chain(0, seed), static_cast<std::uint64_t>(stream)), a), b);
}

/// In [0, 1), multiples of 2^-53.
constexpr double to_unit(std::uint64_t bits) { return static_cast<double>(bits >> 11U) * 0x1.0p-53; }

/// Uniform in [0, 1).
constexpr double uniform(std::uint64_t seed, Stream stream, std::uint64_t a = 0, std::uint64_t b = 0) {
  return to_unit(hash(seed, stream, a, b));
}

/// Normal deviate, mean 0, standard deviation 1 (Box and Muller).
inline double normal(std::uint64_t seed, Stream stream, std::uint64_t a = 0, std::uint64_t b = 0) {
  const std::uint64_t h = hash(seed, stream, a, b);
  return std::sqrt(-2.0 * std::log1p(-to_unit(h))) * std::cos(6.283185307179586 * to_unit(chain(h, 1)));
}

/// A stream's numbers one after the other, where there is an order: rock number `a` draws its size, its shape
/// and so on.
class Draw {
 public:
  constexpr Draw(std::uint64_t seed, Stream stream, std::uint64_t a = 0, std::uint64_t b = 0)
      : h_(hash(seed, stream, a, b)) {}

  constexpr std::uint64_t bits() { return chain(h_, ++count_); }
  constexpr double uniform() { return to_unit(bits()); }
  constexpr double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double normal() {
    const double u = uniform();
    return std::sqrt(-2.0 * std::log1p(-u)) * std::cos(6.283185307179586 * uniform());
  }

 private:
  std::uint64_t h_;
  std::uint64_t count_ = 0;
};

/// A number of a Poisson law of this mean: the normal approximation beyond 50.
inline std::size_t poisson(Draw& draw, double mean) {
  if (mean > 50.0)
    return static_cast<std::size_t>(std::max(0.0, std::round(mean + std::sqrt(mean) * draw.normal())));
  const double end = std::exp(-mean);
  std::size_t n = 0;
  for (double p = draw.uniform(); p > end; p *= draw.uniform()) ++n;
  return n;
}

}  // namespace cairn::ground::sim
