/// One trial: a site is made, mapped from above, driven over twice, and everything compared with truth.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>

#include "campaign/trial_table.hpp"
#include "campaign/trouble.hpp"

namespace cairn::ground {

struct TrialOptions {
  bool keep_ortho = false;
  bool coarser_maps = false;
  std::vector<Trouble> troubles;  ///< replays more, with the trial's own map
};

/// Pixels of the coarser maps over that of the trial's own; none above kCoarsest_m.
inline constexpr std::array<int, 3> kCoarser = {2, 5, 10};
inline constexpr double kCoarsest_m = 0.1001;
inline std::string coarser_name(int times) { return "x" + std::to_string(times); }

/// Carries out `trial.setup` and fills the rest. In `folder` it leaves scene.toml, site.cmap, fixes.csv and
/// seen.csv (local_maps.hpp): `cairn run --scene scene.toml --map site.cmap` does the first replay again. The
/// orthoimage goes once the map is made, unless `keep_ortho`. With `coarser_maps` the same drive is replayed
/// with coarser maps of the site, too, and folders x2, x5 and x10 hold the same files of each: a replay takes
/// a tenth of the time of a rendering, and coarse maps are where fixes fail. It is replayed under each of
/// `troubles`, too, and troubles.csv tells of that. A map without a boulder is no fault: all fixes are
/// declined then. Frames are rendered once and kept in memory, about 0.4 MB each. `progress` hears 0 to 1.
///
/// Not to be called twice at a time: the flight module is one static object.
void run_trial(Trial& trial, const std::filesystem::path& folder, const TrialOptions& wanted,
               const std::function<void(double)>& progress);

}  // namespace cairn::ground
