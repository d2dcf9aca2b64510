// cairn map build
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>

#include "base/boulder_table.hpp"
#include "base/output_file.hpp"
#include "base/progress_line.hpp"
#include "base/stop_signal.hpp"
#include "base/tool_error.hpp"
#include "cmap/cmap_file.hpp"
#include "commands/cmd_map.hpp"
#include "detect/map_build.hpp"
#include "map/geopackage.hpp"
#include "map/quicklook.hpp"
#include "ortho/heights.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

/// Smaller images take a second or two: no partial state for them.
constexpr std::uint64_t kStateFromPx = 64'000'000;

struct BuildOptions {
  fs::path ortho;
  fs::path from_csv;
  fs::path output;
  fs::path csv;
  fs::path gpkg;
  fs::path quicklook;
  fs::path dem;
  fs::path state;
  double min_diameter_m = 0.0;
  double quantum_m = 0.0;  ///< 0 = from the pixel
  int band = 0;
  int tile_px = 0;
  int threads = 0;
  std::string method;  ///< empty = by what is known of the sun
  std::string sun;     ///< empty = as the image's label has it
  DetectorParams detector;
  ShadowParams shadow;
  CmapOptions coding;
  CmapSource labels;  ///< site, epoch and revision
};

/// What the map is made of, from an orthoimage or from a table.
struct Prepared {
  std::vector<TableBoulder> boulders;
  MapExtent extent;
  CmapSource source;
};

/// Before the work: what could not be written or read after it.
void check_products(const BuildOptions& options) {
  for (const fs::path& path : {options.csv, options.gpkg, options.quicklook}) {
    if (!path.empty()) const OutputFile can_be_written(path);
  }
  std::vector<TableBoulder> none;
  if (!options.dem.empty()) sample_heights(options.dem, none, "local");
}

/// Encodes the map and writes all that is asked for, the map last.
void write_products(const BuildOptions& options, Prepared& made, OutputFile& map) {
  const std::string& system = made.source.reference_system;
  std::size_t heights = 0;
  if (!options.dem.empty()) heights = sample_heights(options.dem, made.boulders, system);
  const double quantum_m =
      options.quantum_m > 0.0 ? options.quantum_m : suitable_quantum_m(made.source.pixel_m);
  made.source.site = options.labels.site;
  made.source.epoch_s = options.labels.epoch_s;
  made.source.revision = options.labels.revision;
  CmapReport report;
  const std::vector<std::uint8_t> bytes =
      encode_cmap(made.boulders, made.extent, quantum_m, made.source, options.coding, &report);
  map.write(bytes);
  if (!options.csv.empty()) write_csv(options.csv, made.boulders, system);
  if (!options.gpkg.empty()) write_geopackage(options.gpkg, made.boulders, system);
  if (!options.quicklook.empty()) {
    QuicklookParams picture;
    picture.ortho = options.ortho;
    picture.band = options.band;
    write_quicklook(options.quicklook, made.boulders, made.extent, system, picture);
  }
  map.commit();
  fmt::print("{}: {} boulders on {:.1f} x {:.1f} m, {} bytes\n", options.output.string(), report.boulders,
             made.extent.max_x_m - made.extent.min_x_m, made.extent.max_y_m - made.extent.min_y_m,
             bytes.size());
  if (report.merged > 0)
    fmt::print("{} boulders omitted, each within {} m of a larger one\n", report.merged, quantum_m);
  if (!options.dem.empty())
    fmt::print("{}: ground height known for {} of them\n", options.dem.string(), heights);
}

BuildSettings settings_of(const BuildOptions& options) {
  BuildSettings settings;
  settings.tile_px = options.tile_px;
  settings.threads = options.threads;
  settings.state = options.state;
  if (options.state.empty()) {
    settings.state = options.output.string() + ".part";
    settings.state_from_px = kStateFromPx;
  }
  return settings;
}

/// The image and how boulders are found in it.
TileInput open_input(const BuildOptions& options) {
  TileInput input;
  input.source = open_orthoimage(options.ortho, options.band);
  Detection& detection = input.detection;
  detection.otsu = options.detector;
  detection.shadow = options.shadow;
  std::optional<Sun> sun = input.source->facts().sun;
  if (!options.sun.empty()) sun = parse_sun(options.sun);
  if (options.method == "shadow" && !sun) {
    throw ToolError("{}: its label does not give the position of the sun; give --sun ELEVATION,AZIMUTH",
                    options.ortho.string());
  }
  const bool shadow = options.method.empty() ? sun.has_value() : options.method == "shadow";
  detection.method = shadow ? cmap::Method::kShadow : cmap::Method::kOtsu;
  if (sun) detection.sun = *sun;
  return input;
}

/// In one line: what is done, and why.
void tell_method(const BuildOptions& options, const TileInput& input) {
  if (input.detection.method == cmap::Method::kShadow) {
    fmt::print("method shadow: sun at {} (elevation, azimuth in degrees) from {}\n",
               to_text(input.detection.sun), options.sun.empty() ? "the image's label" : "--sun");
  } else {
    fmt::print("method otsu{}\n",
               options.method.empty() ? ": the position of the sun is not known (see --sun)" : "");
  }
}

void leave_out_small(Prepared& made, const BuildOptions& options) {
  if (options.min_diameter_m <= 0.0) return;
  made.source.parameters += fmt::format(" min_diameter_m={}", options.min_diameter_m);
  made.boulders.erase(
      std::remove_if(made.boulders.begin(), made.boulders.end(),
                     [&](const TableBoulder& b) { return b.diameter_m < options.min_diameter_m; }),
      made.boulders.end());
}

void build_from_image(const BuildOptions& options, const MpiRanks& ranks) {
  OutputFile map(options.output);  // first, so that a folder that cannot be written is told before the work
  const TileInput input = open_input(options);
  const RasterFacts& facts = input.source->facts();
  tell_method(options, input);
  const StopSignal signal;
  ProgressLine progress(fmt::format("map build {}", options.ortho.filename().string()));
  BuildSettings settings = settings_of(options);
  settings.done = [&](double share) { progress.show(share); };
  settings.stop = [&] { return signal.asked(); };
  settings.say = [&](const std::string& line) { fmt::print(stderr, "{}\n", line); };
  MapBuild build(*input.source, input.detection, settings, ranks);
  Prepared made;
  made.boulders = build.run();
  progress.clear();
  made.extent = extent_of(facts.geo, facts.width, facts.height);
  made.source.method = input.detection.method;
  made.source.pixel_m = facts.geo.pixel_m();
  made.source.parameters = to_text(input.detection);
  made.source.reference_system = facts.reference_system;
  leave_out_small(made, options);
  if (made.boulders.empty()) {
    build.finished();
    throw ToolError("{}: no boulder found; try a smaller {}", options.ortho.string(),
                    input.detection.method == cmap::Method::kShadow
                        ? "--min-confidence or --min-diameter"
                        : "--min-area, --min-diameter or --threshold-scale");
  }
  write_products(options, made, map);
  build.finished();
}

void build_from_table(const BuildOptions& options) {
  OutputFile map(options.output);
  Prepared made;
  made.boulders = read_csv(options.from_csv, options.min_diameter_m);
  if (made.boulders.empty()) {
    throw ToolError("{}: contains no boulder of {} m or more; lower --min-diameter or give another table",
                    options.from_csv.string(), options.min_diameter_m);
  }
  made.extent = extent_of(made.boulders);
  made.source.parameters = fmt::format("table min_diameter_m={}", options.min_diameter_m);
  made.source.reference_system = reference_beside(options.from_csv);
  write_products(options, made, map);
}

void build(const BuildOptions& options) {
  const MpiRanks ranks;
  if (ranks.rank() > 0) {
    MapBuild::follow([&] { return open_input(options); }, settings_of(options), ranks);
    return;
  }
  const TileLead lead(ranks);
  if (options.ortho.empty() == options.from_csv.empty()) {
    throw ToolError("map build: give either an orthoimage or --from-csv TABLE");
  }
  check_products(options);
  if (options.from_csv.empty()) {
    build_from_image(options, ranks);
  } else {
    build_from_table(options);
  }
}

}  // namespace

void add_map_build(CLI::App& map) {
  const auto options = std::make_shared<BuildOptions>();
  BuildOptions& o = *options;
  DetectorParams& d = o.detector;
  CLI::App* build_app =
      map.add_subcommand("build", "make a flight map from an orthoimage, or from a table of boulders");
  build_app->add_option(
      "ORTHO", o.ortho,
      "orthoimage that GDAL opens, geo-referenced in metres (GeoTIFF, or world file beside it)");
  build_app->add_option("-o,--output", o.output, "the map to write (.cmap)")->required();
  build_app->add_option("--csv", o.csv,
                        "also write the boulders as a table (.csv, with .csvt and .prj beside it)");
  build_app->add_option("--gpkg", o.gpkg, "and as a GeoPackage");
  build_app->add_option("--quicklook", o.quicklook,
                        "also write a picture of them over the orthoimage "
                        "(.png)");
  build_app->add_option(
      "--dem", o.dem,
      "elevation model that GDAL opens: height of the ground under each boulder, for the tables");
  build_app->add_option(
      "--from-csv", o.from_csv,
      "take the boulders from this table (columns x, y, diameter) instead of an orthoimage");
  build_app->add_option("--min-diameter", o.min_diameter_m, "omit boulders smaller than this, m")
      ->check(CLI::NonNegativeNumber);
  build_app
      ->add_option("--quantum", o.quantum_m,
                   "step of the positions, m (default: a quarter of a pixel or finer, at least 2 mm)")
      ->check(CLI::PositiveNumber);
  build_app->add_flag("--positions-only", o.coding.positions_only, "omit sizes, heights and confidences");
  build_app->add_option("--tile-boulders", o.coding.boulders_per_tile, "average number of boulders per tile")
      ->check(CLI::Range(1.0, 4000.0))
      ->capture_default_str();
  build_app->add_option("--site", o.labels.site, "number of the landing site");
  build_app->add_option("--epoch", o.labels.epoch_s,
                        "time of the image, s since 2000-01-01T12:00:00 TT (0: unknown)");
  build_app->add_option("--revision", o.labels.revision, "revision number of the map of this site");
  build_app
      ->add_option("--band", o.band,
                   "band to use (default: mean of the first three of three or more, else 1)")
      ->check(CLI::PositiveNumber);
  build_app
      ->add_option("--tile", o.tile_px,
                   "side of the tiles that the image is cut into, px (default: chosen for the file); the "
                   "map does not depend on it")
      ->check(CLI::Range(kLeastTilePx, kMostTilePx));
  build_app->add_option("--threads", o.threads, "threads (default: all cores); the map does not depend on it")
      ->check(CLI::Range(1, kMostThreads));
  build_app->add_option(
      "--state", o.state,
      "keep finished tiles in this file, so that an interrupted run can be resumed (default: OUTPUT.part "
      "for images of 64 Mpixel and more)");
  const char* detector = "Detector";
  build_app
      ->add_option(
          "--method", o.method,
          "shadow: pairs bodies and shadows along the sun's direction (default where the sun is known); "
          "otsu: the paper's detector")
      ->check(CLI::IsMember({"otsu", "shadow"}))
      ->group(detector);
  build_app
      ->add_option(
          "--sun", o.sun,
          "ELEVATION,AZIMUTH in degrees, azimuth towards the sun, clockwise from north (default: from the "
          "image's label)")
      ->group(detector);
  build_app
      ->add_option("--min-confidence", o.shadow.min_confidence,
                   "shadow: omit candidates with a smaller probability of being a boulder")
      ->capture_default_str()
      ->group(detector);
  build_app->add_option("--background", d.background_m, "side of the window that a pixel is compared with, m")
      ->capture_default_str()
      ->group(detector);
  build_app->add_option("--block", d.block_m, "side of the blocks of the adaptive threshold, m")
      ->capture_default_str()
      ->group(detector);
  build_app
      ->add_option("--threshold-scale", d.threshold_scale,
                   "factor on Otsu's threshold; smaller values find fainter boulders")
      ->capture_default_str()
      ->group(detector);
  build_app
      ->add_option("--noise-sigmas", d.noise_sigmas,
                   "lowest threshold, in standard deviations of the ground's texture")
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

}  // namespace cairn::ground
