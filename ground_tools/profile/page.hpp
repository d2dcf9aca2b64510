/// A profile as one HTML page that needs nothing else: jobs against budgets, a flame graph of the calling
/// contexts, all functions.
#pragma once

#include <string>
#include <vector>

#include "profile/budget.hpp"
#include "profile/profile.hpp"

namespace cairn::ground {

std::string profile_page(const Profile& profile, const std::vector<JobReport>& jobs,
                         const std::string& target, double clock_mhz);

}  // namespace cairn::ground
