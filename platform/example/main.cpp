// SPDX-License-Identifier: Apache-2.0
// An integrator's own main loop on a bare board: the flight module, a slice at a time, beside whatever else
// the processor does. What Cairn asks of the board is in my_hal.cpp.
#include "app/flight_app.hpp"
#include "my_hal.hpp"
#include "platform/bare/board.h"

int main() {
  using cairn::app::FlightApp;
  using cairn::app::root;

  constexpr int kFrames = 6;
  if (root.init(cairn::LocalizerParams(), cairn::app::mission_rig()) != cairn::LocalizerStatus::kReady)
    return 1;

  unsigned long slices = 0;
  while (my::frames < kFrames) {
    const FlightApp::State left = root.cycle();  // some cfg::kSliceOps operations, then it is back
    ++slices;
    // The processor's other work belongs here.
    if (left == FlightApp::State::kIdle) break;  // a real board sleeps until its camera's interrupt
  }
  my::print("slices ", static_cast<long>(slices), "");
  my::print(", watchdog kicked ", static_cast<long>(my::kicks), "");
  my::print(", stack ", static_cast<long>(board_stack_used()), " bytes");
  my::print(", frames as they should be ", my::frames_right, "");
  my::print(" of ", my::frames, "\n");
  return my::frames == kFrames && my::frames_right == kFrames ? 0 : 1;
}
