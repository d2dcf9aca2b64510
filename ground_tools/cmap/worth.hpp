/// Which boulders of a corridor can be spared: those whose loss costs the fixes of the drive least.
///
/// Along the path stands a station each kStation_m, a fix from what was seen on the way to it. At station i
/// boulder j is expected in the local map with
///   p_ij = found(j) * (share of the stretch on which it is in view, allowing for drift across the path),
/// and a fix there has the expected number of pairs n_i = sum_j p_ij. Its error goes with 1 / sqrt(n_i), and
/// below some kProofPairs it has no proof and is none, so that the drive is worth less
///   loss = sum_i ((n_i + 1)^-1/2 + (kProofPairs / (n_i + 1))^4) / (1 + s_i / length),
/// far stretches less than near ones, since they can be sent later. Boulders are taken away one by one, each
/// time that of the least further loss; their order backwards is that of their worth.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "cmap/corridor.hpp"

namespace cairn::ground {

inline constexpr double kStation_m = 1.0;
inline constexpr double kProofPairs = 8.0;  ///< at the usual densities: doc/RESULTS.md, proof of a fix

/// Indices into `reached`, of most worth first. `found`: probability that the rover finds a boulder that it
/// passes in full view.
std::vector<std::size_t> by_worth(const std::vector<CorridorBoulder>& reached, const PlannedPath& path,
                                  const CorridorParams& params,
                                  const std::function<double(const TableBoulder&)>& found);

}  // namespace cairn::ground
