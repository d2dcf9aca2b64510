// cairn map build | info | score
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>

#include "commands.hpp"
#include "map/boulder_table.hpp"
#include "map/cmap_file.hpp"
#include "map/detector.hpp"
#include "map/raster.hpp"
#include "map/score.hpp"
#include "output_file.hpp"
#include "progress_line.hpp"
#include "tool_error.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

struct BuildOptions {
  fs::path ortho;
  fs::path from_csv;
  fs::path output;
  fs::path csv;
  double min_diameter_m = 0.0;
  double quantum_m = 0.0;  ///< 0 = from the pixel
  int band = 0;
  std::string method = "otsu";
  DetectorParams detector;
};

/// What the map is made of, from an orthoimage or from a table.
struct Prepared {
  std::vector<TableBoulder> boulders;
  MapExtent extent;
  CmapSource source;
};

Prepared detect(const BuildOptions& options) {
  check(options.detector);
  ProgressLine progress(fmt::format("map build {}", options.ortho.filename().string()));
  progress.show(0.0);
  const Raster raster = read_orthoimage(options.ortho, options.band);
  Prepared made;
  made.boulders =
      detect_boulders(raster, options.detector, [&](double share) { progress.show(0.2 + 0.8 * share); });
  made.extent = extent_of(raster);
  made.source = {cmap::Method::kOtsu, raster.geo.pixel_m(), to_text(options.detector),
                 raster.reference_system};
  if (options.min_diameter_m > 0.0)
    made.source.parameters += fmt::format(" min_diameter_m={}", options.min_diameter_m);
  made.boulders.erase(
      std::remove_if(made.boulders.begin(), made.boulders.end(),
                     [&](const TableBoulder& b) { return b.diameter_m < options.min_diameter_m; }),
      made.boulders.end());
  if (made.boulders.empty()) {
    throw ToolError("{}: no boulder found; try a smaller --min-area, --min-diameter or --threshold-scale",
                    options.ortho.string());
  }
  return made;
}

Prepared take_table(const BuildOptions& options) {
  Prepared made;
  made.boulders = read_csv(options.from_csv, options.min_diameter_m);
  if (made.boulders.empty()) {
    throw ToolError("{}: holds no boulder of {} m or more; lower --min-diameter or give another table",
                    options.from_csv.string(), options.min_diameter_m);
  }
  made.extent = extent_of(made.boulders);
  made.source.parameters = fmt::format("table min_diameter_m={}", options.min_diameter_m);
  return made;
}

void build(const BuildOptions& options) {
  if (options.ortho.empty() == options.from_csv.empty()) {
    throw ToolError("map build: give either an orthoimage or --from-csv TABLE");
  }
  OutputFile map(options.output);  // first, so that a folder that cannot be written is told before the work
  const Prepared made = options.from_csv.empty() ? detect(options) : take_table(options);
  const double quantum_m =
      options.quantum_m > 0.0 ? options.quantum_m : suitable_quantum_m(made.source.pixel_m);
  const std::vector<std::uint8_t> bytes = encode_cmap(made.boulders, made.extent, quantum_m, made.source);

  map.write(bytes);
  if (!options.csv.empty()) write_file(options.csv, to_csv(made.boulders));
  map.commit();
  fmt::print("{}: {} boulders on {:.1f} x {:.1f} m, {} bytes\n", options.output.string(),
             made.boulders.size(), made.extent.max_x_m - made.extent.min_x_m,
             made.extent.max_y_m - made.extent.min_y_m, bytes.size());
}

void print_info(const fs::path& path) {
  const std::vector<std::uint8_t> bytes = read_file(path);
  const CmapContent map = decode_cmap(bytes, path.string());
  double smallest_m = 0.0;
  double largest_m = 0.0;
  for (const TableBoulder& b : map.boulders) {
    smallest_m = smallest_m == 0.0 ? b.diameter_m : std::min(smallest_m, b.diameter_m);
    largest_m = std::max(largest_m, b.diameter_m);
  }
  const double area_m2 =
      (map.extent.max_x_m - map.extent.min_x_m) * (map.extent.max_y_m - map.extent.min_y_m);
  const auto count = static_cast<double>(map.boulders.size());
  fmt::print("file              {} ({} bytes, version {}, CRCs hold)\n", path.string(), bytes.size(),
             cmap::kVersion);
  fmt::print("boulders          {} ({:.3f} per m2), diameter {:.3f} to {:.3f} m\n", map.boulders.size(),
             area_m2 > 0.0 ? count / area_m2 : 0.0, smallest_m, largest_m);
  fmt::print("east              {:.3f} to {:.3f} m\n", map.extent.min_x_m, map.extent.max_x_m);
  fmt::print("north             {:.3f} to {:.3f} m\n", map.extent.min_y_m, map.extent.max_y_m);
  fmt::print("reference system  {}\n", map.reference_system);
  fmt::print("position step     {} m\n", map.quantum_m);
  fmt::print("tiles             {} x {} of {:.3f} m\n", map.columns, map.rows, map.tile_m);
  if (map.method == cmap::Method::kOtsu) {
    fmt::print("made by           otsu on pixels of {:.4g} m, parameters {:08x}\n", map.pixel_m,
               map.parameter_hash);
  } else {
    fmt::print("made from         a table, parameters {:08x}\n", map.parameter_hash);
  }
}

struct ScoreOptions {
  fs::path map;
  fs::path truth;
  std::string sun;
  ScoreParams params;
};

void print_score(const ScoreOptions& options) {
  std::vector<TableBoulder> entries;
  MapExtent extent;
  if (options.map.extension() == ".csv") {
    entries = read_csv(options.map);
    extent = extent_of(entries);
  } else {
    CmapContent map = decode_cmap(read_file(options.map), options.map.string());
    entries = std::move(map.boulders);
    extent = map.extent;
  }
  const ScoreParams& p = options.params;
  const std::vector<TableBoulder> truth = read_csv(options.truth);
  const MapScore score = score_map(entries, truth, extent, p);
  if (score.rocks == 0) {
    throw ToolError("{}: no rock of {} m or more lies inside {}; are both in the same reference system?",
                    options.truth.string(), p.recall_diameter_m, options.map.string());
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

void add_build(CLI::App& map) {
  const auto options = std::make_shared<BuildOptions>();
  BuildOptions& o = *options;
  DetectorParams& d = o.detector;
  CLI::App* build_app =
      map.add_subcommand("build", "make a flight map from an orthoimage, or from a table of boulders");
  build_app->add_option(
      "ORTHO", o.ortho,
      "orthoimage that GDAL opens, geo-referenced in metres (GeoTIFF, or world file beside it)");
  build_app->add_option("-o,--output", o.output, "the map to write (.cmap)")->required();
  build_app->add_option("--csv", o.csv, "write the boulders as a table, too");
  build_app->add_option(
      "--from-csv", o.from_csv,
      "take the boulders from this table (columns x, y, diameter) instead of an orthoimage");
  build_app->add_option("--min-diameter", o.min_diameter_m, "leave out smaller boulders, m")
      ->check(CLI::NonNegativeNumber);
  build_app
      ->add_option("--quantum", o.quantum_m,
                   "step of the positions, m (default: a quarter of a pixel or finer, at least 1 mm)")
      ->check(CLI::PositiveNumber);
  build_app
      ->add_option("--band", o.band,
                   "band to use (default: mean of the first three of three or more, else 1)")
      ->check(CLI::PositiveNumber);
  const char* detector = "Detector";
  build_app->add_option("--method", o.method, "otsu: the paper's detector")
      ->check(CLI::IsMember({"otsu"}))
      ->capture_default_str()
      ->group(detector);
  build_app
      ->add_option("--background", d.background_m,
                   "side of the surroundings that a pixel is compared with, m")
      ->capture_default_str()
      ->group(detector);
  build_app->add_option("--block", d.block_m, "side of the blocks of the adaptive threshold, m")
      ->capture_default_str()
      ->group(detector);
  build_app
      ->add_option("--threshold-scale", d.threshold_scale,
                   "share of Otsu's threshold; less finds fainter boulders")
      ->capture_default_str()
      ->group(detector);
  build_app
      ->add_option("--noise-sigmas", d.noise_sigmas,
                   "least threshold, in standard deviations of the ground's texture")
      ->capture_default_str()
      ->group(detector);
  build_app->add_option("--median", d.median_m, "side of the median filter, m (3 to 15 px)")
      ->capture_default_str()
      ->group(detector);
  build_app->add_option("--min-area", d.min_area_m2, "smallest blob, m2")
      ->capture_default_str()
      ->group(detector);
  build_app->add_option("--min-area-px", d.min_area_px, "smallest blob, pixels")
      ->capture_default_str()
      ->group(detector);
  build_app->callback([options] { build(*options); });
}

}  // namespace

void add_map_commands(CLI::App& app) {
  CLI::App* map = app.add_subcommand("map", "prepare and inspect orbital boulder maps");
  map->require_subcommand(1);
  add_build(*map);

  const auto info_path = std::make_shared<fs::path>();
  CLI::App* info = map->add_subcommand("info", "validate a map and print what it holds");
  info->add_option("FILE", *info_path, "map (.cmap)")->required();
  info->callback([info_path] { print_info(*info_path); });

  const auto score = std::make_shared<ScoreOptions>();
  CLI::App* score_app = map->add_subcommand("score", "compare a map, or a table, with the true rocks");
  score_app->add_option("MAP", score->map, "map (.cmap) or table (.csv)")->required();
  score_app->add_option("--truth", score->truth, "table of the true rocks (columns x, y, diameter)")
      ->required();
  score_app->add_option("--margin", score->params.margin_m, "rim of the map that does not count, m")
      ->capture_default_str();
  score_app->add_option("--sun", score->sun,
                        "ELEVATION,AZIMUTH, degrees: tells how far the entries lie towards the sun");
  score_app
      ->add_option("--recall-diameter", score->params.recall_diameter_m,
                   "true rocks of this size and more are to be found, m")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  score_app
      ->add_option("--precision-diameter", score->params.precision_diameter_m,
                   "true rocks of this size and more make an entry right, m")
      ->capture_default_str();
  score_app->add_option("--distance", score->params.distance_m, "an entry belongs to a rock within this, m")
      ->capture_default_str();
  score_app->callback([score] { print_score(*score); });
}

}  // namespace cairn::ground
