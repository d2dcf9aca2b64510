#include "campaign/fix_verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "replay/status_names.hpp"

namespace cairn::ground {

FixVerdict judge_fix(bool applied, double after_m, double sigma_axis_m) {
  if (!applied) return FixVerdict::kDeclined;
  if (after_m <= kRightWithin_m) return FixVerdict::kRight;
  const double sigma_m = std::sqrt(2.0) * sigma_axis_m;
  return after_m > kFalseBeyond_m && after_m > 3.0 * sigma_m ? FixVerdict::kFalse : FixVerdict::kWeak;
}

const char* name_of(FixVerdict verdict) {
  static const char* const names[kFixVerdicts] = {"right", "weak", "declined", "false"};
  return names[static_cast<int>(verdict)];
}

std::vector<JudgedFix> judge_fixes(const Replay& replay, const Drive& drive) {
  const Pose3 T_cam_rover = rig_of(drive).T_rover_cam.inverse();
  std::vector<JudgedFix> judged;
  for (const app::FixReport& fix : replay.fixes) {
    // The frame's own report tells of the pose after the fix.
    const auto frame = std::find_if(replay.frames.begin(), replay.frames.end(),
                                    [&](const ReplayFrame& f) { return f.report.number == fix.number; });
    if (frame == replay.frames.end()) continue;
    const auto truth = drive.truth_rover(frame->index);
    if (!truth) continue;
    const bool applied = fix.status == static_cast<std::uint8_t>(FixStatus::kApplied);
    const Vec2 error_m = ((frame->report.T_map_cam * T_cam_rover).t - truth->t).head<2>();
    const Vec2 moved_m = applied ? Vec2(fix.dx_m, fix.dy_m) : Vec2(0.0, 0.0);
    JudgedFix j;
    j.report = fix;
    j.after_m = error_m.norm();
    j.before_m = Vec2(error_m - moved_m).norm();
    j.verdict = judge_fix(applied, j.after_m, static_cast<double>(fix.sigma_xy_m));
    judged.push_back(j);
  }
  return judged;
}

std::string to_csv_rows(const std::vector<JudgedFix>& fixes, const char* vo) {
  std::string text;
  for (const JudgedFix& f : fixes) {
    text += fmt::format("{},{},{},{},{:.4f},{:.4f},{:.4f},{},{:.4f},{},{}\n", vo, f.report.number,
                        fix_status_name(f.report.status), name_of(f.verdict), f.before_m, f.after_m,
                        f.report.sigma_xy_m, f.report.pairs, f.report.rms_m, f.report.local_boulders,
                        f.report.map_boulders);
  }
  return text;
}

}  // namespace cairn::ground
