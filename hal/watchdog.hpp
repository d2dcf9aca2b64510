// SPDX-License-Identifier: Apache-2.0
/// The watchdog, which resets the processor unless it is kicked in time.
#pragma once

namespace cairn::hal {

/// Once a cycle, and nowhere else.
void watchdog_kick();

}  // namespace cairn::hal
