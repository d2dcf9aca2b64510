// An image that plays its tape and says what came down: what `make profile` measures. Also the shape of an
// integrator's main loop: see player.cpp.
#include <climits>
#include <cstdio>

#include "platform/tape/player.hpp"

// SLICE=ops of make: of one cycle, where not the mission's.
#ifndef CAIRN_SLICE_OPS
#define CAIRN_SLICE_OPS cairn::cfg::kSliceOps
#endif

namespace {

/// What `cairn profile` divides a job's cycles by.
void tell_ops(const cairn::app::FrameReport& frame) {
  std::printf("ops of frame %lu: vo %lu, boulders %lu, fix %lu\n", static_cast<unsigned long>(frame.number),
              static_cast<unsigned long>(frame.vo_ops), static_cast<unsigned long>(frame.boulder_ops),
              static_cast<unsigned long>(frame.fix_ops));
}

}  // namespace

int main() {
  static cairn::tape::Telemetry t;
  t.on_frame = tell_ops;
  if (cairn::tape::play(INT_MAX, t, CAIRN_SLICE_OPS) != cairn::tape::TapeStatus::kReady) {
    std::printf("the tape cannot be played\n");
    return 1;
  }
  std::printf("%d frames, %d fixes applied; poses %08lX, fixes %08lX, boulders %08lX, rest %08lX\n", t.frames,
              t.applied, static_cast<unsigned long>(t.poses), static_cast<unsigned long>(t.fixes),
              static_cast<unsigned long>(t.boulders), static_cast<unsigned long>(t.rest));
  return t.bad == 0 ? 0 : 1;
}
