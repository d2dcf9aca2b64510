// The longest units of work of a mission as the compiler has them, a line a unit, for wcet.py.
#include "app/unit_bounds.hpp"

#include <cstdio>
#include <iterator>

#include "image/remap.hpp"

int main() {
  constexpr const char* kNames[] = {"vo", "boulders", "fix begin", "fix", "fix apply"};
  static_assert(std::size(kNames) == cairn::cfg::kTaskCount);
  for (const cairn::app::UnitBound& bound : cairn::app::kUnitBounds) {
    const auto task = static_cast<std::size_t>(bound.task);
    std::printf("unit\t%s\t%s\t%lu\t%lu\n", kNames[task], bound.what, static_cast<unsigned long>(bound.ops),
                static_cast<unsigned long>(cairn::cfg::kTaskWeight[task]));
  }
  std::printf("unit\tvo raw pair\ta row\t%lu\t%lu\n", static_cast<unsigned long>(cairn::RemapJob::kMostUnit),
              static_cast<unsigned long>(cairn::cfg::kRawPairWeight));
  return 0;
}
