#include "forecast/forecast_layers.hpp"

#include <cpl_vsi.h>
#include <gdal_priv.h>
#include <ogrsf_frmts.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "map/geopackage.hpp"

namespace cairn::ground {
namespace {

using nlohmann::ordered_json;

/// In the order of drawing: what comes last lies on top.
struct Kind {
  const char* kind;
  const char* layer;
};
constexpr Kind kKinds[] = {
    {"ellipse", "ellipses"}, {"drive", "drive"}, {"blind", "blind"}, {"station", "stations"}};
constexpr const char* kInMemory = "/vsimem/cairn_forecast.geojson";

/// With the places as they stand: GDAL's own copy takes those of a GeoJSON for degrees.
bool copy(OGRLayer& from, OGRLayer& to) {
  OGRFeatureDefn& fields = *from.GetLayerDefn();
  for (int i = 0; i < fields.GetFieldCount(); ++i) {
    if (to.CreateField(fields.GetFieldDefn(i)) != OGRERR_NONE) return false;
  }
  for (const auto& feature : from) {
    OGRFeature same(to.GetLayerDefn());
    if (same.SetFrom(feature.get()) != OGRERR_NONE || to.CreateFeature(&same) != OGRERR_NONE) return false;
  }
  return true;
}

bool add_layer(GDALDataset& data, const char* name, const ordered_json& features,
               OGRSpatialReference& system) {
  std::string text = ordered_json{{"type", "FeatureCollection"}, {"features", features}}.dump();
  VSIFCloseL(VSIFileFromMemBuffer(kInMemory, reinterpret_cast<GByte*>(text.data()), text.size(), FALSE));
  const std::unique_ptr<GDALDataset> source(GDALDataset::Open(kInMemory, GDAL_OF_VECTOR | GDAL_OF_READONLY));
  bool good = source != nullptr;
  if (good) {
    OGRLayer& from = *source->GetLayer(0);
    const char* const options[] = {"SPATIAL_INDEX=YES", nullptr};
    OGRLayer* const to = data.CreateLayer(name, &system, from.GetGeomType(), const_cast<char**>(options));
    good = to != nullptr && copy(from, *to);
  }
  VSIUnlink(kInMemory);
  return good;
}

}  // namespace

void write_forecast_layers(const std::filesystem::path& path, const std::string& geojson,
                           const std::string& reference_system) {
  const ordered_json all = ordered_json::parse(geojson);
  write_layers(path, reference_system, [&](GDALDataset& data, OGRSpatialReference& system) {
    bool good = true;
    for (const Kind& kind : kKinds) {
      ordered_json features = ordered_json::array();
      for (const ordered_json& feature : all["features"]) {
        if (feature["properties"]["kind"] == kind.kind) features.push_back(feature);
      }
      if (!features.empty()) good = good && add_layer(data, kind.layer, features, system);
    }
    return good;
  });
}

}  // namespace cairn::ground
