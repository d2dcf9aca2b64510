/// One trial: a site is made, mapped from above, driven over twice, and everything compared with truth.
#pragma once

#include <filesystem>
#include <functional>

#include "campaign/trial_table.hpp"

namespace cairn::ground {

/// Carries out `trial.setup` and fills the rest. In `folder` it leaves scene.toml, site.cmap, fixes.csv and
/// seen.csv (local_maps.hpp):
/// `cairn run --scene scene.toml --map site.cmap` does the first replay again. The orthoimage goes once the
/// map is made, unless `keep_ortho`. A map without a boulder is no fault: all fixes are declined then. Frames
/// are rendered once and kept in memory for the second replay, about 0.4 MB each. `progress` hears 0 to 1.
///
/// Not to be called twice at a time: the flight module is one static object.
void run_trial(Trial& trial, const std::filesystem::path& folder, bool keep_ortho,
               const std::function<void(double)>& progress);

}  // namespace cairn::ground
