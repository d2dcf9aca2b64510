#include "ortho/sun_label.hpp"

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "base/quiet_gdal.hpp"
#include "core/trig.hpp"
#include "ortho/label.hpp"
#include "ortho/site_frame.hpp"

namespace cairn::ground {
namespace {

using Json = nlohmann::json;

/// The label of an ISIS cube, whole.
Json isis_label(GDALDataset& image) {
  char** const items = image.GetMetadata("json:ISIS3");
  return items == nullptr || items[0] == nullptr ? Json() : Json::parse(items[0], nullptr, false);
}

/// Of the middle of the image; nothing where no body is known.
std::optional<SiteFrame> frame_of(GDALDataset& image, const double* geo) {
  const double column = 0.5 * image.GetRasterXSize();
  const double row = 0.5 * image.GetRasterYSize();
  return site_frame(image.GetSpatialRef(),
                    {geo[0] + column * geo[1] + row * geo[2], geo[3] + column * geo[4] + row * geo[5]});
}

/// A direction of the image, clockwise from its right, as an azimuth of the map.
double azimuth_of_image(double from_right_deg, const double* geo) {
  const SinCos angle = sin_cos(from_right_deg * kRadPerDeg);
  return std::atan2(geo[1] * angle.cos + geo[2] * angle.sin, geo[4] * angle.cos + geo[5] * angle.sin) *
         kDegPerRad;
}

/// The sub-solar azimuth is counted in the image's own frame, and so is the north azimuth. Where the latter
/// is not where the image has north, the label is of another image of the ground (before it was projected,
/// say), and what both have in common is the angle between them.
double azimuth_from_right(double sun_deg, std::optional<double> north_deg, const double* geo,
                          double map_north_deg) {
  constexpr double kSameNorthDeg = 5.0;
  if (north_deg) {
    const double off_deg =
        wrap_angle((azimuth_of_image(*north_deg, geo) - map_north_deg) * kRadPerDeg) * kDegPerRad;
    if (std::fabs(off_deg) > kSameNorthDeg) return sun_deg - *north_deg + map_north_deg;
  }
  return azimuth_of_image(sun_deg, geo);
}

/// The first doubles of a table's first record.
bool read_table(const Json& label, const char* table, const char* first_field, std::size_t count,
                double* values) {
  const Json at = label.value(table, Json());
  if (!at.is_object() || !at.contains(first_field) || !at.value("StartByte", Json()).is_number_integer() ||
      at.value("ByteOrder", Json("Lsb")) != "Lsb" || !label.value("_filename", Json()).is_string()) {
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

}  // namespace

std::optional<Vec2> sun_of_spice(const Json& label, const SiteFrame& middle) {
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
  const Json constant = label["Table_BodyRotation"].value("ConstantRotation", Json());
  if (constant.is_array() && constant.size() == 9) {
    Mat3 m;
    for (int i = 0; i < 9; ++i) {
      const Json& entry = constant[static_cast<std::size_t>(i)];
      if (!entry.is_number()) return std::nullopt;
      m(i / 3, i % 3) = entry.get<double>();
    }
    sun = (m * sun).eval();
  }
  if (!(sun.norm() > 0.0 && std::isfinite(sun.norm()))) return std::nullopt;
  sun /= sun.norm();
  const SinCos lon = sin_cos(middle.longitude_deg * kRadPerDeg);
  const SinCos lat = sin_cos(middle.latitude_deg * kRadPerDeg);
  const Vec3 east(-lon.sin, lon.cos, 0.0);
  const Vec3 north(-lat.sin * lon.cos, -lat.sin * lon.sin, lat.cos);
  const Vec3 up(lat.cos * lon.cos, lat.cos * lon.sin, lat.sin);
  return Vec2(asin(std::clamp(sun.dot(up), -1.0, 1.0)), atan2(sun.dot(east), sun.dot(north))) * kDegPerRad;
}

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
  double geo[6] = {};
  const bool placed = image.GetGeoTransform(geo) == CE_None;
  if (!placed) std::copy_n(GeoTransform().c, 6, geo);  // what is up is north
  const std::optional<SiteFrame> frame = placed ? frame_of(image, geo) : std::nullopt;
  const auto in_map_deg = [&](double from_north_deg) {
    return frame && std::isfinite(from_north_deg)
               ? frame->azimuth_in_map(from_north_deg * kRadPerDeg) * kDegPerRad
               : from_north_deg;
  };
  std::optional<double> azimuth_deg = first_of(
      label, {"SUNAZIMUTH", "SOLARAZIMUTH", "SUNAZIMUTHANGLE", "SOLARAZIMUTHANGLE", "SUBSOLARGROUNDAZIMUTH"});
  if (azimuth_deg && std::fabs(*azimuth_deg) > 1080.0) return std::nullopt;
  if (azimuth_deg) {
    azimuth_deg = in_map_deg(*azimuth_deg);
  } else if (const std::optional<double> from_right_deg = first_of(label, {"SUBSOLARAZIMUTH"})) {
    if (std::fabs(*from_right_deg) > 1080.0) return std::nullopt;
    azimuth_deg =
        azimuth_from_right(*from_right_deg, first_of(label, {"NORTHAZIMUTH"}), geo, in_map_deg(0.0));
  }
  if ((!elevation_deg || !azimuth_deg) && frame) {
    if (const std::optional<Vec2> spice_deg = sun_of_spice(isis_label(image), *frame)) {
      elevation_deg = spice_deg->x();
      azimuth_deg = in_map_deg(spice_deg->y());
    }
  }
  if (!elevation_deg || !azimuth_deg || !(*elevation_deg >= 1.0 && *elevation_deg <= 90.0) ||
      !std::isfinite(*azimuth_deg)) {
    return std::nullopt;
  }
  double turn_deg = *azimuth_deg - 360.0 * std::floor(*azimuth_deg / 360.0);
  if (turn_deg >= 360.0) turn_deg = 0.0;
  return Sun{*elevation_deg * kRadPerDeg, turn_deg * kRadPerDeg};
}

}  // namespace cairn::ground
