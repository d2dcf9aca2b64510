// cairn profile: what a run on the emulated processor cost, by job and by function, against the budget;
// cairn profile-diff: such runs side by side.
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/output_file.hpp"
#include "base/tool_error.hpp"
#include "commands/commands.hpp"
#include "profile/budget.hpp"
#include "profile/diff.hpp"
#include "profile/page.hpp"
#include "profile/profile.hpp"
#include "profile/tables.hpp"

namespace cairn::ground {
namespace {

struct ProfileOptions {
  std::filesystem::path input;
  std::filesystem::path budget;
  std::filesystem::path console;
  std::filesystem::path output;
  std::string target;
  double clock_mhz = 0.0;
  std::size_t most = 40;
};

void show(const ProfileOptions& options) {
  const Profile profile = read_profile(options.input);
  const std::vector<FrameOps> ops =
      options.console.empty() ? std::vector<FrameOps>() : read_frame_ops(options.console);
  const std::vector<JobReport> jobs = report_jobs(profile, read_budgets(options.budget, options.target), ops);
  const double clock_mhz = options.clock_mhz > 0.0 ? options.clock_mhz : profile.clock_mhz;
  if (!options.output.empty()) {
    const HoldInterrupts all_or_none;
    make_folder(options.output);
    write_file(options.output / "jobs.csv", jobs_csv(jobs, clock_mhz));
    write_file(options.output / "rounds.csv", rounds_csv(jobs, clock_mhz));
    write_file(options.output / "functions.csv", functions_csv(profile));
    write_file(options.output / "profile.html", profile_page(profile, jobs, options.target, clock_mhz));
  }
  fmt::print("{}", profile_text(profile, jobs, clock_mhz, options.most));
  std::fflush(stdout);  // the tables come before the verdict
  const std::string broken = broken_budgets(jobs, clock_mhz);
  if (!broken.empty()) throw ToolError("{}", broken);
}

}  // namespace

void add_profile_command(Command app) {
  const auto options = std::make_shared<ProfileOptions>();
  Command command = app.add_command(
      "profile",
      "Cycles of the jobs on an emulated processor against their budgets; fails if one is exceeded");
  command.add_option("profile", options->input, "file that the plugin of `make profile` wrote").required();
  command.add_option("--budget", options->budget, "budgets of the jobs (TOML)").required();
  command.add_option("--target", options->target, "target of the budgets: ppc750, leon3 ...").required();
  command.add_option("--console", options->console,
                     "console of the image: operations of each frame, for cycles an operation");
  command.add_option("--clock", options->clock_mhz, "clock, MHz (default: that of the processor's model)")
      .within(0.001, 1.0e6);
  command.add_option("--top", options->most, "functions to print").within(1, 100000);
  command.add_option("-o,--output", options->output, "folder for tables (CSV) and the page (HTML)");
  command.on_run([options] { show(*options); });
}

void add_profile_diff_command(Command app) {
  struct Options {
    std::vector<std::filesystem::path> folders;
    std::size_t most = 30;
  };
  const auto options = std::make_shared<Options>();
  Command command = app.add_command(
      "profile-diff", "Profiles side by side: seconds of each job, and the functions that changed");
  command.add_option("folders", options->folders, "two folders of `make profile` and more; the first is 1")
      .required()
      .values(2, 100);
  command.add_option("--top", options->most, "functions to print").within(1, 100000);
  command.on_run([options] { fmt::print("{}", profile_diff_text(options->folders, options->most)); });
}

}  // namespace cairn::ground
