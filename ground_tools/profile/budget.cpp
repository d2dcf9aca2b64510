#include "profile/budget.hpp"

#include <algorithm>
#include <fstream>

#include "base/layered_toml.hpp"
#include "base/tool_error.hpp"
#include "schedule.hpp"

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
  job.task = (*table)["task"].value_or(std::string());
  if (job.task.empty()) return job;
  if (job.task != "vo" && job.task != "boulders" && job.task != "fix")
    throw ToolError("{}: job '{}' has the task '{}'; write vo, boulders or fix", path, job.name, job.task);
  const auto each = (*table)["cycles_per_op"][target].value<double>();
  if (!each || !(*each > 0.0))
    throw ToolError("{}: job '{}' has no cycles_per_op for {}; add it, or leave its task out", path, job.name,
                    target);
  job.cycles_per_op = *each;
  return job;
}

/// The frame that was under way after so many instructions.
std::size_t frame_at(const Profile& profile, std::uint64_t instructions) {
  const auto after = std::upper_bound(profile.frames.begin(), profile.frames.end(), instructions,
                                      [](std::uint64_t at, const ProfileSpan& f) { return at < f.at; });
  return after == profile.frames.begin() ? 0 : static_cast<std::size_t>(after - profile.frames.begin()) - 1;
}

/// Of one task over the frames [from, to).
std::uint64_t weighted_ops(const std::vector<FrameOps>& ops, const std::string& task, std::size_t from,
                           std::size_t to) {
  const cfg::Task which = task == "vo"         ? cfg::Task::kVo
                          : task == "boulders" ? cfg::Task::kBoulders
                                               : cfg::Task::kFix;
  std::uint64_t sum = 0;
  for (std::size_t i = from; i < to && i < ops.size(); ++i)
    sum += which == cfg::Task::kVo ? ops[i].vo : which == cfg::Task::kBoulders ? ops[i].boulders : ops[i].fix;
  return sum * cfg::kTaskWeight[static_cast<std::size_t>(which)];
}

}  // namespace

std::vector<FrameOps> read_frame_ops(const std::filesystem::path& console) {
  std::ifstream in(console);
  if (!in)
    throw ToolError("{}: cannot be read; give the console of the image that was profiled", console.string());
  std::vector<FrameOps> out;
  for (std::string line; std::getline(in, line);) {
    FrameOps frame;
    unsigned long number = 0;
    unsigned long vo = 0;
    unsigned long boulders = 0;
    unsigned long fix = 0;
    if (std::sscanf(line.c_str(), "ops of frame %lu: vo %lu, boulders %lu, fix %lu", &number, &vo, &boulders,
                    &fix) != 4)
      continue;
    frame.vo = vo;
    frame.boulders = boulders;
    frame.fix = fix;
    out.push_back(frame);
  }
  if (out.empty())
    throw ToolError("{}: tells of no frame's operations; give the console of a replay image",
                    console.string());
  return out;
}

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

double JobReport::cycles_per_op() const {
  double most = 0.0;
  for (const JobRound& round : rounds) {
    if (round.ops > 0)
      most = std::max(most, static_cast<double>(round.cost.cycles) / static_cast<double>(round.ops));
  }
  return most;
}

std::vector<JobReport> report_jobs(const Profile& profile, const std::vector<JobBudget>& budgets,
                                   const std::vector<FrameOps>& ops) {
  std::vector<JobReport> out;
  for (const JobBudget& budget : budgets) {
    JobReport report;
    report.budget = budget;
    for (const ProfileSpan& call : profile.calls) {
      const std::string& name = profile.functions[call.function].plain;
      if (name == budget.begins) report.rounds.push_back({frame_at(profile, call.at), {}, 0});
      const bool counts = std::find(budget.calls.begin(), budget.calls.end(), name) != budget.calls.end();
      if (counts && !report.rounds.empty()) report.rounds.back().cost += call.cost;
    }
    for (std::size_t i = 0; i < report.rounds.size() && !budget.task.empty(); ++i) {
      const std::size_t to = i + 1 < report.rounds.size() ? report.rounds[i + 1].frame : ops.size();
      report.rounds[i].ops = weighted_ops(ops, budget.task, report.rounds[i].frame, to);
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
    } else if (job.longest_s(clock_mhz) <= job.budget.budget_s) {
      out += fmt::format("{} takes {:.2f} cycles a weighted operation, {:.2f} in the table (cycles_per_op)",
                         job.budget.name, job.cycles_per_op(), job.budget.cycles_per_op);
    } else {
      out += fmt::format("{} takes {:.3f} s of {:.3f} s in frame {}", job.budget.name,
                         job.longest_s(clock_mhz), job.budget.budget_s, job.longest().frame);
    }
  }
  return out;
}

}  // namespace cairn::ground
