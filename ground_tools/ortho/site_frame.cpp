#include "ortho/site_frame.hpp"

#include <fmt/format.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "base/quiet_gdal.hpp"
#include "core/trig.hpp"
#include "ortho/reference_system.hpp"

namespace cairn::ground {
namespace {

constexpr double kStepRad = 1e-6;    // some metres on any body
constexpr double kNoTurnRad = 1e-6;  // differences are no better

double turn(double azimuth_rad) {
  const double turned = azimuth_rad - 2.0 * kPi * std::floor(azimuth_rad / (2.0 * kPi));
  return turned >= 2.0 * kPi ? 0.0 : turned;
}

double azimuth_through(const Mat2& m, double azimuth_rad) {
  const SinCos from = sin_cos(azimuth_rad);
  const Vec2 to = m * Vec2(from.sin, from.cos);
  const double azimuth = turn(std::atan2(to.x(), to.y()));
  return std::fabs(wrap_angle(azimuth - azimuth_rad)) < kNoTurnRad ? turn(azimuth_rad) : azimuth;
}

/// Where both axes have the ground's metres, turning and hand alone.
Mat2 directions(const SiteFrame& frame) {
  Mat2 m = frame.map_from_ground;
  if (scale_error(frame) <= kScaleTolerance) m.colwise().normalize();
  return m;
}

}  // namespace

double SiteFrame::azimuth_in_map(double from_north_rad) const {
  return azimuth_through(directions(*this), from_north_rad);
}

double SiteFrame::azimuth_from_north(double in_map_rad) const {
  return azimuth_through(directions(*this).inverse(), in_map_rad);
}

Vec2 SiteFrame::ground_per_map() const {
  const Mat2 ground_from_map = map_from_ground.inverse();
  return {ground_from_map.col(0).norm(), ground_from_map.col(1).norm()};
}

std::optional<SiteFrame> site_frame(const OGRSpatialReference* system, const Vec2& p_map_m) {
  if (system == nullptr || system->IsProjected() == 0) return std::nullopt;
  const QuietGdal quiet;
  const std::unique_ptr<OGRSpatialReference> map(system->Clone());
  map->StripVertical();
  const std::unique_ptr<OGRSpatialReference> body(map->CloneGeogCS());
  if (body == nullptr) return std::nullopt;
  map->SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  body->SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> to_body(
      OGRCreateCoordinateTransformation(map.get(), body.get()));
  const std::unique_ptr<OGRCoordinateTransformation> to_map(
      OGRCreateCoordinateTransformation(body.get(), map.get()));
  if (to_body == nullptr || to_map == nullptr) return std::nullopt;
  SiteFrame frame;
  frame.longitude_deg = p_map_m.x();
  frame.latitude_deg = p_map_m.y();
  if (to_body->Transform(1, &frame.longitude_deg, &frame.latitude_deg) == 0) return std::nullopt;
  // Never over a pole, where north turns into south.
  constexpr double kStepDeg = kStepRad * kDegPerRad;
  const double latitude_deg = std::clamp(frame.latitude_deg, -90.0 + 4.0 * kStepDeg, 90.0 - 4.0 * kStepDeg);
  const SinCos lat = sin_cos(latitude_deg * kRadPerDeg);
  const double a = body->GetSemiMajor();
  const double flattening = body->GetInvFlattening() > 0.0 ? 1.0 / body->GetInvFlattening() : 0.0;
  const double e2 = flattening * (2.0 - flattening);
  const double w2 = 1.0 - e2 * lat.sin * lat.sin;
  const double across_m = a / std::sqrt(w2) * lat.cos;           // of a radian of longitude
  const double along_m = a * (1.0 - e2) / (w2 * std::sqrt(w2));  // and of latitude
  double x[4] = {frame.longitude_deg + kStepDeg, frame.longitude_deg - kStepDeg, frame.longitude_deg,
                 frame.longitude_deg};
  double y[4] = {latitude_deg, latitude_deg, latitude_deg + kStepDeg, latitude_deg - kStepDeg};
  if (to_map->Transform(4, x, y) == 0) return std::nullopt;
  frame.map_from_ground.col(0) = Vec2(x[0] - x[1], y[0] - y[1]) / (2.0 * kStepRad * across_m);
  frame.map_from_ground.col(1) = Vec2(x[2] - x[3], y[2] - y[3]) / (2.0 * kStepRad * along_m);
  const double area = frame.map_from_ground.determinant();
  if (!(std::fabs(area) > 1e-6) || !(std::fabs(area) < 1e6)) return std::nullopt;
  return frame;
}

std::optional<SiteFrame> site_frame(const std::string& reference, const Vec2& p_map_m) {
  if (is_local_reference(reference)) return std::nullopt;
  const OGRSpatialReference system = reference_of(reference, "the map");
  return site_frame(&system, p_map_m);
}

Vec2 scale_limits(const SiteFrame& frame) {
  // Singular values of 2 x 2, by what the matrix holds of a similarity and of a mirrored one.
  const Mat2 m = frame.map_from_ground.inverse();
  const double kept = std::hypot(m(0, 0) + m(1, 1), m(1, 0) - m(0, 1));
  const double mirrored = std::hypot(m(0, 0) - m(1, 1), m(1, 0) + m(0, 1));
  return {0.5 * (kept + mirrored), 0.5 * std::fabs(kept - mirrored)};
}

double scale_error(const SiteFrame& frame) {
  const Vec2 scale = scale_limits(frame);
  return std::max(std::fabs(scale.x() - 1.0), std::fabs(scale.y() - 1.0));
}

std::string local_reference(const OGRSpatialReference& system, const SiteFrame& frame) {
  const auto tenth = [](double degrees) { return std::round(degrees * 10.0) / 10.0; };
  OGRSpatialReference local;
  local.SetProjCS("site");
  local.CopyGeogCSFrom(&system);
  local.SetTM(tenth(frame.latitude_deg), tenth(frame.longitude_deg), 1.0, 0.0, 0.0);
  local.SetLinearUnits(SRS_UL_METER, 1.0);
  return reference_text(&local);
}

std::string local_reference(const std::string& reference, const SiteFrame& frame) {
  return local_reference(reference_of(reference, "the map"), frame);
}

std::string scale_words(const std::string& system, const Vec2& p_m) {
  const std::optional<SiteFrame> frame = site_frame(system, p_m);
  if (!frame || scale_error(*frame) <= kScaleTolerance) return {};
  const Vec2 scale = frame->ground_per_map();
  const Vec2 limits = scale_limits(*frame);
  const bool sheared = limits.x() - scale.maxCoeff() > 0.1 * kScaleTolerance;
  return fmt::format(
      "1 m of {} is {:.4f} m of ground along x and {:.4f} m along y{} at latitude {:.2f}", system, scale.x(),
      scale.y(), sheared ? fmt::format(", and {:.4f} to {:.4f} m between them", limits.y(), limits.x()) : "",
      frame->latitude_deg);
}

}  // namespace cairn::ground
