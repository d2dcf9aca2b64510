#include "profile/page.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "plot/single_page.hpp"

CAIRN_EMBED(cairn_profile_html, "ground_tools/profile/profile.html");
CAIRN_EMBED(cairn_profile_css, "ground_tools/profile/profile.css");
CAIRN_EMBED(cairn_profile_js, "ground_tools/profile/profile.js");

namespace cairn::ground {
namespace {

using nlohmann::ordered_json;

ordered_json job_json(const JobReport& job, double clock_mhz) {
  const ProfileCost mean = job.mean();
  const JobRound longest = job.longest();
  ordered_json rounds = ordered_json::array();
  for (const JobRound& round : job.rounds)
    rounds.push_back({round.frame, static_cast<double>(round.cost.cycles) / (1.0e6 * clock_mhz)});
  return {{"name", job.budget.name},
          {"calls", job.budget.calls},
          {"budget_s", job.budget.budget_s},
          {"broken", job.broken(clock_mhz)},
          {"mean", {mean.instructions, mean.cycles}},
          {"longest", {longest.cost.instructions, longest.cost.cycles}},
          {"longest_frame", longest.frame},
          {"rounds", rounds}};
}

/// Which job a context belongs to: that of the nearest function above it that a job calls; -1 for none.
std::vector<int> jobs_of_nodes(const Profile& profile, const std::vector<JobReport>& jobs) {
  std::vector<int> out;
  for (const ProfileNode& node : profile.nodes) {
    int job = out.empty() ? -1 : out[node.parent];
    for (std::size_t j = 0; j < jobs.size(); ++j) {
      const std::vector<std::string>& calls = jobs[j].budget.calls;
      if (std::find(calls.begin(), calls.end(), profile.functions[node.function].plain) != calls.end())
        job = static_cast<int>(j);
    }
    out.push_back(job);
  }
  return out;
}

}  // namespace

std::string profile_page(const Profile& p, const std::vector<JobReport>& jobs, const std::string& target,
                         double clock_mhz) {
  ordered_json job_list = ordered_json::array();
  for (const JobReport& job : jobs) job_list.push_back(job_json(job, clock_mhz));
  ordered_json functions = ordered_json::array();
  for (const ProfileFunction& f : p.functions) {
    functions.push_back({f.name, f.calls, f.self.instructions, f.self.cycles, f.inclusive.cycles,
                         f.longest.cycles, f.data_misses, f.fetch_misses, f.stalled_cycles, f.detail_calls,
                         f.detail_self.cycles});
  }
  ordered_json nodes = ordered_json::array();
  const std::vector<int> job_of = jobs_of_nodes(p, jobs);
  for (std::size_t i = 0; i < p.nodes.size(); ++i) {
    const ProfileNode& n = p.nodes[i];
    nodes.push_back({n.parent, n.function, job_of[i], n.calls, n.self.instructions, n.self.cycles,
                     n.detail_calls, n.detail_self.instructions, n.detail_self.cycles});
  }
  const ordered_json data = {{"processor", p.processor},
                             {"target", target},
                             {"clock_mhz", clock_mhz},
                             {"total", {p.total.instructions, p.total.cycles}},
                             {"frames", p.frames.size()},
                             {"detail_frame", p.detail_frame},
                             {"jobs", job_list},
                             {"functions", functions},
                             {"nodes", nodes}};
  return single_page({"Cairn profile", cairn_profile_css, cairn_profile_html, cairn_profile_js}, data);
}

}  // namespace cairn::ground
