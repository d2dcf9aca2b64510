// cairn map forecast: where along a planned drive fixes will succeed.
#include <fmt/format.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/output_file.hpp"
#include "base/progress_line.hpp"
#include "base/tool_error.hpp"
#include "base/waypoints.hpp"
#include "cmap/cmap_file.hpp"
#include "commands/cmd_map.hpp"
#include "forecast/forecast.hpp"
#include "forecast/forecast_files.hpp"
#include "forecast/forecast_layers.hpp"
#include "forecast/forecast_plot.hpp"
#include "forecast/model_file.hpp"
#include "map/way_file.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

constexpr double kMostFrames = 1.0e6;

struct ForecastOptions {
  fs::path map;
  fs::path path;
  fs::path output;
  fs::path csv;
  fs::path geojson;
  fs::path geopackage;
  fs::path plot;
  bool json = false;
  std::string mission = cfg::kMission.name;
  double step_m = cfg::kMission.usual_step_m;
  double turn_step_deg = cfg::kMission.usual_turn_rad * kDegPerRad;
  double start_yaw_deg = 0.01 * kDegPerRad;
  double drift_yaw_deg_per_m = cfg::kMission.drift_yaw_rad_per_m * kDegPerRad;
  ForecastModel model;  ///< what is not of the map's detector: start, drift, borders
  /// What the command line says of the detection, in its order: on top of what is known
  /// of the map's detector.
  std::vector<std::function<void(ForecastModel&)>> changes;
};

ForecastModel model_of(const ForecastOptions& options, const CmapContent& map) {
  ForecastModel model = mission_model(map.method, map.pixel_m);
  for (const auto& change : options.changes) change(model);
  check_model(model, "map forecast");
  model.sigma_start_xy_m = options.model.sigma_start_xy_m;
  model.sigma_start_yaw_rad = options.start_yaw_deg * kRadPerDeg;
  model.fusion.sigma_scale = options.model.fusion.sigma_scale;
  model.fusion.sigma_turn_rad_per_m = options.drift_yaw_deg_per_m * kRadPerDeg;
  model.blind_below = options.model.blind_below;
  model.right_within_m = options.model.right_within_m;
  return model;
}

std::vector<PathPoint> planned(const ForecastOptions& options, const CmapContent& map) {
  const std::vector<Vec2> waypoints = read_way(options.path, map.reference_system);
  check_waypoints(waypoints, map.extent, options.map.string());
  warn_of_way(options.path, waypoints);
  double length_m = 0.0;
  for (std::size_t i = 1; i < waypoints.size(); ++i) length_m += (waypoints[i] - waypoints[i - 1]).norm();
  if (length_m / options.step_m > kMostFrames) {
    throw ToolError("{}: {:.0f} m takes more than {:.0f} frames; give a larger --step, or split the drive",
                    options.path.string(), length_m, kMostFrames);
  }
  return drive_over(waypoints, options.step_m, options.turn_step_deg);
}

/// The defaults were fitted on drives of some rigs.
void warn_of_fit(const ForecastOptions& options, bool by_landmarks) {
  const std::string_view mission = cfg::kMission.name;
  const bool fitted = by_landmarks ? mission == "mast" || mission == "drone" : mission == "paper";
  if (fitted || !options.changes.empty()) return;
  fmt::print(stderr,
             "cairn: warning: the forecast's parameters were fitted for mission {}, none for '{}': errors "
             "can be 2.5 times those given here; run a campaign and give its --model\n",
             by_landmarks ? "'mast' and 'drone'" : "'paper'", mission);
}

void run(const ForecastOptions& options) {
  if (options.mission != cfg::kMission.name) {
    throw ToolError(
        "--mission: '{}' is not the mission that cairn was built for, '{}'; build with "
        "MISSION={}",
        options.mission, cfg::kMission.name, options.mission);
  }
  const CmapContent map = decode_cmap(read_file(options.map), options.map.string());
  warn_of_scale(options.map, map);
  const ForecastModel model = model_of(options, map);
  const std::vector<PathPoint> drive = planned(options, map);
  warn_of_fit(options, model.window_m > 0.0);
  ProgressLine progress(fmt::format("map forecast {}", options.map.filename().string()));
  const Forecast made = forecast(model_for(model, map.boulders, map.extent, map.pixel_m), map.boulders, drive,
                                 [&](double share) { progress.show(share); });
  progress.clear();
  const ForecastSource source{options.map.string(), options.path.string(), map.reference_system};

  const auto put = [&](const fs::path& wanted, const char* name, const auto& text) {
    if (!wanted.empty()) write_file(wanted, text());
    if (!options.output.empty()) write_file(options.output / name, text());
  };
  const HoldInterrupts all_or_none;
  if (!options.output.empty()) make_folder(options.output);
  const std::string json = to_json(made, model, drive, source).dump(2) + "\n";
  put(options.csv, "forecast.csv", [&] { return to_csv(made); });
  const std::string geojson = to_geojson(made, model, drive, source);
  put(options.geojson, "forecast.geojson", [&] { return geojson; });
  for (const fs::path& file :
       {options.geopackage, options.output.empty() ? fs::path() : options.output / "forecast.gpkg"}) {
    if (!file.empty()) write_forecast_layers(file, geojson, map.reference_system);
  }
  put(options.plot, "forecast.svg", [&] { return plot_forecast(made, model, map.boulders, drive, source); });
  put({}, "forecast.json", [&] { return json; });
  fmt::print("{}", options.json ? json : to_text(made, model, drive));
}

void add_model_options(Command app, ForecastOptions& o) {
  const char* group = "Model (defaults depend on the map's detector, doc/guide/forecast.md)";
  app.add_taken(
         "--model",
         [&o](const std::string& file) {
           o.changes.emplace_back([file](ForecastModel& m) { read_model(file, m); });
         },
         "read the parameters below from the forecast_model.json of a campaign; further options override "
         "single values")
      .group(group);
  const auto number = [&](const char* name, const std::function<double&(ForecastModel&)>& of,
                          const char* what) {
    app.add_taken(
           name,
           [&o, of](const double& value) {
             o.changes.emplace_back([of, value](ForecastModel& m) { of(m) = value; });
           },
           what)
        .group(group);
  };
  using Model = ForecastModel;
  number(
      "--detect-most", [](Model& m) -> double& { return m.detection.most; },
      "share of the large boulders of the map that the rover finds");
  number(
      "--detect-half", [](Model& m) -> double& { return m.detection.half_m; },
      "diameter at which it finds half as many, m");
  number(
      "--detect-power", [](Model& m) -> double& { return m.detection.power; },
      "steepness of that rise with the diameter");
  number(
      "--detect-spread", [](Model& m) -> double& { return m.detection.spread; },
      "variation of that between drives: standard deviation of the log-odds");
  number(
      "--clutter", [](Model& m) -> double& { return m.clutter_per_m2; },
      "ground boulders that are not in the map, per m2 swept; those below the map's resolution are added");
  number(
      "--pair-sigma", [](Model& m) -> double& { return m.sigma_pair_m; }, "error of a pair, m per axis");
  number(
      "--common-sigma", [](Model& m) -> double& { return m.sigma_common_m; },
      "error common to all boulders of the map, m per axis");
}

void add_drive_options(Command app, ForecastOptions& o) {
  const char* group = "Drive";
  app.add_option("--step", o.step_m, "distance between frames, m")
      .within(0.001, 5.0)
      .default_shown()
      .group(group);
  app.add_option("--turn-step", o.turn_step_deg,
                 "rotation between frames when turning in place, degrees; smaller angles than 25 are steered")
      .within(0.05, 90.0)
      .default_shown()
      .group(group);
  app.add_option("--start-sigma", o.model.sigma_start_xy_m, "of the start, m per axis")
      .within(0.0001, 100.0)
      .default_shown()
      .group(group);
  app.add_option("--start-sigma-yaw", o.start_yaw_deg, "of the start's heading, degrees")
      .within(0.001, 180.0)
      .default_shown()
      .group(group);
  app.add_option("--drift-scale", o.model.fusion.sigma_scale, "of VO's scale, as a share")
      .within(0.0, 0.5)
      .default_shown()
      .group(group);
  app.add_option("--drift-yaw", o.drift_yaw_deg_per_m, "of VO's turn, degrees per m")
      .within(0.0, 5.0)
      .default_shown()
      .group(group);
}

}  // namespace

void add_map_forecast(Command map) {
  const auto options = std::make_shared<ForecastOptions>();
  ForecastOptions& o = *options;
  Command app = map.add_command(
      "forecast", "predict where fixes will succeed along a planned drive, and how accurate they will be");
  app.add_option("MAP", o.map, "map (.cmap)").required();
  app.add_option(
         "--path", o.path,
         "way of the drive: CSV with columns x, y, metres in the map; or a line or points of a GeoPackage, GeoJSON, "
         "shapefile")
      .required();
  app.add_option("-o,--output", o.output, "folder for forecast.csv, .geojson, .svg and .json");
  app.add_option("--csv", o.csv, "write the table here").written();
  app.add_option("--geojson", o.geojson, "write stations, ellipses and blind stretches here").written();
  app.add_option("--gpkg", o.geopackage, "and here as a GeoPackage, a layer for each kind").written();
  app.add_option("--plot", o.plot, "write the picture (SVG) here").written();
  app.add_flag("--json", o.json, "print JSON instead of the table");
  app.add_option("--blind-below", o.model.blind_below,
                 "least probability of being applied for a fix to be counted on")
      .within(0.0, 1.0)
      .default_shown();
  app.add_option("--right-within", o.model.right_within_m,
                 "a fix is right if the pose after it is within this distance of truth, m")
      .positive()
      .default_shown();
  app.add_option("--mission", o.mission, "fail if cairn was built for another mission");
  add_drive_options(app, o);
  add_model_options(app, o);
  app.on_run([options] { run(*options); });
}

}  // namespace cairn::ground
