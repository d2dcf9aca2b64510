#include "report/expectation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/event_count.hpp"
#include "base/number_table.hpp"
#include "base/tool_error.hpp"

namespace cairn::ground {
namespace {

using nlohmann::ordered_json;

/// How far apart stations are at most, or 1 m where there is one alone.
double widest_gap_m(const std::vector<ExpectedFix>& forecast) {
  double gap = forecast.size() > 1 ? 0.0 : 1.0;
  for (std::size_t i = 1; i < forecast.size(); ++i)
    gap = std::max(gap, forecast[i].distance_m - forecast[i - 1].distance_m);
  return gap;
}

/// "1 in 40", "9 of 10".
std::string how_often(double p) {
  if (p < 1.0e-12) return "less than 1 in a million million";
  if (p < 0.1) return fmt::format("about 1 in {:.0f}", std::round(1.0 / p));
  return fmt::format("about {:.0f} of 100", 100.0 * p);
}

/// Metres that VO drove to each frame.
std::vector<double> driven(const ordered_json& path) {
  std::vector<double> distance;
  for (std::size_t i = 0; i + 1 < path.size(); i += 2) {
    const auto step = [&](std::size_t axis) {
      return path[i + axis].get<double>() - path[i - 2 + axis].get<double>();
    };
    distance.push_back(i == 0 ? 0.0 : distance.back() + std::hypot(step(0), step(1)));
  }
  return distance;
}

}  // namespace

Expectation expectation_of(const std::vector<ExpectedFix>& forecast, const std::vector<TriedFix>& tried) {
  Expectation e;
  std::vector<double> probabilities;
  const double reach_m = widest_gap_m(forecast);
  for (const TriedFix& fix : tried) {
    const auto far = [&](const ExpectedFix& f) { return std::fabs(f.distance_m - fix.distance_m); };
    const ExpectedFix& nearest =
        *std::min_element(forecast.begin(), forecast.end(),
                          [&](const ExpectedFix& a, const ExpectedFix& b) { return far(a) < far(b); });
    if (far(nearest) > reach_m) {
      ++e.beyond;
      continue;
    }
    probabilities.push_back(nearest.applied);
    e.expected += nearest.applied;
    e.observed += fix.applied ? 1 : 0;
  }
  e.tried = probabilities.size();
  e.so_few = at_most(probabilities, e.observed);
  return e;
}

std::string words_of(const Expectation& e) {
  if (e.tried == 0) return "This run tried no fix where the forecast has one, so that nothing can be told.";
  const std::string counts =
      fmt::format("Of {} tries to correct the position the forecast expected {:.1f} to be used, and {} {}. ",
                  e.tried, e.expected, e.observed, e.observed == 1 ? "was" : "were");
  if (e.likely_wrong()) {
    return counts + fmt::format(
                        "With the right map and start, {} such drives would have so few: the map or "
                        "the start is likely wrong. Do not rely on this drive's positions before that "
                        "is cleared up.",
                        how_often(e.so_few));
  }
  return counts + fmt::format("With the right map and start, {} such drives would have so few or fewer: {}.",
                              how_often(e.so_few),
                              e.so_few < 0.05 ? "that is seldom, and worth a look at map and start"
                                              : "nothing here speaks against map or start");
}

std::vector<ExpectedFix> read_forecast(const std::filesystem::path& path) {
  const char* const mend = "run `cairn map forecast` again";
  const CsvTable table(path, mend);
  const std::size_t arc = table.column("arc_m");
  const std::size_t applied = table.column("p_applied");
  std::vector<ExpectedFix> forecast;
  for (std::size_t row = 0; row < table.size(); ++row) {
    const ExpectedFix fix{table.number(row, arc), table.number(row, applied)};
    const double least = forecast.empty() ? 0.0 : forecast.back().distance_m;
    if (!(fix.applied >= 0.0 && fix.applied <= 1.0 && fix.distance_m >= least)) {
      throw ToolError("{}:{}: is no probability at a distance driven; {}", path.string(), table.line(row),
                      mend);
    }
    forecast.push_back(fix);
  }
  if (forecast.empty()) throw ToolError("{}: forecasts no fix; {} with a longer path", path.string(), mend);
  return forecast;
}

void set_against(const std::filesystem::path& path, const std::vector<ExpectedFix>& forecast,
                 ordered_json& run) {
  const std::vector<double> distance_m = driven(run.at("paths").at("vo"));
  const ordered_json& fixes = run.at("fixes");
  std::vector<TriedFix> tried;
  for (std::size_t i = 0; i < fixes.at("snapshot").size(); ++i) {
    const auto snapshot = fixes.at("snapshot").at(i).get<std::size_t>();  // counted from 1
    if (snapshot < 1 || snapshot > distance_m.size()) continue;
    const bool goes_on = fixes.at("status").at(i) == "unfinished" && i + 1 < fixes.at("snapshot").size();
    if (goes_on) continue;
    tried.push_back({distance_m[snapshot - 1], fixes.at("status").at(i) == "applied"});
  }
  const Expectation e = expectation_of(forecast, tried);
  run["summary"]["forecast"] = {{"file", path.string()},
                                {"tried", e.tried},
                                {"beyond", e.beyond},
                                {"expected", e.expected},
                                {"observed", e.observed},
                                {"probability_of_so_few", e.so_few},
                                {"likely_wrong", e.likely_wrong()},
                                {"words", words_of(e)}};
}

}  // namespace cairn::ground
