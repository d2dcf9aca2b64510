/// A smooth random texture that can be looked up anywhere: a sum of waves of random direction and phase.
#pragma once

#include "support/noise.hpp"

namespace cairn::test {

class Waves {
 public:
  static constexpr int kCount = 24;

  /// Wave lengths between `shortest` and `longest` px; standard deviation `contrast`, mean 0.
  Waves(std::uint64_t seed, double shortest, double longest, double contrast) {
    Random random(seed);
    for (Wave& w : waves_) {
      const double k = 2.0 * kPi / uniform(random, shortest, longest);
      const double direction = uniform(random, 0.0, 2.0 * kPi);
      w = {k * std::cos(direction), k * std::sin(direction), uniform(random, 0.0, 2.0 * kPi)};
    }
    amplitude_ = contrast * std::sqrt(2.0 / kCount);
  }

  double at(double u, double v) const {
    double sum = 0.0;
    for (const Wave& w : waves_) sum += std::sin(w.ku * u + w.kv * v + w.phase);
    return amplitude_ * sum;
  }

 private:
  struct Wave {
    double ku, kv, phase;
  };
  Wave waves_[kCount];
  double amplitude_;
};

}  // namespace cairn::test
