// The map reader: any bytes are validated, whatever may be used is read by windows, heights too, and again
// after an upset. Ground is held against the heights, and what comes of it against height and tilt: whatever
// steps and sigmas a map tells, all stays finite.
//
// Input: options, a place to look at, then the map.
#include <cmath>

#include "fuzz/fuzz_support.hpp"
#include "localizer/attitude_fusion.hpp"
#include "localizer/ground_height.hpp"

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

/// A plane about `place`, some of it beyond the map, `z_m` from the base of the map's heights.
void hold_ground_against(const OrbitalMap& map, const Vec2& place, double z_m, std::uint32_t ops) {
  static SurfacePoints points;
  static GroundHeightJob job;
  static AttitudeFusion tilt;
  const Vec3 rover(place.x(), place.y(), map.heights().base_m + z_m);
  const double step_m = 0.01 + 0.05 * map.extent_m().norm();
  points.clear();
  for (int i = 0; i < 150; ++i) {
    SurfacePoint p;
    p.p_site_m = rover + Vec3((i % 15 - 4) * step_m, (i / 15 - 5) * step_m, 0.01 * (i % 7));
    p.sigma_height_m = 0.01F;
    points.append(p);
  }
  if (job.start({}, map, points, Pose3(), rover, 0.05) == GroundHeightStatus::kRunning) run(job, ops);
  if (job.status() != GroundHeightStatus::kFitted) return;
  const GroundOffset& seen = job.result();
  tilt.init({});
  for (int n = 0; n < 3; ++n) {
    const TiltResult r = tilt.ground(seen.offset, seen.covariance, seen.least);
    CAIRN_ASSERT(std::isfinite(r.z_m) && std::isfinite(r.turn_map.norm()));
    CAIRN_ASSERT(std::isfinite(tilt.sigma_z_m()) && std::isfinite(tilt.sigma_tilt_rad()));
    for (int i = 0; i < 3; ++i)
      CAIRN_ASSERT(std::isfinite(seen.offset[i]) && seen.covariance(i, i) >= seen.least[i] * seen.least[i]);
    tilt.propagate({Vec2(1.0, 0.5), 0.3, Mat3::Identity() * 1e-6});
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
  const double z_m = (static_cast<double>(flip) - 32768.0) * ((options & 4U) != 0 ? 10.0 : 1e-5);
  const std::uint32_t ops = (options & 2U) != 0 ? 1 : UINT32_MAX;
  hold_ground_against(usable, place, z_m, ops);
  // An upset of the memory that the map lies in.
  map.data()[flip % map.size()] ^= static_cast<std::uint8_t>(1U << (options >> 5U));
  static_cast<void>(look(usable, place, 2.0 * extent.norm() + 1.0));
  look_at_heights(usable, false);
  hold_ground_against(usable, place, z_m, ops);
  return 0;
}
