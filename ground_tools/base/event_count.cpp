#include "base/event_count.hpp"

#include <algorithm>
#include <numeric>

namespace cairn::ground {
namespace {

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

/// P(k events) for each k below `states`, event `without` left out, and P(`states` and more).
struct Counts {
  std::vector<double> below;
  double reached = 0.0;
};

Counts count(const std::vector<double>& probabilities, std::size_t states, std::size_t without) {
  Counts counts{std::vector<double>(states, 0.0)};
  std::vector<double>& below = counts.below;
  below[0] = 1.0;
  for (std::size_t i = 0; i < probabilities.size(); ++i) {
    if (i == without) continue;
    const double p = probabilities[i];
    counts.reached += below[states - 1] * p;
    for (std::size_t k = states - 1; k > 0; --k) below[k] = below[k] * (1.0 - p) + below[k - 1] * p;
    below[0] *= 1.0 - p;
  }
  return counts;
}

double tail(const std::vector<double>& probabilities, std::size_t least, std::size_t without) {
  return least == 0 ? 1.0 : count(probabilities, least, without).reached;
}

}  // namespace

double at_least(const std::vector<double>& probabilities, std::size_t least) {
  return tail(probabilities, least, kNone);
}

double at_most(const std::vector<double>& probabilities, std::size_t most) {
  if (most >= probabilities.size()) return 1.0;
  const std::vector<double> below = count(probabilities, most + 1, kNone).below;
  return std::accumulate(below.begin(), below.end(), 0.0);
}

std::vector<double> distribution(const std::vector<double>& probabilities) {
  return count(probabilities, probabilities.size() + 1, kNone).below;
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
