// cairn map build
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>

#include "base/boulder_table.hpp"
#include "base/json_file.hpp"
#include "base/number_table.hpp"
#include "base/output_file.hpp"
#include "base/progress_line.hpp"
#include "base/tool_error.hpp"
#include "base/waypoints.hpp"
#include "cmap/cmap_file.hpp"
#include "commands/cmd_map.hpp"
#include "core/trig.hpp"
#include "detect/map_build.hpp"
#include "detect/sun_check.hpp"
#include "map/geopackage.hpp"
#include "map/quality.hpp"
#include "map/quicklook.hpp"
#include "ortho/heights.hpp"
#include "ortho/reference_system.hpp"
#include "ortho/true_scale.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

/// Smaller images take a second or two: no partial state for them.
constexpr std::uint64_t kStateFromPx = 64'000'000;

struct BuildOptions {
  fs::path ortho;
  fs::path from_csv;
  fs::path from_gpkg;
  fs::path like;
  fs::path output;
  fs::path csv;
  fs::path gpkg;
  fs::path quicklook;
  fs::path quality;
  fs::path dem;
  double height_step_m = 0.0;   ///< from post to post; 0 = from the elevation model's pixel
  double height_sigma_m = 0.0;  ///< 0 = from the elevation model's pixel
  HeightGrid heights_like;      ///< of the map that --like names
  fs::path state;
  double min_diameter_m = 0.0;
  double quantum_m = 0.0;  ///< 0 = from the pixel
  int band = 0;
  std::string no_data;  ///< a number, "none", or empty = as the image marks it
  int tile_px = 0;
  int threads = 0;
  std::string method;  ///< empty = by what is known of the sun
  std::string sun;     ///< empty = as the image's label has it
  std::string sun_grid;
  std::string scale = "auto";
  DetectorParams detector;
  ShadowParams shadow;
  CmapOptions coding;
  CmapSource labels;  ///< site, epoch and revision
};

/// What the map is made of, from an orthoimage or from a table.
struct Prepared {
  std::vector<TableBoulder> boulders;
  std::vector<TableBoulder> craters;  ///< for the tables alone
  MapExtent extent;
  CmapSource source;
};

/// Before the work: what could not be written or read after it.
void check_products(const BuildOptions& options) {
  for (const fs::path& path : {options.csv, options.gpkg, options.quicklook, options.quality}) {
    if (!path.empty()) const OutputFile can_be_written(path);
  }
  std::vector<TableBoulder> none;
  if (!options.dem.empty()) sample_heights(options.dem, none, "local");
}

/// Craters are landmarks of their own: their tables are written where there is no boulder, and so no map.
/// Returns what was written, in words.
std::string write_craters_alone(const BuildOptions& options, const Prepared& made) {
  const std::string& system = made.source.reference_system;
  std::vector<std::string> written;
  if (!options.csv.empty()) {
    write_csv(options.csv, {}, system, made.craters);
    written.push_back(options.csv.string());
  }
  if (!options.gpkg.empty()) {
    write_geopackage(options.gpkg, {}, system, made.craters);
    written.push_back(options.gpkg.string());
  }
  return fmt::format(", but {} craters{}{}", made.craters.size(), written.empty() ? "" : ", which are in ",
                     fmt::join(written, " and "));
}

/// Square of samples about a post, where the model's pixels are finer than the posts.
constexpr std::uint32_t kMostFine = 4;
constexpr std::size_t kMostSamples = 30'000'000;
/// From post to post, where nothing is asked: no less than a rover needs, and than a stereo model resolves.
constexpr double kHeightStep_m = 0.5;
constexpr double kHeightStepPx = 2.0;
/// Of a pixel of a stereo elevation model: what its heights are off in common, near each other.
constexpr double kDemSigmaPx = 0.25;

/// Cells from post to post.
std::uint32_t height_spacing(const BuildOptions& options, double quantum_m, double pixel_m) {
  const CmapLayout* like = options.coding.like;
  if (options.heights_like.present()) return options.heights_like.spacing;
  const double step_m =
      options.height_step_m > 0.0 ? options.height_step_m : std::max(kHeightStep_m, kHeightStepPx * pixel_m);
  const double wanted = std::round(step_m / quantum_m);
  const auto cells = static_cast<std::uint32_t>(std::clamp(wanted, 1.0, 1.0 * cmap::kMaxTileSide));
  if (like == nullptr) return cells;
  std::uint32_t best = like->tile_side;
  for (std::uint32_t steps = 1; steps <= cmap::kMaxTileSteps; ++steps) {  // the nearest that tiles go by
    const std::uint32_t spacing = like->tile_side / steps;
    const auto off = [&](std::uint32_t s) { return std::fabs(std::log(static_cast<double>(s) / cells)); };
    if (spacing > 0 && spacing * steps == like->tile_side && off(spacing) < off(best)) best = spacing;
  }
  return best;
}

/// The heights of the map's ground, from --dem.
HeightGrid heights_of(const BuildOptions& options, const Prepared& made, double quantum_m) {
  const CmapLayout cells =
      options.coding.like != nullptr ? *options.coding.like : cells_of(made.extent, quantum_m);
  const double pixel_m =
      heights_at(options.dem, {{made.extent.min_x_m, made.extent.min_y_m}}, made.source.reference_system)
          .pixel_m;
  const std::uint32_t spacing = height_spacing(options, quantum_m, pixel_m);
  HeightSamples samples;
  const std::size_t columns = posts_along(cells.extent_x, spacing);
  const std::size_t rows = posts_along(cells.extent_y, spacing);
  if (columns * rows > kMostSamples)
    throw ToolError("--height-step: {} m gives {} heights, more than {}; choose a larger one",
                    spacing * quantum_m, columns * rows, kMostSamples);
  while (samples.fine < kMostFine && samples.fine * pixel_m < spacing * quantum_m &&
         (samples.fine + 1) * (samples.fine + 1) * columns * rows <= kMostSamples)
    ++samples.fine;
  samples.columns = static_cast<std::uint32_t>(columns - 1) * samples.fine + 1U;
  samples.rows = static_cast<std::uint32_t>(rows - 1) * samples.fine + 1U;
  std::vector<Vec2> places;
  const double step = static_cast<double>(spacing) / samples.fine;
  for (std::uint32_t v = 0; v < samples.rows; ++v) {
    for (std::uint32_t u = 0; u < samples.columns; ++u) {
      places.emplace_back(cells.origin_x_m + std::min(u * step, cells.extent_x - 1.0) * quantum_m,
                          cells.origin_y_m + std::min(v * step, cells.extent_y - 1.0) * quantum_m);
    }
  }
  samples.z_m = heights_at(options.dem, places, made.source.reference_system).z_m;
  const double sigma_m = options.height_sigma_m > 0.0 ? options.height_sigma_m : kDemSigmaPx * pixel_m;
  return fit_heights(samples, spacing, sigma_m, options.heights_like);
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
  CmapOptions coding = options.coding;
  HeightGrid grid;
  if (!options.dem.empty()) {
    grid = heights_of(options, made, quantum_m);
    coding.heights = &grid;
  }
  const std::vector<std::uint8_t> bytes =
      encode_cmap(made.boulders, made.extent, quantum_m, made.source, coding, &report);
  map.write(bytes);
  if (!options.csv.empty()) write_csv(options.csv, made.boulders, system, made.craters);
  if (!options.gpkg.empty()) write_geopackage(options.gpkg, made.boulders, system, made.craters);
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
  if (options.dem.empty()) return;
  fmt::print("{}: ground height known for {} of them\n", options.dem.string(), heights);
  fmt::print(
      "heights each {:g} m in steps of {:g} mm, {} of {} known; the ground is {:.1f} mm off them (1 sigma), "
      "and the elevation model taken to be good to {:.3g} m ({})\n",
      grid.spacing * quantum_m, 0.001 * grid.quantum_um, grid.known(), grid.posts.size(),
      1000.0 * grid.sigma_m, grid.common_m,
      options.height_sigma_m > 0.0 ? "as told" : "by its pixel; tell what is true by --height-sigma");
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

NoDataChoice no_data_of(const BuildOptions& options) {
  NoDataChoice choice;
  choice.guess = options.no_data.empty();
  if (options.no_data.empty() || options.no_data == "none") return choice;
  choice.value = to_finite(options.no_data);
  if (!choice.value) {
    throw ToolError("--no-data: '{}' is no number; give the value of the pixels without data, or none",
                    options.no_data);
  }
  return choice;
}

/// Longer over shorter side of a pixel on the ground.
double oblongness(const RasterFacts& facts, const std::optional<SiteFrame>& frame) {
  Mat2 pixel;
  pixel << facts.geo.c[1], facts.geo.c[2], facts.geo.c[4], facts.geo.c[5];
  if (frame) pixel = (frame->map_from_ground.inverse() * pixel).eval();
  const double across = pixel.col(0).norm();
  const double down = pixel.col(1).norm();
  return std::max(across, down) / std::min(across, down);
}

void check_pixels(const BuildOptions& options, const RasterFacts& facts,
                  const std::optional<SiteFrame>& frame) {
  constexpr double kMostOblong = 1.1;  // a boulder's width and length are 5 % off their mean
  const double ratio = oblongness(facts, frame);
  if (ratio <= kMostOblong) return;
  const double side_m = facts.geo.pixel_m() / std::sqrt(ratio);
  throw ToolError(
      "{}: its pixels are {:.2f} times as long as wide{}; make them square with gdalwarp {}-tr {:.4g} "
      "{:.4g} -r cubic",
      options.ortho.string(), ratio, frame ? " on the ground" : "",
      frame ? fmt::format("-t_srs '{}' ", local_reference(facts.reference_system, *frame)) : "", side_m,
      side_m);
}

/// `auto`, or an elevation with it: the image itself is asked.
bool sun_is_asked(const BuildOptions& options) {
  const std::string& text = options.sun;
  return text == "auto" || (text.size() > 5 && text.compare(text.size() - 5, 5, ",auto") == 0);
}

/// In the map's axes; where the elevation is not told, that of the label.
SunGuess asked_sun(const BuildOptions& options, const RasterSource& source, const std::optional<Sun>& label) {
  double elevation_rad = label ? label->elevation_rad : 0.0;
  if (options.sun != "auto")
    elevation_rad = parse_sun(options.sun.substr(0, options.sun.size() - 4) + "0").elevation_rad;
  return guess_sun(*source.reader(), source.facts(), elevation_rad);
}

void tell_guess(const SunGuess& guess) {
  fmt::print(
      "sun by the image itself: azimuth {:.0f} of the map's axes; log odds for it {:+.2f}, for the best of other "
      "directions {:+.2f}, for the opposite one {:+.2f}, mean of {} dark spots{}\n",
      guess.sun.azimuth_rad * kDegPerRad, guess.best.mean(), guess.rival.mean(), guess.opposite.mean(),
      guess.best.fits, guess.is_sure() ? "" : ": not sure");
}

/// The sun as told, its azimuth clockwise from north; nothing where it is not known.
std::optional<Sun> sun_from_north(const BuildOptions& options, const RasterFacts& facts,
                                  const std::optional<SiteFrame>& frame) {
  if (!options.sun.empty() && !sun_is_asked(options)) return parse_sun(options.sun);
  std::optional<Sun> sun = facts.sun;
  if (!options.sun_grid.empty()) sun = parse_sun(options.sun_grid, "--sun-grid");
  if (sun && frame) sun->azimuth_rad = frame->azimuth_from_north(sun->azimuth_rad);
  return sun;
}

/// Whether the map leaves the projection for the ground's own metres.
bool on_ground(const BuildOptions& options, const SiteFrame& frame) {
  const double tolerance = options.scale == "ground" ? kScaleTolerance : kScaleLeft;
  return options.scale != "projection" && scale_error(frame) > tolerance;
}

/// The image and how boulders are found in it.
struct BuildInput : TileInput {
  std::optional<SunGuess> guess;        ///< where the image itself was asked for its sun
  std::vector<std::string> sun_doubts;  ///< what speaks against that sun, or the one told
};

BuildInput open_input(const BuildOptions& options) {
  BuildInput input;
  input.source = open_orthoimage(options.ortho, options.band, no_data_of(options));
  Detection& detection = input.detection;
  detection.otsu = options.detector;
  detection.shadow = options.shadow;
  std::optional<SiteFrame> frame =
      site_frame(input.source->facts().reference_system, middle_of(input.source->facts()));
  check_pixels(options, input.source->facts(), frame);
  std::optional<Sun> sun = sun_from_north(options, input.source->facts(), frame);
  if (frame && on_ground(options, *frame)) {
    input.source = std::make_unique<TrueScaleSource>(std::move(input.source), *frame);
    frame = site_frame(input.source->facts().reference_system, middle_of(input.source->facts()));
  }
  if (sun && frame) sun->azimuth_rad = frame->azimuth_in_map(sun->azimuth_rad);
  if (sun_is_asked(options)) {
    input.guess = asked_sun(options, *input.source, sun);
    sun = input.guess->sun;
  }
  if (options.method == "shadow" && !sun) {
    throw ToolError("{}: its label does not give the position of the sun; give --sun ELEVATION,AZIMUTH",
                    options.ortho.string());
  }
  const bool shadow = options.method.empty() ? sun.has_value() : options.method == "shadow";
  detection.method = shadow ? cmap::Method::kShadow : cmap::Method::kOtsu;
  if (sun) detection.sun = *sun;
  if (options.min_diameter_m > 0.0) {
    detection.shadow =
        options.shadow.with_boulders_of(options.min_diameter_m, input.source->facts().geo.pixel_m());
  }
  return input;
}

const char* sun_from(const BuildOptions& options) {
  return sun_is_asked(options)       ? "the image itself"
         : !options.sun.empty()      ? "--sun"
         : !options.sun_grid.empty() ? "--sun-grid"
                                     : "the image's label";
}

/// In one line: what is done, and why.
void tell_method(const BuildOptions& options, const TileInput& input) {
  if (input.detection.method != cmap::Method::kShadow) {
    fmt::print("method otsu{}\n",
               options.method.empty() ? ": the position of the sun is not known (see --sun)" : "");
    return;
  }
  const RasterFacts& facts = input.source->facts();
  const std::optional<SiteFrame> frame = site_frame(facts.reference_system, middle_of(facts));
  const Sun& in_map = input.detection.sun;
  Sun from_north = in_map;
  if (frame) from_north.azimuth_rad = frame->azimuth_from_north(in_map.azimuth_rad);
  const bool turned = std::fabs(wrap_angle(in_map.azimuth_rad - from_north.azimuth_rad)) > 1e-3;
  fmt::print(
      "method shadow: sun at {} (elevation, azimuth in degrees) from {}{}\n", to_text(from_north),
      sun_from(options),
      turned ? fmt::format("; azimuth {:.1f} in the map's axes", in_map.azimuth_rad * kDegPerRad) : "");
}

/// What becomes of a scale that is not the ground's: `system` is the map's.
void tell_scale(const std::string& words, const std::string& own, const std::string& system) {
  if (words.empty()) return;
  if (same_reference(own, system)) {
    fmt::print(stderr,
               "cairn: warning: {}; the map keeps these metres (--scale ground: it has the ground's)\n",
               words);
  } else {
    fmt::print("scale: {}; the map has metres of the ground, in {}\n", words, system);
  }
}

/// The largest body that is looked for; what is larger is a scarp's shadow, or a boundary.
std::size_t leave_out_large(Prepared& made) {
  const double most_m = ShadowParams().max_diameter_m;
  const auto too_large = [&](const TableBoulder& b) { return b.diameter_m > most_m; };
  const auto count = std::count_if(made.boulders.begin(), made.boulders.end(), too_large);
  if (count == 0) return 0;
  made.boulders.erase(std::remove_if(made.boulders.begin(), made.boulders.end(), too_large),
                      made.boulders.end());
  fmt::print("{} dark areas larger than {} m omitted: no boulders\n", count, most_m);
  return static_cast<std::size_t>(count);
}

void leave_out_small(Prepared& made, const BuildOptions& options) {
  if (options.min_diameter_m <= 0.0) return;
  made.source.parameters += fmt::format(" min_diameter_m={}", options.min_diameter_m);
  made.boulders.erase(
      std::remove_if(made.boulders.begin(), made.boulders.end(),
                     [&](const TableBoulder& b) { return b.diameter_m < options.min_diameter_m; }),
      made.boulders.end());
}

/// Boulders of a few pixels must not be larger than the largest looked for.
void check_coarseness(const BuildOptions& options, const TileInput& input) {
  const ShadowParams& shadow = input.detection.shadow;
  const double pixel_m = input.source->facts().geo.pixel_m();
  const double least_m = shadow.min_diameter_px * pixel_m;
  if (input.detection.method != cmap::Method::kShadow || least_m <= shadow.max_diameter_m) return;
  throw ToolError(
      "{}: pixels of {:.3g} m are too coarse: {} of them are {:.3g} m, and boulders of up to {} m are "
      "looked for; give an image of {:.2g} m a pixel or finer",
      options.ortho.string(), pixel_m, shadow.min_diameter_px, least_m, shadow.max_diameter_m,
      shadow.max_diameter_m / (2.0 * shadow.min_diameter_px));
}

/// An azimuth given where the shadows point is an easy slip.
std::vector<std::string> reversed_sun(const BuildInput& input, int threads) {
  const SunCheck seen =
      check_sun(*input.source->reader(), input.source->facts(), input.detection.sun, threads);
  if (!seen.looks_reversed()) return {};
  return {fmt::format(
      "bodies, hollows and their shadows fit better with the sun the other way round (log odds {:+.2f} against "
      "{:+.2f}, mean of {} dark spots): is the azimuth where shadows point? It leads towards the sun; try one "
      "turned by 180 degrees",
      seen.opposite.mean(), seen.told.mean(), seen.told.fits)};
}

std::vector<std::string> sun_doubts(const BuildInput& input, int threads) {
  if (input.detection.method != cmap::Method::kShadow) return {};
  if (!input.guess) return reversed_sun(input, threads);
  if (input.guess->is_sure()) return {};
  return {"the image does not clearly tell where its sun stood; look at its shadows, and give --sun"};
}

/// The map's last word: whether it looks like a field of boulders, and what it was made from.
void tell_quality(const BuildOptions& options, const BuildInput& input, const Prepared& made,
                  const std::string& scale, std::size_t dark_areas) {
  const MapQuality quality = quality_of(made.boulders, made.craters, made.extent);
  const bool shadow = input.detection.method == cmap::Method::kShadow;
  const std::string sun = shadow ? to_text(input.detection.sun) : "";
  fmt::print("quality: {}; sun {}; scale {}\n", to_text(quality),
             shadow ? fmt::format("{} from {}{}", sun, sun_from(options),
                                  input.sun_doubts.empty() ? "" : ", in doubt")
                    : "not used",
             scale.empty() ? "true" : scale);
  for (const std::string& doubt : quality.doubts())
    fmt::print(stderr, "cairn: warning: {}: {}\n", options.output.string(), doubt);
  if (options.quality.empty()) return;
  nlohmann::ordered_json json = to_json(quality);
  for (const std::string& doubt : input.sun_doubts) json["doubts"].push_back(doubt);
  json["sun"] = shadow ? nlohmann::ordered_json(sun) : nlohmann::ordered_json(nullptr);
  json["sun_from"] = shadow ? nlohmann::ordered_json(sun_from(options)) : nlohmann::ordered_json(nullptr);
  json["scale"] = scale;
  json["dark_areas_omitted"] = dark_areas;
  json["remarks"] = input.source->facts().remarks;
  write_file(options.quality, to_text(json));
}

/// Of the image as it is: its system, and scale_words().
std::pair<std::string, std::string> own_scale(const BuildOptions& options) {
  const std::unique_ptr<RasterSource> image =
      open_orthoimage(options.ortho, options.band, {std::nullopt, false});
  const RasterFacts& facts = image->facts();
  return {facts.reference_system, scale_words(facts.reference_system, middle_of(facts))};
}

/// Of the ground that the image covers, before the work: what could not be taken after it.
void check_heights(const BuildOptions& options, const RasterFacts& facts) {
  if (options.dem.empty()) return;
  const MapExtent e = extent_of(facts.geo, facts.width, facts.height);
  heights_at(options.dem, {{e.min_x_m, e.min_y_m}, {e.max_x_m, e.max_y_m}}, facts.reference_system);
}

void build_from_image(const BuildOptions& options, const MpiRanks& ranks) {
  OutputFile map(options.output);  // first, so that a folder that cannot be written is told before the work
  BuildInput input = open_input(options);
  const RasterFacts& facts = input.source->facts();
  check_heights(options, facts);
  for (const std::string& remark : facts.remarks)
    fmt::print(stderr, "cairn: warning: {}: {}\n", options.ortho.string(), remark);
  if (input.guess) tell_guess(*input.guess);
  tell_method(options, input);
  const auto* const true_scale = dynamic_cast<const TrueScaleSource*>(input.source.get());
  const auto [own_system, own_words] = own_scale(options);
  tell_scale(own_words, own_system, facts.reference_system);
  const StopSignal signal;
  ProgressLine progress(fmt::format("map build {}", options.ortho.filename().string()));
  BuildSettings settings = settings_of(options);
  settings.done = [&](double share) { progress.show(share); };
  settings.stop = [&] { return signal.asked(); };
  settings.say = [&](const std::string& line) { fmt::print(stderr, "{}\n", line); };
  check_coarseness(options, input);
  input.sun_doubts = sun_doubts(input, options.threads);  // told before the work, which may take long
  for (const std::string& doubt : input.sun_doubts)
    fmt::print(stderr, "cairn: warning: {}: {}\n", options.ortho.string(), doubt);
  MapBuild build(*input.source, input.detection, settings, ranks);
  Prepared made;
  made.boulders = build.run();
  made.craters = build.craters();
  progress.clear();
  if (true_scale != nullptr) {
    true_scale->place(made.boulders);
    true_scale->place(made.craters);
  }
  made.extent =
      true_scale != nullptr ? true_scale->extent() : extent_of(facts.geo, facts.width, facts.height);
  made.source.method = input.detection.method;
  made.source.pixel_m = facts.geo.pixel_m();
  made.source.parameters = to_text(input.detection);
  made.source.reference_system = facts.reference_system;
  leave_out_small(made, options);
  const std::size_t dark_areas = leave_out_large(made);
  if (made.boulders.empty()) {
    build.finished();
    throw ToolError("{}: no boulder found{}; no map is made; try a smaller {}", options.ortho.string(),
                    made.craters.empty() ? "" : write_craters_alone(options, made),
                    input.detection.method == cmap::Method::kShadow
                        ? "--min-confidence or --min-diameter"
                        : "--min-area, --min-diameter or --threshold-scale");
  }
  write_products(options, made, map);
  tell_quality(options, input, made, own_words, dark_areas);
  build.finished();
}

/// Positions of a projection of another scale become metres of the ground; diameters are that already.
void place_on_ground(const BuildOptions& options, Prepared& made) {
  const std::string own = made.source.reference_system;
  const MapExtent e = extent_of(made.boulders);
  const Vec2 middle_m(0.5 * (e.min_x_m + e.max_x_m), 0.5 * (e.min_y_m + e.max_y_m));
  const std::string words = scale_words(own, middle_m);
  if (words.empty()) return;
  if (on_ground(options, *site_frame(own, middle_m))) {
    made.source.reference_system = local_reference(own, *site_frame(own, middle_m));
    const Places to_ground(own, made.source.reference_system);
    for (TableBoulder& b : made.boulders) b.p_map_m = to_ground(b.p_map_m);
  }
  tell_scale(words, own, made.source.reference_system);
}

/// Grid, tables and system of the map that the table was taken from: what did not change is the same bytes.
CmapLayout take_after(const BuildOptions& options, Prepared& made, BuildOptions& as_base) {
  const CmapContent base = load_map(options.like);
  as_base.heights_like = base.heights;
  if (base.heights.present() && options.dem.empty())
    fmt::print(stderr, "cairn: warning: {} has heights, {} will have none (give --dem)\n",
               options.like.string(), options.output.string());
  const bool same = same_reference(made.source.reference_system, base.reference_system);
  if (!same && !is_local_reference(made.source.reference_system))
    throw ToolError("{}: is in {}, {} in {}; give both in one system", options.like.string(),
                    base.reference_system, options.output.string(), made.source.reference_system);
  made.source.reference_system = base.reference_system;
  made.source.pixel_m = base.pixel_m;
  made.extent = base.extent;
  as_base.quantum_m = base.quantum_m;
  if (as_base.labels.site == 0) as_base.labels.site = base.site;
  if (as_base.labels.epoch_s == 0) as_base.labels.epoch_s = base.epoch_s;
  for (const TableBoulder& b : made.boulders) {
    if (!base.extent.contains(b.p_map_m))
      throw ToolError("{}: ({:.3f}, {:.3f}) lies outside {}; omit --like, or remove it",
                      options.from_csv.string() + options.from_gpkg.string(), b.p_map_m.x(), b.p_map_m.y(),
                      options.like.string());
  }
  return base.layout;
}

/// Boulders in one another are degrees in columns of metres.
void warn_of_degrees(const fs::path& table, const std::vector<TableBoulder>& boulders) {
  std::vector<Vec2> places;
  double largest_m = 0.0;
  for (const TableBoulder& b : boulders) {
    places.push_back(b.p_map_m);
    largest_m = std::max(largest_m, b.diameter_m);
  }
  const MapExtent e = extent_of(boulders);
  if (boulders.size() < 2 || !in_degrees(places) ||
      std::max(e.max_x_m - e.min_x_m, e.max_y_m - e.min_y_m) > largest_m)
    return;
  fmt::print(
      stderr,
      "cairn: warning: {}: all {} boulders lie within the largest one's diameter of {:.3g} m; x and y are "
      "taken as metres (are they degrees?)\n",
      table.string(), boulders.size(), largest_m);
}

void build_from_table(const BuildOptions& options) {
  OutputFile map(options.output);
  Prepared made;
  const fs::path& table = options.from_csv.empty() ? options.from_gpkg : options.from_csv;
  if (options.from_csv.empty()) {
    PointLayer layer = read_points(table, options.min_diameter_m);
    made.boulders = std::move(layer.boulders);
    made.source.reference_system = layer.reference_system;
  } else {
    made.boulders = read_csv(table, options.min_diameter_m);
    made.source.reference_system = reference_beside(table);
  }
  if (made.boulders.empty()) {
    throw ToolError("{}: contains no boulder of {} m or more; lower --min-diameter or give another table",
                    table.string(), options.min_diameter_m);
  }
  warn_of_degrees(table, made.boulders);
  made.source.parameters = fmt::format("table min_diameter_m={}", options.min_diameter_m);
  if (!options.like.empty()) {
    BuildOptions as_base = options;
    const CmapLayout layout = take_after(options, made, as_base);
    as_base.coding.like = &layout;
    write_products(as_base, made, map);
    return;
  }
  place_on_ground(options, made);
  made.extent = extent_of(made.boulders);
  write_products(options, made, map);
}

void build(const BuildOptions& options) {
  const MpiRanks ranks;
  if (ranks.rank() > 0) {
    MapBuild::follow([&] { return open_input(options); }, settings_of(options), ranks);
    return;
  }
  const TileLead lead(ranks);
  const int inputs = static_cast<int>(!options.ortho.empty()) + static_cast<int>(!options.from_csv.empty()) +
                     static_cast<int>(!options.from_gpkg.empty());
  if (inputs != 1)
    throw ToolError("map build: give either an orthoimage, --from-csv TABLE or --from-gpkg LAYER");
  if (!options.like.empty() && !options.ortho.empty())
    throw ToolError("--like: is for tables; build both images with the same options");
  check_products(options);
  if (!options.ortho.empty()) {
    build_from_image(options, ranks);
  } else {
    build_from_table(options);
  }
}

}  // namespace

void add_map_build(Command map) {
  const auto options = std::make_shared<BuildOptions>();
  BuildOptions& o = *options;
  DetectorParams& d = o.detector;
  Command build_app =
      map.add_command("build", "make a flight map from an orthoimage, or from a table of boulders");
  build_app.add_option(
      "ORTHO", o.ortho,
      "orthoimage that GDAL opens, geo-referenced in metres (GeoTIFF, or world file beside it)");
  build_app.add_option("-o,--output", o.output, "the map to write (.cmap)").written().required();
  build_app
      .add_option("--csv", o.csv, "also write the boulders as a table (.csv, with .csvt and .prj beside it)")
      .written();
  build_app.add_option("--gpkg", o.gpkg, "and as a GeoPackage").written();
  build_app
      .add_option("--quicklook", o.quicklook,
                  "also write a picture of them over the orthoimage "
                  "(.png)")
      .written();
  build_app.add_option("--quality", o.quality, "also write what the map's last line says of it (.json)")
      .written();
  build_app.add_option(
      "--dem", o.dem,
      "elevation model that GDAL opens: the map carries its heights, the tables those under each boulder");
  build_app
      .add_option(
          "--height-step", o.height_step_m,
          "distance of the map's heights, m (default: 0.5, and no less than two of the model's pixels)")
      .within(0.01, 100.0)
      .needs("--dem");
  build_app
      .add_option("--height-sigma", o.height_sigma_m,
                  "what heights near each other are off in common, m (default: a quarter of the elevation "
                  "model's pixel)")
      .within(0.001, 1000.0)
      .needs("--dem");
  build_app.add_option("--from-csv", o.from_csv,
                       "take the boulders from this table (columns x, y, diameter) instead of an orthoimage");
  build_app.add_option("--from-gpkg", o.from_gpkg,
                       "or from the points of a GeoPackage, GeoJSON or shapefile with a field diameter_m");
  build_app.add_option(
      "--like", o.like,
      "a table: with the grid, attributes and system of this map (.cmap), which it was taken "
      "from, so that map uplink can send the difference");
  build_app
      .add_option("--min-diameter", o.min_diameter_m,
                  "omit boulders smaller than this, m; below 3 px: find them, too, down to 2.4 px")
      .not_negative();
  build_app
      .add_option("--quantum", o.quantum_m,
                  "step of the positions, m (default: a quarter of a pixel or finer, at least 2 mm)")
      .positive();
  build_app
      .add_option(
          "--scale", o.scale,
          "metres of the map where the projection's differ from the ground's: auto (the ground's, from 1 % "
          "on), ground (from 0.1 % on), projection (never)")
      .one_of({"auto", "ground", "projection"})
      .default_shown();
  build_app.add_flag("--positions-only", o.coding.positions_only, "omit sizes, heights and confidences");
  build_app.add_option("--tile-boulders", o.coding.boulders_per_tile, "average number of boulders per tile")
      .within(1.0, 4000.0)
      .default_shown();
  build_app.add_option("--site", o.labels.site, "number of the landing site");
  build_app.add_option("--epoch", o.labels.epoch_s,
                       "time of the image, s since 2000-01-01T12:00:00 TT (0: unknown)");
  build_app.add_option("--revision", o.labels.revision, "revision number of the map of this site");
  build_app
      .add_option("--band", o.band, "band to use (default: mean of the first three of three or more, else 1)")
      .positive();
  build_app.add_option("--no-data", o.no_data,
                       "value of pixels without data, besides those that the image marks; none: do not look "
                       "for an unmarked collar");
  build_app
      .add_option("--tile", o.tile_px,
                  "side of the tiles that the image is cut into, px (default: chosen for the file); the "
                  "map does not depend on it")
      .within(kLeastTilePx, kMostTilePx);
  build_app.add_option("--threads", o.threads, "threads (default: all cores); the map does not depend on it")
      .within(1, kMostThreads);
  build_app
      .add_option(
          "--state", o.state,
          "keep finished tiles in this file, so that an interrupted run can be resumed (default: OUTPUT.part "
          "for images of 64 Mpixel and more)")
      .written();
  const char* detector = "Detector";
  build_app
      .add_option(
          "--method", o.method,
          "shadow: pairs bodies and shadows along the sun's direction (default where the sun is known); "
          "otsu: the paper's detector")
      .one_of({"otsu", "shadow"})
      .group(detector);
  build_app
      .add_option(
          "--sun", o.sun,
          "ELEVATION,AZIMUTH in degrees, azimuth towards the sun, clockwise from true north (default: from "
          "the image's label); auto, or ELEVATION,auto: from the image itself")
      .group(detector);
  build_app
      .add_option("--sun-grid", o.sun_grid,
                  "the same with the azimuth clockwise from the y axis of the image's projection")
      .excludes("--sun")
      .group(detector);
  build_app
      .add_option("--min-confidence", o.shadow.min_confidence,
                  "shadow: omit candidates with a smaller probability of being a boulder")
      .default_shown()
      .group(detector);
  build_app.add_option("--background", d.background_m, "side of the window that a pixel is compared with, m")
      .default_shown()
      .group(detector);
  build_app.add_option("--block", d.block_m, "side of the blocks of the adaptive threshold, m")
      .default_shown()
      .group(detector);
  build_app
      .add_option("--threshold-scale", d.threshold_scale,
                  "factor on Otsu's threshold; smaller values find fainter boulders")
      .default_shown()
      .group(detector);
  build_app
      .add_option("--noise-sigmas", d.noise_sigmas,
                  "lowest threshold, in standard deviations of the ground's texture")
      .default_shown()
      .group(detector);
  build_app.add_option("--median", d.median_m, "side of the median filter, m (3 to 15 px)")
      .default_shown()
      .group(detector);
  build_app.add_option("--min-area", d.min_area_m2, "smallest blob, m2").default_shown().group(detector);
  build_app.add_option("--min-area-px", d.min_area_px, "smallest blob, pixels")
      .default_shown()
      .group(detector);
  build_app.on_run([options] { build(*options); });
}

}  // namespace cairn::ground
