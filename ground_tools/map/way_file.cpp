#include "map/way_file.hpp"

#include <gdal_priv.h>
#include <ogrsf_frmts.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <string_view>

#include "base/number_table.hpp"
#include "base/quiet_gdal.hpp"
#include "base/tool_error.hpp"
#include "base/waypoints.hpp"
#include "ortho/reference_system.hpp"
#include "ortho/true_scale.hpp"

namespace cairn::ground {
namespace {

constexpr std::string_view kTables[] = {".csv", ".txt", ".tsv", ".dat", ""};
constexpr const char* kLayers[] = {"way", "drive"};
constexpr std::string_view kForms = "give a CSV table with columns x, y, a GeoPackage, GeoJSON or shapefile";
/// Of the axes of two bodies; those of one differ by flattening and local radii, Mars's by 0.6 %.
constexpr double kSameBody = 0.02;

/// A way that spans less is one in degrees; as metres nobody would drive it.
constexpr double kWayInDegrees = 0.1;

bool is_plain_table(const std::filesystem::path& path) {
  const std::string ending = path.extension().string();
  if (std::none_of(std::begin(kTables), std::end(kTables),
                   [&](std::string_view table) { return same_name(ending, table); }))
    return false;
  const CsvTable table(path);
  return table.find({"x_m", "x"}) || !table.find({"wkt", "wkt_geom", "geometry", "geom"});
}

OGRLayer& layer_of(GDALDataset& data, const std::string& name) {
  for (const char* const wanted : kLayers) {
    if (OGRLayer* const layer = data.GetLayerByName(wanted)) return *layer;
  }
  OGRLayer* only = nullptr;
  std::string names;
  for (OGRLayer* const layer : data.GetLayers()) {
    if (layer->GetFeatureCount() == 0) continue;
    names += fmt::format("{}'{}'", names.empty() ? "" : ", ", layer->GetName());
    only = layer;
  }
  if (only == nullptr) throw ToolError("{}: contains no features; draw a line, or points", name);
  if (names.find(',') != std::string::npos)
    throw ToolError("{}: has the layers {}; save the one with the way alone, or name it 'way'", name, names);
  return *only;
}

/// A point where the last one stands is the double click that ended a line.
void add_line(const OGRLineString& line, std::vector<Vec2>& points) {
  for (int i = 0; i < line.getNumPoints(); ++i) {
    const Vec2 p(line.getX(i), line.getY(i));
    if (points.empty() || points.back() != p) points.push_back(p);
  }
}

/// The points of one feature, appended; how many lines they were.
int add_shape(const OGRFeature& feature, const std::string& name, std::vector<Vec2>& points) {
  const OGRGeometry* const shape = feature.GetGeometryRef();
  switch (shape == nullptr ? wkbUnknown : wkbFlatten(shape->getGeometryType())) {
    case wkbPoint: points.emplace_back(shape->toPoint()->getX(), shape->toPoint()->getY()); return 0;
    case wkbLineString: add_line(*shape->toLineString(), points); return 1;
    case wkbMultiLineString: {
      const OGRMultiLineString& lines = *shape->toMultiLineString();
      for (const auto* const line : lines) add_line(*line, points);
      return lines.getNumGeometries();
    }
    default: break;
  }
  throw ToolError("{}: feature {} is neither a point nor a line; save the way as one line", name,
                  feature.GetFID());
}

std::vector<Vec2> points_of(OGRLayer& layer, const std::string& name) {
  const int kind = layer.GetLayerDefn()->GetFieldIndex("kind");
  const auto is_drive = [kind](const OGRFeature& f) {
    return kind >= 0 && std::string_view(f.GetFieldAsString(kind)) == "drive";
  };
  bool drives = false;
  for (const auto& feature : layer) drives = drives || is_drive(*feature);
  std::vector<Vec2> points;
  int lines = 0;
  int singles = 0;
  for (const auto& feature : layer) {
    if (drives && !is_drive(*feature)) continue;
    const int more = add_shape(*feature, name, points);
    lines += more;
    singles += more == 0 ? 1 : 0;
  }
  if (lines > 1) throw ToolError("{}: has {} lines; join them, or keep the one to drive", name, lines);
  if (lines == 1 && singles > 0)
    throw ToolError("{}: has a line and {} points; keep one of both", name, singles);
  return points;
}

/// The longer side of the box around the way.
double span_of(const std::vector<Vec2>& points) {
  Vec2 low = points.front();
  Vec2 high = points.front();
  for (const Vec2& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return (high - low).maxCoeff();
}

void take_to(const std::string& reference_system, const OGRSpatialReference* own, const std::string& name,
             std::vector<Vec2>& points) {
  const std::string system = reference_text(own);
  const bool angles = own != nullptr && own->IsGeographic() != 0;
  const bool degrees = angles && in_degrees(points);
  if (is_local_reference(reference_system) && degrees && span_of(points) < kWayInDegrees)
    throw ToolError(
        "{}: its coordinates are degrees, and the map's system is a local one; save it in metres "
        "of the map",
        name);
  // GeoPackage and GeoJSON say degrees where nobody named a system.
  if (is_local_reference(reference_system) || is_local_reference(system) || (angles && !degrees) ||
      same_reference(system, reference_system))
    return;
  const OGRSpatialReference to = reference_of(reference_system, "the map");
  if (std::fabs(own->GetSemiMajor() / to.GetSemiMajor() - 1.0) > kSameBody)
    throw ToolError(
        "{}: lies on a body of {:.0f} km radius, the map on one of {:.0f} km; save it in the "
        "map's own system, {}",
        name, 1e-3 * own->GetSemiMajor(), 1e-3 * to.GetSemiMajor(), reference_system);
  const Places places(system, reference_system);
  for (Vec2& p : points) {
    const Vec2 there = places(p);
    if (!there.allFinite())
      throw ToolError("{}: ({}, {}) of {} has no place in the map's system, {}; save the way in that one",
                      name, p.x(), p.y(), system, reference_system);
    p = there;
  }
}

}  // namespace

std::vector<Vec2> read_way(const std::filesystem::path& path, const std::string& reference_system) {
  if (is_plain_table(path)) return read_waypoints(path);
  const std::string name = path.string();
  const QuietGdal quiet;
  const std::unique_ptr<GDALDataset> data(GDALDataset::Open(name.c_str(), GDAL_OF_VECTOR | GDAL_OF_READONLY));
  if (data == nullptr) throw ToolError("{}: cannot be opened as a way{}; {}", name, quiet.reason(), kForms);
  OGRLayer& layer = layer_of(*data, name);
  std::vector<Vec2> points = points_of(layer, name);
  if (!points.empty()) take_to(reference_system, layer.GetSpatialRef(), name, points);
  check_way(points, name);
  return points;
}

}  // namespace cairn::ground
