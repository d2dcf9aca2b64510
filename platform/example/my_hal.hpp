// SPDX-License-Identifier: Apache-2.0
/// What main.cpp sees of its board.
#pragma once

namespace my {

/// Sleeps until there is a pair or a command, and no longer than half the watchdog's period: a rover that
/// stands gets neither for hours, and the main loop must come round to cycle(), which kicks.
void wait_for_work();

/// Where the flight module cannot go on.
[[noreturn]] void safe_state();

}  // namespace my
