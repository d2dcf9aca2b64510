/// The picture of a campaign.
#pragma once

#include <string>
#include <vector>

#include "campaign/trial_table.hpp"

namespace cairn::ground {

/// SVG. Above, how large a share of the drives ended within an error, VO alone and corrected, with VO as it
/// is and made worse; below, what became of fixes by map resolution. Asks for at least one trial.
std::string plot_findings(const std::vector<Trial>& trials);

}  // namespace cairn::ground
