/// What fixes were worth, by truth.
///
/// The error is that of the rover's position in x and y. A fix that was applied is
///   right     where the pose after it is within 0.15 m of truth,
///   false     where it is farther than that, and farther than the pose before it,
///   weak      else: farther than that, but no farther than before.
/// One with any other status is declined.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "replay/replay.hpp"

namespace cairn::ground {

enum class FixVerdict : std::uint8_t { kRight, kWeak, kDeclined, kFalse };
inline constexpr int kFixVerdicts = 4;
inline constexpr double kRightWithin_m = 0.15;

FixVerdict judge_fix(bool applied, double before_m, double after_m);
const char* name_of(FixVerdict verdict);

struct JudgedFix {
  app::FixReport report;
  FixVerdict verdict = FixVerdict::kDeclined;
  double before_m = 0.0;  ///< error of the pose that the fix found
  double after_m = 0.0;   ///< and that it left; the same where it was declined
};

/// The fixes of a replay over `drive`, whose true rover poses are known.
std::vector<JudgedFix> judge_fixes(const Replay& replay, const Drive& drive);

/// As CSV, with `vo` in the first column; without the line of names.
std::string to_csv_rows(const std::vector<JudgedFix>& fixes, const char* vo);
inline constexpr const char* kFixColumns =
    "vo,frame,status,verdict,before_m,after_m,sigma_xy_m,pairs,rms_m,local_boulders,map_boulders\n";

}  // namespace cairn::ground
