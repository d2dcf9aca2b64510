#include "map/tile_work.hpp"

namespace cairn::ground {
namespace {

/// A FoundBoulder as plain numbers.
struct Plain {
  std::int32_t y = 0;
  std::int32_t x = 0;
  double number[9] = {};
};

void put(ByteWriter& to, const FoundBoulder& found) {
  const TableBoulder& b = found.boulder;
  to.put(Plain{found.y,
               found.x,
               {b.p_map_m.x(), b.p_map_m.y(), b.diameter_m, b.area_m2, b.contrast, b.elongation, b.height_m,
                b.confidence, b.ground_z_m}});
}

FoundBoulder found_boulder(ByteReader& from) {
  const auto plain = from.get<Plain>();
  const double* const n = plain.number;
  FoundBoulder found{plain.y, plain.x, {}};
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
  return tile;
}

int reach_px(const Detection& detection, double pixel_m) {
  return on_pixels(detection.otsu, pixel_m).reach();
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
    case Round::kBoulders: return otsu_boulders(reader, facts, detection.otsu, input, tile);
  }
  return {};
}

}  // namespace cairn::ground
