// The mission's schedule as the compiler has it, a line a row, for schedule.py.
#include <cstdio>
#include <iterator>

#include "image/remap.hpp"
#include "mission_cfg.hpp"
#include "schedule.hpp"

int main() {
  constexpr const char* kNames[] = {"vo", "boulders", "fix begin", "fix", "fix apply"};
  static_assert(std::size(kNames) == cairn::cfg::kTaskCount);
  std::printf("mission\t%s\nminor frames\t%d\nslice\t%lu\n", cairn::cfg::kMission.name,
              cairn::cfg::kMinorFrames, static_cast<unsigned long>(cairn::cfg::kSliceOps));
  for (const cairn::cfg::ScheduleRow& row : cairn::cfg::kSchedule) {
    const auto task = static_cast<std::size_t>(row.task);
    std::printf("row\t%s\t%d\t%d\t%lu\t%lu\n", kNames[task], row.first_minor, row.last_minor,
                static_cast<unsigned long>(row.ops),
                static_cast<unsigned long>(cairn::cfg::kTaskWeight[task]));
  }
  // Of a rig whose pairs come raw: what a mission pays at most, before its rows begin.
  std::printf("row\tvo raw pair\t0\t%d\t%lu\t%lu\n", cairn::cfg::kMinorFrames - 1,
              static_cast<unsigned long>(2 * cairn::RemapJob::kMostUnit * cairn::cfg::kImageHeight),
              static_cast<unsigned long>(cairn::cfg::kRawPairWeight));
  return 0;
}
