/// How surely the rover's own search finds a boulder of the map, by its diameter; and fitting that to drives.
///
/// A boulder of diameter D in the footprint is in the local map with probability
///   d(D) = most / (1 + (half / D)^power),
/// a logistic curve in log D: 0 for pebbles, `most` for large ones, half of that at D = half. D is what the
/// map says. Drives differ (light, texture, what the map takes for boulders): in each, the log-odds of all
/// d(D) are shifted by the same amount, which nobody knows before; over drives it is normal with standard
/// deviation `spread`. What the map says of a boulder is true with its confidence c, so that it is found
/// with c d(D).
#pragma once

#include <cstddef>
#include <vector>

namespace cairn::ground {

struct DetectionCurve {
  double most = 0.86;     ///< (0, 1]
  double half_m = 0.083;  ///< [0.005, 2]
  double power = 8.5;     ///< [0.5, 20]
  double spread = 0.66;   ///< [0, 3]

  /// d(D) of a drive with that shift of the log-odds, in units of `spread`.
  double operator()(double diameter_m, double shift = 0.0) const;
};

/// The normal distribution of the shift in a few points, exact for polynomials to degree 13 (Gauss and
/// Hermite; Abramowitz and Stegun, table 25.10).
struct ShiftNode {
  double shift;
  double weight;
};
inline constexpr ShiftNode kShiftNodes[] = {
    {-3.7504397177257425, 5.4826885597221781e-4}, {-2.3667594107345412, 3.0757123967586498e-2},
    {-1.1544053947399680, 0.24012317860501272},   {0.0, 0.45714285714285713},
    {1.1544053947399680, 0.24012317860501272},    {2.3667594107345412, 3.0757123967586498e-2},
    {3.7504397177257425, 5.4826885597221781e-4}};

/// A boulder of the map that was in a footprint, and what came of it.
struct Look {
  double diameter_m = 0.0;
  double confidence = 1.0;
  double by_chance = 0.0;  ///< probability of a pair with something else than this boulder
  bool paired = false;     ///< something of the local map lay within the gate
};

struct DetectionFit {
  DetectionCurve curve;
  double log_likelihood = 0.0;
  std::size_t looks = 0;
  std::size_t paired = 0;
};

/// The curve of greatest likelihood for the looks of some drives, pairs by chance allowed for:
///   P(paired) = 1 - (1 - c d(D)) (1 - by_chance)
/// By turns the curve is found by a pattern search over the ranges above (from several starts), and for each
/// drive the shift of the log-odds that suits it best, less their mean; `spread` is the standard deviation of
/// those, 0 for a single drive. Asks for at least one look in all.
DetectionFit fit_detection(const std::vector<std::vector<Look>>& drives);

}  // namespace cairn::ground
