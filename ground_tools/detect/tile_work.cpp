#include "detect/tile_work.hpp"

#include <cmath>

namespace cairn::ground {
namespace {

constexpr int kShadowTilePx = 6144;

/// A FoundBoulder as plain numbers.
struct Plain {
  std::int32_t y = 0;
  std::int32_t x = 0;
  std::int64_t crater = 0;
  double number[9] = {};
};

void put(ByteWriter& to, const FoundBoulder& found) {
  const TableBoulder& b = found.boulder;
  to.put(Plain{found.y,
               found.x,
               found.crater ? 1 : 0,
               {b.p_map_m.x(), b.p_map_m.y(), b.diameter_m, b.area_m2, b.contrast, b.elongation, b.height_m,
                b.confidence, b.ground_z_m}});
}

FoundBoulder found_boulder(ByteReader& from) {
  const auto plain = from.get<Plain>();
  const double* const n = plain.number;
  FoundBoulder found{plain.y, plain.x, {}, plain.crater != 0};
  TableBoulder& b = found.boulder;
  b.p_map_m = Vec2(n[0], n[1]);
  b.diameter_m = n[2];
  b.area_m2 = n[3];
  b.contrast = n[4];
  b.elongation = n[5];
  b.height_m = n[6];
  b.confidence = n[7];
  b.ground_z_m = n[8];
  return found;
}

Bytes to_bytes(const TileBoulders& tile) {
  Bytes bytes;
  ByteWriter writer(bytes);
  writer.put_number(tile.found.size());
  for (const FoundBoulder& found : tile.found) put(writer, found);
  writer.put_all(tile.shared.open);
  for (const auto* side : {&tile.shared.top, &tile.shared.bottom, &tile.shared.left, &tile.shared.right})
    writer.put_all(*side);
  writer.put(tile.content);
  return bytes;
}

Bytes otsu_boulders(RasterReader& reader, const RasterFacts& facts, const DetectorParams& params,
                    const RoundInput& input, const PixelBox& tile) {
  const DetectorPixels pixels = on_pixels(params, facts.geo.pixel_m());
  const BlockGrid grid(facts.width, facts.height, pixels.block);
  TileBoulders result;
  result.shared = dark_components(reader, input.range, facts, grid, input.darkness, pixels, tile);
  result.found = boulders_of(result.shared.closed, params, facts.geo);
  return to_bytes(result);
}

/// Ordered by the pixel of the centroid, which lies in the tile.
Bytes shadow_boulders(RasterReader& reader, const RasterFacts& facts, const Detection& detection,
                      const RoundInput& input, const PixelBox& tile) {
  const ShadowView view = shadow_view(detection.sun, facts.geo);
  const PixelBox around = tile.grown(reach_px(detection, facts.geo), facts.box());
  std::vector<std::uint8_t> grey(around.pixels());
  std::vector<std::uint8_t> flags(facts.all_valid ? 0 : grey.size());
  const bool any = reader.read(around, input.range, grey.data(), flags.data(), around.width());
  TileBoulders result;
  for (int y = tile.y0; y < tile.y1; ++y) {
    const std::size_t at =
        static_cast<std::size_t>(y - around.y0) * static_cast<std::size_t>(around.width()) +
        static_cast<std::size_t>(tile.x0 - around.x0);
    result.content.add(&grey[at], any ? &flags[at] : nullptr, static_cast<std::size_t>(tile.width()));
  }
  for (std::uint8_t& flag : flags) flag = flag != 0 ? 0 : 255;  // missing becomes valid's opposite
  GreyTile view_of_tile;
  view_of_tile.rect = {around.x0, around.y0, around.width(), around.height()};
  view_of_tile.grey = packed_view<const std::uint8_t>(grey.data(), around.width(), around.height());
  if (any)
    view_of_tile.valid = packed_view<const std::uint8_t>(flags.data(), around.width(), around.height());
  const PixelRect core{tile.x0, tile.y0, tile.width(), tile.height()};
  const ShadowFinds finds = detect_by_shadow(view_of_tile, core, view, detection.shadow);
  const auto add = [&](double u_px, double v_px, const TableBoulder& entry, bool crater) {
    result.found.push_back(
        {static_cast<int>(std::floor(v_px + 0.5)), static_cast<int>(std::floor(u_px + 0.5)), entry, crater});
  };
  for (const ShadowBoulder& b : finds.boulders) add(b.u_px, b.v_px, table_boulder(b, facts.geo), false);
  for (const ShadowCrater& c : finds.craters) add(c.u_px, c.v_px, table_crater(c, facts.geo), true);
  return to_bytes(result);
}

}  // namespace

Bytes to_bytes(const RoundInput& input) {
  Bytes bytes;
  ByteWriter writer(bytes);
  writer.put(input.round);
  writer.put(input.bins);
  writer.put(input.range);
  writer.put_all(input.darkness);
  return bytes;
}

void read(ByteReader& from, RoundInput& input) {
  input.round = from.get<Round>();
  input.bins = from.get<FineBins>();
  input.range = from.get<GreyRange>();
  input.darkness = from.get_all<std::int32_t>();
}

TileBoulders tile_boulders(const Bytes& record) {
  TileBoulders tile;
  ByteReader reader(record);
  for (std::uint64_t left = reader.get_number(); left > 0; --left)
    tile.found.push_back(found_boulder(reader));
  tile.shared.open = reader.get_all<Component>();
  for (auto* side : {&tile.shared.top, &tile.shared.bottom, &tile.shared.left, &tile.shared.right})
    *side = reader.get_all<BorderRun>();
  tile.content = reader.get<GreyContent>();
  return tile;
}

void check(const Detection& detection) {
  if (detection.method == cmap::Method::kShadow) {
    check(detection.shadow);
  } else {
    check(detection.otsu);
  }
}

std::string to_text(const Detection& detection) {
  return detection.method == cmap::Method::kShadow ? to_text(detection.shadow, detection.sun)
                                                   : to_text(detection.otsu);
}

int reach_px(const Detection& detection, const GeoTransform& geo) {
  if (detection.method == cmap::Method::kShadow)
    return shadow_reach_px(shadow_view(detection.sun, geo), detection.shadow);
  return on_pixels(detection.otsu, geo.pixel_m()).reach();
}

TileGrid tiles_of(const RasterFacts& facts, const Detection& detection, int side) {
  // The shadow detector holds a tile with all around it in memory, and looks there for little.
  const bool shadow = detection.method == cmap::Method::kShadow;
  return tiles_of(facts, shadow && side == 0 ? kShadowTilePx : side, reach_px(detection, facts.geo));
}

Bytes work_on_tile(RasterReader& reader, const RasterFacts& facts, const Detection& detection,
                   const RoundInput& input, const PixelBox& tile) {
  switch (input.round) {
    case Round::kValues: return count_values(reader, facts.depth, tile);
    case Round::kLowerHalves: return count_lower_halves(reader, input.bins, tile);
    case Round::kStatistics: {
      const DetectorPixels pixels = on_pixels(detection.otsu, facts.geo.pixel_m());
      return tile_statistics(reader, input.range, facts, BlockGrid(facts.width, facts.height, pixels.block),
                             pixels.radius, tile);
    }
    case Round::kBoulders:
      return detection.method == cmap::Method::kShadow
                 ? shadow_boulders(reader, facts, detection, input, tile)
                 : otsu_boulders(reader, facts, detection.otsu, input, tile);
  }
  return {};
}

}  // namespace cairn::ground
