#include "map/geopackage.hpp"

#include <cpl_conv.h>
#include <gdal_priv.h>
#include <ogrsf_frmts.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "base/number_table.hpp"
#include "base/output_file.hpp"
#include "base/quiet_gdal.hpp"
#include "base/tool_error.hpp"
#include "core/trig.hpp"
#include "ortho/reference_system.hpp"

namespace cairn::ground {
namespace {

constexpr const char* kLayer = "boulders";
constexpr const char* kCraterLayer = "craters";

struct Field {
  const char* name;
  double TableBoulder::*member;
  bool zero_is_unknown;
};

constexpr Field kFields[] = {
    {"diameter_m", &TableBoulder::diameter_m, false}, {"area_m2", &TableBoulder::area_m2, false},
    {"contrast", &TableBoulder::contrast, true},      {"elongation", &TableBoulder::elongation, false},
    {"height_m", &TableBoulder::height_m, true},      {"confidence", &TableBoulder::confidence, false},
    {"ground_z_m", &TableBoulder::ground_z_m, false},
};

/// An option of GDAL for as long as it lives, on this thread.
class GdalOption {
 public:
  GdalOption(const char* key, const char* value) : key_(key) { CPLSetThreadLocalConfigOption(key, value); }
  ~GdalOption() { CPLSetThreadLocalConfigOption(key_, nullptr); }
  GdalOption(const GdalOption&) = delete;
  GdalOption& operator=(const GdalOption&) = delete;

 private:
  const char* key_;
};

using Dataset = std::unique_ptr<GDALDataset>;

bool all_on_known_ground(const std::vector<TableBoulder>& boulders) {
  return !boulders.empty() && std::all_of(boulders.begin(), boulders.end(),
                                          [](const TableBoulder& b) { return std::isfinite(b.ground_z_m); });
}

OGRLayer* add_layer(GDALDataset& data, const char* name, OGRSpatialReference& system, bool with_z) {
  const std::string identifier = fmt::format("IDENTIFIER={}", name);
  const std::string description = fmt::format("DESCRIPTION={}, frame map: metres east and north",
                                              name == kLayer ? "Boulders" : "Craters");
  const char* const options[] = {"SPATIAL_INDEX=YES", identifier.c_str(), description.c_str(), nullptr};
  OGRLayer* const layer =
      data.CreateLayer(name, &system, with_z ? wkbPoint25D : wkbPoint, const_cast<char**>(options));
  if (layer == nullptr) return nullptr;
  for (const Field& field : kFields) {
    OGRFieldDefn definition(field.name, OFTReal);
    if (layer->CreateField(&definition) != OGRERR_NONE) return nullptr;
  }
  return layer;
}

bool add_boulders(OGRLayer& layer, const std::vector<TableBoulder>& boulders, bool with_z) {
  OGRFeature feature(layer.GetLayerDefn());
  for (const TableBoulder& b : boulders) {
    feature.SetFID(OGRNullFID);
    OGRPoint point(b.p_map_m.x(), b.p_map_m.y());
    if (with_z) point.setZ(b.ground_z_m);
    feature.SetGeometry(&point);
    for (int i = 0; i < static_cast<int>(std::size(kFields)); ++i) {
      const double value = b.*kFields[i].member;
      if (!std::isfinite(value) || (kFields[i].zero_is_unknown && value == 0.0)) {
        feature.SetFieldNull(i);
      } else {
        feature.SetField(i, value);
      }
    }
    if (layer.CreateFeature(&feature) != OGRERR_NONE) return false;
  }
  return true;
}

using Counts = std::vector<std::pair<std::string, GIntBig>>;

Counts counts_of(GDALDataset* data) {
  Counts counts;
  if (data == nullptr) return counts;
  for (OGRLayer* const layer : data->GetLayers())
    counts.emplace_back(layer->GetName(), layer->GetFeatureCount());
  return counts;
}

}  // namespace

void write_layers(const std::filesystem::path& path, const std::string& reference_system,
                  const std::function<bool(GDALDataset&, OGRSpatialReference&)>& fill) {
  OGRSpatialReference system = reference_of(reference_system, path.string());
  OutputByName output(path);
  const QuietGdal quiet;
  const GdalOption date("OGR_CURRENT_DATE", "2000-01-01T00:00:00.000Z");
  const GdalOption statements("OGR_SQLITE_JOURNAL", "MEMORY");
  GDALDriver* const driver = GetGDALDriverManager()->GetDriverByName("GPKG");
  if (driver == nullptr) {
    throw ToolError("{}: this GDAL cannot write GeoPackage; install one with SQLite, or ask for CSV",
                    path.string());
  }
  bool good = false;
  Counts counts;
  {
    const Dataset data(driver->Create(output.file().c_str(), 0, 0, 0, GDT_Unknown, nullptr));
    good = data != nullptr && data->StartTransaction() == OGRERR_NONE && fill(*data, system) &&
           data->CommitTransaction() == OGRERR_NONE;
    counts = counts_of(data.get());
  }
  // SQLite tells of a full disk only as it closes: what is on the disk is read back.
  const Dataset back(GDALDataset::Open(output.file().c_str(), GDAL_OF_VECTOR | GDAL_OF_READONLY));
  if (!good || quiet.failed() || counts_of(back.get()) != counts)
    throw ToolError("{}: writing failed{}; free some disk space and run again", path.string(),
                    quiet.reason());
  output.commit();
}

void write_geopackage(const std::filesystem::path& path, const std::vector<TableBoulder>& boulders,
                      const std::string& reference_system, const std::vector<TableBoulder>& craters) {
  write_layers(path, reference_system, [&](GDALDataset& data, OGRSpatialReference& system) {
    const auto put = [&](const char* name, const std::vector<TableBoulder>& points) {
      const bool with_z = all_on_known_ground(points);
      OGRLayer* const layer = add_layer(data, name, system, with_z);
      return layer != nullptr && add_boulders(*layer, points, with_z) && layer->SyncToDisk() == OGRERR_NONE;
    };
    return put(kLayer, boulders) && (craters.empty() || put(kCraterLayer, craters));
  });
}

void write_csv(const std::filesystem::path& path, const std::vector<TableBoulder>& boulders,
               const std::string& reference_system, const std::vector<TableBoulder>& craters) {
  const auto beside = [&](const char* ending) {
    return std::filesystem::path(path).replace_extension(ending);
  };
  if (std::filesystem::exists(beside(".shp"))) {
    throw ToolError("{}: {} in the same folder uses the same .prj; choose another name", path.string(),
                    beside(".shp").filename().string());
  }
  std::string wkt;
  if (!is_local_reference(reference_system)) {
    char* text = nullptr;
    reference_of(reference_system, path.string()).exportToWkt(&text);
    if (text != nullptr) wkt = text;
    CPLFree(text);
  }
  OutputFile table(path);
  OutputFile types(beside(".csvt"));
  table.write(to_csv(boulders, craters));
  types.write(
      "\"CoordX\",\"CoordY\",\"Real\",\"Real\",\"Real\",\"Real\",\"Real\",\"Real\",\"Real\",\"String\"\n");
  const HoldInterrupts all_or_none;
  if (wkt.empty()) {
    std::error_code ignored;
    if (std::filesystem::exists(path))
      std::filesystem::remove(beside(".prj"), ignored);  // an earlier table's
  } else {
    write_file(beside(".prj"), wkt + "\n");
  }
  types.commit();
  table.commit();
}

std::string reference_beside(const std::filesystem::path& csv) {
  const std::filesystem::path prj = std::filesystem::path(csv).replace_extension(".prj");
  if (!std::filesystem::exists(prj)) return std::string(reference_text(nullptr));
  const std::vector<std::uint8_t> bytes = read_file(prj);
  const QuietGdal quiet;
  OGRSpatialReference system;
  std::string text(bytes.begin(), bytes.end());
  text.erase(0, text.find_first_not_of(" \t\r\n"));  // gdalsrsinfo begins with an empty line
  if (system.SetFromUserInput(text.c_str()) != OGRERR_NONE || system.IsGeographic() != 0) {
    throw ToolError("{}: contains no projected reference system as WKT; correct or remove it", prj.string());
  }
  return reference_text(&system);
}

namespace {

/// Of a column of numbers, or of text that holds them; nothing where it is empty.
std::optional<double> number_of(const OGRFeature& feature, int column, const std::string& where) {
  if (!feature.IsFieldSetAndNotNull(column)) return std::nullopt;
  if (feature.GetFieldDefnRef(column)->GetType() != OFTString) return feature.GetFieldAsDouble(column);
  const std::string text = feature.GetFieldAsString(column);
  if (text.find_first_not_of(' ') == std::string::npos) return std::nullopt;
  const std::optional<double> value = to_table_number(text);
  if (!value)
    throw ToolError("{}: '{}' in field '{}' is not a number; correct it, or make the field one of numbers",
                    where, text, feature.GetFieldDefnRef(column)->GetNameRef());
  return value;
}

}  // namespace

PointLayer read_points(const std::filesystem::path& path, double min_diameter_m) {
  const std::string name = path.string();
  const QuietGdal quiet;
  const Dataset data(GDALDataset::Open(name.c_str(), GDAL_OF_VECTOR | GDAL_OF_READONLY));
  if (data == nullptr)
    throw ToolError("{}: cannot be opened as a layer of points{}; give a GeoPackage, GeoJSON or shapefile",
                    name, quiet.reason());
  OGRLayer* layer = data->GetLayerByName(kLayer);
  for (OGRLayer* const other : data->GetLayers()) {
    if (layer == nullptr && !is_crater(other->GetName())) layer = other;
  }
  if (layer == nullptr) throw ToolError("{}: contains no layer of boulders; export them as points", name);
  const OGRFeatureDefn& fields = *layer->GetLayerDefn();
  int diameter = fields.GetFieldIndex("diameter_m");
  if (diameter < 0) diameter = fields.GetFieldIndex("diameter");
  if (diameter < 0)
    throw ToolError("{}: layer '{}' has no field 'diameter_m' or 'diameter'; add it", name, layer->GetName());
  const int kind = fields.GetFieldIndex("kind");
  PointLayer read;
  const OGRSpatialReference* const system = layer->GetSpatialRef();
  if (system != nullptr && system->IsGeographic() != 0)
    throw ToolError("{}: its coordinates are degrees; save it in a projected system in metres", name);
  read.reference_system = reference_text(system);
  for (const auto& feature : *layer) {
    if (kind >= 0 && is_crater(feature->GetFieldAsString(kind))) continue;
    const std::string where = fmt::format("{}: feature {}", name, feature->GetFID());
    const OGRGeometry* const shape = feature->GetGeometryRef();
    if (shape == nullptr || wkbFlatten(shape->getGeometryType()) != wkbPoint)
      throw ToolError("{} is no point; export the boulders as points", where);
    TableBoulder b;
    b.p_map_m = Vec2(shape->toPoint()->getX(), shape->toPoint()->getY());
    if (!b.p_map_m.allFinite()) throw ToolError("{} has no place; correct or remove it", where);
    b.diameter_m = number_of(*feature, diameter, where).value_or(0.0);
    b.area_m2 = 0.25 * kPi * b.diameter_m * b.diameter_m;
    for (const Field& field : kFields) {
      const int at = fields.GetFieldIndex(field.name);
      if (at >= 0 && at != diameter)
        b.*field.member = number_of(*feature, at, where).value_or(b.*field.member);
    }
    check_boulder(b, where);
    if (b.diameter_m >= min_diameter_m) read.boulders.push_back(b);
  }
  return read;
}

}  // namespace cairn::ground
