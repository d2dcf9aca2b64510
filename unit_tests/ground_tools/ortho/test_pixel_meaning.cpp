// What the values of an image mean: palettes, negatives, special pixels, no-data that nothing marks.
#include "ortho/pixel_meaning.hpp"

#include <fmt/format.h>
#include <gdal_priv.h>

#include <cstring>
#include <functional>

#include "ground_tools/raster_in_memory.hpp"
#include "ground_tools/scratch.hpp"

using namespace cairn;
using namespace cairn::ground;
using test::Raster;
using test::read_orthoimage;

namespace {

const test::Scratch scratch;
Raster raster;

using Value = std::function<double(int band, int x, int y)>;
using Finish = std::function<void(GDALDataset&)>;

/// A file of `side` pixels of 0.5 m each way.
std::string image(const char* name, const char* driver, GDALDataType type, int bands, int side,
                  const Value& value, const Finish& finish = {}, const char* option = nullptr) {
  GDALAllRegister();
  const std::string path = scratch.path(name).string();
  const char* const options[] = {option, nullptr};
  const std::unique_ptr<GDALDataset> data(GetGDALDriverManager()->GetDriverByName(driver)->Create(
      path.c_str(), side, side, bands, type, const_cast<char**>(options)));
  assert_non_null(data.get());
  double geo[6] = {100.0, 0.5, 0.0, 200.0, 0.0, -0.5};
  data->SetGeoTransform(geo);
  if (finish) finish(*data);
  for (int b = 0; b < bands; ++b) {
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        double v = value(b, x, y);
        assert_int_equal(
            data->GetRasterBand(b + 1)->RasterIO(GF_Write, x, y, 1, 1, &v, 1, 1, GDT_Float64, 0, 0, nullptr),
            CE_None);
      }
    }
  }
  return path;
}

int grey(int x, int y) { return raster.grey_view().at(x, y); }
bool missing(int x, int y) { return !raster.valid.empty() && raster.valid_view().at(x, y) == 0; }

float special(std::uint32_t bits) {
  float value = 0.0F;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

double index_of(int, int x, int y) { return (x + y) % 4; }

void test_palette(void**) {
  raster = read_orthoimage(image("palette.tif", "GTiff", GDT_Byte, 1, 8, index_of, [](GDALDataset& data) {
    GDALColorTable table;  // bright to dark, one in colour
    const GDALColorEntry entries[] = {
        {250, 250, 250, 255}, {120, 150, 180, 255}, {90, 90, 90, 255}, {3, 3, 3, 255}};
    for (int i = 0; i < 4; ++i) table.SetColorEntry(i, &entries[i]);
    data.GetRasterBand(1)->SetColorTable(&table);
  }));
  assert_int_equal(grey(0, 0), 250);
  assert_int_equal(grey(1, 0), 150);
  assert_int_equal(grey(2, 0), 90);
  assert_int_equal(grey(3, 0), 3);
  assert_false(missing(0, 0));
}

double ramp(int, int x, int y) { return 10 * y + x; }

void test_min_is_white(void**) {
  const char* const white = "PHOTOMETRIC=MINISWHITE";
  raster = read_orthoimage(image("white.tif", "GTiff", GDT_Byte, 1, 8, ramp, {}, white));
  assert_int_equal(grey(0, 0), 255);
  assert_int_equal(grey(3, 7), 255 - 73);
  raster = read_orthoimage(image("white16.tif", "GTiff", GDT_UInt16, 1, 8, ramp, {}, white));
  assert_int_equal(grey(0, 0), 255);
  assert_int_equal(grey(7, 7), 0);
}

void test_negative_scale(void**) {
  const Finish turn = [](GDALDataset& data) { data.GetRasterBand(1)->SetScale(-0.5); };
  raster = read_orthoimage(image("scale.tif", "GTiff", GDT_Int16, 1, 8, ramp, turn));
  assert_int_equal(grey(0, 0), 255);
  assert_int_equal(grey(7, 7), 0);
  const Finish none = [](GDALDataset& data) { data.GetRasterBand(1)->SetScale(0.0); };
  assert_refused(read_orthoimage(image("scale0.tif", "GTiff", GDT_Int16, 1, 8, ramp, none)),
                 "scale of band 1");
}

/// Row 0: Null, LRS, LIS, HIS, HRS; below a ramp that alone sets the stretch.
void check_special(const std::string& path) {
  raster = read_orthoimage(path);
  assert_true(missing(0, 0));
  for (int x = 1; x < 5; ++x) assert_false(missing(x, 0));
  assert_int_equal(grey(1, 0), 0);
  assert_int_equal(grey(2, 0), 0);
  assert_int_equal(grey(3, 0), 255);
  assert_int_equal(grey(4, 0), 255);
  assert_int_equal(grey(5, 0), 0);
  assert_int_equal(grey(7, 7), 255);
  assert_in_range(grey(0, 4), 90, 160);
}

void test_special_pixels(void**) {
  const Value whole = [](int, int x, int y) { return y == 0 && x < 5 ? -32768.0 + x : 1000.0 + 100 * y + x; };
  const Value real = [](int, int x, int y) {
    return y == 0 && x < 5 ? static_cast<double>(special(0xFF7FFFFBU + static_cast<std::uint32_t>(x)))
                           : 0.1 + 0.01 * y + 0.001 * x;
  };
  const double null = static_cast<double>(special(0xFF7FFFFBU));
  check_special(image("i16.cub", "ISIS3", GDT_Int16, 1, 8, whole));
  check_special(image("real.cub", "ISIS3", GDT_Float32, 1, 8, real));
  check_special(image("i16.tif", "GTiff", GDT_Int16, 1, 8, whole,
                      [](GDALDataset& data) { data.GetRasterBand(1)->SetNoDataValue(-32768.0); }));
  check_special(image("real.tif", "GTiff", GDT_Float32, 1, 8, real,
                      [&](GDALDataset& data) { data.GetRasterBand(1)->SetNoDataValue(null); }));
}

/// A cube's special pixels by the mask that GDAL writes beside a copy of it: all of them missing.
void test_special_pixels_of_a_masked_copy(void**) {
  const Value whole = [](int, int x, int y) { return y == 0 && x < 5 ? -32768.0 + x : 1000.0 + 100 * y + x; };
  const Value unsigned_whole = [](int, int x, int y) {
    constexpr double kRow[] = {0, 1, 2, 65534, 65535};
    return y == 0 && x < 5 ? kRow[x] : 1000.0 + 100 * y + x;
  };
  const Value real = [](int, int x, int y) {
    return y == 0 && x < 5 ? static_cast<double>(special(0xFF7FFFFBU + static_cast<std::uint32_t>(x)))
                           : 0.1 + 0.01 * y + 0.001 * x;
  };
  const std::string cubes[] = {image("whole.cub", "ISIS3", GDT_Int16, 1, 8, whole),
                               image("natural.cub", "ISIS3", GDT_UInt16, 1, 8, unsigned_whole),
                               image("real2.cub", "ISIS3", GDT_Float32, 1, 8, real)};
  for (const std::string& cube : cubes) {
    for (const char* driver : {"GTiff", "VRT"}) {
      if (&cube == &cubes[1] && driver[0] == 'V') continue;  // keeps no label, and 0 alone says nothing
      const std::string copy =
          scratch.path(std::string("copy.") + (driver[0] == 'V' ? "vrt" : "tif")).string();
      std::unique_ptr<GDALDataset> from(GDALDataset::Open(cube.c_str(), GDAL_OF_RASTER));
      std::unique_ptr<GDALDataset> to(GetGDALDriverManager()->GetDriverByName(driver)->CreateCopy(
          copy.c_str(), from.get(), 0, nullptr, nullptr, nullptr));
      assert_non_null(to.get());
      to->CreateMaskBand(GMF_PER_DATASET);
      const std::uint8_t none[5] = {};
      std::uint8_t all[64];
      std::memset(all, 255, sizeof all);
      std::memcpy(all, none, sizeof none);
      if (driver[0] == 'G') {
        assert_int_equal(to->GetRasterBand(1)->GetMaskBand()->RasterIO(GF_Write, 0, 0, 8, 8, all, 8, 8,
                                                                       GDT_Byte, 0, 0, nullptr),
                         CE_None);
      }
      to.reset();
      from.reset();
      check_special(copy);
    }
  }
}

/// -128 is black, whatever GDAL makes of the sign.
void test_signed_bytes(void**) {
  const Value value = [](int, int x, int y) { return (10 * y + x + 128 + 90) % 256; };  // -38 on
  const auto check = [](const std::string& path, const NoDataChoice& no_data) {
    raster = read_orthoimage(path, 0, no_data);
    assert_int_equal(grey(1, 0), 128 - 37);
    assert_int_equal(grey(7, 7), 128 + 39);
    assert_true(missing(0, 0));
  };
  const std::string path = image("signed.tif", "GTiff", GDT_Byte, 1, 8, value, {}, "PIXELTYPE=SIGNEDBYTE");
  check(path, {-38.0, true});
  check(image(
            "signed_tagged.tif", "GTiff", GDT_Byte, 1, 8, value,
            [](GDALDataset& data) { data.GetRasterBand(1)->SetNoDataValue(-38.0); }, "PIXELTYPE=SIGNEDBYTE"),
        {});
  std::string bytes;
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) bytes += static_cast<char>(static_cast<unsigned char>(value(0, x, y)));
  }
  scratch.file("signed.img", bytes);
  for (const char* order : {"MSB_", "LSB_", ""}) {
    const std::string label = fmt::format(
        "PDS_VERSION_ID = PDS3\r\nRECORD_TYPE = FIXED_LENGTH\r\nRECORD_BYTES = 8\r\nFILE_RECORDS = 8\r\n"
        "^IMAGE = \"signed.img\"\r\nOBJECT = IMAGE\r\nLINES = 8\r\nLINE_SAMPLES = 8\r\nSAMPLE_TYPE = {}INTEGER\r\n"
        "SAMPLE_BITS = 8\r\nBANDS = 1\r\nMISSING_CONSTANT = -38\r\nEND_OBJECT = IMAGE\r\n"
        "OBJECT = IMAGE_MAP_PROJECTION\r\nMAP_PROJECTION_TYPE = \"EQUIRECTANGULAR\"\r\nA_AXIS_RADIUS = 3396.19 <KM>\r\n"
        "B_AXIS_RADIUS = 3396.19 <KM>\r\nC_AXIS_RADIUS = 3396.19 <KM>\r\nCENTER_LATITUDE = 0.0 <DEG>\r\n"
        "CENTER_LONGITUDE = 0.0 <DEG>\r\nMAP_RESOLUTION = 592746.0\r\nMAP_SCALE = 0.0001 <KM/PIXEL>\r\n"
        "LINE_PROJECTION_OFFSET = 8.5\r\nSAMPLE_PROJECTION_OFFSET = 0.5\r\nEND_OBJECT = IMAGE_MAP_PROJECTION\r\nEND\r\n",
        order);
    check(scratch.file("signed.lbl", label).string(), {});
  }
}

void test_special_pixels_of_a_label(void**) {
  const Value value = [](int, int x, int y) {
    constexpr double kRow[] = {0, 1, 2, 1022, 1023};
    return y == 0 && x < 5 ? kRow[x] : 300.0 + 10 * y + x;
  };
  const std::string path = image("hirise.tif", "GTiff", GDT_UInt16, 1, 8, value);
  scratch.file(
      "hirise.LBL",
      "PDS_VERSION_ID = PDS3\r\nSAMPLE_BITS = 16\r\nCORE_NULL = 0\r\nCORE_LOW_REPR_SATURATION = 1\r\n"
      "CORE_LOW_INSTR_SATURATION = 2\r\nCORE_HIGH_REPR_SATURATION = 16#3FF#\r\n"
      "CORE_HIGH_INSTR_SATURATION = 1022\r\nEND\r\n");
  check_special(path);
  // A copy of 8 bits beside the label of 16 has values of its own.
  image("hirise.tif", "GTiff", GDT_Byte, 1, 8, ramp);
  raster = read_orthoimage(path);
  assert_false(missing(0, 0));
  std::filesystem::remove(scratch.path("hirise.LBL"));
}

void test_colour_with_no_data(void**) {
  const Value value = [](int b, int x, int y) {
    if (x == 0) return 0.0;                        // no data
    return x == 1 && b == 0 ? 0.0 : 30.0 + b + y;  // a bluish shadow in column 1
  };
  raster = read_orthoimage(image("rgb.tif", "GTiff", GDT_Byte, 3, 8, value, [](GDALDataset& data) {
    for (int b = 1; b <= 3; ++b) data.GetRasterBand(b)->SetNoDataValue(0.0);
  }));
  for (int y = 0; y < 8; ++y) {
    assert_true(missing(0, y));
    for (int x = 1; x < 8; ++x) assert_false(missing(x, y));
  }
  assert_int_equal(grey(1, 0), (0 + 31 + 32) / 3);
}

constexpr int kSide = 128;

std::vector<std::string> remarks_of(const std::string& path, const NoDataChoice& choice = {}) {
  return open_orthoimage(path, 0, choice)->facts().remarks;
}

void test_unmarked_values(void**) {
  const auto ground = [](int x, int y) { return 90.0 + (37 * x + 91 * y + x * y) % 100; };
  // A corner of -9999 far below the rest: no data.
  static std::string path;
  path = image("sentinel.tif", "GTiff", GDT_Int16, 1, kSide,
               [&](int, int x, int y) { return x + y < 40 ? -9999.0 : ground(x, y); });
  raster = read_orthoimage(path);
  assert_true(missing(0, 0) && missing(39, 0) && !missing(40, 0));
  assert_int_equal(remarks_of(path).size(), 1);
  assert_true(remarks_of(path)[0].find("-9999") != std::string::npos);
  assert_true(remarks_of(path, {std::nullopt, false}).empty());
  // A white collar of 8 bits.
  raster = read_orthoimage(image("white_collar.tif", "GTiff", GDT_Byte, 1, kSide,
                                 [&](int, int x, int y) { return x + y < 40 ? 255.0 : ground(x, y); }));
  assert_true(missing(0, 0) && !missing(40, 0));
  // In the middle it may be snow: told alone.
  path = image("snow.tif", "GTiff", GDT_Byte, 1, kSide, [&](int, int x, int y) {
    return std::abs(x - 64) + std::abs(y - 64) < 30 ? 255.0 : ground(x, y);
  });
  raster = read_orthoimage(path);
  assert_true(raster.valid.empty());
  assert_true(remarks_of(path).at(0).find("--no-data 255") != std::string::npos);
  assert_true(open_orthoimage(path, 0, {255.0, true})->facts().remarks.empty());
  // Nothing to say of an ordinary picture.
  path = image("plain.tif", "GTiff", GDT_Byte, 1, kSide, [&](int, int x, int y) { return ground(x, y); });
  assert_true(remarks_of(path).empty() && open_orthoimage(path)->facts().all_valid);
}

/// Zero marked as no data takes black shadows away, which is told; a collar alone is none.
void test_black_shadows_as_no_data(void**) {
  const auto with = [](bool shadows) {
    return remarks_of(image(
        "black.tif", "GTiff", GDT_Byte, 1, kSide,
        [&](int, int x, int y) {
          const bool shadow = shadows && x % 32 < 4 && y % 32 < 3;
          return shadow || x + y < 60 || x + 2 * y > 350 ? 0.0 : 60.0 + (7 * x + 13 * y) % 90;
        },
        [](GDALDataset& data) { data.GetRasterBand(1)->SetNoDataValue(0.0); }));
  };
  assert_true(with(false).empty());
  assert_int_equal(with(true).size(), 1);
  assert_true(with(true)[0].find("-unsetnodata") != std::string::npos);
}

/// Holes of a value where no brightness is, whatever their size and place; both ends at once.
void test_unmarked_holes(void**) {
  const auto ground = [](int x, int y) { return 90.0 + (37 * x + 91 * y + x * y) % 100; };
  for (const GDALDataType type : {GDT_Int16, GDT_Float32}) {
    for (const double most : {32767.0, 189.0}) {
      raster = read_orthoimage(image("holes.tif", "GTiff", type, 1, kSide, [&](int, int x, int y) {
        if (std::abs(x - 60) + std::abs(y - 60) < 6) return -9999.0;
        return y > 120 && x > 120 ? most : ground(x, y);
      }));
      assert_true(missing(60, 60) && missing(60, 55) && !missing(60, 54) && !missing(0, 0));
      assert_int_equal(missing(125, 125), most > 200.0);
      assert_in_range(grey(0, 0), 0, 2);  // ground's least: the stretch is of ground alone
    }
  }
  // Shadows without any light are zero, and far from a flat ground: as they are, and told.
  raster = read_orthoimage(image("unlit.tif", "GTiff", GDT_Float32, 1, kSide, [&](int, int x, int y) {
    return x % 16 < 3 && y % 16 < 3 ? 0.0 : 0.3 + 1e-4 * ground(x, y);
  }));
  assert_false(missing(3, 0) || missing(0, 0));
  assert_true(remarks_of(scratch.path("unlit.tif").string()).at(0).find("--no-data 0") != std::string::npos);
  // A value alone is a fault of the detector, and 8 bits have no room for such values.
  raster = read_orthoimage(image("hot.tif", "GTiff", GDT_Int16, 1, kSide, [&](int, int x, int y) {
    return x == 5 && y == 5 ? 30000.0 : ground(x, y);
  }));
  assert_false(missing(5, 5));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_palette),
      cmocka_unit_test(test_min_is_white),
      cmocka_unit_test(test_negative_scale),
      cmocka_unit_test(test_special_pixels),
      cmocka_unit_test(test_special_pixels_of_a_masked_copy),
      cmocka_unit_test(test_special_pixels_of_a_label),
      cmocka_unit_test(test_signed_bytes),
      cmocka_unit_test(test_colour_with_no_data),
      cmocka_unit_test(test_unmarked_values),
      cmocka_unit_test(test_unmarked_holes),
      cmocka_unit_test(test_black_shadows_as_no_data),
  };
  return cmocka_run_group_tests_name("ground_tools/ortho/pixel_meaning", tests, nullptr, nullptr);
}
