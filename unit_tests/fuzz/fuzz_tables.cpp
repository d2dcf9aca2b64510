// The ground's readers of text: tables of boulders and way-points, rows of numbers, trajectories,
// calibrations. Any bytes are read, or refused in one line.
//
// Input: which reader, then the file.
#include "base/boulder_table.hpp"
#include "base/number_table.hpp"
#include "base/waypoints.hpp"
#include "dataset/rig_file.hpp"
#include "dataset/trajectory.hpp"
#include "fuzz/fuzz_file.hpp"

using namespace cairn;
using namespace cairn::fuzz;
using namespace cairn::ground;

namespace {

void read(unsigned reader, const std::filesystem::path& path) {
  switch (reader % 5U) {
    case 0:
      for (const TableBoulder& b : read_csv(path)) CAIRN_ASSERT(b.diameter_m > 0.0 && b.p_map_m.allFinite());
      return;
    case 1: CAIRN_ASSERT(read_waypoints(path).size() >= 2); return;
    case 2:
      for (const NumberRow& row : read_number_rows(path)) CAIRN_ASSERT(row.line > 0);
      return;
    case 3: static_cast<void>(read_tum(path)); return;
    default: {
      const CameraPair pair = read_rig({path});
      CAIRN_ASSERT(pair.T_right_left.t.allFinite());
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::filesystem::path path = file_of(data + 1, size - 1);
  refused_in_one_line([&] { read(data[0], path); });
  return 0;
}
