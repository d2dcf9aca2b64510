/// Random numbers for tests: uniform and normal deviates from the project's own generator.
#pragma once

#include <cmath>

#include "core/random.hpp"
#include "core/trig.hpp"

namespace cairn::test {

/// Uniform in [low, high).
inline double uniform(Random& random, double low, double high) {
  return low + (high - low) * (random.next() / 4294967296.0);
}

/// Normal deviate, mean 0, standard deviation 1 (Box and Muller).
inline double normal(Random& random) {
  const double u = (random.next() + 0.5) / 4294967296.0;
  return std::sqrt(-2.0 * std::log(u)) * std::cos(uniform(random, 0.0, 2.0 * kPi));
}

}  // namespace cairn::test
