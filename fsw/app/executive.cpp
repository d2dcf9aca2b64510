#include "app/executive.hpp"

namespace cairn::app {
namespace {

std::uint32_t saturated(std::uint64_t ops) {
  return ops < UINT32_MAX ? static_cast<std::uint32_t>(ops) : UINT32_MAX;
}

static_assert(cfg::kFixBeginOps >=
                  2 * cfg::kMaxLocalBoulders * BoulderTracks::settle_ops(cfg::kMaxLocalBoulders) +
                      Localizer::kBeginFixOps,
              "schedule: with the local map full, no fix would begin");

}  // namespace

void Executive::init() { *this = Executive(); }

void Executive::restart() {
  const ExecutiveCounts counts = counts_;
  init();
  counts_ = counts;
}

LocalizerStatus Executive::begin_minor(Localizer& localizer, const ImageU8& left, const ImageU8& right,
                                       const Pose3* motion_prior) {
  CAIRN_ASSERT(!busy_);
  if (localizer.vo_open()) {
    ++counts_.dropped_pairs;
  } else {
    const LocalizerStatus status = localizer.begin_frame(left, right, motion_prior);
    if (status != LocalizerStatus::kReady) return status;
  }
  minor_ = (minor_ + 1) % cfg::kMinorFrames;
  work_ = {};
  row_ = 0;
  row_left_ = cfg::kSchedule[0].ops;
  fix_closed_ = false;
  busy_ = true;
  return LocalizerStatus::kReady;
}

Progress Executive::run(Localizer& localizer, WorkBudget& slice) {
  while (busy_) {
    const cfg::ScheduleRow& row = cfg::kSchedule[row_];
    bool over = !cfg::is_of(row, minor_);
    if (!over) {
      if (slice.left() == 0) return Progress::kMore;
      const std::uint32_t weight = cfg::kTaskWeight[static_cast<int>(row.task)];
      const std::uint32_t room = slice.left() < weight ? 1U : slice.left() / weight;
      WorkBudget share(room < row_left_ ? room : row_left_);
      const bool done = step(localizer, row.task, share) == Progress::kDone;
      slice.charge(share.spent() * weight);
      const std::uint32_t spent = saturated(share.spent());
      row_left_ = row_left_ > spent ? row_left_ - spent : 0;
      std::uint32_t& total = work_.ops[static_cast<int>(row.task)];
      total = saturated(static_cast<std::uint64_t>(total) + spent);
      // A registration may take all its minor frames; whether it was late is told when it is due.
      if (!done && row_left_ == 0 && row.task != cfg::Task::kFix)
        ++counts_.overruns[static_cast<int>(row.task)];
      over = done || row_left_ == 0;
    }
    if (!over) continue;
    ++row_;
    if (row_ == cfg::kScheduleRows) {
      busy_ = false;
    } else {
      row_left_ = cfg::kSchedule[row_].ops;
    }
  }
  return Progress::kDone;
}

Progress Executive::step(Localizer& localizer, cfg::Task task, WorkBudget& budget) {
  const bool due = minor_ == cfg::kFixDueMinor;  // the fix of this major frame
  const bool open = localizer.last_fix().status == FixStatus::kRunning;
  switch (task) {
    case cfg::Task::kVo: return localizer.step_vo(budget);
    case cfg::Task::kBoulders: return localizer.step_boulders(budget);
    case cfg::Task::kFixBegin:
      if (localizer.prepare_fix(budget) == Progress::kMore) return Progress::kMore;
      if (!budget.take(Localizer::kBeginFixOps)) return Progress::kMore;
      localizer.begin_fix();
      return Progress::kDone;
    case cfg::Task::kFix: return localizer.step_fix(budget);
    case cfg::Task::kFixApply:
      if (!due && !open) return Progress::kDone;
      if (!budget.take(Localizer::kApplyFixOps)) return Progress::kMore;
      localizer.apply_fix();
      fix_closed_ = due || localizer.last_fix().status != FixStatus::kRunning;
      if (fix_closed_ && localizer.last_fix().status == FixStatus::kLate)
        ++counts_.overruns[static_cast<int>(cfg::Task::kFix)];
      return Progress::kDone;
  }
  return Progress::kDone;
}

}  // namespace cairn::app
