// The map reader: any bytes are validated, whatever may be used is read by windows, heights too, and again
// after an upset.
//
// Input: options, a place to look at, then the map.
#include <cmath>

#include "fuzz/fuzz_support.hpp"

using namespace cairn;
using namespace cairn::fuzz;

namespace {

MapBoulders boulders;

WindowStatus look(const OrbitalMap& map, const Vec2& p_map_m, double radius_m) {
  boulders.clear();
  const WindowStatus status = map.window(p_map_m, radius_m, boulders);
  for (const MapBoulder& b : boulders) {
    CAIRN_ASSERT((b.p_map_m - p_map_m).norm() <= radius_m * (1.0 + 1e-9) + 1e-6);
    CAIRN_ASSERT(b.confidence_percent <= 100);
  }
  return status;
}

/// All heights; of a map that held, all tiles' are whole.
void look_at_heights(const OrbitalMap& map, bool whole) {
  const MapHeights& grid = map.heights();
  if (grid.spacing == 0) return;
  for (std::uint32_t t = 0; t < map.tiles(); ++t) {
    MapTile tile;
    if (!map.tile(t, tile) || !OrbitalMap::tile_holds(t, tile) || tile.height_bytes == 0) continue;
    cmap::Post posts[cmap::kMaxPosts];
    cmap::HeightDecoder decoder;
    cmap::HeightStep step = cmap::HeightStep::kCorrupt;
    if (decoder.start(grid.posts(tile.shape.width), grid.posts(tile.shape.height), tile.heights(),
                      tile.height_bytes))
      step = cmap::HeightStep::kMore;
    while (step == cmap::HeightStep::kMore) {
      step = decoder.read(posts);
      for (const cmap::Post& post : posts)
        CAIRN_ASSERT(post.value() >= -cmap::kMaxPostValue && post.value() <= cmap::kMaxPostValue);
    }
    CAIRN_ASSERT(!whole || step == cmap::HeightStep::kEnd);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Input in(data, size);
  const std::uint8_t options = in.u8();
  const std::uint16_t east = in.u16();
  const std::uint16_t north = in.u16();
  const std::uint32_t flip = in.u16();
  Block map(in, in.left());
  if ((options & 1U) == 0) repair_map(map.data(), map.size());

  OrbitalMap usable;
  const MapStatus status = validate(map, (options & 2U) != 0 ? 1 : UINT32_MAX, usable);
  if (!may_be_used(status)) return 0;
  const Vec2 extent = usable.extent_m();
  const Vec2 place = usable.origin_map_m() + Vec2(extent.x() * east / 65535.0, extent.y() * north / 65535.0);
  static_cast<void>(look(usable, place, 0.05 * extent.norm()));
  const WindowStatus all = look(usable, place, 2.0 * extent.norm() + 1.0);
  if (status == MapStatus::kUsable) {
    CAIRN_ASSERT(all == WindowStatus::kUsable || all == WindowStatus::kWindowFull);
    if (all == WindowStatus::kUsable) CAIRN_ASSERT(boulders.size() == usable.count());
  }
  look_at_heights(usable, status == MapStatus::kUsable);
  // An upset of the memory that the map lies in.
  map.data()[flip % map.size()] ^= static_cast<std::uint8_t>(1U << (options >> 5U));
  static_cast<void>(look(usable, place, 2.0 * extent.norm() + 1.0));
  look_at_heights(usable, false);
  return 0;
}
