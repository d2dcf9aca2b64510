/// Runs a job in many steps of tiny and odd budgets.
#pragma once

#include "core/work_budget.hpp"

namespace cairn::test {

/// Steps until done; returns the number of steps, or -1 where the job did not end within `most`.
template <typename Job>
int run_in_slices(Job& job, int most = 1000000) {
  constexpr std::uint32_t kBudgets[] = {1, 7, 997, 20011, 3, 150001};
  for (int n = 1; n <= most; ++n) {
    WorkBudget budget(kBudgets[n % 6]);
    if (job.step(budget) == Progress::kDone) return n;
  }
  return -1;
}

/// The whole job in one step.
template <typename Job>
bool run_whole(Job& job) {
  WorkBudget budget = WorkBudget::unlimited();
  return job.step(budget) == Progress::kDone;
}

}  // namespace cairn::test
