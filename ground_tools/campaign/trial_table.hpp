/// The trials of a campaign and their file, `trials.csv`: a line of names, then a line a trial in the order
/// of the seeds. What was drawn stands first in a line, so that lines of another campaign, or of a version
/// that draws otherwise, are known.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "campaign/fix_verdict.hpp"
#include "campaign/setup.hpp"

namespace cairn::ground {

/// What to do about a trial whose files can't be read.
inline constexpr const char* kMendTrial =
    "remove the trial's folder and its line in trials.csv, and run again";

/// One replay against truth. Percentages are of the true path's length; NaN where there is nothing to tell.
struct RunFigures {
  double vo_end_xy_m = 0.0;
  double vo_end_xy_percent = 0.0;
  double vo_end_3d_percent = 0.0;
  double vo_end_yaw_deg = 0.0;  ///< signed, as that of the corrected pose
  double end_xy_m = 0.0;        ///< of the corrected pose, as all below
  double largest_xy_m = 0.0;
  double end_yaw_deg = 0.0;
  double excess_over_vo_m = 0.0;                ///< the most by which it was worse than VO alone
  double median_fix_error_m = 0.0;              ///< of the pose after an applied fix; NaN: none was applied
  std::array<double, kFixVerdicts> fixes = {};  ///< numbers by FixVerdict
};

struct Trial {
  Setup setup;
  double map_boulders = 0.0;
  double frames = 0.0;
  double path_m = 0.0;
  double seconds = 0.0;  ///< that the trial took
  RunFigures as_it_is;
  RunFigures worse;  ///< the same images, VO made worse
};

std::string to_csv(const std::vector<Trial>& trials);

/// Throws ToolError (file, line, mend) where a line is damaged, or not the next trial of the campaign that
/// begins at `first_seed`.
std::vector<Trial> read_trials(const std::filesystem::path& path, std::uint64_t first_seed,
                               Abundance abundance = Abundance::kUsual);

/// Fills what a trial is to find out.
using RunTrial = std::function<void(Trial& trial)>;

/// `trials` trials in all, from `first_seed` on, kept in `folder`/trials.csv. Those that are there already
/// are taken from it, and the file is rewritten, whole, after each new one. More than `trials` in the file
/// are all kept. Throws ToolError where the folder cannot be written (before the first trial) or its file is
/// not this campaign's.
std::vector<Trial> run_campaign(const std::filesystem::path& folder, std::size_t trials,
                                std::uint64_t first_seed, const RunTrial& run,
                                Abundance abundance = Abundance::kUsual);

}  // namespace cairn::ground
