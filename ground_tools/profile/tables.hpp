/// A profile as text for a terminal and as CSV.
#pragma once

#include <string>
#include <vector>

#include "profile/budget.hpp"
#include "profile/profile.hpp"

namespace cairn::ground {

/// The jobs against their budgets, then the `most` functions that spend the most by themselves, in the whole
/// run and in the frame in detail.
std::string profile_text(const Profile& profile, const std::vector<JobReport>& jobs, double clock_mhz,
                         std::size_t most);

std::string jobs_csv(const std::vector<JobReport>& jobs, double clock_mhz);
std::string rounds_csv(const std::vector<JobReport>& jobs, double clock_mhz);  ///< each round of each job
std::string functions_csv(const Profile& profile);

}  // namespace cairn::ground
