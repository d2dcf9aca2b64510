/// How far forecasts may be believed: what was forecast for each fix of a campaign beside what became of it.
///
/// Two events are looked at:
///   applied   the flight module made the correction, right or not;
///   right     and the pose was within 0.15 m of truth then (fix_verdict.hpp).
///
/// The Brier score is the mean of (forecast - outcome)^2; the base rate's is what one gets who says every
/// time how often the event happened in these very trials. Skill = 1 - score / base score: 1 is perfect, 0 no
/// better than the base rate (Brier 1950; Murphy 1973; Wilks, Statistical Methods in the Atmospheric
/// Sciences, chapter 8). Fixes of a drive share map and sun, so the interval of the skill comes from drawing
/// whole trials anew (bootstrap).
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "campaign/findings.hpp"
#include "campaign/trial_forecast.hpp"

namespace cairn::ground {

enum class FixEvent : std::uint8_t { kApplied, kRight };
inline constexpr std::array<FixEvent, 2> kFixEvents = {FixEvent::kApplied, FixEvent::kRight};
const char* name_of(FixEvent event);

struct ReliabilityBin {
  double low = 0.0;
  double high = 0.0;
  double forecast = 0.0;  ///< mean
  Share observed;
};

struct Reliability {
  std::vector<ReliabilityBin> bins;  ///< those that hold fixes
  std::size_t fixes = 0;
  double forecast = 0.0;  ///< mean
  Share observed;
  double brier = 0.0;
  double base_brier = 0.0;
  double skill = 0.0;  ///< NaN where the event happened always or never
  Interval skill_interval;
};

Reliability reliability_of(const std::vector<ForecastFix>& fixes, FixEvent event);

void print_reliability(const std::vector<TrialForecast>& trials, const ForecastModel& model);
nlohmann::ordered_json reliability_json(const std::vector<TrialForecast>& trials, const ForecastModel& model);
/// A line a fix.
std::string forecast_csv(const std::vector<TrialForecast>& trials);

}  // namespace cairn::ground
