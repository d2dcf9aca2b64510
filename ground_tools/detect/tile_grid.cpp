#include "detect/tile_grid.hpp"

namespace cairn::ground {
namespace {

constexpr int kLeastSide = 2048;
constexpr int kReachesInSide = 16;  ///< so that what is read and computed twice stays near an eighth
constexpr std::int64_t kWindowBytes = std::int64_t{12} << 20;

}  // namespace

TileGrid tiles_of(const RasterFacts& facts, int side, int reach) {
  TileGrid grid;
  grid.image = facts.box();
  if (side > 0) {
    grid.tile_width = grid.tile_height = side;
    return grid;
  }
  const int suitable = std::max(kLeastSide, kReachesInSide * reach);
  grid.tile_width = grid.tile_height = suitable;
  if (facts.block_width >= facts.width) {
    const std::int64_t most = std::max<std::int64_t>(suitable, kWindowBytes / (2 * reach + 1));
    const std::int64_t columns = (facts.width + most - 1) / most;
    grid.tile_width = static_cast<int>((facts.width + columns - 1) / columns);
    // A row of tiles is a thread's piece of work: not all of a small image.
    grid.tile_height = std::max(256, suitable / 2);
  }
  return grid;
}

}  // namespace cairn::ground
