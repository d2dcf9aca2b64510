// Orthoimages through GDAL: where pixels lie, which are valid, and files that cannot be used.
#include "ortho/raster.hpp"

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <functional>
#include <limits>
#include <memory>

#include "ground_tools/raster_in_memory.hpp"
#include "ground_tools/scratch.hpp"
#include "ground_tools/test_images.hpp"

using namespace cairn;
using namespace cairn::ground;
using cairn::test::Scratch;
using test::Raster;
using test::read_orthoimage;

namespace {

const Scratch scratch;
Raster raster;

struct TiffForm {
  int epsg = 0;  ///< 0 = no reference system
  bool geo = true;
  double no_data = -1.0;  ///< below 0 = none
  GDALDataType type = GDT_Byte;
  int bands = 1;
};

/// A GeoTIFF of 6 x 4 pixels of 0.5 m whose outer corner is at (100, 200).
std::filesystem::path tiff(const char* name, const TiffForm& form,
                           const std::function<double(int band, int x, int y)>& sample) {
  GDALAllRegister();
  const std::filesystem::path path = scratch.path(name);
  const std::unique_ptr<GDALDataset> data(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      path.c_str(), 6, 4, form.bands, form.type, nullptr));
  double geo[6] = {100.0, 0.5, 0.0, 200.0, 0.0, -0.5};
  if (form.geo) data->SetGeoTransform(geo);
  if (form.epsg != 0) {
    OGRSpatialReference system;
    system.importFromEPSG(form.epsg);
    data->SetSpatialRef(&system);
  }
  for (int b = 0; b < form.bands; ++b) {
    if (form.no_data >= 0.0) data->GetRasterBand(b + 1)->SetNoDataValue(form.no_data);
    for (int y = 0; y < 4; ++y) {
      for (int x = 0; x < 6; ++x) {
        double value = sample(b, x, y);
        assert_int_equal(data->GetRasterBand(b + 1)->RasterIO(GF_Write, x, y, 1, 1, &value, 1, 1, GDT_Float64,
                                                              0, 0, nullptr),
                         CE_None);
      }
    }
  }
  return path;
}

double ramp(int, int x, int y) { return 10 * y + x; }

void test_pixels_and_places(void**) {
  raster = read_orthoimage(tiff("utm.tif", {32633}, ramp));
  assert_int_equal(raster.width, 6);
  assert_int_equal(raster.height, 4);
  assert_true(raster.valid.empty());
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 6; ++x) assert_int_equal(raster.grey_view().at(x, y), 10 * y + x);
  }
  assert_string_equal(raster.reference_system.c_str(), "EPSG:32633");
  // GDAL's origin is the outer corner of the first pixel: its centre is half a pixel inside.
  const Vec2 first = raster.geo.to_map(0.0, 0.0);
  assert_near(first.x(), 100.25, 1e-12);
  assert_near(first.y(), 199.75, 1e-12);
  assert_near(raster.geo.pixel_m(), 0.5, 1e-12);
}

void test_world_file(void**) {
  test::write_grey_png(scratch.path("world.png"), 20, 10);
  // A world file gives the centre of the first pixel.
  scratch.file("world.wld", "0.1\n0\n0\n-0.1\n50.0\n70.0\n");
  raster = read_orthoimage(scratch.path("world.png"));
  const Vec2 first = raster.geo.to_map(0.0, 0.0);
  assert_near(first.x(), 50.0, 1e-12);
  assert_near(first.y(), 70.0, 1e-12);
  assert_string_equal(raster.reference_system.c_str(), "local");
}

void test_16_bit_is_stretched(void**) {
  raster = read_orthoimage(tiff("deep.tif", {32633, true, -1.0, GDT_UInt16},
                                [](int, int x, int y) { return 4000 + 100 * (6 * y + x); }));
  assert_int_equal(raster.grey.front(), 0);
  assert_int_equal(raster.grey.back(), 255);
  assert_in_range(raster.grey[12], 128, 140);
}

void test_no_data(void**) {
  raster = read_orthoimage(tiff("hole.tif", {32633, true, 21.0}, ramp));
  assert_int_equal(raster.valid.size(), 24);
  for (int i = 0; i < 24; ++i) assert_int_equal(raster.valid[static_cast<std::size_t>(i)] == 0, i == 13);
  raster = read_orthoimage(tiff("nan.tif", {32633, true, -1.0, GDT_Float32}, [](int, int x, int y) {
    return x == 2 && y == 1 ? std::numeric_limits<double>::quiet_NaN() : ramp(0, x, y);
  }));
  assert_int_equal(raster.valid[8], 0);
  assert_int_equal(raster.valid[9], 255);
}

void test_bands(void**) {
  const std::filesystem::path path =
      tiff("rgb.tif", {32633, true, -1.0, GDT_Byte, 3}, [](int b, int x, int) { return 30 * b + x; });
  raster = read_orthoimage(path);  // the mean of the three
  assert_int_equal(raster.grey[2], 32);
  raster = read_orthoimage(path, 3);
  assert_int_equal(raster.grey[2], 62);
  assert_refused(read_orthoimage(path, 4), "has no band 4");
}

void test_refusals(void**) {
  assert_refused(read_orthoimage(scratch.path("absent.tif")), "absent.tif: no such file");
  assert_refused(read_orthoimage(scratch.file("text.tif", "hello")), "cannot be opened as an image");
  assert_refused(read_orthoimage(tiff("bare.tif", {0, false}, ramp)), "has no geo-reference");
  assert_refused(read_orthoimage(tiff("degrees.tif", {4326}, ramp)), "degrees");
  assert_refused(read_orthoimage(tiff("feet.tif", {2263}, ramp)), "metres");
  assert_refused(read_orthoimage(tiff("flat.tif", {32633}, [](int, int, int) { return 7.0; })),
                 "same value (7)");
  assert_refused(read_orthoimage(tiff("void.tif", {32633, true, 9.0}, [](int, int, int) { return 9.0; })),
                 "no data");
  assert_refused(read_orthoimage(tiff("complex.tif", {32633, true, -1.0, GDT_CFloat32}, ramp)), "complex");
}

void test_truncated_files(void**) {
  for (const char* name : {"cut.tif", "cut.png", "cut.jpg"}) {
    static std::filesystem::path path;
    path = scratch.path(name);
    const char* driver = path.extension() == ".tif" ? "GTiff" : path.extension() == ".png" ? "PNG" : "JPEG";
    test::write_image(path, driver, GDT_Byte, 300, 200, 1,
                      [](int, int x, int y) { return test::texture(x, y); });
    scratch.file("cut.wld", "0.1\n0\n0\n-0.1\n50.0\n70.0\n");
    raster = read_orthoimage(path);
    std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
    assert_refused(read_orthoimage(path), name);
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_pixels_and_places),
      cmocka_unit_test(test_world_file),
      cmocka_unit_test(test_16_bit_is_stretched),
      cmocka_unit_test(test_no_data),
      cmocka_unit_test(test_bands),
      cmocka_unit_test(test_refusals),
      cmocka_unit_test(test_truncated_files),
  };
  return cmocka_run_group_tests_name("ground_tools/ortho/raster", tests, nullptr, nullptr);
}
