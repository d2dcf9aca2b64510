/// A replay in numbers: the table that is printed, and `summary.json`.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/boulder_table.hpp"
#include "dataset/dataset.hpp"
#include "replay/replay.hpp"

namespace cairn::ground {

/// What was run.
struct RunTitle {
  std::string dataset;
  std::string map;           ///< file; empty: none
  double map_pixel_m = 0.0;  ///< of the orthoimage that the map was made from; 0: not known
  std::string variant = "cairn";
  std::string degrade;  ///< as given; empty: VO as it is
  std::filesystem::path ortho;
  std::vector<TableBoulder> orbital;   ///< the map's
  std::vector<TruthRock> truth_rocks;  ///< empty: not known
};

struct RunErrors {
  std::optional<TrajectoryErrors> vo;  ///< both or none
  std::optional<TrajectoryErrors> corrected;
};
RunErrors errors_of(const Replay& replay);

/// The largest amount by which the corrected error in x, y exceeds that of VO alone; 0 where it never does.
double largest_excess(const TrajectoryErrors& vo, const TrajectoryErrors& corrected);

nlohmann::ordered_json summary_json(const RunTitle& title, const Replay& replay, const RunErrors& errors);

/// To stdout.
void print_table(const Replay& replay, const RunErrors& errors);

}  // namespace cairn::ground
