#include "profile/diff.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/number_table.hpp"
#include "base/tool_error.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMend = "make it anew with `make profile`";

struct Job {
  std::string name;
  double mean_s = 0.0;
  double longest_s = 0.0;
};

std::vector<Job> read_jobs(const fs::path& folder) {
  const CsvTable table(folder / "jobs.csv", kMend);
  const std::size_t name = table.column("job"), mean = table.column("mean_cycles"),
                    longest = table.column("longest_cycles"), clock = table.column("clock_mhz");
  std::vector<Job> out;
  for (std::size_t row = 0; row < table.size(); ++row) {
    const double cycles_a_second = 1.0e6 * table.number(row, clock);
    out.push_back({std::string(table.word(row, name)), table.number(row, mean) / cycles_a_second,
                   table.number(row, longest) / cycles_a_second});
  }
  return out;
}

const Job& job_of(const std::vector<Job>& jobs, const std::string& name, const fs::path& folder) {
  const auto found = std::find_if(jobs.begin(), jobs.end(), [&](const Job& job) { return job.name == name; });
  if (found == jobs.end())
    throw ToolError("{}: no job '{}'; {}", (folder / "jobs.csv").string(), name, kMend);
  return *found;
}

struct Spent {
  double calls = 0.0;
  double cycles = 0.0;
};

/// By name: the compiler may make several functions of one.
std::map<std::string, Spent> read_functions(const fs::path& folder) {
  const CsvTable table(folder / "functions.csv", kMend);
  const std::size_t name = table.column("function"), calls = table.column("calls"),
                    cycles = table.column("self_cycles");
  std::map<std::string, Spent> out;
  for (std::size_t row = 0; row < table.size(); ++row) {
    Spent& spent = out[std::string(table.word(row, name))];
    spent.calls += table.number(row, calls);
    spent.cycles += table.number(row, cycles);
  }
  return out;
}

std::string times(double value, double of) {
  return of > 0.0 ? fmt::format("{:.3f}", value / of) : std::string("-");
}

std::string jobs_text(const std::vector<fs::path>& folders) {
  std::vector<std::vector<Job>> jobs;
  for (const fs::path& folder : folders) jobs.push_back(read_jobs(folder));
  std::string out = fmt::format("  {:<20} {:<44} {:>9} {:>7}   {:>9} {:>7}\n", "job", "profile", "longest, s",
                                "times", "mean, s", "times");
  for (const Job& first : jobs[0]) {
    for (std::size_t i = 0; i < folders.size(); ++i) {
      const Job& job = job_of(jobs[i], first.name, folders[i]);
      out += fmt::format("  {:<20} {:<44} {:>10.4f} {:>7}   {:>9.4f} {:>7}\n", i == 0 ? job.name : "",
                         folders[i].string(), job.longest_s, times(job.longest_s, first.longest_s),
                         job.mean_s, times(job.mean_s, first.mean_s));
    }
  }
  return out;
}

std::string functions_text(const fs::path& before, const fs::path& after, std::size_t most) {
  struct Change {
    std::string name;
    Spent before, after;
    double cycles() const { return after.cycles - before.cycles; }
  };
  std::map<std::string, Change> by_name;
  double whole = 0.0;
  for (const auto& [name, spent] : read_functions(before)) {
    by_name[name].before = spent;
    whole += spent.cycles;
  }
  for (const auto& [name, spent] : read_functions(after)) by_name[name].after = spent;
  std::vector<Change> changes;
  for (auto& [name, change] : by_name) {
    change.name = name;
    if (change.cycles() != 0.0 || change.before.calls != change.after.calls) changes.push_back(change);
  }
  if (changes.empty()) return "\nNo function's calls or cycles changed\n";
  std::stable_sort(changes.begin(), changes.end(), [](const Change& a, const Change& b) {
    return std::abs(a.cycles()) > std::abs(b.cycles());
  });
  std::string out = fmt::format(
      "\nFunctions by what changed of their own cycles\n  {:<58} {:>10} {:>10} {:>10} {:>10} {:>10} {:>8}\n",
      "function", "calls", "calls now", "M cycles", "M now", "change", "% of all");
  for (std::size_t i = 0; i < std::min(most, changes.size()); ++i) {
    const Change& c = changes[i];
    out += fmt::format("  {:<58.58} {:>10} {:>10} {:>10.2f} {:>10.2f} {:>+10.2f} {:>+8.2f}\n", c.name,
                       c.before.calls, c.after.calls, 1.0e-6 * c.before.cycles, 1.0e-6 * c.after.cycles,
                       1.0e-6 * c.cycles(), whole > 0.0 ? 100.0 * c.cycles() / whole : 0.0);
  }
  return out;
}

}  // namespace

std::string profile_diff_text(const std::vector<fs::path>& folders, std::size_t most) {
  std::string out = jobs_text(folders);
  if (folders.size() == 2) out += functions_text(folders[0], folders[1], most);
  return out;
}

}  // namespace cairn::ground
