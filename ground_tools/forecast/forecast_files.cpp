#include "forecast/forecast_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/trig.hpp"
#include "forecast/model_file.hpp"
#include "mission_cfg.hpp"

namespace cairn::ground {
namespace {

using nlohmann::ordered_json;

constexpr int kEllipsePoints = 36;

/// Rounded for reading; what GIS does with a tenth of a millimetre is its own affair.
double rounded(double value, double step) {
  const double r = std::round(value / step) * step;
  return std::round(r * 1.0e9) / 1.0e9;
}
double metres(double value) { return rounded(value, 1.0e-4); }
double share(double value) { return rounded(value, 1.0e-4); }
double degrees(double rad) { return rounded(rad * kDegPerRad, 1.0e-3); }

ordered_json place(double x_m, double y_m) { return {metres(x_m), metres(y_m)}; }

ordered_json json_of(const PoseSigma& s) {
  if (s.lost) return {{"along_m", nullptr}, {"across_m", nullptr}, {"yaw_deg", nullptr}};
  return {{"along_m", metres(s.along_m)}, {"across_m", metres(s.across_m)}, {"yaw_deg", degrees(s.yaw_rad)}};
}

ordered_json json_of(const FixStation& s) {
  return {{"arc_m", metres(s.at.arc_m)},
          {"x_m", metres(s.at.x_m)},
          {"y_m", metres(s.at.y_m)},
          {"heading_deg", degrees(s.at.yaw_rad)},
          {"frame", s.frame},
          {"boulders", s.boulders},
          {"expected_found", rounded(s.found, 0.01)},
          {"expected_clutter", rounded(s.clutter, 0.01)},
          {"map_per_m2", rounded(s.per_m2, 0.001)},
          {"true_needed", rounded(s.needed, 0.1)},
          {"lever_m", metres(s.lever_m)},
          {"p_applied", share(s.applied)},
          {"p_right", share(s.right)},
          {"before", json_of(s.before)},
          {"after", json_of(s.after)},
          {"ellipse",
           {{"major_m", metres(s.ellipse.major_m)},
            {"minor_m", metres(s.ellipse.minor_m)},
            {"azimuth_deg", degrees(s.ellipse.azimuth_rad)}}},
          {"blind", s.blind}};
}

ordered_json json_of(const BlindStretch& b) {
  return {{"from_m", metres(b.from_m)},
          {"to_m", metres(b.to_m)},
          {"length_m", metres(b.to_m - b.from_m)},
          {"at_end", json_of(b.at_end)}};
}

ordered_json feature(const char* kind, const char* type, ordered_json coordinates, ordered_json properties) {
  ordered_json all = {{"kind", kind}};
  all.update(properties);
  return {{"type", "Feature"},
          {"geometry", {{"type", type}, {"coordinates", std::move(coordinates)}}},
          {"properties", std::move(all)}};
}

ordered_json line(const std::vector<PathPoint>& drive, std::size_t first, std::size_t last) {
  ordered_json points = ordered_json::array();
  for (std::size_t i = first; i <= last; ++i) {
    ordered_json next = place(drive[i].x_m, drive[i].y_m);
    if (points.empty() || points.back() != next) points.push_back(std::move(next));
  }
  if (points.size() == 1) points.push_back(points.front());  // a line wants two
  return points;
}

ordered_json outline(const FixStation& s) {
  ordered_json ring = ordered_json::array();
  const SinCos a = sin_cos(s.ellipse.azimuth_rad);
  for (int i = 0; i <= kEllipsePoints; ++i) {
    const SinCos t = sin_cos(2.0 * kPi * (i % kEllipsePoints) / kEllipsePoints);
    const double u = kEllipseSigmas * s.ellipse.major_m * t.cos;
    const double v = kEllipseSigmas * s.ellipse.minor_m * t.sin;
    ring.push_back(place(s.at.x_m + a.cos * u - a.sin * v, s.at.y_m + a.sin * u + a.cos * v));
  }
  return ordered_json::array({ring});
}

/// The same in one level, as tables of attributes want it.
ordered_json flat(const FixStation& s) {
  const ordered_json flattened = json_of(s);
  ordered_json out;
  for (const auto& [key, value] : flattened.items()) {
    if (!value.is_object()) {
      out[key] = value;
      continue;
    }
    for (const auto& [inner, number] : value.items()) out[key + "_" + inner] = number;
  }
  return out;
}

/// What QGIS and GDAL take for a name.
std::string crs_name(const std::string& reference_system) {
  constexpr const char* kEpsg = "EPSG:";
  if (reference_system.rfind(kEpsg, 0) != 0) return reference_system;
  return "urn:ogc:def:crs:EPSG::" + reference_system.substr(5);
}

std::string error_words(const PoseSigma& s) {
  if (s.lost) return "lost";
  return fmt::format("{:.3f} m along, {:.3f} m across, {:.2f} deg", s.along_m, s.across_m,
                     s.yaw_rad * kDegPerRad);
}

std::string error_columns(const PoseSigma& s) {
  if (s.lost) return fmt::format("{:>7} {:>7} {:>7}", "lost", "-", "-");
  return fmt::format("{:>7.3f} {:>7.3f} {:>7.3f}", s.along_m, s.across_m, s.yaw_rad * kDegPerRad);
}

double blind_m(const Forecast& made) {
  double sum = 0.0;
  for (const BlindStretch& b : made.blind) sum += b.to_m - b.from_m;
  return sum;
}

}  // namespace

std::string to_text(const Forecast& made, const ForecastModel& model, const std::vector<PathPoint>& drive) {
  std::string text =
      fmt::format("{:>7} {:>9} {:>9} {:>5} {:>6} {:>6} {:>7} {:>6}  {:>7} {:>7} {:>7}  {:>7} {:>7} {:>7}\n",
                  "arc", "x", "y", "bould", "found", "need", "applied", "right", "before:", "across", "yaw",
                  "after:", "across", "yaw");
  text +=
      fmt::format("{:>7} {:>9} {:>9} {:>5} {:>6} {:>6} {:>7} {:>6}  {:>7} {:>7} {:>7}  {:>7} {:>7} {:>7}\n",
                  "m", "m", "m", "", "", "", "", "", "along m", "m", "deg", "along m", "m", "deg");
  for (const FixStation& s : made.stations) {
    text += fmt::format("{:>7.2f} {:>9.2f} {:>9.2f} {:>5} {:>6.1f} {:>6.1f} {:>7.3f} {:>6.3f}  {}  {}{}\n",
                        s.at.arc_m, s.at.x_m, s.at.y_m, s.boulders, s.found, s.needed, s.applied, s.right,
                        error_columns(s.before), error_columns(s.after), s.blind ? "  blind" : "");
  }
  double applied = 0.0;
  double right = 0.0;
  for (const FixStation& s : made.stations) {
    applied += s.applied;
    right += s.right;
  }
  const double all_m = drive.back().arc_m;
  text += fmt::format("{} fixes on {:.2f} m: {:.1f} expected to be applied, {:.1f} right (within {} m)\n",
                      made.stations.size(), all_m, applied, right, model.right_within_m);
  for (const BlindStretch& b : made.blind) {
    text += fmt::format("blind from {:.2f} m to {:.2f} m ({:.2f} m): error by then {}\n", b.from_m, b.to_m,
                        b.to_m - b.from_m, error_words(b.at_end));
  }
  text += fmt::format("at the end: {} (standard deviations)\n", error_words(made.at_end));
  return text;
}

std::string to_csv(const Forecast& made) {
  std::string text;
  const ordered_json names = flat(FixStation{});
  for (const auto& [key, value] : names.items()) text += (text.empty() ? "" : ",") + key;
  text += '\n';
  for (const FixStation& s : made.stations) {
    std::string row;
    const ordered_json values = flat(s);
    for (const auto& [key, value] : values.items()) {
      if (!row.empty()) row += ',';
      row += value.is_null() ? "" : value.is_boolean() ? (value.get<bool>() ? "1" : "0") : value.dump();
    }
    text += row + '\n';
  }
  return text;
}

std::string to_geojson(const Forecast& made, const ForecastModel& model, const std::vector<PathPoint>& drive,
                       const ForecastSource& source) {
  ordered_json json = {{"type", "FeatureCollection"}, {"name", "forecast"}};
  if (source.reference_system != "local" && !source.reference_system.empty())
    json["crs"] = {{"type", "name"}, {"properties", {{"name", crs_name(source.reference_system)}}}};
  ordered_json& features = json["features"] = ordered_json::array();
  features.push_back(feature("drive", "LineString", line(drive, 0, drive.size() - 1),
                             {{"length_m", metres(drive.back().arc_m)}, {"map", source.map}}));
  for (const BlindStretch& b : made.blind) {
    ordered_json properties = json_of(b);
    for (const char* name : {"along_m", "across_m"}) properties[name] = properties["at_end"][name];
    properties.erase("at_end");
    properties["blind_below"] = model.blind_below;
    features.push_back(feature("blind", "LineString", line(drive, b.first_frame, b.last_frame), properties));
  }
  for (const FixStation& s : made.stations) {
    if (s.applied > 0.0)
      features.push_back(feature(
          "ellipse", "Polygon", outline(s),
          {{"arc_m", metres(s.at.arc_m)}, {"sigmas", kEllipseSigmas}, {"p_applied", share(s.applied)}}));
    features.push_back(feature("station", "Point", place(s.at.x_m, s.at.y_m), flat(s)));
  }
  // A line a feature: readable, and short differences between two forecasts.
  std::string text = "{\n";
  for (const auto& [key, value] : json.items()) {
    if (key != "features") text += ordered_json(key).dump() + ": " + value.dump() + ",\n";
  }
  text += "\"features\": [\n";
  for (std::size_t i = 0; i < features.size(); ++i)
    text += features[i].dump() + (i + 1 < features.size() ? ",\n" : "\n");
  return text + "]}\n";
}

ordered_json to_json(const Forecast& made, const ForecastModel& model, const std::vector<PathPoint>& drive,
                     const ForecastSource& source) {
  double applied = 0.0;
  double right = 0.0;
  ordered_json stations = ordered_json::array();
  for (const FixStation& s : made.stations) {
    applied += s.applied;
    right += s.right;
    stations.push_back(json_of(s));
  }
  ordered_json blind = ordered_json::array();
  for (const BlindStretch& b : made.blind) blind.push_back(json_of(b));
  return {{"mission", cfg::kMission.name},
          {"map", source.map},
          {"path", source.path},
          {"reference_system", source.reference_system},
          {"length_m", metres(drive.back().arc_m)},
          {"fixes", made.stations.size()},
          {"expected_applied", rounded(applied, 0.01)},
          {"expected_right", rounded(right, 0.01)},
          {"right_within_m", model.right_within_m},
          {"blind_below", model.blind_below},
          {"blind_m", metres(blind_m(made))},
          {"blind", blind},
          {"at_end", json_of(made.at_end)},
          {"model", model_json(model)},
          {"stations", stations}};
}

}  // namespace cairn::ground
