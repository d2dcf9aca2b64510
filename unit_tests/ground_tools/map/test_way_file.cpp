// Ways as planners keep them: tables, well-known text, layers in the map's system or in another.
#include "map/way_file.hpp"

#include <gdal_priv.h>
#include <ogrsf_frmts.h>

#include <memory>

#include "forecast/forecast_layers.hpp"
#include "ground_tools/scratch.hpp"
#include "map/geopackage.hpp"
#include "ortho/reference_system.hpp"
#include "ortho/true_scale.hpp"

using namespace cairn;
using namespace cairn::ground;
using cairn::test::Scratch;

namespace {

namespace fs = std::filesystem;
using Way = std::vector<Vec2>;

const Scratch scratch;
const char* const kUtm = "EPSG:32633";
const char* const kDegrees = "EPSG:4326";
const Way kWay = {{500005.0, 4000010.0}, {500030.0, 4000030.0}, {500055.0, 4000012.0}};

/// The way in another system.
Way in_system(const std::string& system) {
  const Places places(kUtm, system);
  Way way;
  for (const Vec2& p : kWay) way.push_back(places(p));
  return way;
}

struct Feature {
  std::string kind;
  Way points;
};

/// A layer of lines, or of single points where a feature has one.
fs::path layer_file(const char* driver, const std::string& name, const std::string& system,
                    const std::vector<Feature>& features, const char* layer_name = "layer") {
  GDALAllRegister();
  fs::remove(scratch.path(name));
  const std::unique_ptr<GDALDataset> data(GetGDALDriverManager()->GetDriverByName(driver)->Create(
      scratch.path(name).c_str(), 0, 0, 0, GDT_Unknown, nullptr));
  OGRSpatialReference reference = reference_of(system, name);
  OGRLayer* const layer =
      data->CreateLayer(layer_name, system.empty() ? nullptr : &reference, wkbUnknown, nullptr);
  OGRFieldDefn kind("kind", OFTString);
  assert_int_equal(layer->CreateField(&kind), OGRERR_NONE);
  for (const Feature& f : features) {
    OGRFeature feature(layer->GetLayerDefn());
    feature.SetField("kind", f.kind.c_str());
    OGRLineString line;
    for (const Vec2& p : f.points) line.addPoint(p.x(), p.y());
    const OGRPoint point(f.points[0].x(), f.points[0].y());
    feature.SetGeometry(f.points.size() == 1 ? static_cast<const OGRGeometry*>(&point) : &line);
    assert_int_equal(layer->CreateFeature(&feature), OGRERR_NONE);
  }
  return scratch.path(name);
}

void check_way_of(const fs::path& file, const std::string& map_system, double within_m) {
  static Way way;
  way = read_way(file, map_system);
  assert_int_equal(way.size(), kWay.size());
  for (std::size_t i = 0; i < way.size(); ++i) assert_near((way[i] - kWay[i]).norm(), 0.0, within_m);
}

void test_tables(void**) {
  check_way_of(scratch.file("w.csv", "\xEF\xBB\xBFX;Y\n500005;4000010\n500030;4000030\n500055;4000012\n"),
               kUtm, 0.0);
  check_way_of(
      scratch.file("wkt.csv", "WKT,id\n\"LINESTRING (500005 4000010,500030 4000030,500055 4000012)\",1\n"),
      kUtm, 0.0);
  check_way_of(scratch.file("points.csv",
                            "WKT,id\nPOINT (500005 4000010),1\nPOINT (500030 4000030),2\n"
                            "POINT (500055 4000012),3\n"),
               kUtm, 0.0);
}

void test_a_line_and_points_are_the_same_way(void**) {
  check_way_of(layer_file("GPKG", "line.gpkg", kUtm, {{"", kWay}}), kUtm, 0.0);
  check_way_of(layer_file("GPKG", "points.gpkg", kUtm, {{"", {kWay[0]}}, {"", {kWay[1]}}, {"", {kWay[2]}}}),
               kUtm, 0.0);
  Way twice = kWay;
  twice.push_back(kWay.back());
  check_way_of(layer_file("GPKG", "double_click.gpkg", kUtm, {{"", twice}}), kUtm, 0.0);
}

/// Degrees and other projections are taken to the map's metres; GDAL writes GeoJSON to 1e-7 degrees.
void test_other_systems(void**) {
  for (const char* const system : {kDegrees, "EPSG:3857", "+proj=tmerc +lon_0=15.1 +datum=WGS84"})
    check_way_of(layer_file("GPKG", "other.gpkg", system, {{"", in_system(system)}}), kUtm, 1e-4);
  check_way_of(layer_file("GeoJSON", "w.geojson", kDegrees, {{"", in_system(kDegrees)}}), kUtm, 0.02);
}

/// A local map has metres and no place: so has a way whose layer claims one.
void test_a_local_map(void**) {
  check_way_of(layer_file("GPKG", "utm.gpkg", kUtm, {{"", kWay}}), "local", 0.0);
  check_way_of(layer_file("GPKG", "bare.gpkg", "", {{"", kWay}}), kUtm, 0.0);
  assert_refused(read_way(layer_file("GPKG", "degrees.gpkg", kDegrees, {{"", in_system(kDegrees)}}), "local"),
                 "degrees.gpkg: its coordinates are degrees");
  // GeoJSON knows degrees alone: metres of a local map, small as they are, are none.
  static Way small;
  small = {{2.0, 10.0}, {14.0, 11.0}, {28.0, 8.0}};
  assert_true(read_way(layer_file("GeoJSON", "small.geojson", "", {{"drive", small}}), "local") == small);
}

void test_the_drive_among_lines(void**) {
  check_way_of(layer_file("GPKG", "two.gpkg", kUtm, {{"blind", {kWay[0], kWay[1]}}, {"drive", kWay}}), kUtm,
               0.0);
  // What a forecast writes is read back, from its GeoPackage as from its GeoJSON.
  const char* const text = R"({"type": "FeatureCollection",
    "crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::32633"}}, "features": [
    {"type": "Feature", "geometry": {"type": "LineString", "coordinates":
       [[500005, 4000010], [500030, 4000030], [500055, 4000012]]}, "properties": {"kind": "drive", "length_m": 60}},
    {"type": "Feature", "geometry": {"type": "Point", "coordinates": [500030, 4000030]},
     "properties": {"kind": "station", "frame": 30, "lever_m": 0.25}}]})";
  check_way_of(scratch.file("forecast.geojson", text), kUtm, 1e-9);
  write_forecast_layers(scratch.path("forecast.gpkg"), text, kUtm);
  check_way_of(scratch.path("forecast.gpkg"), kUtm, 1e-9);
  check_way_of(scratch.path("forecast.gpkg"), "local", 1e-9);
}

void test_layers_of_a_forecast(void**) {
  const char* const text = R"({"type": "FeatureCollection", "features": [
    {"type": "Feature", "geometry": {"type": "Point", "coordinates": [3.5, 4]},
     "properties": {"kind": "station", "frame": 30, "lever_m": 0.25, "yaw_deg": null}}]})";
  write_forecast_layers(scratch.path("local.gpkg"), text, "local:here");
  static std::unique_ptr<GDALDataset> data;
  data.reset(GDALDataset::Open(scratch.path("local.gpkg").c_str(), GDAL_OF_VECTOR | GDAL_OF_READONLY));
  assert_int_equal(data->GetLayerCount(), 1);
  OGRLayer* const layer = data->GetLayerByName("stations");
  assert_non_null(layer);
  assert_true(same_reference(reference_text(layer->GetSpatialRef()), "local:here"));
  const OGRFeatureUniquePtr feature(layer->GetNextFeature());
  assert_near(feature->GetGeometryRef()->toPoint()->getX(), 3.5, 0.0);
  assert_near(feature->GetFieldAsDouble("lever_m"), 0.25, 0.0);
  assert_int_equal(feature->GetFieldAsInteger("frame"), 30);
  data.reset();
}

void test_refusals(void**) {
  assert_refused(read_way(scratch.path("absent.gpkg"), kUtm), "absent.gpkg: cannot be opened");
  assert_refused(read_way(scratch.path("absent.csv"), kUtm), "absent.csv");
  assert_refused(read_way(scratch.file("text.gpkg", "hello"), kUtm), "text.gpkg: cannot be opened");
  assert_refused(read_way(layer_file("GPKG", "empty.gpkg", kUtm, {}), kUtm), "no features");
  assert_refused(read_way(layer_file("GPKG", "one.gpkg", kUtm, {{"", {kWay[0]}}}), kUtm), "1 way-point");
  assert_refused(read_way(layer_file("GPKG", "lines.gpkg", kUtm, {{"", kWay}, {"", kWay}}), kUtm), "2 lines");
  assert_refused(read_way(layer_file("GPKG", "both.gpkg", kUtm, {{"", kWay}, {"", {kWay[0]}}}), kUtm),
                 "a line and 1 points");
  assert_refused(read_way(layer_file("GPKG", "mars.gpkg", "IAU_2015:49910", {{"", kWay}}), kUtm),
                 "a body of 3396 km");
  assert_refused(
      read_way(layer_file("GPKG", "far.gpkg", kDegrees, {{"", {{15.0, 36.0}, {-75.0, 0.0}}}}), kUtm),
      "no place in the map's system");
  static TableBoulder boulder;
  boulder.diameter_m = 1.0;
  write_geopackage(scratch.path("layers.gpkg"), {boulder}, kUtm, {boulder});
  assert_refused(read_way(scratch.path("layers.gpkg"), kUtm), "'boulders', 'craters'");
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_tables),
      cmocka_unit_test(test_a_line_and_points_are_the_same_way),
      cmocka_unit_test(test_other_systems),
      cmocka_unit_test(test_a_local_map),
      cmocka_unit_test(test_the_drive_among_lines),
      cmocka_unit_test(test_layers_of_a_forecast),
      cmocka_unit_test(test_refusals),
  };
  return cmocka_run_group_tests_name("ground_tools/map/way_file", tests, nullptr, nullptr);
}
