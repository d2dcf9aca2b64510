/// A forecast as text, CSV, GeoJSON and JSON. doc/guide/forecast.md tells every column and key.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "forecast/forecast.hpp"

namespace cairn::ground {

/// Standard deviations that an ellipse is drawn at.
inline constexpr double kEllipseSigmas = 2.0;

/// What a forecast was made of, for its products.
struct ForecastSource {
  std::string map;
  std::string path;
  std::string reference_system;  ///< as the map has it: "EPSG:32633", a PROJ string, "local"
};

/// A table for the eye, a line a station, and what is blind.
std::string to_text(const Forecast& made, const ForecastModel& model, const std::vector<PathPoint>& drive);
/// A line a station under a line of names.
std::string to_csv(const Forecast& made);
/// A feature collection in the map's own coordinates, which its `crs` member names (absent for a local map):
/// the drive, the stations, the ellipses after a fix there (two standard deviations), the blind stretches.
/// RFC 7946 knows longitude and latitude on Earth alone; GDAL and QGIS read the member of the older GeoJSON.
std::string to_geojson(const Forecast& made, const ForecastModel& model, const std::vector<PathPoint>& drive,
                       const ForecastSource& source);
nlohmann::ordered_json to_json(const Forecast& made, const ForecastModel& model,
                               const std::vector<PathPoint>& drive, const ForecastSource& source);

}  // namespace cairn::ground
