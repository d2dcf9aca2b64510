#include "campaign/reliability.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/hash_random.hpp"

namespace cairn::ground {
namespace {

using nlohmann::ordered_json;

constexpr int kBins = 10;
constexpr int kResamples = 1000;

bool happened(const ForecastFix& fix, FixEvent event) {
  return event == FixEvent::kApplied ? fix.applied : fix.verdict == FixVerdict::kRight;
}
double forecast_of(const ForecastFix& fix, FixEvent event) {
  return event == FixEvent::kApplied ? fix.forecast.applied : fix.forecast.right;
}

/// Sums of one trial, for drawing trials anew.
struct Sums {
  double n = 0.0;
  double hits = 0.0;
  double squares = 0.0;

  void add(const Sums& s) {
    n += s.n;
    hits += s.hits;
    squares += s.squares;
  }
  double base() const { return hits / n * (1.0 - hits / n); }
  double skill() const { return 1.0 - squares / n / base(); }
};

Interval skill_interval(const std::map<std::uint64_t, Sums>& by_trial) {
  std::vector<Sums> trials;
  for (const auto& [seed, sums] : by_trial) trials.push_back(sums);
  sim::Draw draw(0, sim::Stream::kCampaign);
  std::vector<double> skills;
  for (int i = 0; i < kResamples; ++i) {
    Sums all;
    for (std::size_t k = 0; k < trials.size(); ++k) {
      const auto at = static_cast<std::size_t>(draw.uniform() * static_cast<double>(trials.size()));
      all.add(trials[std::min(at, trials.size() - 1)]);
    }
    if (all.base() > 0.0) skills.push_back(all.skill());
  }
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (skills.empty()) return {kNone, kNone};
  std::sort(skills.begin(), skills.end());
  const auto at = [&](double share) {
    return skills[static_cast<std::size_t>(share * static_cast<double>(skills.size() - 1))];
  };
  return {at(0.025), at(0.975)};
}

std::vector<ForecastFix> all_fixes(const std::vector<TrialForecast>& trials) {
  std::vector<ForecastFix> all;
  for (const TrialForecast& t : trials) all.insert(all.end(), t.fixes.begin(), t.fixes.end());
  return all;
}

/// Root mean square of the errors after fixes that were applied, and what was forecast of it.
struct ErrorSize {
  double observed_m = 0.0;
  double forecast_m = 0.0;
  std::size_t fixes = 0;
};

ErrorSize error_size(const std::vector<ForecastFix>& fixes, const ForecastModel& model) {
  ErrorSize size;
  for (const ForecastFix& f : fixes) {
    if (!f.applied) continue;
    const FixStation& s = f.forecast;
    ++size.fixes;
    size.observed_m += f.after_m * f.after_m;
    size.forecast_m += s.after.along_m * s.after.along_m + s.after.across_m * s.after.across_m +
                       2.0 * model.sigma_common_m * model.sigma_common_m;
  }
  if (size.fixes == 0) return size;
  const auto n = static_cast<double>(size.fixes);
  return {std::sqrt(size.observed_m / n), std::sqrt(size.forecast_m / n), size.fixes};
}

ordered_json json_of(const Reliability& r) {
  ordered_json json = {{"fixes", r.fixes},
                       {"forecast_mean", r.forecast},
                       {"observed", r.observed.value()},
                       {"brier", r.brier},
                       {"brier_of_base_rate", r.base_brier}};
  json["skill"] =
      std::isnan(r.skill)
          ? ordered_json(nullptr)
          : ordered_json{{"value", r.skill}, {"low", r.skill_interval.low}, {"high", r.skill_interval.high}};
  json["bins"] = ordered_json::array();
  for (const ReliabilityBin& b : r.bins) {
    json["bins"].push_back({{"from", b.low},
                            {"to", b.high},
                            {"forecast", b.forecast},
                            {"observed", b.observed.value()},
                            {"low", b.observed.interval().low},
                            {"high", b.observed.interval().high},
                            {"hits", b.observed.hits},
                            {"fixes", b.observed.of}});
  }
  return json;
}

}  // namespace

const char* name_of(FixEvent event) { return event == FixEvent::kApplied ? "applied" : "right"; }

Reliability reliability_of(const std::vector<ForecastFix>& fixes, FixEvent event) {
  Reliability r;
  r.fixes = fixes.size();
  r.observed.of = fixes.size();
  std::array<ReliabilityBin, kBins> bins;
  for (int b = 0; b < kBins; ++b) {
    bins[static_cast<std::size_t>(b)].low = static_cast<double>(b) / kBins;
    bins[static_cast<std::size_t>(b)].high = static_cast<double>(b + 1) / kBins;
  }
  std::map<std::uint64_t, Sums> by_trial;
  for (const ForecastFix& fix : fixes) {
    const double forecast = forecast_of(fix, event);
    const double outcome = happened(fix, event) ? 1.0 : 0.0;
    ReliabilityBin& bin =
        bins[static_cast<std::size_t>(std::min(kBins - 1, static_cast<int>(forecast * kBins)))];
    bin.forecast += forecast;
    bin.observed.hits += happened(fix, event) ? 1 : 0;
    ++bin.observed.of;
    by_trial[fix.seed].add({1.0, outcome, (forecast - outcome) * (forecast - outcome)});
    r.forecast += forecast;
  }
  Sums all;
  for (const auto& [seed, sums] : by_trial) all.add(sums);
  if (fixes.empty()) {
    r.skill = std::numeric_limits<double>::quiet_NaN();
    return r;
  }
  for (ReliabilityBin& bin : bins) {
    if (bin.observed.of == 0) continue;
    bin.forecast /= static_cast<double>(bin.observed.of);
    r.observed.hits += bin.observed.hits;
    r.bins.push_back(bin);
  }
  r.forecast /= all.n;
  r.brier = all.squares / all.n;
  r.base_brier = all.base();
  r.skill = r.base_brier > 0.0 ? all.skill() : std::numeric_limits<double>::quiet_NaN();
  r.skill_interval = skill_interval(by_trial);
  return r;
}

void print_reliability(const std::vector<TrialForecast>& trials, const ForecastModel& model) {
  const std::vector<ForecastFix> fixes = all_fixes(trials);
  fmt::print("\nForecast against outcome, {} fixes with {} maps, each with VO as it is and made worse\n",
             fixes.size(), trials.size());
  for (const FixEvent event : kFixEvents) {
    const Reliability r = reliability_of(fixes, event);
    fmt::print("  {:<10} {:>6}  {:>8}  {:>8}  {:<16}\n", name_of(event), "fixes", "forecast", "observed",
               "95 % interval");
    for (const ReliabilityBin& b : r.bins) {
      const Interval i = b.observed.interval();
      fmt::print("  {:.1f} to {:.1f} {:>6}  {:>8.3f}  {:>8.3f}  {:.3f} to {:.3f}\n", b.low, b.high,
                 b.observed.of, b.forecast, b.observed.value(), i.low, i.high);
    }
    fmt::print("  {:<10} {:>6}  {:>8.3f}  {:>8.3f}\n", "all", r.fixes, r.forecast, r.observed.value());
    fmt::print("  Brier score {:.4f}, that of the base rate {:.4f}, ", r.brier, r.base_brier);
    if (std::isnan(r.skill)) {
      fmt::print("skill is undefined: the event happened always, or never\n\n");
    } else {
      fmt::print("skill {:+.3f} [{:+.3f}, {:+.3f}]\n\n", r.skill, r.skill_interval.low,
                 r.skill_interval.high);
    }
  }
  const ErrorSize size = error_size(fixes, model);
  if (size.fixes > 0)
    fmt::print("  error after an applied fix, rms: forecast {:.3f} m, observed {:.3f} m ({} fixes)\n",
               size.forecast_m, size.observed_m, size.fixes);
  const auto told = [](const char* whose, const ForecastModel& m) {
    fmt::print(
        "  {:<12} most {:.3f}, half {:.3f} m, power {:.2f}, spread {:.2f}, clutter {:.3f} per m2, pair "
        "{:.3f} m, common "
        "{:.3f} m\n",
        whose, m.detection.most, m.detection.half_m, m.detection.power, m.detection.spread, m.clutter_per_m2,
        m.sigma_pair_m, m.sigma_common_m);
  };
  told("forecast by", model);
  told("fitted to these", fitted(model, trials));
}

ordered_json reliability_json(const std::vector<TrialForecast>& trials, const ForecastModel& model) {
  const std::vector<ForecastFix> fixes = all_fixes(trials);
  ordered_json json;
  json["maps"] = trials.size();
  for (const FixEvent event : kFixEvents) json[name_of(event)] = json_of(reliability_of(fixes, event));
  const ErrorSize size = error_size(fixes, model);
  json["error_after_fix_rms_m"] = {
      {"fixes", size.fixes}, {"forecast", size.forecast_m}, {"observed", size.observed_m}};
  return json;
}

std::string forecast_csv(const std::vector<TrialForecast>& trials) {
  std::string text =
      "seed,vo,snapshot,boulders,expected_found,p_applied,p_right,sigma_after_m,verdict,after_m\n";
  for (const TrialForecast& t : trials) {
    for (const ForecastFix& f : t.fixes) {
      const FixStation& s = f.forecast;
      text += fmt::format("{},{},{},{},{:.2f},{:.4f},{:.4f},{:.4f},{},{:.4f}\n", f.seed, f.vo, s.frame,
                          s.boulders, s.found, s.applied, s.right,
                          std::hypot(s.after.along_m, s.after.across_m), name_of(f.verdict), f.after_m);
    }
  }
  return text;
}

}  // namespace cairn::ground
