/// The cyclic executive's table. A minor frame is one stereo pair; `kMinorFrames` of them are a major frame.
///
/// In each minor frame the rows run in order, each with its own budget of operations (core/work_budget.hpp).
/// A row that runs out of it before its work is done is an overrun, counted; what follows from it is told
/// beside each task.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mission_cfg.hpp"

namespace cairn::cfg {

enum class Task : std::uint8_t {
  kVo,        ///< an overrun goes on in the next minor frame, whose pair is dropped and counted
  kBoulders,  ///< an overrun is abandoned: the frame adds nothing to the local map
  kFixBegin,  ///< snapshot of the local map, its tracks merged before; an overrun begins no fix
  kFix,       ///< search and verdict, over as many minor frames as they take
  kFixApply,  ///< the correction, at these frames and no other; a search that is not done goes on to the next
              ///< of them (the paper's ICP is late, and counted)
};
inline constexpr std::size_t kTaskCount = 5;

struct ScheduleRow {
  Task task;
  int first_minor;  ///< of the major frame, 0 ...
  int last_minor;
  std::uint32_t ops;  ///< in each of these minor frames
};

inline constexpr int kMinorFrames = 30;  ///< a fix every 30 frames, as in the paper

/// What an operation of each task weighs: its time, in operations of VO. A weighted operation takes nearly
/// the same time in each task, so that a budget is a time: how long on which target is in
/// timing_budget.toml, measured by `make profile`.
inline constexpr std::uint32_t kTaskWeight[kTaskCount] = {1, 4, 4, 4, 4};
static_assert(static_cast<std::size_t>(Task::kFixApply) + 1 == kTaskCount, "a weight for each task");

/// The same of rectifying a raw pair, which is no row: it is done before VO begins, in the mission's minor
/// frame all the same. 13 cycles of the RAD750 an operation against 2.7.
inline constexpr std::uint32_t kRawPairWeight = 5;

/// The same of a map's validation and of an upload's, done between minor frames: 7 cycles of the RAD750,
/// and 14 of the LEON3, to 2.7 and 4.7.
inline constexpr std::uint32_t kMapWeight = 3;

/// Merges the tracks of a full local map twice over, each against all: by the square of their number. With
/// less no fix ever begins where boulders are many.
inline constexpr std::uint32_t kFixBeginOps = 2 * static_cast<std::uint32_t>(kMaxLocalBoulders) *
                                                  (10 + 3 * static_cast<std::uint32_t>(kMaxLocalBoulders)) +
                                              5'000;

/// `make check-schedule`: in no minor frame do the rows take longer than the mission's frame on a target.
inline constexpr ScheduleRow kSchedule[] = {
    {Task::kVo, 0, 29, kVoOps},
    {Task::kBoulders, 0, 29, kBoulderOps},
    {Task::kFixBegin, 24, 24, kFixBeginOps},
    {Task::kFix, 0, 29, 2'000'000},
    {Task::kFixApply, 0, 22, 10'000},  // of a search that was not done by the row below
    {Task::kFixApply, 29, 29, 10'000},
};
inline constexpr int kScheduleRows = sizeof(kSchedule) / sizeof(kSchedule[0]);

/// Weighted operations that one call of the executive's cycle may spend: how long the caller's main loop may
/// be held up. One unit more, at most.
inline constexpr std::uint32_t kSliceOps = 400'000;

/// Whether the row is one of this minor frame.
constexpr bool is_of(const ScheduleRow& row, int minor) {
  return row.first_minor <= minor && minor <= row.last_minor;
}

/// A fix that has begun is due in the last minor frame: if its search is done, it is applied there.
inline constexpr int kFixDueMinor = kMinorFrames - 1;

/// Goes through a major frame as the executive does: its minor frames in order, in each of them the rows
/// in theirs. In each minor frame VO is first, and the only VO. One fix begins, is worked on before it is
/// applied, and is applied when it is due and not before. What an apply row finds open before that fix
/// begins is of the major frame before.
constexpr bool is_sound(const ScheduleRow* rows, int count) {
  for (int i = 0; i < count; ++i) {
    if (rows[i].first_minor < 0 || rows[i].last_minor < rows[i].first_minor ||
        rows[i].last_minor >= kMinorFrames || rows[i].ops == 0) {
      return false;
    }
  }
  enum class Fix { kNone, kBegun, kWorkedOn, kApplied } fix = Fix::kNone;
  for (int minor = 0; minor < kMinorFrames; ++minor) {
    bool first = true;
    for (int i = 0; i < count; ++i) {
      if (!is_of(rows[i], minor)) continue;
      if ((rows[i].task == Task::kVo) != first) return false;
      first = false;
      if (rows[i].task == Task::kFixBegin) {
        if (fix != Fix::kNone) return false;
        fix = Fix::kBegun;
      } else if (rows[i].task == Task::kFix && fix == Fix::kBegun) {
        fix = Fix::kWorkedOn;
      } else if (rows[i].task == Task::kFixApply && fix != Fix::kNone) {
        if (fix != Fix::kWorkedOn || minor != kFixDueMinor) return false;
        fix = Fix::kApplied;
      }
    }
    if (first) return false;
  }
  return fix == Fix::kApplied;
}
static_assert(is_sound(kSchedule, kScheduleRows),
              "schedule: VO first and always; a fix begins, is worked on, and is applied when it is due");

/// The minor frame in which a fix begins.
constexpr int fix_begin_minor() {
  int begin = -1;
  for (const ScheduleRow& row : kSchedule) {
    if (row.task == Task::kFixBegin) begin = row.first_minor;
  }
  return begin;
}
inline constexpr int kFixBeginMinor = fix_begin_minor();

}  // namespace cairn::cfg
