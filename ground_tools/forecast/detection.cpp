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

DetectionCurve curve_at(const Point& at) { return {at[0], std::exp(at[1]), std::exp(at[2]), 0.0}; }

double log_likelihood(const std::vector<Look>& looks, const DetectionCurve& curve, double shift) {
  double sum = 0.0;
  for (const Look& look : looks) {
    const double found = look.confidence * curve(look.diameter_m, shift);
    const double paired = 1.0 - (1.0 - found) * (1.0 - look.by_chance);
    sum += std::log(std::max(look.paired ? paired : 1.0 - paired, 1.0e-12));
  }
  return sum;
}

using Drives = std::vector<std::vector<Look>>;

/// Of all drives, each with its own shift of the log-odds.
double log_likelihood(const Drives& drives, const std::vector<double>& shifts, const Point& at) {
  DetectionCurve curve = curve_at(at);
  curve.spread = 1.0;
  double sum = 0.0;
  for (std::size_t i = 0; i < drives.size(); ++i) sum += log_likelihood(drives[i], curve, shifts[i]);
  return sum;
}

/// Hooke and Jeeves: along each axis both ways, half the step where nothing is better.
double climb(const Drives& drives, const std::vector<double>& shifts, Point& at) {
  double best = log_likelihood(drives, shifts, at);
  for (double step = 0.25; step > 1.0e-5;) {
    bool better = false;
    for (std::size_t axis = 0; axis < at.size(); ++axis) {
      for (const double way : {step, -step}) {
        Point next = at;
        next[axis] = std::clamp(next[axis] + way * (kHigh[axis] - kLow[axis]), kLow[axis], kHigh[axis]);
        const double value = log_likelihood(drives, shifts, next);
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

/// The shift of the log-odds that suits a drive best. Golden section; one look of a coin on each side
/// keeps it finite.
double best_shift(const std::vector<Look>& looks, DetectionCurve curve) {
  curve.spread = 1.0;
  const auto value = [&](double shift) {
    return log_likelihood(looks, curve, shift) - 2.0 * std::log(2.0 * std::cosh(0.5 * shift));
  };
  constexpr double kGolden = 0.61803398874989485;
  double low = -4.0;
  double high = 4.0;
  while (high - low > 1.0e-4) {
    const double left = high - kGolden * (high - low);
    const double right = low + kGolden * (high - low);
    (value(left) > value(right) ? high : low) = value(left) > value(right) ? right : left;
  }
  return 0.5 * (low + high);
}

}  // namespace

double DetectionCurve::operator()(double diameter_m, double shift) const {
  if (!(diameter_m > 0.0)) return 0.0;
  const double d = most / (1.0 + std::pow(half_m / diameter_m, power));
  const double factor = std::exp(spread * shift);
  return d * factor / (d * factor + 1.0 - d);
}

DetectionFit fit_detection(const Drives& drives) {
  DetectionFit fit;
  double with_looks = 0.0;
  for (const std::vector<Look>& drive : drives) {
    with_looks += drive.empty() ? 0.0 : 1.0;
    fit.looks += drive.size();
    fit.paired += static_cast<std::size_t>(
        std::count_if(drive.begin(), drive.end(), [](const Look& look) { return look.paired; }));
  }
  CAIRN_ASSERT(fit.looks > 0);
  fit.log_likelihood = -std::numeric_limits<double>::infinity();
  constexpr int kRounds = 6;
  for (const double half_m : {0.05, 0.15, 0.4}) {
    Point at = {0.7, std::log(half_m), std::log(3.0)};
    std::vector<double> shifts(drives.size(), 0.0);
    double value = climb(drives, shifts, at);
    for (int round = 0; round < kRounds && with_looks > 1.0; ++round) {
      double mean = 0.0;
      for (std::size_t i = 0; i < drives.size(); ++i) {
        shifts[i] = drives[i].empty() ? 0.0 : best_shift(drives[i], curve_at(at));
        mean += shifts[i] / with_looks;
      }
      for (std::size_t i = 0; i < drives.size(); ++i) shifts[i] -= drives[i].empty() ? 0.0 : mean;
      value = climb(drives, shifts, at);
    }
    if (value <= fit.log_likelihood) continue;
    fit.log_likelihood = value;
    fit.curve = curve_at(at);
    double squares = 0.0;
    for (const double shift : shifts) squares += shift * shift;
    fit.curve.spread = with_looks > 1.0 ? std::min(3.0, std::sqrt(squares / (with_looks - 1.0))) : 0.0;
  }
  return fit;
}

}  // namespace cairn::ground
