// cairn map score
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>

#include "base/tool_error.hpp"
#include "commands/cmd_map.hpp"
#include "dataset/trajectory.hpp"
#include "map/geopackage.hpp"
#include "map/score.hpp"
#include "map/way_file.hpp"
#include "ortho/reference_system.hpp"
#include "ortho/true_scale.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

struct ScoreOptions {
  fs::path map;
  fs::path truth;
  std::string sun;
  fs::path way;
  double entry_diameter_m = 0.0;
  bool json = false;
  ScoreParams params;
};

Json score_json(const ScoreOptions& options, const MapScore& score, const std::vector<SizeClass>& sizes) {
  const ScoreParams& p = options.params;
  Json json = {{"map", options.map.string()},
               {"truth", options.truth.string()},
               {"recall", score.recall()},
               {"found", score.found},
               {"rocks", score.rocks},
               {"recall_diameter_m", p.recall_diameter_m},
               {"precision", score.entries == 0 ? Json(nullptr) : Json(score.precision())},
               {"right", score.right},
               {"entries", score.entries},
               {"precision_diameter_m", p.precision_diameter_m},
               {"distance_m", p.distance_m},
               {"margin_m", p.margin_m}};
  // Of found rocks alone.
  const auto known = [](std::size_t found, double value) { return found == 0 ? Json(nullptr) : Json(value); };
  json["median_error_m"] = known(score.found, score.median_error_m);
  json["shift_east_m"] = known(score.found, score.mean_shift_map_m.x());
  json["shift_north_m"] = known(score.found, score.mean_shift_map_m.y());
  if (!options.sun.empty())
    json["shift_towards_sun_m"] = known(score.found, sunward_shift_m(score, parse_sun(options.sun)));
  json["sizes"] = Json::array();
  for (const SizeClass& c : sizes) {
    json["sizes"].push_back({{"from_m", c.from_m},
                             {"to_m", c.to_m},
                             {"rocks", c.rocks},
                             {"found", c.found},
                             {"recall", c.recall()},
                             {"median_error_m", known(c.found, c.median_error_m)},
                             {"diameter_ratio", known(c.found, c.diameter_ratio)}});
  }
  return json;
}

/// A planned way, or what a run drove.
std::vector<Vec2> way_of(const fs::path& path, const std::string& system) {
  if (path.extension() != ".tum") return read_way(path, system);
  std::vector<Vec2> way;
  for (const StampedPose& p : read_tum(path)) way.emplace_back(p.pose.t.x(), p.pose.t.y());
  if (way.size() < 2) throw ToolError("{}: has fewer than two poses; give a way", path.string());
  return way;
}

/// What a run saw of the ground is scored along its way, not where its boulders end.
MapExtent around(const std::vector<Vec2>& way, double within_m) {
  MapExtent box{way[0].x(), way[0].y(), way[0].x(), way[0].y()};
  for (const Vec2& p : way) {
    box.min_x_m = std::min(box.min_x_m, p.x());
    box.min_y_m = std::min(box.min_y_m, p.y());
    box.max_x_m = std::max(box.max_x_m, p.x());
    box.max_y_m = std::max(box.max_y_m, p.y());
  }
  return {box.min_x_m - within_m, box.min_y_m - within_m, box.max_x_m + within_m, box.max_y_m + within_m};
}

void print_score(const ScoreOptions& options) {
  std::vector<TableBoulder> entries;
  MapExtent extent;
  std::string system;
  if (options.map.extension() == ".csv") {
    entries = read_csv(options.map, options.entry_diameter_m);
    extent = extent_of(entries);
  } else {
    CmapContent map = load_map(options.map);
    entries = std::move(map.boulders);
    extent = map.extent;
    system = map.reference_system;
  }
  ScoreParams p = options.params;
  if (!options.way.empty()) {
    p.way_map_m = way_of(options.way, system);
    if (options.map.extension() == ".csv") {
      extent = around(p.way_map_m, p.within_m);
      p.margin_m = 0.0;
    }
  }
  std::vector<TableBoulder> truth = read_csv(options.truth);
  const std::string truth_system = reference_beside(options.truth);
  if (!is_local_reference(system) && !is_local_reference(truth_system) &&
      !same_reference(system, truth_system)) {
    const Places to_map(truth_system, system);
    for (TableBoulder& rock : truth) rock.p_map_m = to_map(rock.p_map_m);
  }
  const MapScore score = score_map(entries, truth, extent, p);
  if (score.rocks == 0) {
    throw ToolError("{}: no rock of {} m or more lies inside {}; are both in the same reference system?",
                    options.truth.string(), p.recall_diameter_m, options.map.string());
  }
  if (options.json) {
    print_json(score_json(options, score, score_by_size(entries, truth, extent, p)));
    return;
  }
  fmt::print("recall            {:.3f} ({} of {} rocks of {} m and more)\n", score.recall(), score.found,
             score.rocks, p.recall_diameter_m);
  fmt::print("precision         {:.3f} ({} of {} entries at a rock of {} m and more)\n", score.precision(),
             score.right, score.entries, p.precision_diameter_m);
  fmt::print("centroid error    {:.3f} m (median)\n", score.median_error_m);
  fmt::print("centroid shift    {:+.3f} m east, {:+.3f} m north (mean)\n", score.mean_shift_map_m.x(),
             score.mean_shift_map_m.y());
  if (!options.sun.empty()) {
    fmt::print("towards the sun   {:+.3f} m (mean; minus: into the shadow)\n",
               sunward_shift_m(score, parse_sun(options.sun)));
  }
  for (const SizeClass& c : score_by_size(entries, truth, extent, p)) {
    fmt::print(
        "{:>5.2f} to {:.2f} m   recall {:.3f} ({} of {}), centroid error {:.3f} m, diameter x {:.2f}\n",
        c.from_m, c.to_m, c.recall(), c.found, c.rocks, c.median_error_m, c.diameter_ratio);
  }
}

}  // namespace

void add_map_score(Command map) {
  const auto score = std::make_shared<ScoreOptions>();
  Command score_app = map.add_command("score", "compare a map, or a table, with the true rocks");
  score_app.add_option("MAP", score->map, "map (.cmap) or table (.csv)").required();
  score_app.add_option("--way", score->way,
                       "only what lies near a way: that of a run (.tum), or one that was planned");
  score_app.add_option("--within", score->params.within_m, "how near, m").default_shown().positive();
  score_app
      .add_option("--entry-diameter", score->entry_diameter_m,
                  "smallest entry of a table that counts, m (a run's boulders.csv, say)")
      .not_negative();
  score_app
      .add_option(
          "--truth", score->truth,
          "table of the true rocks (columns x, y, diameter), in the map's reference system or with a .prj beside it")
      .required();
  score_app.add_flag("--json", score->json, "one JSON object on stdout");
  score_app.add_option("--margin", score->params.margin_m, "margin of the map that is not counted, m")
      .default_shown();
  score_app.add_option("--sun", score->sun,
                       "ELEVATION,AZIMUTH, degrees: also print how far the entries lie towards the sun");
  score_app
      .add_option("--recall-diameter", score->params.recall_diameter_m,
                  "smallest true rock that should be found, m")
      .default_shown()
      .positive();
  score_app
      .add_option("--precision-diameter", score->params.precision_diameter_m,
                  "smallest true rock that makes an entry correct, m")
      .default_shown();
  score_app
      .add_option("--distance", score->params.distance_m,
                  "largest distance between an entry and its "
                  "rock, m")
      .default_shown();
  score_app.on_run([score] { print_score(*score); });
}

}  // namespace cairn::ground
