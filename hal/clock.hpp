/// Time since an arbitrary start, microseconds, never backwards. For telemetry only: no result depends on it.
#pragma once

#include <cstdint>

namespace cairn::hal {

std::uint64_t clock_us();

}  // namespace cairn::hal
