// SPDX-License-Identifier: Apache-2.0
// An integrator's own main loop: the flight module, a slice at a time, beside whatever else the processor
// does. The body of a task under an RTOS is the same. What Cairn asks of the board is in my_hal.cpp.
#include "app/flight_app.hpp"
#include "my_hal.hpp"

int main() {
  using cairn::app::FlightApp;
  using cairn::app::root;

  if (root.init(cairn::LocalizerParams(), cairn::app::mission_rig()) != cairn::LocalizerStatus::kReady)
    my::safe_state();
  for (;;) {
    // Kicks the watchdog, does some cfg::kSliceOps operations, and is back.
    const FlightApp::State left = root.cycle();
    // The processor's other work belongs here.
    if (left == FlightApp::State::kIdle) my::wait_for_work();  // not for ever: only cycle() kicks
  }
}
