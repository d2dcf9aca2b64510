// Boulder tables for geographic information systems, read back by GDAL's own reader and by ogrinfo.
#include "map/geopackage.hpp"

#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogrsf_frmts.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>

#include "base/output_file.hpp"
#include "ground_tools/scratch.hpp"
#include "ortho/reference_system.hpp"

using namespace cairn;
using namespace cairn::ground;
using cairn::test::Scratch;

namespace {

namespace fs = std::filesystem;

const Scratch scratch;
// That of HiRISE: a sphere of Mars's local radius, without a number.
const char* const kMars = "+proj=eqc +lat_ts=-38.071984777395 +lon_0=224.02263789406 +R=3388546.86869391";
std::unique_ptr<GDALDataset> data;
std::vector<TableBoulder> boulders;
std::string text;

void make_boulders(bool with_z) {
  boulders.clear();
  for (int i = 0; i < 50; ++i) {
    TableBoulder b;
    b.p_map_m = Vec2(-35.8637 + 3.0123456789 * i, -2251400.0638 - 2.0987654321 * i);
    b.diameter_m = 0.3 + 0.01 * i;
    b.area_m2 = 0.1;
    b.height_m = i == 7 ? 0.0 : 0.25;
    b.confidence = 0.02 * i;
    if (with_z) b.ground_z_m = -2500.5 + i;
    boulders.push_back(b);
  }
}

OGRLayer* opened(const fs::path& path) {
  GDALAllRegister();
  data.reset(GDALDataset::Open(path.c_str(), GDAL_OF_VECTOR | GDAL_OF_READONLY));
  assert_non_null(data.get());
  OGRLayer* const layer = data->GetLayer(0);
  assert_non_null(layer);
  return layer;
}

std::size_t files_in(const fs::path& folder) {
  std::size_t count = 0;
  for (const auto& entry : fs::directory_iterator(folder)) count += entry.exists() ? 1 : 0;
  return count;
}

/// What a command writes; empty where it is not installed.
std::string output_of(const std::string& command) {
  std::string all;
  std::FILE* const pipe = ::popen((command + " 2>/dev/null").c_str(), "r");
  assert_non_null(pipe);
  char block[4096];
  for (std::size_t got = 0; (got = std::fread(block, 1, sizeof block, pipe)) > 0;) all.append(block, got);
  ::pclose(pipe);
  return all;
}

void test_read_back(void**) {
  for (const bool with_z : {false, true}) {
    make_boulders(with_z);
    write_geopackage(scratch.path("read/b.gpkg"), boulders, kMars);
    assert_int_equal(files_in(scratch.path("read")), 1);
    OGRLayer* const layer = opened(scratch.path("read/b.gpkg"));
    assert_string_equal(layer->GetName(), "boulders");
    assert_int_equal(layer->GetGeomType(), with_z ? wkbPoint25D : wkbPoint);
    assert_int_equal(layer->GetFeatureCount(), 50);
    assert_true(layer->TestCapability(OLCFastSpatialFilter));
    for (std::size_t i = 0; i < 50; ++i) {
      const OGRFeatureUniquePtr feature(layer->GetNextFeature());
      const OGRPoint* const point = feature->GetGeometryRef()->toPoint();
      assert_near(point->getX(), boulders[i].p_map_m.x(), 0.0);
      assert_near(point->getY(), boulders[i].p_map_m.y(), 0.0);
      assert_near(feature->GetFieldAsDouble("diameter_m"), boulders[i].diameter_m, 0.0);
      assert_near(feature->GetFieldAsDouble("confidence"), boulders[i].confidence, 0.0);
      assert_int_equal(feature->IsFieldNull(feature->GetFieldIndex("height_m")), i == 7);
      assert_int_equal(feature->IsFieldNull(feature->GetFieldIndex("ground_z_m")), !with_z);
      if (with_z) assert_near(point->getZ(), boulders[i].ground_z_m, 0.0);
    }
    data.reset();
  }
}

void test_craters_have_a_layer(void**) {
  make_boulders(false);
  TableBoulder crater;
  crater.diameter_m = 9.0;
  write_geopackage(scratch.path("craters.gpkg"), boulders, kMars, {crater});
  OGRLayer* const first = opened(scratch.path("craters.gpkg"));
  assert_string_equal(first->GetName(), "boulders");
  assert_int_equal(first->GetFeatureCount(), 50);
  OGRLayer* const layer = data->GetLayerByName("craters");
  assert_non_null(layer);
  assert_int_equal(layer->GetFeatureCount(), 1);
  const OGRFeatureUniquePtr feature(layer->GetNextFeature());
  assert_near(feature->GetFieldAsDouble("diameter_m"), 9.0, 0.0);
  data.reset();
  assert_int_equal(read_points(scratch.path("craters.gpkg")).boulders.size(), 50);
}

/// A layer that somebody saved: fields of text, a column that tells craters.
void test_a_layer_saved_by_hand(void**) {
  const auto save = [](const char* diameter, const char* kind) {
    return scratch.file(
        "hand.geojson",
        fmt::format(R"({{"type":"FeatureCollection","crs":{{"type":"name","properties":{{"name":)"
                    R"("EPSG:32633"}}}},"features":[{{"type":"Feature","properties":{{"diameter_m":)"
                    R"("{}","confidence":" 0,5","kind":"{}"}},"geometry":{{"type":"Point",)"
                    R"("coordinates":[5.0,6.0]}}}}]}})",
                    diameter, kind));
  };
  const PointLayer layer = read_points(save("1,35", "boulder"));
  assert_int_equal(layer.boulders.size(), 1);
  assert_near(layer.boulders[0].diameter_m, 1.35, 0.0);
  assert_near(layer.boulders[0].confidence, 0.5, 0.0);
  assert_near(read_points(save("1.35", "")).boulders.at(0).diameter_m, 1.35, 0.0);
  assert_true(read_points(save("1.35", "Crater")).boulders.empty());
  assert_refused(read_points(save("1.35 m", "boulder")), "'1.35 m' in field 'diameter_m'");
  assert_refused(read_points(save("", "boulder")), "diameter is not positive");
}

/// A layer of craters that was saved alone.
void test_craters_alone_are_no_boulders(void**) {
  make_boulders(false);
  write_geopackage(scratch.path("both.gpkg"), {}, kMars, boulders);
  {
    const std::unique_ptr<GDALDataset> both(
        GDALDataset::Open(scratch.path("both.gpkg").c_str(), GDAL_OF_VECTOR | GDAL_OF_UPDATE));
    assert_int_equal(both->DeleteLayer(0), OGRERR_NONE);
  }
  assert_refused(read_points(scratch.path("both.gpkg")), "no layer of boulders");
}

/// However a system is written, the file's system means the same.
/// What is written is read as it was.
void test_points_are_boulders_again(void**) {
  boulders.assign(2, TableBoulder());
  boulders[0].p_map_m = Vec2(1000.123456789, -2.0e6);
  boulders[0].diameter_m = 0.75;
  boulders[0].confidence = 0.5;
  boulders[1].p_map_m = Vec2(1001.0, -2.0e6);
  boulders[1].diameter_m = 0.25;
  write_geopackage(scratch.path("again.gpkg"), boulders, "EPSG:32633");
  const PointLayer layer = read_points(scratch.path("again.gpkg"), 0.5);
  assert_string_equal(layer.reference_system.c_str(), "EPSG:32633");
  assert_int_equal(layer.boulders.size(), 1);
  assert_near((layer.boulders[0].p_map_m - boulders[0].p_map_m).norm(), 0.0, 0.0);
  assert_near(layer.boulders[0].diameter_m, 0.75, 0.0);
  assert_near(layer.boulders[0].confidence, 0.5, 0.0);
  assert_near(layer.boulders[0].height_m, 0.0, 0.0);
  assert_refused(read_points(scratch.file("none.gpkg", "x")), "none.gpkg: cannot be opened");
}

void test_reference_systems(void**) {
  make_boulders(false);
  static std::string systems[] = {"EPSG:32633", "IAU_2015:49910",
                                  kMars,        "+proj=stere +lat_0=90 +lon_0=0 +a=3396190 +b=3376200",
                                  "local",      "local:rover site"};
  for (const std::string& system : systems) {
    write_geopackage(scratch.path("systems/b.gpkg"), boulders, system);
    text = reference_text(opened(scratch.path("systems/b.gpkg"))->GetSpatialRef());
    data.reset();
    if (!same_reference(text, system)) fail_msg("'%s' came back as '%s'", system.c_str(), text.c_str());
  }
}

void test_same_table_same_bytes(void**) {
  make_boulders(true);
  write_geopackage(scratch.path("bytes/a.gpkg"), boulders, kMars);
  write_geopackage(scratch.path("bytes/b.gpkg"), boulders, kMars);
  assert_true(read_file(scratch.path("bytes/a.gpkg")) == read_file(scratch.path("bytes/b.gpkg")));
}

void test_ogrinfo(void**) {
  if (std::system("ogrinfo --version >/dev/null 2>&1") != 0) {
    print_message("skipped: no ogrinfo\n");
    skip();
  }
  make_boulders(false);
  write_geopackage(scratch.path("info/b.gpkg"), boulders, kMars);
  text = output_of("ogrinfo -al -so '" + scratch.path("info/b.gpkg").string() + "'");
  for (const char* word :
       {"Layer name: boulders", "Geometry: Point", "Feature Count: 50", "Equidistant Cylindrical",
        "3388546.86869391", "Extent: (-35.863700, -2251502.903306) - (111.741238, -2251400.063800)",
        "diameter_m: Real"}) {
    if (text.find(word) == std::string::npos) fail_msg("ogrinfo tells no '%s':\n%s", word, text.c_str());
  }
}

void test_csv_has_places(void**) {
  make_boulders(true);
  write_csv(scratch.path("csv/b.csv"), boulders, kMars);
  assert_int_equal(files_in(scratch.path("csv")), 3);
  OGRLayer* const layer = opened(scratch.path("csv/b.csv"));
  assert_int_equal(layer->GetGeomType(), wkbPoint);
  assert_true(same_reference(reference_text(layer->GetSpatialRef()), kMars));
  const OGRFeatureUniquePtr feature(layer->GetFeature(4));
  assert_near(feature->GetGeometryRef()->toPoint()->getX(), boulders[3].p_map_m.x(), 0.001);
  assert_near(feature->GetGeometryRef()->toPoint()->getY(), boulders[3].p_map_m.y(), 0.001);
  data.reset();
  // A local table after it leaves no system of another behind.
  write_csv(scratch.path("csv/b.csv"), boulders, "local");
  assert_int_equal(files_in(scratch.path("csv")), 2);
  scratch.file("csv/b.shp", "");
  assert_refused(write_csv(scratch.path("csv/b.csv"), boulders, kMars), "b.shp");
}

void test_an_older_file_is_replaced(void**) {
  make_boulders(false);
  scratch.file("old/b.gpkg", "something else");
  write_geopackage(scratch.path("old/b.gpkg"), boulders, "local");
  assert_int_equal(opened(scratch.path("old/b.gpkg"))->GetFeatureCount(), 50);
  data.reset();
  boulders.clear();
  write_geopackage(scratch.path("old/b.gpkg"), boulders, "local");
  assert_int_equal(opened(scratch.path("old/b.gpkg"))->GetFeatureCount(), 0);
  data.reset();
}

void test_refusals(void**) {
  make_boulders(false);
  assert_refused(write_geopackage(scratch.path("none/x") / "y/b.gpkg", boulders, kMars), "folder");
  assert_refused(write_geopackage(scratch.path("none"), boulders, kMars), "none: cannot write here");
  assert_refused(write_geopackage(scratch.path("no/b.gpkg"), boulders, "+proj=nonsense"), "+proj=nonsense");
  assert_int_equal(files_in(scratch.path("no")), 0);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_read_back),
      cmocka_unit_test(test_craters_have_a_layer),
      cmocka_unit_test(test_points_are_boulders_again),
      cmocka_unit_test(test_a_layer_saved_by_hand),
      cmocka_unit_test(test_craters_alone_are_no_boulders),
      cmocka_unit_test(test_reference_systems),
      cmocka_unit_test(test_same_table_same_bytes),
      cmocka_unit_test(test_ogrinfo),
      cmocka_unit_test(test_csv_has_places),
      cmocka_unit_test(test_an_older_file_is_replaced),
      cmocka_unit_test(test_refusals),
  };
  return cmocka_run_group_tests_name("ground_tools/map/geopackage", tests, nullptr, nullptr);
}
