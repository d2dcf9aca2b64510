#include "ortho/sun_label.hpp"

#include <cpl_minixml.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/quiet_gdal.hpp"
#include "core/trig.hpp"

namespace cairn::ground {
namespace {

using Json = nlohmann::json;

/// Names in capitals without underlines and blanks -> number. The first of a name stays.
using Label = std::map<std::string, double>;

std::string plain(std::string_view name) {
  if (const std::size_t colon = name.rfind(':'); colon != std::string_view::npos)
    name.remove_prefix(colon + 1);
  std::string text;
  for (const char c : name) {
    if (c >= 'a' && c <= 'z') text += static_cast<char>(c - 'a' + 'A');
    if ((c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9')) text += c;
  }
  return text;
}

/// A number, and behind it nothing or a unit: "32.5", "32.5 <deg>", "\"32.5\"".
std::optional<double> number(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '"' || text.front() == '+'))
    text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
  const std::string_view rest(end, static_cast<std::size_t>(text.data() + text.size() - end));
  if (!rest.empty() && std::string_view(" \t\r\"<").find(rest.front()) == std::string_view::npos)
    return std::nullopt;
  return rest.find("rad") != std::string_view::npos || rest.find("RAD") != std::string_view::npos
             ? value * kDegPerRad
             : value;
}

void note(Label& label, std::string_view name, std::string_view value) {
  if (const std::optional<double> found = number(value)) label.emplace(plain(name), *found);
}

// Labels nest a few deep; what is deeper is none.
constexpr int kDepth = 16;

void note_json(Label& label, const Json& at, int depth = 0) {
  if (!at.is_object() || depth > kDepth) return;
  for (const auto& [name, value] : at.items()) {
    if (value.is_number()) {
      label.emplace(plain(name), value.get<double>());
    } else if (value.is_string()) {
      note(label, name, value.get<std::string>());
    } else if (value.is_object() && value.contains("value") && value["value"].is_number()) {
      note(label, name,
           fmt::format("{} {}", value["value"].get<double>(), value.value("unit", std::string())));
    } else {
      note_json(label, value, depth + 1);
    }
  }
}

void note_xml(Label& label, const CPLXMLNode* node, int depth = 0) {
  if (depth > kDepth) return;
  for (; node != nullptr; node = node->psNext) {
    if (node->eType != CXT_Element) continue;
    const char* unit = CPLGetXMLValue(node, "unit", "");
    note(label, node->pszValue, fmt::format("{} {}", CPLGetXMLValue(node, "", ""), unit));
    note_xml(label, node->psChild, depth + 1);
  }
}

/// NAME = VALUE, line by line, up to END: PDS3 as text.
void note_text(Label& label, const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string line;
  for (int lines = 0; lines < 10000 && std::getline(file, line); ++lines) {
    const std::size_t equals = line.find('=');
    if (equals != std::string::npos) note(label, line.substr(0, equals), line.substr(equals + 1));
    if (plain(line) == "END") return;
  }
}

/// The items of a metadata domain that holds one text, JSON or XML.
const char* whole_domain(GDALDataset& image, const char* domain) {
  char** const items = image.GetMetadata(domain);
  return items == nullptr ? nullptr : items[0];
}

Json json_label(GDALDataset& image, const char* domain) {
  const char* const text = whole_domain(image, domain);
  return text == nullptr ? Json() : Json::parse(text, nullptr, false);
}

Label label_of(GDALDataset& image) {
  Label label;
  for (char** item = image.GetMetadata(); item != nullptr && *item != nullptr; ++item) {
    const std::string_view text(*item);
    const std::size_t equals = text.find('=');
    if (equals != std::string_view::npos) note(label, text.substr(0, equals), text.substr(equals + 1));
  }
  for (const char* domain : {"json:ISIS3", "json:PDS", "json:VICAR"})
    note_json(label, json_label(image, domain));
  if (const char* const text = whole_domain(image, "xml:PDS4")) {
    CPLXMLNode* const tree = CPLParseXMLString(text);
    note_xml(label, tree);
    CPLDestroyXMLNode(tree);
  }
  const std::filesystem::path file(image.GetDescription());
  for (const char* ending : {".LBL", ".lbl"}) {
    std::error_code none;
    const std::filesystem::path beside = std::filesystem::path(file).replace_extension(ending);
    if (std::filesystem::is_regular_file(beside, none)) note_text(label, beside);
  }
  return label;
}

std::optional<double> first_of(const Label& label, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    const auto found = label.find(name);
    if (found != label.end()) return found->second;
  }
  return std::nullopt;
}

/// Middle of the image on the body, and how the map's y axis departs from north there.
struct Middle {
  double longitude_rad = 0.0;
  double latitude_rad = 0.0;
  double north_rad = 0.0;  ///< direction of north in the map, clockwise from the y axis
};

std::optional<Middle> middle_of(GDALDataset& image) {
  double geo[6] = {};
  const OGRSpatialReference* const known = image.GetSpatialRef();
  if (known == nullptr || known->IsProjected() == 0 || image.GetGeoTransform(geo) != CE_None)
    return std::nullopt;
  const std::unique_ptr<OGRSpatialReference> map(known->Clone());
  const std::unique_ptr<OGRSpatialReference> body(map->CloneGeogCS());
  if (body == nullptr) return std::nullopt;
  map->SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  body->SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> to_body(
      OGRCreateCoordinateTransformation(map.get(), body.get()));
  const std::unique_ptr<OGRCoordinateTransformation> to_map(
      OGRCreateCoordinateTransformation(body.get(), map.get()));
  if (to_body == nullptr || to_map == nullptr) return std::nullopt;
  const double column = 0.5 * image.GetRasterXSize();
  const double row = 0.5 * image.GetRasterYSize();
  const double x = geo[0] + column * geo[1] + row * geo[2];
  const double y = geo[3] + column * geo[4] + row * geo[5];
  double longitude_deg = x;
  double latitude_deg = y;
  if (to_body->Transform(1, &longitude_deg, &latitude_deg) == 0) return std::nullopt;
  constexpr double kStepDeg = 1e-5;                                   // about half a metre on Mars
  const double step_deg = latitude_deg < 0.0 ? kStepDeg : -kStepDeg;  // never over a pole
  double x_there = longitude_deg;
  double y_there = latitude_deg + step_deg;
  double x_here = longitude_deg;
  double y_here = latitude_deg;
  if (to_map->Transform(1, &x_there, &y_there) == 0 || to_map->Transform(1, &x_here, &y_here) == 0)
    return std::nullopt;
  const double sign = step_deg > 0.0 ? 1.0 : -1.0;
  return Middle{longitude_deg * kRadPerDeg, latitude_deg * kRadPerDeg,
                atan2(sign * (x_there - x_here), sign * (y_there - y_here))};
}

/// The first doubles of a table's first record.
bool read_table(const Json& label, const char* table, const char* first_field, std::size_t count,
                double* values) {
  const Json& at = label.value(table, Json());
  if (!at.is_object() || !at.contains(first_field) || !at.value("StartByte", Json()).is_number_integer() ||
      at.value("ByteOrder", std::string("Lsb")) != "Lsb" || !label.value("_filename", Json()).is_string()) {
    return false;
  }
  std::ifstream file(label["_filename"].get<std::string>(), std::ios::binary);
  file.seekg(at["StartByte"].get<std::int64_t>() - 1);
  file.read(reinterpret_cast<char*>(values), static_cast<std::streamsize>(count * sizeof(double)));
  return file.gcount() == static_cast<std::streamsize>(count * sizeof(double));
}

/// Rotation matrix of a unit quaternion, scalar first.
Mat3 rotation(const double q[4]) {
  const double w = q[0];
  const double x = q[1];
  const double y = q[2];
  const double z = q[3];
  Mat3 m;
  m << 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),  //
      2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),   //
      2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y);
  return m;
}

/// From what spiceinit left in an ISIS cube: sun's elevation and azimuth (from north) in degrees.
std::optional<Vec2> from_spice(GDALDataset& image, const Middle& middle) {
  const Json label = json_label(image, "json:ISIS3");
  if (!label.is_object()) return std::nullopt;
  double sun_km[3] = {};
  double q[4] = {};
  if (!read_table(label, "Table_SunPosition", "Field_J2000X", 3, sun_km) ||
      !read_table(label, "Table_BodyRotation", "Field_J2000Q0", 4, q)) {
    return std::nullopt;
  }
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(std::fabs(length - 1.0) < 1e-6)) return std::nullopt;
  Vec3 sun = rotation(q) * Vec3(sun_km[0], sun_km[1], sun_km[2]);
  const Json& constant = label["Table_BodyRotation"].value("ConstantRotation", Json());
  if (constant.is_array() && constant.size() == 9) {
    Mat3 m;
    for (int i = 0; i < 9; ++i) m(i / 3, i % 3) = constant[static_cast<std::size_t>(i)].get<double>();
    sun = (m * sun).eval();
  }
  if (!(sun.norm() > 0.0)) return std::nullopt;
  sun /= sun.norm();
  const SinCos lon = sin_cos(middle.longitude_rad);
  const SinCos lat = sin_cos(middle.latitude_rad);
  const Vec3 east(-lon.sin, lon.cos, 0.0);
  const Vec3 north(-lat.sin * lon.cos, -lat.sin * lon.sin, lat.cos);
  const Vec3 up(lat.cos * lon.cos, lat.cos * lon.sin, lat.sin);
  return Vec2(asin(std::clamp(sun.dot(up), -1.0, 1.0)), atan2(sun.dot(east), sun.dot(north))) * kDegPerRad;
}

}  // namespace

std::optional<Sun> find_sun(GDALDataset& image) {
  const QuietGdal quiet;
  const Label label = label_of(image);
  std::optional<double> elevation_deg =
      first_of(label, {"SUNELEVATION", "SOLARELEVATION", "SUNELEVATIONANGLE", "SOLARELEVATIONANGLE"});
  if (!elevation_deg) {
    const std::optional<double> incidence_deg =
        first_of(label, {"INCIDENCEANGLE", "SOLARINCIDENCEANGLE", "INCIDENCE"});
    if (incidence_deg) elevation_deg = 90.0 - *incidence_deg;
  }
  const std::optional<Middle> middle = middle_of(image);
  const double map_north_deg = middle ? middle->north_rad * kDegPerRad : 0.0;
  std::optional<double> azimuth_deg = first_of(
      label, {"SUNAZIMUTH", "SOLARAZIMUTH", "SUNAZIMUTHANGLE", "SOLARAZIMUTHANGLE", "SUBSOLARGROUNDAZIMUTH"});
  if (azimuth_deg) {
    *azimuth_deg += map_north_deg;
  } else if (const std::optional<double> from_right_deg = first_of(label, {"SUBSOLARAZIMUTH"})) {
    const std::optional<double> north_deg = first_of(label, {"NORTHAZIMUTH"});
    azimuth_deg = north_deg ? *from_right_deg - *north_deg + map_north_deg : *from_right_deg - 270.0;
  }
  if ((!elevation_deg || !azimuth_deg) && middle) {
    if (const std::optional<Vec2> spice_deg = from_spice(image, *middle)) {
      elevation_deg = spice_deg->x();
      azimuth_deg = spice_deg->y() + map_north_deg;
    }
  }
  if (!elevation_deg || !azimuth_deg || !(*elevation_deg >= 1.0 && *elevation_deg <= 90.0) ||
      !(std::fabs(*azimuth_deg) <= 1080.0)) {
    return std::nullopt;
  }
  double turn_deg = *azimuth_deg - 360.0 * std::floor(*azimuth_deg / 360.0);
  if (turn_deg >= 360.0) turn_deg = 0.0;
  return Sun{*elevation_deg * kRadPerDeg, turn_deg * kRadPerDeg};
}

}  // namespace cairn::ground
