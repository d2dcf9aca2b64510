/// What a campaign found: its table and `summary.json`.
///
/// Medians are over drives, with order-statistics intervals; shares are of all fixes that were tried, with
/// Wilson's. The latter take fixes as independent; those of one drive share a map and a sun, so that the
/// truth may lie a little wider.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/statistics.hpp"
#include "campaign/trial_table.hpp"

namespace cairn::ground {

struct Share {
  std::size_t hits = 0;
  std::size_t of = 0;
  double value() const { return of == 0 ? 0.0 : static_cast<double>(hits) / static_cast<double>(of); }
  Interval interval() const { return wilson(hits, of); }
};

/// Of some replays.
struct RunFindings {
  Median vo_end_xy_m, vo_end_xy_percent, vo_end_3d_percent, vo_end_yaw_deg;  ///< yaws without sign
  Median end_xy_m, largest_xy_m, end_yaw_deg, excess_over_vo_m, median_fix_error_m;
  std::array<Share, kFixVerdicts> fixes;
};

/// Of some trials.
struct Findings {
  double map_pixel_m = 0.0;  ///< 0: of all
  std::size_t trials = 0;
  Median map_boulders;
  RunFindings as_it_is, worse;
};

Findings findings_of(const std::vector<Trial>& trials);
/// By map resolution, the finest first; only those that there are.
std::vector<Findings> findings_by_map(const std::vector<Trial>& trials);

/// To stdout.
void print_findings(const std::vector<Trial>& trials);
nlohmann::ordered_json findings_json(const std::vector<Trial>& trials);

}  // namespace cairn::ground
