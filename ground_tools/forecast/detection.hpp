/// How surely the rover's own search finds a boulder of the map, by its diameter; and fitting that to drives.
///
/// A boulder of diameter D in the footprint is in the local map with probability
///   d(D) = most / (1 + (half / D)^power),
/// a logistic curve in log D: 0 for pebbles, `most` for large ones, half of that at D = half. D is what the
/// map says. What the map says of a boulder is true with its confidence c, so that it is found with c d(D).
#pragma once

#include <cstddef>
#include <vector>

namespace cairn::ground {

struct DetectionCurve {
  double most = 0.86;    ///< (0, 1]
  double half_m = 0.10;  ///< [0.005, 2]
  double power = 3.0;    ///< [0.5, 20]

  double operator()(double diameter_m) const;
};

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

/// The curve of greatest likelihood, pairs by chance allowed for: P(paired) = 1 - (1 - c d(D)) (1 -
/// by_chance). Found by a pattern search over the ranges above from several starts; asks for at least one
/// look.
DetectionFit fit_detection(const std::vector<Look>& looks);

}  // namespace cairn::ground
