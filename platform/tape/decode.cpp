// An image that validates the map it holds and takes a window of all of it:
// what `make bench-decode` measures.
#include <cstdio>

#include "orbital_map/orbital_map.hpp"

extern "C" const unsigned char cairn_tape_begin[];
extern "C" const unsigned char cairn_tape_end[];

int main() {
  static cairn::MapValidation validation;
  static cairn::MapBoulders boulders;
  cairn::WorkBudget budget = cairn::WorkBudget::unlimited();
  const auto size = static_cast<std::size_t>(cairn_tape_end - cairn_tape_begin);
  if (validation.start(cairn_tape_begin, size) != cairn::MapStatus::kChecking ||
      validation.step(budget) != cairn::Progress::kDone || !validation.result().usable()) {
    std::printf("the map cannot be used\n");
    return 1;
  }
  const cairn::OrbitalMap& map = validation.result();
  const auto status = map.window(map.origin_map_m(), 1e9, boulders);
  std::printf("boulders %lu window %lu\n", static_cast<unsigned long>(map.count()),
              static_cast<unsigned long>(boulders.size()));
  return status == cairn::WindowStatus::kUsable ? 0 : 1;
}
