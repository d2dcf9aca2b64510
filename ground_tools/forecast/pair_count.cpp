#include "forecast/pair_count.hpp"

#include <algorithm>

namespace cairn::ground {
namespace {

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

/// P(at least `least`), event `without` left out: only the states below `least` are carried.
double tail(const std::vector<double>& probabilities, std::size_t least, std::size_t without) {
  if (least == 0) return 1.0;
  std::vector<double> below(least, 0.0);
  below[0] = 1.0;
  double reached = 0.0;
  for (std::size_t i = 0; i < probabilities.size(); ++i) {
    if (i == without) continue;
    const double p = probabilities[i];
    reached += below[least - 1] * p;
    for (std::size_t k = least - 1; k > 0; --k) below[k] = below[k] * (1.0 - p) + below[k - 1] * p;
    below[0] *= 1.0 - p;
  }
  return reached;
}

}  // namespace

double at_least(const std::vector<double>& probabilities, std::size_t least) {
  return tail(probabilities, least, kNone);
}

std::vector<double> given_at_least(const std::vector<double>& probabilities, std::size_t least) {
  std::vector<double> given(probabilities.size(), 0.0);
  const double all = at_least(probabilities, least);
  if (!(all > 0.0)) return given;
  for (std::size_t i = 0; i < given.size(); ++i) {
    const double with = probabilities[i] * tail(probabilities, least > 0 ? least - 1 : 0, i);
    given[i] = std::min(1.0, with / all);
  }
  return given;
}

}  // namespace cairn::ground
