/// What fixes were worth, by truth.
///
/// The error is that of the rover's position in x and y. A fix that was applied is
///   right     where the pose after it is within 0.15 m of truth,
///   false     where it is more than 0.3 m and more than three sigmas off: believed, and wrong,
///   weak      else: in between, or farther off and known to be.
/// One with any other status is declined. What the error was before counts for nothing: a fix that makes a
/// lost rover less lost and certain is false. Sigma is the root of the trace of the position's covariance
/// after the fix, as in the point-set trials (unit_tests/bench/bench_fix.cpp).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "replay/replay.hpp"

namespace cairn::ground {

enum class FixVerdict : std::uint8_t { kRight, kWeak, kDeclined, kFalse };
inline constexpr int kFixVerdicts = 4;
inline constexpr double kRightWithin_m = 0.15;
inline constexpr double kFalseBeyond_m = 0.3;

/// `sigma_axis_m`: after the fix, of x and y each, in the mean (FixReport::sigma_xy_m).
FixVerdict judge_fix(bool applied, double after_m, double sigma_axis_m);
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
