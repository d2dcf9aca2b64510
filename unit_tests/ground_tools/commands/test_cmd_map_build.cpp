// The program `cairn map build` itself: killed and started again, under mpirun, on every kind of file, and
// each bad input in one line that names it and the mend, with nothing half-written.
#include <gdal_priv.h>
#include <ogr_spatialref.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "base/boulder_table.hpp"
#include "base/json_file.hpp"
#include "base/number_table.hpp"
#include "core/random.hpp"
#include "core/trig.hpp"
#include "ground_tools/program.hpp"
#include "ground_tools/test_images.hpp"
#include "map/geopackage.hpp"
#include "support/data.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

namespace fs = std::filesystem;

const test::Scratch scratch;
test::Ended ended;

std::string file(const std::string& name) { return scratch.path(name).string(); }

int build(const std::string& arguments, const std::string& before = "") {
  ended = test::run_cairn(scratch, "map build " + arguments, before);
  return ended.code;
}

/// What it wrote on stdout.
std::string said() {
  const std::vector<std::uint8_t> bytes = read_file(scratch.path("stdout"));
  return {bytes.begin(), bytes.end()};
}

/// Bytes of what `name` and its table hold.
std::vector<std::uint8_t> products(const std::string& name) {
  std::vector<std::uint8_t> bytes = read_file(file(name + ".cmap"));
  const std::vector<std::uint8_t> table = read_file(file(name + ".csv"));
  bytes.insert(bytes.end(), table.begin(), table.end());
  return bytes;
}
std::string into(const std::string& name) {
  return " -o " + file(name + ".cmap") + " --csv " + file(name + ".csv");
}

int ground_level(int, int x, int y) {
  const auto hash = static_cast<unsigned>(x * 7919 + y * 104729);
  const int noise = static_cast<int>((hash ^ (hash >> 7) ^ (hash >> 13)) % 17);
  const int u = x % 90 - 45;
  const int v = y % 75 - 37 + x / 90 % 5;
  const int r = 6 + (x / 90 * 5 + y / 75 * 3) % 9;
  return u * u / 3 + v * v < r * r ? 35 + noise / 2 : 110 + noise;
}

constexpr int kSide = 1200;

void georeference(const fs::path& path, int epsg = 32633) {
  const std::unique_ptr<GDALDataset> data(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_UPDATE));
  double geo[6] = {500000.0, 0.02, 0.0, 80000.0, 0.0, -0.02};
  data->SetGeoTransform(geo);
  OGRSpatialReference system;
  system.importFromEPSG(epsg);
  data->SetSpatialRef(&system);
}

fs::path tiff(const char* name, int bands = 1, int side = kSide, int epsg = 32633) {
  const fs::path path = scratch.path(name);
  test::write_image(path, "GTiff", GDT_Byte, side, side, bands, ground_level);
  georeference(path, epsg);
  return path;
}

void convert(const fs::path& from, const char* driver, const fs::path& to) {
  GDALAllRegister();
  const std::unique_ptr<GDALDataset> data(GDALDataset::Open(from.c_str(), GDAL_OF_RASTER));
  const std::unique_ptr<GDALDataset> made(GetGDALDriverManager()->GetDriverByName(driver)->CreateCopy(
      to.c_str(), data.get(), 0, nullptr, nullptr, nullptr));
  assert_non_null(made.get());
}

/// The site in another system, pixels of `pixel_m` at (x, y) there.
std::string site_in(const char* name, const char* system, double x, double y, double pixel_m) {
  const fs::path path = tiff(name);
  const std::unique_ptr<GDALDataset> data(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_UPDATE));
  double geo[6] = {x, pixel_m, 0.0, y, 0.0, -pixel_m};
  data->SetGeoTransform(geo);
  OGRSpatialReference reference;
  reference.SetFromUserInput(system);
  data->SetSpatialRef(&reference);
  return path.string();
}

int setup(void**) {
  tiff("site.tif");
  assert_int_equal(build(file("site.tif") + into("whole")), 0);
  assert_at_least(read_csv(file("whole.csv")).size(), 100);
  return 0;
}

void test_options_that_change_nothing(void**) {
  for (const char* options : {" --tile 128", " --tile 333 --threads 3", " --threads 1 --method otsu"}) {
    assert_int_equal(build(file("site.tif") + into("again") + options), 0);
    assert_true(products("again") == products("whole"));
  }
}

void test_the_same_from_other_formats(void**) {
  convert(file("site.tif"), "VRT", file("site.vrt"));
  assert_int_equal(build(file("site.vrt") + into("vrt")), 0);
  assert_true(products("vrt") == products("whole"));
  GDALAllRegister();
  if (GetGDALDriverManager()->GetDriverByName("JP2OpenJPEG") == nullptr) {
    print_message("skipped: JPEG 2000, no driver\n");
    return;
  }
  convert(file("site.tif"), "JP2OpenJPEG", file("site.jp2"));  // with losses
  assert_int_equal(build(file("site.jp2") + into("jp2")), 0);
  const std::size_t found = read_csv(file("jp2.csv")).size();
  const std::size_t expected = read_csv(file("whole.csv")).size();
  assert_in_range(found, expected - expected / 20, expected + expected / 20);
}

void test_isis_cube(void**) {
  static std::string folder;
  folder = test::find_data("hirise");
  SKIP_WITHOUT(folder, "hirise");
  const std::string cube = folder + "/no_change_before.cub";  // real numbers, special pixels
  assert_int_equal(build(cube + " --method otsu" + into("cube")), 0);
  assert_int_equal(build(cube + " --method otsu --tile 100" + into("cube_tiles")), 0);
  assert_true(products("cube") == products("cube_tiles"));
  assert_int_equal(build(folder + "/no_change_before.tif --method otsu" + into("tif")), 0);
  const std::size_t found = read_csv(file("cube.csv")).size();
  assert_in_range(found, read_csv(file("tif.csv")).size() / 2, read_csv(file("tif.csv")).size() * 2);
}

/// Smaller boulders than usual must be asked for by name; larger ones asked for are those of the usual map.
void test_least_diameter(void**) {
  const std::string shadow = CAIRN_SOURCE_DIR "/unit_tests/integration/sample/ortho_5mm.tif --sun 45,135";
  assert_int_equal(build(shadow + into("usual")), 0);
  assert_int_equal(build(shadow + into("small") + " --min-diameter 0.06"), 0);
  assert_int_equal(build(shadow + into("large") + " --min-diameter 0.2"), 0);
  const std::vector<TableBoulder> usual = read_csv(file("usual.csv"));
  const std::vector<TableBoulder> small = read_csv(file("small.csv"));
  print_message("%zu boulders, smaller ones asked for %zu\n", usual.size(), small.size());
  assert_true(small.size() > usual.size());
  const auto large =
      std::count_if(usual.begin(), usual.end(), [](const auto& b) { return b.diameter_m >= 0.2; });
  assert_int_equal(read_csv(file("large.csv")).size(), large);
}

void test_sun_chooses_the_method(void**) {
  assert_int_equal(build(file("site.tif") + into("shadow") + " --sun 40,270"), 0);
  assert_true(said().find("method shadow") != std::string::npos);
  assert_true(products("shadow") != products("whole"));
  assert_int_equal(build(file("site.tif") + into("again") + " --sun 40,270 --method otsu"), 0);
  assert_true(products("again") == products("whole"));
  test::check_refusal(scratch, "map build " + file("site.tif") + into("no") + " --method shadow", "site.tif",
                      "--sun");
  test::check_refusal(scratch, "map build " + file("site.tif") + into("no") + " --sun 95,0", "--sun", "");
}

/// Where the image does not agree with its sun, or does not tell it, the map is made, and is in doubt in all
/// that is said of it; where it does, nothing is.
void test_a_sun_in_doubt(void**) {
  const std::string image = CAIRN_SOURCE_DIR "/unit_tests/integration/sample/ortho_5mm.tif";
  const std::string blank = file("site.tif");  // dark discs without a body: there is no direction in them
  const std::string json = " --quality " + file("doubt.json");
  const auto doubts = [&](const std::string& of, const std::string& sun) {
    assert_int_equal(build("'" + of + "' --sun " + sun + into("doubt") + json), 0);
    return read_json(file("doubt.json"), "a fault of ours").at("doubts").dump();
  };
  assert_true(doubts(image, "45,135").find("the other way round") == std::string::npos);
  assert_true(said().find("in doubt") == std::string::npos);
  assert_true(doubts(image, "45,315").find("the other way round") != std::string::npos);
  assert_true(said().find("from --sun, in doubt") != std::string::npos);
  assert_true(ended.errors.find("the other way round") != std::string::npos);
  assert_true(doubts(blank, "auto").find("does not clearly tell") != std::string::npos);
  assert_true(said().find("from the image itself, in doubt") != std::string::npos);
}

/// Killed at many moments, each time started again; then ended by a signal that it hears.
/// Mercator at 60 degrees of a sphere: 1 m of the map is half a metre. The same boulders, as far apart
/// and as large.
void test_metres_of_the_ground(void**) {
  const char* const mercator = "+proj=merc +R=3396190";
  const double y = 3396190.0 * std::log(std::tan(75.0 * kRadPerDeg));
  const std::string twice = site_in("twice.tif", mercator, 0.0, y, 0.04);
  const std::string picture = " --quicklook " + file("ground.png");  // the image as it looks in that plane
  assert_int_equal(build(twice + " --sun 45,135" + into("ground") + picture), 0);
  assert_true(fs::exists(file("ground.png")));
  assert_int_equal(build(file("site.tif") + " --sun-grid 45,135" + into("plain")), 0);
  const std::vector<TableBoulder> ground = read_csv(file("ground.csv"));
  const std::vector<TableBoulder> plain = read_csv(file("plain.csv"));
  assert_int_equal(ground.size(), plain.size());
  const Vec2 shift = ground[0].p_map_m - plain[0].p_map_m;
  for (std::size_t i = 0; i < plain.size(); ++i) {
    assert_near((ground[i].p_map_m - plain[i].p_map_m - shift).norm(), 0.0, 0.005);
    assert_near(ground[i].diameter_m, plain[i].diameter_m, 1e-3);
  }
  assert_int_equal(build(twice + " --sun 45,135 --scale projection" + into("kept")), 0);
  assert_true(ended.errors.find("0.5000 m of ground") != std::string::npos);
  assert_near(read_csv(file("kept.csv"))[0].diameter_m, 2.0 * plain[0].diameter_m, 2e-3);
  // A table of the same system.
  assert_int_equal(
      build("--from-csv " + file("kept.csv") + " -o " + file("table.cmap") + " --csv " + file("table.csv")),
      0);
  const std::vector<TableBoulder> table = read_csv(file("table.csv"));
  assert_near((table.back().p_map_m - table.front().p_map_m).norm(),
              (ground.back().p_map_m - ground.front().p_map_m).norm(), 0.02);
}

void test_killed_and_started_again(void**) {
  const std::string state = file("killed.cmap.part");
  const std::string arguments = file("site.tif") + into("killed") + " --tile 64 --threads 1 --state " + state;
  int killed = 0;
  for (int delay_ms = 20; delay_ms < 4000; delay_ms += delay_ms / 4 + 5) {
    fs::remove(file("killed.cmap"));
    const std::string limit = "timeout -s KILL " + std::to_string(delay_ms / 1000) + "." +
                              std::to_string(1000 + delay_ms % 1000).substr(1) + " ";
    if (build(arguments, limit) == 0) break;
    ++killed;
    // Whole where it is there: the last thing before the end is to take the state away.
    if (fs::exists(file("killed.cmap")))
      assert_true(read_file(file("killed.cmap")) == read_file(file("whole.cmap")));
  }
  assert_int_equal(build(arguments), 0);
  assert_true(products("killed") == products("whole"));
  assert_false(fs::exists(state));
  print_message("killed %d times\n", killed);
}

void test_full_disk(void**) {
  const std::string limit = "trap '' XFSZ; ulimit -f 4; ";
  fs::create_directory(scratch.path("full"));
  const std::string state = file("full/site.part");
  assert_int_equal(
      build(file("site.tif") + " --tile 64 -o " + file("full/site.cmap") + " --state " + state, limit), 1);
  assert_true(test::is_one_line(ended.errors));
  assert_true(ended.errors.find("site.part: writing failed") != std::string::npos);
  // What is whole stays, and is gone on from.
  assert_int_equal(build(file("site.tif") + " --tile 64 -o " + file("full/site.cmap") + " --state " + state),
                   0);
  assert_true(read_file(file("full/site.cmap")) == read_file(file("whole.cmap")));
  fs::remove(file("full/site.cmap"));
  assert_int_equal(
      build(file("site.tif") + " -o " + file("full/site.cmap") + " --csv " + file("full/site.csv"), limit),
      1);
  assert_true(test::is_one_line(ended.errors));
  assert_true(fs::is_empty(scratch.path("full")));
}

/// Only what is asked for may lie in the folder afterwards: nothing.
void check_bad(const std::string& image, const char* what, const char* mend,
               const std::string& options = "") {
  fs::create_directories(scratch.path("bad").parent_path() / "bad");
  test::check_refusal(scratch, "map build " + image + " -o " + file("bad/site.cmap") + options, what, mend);
  assert_true(fs::is_empty(scratch.path("bad")));
}

void test_bad_images(void**) {
  check_bad(file("absent.tif"), "absent.tif", "check the name");
  test::write_image(scratch.path("bare.tif"), "GTiff", GDT_Byte, 50, 50, 1, ground_level);
  check_bad(file("bare.tif"), "bare.tif", "geo-reference");
  tiff("degrees.tif", 1, 50, 4326);
  check_bad(file("degrees.tif"), "degrees.tif", "gdalwarp");
  test::write_image(scratch.path("flat.tif"), "GTiff", GDT_Byte, 50, 50, 1, [](int, int, int) { return 9; });
  georeference(scratch.path("flat.tif"));
  check_bad(file("flat.tif"), "flat.tif", "same value");
  check_bad(file("flat.tif"), "flat.tif", "same value", " --sun 40,90");
  {
    const std::unique_ptr<GDALDataset> data(
        GDALDataset::Open(file("flat.tif").c_str(), GDAL_OF_RASTER | GDAL_OF_UPDATE));
    data->GetRasterBand(1)->SetNoDataValue(9.0);
  }
  check_bad(file("flat.tif"), "flat.tif", "no data");
  fs::copy_file(file("site.tif"), file("cut.tif"));
  fs::resize_file(file("cut.tif"), 700000);
  check_bad(file("cut.tif"), "cut.tif", "whole");
  check_bad(file("cut.tif"), "cut.tif", "whole", " --sun 40,90");
  check_bad(file("site.tif"), "--band", "1", " --band 7");
  check_bad(file("site.tif"), "--tile", "", " --tile 3");
  check_bad(file("site.tif"), "no boulder", "--min-diameter", " --min-diameter 50");
}

/// Ground of craters alone: no map, but their tables, and a refusal that tells of them.
void test_craters_alone(void**) {
  const std::string image = test::find_data("raster_cases/16_craters_no_boulders/site_el20.tif");
  SKIP_WITHOUT(image, "raster_cases");
  const std::string tables = " --csv " + file("c.csv") + " --gpkg " + file("c.gpkg");
  assert_int_equal(build("'" + image + "' --sun 20,290 -o " + file("c.cmap") + tables), 1);
  assert_false(fs::exists(file("c.cmap")));
  assert_true(read_csv(file("c.csv")).empty());
  const CsvTable table(file("c.csv"));
  assert_at_least(static_cast<double>(table.size()), 40.0);
  for (std::size_t row = 0; row < table.size(); ++row)
    assert_true(table.word(row, table.column("kind")) == "crater");
  assert_true(read_points(file("c.gpkg")).boulders.empty());
}

void test_three_bands_are_their_mean(void**) {
  tiff("rgb.tif", 3);
  assert_int_equal(build(file("rgb.tif") + into("rgb")), 0);
  assert_true(products("rgb") == products("whole"));  // three times the same band
}

void test_ranks(void**) {
  if (std::system("command -v mpirun >/dev/null 2>&1") != 0) {
    print_message("skipped: mpirun is not installed\n");
    skip();
  }
  // Three processes on a machine that may have fewer cores and be used by root; MPI's own leaks are not ours.
  const std::string run =
      "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1 "
      "ASAN_OPTIONS=detect_leaks=0 timeout 300 mpirun -n ";
  for (const char* ranks : {"1 ", "3 "}) {
    assert_int_equal(build(file("site.tif") + into("ranks") + " --tile 200", run + ranks), 0);
    assert_true(products("ranks") == products("whole"));
  }
  assert_int_equal(build(file("site.tif") + into("shadow3") + " --tile 500 --sun 40,270", run + "3 "), 0);
  assert_true(products("shadow3") == products("shadow"));
  // What the image tells of its sun, and an error, which ends all of them, are told once.
  const std::string sample = CAIRN_SOURCE_DIR "/unit_tests/integration/sample/ortho_5mm.tif";
  assert_int_equal(build("'" + sample + "' --sun auto" + into("auto3"), run + "3 "), 0);
  const std::size_t told = said().find("sun by the image");
  assert_true(told != std::string::npos && said().find("sun by the image", told + 1) == std::string::npos);
  // On a busy machine mpirun may end before it has passed on what a rank said: then it is asked again.
  const auto refused_once = [&](const std::string& arguments) {
    std::size_t told_at = std::string::npos;
    for (int tries = 0; tries < 5 && told_at == std::string::npos; ++tries) {
      assert_true(build(arguments, run + "3 ") != 0);
      told_at = ended.errors.find("cairn: ");
    }
    assert_true(told_at != std::string::npos);
    assert_true(ended.errors.find("cairn: ", told_at + 1) == std::string::npos);
  };
  refused_once(file("cut.tif") + " -o " + file("bad/site.cmap"));
  assert_true(fs::is_empty(scratch.path("bad")));
  refused_once("--no-such-option");
}

/// A model that cannot be used is told before the work, in one line alone: no word yet of the method.
void test_bad_elevation_models_are_told_first(void**) {
  test::write_image(file("voids.tif"), "GTiff", GDT_Byte, 200, 200, 1,
                    [](int, int x, int y) { return x > 90 && x < 99 && y > 90 && y < 99 ? 0 : 200 + x % 7; });
  georeference(file("voids.tif"));
  test::check_refusal(scratch,
                      "map build " + file("site.tif") + " --sun 40,270 -o " + file("heights.cmap") +
                          " --dem " + file("voids.tif"),
                      "voids.tif", "-a_nodata 0");
  assert_true(read_file(scratch.path("stdout")).empty());
  assert_false(fs::exists(file("heights.cmap")));
}

/// What is read is still there, whatever names it as an output.
void test_inputs_are_kept(void**) {
  for (const char* name : {"input.tif", "input_dem.tif"}) fs::copy_file(file("site.tif"), file(name));
  fs::copy_file(file("whole.csv"), file("input.csv"));
  fs::create_symlink(file("input.tif"), file("link.png"));
  const std::string image = "map build " + file("input.tif") + " --sun 40,270 --dem " + file("input_dem.tif");
  const std::string table = "map build --from-csv " + file("input.csv");
  const std::string free = " -o " + file("free.cmap");
  for (const std::string& bad :
       {image + " -o " + file("input.tif"), image + " -o " + file("input_dem.tif"),
        image + free + " --quicklook " + file("link.png"),
        image + free + " --quality " + file("x/../input.tif"), image + free + " --csv " + file("free.cmap"),
        table + " -o " + file("input.csv"), table + free + " --csv " + file("input.csv"),
        "map quicklook " + file("whole.cmap") + " -o " + file("whole.cmap"),
        "map unpack " + file("whole.cmap") + " --gpkg " + file("whole.cmap"),
        "map merge " + file("whole.cmap") + " " + file("again.cmap") + " -o " + file("again.cmap")})
    test::check_refusal(scratch, bad, "would be overwritten", "choose another name");
  assert_true(read_file(file("input.tif")) == read_file(file("site.tif")));
  assert_true(read_file(file("input_dem.tif")) == read_file(file("site.tif")));
  assert_true(read_file(file("input.csv")) == read_file(file("whole.csv")));
  assert_false(fs::exists(file("free.cmap")));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_options_that_change_nothing),
      cmocka_unit_test(test_the_same_from_other_formats),
      cmocka_unit_test(test_isis_cube),
      cmocka_unit_test(test_least_diameter),
      cmocka_unit_test(test_sun_chooses_the_method),
      cmocka_unit_test(test_a_sun_in_doubt),
      cmocka_unit_test(test_metres_of_the_ground),
      cmocka_unit_test(test_killed_and_started_again),
      cmocka_unit_test(test_full_disk),
      cmocka_unit_test(test_bad_images),
      cmocka_unit_test(test_craters_alone),
      cmocka_unit_test(test_three_bands_are_their_mean),
      cmocka_unit_test(test_ranks),
      cmocka_unit_test(test_bad_elevation_models_are_told_first),
      cmocka_unit_test(test_inputs_are_kept),
  };
  return cmocka_run_group_tests_name("ground_tools/commands/cmd_map_build", tests, setup, nullptr);
}
