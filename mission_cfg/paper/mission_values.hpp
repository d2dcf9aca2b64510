/// The paper's rig (METHOD section IV), 512 x 384.
#pragma once

#include "mission.hpp"

namespace cairn::cfg {

inline constexpr Mission kMission{};

}  // namespace cairn::cfg
