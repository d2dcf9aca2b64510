#include "profile/budget.hpp"

#include <algorithm>

#include "base/layered_toml.hpp"
#include "base/tool_error.hpp"

namespace cairn::ground {
namespace {

JobBudget job_of(const toml::node& node, const std::string& path, const std::string& target) {
  const toml::table* table = node.as_table();
  if (table == nullptr) throw ToolError("{}: 'job' must be tables; write [[job]]", path);
  JobBudget job;
  job.name = (*table)["name"].value_or(std::string());
  if (job.name.empty()) throw ToolError("{}: a [[job]] without a name; give it one", path);
  job.begins = (*table)["begins"].value_or(std::string());
  if (const toml::array* calls = (*table)["calls"].as_array()) {
    for (const toml::node& call : *calls) job.calls.push_back(call.value_or(std::string()));
  }
  if (std::find(job.calls.begin(), job.calls.end(), "") != job.calls.end() || job.calls.empty() ||
      job.begins.empty())
    throw ToolError("{}: job '{}' needs 'begins' and a list 'calls' of functions", path, job.name);
  const auto budget = (*table)["budget_s"][target].value<double>();
  if (!budget || !(*budget > 0.0))
    throw ToolError("{}: job '{}' has no budget for {}; add budget_s.{} in seconds", path, job.name, target,
                    target);
  job.budget_s = *budget;
  return job;
}

/// The frame that was under way after so many instructions.
std::size_t frame_at(const Profile& profile, std::uint64_t instructions) {
  const auto after = std::upper_bound(profile.frames.begin(), profile.frames.end(), instructions,
                                      [](std::uint64_t at, const ProfileSpan& f) { return at < f.at; });
  return after == profile.frames.begin() ? 0 : static_cast<std::size_t>(after - profile.frames.begin()) - 1;
}

}  // namespace

std::vector<JobBudget> read_budgets(const std::filesystem::path& path, const std::string& target) {
  const toml::table root = read_toml(path).table;
  const toml::array* jobs = root["job"].as_array();
  if (jobs == nullptr || jobs->empty()) throw ToolError("{}: has no [[job]]; add one", path.string());
  std::vector<JobBudget> out;
  for (const toml::node& job : *jobs) out.push_back(job_of(job, path.string(), target));
  return out;
}

ProfileCost JobReport::mean() const {
  ProfileCost sum;
  for (const JobRound& round : rounds) sum += round.cost;
  if (rounds.empty()) return sum;
  return {sum.instructions / rounds.size(), sum.cycles / rounds.size()};
}

JobRound JobReport::longest() const {
  if (rounds.empty()) return {};
  return *std::max_element(rounds.begin(), rounds.end(), [](const JobRound& a, const JobRound& b) {
    return a.cost.cycles < b.cost.cycles;
  });
}

std::vector<JobReport> report_jobs(const Profile& profile, const std::vector<JobBudget>& budgets) {
  std::vector<JobReport> out;
  for (const JobBudget& budget : budgets) {
    JobReport report;
    report.budget = budget;
    for (const ProfileSpan& call : profile.calls) {
      const std::string& name = profile.functions[call.function].plain;
      if (name == budget.begins) report.rounds.push_back({frame_at(profile, call.at), {}});
      const bool counts = std::find(budget.calls.begin(), budget.calls.end(), name) != budget.calls.end();
      if (counts && !report.rounds.empty()) report.rounds.back().cost += call.cost;
    }
    out.push_back(std::move(report));
  }
  return out;
}

std::string broken_budgets(const std::vector<JobReport>& jobs, double clock_mhz) {
  std::string out;
  for (const JobReport& job : jobs) {
    if (!job.broken(clock_mhz)) continue;
    out += out.empty() ? "budget exceeded: " : "; ";
    if (job.rounds.empty()) {
      out += fmt::format("{} never ran (or {} is not a function of the image)", job.budget.name,
                         job.budget.begins);
    } else {
      out += fmt::format("{} takes {:.3f} s of {:.3f} s in frame {}", job.budget.name,
                         job.longest_s(clock_mhz), job.budget.budget_s, job.longest().frame);
    }
  }
  return out;
}

}  // namespace cairn::ground
