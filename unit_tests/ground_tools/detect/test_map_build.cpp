// Boulders of an image in tiles: the same table to the bit whatever the tiles and threads, and however often
// the build was stopped.
#include "detect/map_build.hpp"

#include <gdal_priv.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>

#include "core/random.hpp"
#include "ground_tools/raster_in_memory.hpp"
#include "ground_tools/scratch.hpp"
#include "ground_tools/test_images.hpp"

using namespace cairn;
using namespace cairn::ground;
using test::Raster;
using test::read_orthoimage;

namespace {

const test::Scratch scratch;
constexpr int kWidth = 900;
constexpr int kHeight = 700;
std::vector<int> field;  ///< grey of a boulder field, 0 to 255
std::string whole;       ///< the table of the whole image at once
const MpiRanks alone;

/// Noisy ground with dark blobs of all sizes, one of them winding through the image.
int setup(void**) {
  Random random(11);
  field.resize(static_cast<std::size_t>(kWidth) * kHeight);
  const auto at = [](int x, int y) {
    return static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(x);
  };
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) field[at(x, y)] = 110 + x / 20 + static_cast<int>(random.below(21)) - 10;
  for (int i = 0; i < 250; ++i) {
    const int cx = static_cast<int>(random.below(kWidth));
    const int cy = static_cast<int>(random.below(kHeight));
    const int r = 3 + static_cast<int>(random.below(i < 5 ? 60 : 12));
    for (int y = std::max(0, cy - r); y < std::min(kHeight, cy + r); ++y)
      for (int x = std::max(0, cx - r); x < std::min(kWidth, cx + 2 * r); ++x)
        if ((x - cx) * (x - cx) / 4 + (y - cy) * (y - cy) < r * r) field[at(x, y)] = 40;
  }
  for (int x = 0; x < kWidth; ++x)
    for (int t = 0; t < 7; ++t)
      field[at(x, std::clamp(350 + static_cast<int>(250 * std::sin(0.02 * x)) + t, 0, kHeight - 1))] = 30;
  return 0;
}

int grey(int, int x, int y) {
  return field[static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(x)];
}

int sixteen(int x, int y) { return 3000 + 97 * grey(0, x, y) + (31 * x + 17 * y) % 97; }

enum class Shape { kStrips, kTiled, kSixteen, kReal, kHoles, kAlpha };

std::filesystem::path image(const char* name, Shape shape) {
  GDALAllRegister();
  const std::filesystem::path path = scratch.path(name);
  const GDALDataType type = shape == Shape::kSixteen ? GDT_UInt16
                            : shape == Shape::kReal  ? GDT_Float32
                                                     : GDT_Byte;
  const int bands = shape == Shape::kAlpha ? 2 : 1;
  const char* options[] = {shape == Shape::kTiled ? "TILED=YES" : "TILED=NO", "BLOCKXSIZE=256",
                           "BLOCKYSIZE=16", shape == Shape::kAlpha ? "ALPHA=YES" : nullptr, nullptr};
  const std::unique_ptr<GDALDataset> data(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      path.c_str(), kWidth, kHeight, bands, type, const_cast<char**>(options)));
  double geo[6] = {500.0, 0.02, 0.0, 80.0, 0.0, -0.02};
  data->SetGeoTransform(geo);
  if (shape == Shape::kHoles) data->GetRasterBand(1)->SetNoDataValue(0.0);
  std::vector<double> row(kWidth);
  std::vector<std::uint8_t> alpha(kWidth, 255);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      double value = grey(0, x, y);
      if (shape == Shape::kSixteen) value = sixteen(x, y);
      if (shape == Shape::kReal) value = 0.01 + 1e-4 * value;
      const bool hole = (x / 90 + y / 70) % 5 == 0;
      if (shape == Shape::kHoles && hole) value = 0.0;
      alpha[static_cast<std::size_t>(x)] = hole ? 0 : 255;
      row[static_cast<std::size_t>(x)] = value;
    }
    assert_int_equal(data->GetRasterBand(1)->RasterIO(GF_Write, 0, y, kWidth, 1, row.data(), kWidth, 1,
                                                      GDT_Float64, 0, 0, nullptr),
                     CE_None);
    if (bands == 2)
      assert_int_equal(data->GetRasterBand(2)->RasterIO(GF_Write, 0, y, kWidth, 1, alpha.data(), kWidth, 1,
                                                        GDT_Byte, 0, 0, nullptr),
                       CE_None);
  }
  return path;
}

std::string table(const RasterSource& source, const BuildSettings& settings,
                  const Detection& detection = {}) {
  MapBuild build(source, detection, settings, alone);
  std::string text;
  for (const TableBoulder& b : build.run()) {  // every bit
    text += fmt::format("{:a} {:a} {:a} {:a} {:a} {:a} {:a} {:a}\n", b.p_map_m.x(), b.p_map_m.y(),
                        b.diameter_m, b.area_m2, b.contrast, b.elongation, b.height_m, b.confidence);
  }
  return text;
}

void check_tiles(const RasterSource& source, const Detection& detection = {}) {
  BuildSettings one;
  one.threads = 1;
  one.tile_px = 4096;
  whole = table(source, one, detection);
  assert_at_least(std::count(whole.begin(), whole.end(), '\n'), 50);
  for (const int tile : {0, 64, 100, 256, 512, 899}) {
    for (const int threads : {1, 2, 5}) {
      if (tile != 100 && threads == 5) continue;
      BuildSettings settings;
      settings.tile_px = tile;
      settings.threads = threads;
      if (table(source, settings, detection) != whole)
        fail_msg("tile %d, %d threads: another table", tile, threads);
    }
  }
}

void test_the_same_in_any_tiles(void**) {
  const struct {
    const char* name;
    Shape shape;
  } kImages[] = {{"strips.tif", Shape::kStrips},   {"tiled.tif", Shape::kTiled},
                 {"sixteen.tif", Shape::kSixteen}, {"real.tif", Shape::kReal},
                 {"holes.tif", Shape::kHoles},     {"alpha.tif", Shape::kAlpha}};
  for (const auto& each : kImages) {
    const std::unique_ptr<RasterSource> source = open_orthoimage(image(each.name, each.shape));
    check_tiles(*source);
  }
}

void test_shadow_method_in_any_tiles(void**) {
  const std::unique_ptr<RasterSource> source = open_orthoimage(image("sun.tif", Shape::kStrips));
  Detection detection;
  detection.method = cmap::Method::kShadow;
  detection.sun = {0.8, 4.7};
  detection.shadow.max_diameter_m = 0.3;
  detection.shadow.min_confidence = 0.05;
  BuildSettings settings;
  settings.tile_px = 4096;
  whole = table(*source, settings, detection);
  assert_at_least(std::count(whole.begin(), whole.end(), '\n'), 10);
  for (const int tile : {200, 512}) {
    settings.tile_px = tile;
    settings.threads = 2;
    assert_true(table(*source, settings, detection) == whole);
  }
}

/// Files and memory, strips and holes: the same pixels give the same table.
void test_the_same_from_memory(void**) {
  for (const Shape shape : {Shape::kTiled, Shape::kHoles}) {
    const std::filesystem::path path = image("memory.tif", shape);
    const Raster raster = read_orthoimage(path);
    BuildSettings settings;
    settings.tile_px = 128;
    const std::unique_ptr<RasterSource> file = open_orthoimage(path);
    const std::unique_ptr<RasterSource> memory = view_of(raster);
    assert_true(table(*file, settings) == table(*memory, settings));
    assert_int_equal(detect_boulders(raster, {}).size(), [&] {
      const std::string text = table(*memory, settings);
      return std::count(text.begin(), text.end(), '\n');
    }());
  }
}

/// Against the values sorted.
void test_percentiles_are_exact(void**) {
  const std::unique_ptr<RasterSource> source = open_orthoimage(image("p.tif", Shape::kSixteen));
  const std::unique_ptr<RasterReader> reader = source->reader();
  std::vector<int> sorted;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) sorted.push_back(sixteen(x, y));
  std::sort(sorted.begin(), sorted.end());
  const auto rank = [&](double share) {
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
  };
  for (const PixelDepth depth : {PixelDepth::kSixteen, PixelDepth::kReal}) {
    GreyRangeSearch search(depth);
    const PixelBox parts[] = {{0, 0, 300, kHeight}, {300, 0, kWidth, 200}, {300, 200, kWidth, kHeight}};
    for (const PixelBox& part : parts) search.add_values(count_values(*reader, depth, part));
    search.finish_values("p.tif");
    assert_true(search.needs_lower_halves() == (depth == PixelDepth::kReal));
    if (search.needs_lower_halves())
      for (const PixelBox& part : parts)
        search.add_lower_halves(count_lower_halves(*reader, search.bins(), part));
    const GreyRange range = search.finish("p.tif");
    assert_near(range.low, rank(0.001), 0.0);
    assert_near(range.high, rank(0.999), 0.0);
  }
}

/// An image of given values.
struct Values final : RasterReader {
  std::vector<float> values;

  bool read(const PixelBox&, const GreyRange&, std::uint8_t*, std::uint8_t*, int) override { return false; }
  bool read_values(const PixelBox&, float* to, std::uint8_t*) override {
    std::copy(values.begin(), values.end(), to);
    return false;
  }
};

GreyRange range_of_values(Values& image, PixelDepth depth) {
  const PixelBox all{0, 0, static_cast<int>(image.values.size()), 1};
  GreyRangeSearch search(depth);
  search.add_values(count_values(image, depth, all));
  search.finish_values("values");
  if (search.needs_lower_halves()) search.add_lower_halves(count_lower_halves(image, search.bins(), all));
  return search.finish("values");
}

/// Some pixels far below zero or far above all others change nothing of the stretch, however many they are;
/// black among bright ground belongs to it.
void test_values_where_no_brightness_is(void**) {
  for (const PixelDepth depth : {PixelDepth::kSixteen, PixelDepth::kReal}) {
    Values plain;
    for (int i = 0; i < 100000; ++i) plain.values.push_back(static_cast<float>(1000 + i * 7919 % 997));
    const GreyRange range = range_of_values(plain, depth);
    for (const std::size_t count : {1U, 300U, 15000U}) {
      for (const std::vector<float>& far :
           {std::vector<float>{-9999.0F}, {30000.0F}, {-9999.0F, -32768.0F}, {-9999.0F, 30000.0F}}) {
        Values holes;
        holes.values = plain.values;
        for (const float value : far) holes.values.insert(holes.values.end(), count, value);
        const GreyRange same = range_of_values(holes, depth);
        assert_near(same.low, range.low, 0.0);
        assert_near(same.high, range.high, 0.0);
      }
    }
    Values shadows;
    shadows.values.assign(300, 0.0F);
    for (int i = 0; i < 100000; ++i) shadows.values.push_back(static_cast<float>(1000 + i % 50));
    assert_near(range_of_values(shadows, depth).low, 0.0, 0.0);
    shadows.values.insert(shadows.values.end(), 300, -9999.0F);
    assert_near(range_of_values(shadows, depth).low, 0.0, 0.0);
    Values two;
    two.values = {-5.0F, -5.0F, 7.0F, 7.0F};
    assert_near(range_of_values(two, depth).low, -5.0, 0.0);
  }
}

/// Stopped again and again, each time after a tile or two; a torn record in between.
void test_goes_on_to_the_same_table(void**) {
  for (const Shape shape : {Shape::kTiled, Shape::kReal}) {
    const std::unique_ptr<RasterSource> source = open_orthoimage(image("stop.tif", shape));
    BuildSettings settings;
    settings.threads = 1;
    settings.tile_px = 200;
    whole = table(*source, settings);
    settings.state = scratch.path("stop.part");
    std::filesystem::remove(settings.state);
    int stops = 0;
    int asked = 0;
    std::string went_on;
    settings.stop = [&] { return ++asked > 2; };
    settings.say = [&](const std::string& line) { went_on = line; };
    static std::string text;
    for (text.clear(); text.empty(); asked = 0) {
      if (stops > 0 && stops % 7 == 0) std::ofstream(settings.state, std::ios::app) << "torn";
      try {
        text = table(*source, settings);
      } catch (const ToolError& error) {
        assert_true(std::string(error.what()).find("to resume from") != std::string::npos);
        assert_true(std::filesystem::exists(settings.state));
        ++stops;
      }
    }
    assert_at_least(stops, 5);
    assert_true(went_on.find("resuming") != std::string::npos);
    assert_true(text == whole);

    settings.stop = {};
    Detection other;
    other.otsu.min_area_px = 400;
    static std::string fewer;
    fewer = table(*source, settings, other);
    assert_true(went_on.find("starting over") != std::string::npos);
    assert_true(fewer.size() < whole.size());
  }
}

void test_progress_and_stop_without_state(void**) {
  const std::unique_ptr<RasterSource> source = open_orthoimage(image("p2.tif", Shape::kReal));
  BuildSettings settings;
  settings.tile_px = 300;
  double last = 0.0;
  settings.done = [&](double share) {
    assert_true(share >= last && share <= 1.0);
    last = share;
  };
  table(*source, settings);
  assert_near(last, 1.0, 1e-12);
  settings.done = {};
  settings.stop = [] { return true; };
  assert_refused(table(*source, settings), "nothing was written");
}

void test_refusals(void**) {
  static std::unique_ptr<RasterSource> source;
  source = open_orthoimage(image("r.tif", Shape::kTiled));
  static BuildSettings settings;
  settings.tile_px = 5;
  assert_refused(table(*source, settings), "--tile");
  settings.tile_px = 0;
  settings.threads = -1;
  assert_refused(table(*source, settings), "--threads");
  settings.threads = 0;
  static Detection detection;
  detection.otsu.background_m = 100.0;
  assert_refused(table(*source, settings, detection), "--background");
  // A file that is cut while it is read: told, and no state stays.
  static std::filesystem::path path;
  path = image("cut.tif", Shape::kStrips);
  source = open_orthoimage(path);
  std::filesystem::resize_file(path, 300000);
  settings.state = scratch.path("cut.part");
  settings.tile_px = 128;
  assert_refused(table(*source, settings), "cut.tif");
  assert_false(std::filesystem::exists(settings.state));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_the_same_in_any_tiles),
      cmocka_unit_test(test_shadow_method_in_any_tiles),
      cmocka_unit_test(test_the_same_from_memory),
      cmocka_unit_test(test_percentiles_are_exact),
      cmocka_unit_test(test_values_where_no_brightness_is),
      cmocka_unit_test(test_goes_on_to_the_same_table),
      cmocka_unit_test(test_progress_and_stop_without_state),
      cmocka_unit_test(test_refusals),
  };
  return cmocka_run_group_tests_name("ground_tools/detect/map_build", tests, setup, nullptr);
}
