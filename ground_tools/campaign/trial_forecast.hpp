/// What a trial of a campaign says of the forecast: its fixes beside what was forecast for each, and what the
/// local maps say of the model's parameters.
///
/// The forecast (forecast/forecast.hpp) is run on the trial's map and true path; it knows nothing of the
/// images. Both replays of a trial, VO as it is and made worse, are fixes of their own with one forecast.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "campaign/fix_verdict.hpp"
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

/// Parameters that fit the drives best; the others are those of `model`.
ForecastModel fitted(const ForecastModel& model, const std::vector<TrialForecast>& trials);

}  // namespace cairn::ground
