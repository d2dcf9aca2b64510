/// What the jobs of the flight module may take (mission_cfg/timing_budget.toml), and what they took.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "profile/profile.hpp"

namespace cairn::ground {

struct JobBudget {
  std::string name;
  std::string begins;              ///< each call of it begins a round of the job
  std::vector<std::string> calls;  ///< what they spend until the next round is the job's cost
  double budget_s = 0.0;
};

/// Those of one target. Throws ToolError: cannot be read, a job without one of its entries or without a
/// budget for the target.
std::vector<JobBudget> read_budgets(const std::filesystem::path& path, const std::string& target);

struct JobRound {
  std::size_t frame = 0;  ///< in which it began
  ProfileCost cost;
};

struct JobReport {
  JobBudget budget;
  std::vector<JobRound> rounds;

  ProfileCost mean() const;
  /// By cycles; a round of no cost where there was none.
  JobRound longest() const;
  double longest_s(double clock_mhz) const {
    return static_cast<double>(longest().cost.cycles) / (1.0e6 * clock_mhz);
  }
  /// Never ran, or its longest round takes more than it may.
  bool broken(double clock_mhz) const { return rounds.empty() || longest_s(clock_mhz) > budget.budget_s; }
};

std::vector<JobReport> report_jobs(const Profile& profile, const std::vector<JobBudget>& budgets);

/// One line that names each broken budget; empty where all hold.
std::string broken_budgets(const std::vector<JobReport>& jobs, double clock_mhz);

}  // namespace cairn::ground
