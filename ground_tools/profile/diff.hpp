/// Profiles side by side: what a change of the code, or of the model's memory, does to each job and function.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace cairn::ground {

/// `folders` are two and more that `make profile` wrote (jobs.csv, functions.csv). Text: seconds of each
/// job's longest and mean round, in each folder as a multiple of the first's; of two folders also the `most`
/// functions whose own cycles changed the most. Throws ToolError: cannot be read, no such table, a job that
/// the first folder doesn't have.
std::string profile_diff_text(const std::vector<std::filesystem::path>& folders, std::size_t most);

}  // namespace cairn::ground
