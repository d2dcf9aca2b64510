/// Non-volatile memory that holds the uplinked orbital map.
#pragma once

#include <cstddef>
#include <cstdint>

namespace cairn::hal {

struct Bytes {
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
};

/// The map bank, readable in place; empty where there is no map. Valid until the bank is written again.
Bytes map_bank();

}  // namespace cairn::hal
