/// The parameters of a forecast that drives tell, as JSON: `cairn campaign` writes those that its drives ask
/// for, `cairn map forecast --model` takes them.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "forecast/forecast.hpp"

namespace cairn::ground {

/// {"detection": {"most", "half_m", "power", "spread"}, "clutter_per_m2", "sigma_pair_m", "sigma_common_m"}
nlohmann::ordered_json model_json(const ForecastModel& model);

/// Takes what is in the file into `model`; what is not there stays. Throws ToolError: not JSON, an unknown
/// key, a value that is no number or out of range.
void read_model(const std::filesystem::path& path, ForecastModel& model);

/// Throws ToolError (led by `whose`) where a parameter is out of its range.
void check_model(const ForecastModel& model, const std::string& whose);

}  // namespace cairn::ground
