/// What a forecast promised of a drive, beside what came: without truth nothing else tells of a wrong map.
///
/// Each fix that the run tried has the probability of the forecast's station nearest to it, in distance
/// driven (VO's, which a wrong fix does not change); one farther from all stations than they are from one
/// another is beyond the forecast, and not counted. The number of fixes applied is then Poisson-binomial
/// (base/event_count.hpp), and P(as few, or fewer) tells how often a drive with the right map and start has
/// so few. That takes the fixes as independent; drives on which the rover finds fewer boulders than usual
/// have fewer altogether: small probabilities are larger in truth, and the limit is one in a thousand.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace cairn::ground {

/// A fix that was forecast.
struct ExpectedFix {
  double distance_m = 0.0;  ///< driven
  double applied = 0.0;     ///< probability
};
/// One that was tried.
struct TriedFix {
  double distance_m = 0.0;
  bool applied = false;
};

struct Expectation {
  std::size_t tried = 0;
  std::size_t beyond = 0;  ///< more of them, beyond the forecast
  double expected = 0.0;   ///< of those tried, to be applied
  std::size_t observed = 0;
  double so_few = 1.0;  ///< P(as many as observed, or fewer)

  static constexpr double kUnlikely = 1.0e-3;
  bool likely_wrong() const { return so_few < kUnlikely; }
};

/// `forecast` by distance, as a drive meets it; not empty.
Expectation expectation_of(const std::vector<ExpectedFix>& forecast, const std::vector<TriedFix>& tried);

/// What it means, for a reader who knows no truth: one or two sentences.
std::string words_of(const Expectation& e);

/// The forecast.csv of `cairn map forecast` (columns arc_m, p_applied). Throws ToolError: cannot be read, a
/// column missing, no row, no probability, distances that fall.
std::vector<ExpectedFix> read_forecast(const std::filesystem::path& path);

/// A search of the whole map that goes on over several corrections is one try, which counts with its end.
/// Puts `forecast` into the summary of a run folder's object (report/run_folder.hpp): file, tried, beyond,
/// expected, observed, probability_of_so_few, likely_wrong, words.
void set_against(const std::filesystem::path& path, const std::vector<ExpectedFix>& forecast,
                 nlohmann::ordered_json& run);

}  // namespace cairn::ground
