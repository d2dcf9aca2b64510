/// Whether what a detector found looks like a field of boulders.
///
/// Its own larger ones are held against the law of Golombek and Rapp (1997): the share of the ground under
/// rocks of diameter D and more is
///   F(D) = k exp(-q D),   q = 1.79 + 0.152 / k,
/// so that their number per area is N(D) = integral from D of 4 k q exp(-q x) / (pi x^2). k is that of the
/// share under the larger quarter; `of_expected` is how many of all are there, over A N(D) with D the lower
/// twentieth of the diameters. A field of boulders has about 1; fewer where small ones escape the detector.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/boulder_table.hpp"

namespace cairn::ground {

struct MapQuality {
  std::size_t boulders = 0;
  std::size_t craters = 0;
  double area_m2 = 0.0;
  double k = 0.0;            ///< 0: too few boulders to tell, or more than the law has
  double of_expected = 0.0;  ///< 0 where k is
  /// Of the boulders, those nearer to a crater's middle than 1.5 of its radius.
  double share_near_craters = 0.0;
  /// And what that share were if boulders took no notice of craters: the ground's.
  double ground_near_craters = 0.0;

  double density_per_m2() const { return static_cast<double>(boulders) / area_m2; }
  /// What does not look like a field of boulders, a line each; empty where all does.
  std::vector<std::string> doubts() const;
};

/// Over `extent`, whose area must be positive. Time: boulders times craters.
MapQuality quality_of(const std::vector<TableBoulder>& boulders, const std::vector<TableBoulder>& craters,
                      const MapExtent& extent);

/// One line, without doubts.
std::string to_text(const MapQuality& quality);
nlohmann::ordered_json to_json(const MapQuality& quality);

}  // namespace cairn::ground
