#include "forecast/detection.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/assert.hpp"

namespace cairn::ground {
namespace {

/// most, ln half, ln power.
using Point = std::array<double, 3>;
const Point kLow = {0.02, std::log(0.005), std::log(0.5)};
const Point kHigh = {1.0, std::log(2.0), std::log(20.0)};

DetectionCurve curve_at(const Point& at) { return {at[0], std::exp(at[1]), std::exp(at[2])}; }

double log_likelihood(const std::vector<Look>& looks, const Point& at) {
  const DetectionCurve curve = curve_at(at);
  double sum = 0.0;
  for (const Look& look : looks) {
    const double paired = 1.0 - (1.0 - look.confidence * curve(look.diameter_m)) * (1.0 - look.by_chance);
    sum += std::log(std::max(look.paired ? paired : 1.0 - paired, 1.0e-12));
  }
  return sum;
}

/// Hooke and Jeeves: along each axis both ways, half the step where nothing is better.
double climb(const std::vector<Look>& looks, Point& at) {
  double best = log_likelihood(looks, at);
  for (double step = 0.25; step > 1.0e-5;) {
    bool better = false;
    for (std::size_t axis = 0; axis < at.size(); ++axis) {
      for (const double way : {step, -step}) {
        Point next = at;
        next[axis] = std::clamp(next[axis] + way * (kHigh[axis] - kLow[axis]), kLow[axis], kHigh[axis]);
        const double value = log_likelihood(looks, next);
        if (value <= best) continue;
        best = value;
        at = next;
        better = true;
      }
    }
    if (!better) step *= 0.5;
  }
  return best;
}

}  // namespace

double DetectionCurve::operator()(double diameter_m) const {
  if (!(diameter_m > 0.0)) return 0.0;
  return most / (1.0 + std::pow(half_m / diameter_m, power));
}

DetectionFit fit_detection(const std::vector<Look>& looks) {
  CAIRN_ASSERT(!looks.empty());
  DetectionFit fit;
  fit.looks = looks.size();
  fit.paired = static_cast<std::size_t>(
      std::count_if(looks.begin(), looks.end(), [](const Look& look) { return look.paired; }));
  fit.log_likelihood = -std::numeric_limits<double>::infinity();
  for (const double half_m : {0.05, 0.15, 0.4}) {
    Point at = {0.7, std::log(half_m), std::log(3.0)};
    const double value = climb(looks, at);
    if (value <= fit.log_likelihood) continue;
    fit.log_likelihood = value;
    fit.curve = curve_at(at);
  }
  return fit;
}

}  // namespace cairn::ground
