/// The picture of a campaign's forecasts.
#pragma once

#include <string>
#include <vector>

#include "campaign/reliability.hpp"

namespace cairn::ground {

/// SVG: for each event the observed frequency over the forecast probability, with 95 % intervals, the
/// diagonal and the base rate; below, how many fixes each forecast got.
std::string plot_reliability(const std::vector<TrialForecast>& trials);

}  // namespace cairn::ground
