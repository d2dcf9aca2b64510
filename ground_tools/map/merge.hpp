/// Boulder maps of one site, joined into one.
#pragma once

#include <vector>

#include "base/boulder_table.hpp"

namespace cairn::ground {

/// A map that goes into a merger.
struct MergePart {
  std::vector<TableBoulder> boulders;
  double pixel_m = 0.0;  ///< of the orthoimage; 0 = unknown, which counts as coarser than any
};

/// Joins the parts. Boulders of different parts at most `within_m` apart are one, nearest pairs first;
/// boulders of the same part never are. Of those that are one, the entry of the highest confidence stands,
/// among equals that from the finest pixel, among these their mean; what it does not know (height, ground) is
/// the next one's in that order. A boulder that only one part has stays, also where others cover the place.
///
/// Sorted by y, then x. The parts may stand in any order: the same bits come out.
std::vector<TableBoulder> merge_boulders(const std::vector<MergePart>& parts, double within_m);

}  // namespace cairn::ground
