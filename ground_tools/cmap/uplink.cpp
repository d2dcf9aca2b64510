#include "cmap/uplink.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/tool_error.hpp"
#include "base/waypoints.hpp"
#include "cmap/worth.hpp"

namespace cairn::ground {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::uint32_t kLeastTileSide = 64;  // cells

std::uint32_t suitable_side(const CmapContent& map, const UplinkParams& params, std::size_t boulders,
                            double corridor_m2) {
  const double tile_m = params.tile_m > 0.0
                            ? params.tile_m
                            : std::sqrt(kBouldersPerCutTile * corridor_m2 / static_cast<double>(boulders));
  const double side = std::round(tile_m / map.quantum_m);
  return static_cast<std::uint32_t>(
      std::clamp(side, static_cast<double>(kLeastTileSide), static_cast<double>(cmap::kMaxTileSide)));
}

/// Whole tiles of a grid through (`origin`, `side`) that cover [low, high]: the first one and their number.
struct Span {
  double first = 0.0;
  std::uint32_t tiles = 1;
};
Span tiles_over(double low_m, double high_m, double origin_m, double tile_m) {
  const double first = std::floor((low_m - origin_m) / tile_m);
  const double last = std::floor((high_m - origin_m) / tile_m);
  if (last - first >= cmap::kMaxTiles)
    throw ToolError("--tile: {} m is too small for this corridor; give a larger side", tile_m);
  return {first, static_cast<std::uint32_t>(last - first) + 1U};
}

/// The grid of the cut: tiles of `side` cells on the lattice of `lattice`, over the box.
CmapLayout grid_over(const CmapLayout& lattice, std::uint32_t side, const MapExtent& box) {
  const double tile_m = side * (lattice.quantum_um / kMicrometresPerMetre);
  const Span columns = tiles_over(box.min_x_m, box.max_x_m, lattice.origin_x_m, tile_m);
  const Span rows = tiles_over(box.min_y_m, box.max_y_m, lattice.origin_y_m, tile_m);
  if (std::uint64_t{columns.tiles} * rows.tiles > cmap::kMaxTiles)
    throw ToolError("--tile: {} m gives {} x {} tiles, more than a map can have ({}); give a larger side",
                    tile_m, columns.tiles, rows.tiles, cmap::kMaxTiles);
  CmapLayout layout = lattice;
  layout.origin_x_m += columns.first * tile_m;
  layout.origin_y_m += rows.first * tile_m;
  layout.tile_side = side;
  layout.extent_x = columns.tiles * side;
  layout.extent_y = rows.tiles * side;
  return layout;
}

std::uint32_t tile_of(const CmapLayout& layout, const Vec2& p_map_m) {
  const double quantum_m = layout.quantum_um / kMicrometresPerMetre;
  const auto x = static_cast<std::uint32_t>(std::lround((p_map_m.x() - layout.origin_x_m) / quantum_m));
  const auto y = static_cast<std::uint32_t>(std::lround((p_map_m.y() - layout.origin_y_m) / quantum_m));
  return y / layout.tile_side * layout.columns() + x / layout.tile_side;
}

/// What is cut, and how it is encoded.
struct Job {
  const CmapContent& map;
  const UplinkParams& params;
  const std::optional<BaseMap>& base;
  CmapLayout layout;
  GridShift shift;
  CmapSource source;
  std::vector<CorridorBoulder> reached;
  HeightGrid heights;  ///< on the posts of the cut

  /// The map of the boulders in the tiles that `keeps` names, in the tables of the base or of the map.
  Bytes encode(const AttributeTables& tables, const std::vector<bool>& keeps) const {
    std::vector<TableBoulder> boulders;
    for (const CorridorBoulder& r : reached) {
      if (keeps[r.tile]) boulders.push_back(*r.boulder);
    }
    CmapLayout like = layout;
    like.tables = tables;
    CmapOptions options;
    options.like = &like;
    if (heights.present()) options.heights = &heights;
    options.tiles_with_heights = &keeps;
    return encode_cmap(boulders, {}, map.quantum_m, source, options);
  }
};

std::vector<RankedTile> rank(const Job& job, double length_m) {
  std::vector<RankedTile> all(std::size_t{job.layout.columns()} * job.layout.rows());
  for (std::size_t t = 0; t < all.size(); ++t) all[t].tile = static_cast<std::uint32_t>(t);
  for (const CorridorBoulder& r : job.reached) {
    RankedTile& tile = all[r.tile];
    tile.first_s_m = tile.boulders == 0 ? r.first_s_m : std::min(tile.first_s_m, r.first_s_m);
    ++tile.boulders;
    tile.way_m += r.way_m;
  }
  for (const TilePiece& piece :
       pieces_of(job.encode(job.map.layout.tables, std::vector<bool>(all.size(), true))))
    all[piece.tile].bytes = piece.bytes;
  for (RankedTile& tile : all) {
    if (tile.bytes > 0)
      tile.use_per_byte = tile.way_m / (1.0 + tile.first_s_m / length_m) / static_cast<double>(tile.bytes);
  }
  all.erase(std::remove_if(all.begin(), all.end(), [](const RankedTile& t) { return t.boulders == 0; }),
            all.end());
  std::stable_sort(all.begin(), all.end(),
                   [](const RankedTile& a, const RankedTile& b) { return a.use_per_byte > b.use_per_byte; });
  return all;
}

std::size_t boulders_of(const Bytes& map) { return decode_cmap(map, "cut").boulders.size(); }

/// The upload of the best `count` tiles: whole or as a delta, what is smaller.
void make_cut(const Job& job, std::size_t count, Cut& cut) {
  std::vector<bool> keeps(std::size_t{job.layout.columns()} * job.layout.rows());
  for (std::size_t i = 0; i < cut.tiles.size(); ++i) {
    cut.tiles[i].kept = i < count;
    if (i < count) keeps[cut.tiles[i].tile] = true;
  }
  cut.map = job.encode(job.map.layout.tables, keeps);
  cut.whole_bytes = cut.map.size();
  cut.is_delta = cut.unchanged = false;
  if (job.base) {
    Bytes like_base = job.encode(layout_of(job.base->bytes, job.base->name).tables, keeps);
    MapDelta delta = encode_delta(job.base->bytes, like_base, job.shift);
    cut.delta_bytes = delta.bytes.size();
    if (cut.delta_bytes < cut.whole_bytes) {
      cut.is_delta = true;
      cut.tiles_of_base = delta.tiles_kept;
      cut.map = std::move(like_base);
      cut.unchanged = delta.pieces.empty() && boulders_of(cut.map) == boulders_of(job.base->bytes);
      cut.upload = make_upload(UploadKind::kDelta, std::move(delta.bytes), std::move(delta.pieces),
                               job.params.chunk_bytes);
      return;
    }
  }
  cut.tiles_of_base = 0;
  cut.upload = make_upload(UploadKind::kMap, cut.map, pieces_of(cut.map), job.params.chunk_bytes);
}

/// All boulders that the job has, their tiles ranked.
void take_all_tiles(const Job& job, Cut& cut) {
  cut.tiles = rank(job, std::max(cut.length_m, 1e-9));
  cut.rank_of_tile.assign(std::size_t{job.layout.columns()} * job.layout.rows(), cut.tiles.size());
  for (std::size_t i = 0; i < cut.tiles.size(); ++i) cut.rank_of_tile[cut.tiles[i].tile] = i;
  make_cut(job, cut.tiles.size(), cut);
}

/// As many of the best tiles as the budget has room for.
void fit_budget(const Job& job, Cut& cut) {
  std::size_t fits = 0;
  std::size_t too_many = cut.tiles.size() + 1;
  std::size_t least_bytes = 0;
  while (too_many - fits > 1) {
    const std::size_t count = fits + (too_many - fits) / 2;
    make_cut(job, count, cut);
    const std::size_t bytes = link_bytes(cut.upload.plan);
    if (count == 1) least_bytes = bytes;
    (bytes <= job.params.budget_bytes ? fits : too_many) = count;
  }
  if (fits == 0) {
    throw ToolError("--budget: {} bytes are not enough for one tile; this corridor needs at least {}",
                    job.params.budget_bytes, least_bytes);
  }
  make_cut(job, fits, cut);
}

/// As many of the boulders of most worth as the budget has room for.
void spare_boulders(Job& job, const PlannedPath& path, Cut& cut) {
  const std::vector<CorridorBoulder> all = job.reached;
  const std::vector<std::size_t> order = by_worth(all, path, job.params, job.params.found);
  std::size_t fits = 0;
  std::size_t too_many = order.size() + 1;
  const auto keep = [&](std::size_t count) {
    std::vector<std::size_t> kept(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count));
    std::sort(kept.begin(), kept.end());
    job.reached.clear();
    for (const std::size_t j : kept) job.reached.push_back(all[j]);
    take_all_tiles(job, cut);
    return link_bytes(cut.upload.plan);
  };
  while (too_many - fits > 1) {
    const std::size_t count = fits + (too_many - fits) / 2;
    (keep(count) <= job.params.budget_bytes ? fits : too_many) = count;
  }
  if (fits == 0)
    throw ToolError("--budget: {} bytes are not enough for one boulder; this corridor needs at least {}",
                    job.params.budget_bytes, keep(1));
  keep(fits);
}

void check(const UplinkParams& params) {
  check_range("--width", params.half_width_m, 0.1, 10000.0);
  check_range("--drift", 100.0 * params.drift, 0.0, 100.0);
  check_range("--fix-every", params.fix_every_m, 0.0, 1e6);
  if (params.tile_m != 0.0) check_range("--tile", params.tile_m, 0.1, 1e6);
}

/// The base's grid must be one that the map's cells fall on: else no tile would come out the same.
void check_base(const CmapContent& map, const std::string& name, const BaseMap& base) {
  const CmapContent old = decode_cmap(base.bytes, base.name);
  const auto refuse = [&](const std::string& why) {
    throw ToolError("{}: {} than {}; omit --base, or build both maps with the same options", base.name, why,
                    name);
  };
  if (old.reference_system != map.reference_system) {
    refuse(fmt::format("has a different reference system ({})", old.reference_system));
  }
  if (old.layout.quantum_um != map.layout.quantum_um)
    refuse(fmt::format("has a different position step ({} m)", old.quantum_m));
  CmapLayout cell = map.layout;
  CmapLayout base_cell = old.layout;
  cell.tile_side = base_cell.tile_side = 1;
  const double quantum_m = map.quantum_m;
  for (const double off : {(cell.origin_x_m - base_cell.origin_x_m) / quantum_m,
                           (cell.origin_y_m - base_cell.origin_y_m) / quantum_m}) {
    if (std::fabs(off - std::round(off)) > 1e-3)
      refuse("has a different grid (the origins are not a whole number of steps apart)");
  }
}

/// The map's heights on the cut's posts.
HeightGrid cut_heights(const CmapContent& map, const CmapLayout& layout) {
  const HeightGrid& all = map.heights;
  if (!all.present()) return {};
  const std::int64_t east = std::llround((layout.origin_x_m - map.layout.origin_x_m) / map.quantum_m);
  const std::int64_t north = std::llround((layout.origin_y_m - map.layout.origin_y_m) / map.quantum_m);
  if (east % all.spacing != 0 || north % all.spacing != 0 || layout.tile_side % all.spacing != 0)
    throw ToolError("the map's heights do not stand on the corners of the base's tiles; omit --base");
  return moved(all, east, north, layout.extent_x, layout.extent_y);
}

}  // namespace

Cut cut_corridor(const Bytes& map_bytes, const std::string& name, const PlannedPath& path,
                 const UplinkParams& params, const std::optional<BaseMap>& base) {
  check(params);
  const CmapContent map = decode_cmap(map_bytes, name);
  check_waypoints(path.p_map_m, map.extent, name);
  if (base) check_base(map, name, *base);

  Cut cut;
  cut.length_m = path.length_m();
  cut.box = corridor_box(path, params, map.extent);
  cut.map_boulders = map.boulders.size();
  cut.map_bytes = map_bytes.size();
  Job job{map, params, base, {}, {}, {}, boulders_within_reach(map.boulders, path, params), {}};
  cut.corridor_boulders = job.reached.size();
  if (job.reached.empty()) {
    throw ToolError("{}: has no boulder within {:.1f} m of the path; give a larger --width, or another path",
                    name, params.half_width_m);
  }
  CmapLayout lattice = map.layout;
  std::uint32_t side = suitable_side(map, params, job.reached.size(), corridor_area_m2(path, params));
  if (base) {
    lattice = layout_of(base->bytes, base->name);
    side = lattice.tile_side;
  }
  if (map.heights.present() && !base)
    side = std::clamp((side - 1U) / map.heights.spacing + 1U, 1U, cmap::kMaxTileSteps) * map.heights.spacing;
  job.layout = grid_over(lattice, side, cut.box);
  if (base && !find_shift(lattice, job.layout, job.shift)) {
    throw ToolError("{}: is too far from the path; omit --base", base->name);
  }
  job.heights = cut_heights(map, job.layout);
  job.source = {
      map.method,
      map.pixel_m,
      fmt::format("corridor of map {:08x}: half_width_m={} drift={} fix_every_m={} length_m={}", map.head_crc,
                  params.half_width_m, params.drift, params.fix_every_m, cut.length_m),
      map.reference_system,
      map.site,
      map.epoch_s,
      map.revision};
  for (CorridorBoulder& r : job.reached) r.tile = tile_of(job.layout, r.boulder->p_map_m);
  cut.layout = job.layout;
  take_all_tiles(job, cut);
  if (params.budget_bytes > 0 && link_bytes(cut.upload.plan) > params.budget_bytes) {
    if (base) {
      fit_budget(job, cut);
    } else {
      spare_boulders(job, path, cut);
    }
  }
  cut.boulders = boulders_of(cut.map);
  return cut;
}

std::string to_json(const Cut& cut, const UplinkParams& params, std::uint32_t next_sequence) {
  using nlohmann::ordered_json;
  const auto box = [](const MapExtent& e) {
    return ordered_json{
        {"min_x_m", e.min_x_m}, {"min_y_m", e.min_y_m}, {"max_x_m", e.max_x_m}, {"max_y_m", e.max_y_m}};
  };
  ordered_json j;
  j["path_m"] = cut.length_m;
  j["corridor"] = {
      {"half_width_m", params.half_width_m},   {"half_width_at_end_m", reach_m(params, cut.length_m)},
      {"drift_percent", 100.0 * params.drift}, {"fix_every_m", params.fix_every_m},
      {"fixes_s_m", params.fixes_s_m},         {"box", box(cut.box)}};
  j["boulders"] = {{"map", cut.map_boulders}, {"corridor", cut.corridor_boulders}, {"sent", cut.boulders}};
  std::size_t kept = 0;
  for (const RankedTile& tile : cut.tiles) kept += tile.kept ? 1U : 0U;
  j["tiles"] = {{"columns", cut.layout.columns()},
                {"rows", cut.layout.rows()},
                {"side_m", cut.layout.tile_side * cut.layout.quantum_um / kMicrometresPerMetre},
                {"with_boulders", cut.tiles.size()},
                {"kept", kept},
                {"of_base", cut.tiles_of_base}};
  j["bytes"] = {{"map", cut.map_bytes}, {"whole", cut.whole_bytes}};
  if (cut.delta_bytes > 0) j["bytes"]["delta"] = cut.delta_bytes;
  j["bytes"]["upload"] = cut.upload.bytes.size();
  j["bytes"]["link"] = link_bytes(cut.upload.plan);
  j["upload"] = {{"kind", cut.is_delta ? "delta" : "map"},
                 {"unchanged", cut.unchanged},
                 {"id", fmt::format("{:08x}", cut.upload.plan.id)},
                 {"chunk_bytes", cut.upload.plan.chunk_bytes},
                 {"chunks", chunks_of(cut.upload.plan)},
                 {"next_sequence", next_sequence}};
  for (const RankedTile& tile : cut.tiles) {
    j["ranked"].push_back({{"tile", tile.tile},
                           {"boulders", tile.boulders},
                           {"bytes", tile.bytes},
                           {"first_s_m", tile.first_s_m},
                           {"use_per_byte", tile.use_per_byte},
                           {"kept", tile.kept}});
  }
  return j.dump(2) + "\n";
}

}  // namespace cairn::ground
