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
  std::string task;  ///< vo, boulders or fix: whose operations it does; empty where they are not told
  double cycles_per_op = 0.0;  ///< at most, of a weighted operation (cfg::kTaskWeight)
};

/// Those of one target. Throws ToolError: cannot be read, a job without one of its entries or without a
/// budget for the target.
std::vector<JobBudget> read_budgets(const std::filesystem::path& path, const std::string& target);

struct JobRound {
  std::size_t frame = 0;  ///< in which it began
  ProfileCost cost;
  std::uint64_t ops = 0;  ///< weighted; 0 where they are not told
};

/// Operations of each frame, by task, as the image tells them on its console (platform/tape/replay.cpp).
struct FrameOps {
  std::uint64_t vo = 0;
  std::uint64_t boulders = 0;
  std::uint64_t fix = 0;
};
/// Throws ToolError: cannot be read, or tells of no frame.
std::vector<FrameOps> read_frame_ops(const std::filesystem::path& console);

struct JobReport {
  JobBudget budget;
  std::vector<JobRound> rounds;

  ProfileCost mean() const;
  /// By cycles; a round of no cost where there was none.
  JobRound longest() const;
  double longest_s(double clock_mhz) const {
    return static_cast<double>(longest().cost.cycles) / (1.0e6 * clock_mhz);
  }
  /// Model cycles of a weighted operation in the round where it is dearest; 0 where they are not told.
  double cycles_per_op() const;
  /// Never ran, or its longest round or its dearest operations take more than they may.
  bool broken(double clock_mhz) const {
    return rounds.empty() || longest_s(clock_mhz) > budget.budget_s || cycles_per_op() > budget.cycles_per_op;
  }
};

/// `ops`: of the frames, or none.
std::vector<JobReport> report_jobs(const Profile& profile, const std::vector<JobBudget>& budgets,
                                   const std::vector<FrameOps>& ops = {});

/// One line that names each broken budget; empty where all hold.
std::string broken_budgets(const std::vector<JobReport>& jobs, double clock_mhz);

}  // namespace cairn::ground
