// An image that plays its tape and says what came down: what `make profile` measures. Also the shape of an
// integrator's main loop: see player.cpp.
#include <climits>
#include <cstdio>

#include "platform/tape/player.hpp"

int main() {
  static cairn::tape::Telemetry t;
  if (cairn::tape::play(INT_MAX, t) != cairn::tape::TapeStatus::kReady) {
    std::printf("the tape cannot be played\n");
    return 1;
  }
  std::printf("%d frames, %d fixes applied; poses %08lX, fixes %08lX, boulders %08lX, rest %08lX\n", t.frames,
              t.applied, static_cast<unsigned long>(t.poses), static_cast<unsigned long>(t.fixes),
              static_cast<unsigned long>(t.boulders), static_cast<unsigned long>(t.rest));
  return t.bad == 0 ? 0 : 1;
}
