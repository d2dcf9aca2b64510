// cairn report: one page that shows what runs gave.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <vector>

#include "base/json_file.hpp"
#include "base/output_file.hpp"
#include "commands/commands.hpp"
#include "report/expectation.hpp"
#include "report/page.hpp"
#include "report/run_folder.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

struct ReportOptions {
  std::vector<fs::path> folders;
  fs::path output;
  fs::path forecast;
};

/// Each run's fixes beside the forecast's: in its data, in its summary.json, and on stdout.
void set_against_forecast(const ReportOptions& options, std::vector<nlohmann::ordered_json>& runs) {
  const std::vector<ExpectedFix> forecast = read_forecast(options.forecast);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    set_against(options.forecast, forecast, runs[i]);
    const nlohmann::ordered_json& summary = runs[i].at("summary");
    write_file(options.folders[i] / "summary.json", to_text(summary));
    fmt::print("{}: {}\n", runs[i].at("name").get<std::string>(),
               summary.at("forecast").at("words").get<std::string>());
  }
}

void report(const ReportOptions& options) {
  std::vector<nlohmann::ordered_json> runs;
  for (const fs::path& folder : options.folders) runs.push_back(read_run_folder(folder));
  if (!options.forecast.empty()) set_against_forecast(options, runs);
  const fs::path output = options.output.empty() ? options.folders.front() / "report.html" : options.output;
  write_file(output, report_page(std::move(runs)));
  fmt::print("written: {}\n", output.string());
}

}  // namespace

void add_report_command(Command app) {
  const auto options = std::make_shared<ReportOptions>();
  Command command = app.add_command("report", "Make one page (HTML) that shows the results of runs");
  command.add_option("runs", options->folders, "folders that cairn run wrote").required();
  command.add_option("-o,--output", options->output, "the page (default: report.html in the first folder)")
      .written();
  command.add_option(
      "--forecast", options->forecast,
      "forecast.csv of the drive (cairn map forecast): also tell whether so few fixes were to be "
      "expected, here and in summary.json");
  command.on_run([options] { report(*options); });
}

}  // namespace cairn::ground
