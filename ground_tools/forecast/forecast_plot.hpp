/// The picture of a forecast.
#pragma once

#include <string>

#include "forecast/forecast.hpp"
#include "forecast/forecast_files.hpp"

namespace cairn::ground {

/// SVG: the drive from above with the map's boulders near it, its fixes by their probability, their ellipses
/// (drawn larger, the legend tells by how much) and the blind stretches; below, probabilities and errors over
/// the arc length.
std::string plot_forecast(const Forecast& made, const ForecastModel& model,
                          const std::vector<TableBoulder>& boulders, const std::vector<PathPoint>& drive,
                          const ForecastSource& source);

}  // namespace cairn::ground
