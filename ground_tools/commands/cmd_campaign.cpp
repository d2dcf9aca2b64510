// cairn campaign: many drives over terrains that are drawn at random, and what they come to.
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "base/output_file.hpp"
#include "base/progress_line.hpp"
#include "campaign/findings.hpp"
#include "campaign/findings_plot.hpp"
#include "campaign/reliability.hpp"
#include "campaign/reliability_plot.hpp"
#include "campaign/trial.hpp"
#include "campaign/trouble.hpp"
#include "commands/commands.hpp"
#include "forecast/model_file.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

struct CampaignOptions {
  std::size_t trials = 30;
  std::uint64_t first_seed = kFirstSeed;
  fs::path output;
  bool keep = false;
  bool sparse = false;
  std::vector<Trouble> troubles;
  fs::path model;  ///< of the forecast
};

std::string fixes_of(const RunFigures& f) {
  return fmt::format("{:.0f}/{:.0f}/{:.0f}/{:.0f}", f.fixes[0], f.fixes[1], f.fixes[2], f.fixes[3]);
}

void print_trial(const Trial& t) {
  fmt::print(
      "{}  {:<11} {:>2.0f} mm, k {:.3f}  VO {:.3f} m, corrected {:.3f} m, fixes {}; worse {:.3f} m, {:.3f} "
      "m, {}; "
      "{:.0f} s\n",
      t.setup.seed, sim::name_of(t.setup.scene.traverse.kind), 1.0e3 * t.setup.map_pixel_m,
      t.setup.scene.rocks.k, t.as_it_is.vo_end_xy_m, t.as_it_is.end_xy_m, fixes_of(t.as_it_is),
      t.worse.vo_end_xy_m, t.worse.end_xy_m, fixes_of(t.worse), t.seconds);
  std::fflush(stdout);
}

/// What would have been forecast for each trial; those of a version that kept no local maps are left out.
std::vector<TrialForecast> forecasts_of(const std::vector<Trial>& trials, const fs::path& folder,
                                        const ForecastModel& model) {
  ProgressLine progress("forecasts");
  std::vector<TrialForecast> made;
  double done = 0.0;
  for (const Trial& trial : trials) {
    const fs::path own = folder / std::to_string(trial.setup.seed);
    std::vector<fs::path> places{own};
    for (const int times : kCoarser) places.push_back(own / coarser_name(times));
    for (const fs::path& place : places) {
      auto one = forecast_trial(model, place, trial.setup.seed);
      if (one) made.push_back(std::move(*one));
    }
    done += 1.0;
    progress.show(done / static_cast<double>(trials.size()));
  }
  return made;
}

/// Those of all trials that have any.
std::vector<TroubledRun> troubles_of(const std::vector<Trial>& trials, const fs::path& folder) {
  std::vector<TroubledRun> all;
  std::error_code ignored;
  for (const Trial& trial : trials) {
    const fs::path file = folder / std::to_string(trial.setup.seed) / "troubles.csv";
    if (!fs::exists(file, ignored)) continue;
    const std::vector<TroubledRun> runs = read_troubles(file);
    all.insert(all.end(), runs.begin(), runs.end());
  }
  return all;
}

void campaign(const CampaignOptions& options) {
  ForecastModel model = mission_model();
  if (!options.model.empty()) read_model(options.model, model);
  std::vector<Trial> trials;
  {
    ProgressLine progress(fmt::format("campaign of {} drives", options.trials));
    double done = 0.0;
    trials = run_campaign(
        options.output, options.trials, options.first_seed,
        [&](Trial& trial) {
          const std::uint64_t number = trial.setup.seed - options.first_seed;
          const double to_do = static_cast<double>(options.trials - number) + done;  // of this start
          if (done == 0.0) {
            if (number > 0) fmt::print("resuming after {} finished drives\n", number);
            fmt::print("errors at the end in x, y; fixes right/weak/declined/false\n");
            std::fflush(stdout);
          }
          run_trial(trial, options.output / std::to_string(trial.setup.seed),
                    {options.keep, options.sparse, options.troubles},
                    [&](double share) { progress.show((done + share) / to_do); });
          done += 1.0;
          progress.clear();
          print_trial(trial);
        },
        options.sparse ? Abundance::kSparse : Abundance::kUsual);
  }
  const std::vector<TrialForecast> forecasts = forecasts_of(trials, options.output, model);
  nlohmann::ordered_json summary = findings_json(trials);
  summary["forecast"] = reliability_json(forecasts, model);
  const std::vector<TroubledRun> troubles = troubles_of(trials, options.output);
  if (!troubles.empty()) {
    summary["troubles"] = troubles_json(troubles);
    write_file(options.output / "troubles.csv", to_csv(troubles));
  }
  write_file(options.output / "summary.json", summary.dump(2) + "\n");
  write_file(options.output / "reliability.svg", plot_reliability(forecasts));
  write_file(options.output / "forecast.csv", forecast_csv(forecasts));
  write_file(options.output / "forecast_model.json", model_json(fitted(model, forecasts)).dump(2) + "\n");
  write_file(options.output / "campaign.svg", plot_findings(trials));
  print_findings(trials);
  print_troubles(troubles);
  print_reliability(forecasts, model);
  fmt::print("\nwritten: {}\n",
             (options.output /
              "{trials.csv,summary.json,campaign.svg,forecast.csv,forecast_model.json,reliability.svg}")
                 .string());
}

}  // namespace

void add_campaign_command(Command app) {
  const auto options = std::make_shared<CampaignOptions>();
  Command command = app.add_command(
      "campaign", "Drives over many random terrains: errors and fixes with confidence intervals");
  command.add_option("-n,--trials", options->trials, "total number of drives (default 30)").within(1, 100000);
  command.add_option("-o,--output", options->output, "output folder; a campaign found there is resumed")
      .required();
  command
      .add_option("--first-seed", options->first_seed,
                  fmt::format("seed of the first drive; the others follow on (default {})", kFirstSeed))
      .within(0, 1000000000);
  command.add_flag("--keep", options->keep, "keep the orthoimages, up to 25 MB per drive");
  command.add_flag("--sparse", options->sparse,
                   "sparse rock fields, where fixes begin to fail: k from 0.02 to 0.032");
  command.add_taken(
      "--troubles", [options](const std::string& text) { options->troubles = parse_troubles(text); },
      "replay each drive under these, too: all, or names of start_error, wrong_site, slip, dark, kidnap "
      "between commas");
  command.add_option("--model", options->model,
                     "parameters of the forecast (forecast_model.json of another campaign)");
  command.on_run([options] { campaign(*options); });
}

}  // namespace cairn::ground
