/// How far forecasts may be believed: what was forecast for each fix of a campaign beside what became of it.
///
/// The forecast (forecast/forecast.hpp) is run on each trial's map and true path; it knows nothing of the
/// images. Both replays of a trial, VO as it is and made worse, are fixes of their own with the same
/// forecast. Two events are looked at:
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
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "campaign/findings.hpp"
#include "forecast/forecast.hpp"

namespace cairn::ground {

/// One fix of a campaign.
struct ForecastFix {
  std::uint64_t seed = 0;
  std::string vo;  ///< as_it_is or worse
  FixStation forecast;
  bool applied = false;
  FixVerdict verdict = FixVerdict::kDeclined;
  double after_m = 0.0;  ///< error of the pose after it
};

/// What the drives say of the model's parameters.
struct DriveEvidence {
  std::vector<TableBoulder> boulders;  ///< of the map
  MapExtent extent;
  std::vector<Look> looks;       ///< one a map boulder and snapshot
  double swept_m2 = 0.0;         ///< ground of footprints farther than the gate from every boulder of the map
  std::size_t clutter = 0;       ///< local boulders on it
  std::vector<double> pair_m;    ///< residuals of pairs, the mean of their trial taken off, per axis
  std::vector<double> common_m;  ///< those means, per axis
};

/// The places of local boulders as the rover saw them from its true pose (local_maps.hpp), by replay and
/// frame of the snapshot.
using LocalMaps = std::map<std::pair<std::string, std::size_t>, std::vector<Vec2>>;

DriveEvidence evidence_of(const ForecastModel& model, const std::vector<TableBoulder>& boulders,
                          const std::vector<PathPoint>& drive, const LocalMaps& snapshots);

struct TrialForecast {
  std::vector<ForecastFix> fixes;
  DriveEvidence evidence;
};

/// Of the trial in `folder` (scene.toml, site.cmap, fixes.csv; evidence where there is seen.csv); nothing
/// where one is missing. Throws ToolError where one is damaged.
std::optional<TrialForecast> forecast_trial(const ForecastModel& model, const std::filesystem::path& folder,
                                            std::uint64_t seed);

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

/// Parameters that fit the drives best; the others are those of `model`.
ForecastModel fitted(const ForecastModel& model, const std::vector<TrialForecast>& trials);

void print_reliability(const std::vector<TrialForecast>& trials, const ForecastModel& model);
nlohmann::ordered_json reliability_json(const std::vector<TrialForecast>& trials, const ForecastModel& model);
/// A line a fix.
std::string forecast_csv(const std::vector<TrialForecast>& trials);

}  // namespace cairn::ground
