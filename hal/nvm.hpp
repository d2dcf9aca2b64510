// SPDX-License-Identifier: Apache-2.0
/// Non-volatile memory that holds the uplinked orbital map: two banks, one in use, the other spare.
///
/// Both are memory that the processor reads and writes byte by byte where it lies (MRAM, EEPROM, or RAM that
/// the platform loads and saves itself): flight code reads a map in place, and puts a new one together in
/// place, too. A bank never moves.
#pragma once

#include <cstddef>
#include <cstdint>

namespace cairn::hal {

struct Bytes {
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
};

struct Room {
  std::uint8_t* data = nullptr;
  std::size_t size = 0;
};

/// The map bank in use, readable in place; empty where there is no map. Valid until the bank
/// is written again.
Bytes map_bank();

/// The other bank, to be written in place, all of it; empty where the platform has none, so that uploads are
/// refused. The same until `switch_map_banks`.
Room spare_map_bank();

/// From now on, and after a reset, the spare bank is the one in use, and the other is spare. All of it or
/// nothing. False: nothing has changed.
[[nodiscard]] bool switch_map_banks();

}  // namespace cairn::hal
