// Heights of the ground from elevation models.
#include "ortho/heights.hpp"

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <cmath>
#include <functional>
#include <limits>
#include <memory>

#include "core/random.hpp"
#include "ground_tools/scratch.hpp"
#include "support/data.hpp"

using namespace cairn;
using namespace cairn::ground;
using cairn::test::Scratch;

namespace {

const Scratch scratch;
std::vector<TableBoulder> boulders;

struct Model {
  const char* system = "EPSG:32633";
  double x0_m = 500000.0;
  double y0_m = 4000000.0;
  double pixel_m = 2.0;
  int width = 100;
  int height = 80;
  double no_data = NAN;
  bool tiled = false;
};

/// An elevation model of `z(x, y)` at its pixels' centres.
std::filesystem::path model(const Model& m, const std::function<double(double x, double y)>& z) {
  GDALAllRegister();
  const std::filesystem::path path = scratch.path("dem.tif");
  const char* options[] = {"TILED=YES", "BLOCKXSIZE=16", "BLOCKYSIZE=16", nullptr};
  const std::unique_ptr<GDALDataset> data(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      path.c_str(), m.width, m.height, 1, GDT_Float32, m.tiled ? const_cast<char**>(options) : nullptr));
  double geo[6] = {m.x0_m, m.pixel_m, 0.0, m.y0_m, 0.0, -m.pixel_m};
  data->SetGeoTransform(geo);
  if (m.system != nullptr) {
    OGRSpatialReference system;
    system.SetFromUserInput(m.system);
    data->SetSpatialRef(&system);
  }
  if (!std::isnan(m.no_data)) data->GetRasterBand(1)->SetNoDataValue(m.no_data);
  for (int v = 0; v < m.height; ++v) {
    for (int u = 0; u < m.width; ++u) {
      double value = z(m.x0_m + (u + 0.5) * m.pixel_m, m.y0_m - (v + 0.5) * m.pixel_m);
      assert_int_equal(
          data->GetRasterBand(1)->RasterIO(GF_Write, u, v, 1, 1, &value, 1, 1, GDT_Float64, 0, 0, nullptr),
          CE_None);
    }
  }
  return path;
}

/// What bilinear interpolation gives back exactly, in single precision.
double plane(double x, double y) { return 0.25 * (x - 500000.0) - 0.5 * (y - 4000000.0); }

void put(std::initializer_list<Vec2> places) {
  boulders.clear();
  for (const Vec2& p : places) {
    TableBoulder b;
    b.p_map_m = p;
    b.diameter_m = 1.0;
    b.ground_z_m = 77.0;
    boulders.push_back(b);
  }
}

/// 1000 feet under a boulder in the middle, told by `tell`.
double height_of(const std::function<void(GDALDataset&)>& tell) {
  put({{500100.0, 3999920.0}});
  const std::filesystem::path path = model({}, [](double, double) { return 1000.0; });
  {
    const std::unique_ptr<GDALDataset> data(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_UPDATE));
    tell(*data);
  }
  assert_int_equal(sample_heights(path, boulders, "EPSG:32633"), 1);
  return boulders[0].ground_z_m;
}

void test_units(void**) {
  const auto unit = [](const char* name) {
    return [name](GDALDataset& data) { data.GetRasterBand(1)->SetUnitType(name); };
  };
  assert_near(height_of(unit("m")), 1000.0, 1e-9);
  assert_near(height_of(unit("ft")), 304.8, 1e-9);
  assert_near(height_of(unit("US survey foot")), 304.8006096, 1e-6);
  assert_near(height_of([](GDALDataset& data) {
                OGRSpatialReference system;
                system.SetFromUserInput("EPSG:32633+6360");
                data.SetSpatialRef(&system);
              }),
              304.8006096, 1e-6);
  assert_refused(height_of(unit("fathom")), "'fathom'");
  assert_near(height_of([](GDALDataset& data) {
                OGRSpatialReference system;
                system.SetFromUserInput("EPSG:32633+5715");  // depth below mean sea level
                data.SetSpatialRef(&system);
              }),
              -1000.0, 1e-9);
}

void test_between_pixels(void**) {
  for (const bool tiled : {false, true}) {
    Model m;
    m.tiled = tiled;
    const std::filesystem::path path = model(m, plane);
    Random random(3);
    boulders.clear();
    for (int i = 0; i < 500; ++i) {
      TableBoulder b;
      b.p_map_m =
          Vec2(500001.0 + 1.98e-7 * random.below(1000000001), 3999999.0 - 1.58e-7 * random.below(1000000001));
      boulders.push_back(b);
    }
    assert_int_equal(sample_heights(path, boulders, "EPSG:32633"), 500);
    for (const TableBoulder& b : boulders)
      assert_near(b.ground_z_m, plane(b.p_map_m.x(), b.p_map_m.y()), 1e-5);
  }
}

void test_rim_and_outside(void**) {
  const std::filesystem::path path = model({}, plane);
  put({{500000.0, 4000000.0},
       {500200.0, 3999840.0},
       {499999.99, 4000000.0},
       {500100.0, 4000000.01},
       {NAN, 0.0}});
  assert_int_equal(sample_heights(path, boulders, "EPSG:32633"), 2);
  assert_near(boulders[0].ground_z_m, plane(500001.0, 3999999.0), 1e-5);  // of the nearest centre
  assert_near(boulders[1].ground_z_m, plane(500199.0, 3999841.0), 1e-5);
  for (std::size_t i = 2; i < 5; ++i) assert_true(std::isnan(boulders[i].ground_z_m));
}

void test_no_data(void**) {
  Model m;
  m.no_data = -9999.0;
  const std::filesystem::path path =
      model(m, [](double x, double y) { return x == 500011.0 && y == 3999989.0 ? -9999.0 : 5.0; });
  put({{500011.0, 3999989.0},
       {500010.9, 3999989.0},
       {500012.9, 3999989.0},
       {500013.0, 3999989.0},
       {500009.0, 3999991.0}});
  assert_int_equal(sample_heights(path, boulders, "EPSG:32633"), 2);
  for (std::size_t i = 0; i < 5; ++i) assert_int_equal(std::isnan(boulders[i].ground_z_m), i < 3);
}

/// What no terrain is becomes no height: a hole of one value that nothing marks.
void test_unmarked_voids(void**) {
  put({{500060.0, 3999940.0}});
  for (const double hole : {-9999.0, -32768.0, 0.0, 1e20}) {
    const auto with_hole = [&](double x, double y) {
      return std::hypot(x - 500060.0, y - 3999940.0) < 9.0 ? hole : 480.0 + 1e-3 * plane(x, y);
    };
    assert_refused(sample_heights(model({}, with_hole), boulders, "EPSG:32633"), "-a_nodata");
    Model marked;
    marked.no_data = hole;
    const std::filesystem::path path = model(marked, with_hole);
    put({{500060.0, 3999940.0}, {500030.0, 3999940.0}});
    assert_int_equal(sample_heights(path, boulders, "EPSG:32633"), 1);
  }
  // A cliff is ground.
  const std::filesystem::path cliff =
      model({}, [](double x, double y) { return (x > 500060.0 ? 400.0 : 0.0) + plane(x, y); });
  assert_int_equal(sample_heights(cliff, boulders, "EPSG:32633"), 2);
}

void test_picture(void**) {
  put({{1.0, -1.0}});
  const std::string path = scratch.path("relief.tif").string();
  std::unique_ptr<GDALDataset> data(
      GetGDALDriverManager()->GetDriverByName("GTiff")->Create(path.c_str(), 4, 4, 3, GDT_Byte, nullptr));
  double geo[6] = {0.0, 1.0, 0.0, 0.0, 0.0, -1.0};
  data->SetGeoTransform(geo);
  data.reset();
  assert_refused(sample_heights(path, boulders, "local"), "picture");
}

/// A model in another system: the same plane in the map's coordinates comes out.
void test_another_system(void**) {
  const char* const map = "+proj=eqc +lat_ts=-38 +lon_0=224 +R=3388546";
  Model m;
  m.system = "+proj=eqc +lat_ts=0 +lon_0=224 +R=3388546";  // x is longer by 1 / cos 38
  m.x0_m = -100.0;
  m.y0_m = -2251000.0;
  const std::filesystem::path path =
      model(m, [](double x, double y) { return 0.1 * x + 0.2 * (y + 2251000.0); });
  put({{10.0, -2251050.0}});
  assert_int_equal(sample_heights(path, boulders, map), 1);
  assert_near(boulders[0].ground_z_m, 0.1 * 10.0 / std::cos(38.0 * 3.14159265358979323846 / 180.0) - 10.0,
              1e-4);
  // Without a system on either side they are taken as one.
  put({{10.0, -2251050.0}});
  sample_heights(path, boulders, "local");
  assert_near(boulders[0].ground_z_m, 1.0 - 10.0, 1e-4);
}

void test_a_single_pixel(void**) {
  Model m;
  m.width = 1;
  m.height = 1;
  const std::filesystem::path path = model(m, [](double, double) { return -2.5; });
  put({{500000.5, 3999999.5}});
  assert_int_equal(sample_heights(path, boulders, "EPSG:32633"), 1);
  assert_near(boulders[0].ground_z_m, -2.5, 0.0);
}

void test_refusals(void**) {
  put({{0.0, 0.0}});
  assert_refused(sample_heights(scratch.path("absent.tif"), boulders, "local"), "absent.tif");
  assert_refused(sample_heights(scratch.file("text.tif", "hello"), boulders, "local"), "text.tif");
  assert_refused(sample_heights(model({}, plane), boulders, "EPSG:32633"),
                 "no height under any of the 1 boulders");
  // Earth under a map of Mars.
  assert_refused(sample_heights(model({}, plane), boulders, "+proj=eqc +R=3396190"), "dem.tif");
  boulders.clear();
  assert_int_equal(sample_heights(model({}, plane), boulders, "EPSG:32633"), 0);
}

/// Rocks of the rendered field stand on its elevation model.
void test_rendered_field(void**) {
  const std::string dem = cairn::test::find_data("rendered_dev/dem_5cm.tif");
  SKIP_WITHOUT(dem, "rendered_dev");
  boulders = read_csv(cairn::test::find_data("rendered_dev/truth_rocks.csv"));
  const std::size_t all = boulders.size();
  assert_true(sample_heights(dem, boulders, "local") > all / 2);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_units),           cmocka_unit_test(test_between_pixels),
      cmocka_unit_test(test_rim_and_outside), cmocka_unit_test(test_no_data),
      cmocka_unit_test(test_unmarked_voids),  cmocka_unit_test(test_picture),
      cmocka_unit_test(test_another_system),  cmocka_unit_test(test_a_single_pixel),
      cmocka_unit_test(test_refusals),        cmocka_unit_test(test_rendered_field),
  };
  return cmocka_run_group_tests_name("ground_tools/ortho/heights", tests, nullptr, nullptr);
}
