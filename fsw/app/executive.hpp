/// The cyclic executive: walks the schedule table of mission_cfg, a minor frame a stereo pair,
/// in slices of weighted operations (cfg::kTaskWeight).
///
/// What is done when depends only on the table and on what the tasks themselves ask for, not on how the
/// caller slices: the results are the same to the bit for every slice, as long as no row overruns its budget.
#pragma once

#include <array>
#include <cstdint>

#include "core/enum_count.hpp"
#include "core/work_budget.hpp"
#include "localizer/localizer.hpp"
#include "schedule.hpp"

namespace cairn::app {

static_assert(enum_has<cfg::Task, cfg::kTaskCount>());

struct ExecutiveCounts {
  std::array<std::uint32_t, cfg::kTaskCount> overruns{};  ///< by task
  std::uint32_t dropped_pairs = 0;  ///< pairs that came while VO was still at the one before
};

/// What the last minor frame took.
struct MinorWork {
  std::uint32_t ops[cfg::kTaskCount] = {};
};

class Executive {
 public:
  void init();
  /// A new site: a major frame begins. Counts stay.
  void restart();

  /// Begins a minor frame with a new pair (borrowed until the next one). Where VO has not finished the pair
  /// before, this one is dropped and counted, and VO goes on.
  LocalizerStatus begin_minor(Localizer& localizer, const ImageU8& left, const ImageU8& right,
                              const Pose3* motion_prior);
  /// Goes on with the minor frame; kDone when all its rows are through.
  Progress run(Localizer& localizer, WorkBudget& slice);

  bool busy() const { return busy_; }
  /// True where the minor frame that just ended closed a registration, and in the last of a major frame.
  bool fix_closed() const { return fix_closed_; }
  /// 0 ... kMinorFrames - 1, of the minor frame that runs or ran last.
  int minor() const { return minor_; }
  const ExecutiveCounts& counts() const { return counts_; }
  const MinorWork& work() const { return work_; }

 private:
  Progress step(Localizer& localizer, cfg::Task task, WorkBudget& budget);

  ExecutiveCounts counts_;
  MinorWork work_;
  int minor_ = cfg::kMinorFrames - 1;
  int row_ = 0;
  std::uint32_t row_left_ = 0;
  bool busy_ = false;
  bool fix_closed_ = false;
};

}  // namespace cairn::app
