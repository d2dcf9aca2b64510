// cairn report: one page that shows what runs gave.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <vector>

#include "base/output_file.hpp"
#include "commands/commands.hpp"
#include "report/page.hpp"
#include "report/run_folder.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

struct ReportOptions {
  std::vector<fs::path> folders;
  fs::path output;
};

void report(const ReportOptions& options) {
  std::vector<nlohmann::ordered_json> runs;
  for (const fs::path& folder : options.folders) runs.push_back(read_run_folder(folder));
  const fs::path output = options.output.empty() ? options.folders.front() / "report.html" : options.output;
  write_file(output, report_page(std::move(runs)));
  fmt::print("written: {}\n", output.string());
}

}  // namespace

void add_report_command(CLI::App& app) {
  const auto options = std::make_shared<ReportOptions>();
  CLI::App* command = app.add_subcommand("report", "Make one page (HTML) that shows the results of runs");
  command->add_option("runs", options->folders, "folders that cairn run wrote")->required();
  command->add_option("-o,--output", options->output, "the page (default: report.html in the first folder)");
  command->callback([options] { report(*options); });
}

}  // namespace cairn::ground
