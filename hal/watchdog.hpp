// SPDX-License-Identifier: Apache-2.0
/// The watchdog, which resets the processor unless it is kicked in time.
#pragma once

namespace cairn::hal {

/// Once a cycle, and nowhere else: the main loop must come round when it is idle, too.
void watchdog_kick();

}  // namespace cairn::hal
