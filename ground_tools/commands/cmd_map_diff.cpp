// cairn map diff
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/output_file.hpp"
#include "commands/cmd_map.hpp"
#include "map/diff.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

struct DiffOptions {
  fs::path a;
  fs::path b;
  fs::path csv;
  double within_m = 0.0;  ///< 0: usual_distance_m
  double moved_m = -1.0;  ///< negative: the coarser step of positions
  double reach_m = 0.0;   ///< 0: ten times within
  bool align = false;
  bool json = false;
};

/// Tiles whose bytes differ; negative where the maps have not the same tiles.
long long changed_tiles(const CmapContent& a, const CmapContent& b) {
  const CmapLayout& p = a.layout;
  const CmapLayout& q = b.layout;
  if (p.origin_x_m != q.origin_x_m || p.origin_y_m != q.origin_y_m || p.extent_x != q.extent_x ||
      p.extent_y != q.extent_y || p.quantum_um != q.quantum_um || p.tile_side != q.tile_side ||
      a.tiles.size() != b.tiles.size()) {
    return -1;
  }
  long long changed = 0;
  for (std::size_t i = 0; i < a.tiles.size(); ++i) {
    if (a.tiles[i].bytes != b.tiles[i].bytes || a.tiles[i].crc != b.tiles[i].crc) ++changed;
  }
  return changed;
}

/// What has no partner where the other map does not look, and pairs whose attributes differ.
struct Rest {
  std::size_t a_outside = 0;
  std::size_t b_outside = 0;
  std::size_t changed = 0;
};

Rest rest_of(const CmapContent& a, const CmapContent& b, const MapDiff& diff) {
  Rest rest{a.boulders.size() - diff.a_inside, b.boulders.size() - diff.b_inside, 0};
  for (const BoulderPair& pair : diff.pairs) {
    const TableBoulder& x = a.boulders[pair.a];
    const TableBoulder& y = b.boulders[pair.b];
    if (x.diameter_m != y.diameter_m || x.height_m != y.height_m || x.confidence != y.confidence)
      ++rest.changed;
  }
  return rest;
}

std::string changes_csv(const CmapContent& a, const CmapContent& b, const MapDiff& diff, double moved_m) {
  std::string text = "change,x_m,y_m,diameter_m,to_x_m,to_y_m,to_diameter_m\n";
  const auto place = [](const TableBoulder& t) {
    return fmt::format(",{:.4f},{:.4f},{:.4f}", t.p_map_m.x(), t.p_map_m.y(), t.diameter_m);
  };
  for (const std::size_t i : diff.removed) text += "removed" + place(a.boulders[i]) + ",,,\n";
  for (const std::size_t i : diff.added) text += "added,,," + place(b.boulders[i]) + "\n";
  for (const BoulderPair& pair : diff.pairs) {
    if (pair.distance_m > moved_m)
      text += "moved" + place(a.boulders[pair.a]) + place(b.boulders[pair.b]) + "\n";
  }
  return text;
}

/// Where both maps look there is no ground.
bool apart(const MapDiff& d) {
  return !(d.common.min_x_m < d.common.max_x_m && d.common.min_y_m < d.common.max_y_m);
}

Json no_extent() {
  return {{"min_x_m", nullptr}, {"min_y_m", nullptr}, {"max_x_m", nullptr}, {"max_y_m", nullptr}};
}

Json diff_json(const DiffOptions& options, const DiffParams& params, const MapDiff& d, const Rest& rest,
               long long tiles, std::size_t of_tiles, bool same) {
  return {
      {"a", options.a.string()},
      {"b", options.b.string()},
      {"same", same},
      {"within_m", params.within_m},
      {"moved_m", params.moved_m},
      {"common_extent", apart(d) ? no_extent() : to_json(d.common)},
      {"boulders_a", d.a_inside},
      {"boulders_b", d.b_inside},
      {"outside_a", rest.a_outside},
      {"outside_b", rest.b_outside},
      {"matched", d.pairs.size()},
      {"added", d.added.size()},
      {"removed", d.removed.size()},
      {"moved", d.moved},
      {"changed_attributes", rest.changed},
      {"repeatability", apart(d) ? Json(nullptr) : Json(d.repeatability())},
      {"aligned", params.align},
      {"shift_taken_off_m", {d.shift_map_m.x(), d.shift_map_m.y()}},
      {"mean_shift_m", {d.mean_shift_map_m.x(), d.mean_shift_map_m.y()}},
      {"rms_m", d.rms_m},
      {"median_size_ratio", d.median_size_ratio},
      {"tiles",
       {{"comparable", tiles >= 0}, {"changed", tiles < 0 ? Json(nullptr) : Json(tiles)}, {"of", of_tiles}}}};
}

void print_diff(const DiffParams& params, const MapDiff& d, const Rest& rest, long long tiles,
                std::size_t of_tiles) {
  if (apart(d)) {
    fmt::print("the maps do not overlap: {} and {} boulders, nothing to compare\n", rest.a_outside,
               rest.b_outside);
    return;
  }
  const auto share = [](std::size_t part, std::size_t of) {
    return of == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(of);
  };
  fmt::print("boulders          {} and {} in the common area ({:.1f} x {:.1f} m); {} and {} outside\n",
             d.a_inside, d.b_inside, std::max(0.0, d.common.max_x_m - d.common.min_x_m),
             std::max(0.0, d.common.max_y_m - d.common.min_y_m), rest.a_outside, rest.b_outside);
  fmt::print("matched           {} within {:.3f} m ({:.1f} % of the first, {:.1f} % of the second)\n",
             d.pairs.size(), params.within_m, share(d.pairs.size(), d.a_inside),
             share(d.pairs.size(), d.b_inside));
  fmt::print("repeatability     {:.3f}\n", d.repeatability());
  fmt::print("removed, added    {}, {}\n", d.removed.size(), d.added.size());
  fmt::print("moved             {} by more than {:.3f} m; attributes changed of {}\n", d.moved,
             params.moved_m, rest.changed);
  if (params.align)
    fmt::print("common shift      {:+.3f} m east, {:+.3f} m north\n", d.shift_map_m.x(), d.shift_map_m.y());
  fmt::print("mean shift        {:+.3f} m east, {:+.3f} m north; {:.3f} m rms{}\n", d.mean_shift_map_m.x(),
             d.mean_shift_map_m.y(), d.rms_m, params.align ? " after removing the common shift" : "");
  fmt::print("size              second over first {:.3f} (median)\n", d.median_size_ratio);
  if (tiles >= 0)
    fmt::print("tiles             {} of {} changed\n", tiles, of_tiles);
  else
    fmt::print("tiles             not comparable: the maps have different tile grids\n");
}

void diff(const DiffOptions& options) {
  const CmapContent a = load_map(options.a);
  const CmapContent b = load_map(options.b);
  need_same_system(options.a, a, options.b, b);
  DiffParams params;
  params.within_m = options.within_m > 0.0 ? options.within_m : usual_distance_m({a.pixel_m, b.pixel_m});
  params.moved_m = options.moved_m >= 0.0 ? options.moved_m : std::max(a.quantum_m, b.quantum_m);
  params.align = options.align;
  params.reach_m = options.reach_m > 0.0 ? options.reach_m : 10.0 * params.within_m;
  const MapDiff d = diff_maps(a.boulders, a.extent, b.boulders, b.extent, params);
  const Rest rest = rest_of(a, b, d);
  const long long tiles = changed_tiles(a, b);
  const bool same = d.added.empty() && d.removed.empty() && d.moved == 0 && rest.changed == 0 &&
                    rest.a_outside == 0 && rest.b_outside == 0;
  if (apart(d)) {
    const std::string words = apart_words(options.a, a, options.b, b);
    if (!words.empty()) fmt::print(stderr, "cairn: warning: {}\n", words);
  }
  if (!options.csv.empty()) write_file(options.csv, changes_csv(a, b, d, params.moved_m));
  if (options.json)
    print_json(diff_json(options, params, d, rest, tiles, a.tiles.size(), same));
  else
    print_diff(params, d, rest, tiles, a.tiles.size());
  if (!same) throw Answer{kAnswerIsNo};
}

}  // namespace

void add_map_diff(Command map) {
  const auto compared = std::make_shared<DiffOptions>();
  DiffOptions& d = *compared;
  Command diff_app = map.add_command(
      "diff", "compare two maps of one site, boulder by boulder; exit status 0: same, 2: different");
  diff_app.add_option("A", d.a, "map (.cmap)").required();
  diff_app.add_option("B", d.b, "map (.cmap)").required();
  diff_app
      .add_option("--within", d.within_m,
                  "two entries are one boulder within this distance, m (default: two pixels, at least 0.1)")
      .positive();
  diff_app
      .add_option("--moved", d.moved_m,
                  "a boulder has moved if it is farther away than this, m (default: the position step)")
      .not_negative();
  diff_app.add_flag("--align", d.align, "first remove the common shift of the two maps");
  diff_app
      .add_option("--reach", d.reach_m,
                  "largest common shift to look for, m (default: ten times "
                  "--within)")
      .positive();
  diff_app.add_option("--csv", d.csv, "write removed, added and moved boulders as a table").written();
  diff_app.add_flag("--json", d.json, "one JSON object on stdout");
  diff_app.on_run([compared] { diff(*compared); });
}

}  // namespace cairn::ground
