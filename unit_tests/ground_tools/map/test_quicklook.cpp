// Quick-look pictures: circles around boulders, in place, on what the orthoimage shows.
#include "map/quicklook.hpp"

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <cmath>
#include <memory>

#include "ground_tools/scratch.hpp"
#include "ortho/reference_system.hpp"
#include "plot/canvas.hpp"

using namespace cairn;
using namespace cairn::ground;
using cairn::test::Scratch;

namespace {

namespace fs = std::filesystem;

const Scratch scratch;
const char* const kMars = "+proj=eqc +lat_ts=-38.071984777395 +lon_0=224.02263789406 +R=3388546.86869391";
std::vector<TableBoulder> boulders;
std::unique_ptr<GDALDataset> data;

struct Form {
  const char* system = kMars;
  double x0_m = 100.0;
  double y0_m = -2000.0;
  double pixel_m = 0.25;
  int side = 400;
  GDALDataType type = GDT_Byte;
  int bands = 1;
};

/// Grey ramps with a hole of no data (0) of 20 x 20 pixels in the middle.
fs::path ortho(const Form& form) {
  GDALAllRegister();
  const fs::path path = scratch.path("ortho.tif");
  data.reset(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(path.c_str(), form.side, form.side,
                                                                      form.bands, form.type, nullptr));
  double geo[6] = {form.x0_m, form.pixel_m, 0.0, form.y0_m, 0.0, -form.pixel_m};
  data->SetGeoTransform(geo);
  OGRSpatialReference system;
  system.SetFromUserInput(form.system);
  data->SetSpatialRef(&system);
  std::vector<std::uint16_t> row(static_cast<std::size_t>(form.side));
  for (int b = 1; b <= form.bands; ++b) {
    data->GetRasterBand(b)->SetNoDataValue(0.0);
    for (int y = 0; y < form.side; ++y) {
      for (int x = 0; x < form.side; ++x) {
        const bool hole = std::abs(x - form.side / 2) < 10 && std::abs(y - form.side / 2) < 10;
        row[static_cast<std::size_t>(x)] =
            hole ? std::uint16_t{0}
                 : static_cast<std::uint16_t>(40 + 100 * x / form.side + 50 * y / form.side);
      }
      assert_int_equal(data->GetRasterBand(b)->RasterIO(GF_Write, 0, y, form.side, 1, row.data(), form.side,
                                                        1, GDT_UInt16, 0, 0, nullptr),
                       CE_None);
    }
  }
  data.reset();
  return path;
}

MapExtent extent_of_form(const Form& f) {
  return {f.x0_m, f.y0_m - f.side * f.pixel_m, f.x0_m + f.side * f.pixel_m, f.y0_m};
}

void put(double x_m, double y_m, double diameter_m, double confidence) {
  TableBoulder b;
  b.p_map_m = Vec2(x_m, y_m);
  b.diameter_m = diameter_m;
  b.confidence = confidence;
  boulders.push_back(b);
}

Colour pixel(int x, int y) {
  std::uint8_t values[3] = {};
  assert_int_equal(data->RasterIO(GF_Read, x, y, 1, 1, values, 1, 1, GDT_Byte, 3, nullptr, 0, 0, 0, nullptr),
                   CE_None);
  return {values[0], values[1], values[2]};
}

bool coloured(const Colour& c) { return std::abs(c[0] - c[1]) > 30 || std::abs(c[1] - c[2]) > 30; }

void test_circles_and_place(void**) {
  const Form form;
  boulders.clear();
  put(150.0, -2020.0, 10.0, 1.0);  // column 200, row 80
  put(120.0, -2030.0, 0.01, 0.0);  // column 80, row 120: too small to see, drawn all the same
  put(5000.0, 5000.0, 10.0, 1.0);  // elsewhere
  const fs::path path = scratch.path("circle/q.png");
  QuicklookParams params;
  params.ortho = ortho(form);
  params.max_side_px = 400;
  const QuicklookFacts facts = write_quicklook(path, boulders, extent_of_form(form), kMars, params);
  assert_int_equal(facts.width_px, 400);
  assert_int_equal(facts.height_px, 400);
  data.reset(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER));
  assert_non_null(data.get());
  double geo[6] = {};
  assert_int_equal(data->GetGeoTransform(geo), CE_None);
  assert_near(geo[0], 100.0, 1e-9);
  assert_near(geo[3], -2000.0, 1e-9);
  assert_near(geo[1], 0.25, 1e-12);
  assert_true(same_reference(reference_text(data->GetSpatialRef()), kMars));
  // The line goes round at 20 pixels; within, the ground is as it was.
  int on_line = 0;
  for (int degrees = 0; degrees < 360; degrees += 10) {
    const double angle = degrees * 3.14159265358979323846 / 180.0;
    const auto at = [&](double radius) {
      return pixel(static_cast<int>(std::lround(199.5 + radius * std::cos(angle))),
                   static_cast<int>(std::lround(79.5 + radius * std::sin(angle))));
    };
    on_line += coloured(at(20.5)) ? 1 : 0;
    assert_false(coloured(at(17.5)));
    assert_false(coloured(at(23.5)));
  }
  assert_int_equal(on_line, 36);
  assert_true(pixel(220, 79)[2] > 200);                     // sure: cyan
  assert_true(pixel(82, 119)[0] > pixel(82, 119)[2] + 50);  // unsure: red
  assert_true(pixel(200, 200)[2] > pixel(200, 200)[0]);     // no data: dark blue
  assert_true(pixel(200, 200)[0] < 40);
  assert_true(pixel(390, 200)[0] > pixel(10, 200)[0] + 50);  // the ramp
  data.reset();
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(scratch.path("circle"))) files += entry.exists() ? 1 : 0;
  assert_int_equal(files, 2);
}

/// A large image becomes small, a small one large; the place stays.
void test_sizes(void**) {
  boulders.clear();
  put(150.0, -2020.0, 10.0, 0.5);
  for (const int max_side : {100, 150, 1000, 3000}) {
    for (const GDALDataType type : {GDT_Byte, GDT_UInt16}) {
      Form form;
      form.type = type;
      form.bands = type == GDT_Byte ? 3 : 1;
      QuicklookParams params;
      params.ortho = ortho(form);
      params.max_side_px = max_side;
      const QuicklookFacts facts =
          write_quicklook(scratch.path("q.png"), boulders, extent_of_form(form), kMars, params);
      const int expected = max_side < 400 ? max_side : std::min(4, max_side / 400) * 400;
      assert_int_equal(facts.width_px, expected);
      assert_near(facts.pixel_m, 100.0 / expected, 1e-9);
      data.reset(GDALDataset::Open(scratch.path("q.png").c_str(), GDAL_OF_RASTER));
      double geo[6] = {};
      data->GetGeoTransform(geo);
      assert_near(geo[0] + expected * geo[1], 200.0, 1e-9);
      assert_near(geo[3] + expected * geo[5], -2100.0, 1e-9);
      const double zoom = expected / 400.0;
      bool found = false;
      for (int off = -2; off <= 4; ++off)
        found = found ||
                coloured(pixel(static_cast<int>(200 * zoom + 20 * zoom) + off, static_cast<int>(80 * zoom)));
      assert_true(found);
      data.reset();
    }
  }
}

void test_without_orthoimage(void**) {
  boulders.clear();
  put(1.0, 1.0, 0.5, 1.0);
  const QuicklookFacts facts =
      write_quicklook(scratch.path("p.png"), boulders, {0.0, 0.0, 10.0, 5.0}, "local");
  assert_int_equal(facts.width_px, 2000);
  assert_int_equal(facts.height_px, 1000);
  assert_near(facts.pixel_m, 0.005, 1e-12);
}

/// A part of the orthoimage alone: whole pixels around it.
void test_cut_to_the_map(void**) {
  const Form form;
  QuicklookParams params;
  params.ortho = ortho(form);
  params.max_side_px = 100;
  const QuicklookFacts facts =
      write_quicklook(scratch.path("c.png"), {}, {110.0, -2030.0, 135.0, -2010.1}, kMars, params);
  assert_int_equal(facts.width_px, 100);
  assert_int_equal(facts.height_px, 80);
}

void test_refusals(void**) {
  const Form form;
  const MapExtent extent = extent_of_form(form);
  QuicklookParams params;
  params.ortho = scratch.path("absent.tif");
  const fs::path path = scratch.path("refused/q.png");
  assert_refused(write_quicklook(path, {}, extent, kMars, params), "absent.tif");
  params.ortho = ortho(form);
  assert_refused(write_quicklook(path, {}, extent, "EPSG:32633", params), "EPSG:32633");
  assert_refused(write_quicklook(path, {}, {0.0, 0.0, 1.0, 1.0}, kMars, params),
                 "does not overlap the mapped area");
  assert_refused(write_quicklook(scratch.path("no") / "x/q.png", {}, extent, kMars, params), "folder");
  params.band = 2;
  assert_refused(write_quicklook(path, {}, extent, kMars, params), "has no band 2");
  params.band = 0;
  params.max_side_px = 10;
  assert_refused(write_quicklook(path, {}, extent, kMars, params), "--max-side");
  assert_refused(write_quicklook(path, {}, {0.0, 0.0, 0.0, 1.0}, kMars), "covers no area");
  fs::resize_file(ortho(form), 100000);
  params = {};
  params.ortho = scratch.path("ortho.tif");
  assert_refused(write_quicklook(path, {}, extent, kMars, params), "ortho.tif");
  assert_true(fs::is_empty(scratch.path("refused/q.png").parent_path()));
}

/// What is drawn stays on the canvas.
void test_canvas_at_its_rim(void**) {
  Canvas canvas(20, 10);
  canvas.circle(-3.0, 5.0, 4.0, 2.0, {255, 255, 255});
  canvas.circle(1e9, 1e9, 4.0, 2.0, {255, 255, 255});
  canvas.circle(10.0, 5.0, 1e9, 2.0, {255, 255, 255});
  canvas.rectangle(-5, 8, 100, 100, {1, 2, 3});
  canvas.text(16, -2, "8a.", {255, 0, 0}, 3);
  canvas.mix(-1, 3, {9, 9, 9}, 1.0);
  assert_true(canvas.at(2, 5)[0] > 200);
  assert_int_equal(canvas.at(12, 5)[0], 0);
  assert_int_equal(canvas.at(3, 9)[2], 3);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_circles_and_place),  cmocka_unit_test(test_sizes),
      cmocka_unit_test(test_without_orthoimage), cmocka_unit_test(test_cut_to_the_map),
      cmocka_unit_test(test_refusals),           cmocka_unit_test(test_canvas_at_its_rim),
  };
  return cmocka_run_group_tests_name("ground_tools/map/quicklook", tests, nullptr, nullptr);
}
