// cairn map info, verify, unpack, diff, merge, quicklook, and the products of build,
// as their users start them.
#include <gdal_priv.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "base/boulder_table.hpp"
#include "cmap/cmap_file.hpp"
#include "core/big_endian.hpp"
#include "core/random.hpp"
#include "core/trig.hpp"
#include "ground_tools/program.hpp"
#include "ortho/reference_system.hpp"

using namespace cairn;
using namespace cairn::ground;
using cairn::test::check_refusal;
using cairn::test::Ended;
using cairn::test::run_cairn;
using cairn::test::Scratch;

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const Scratch scratch;
const char* const kMars = "+proj=eqc +lat_ts=0 +lon_0=224.02263789406 +R=3388546.86869391";
const MapExtent kExtent{100.0, 5000.0, 200.0, 5100.0};
std::vector<TableBoulder> boulders;
std::vector<std::uint8_t> bytes;
CmapContent content;
Json json;
std::string text;
Ended ended;

std::string quoted(const char* name) { return " '" + scratch.path(name).string() + "'"; }

std::string read_text(const char* name) {
  const std::vector<std::uint8_t> all = read_file(scratch.path(name));
  return {all.begin(), all.end()};
}

/// Exit status; what it wrote stands in `text`, and in `json` where it was asked for.
int cairn_says(const std::string& arguments, const std::string& before = "") {
  ended = run_cairn(scratch, arguments, before);
  text = read_text("stdout");
  if (arguments.find("--json") != std::string::npos && !text.empty()) json = Json::parse(text);
  return ended.code;
}

void make_boulders(int count) {
  Random random(3);
  boulders.clear();
  for (int i = 0; i < count; ++i) {
    TableBoulder b;
    b.p_map_m = Vec2(100.0 + 1e-7 * random.below(1000000001), 5000.0 + 1e-7 * random.below(1000000001));
    b.diameter_m = 0.2 + 1e-3 * random.below(1500);
    b.height_m = i % 3 == 0 ? 0.0 : 0.1 + 0.001 * random.below(500);
    b.confidence = 0.25 * random.below(5);
    boulders.push_back(b);
  }
}

void write_map(const char* name, const std::string& system = kMars) {
  bytes = encode_cmap(boulders, kExtent, 0.01, {cmap::Method::kOtsu, 0.04, "p", system, 7, 1000, 3});
  scratch.file(name, std::string(bytes.begin(), bytes.end()));
}

void put_all() {
  make_boulders(3000);
  write_map("a.cmap");
}

void test_info(void**) {
  put_all();
  assert_int_equal(cairn_says("map info" + quoted("a.cmap")), 0);
  for (const char* word : {"3000 (0.3 per m2)", kMars, "otsu on pixels of 0.04 m",
                           "site              7, revision 3", "2000-01-01T12:16:40 TT"}) {
    if (text.find(word) == std::string::npos) fail_msg("no '%s' in\n%s", word, text.c_str());
  }
  assert_int_equal(cairn_says("map info --json" + quoted("a.cmap")), 0);
  std::size_t sum = 0;
  for (const auto& part : json["bytes_by_part"]) sum += part.get<std::size_t>();
  assert_int_equal(sum, bytes.size());
  assert_int_equal(json["bytes"].get<std::size_t>(), bytes.size());
  std::size_t in_bins = 0;
  for (const auto& bin : json["diameter_histogram"]) in_bins += bin["boulders"].get<std::size_t>();
  assert_int_equal(in_bins, 3000);
  assert_int_equal(json["height_m"]["known"].get<int>(), 2000);
  assert_string_equal(json["reference_system"].get<std::string>().c_str(), kMars);
  // log2 C(1e8, 3000) / 3000, by an exact sum of logarithms elsewhere: 16.4669.
  assert_near(json["bits_per_boulder"]["position_limit"].get<double>(), 16.467, 0.01);
  assert_int_equal(json["revision"].get<int>(), 3);
  assert_near(json["ground_m_per_map_m"][0].get<double>(), 1.0, 1e-5);

  // At the equator of a map that is true at 60 degrees, a metre along x is two.
  write_map("wide.cmap", "+proj=eqc +lat_ts=60 +R=3388546.87");
  assert_int_equal(cairn_says("map info --json" + quoted("wide.cmap")), 0);
  assert_near(json["ground_m_per_map_m"][0].get<double>(), 2.0, 1e-5);
  assert_near(json["ground_m_per_map_m"][1].get<double>(), 1.0, 1e-5);
  assert_int_equal(cairn_says("map info" + quoted("wide.cmap")), 0);
  assert_true(text.find("is 2.0000 m of ground along x") != std::string::npos);
}

void test_verify(void**) {
  put_all();
  assert_int_equal(cairn_says("map verify" + quoted("a.cmap")), 0);
  assert_true(text.find("a.cmap: good, 3000 boulders") != std::string::npos);
  assert_int_equal(cairn_says("map verify --json" + quoted("a.cmap")), 0);
  assert_string_equal(json["verdict"].get<std::string>().c_str(), "good");
  assert_true(json["damaged_tiles"].empty());

  // One bit of a tile: that tile is named, the rest counts.
  content = decode_cmap(bytes, "a");
  const CmapTile tile = content.tiles[2];
  std::string damaged(bytes.begin(), bytes.end());
  damaged[tile.offset + 10] = static_cast<char>(damaged[tile.offset + 10] ^ 4);
  scratch.file("damaged.cmap", damaged);
  assert_int_equal(cairn_says("map verify" + quoted("damaged.cmap")), 2);
  assert_true(text.find("damaged, 1 of ") != std::string::npos && text.find("(2)") != std::string::npos);
  assert_true(text.find('\n') == text.size() - 1);
  assert_int_equal(cairn_says("map verify --json" + quoted("damaged.cmap")), 2);
  assert_string_equal(json["verdict"].get<std::string>().c_str(), "damaged");
  assert_int_equal(json["damaged_tiles"].size(), 1);
  assert_int_equal(json["damaged_tiles"][0]["tile"].get<int>(), 2);
  assert_int_equal(json["boulders_lost"].get<std::uint32_t>(), tile.count);
  assert_int_equal(cairn_says("map info --json" + quoted("damaged.cmap")), 0);
  assert_int_equal(json["tiles"]["damaged"].get<int>(), 1);

  damaged = std::string(bytes.begin(), bytes.end());
  damaged[20] = static_cast<char>(damaged[20] ^ 1);
  scratch.file("head.cmap", damaged);
  assert_int_equal(cairn_says("map verify" + quoted("head.cmap")), 2);
  assert_true(text.find("head.cmap: bad, it ") != std::string::npos);
  scratch.file("cut.cmap", std::string(bytes.begin(), bytes.begin() + 400));
  assert_int_equal(cairn_says("map verify" + quoted("cut.cmap")), 2);
  scratch.file("text.cmap", std::string(300, 'x'));
  assert_int_equal(cairn_says("map verify --json" + quoted("text.cmap")), 2);
  assert_string_equal(json["verdict"].get<std::string>().c_str(), "bad");
  check_refusal(scratch, "map verify" + quoted("absent.cmap"), "absent.cmap", "check the name");

  boulders.clear();
  write_map("empty.cmap");
  assert_int_equal(cairn_says("map verify" + quoted("empty.cmap")), 0);
  assert_true(text.find("empty") != std::string::npos);
}

void test_unpack(void**) {
  put_all();
  assert_int_equal(cairn_says("map unpack --json" + quoted("a.cmap") + " --csv" + quoted("u/a.csv") +
                              " --gpkg" + quoted("u/a.gpkg")),
                   0);
  assert_int_equal(json["boulders"].get<int>(), 3000);
  content = decode_cmap(bytes, "a");
  boulders = read_csv(scratch.path("u/a.csv"));
  assert_int_equal(boulders.size(), content.boulders.size());
  for (std::size_t i = 0; i < boulders.size(); ++i) {
    assert_near(boulders[i].p_map_m.x(), content.boulders[i].p_map_m.x(), 0.00006);
    assert_near(boulders[i].confidence, content.boulders[i].confidence, 0.0006);
  }
  // And back into a map, in the same reference system.
  assert_int_equal(cairn_says("map build --from-csv" + quoted("u/a.csv") + " -o" + quoted("back.cmap") +
                              " --quantum 0.01"),
                   0);
  content = decode_cmap(read_file(scratch.path("back.cmap")), "back");
  assert_string_equal(content.reference_system.c_str(), kMars);
  assert_int_equal(content.boulders.size(), 3000);

  check_refusal(scratch, "map unpack" + quoted("a.cmap"), "map unpack", "--csv");
  scratch.file("text.cmap", std::string(300, 'x'));
  check_refusal(scratch, "map unpack" + quoted("text.cmap") + " --csv" + quoted("n.csv"), "text.cmap",
                "cairn map build");
  check_refusal(scratch, "map unpack" + quoted("a.cmap") + " --gpkg" + quoted("a.cmap") + "/x.gpkg", "x.gpkg",
                "folder");
  check_refusal(scratch,
                "map unpack" + quoted("a.cmap") + " --csv" + quoted("n.csv") + " --dem" + quoted("no.tif"),
                "no.tif", "check the name");
  assert_false(fs::exists(scratch.path("n.csv")));

  std::string damaged(bytes.begin(), bytes.end());
  damaged.back() = static_cast<char>(damaged.back() ^ 1);
  scratch.file("damaged.cmap", damaged);
  check_refusal(scratch, "map unpack" + quoted("damaged.cmap") + " --csv" + quoted("n.csv"), "damaged.cmap",
                "damaged");
  assert_int_equal(
      cairn_says("map unpack --salvage --json" + quoted("damaged.cmap") + " --csv" + quoted("n.csv")), 0);
  assert_int_equal(json["damaged_tiles"].get<int>(), 1);
  assert_true(json["boulders"].get<int>() < 3000 && json["boulders"].get<int>() > 1000);
}

/// A map against its own table: all there, in place.
void test_score(void**) {
  put_all();
  assert_int_equal(cairn_says("map unpack" + quoted("a.cmap") + " --csv" + quoted("truth.csv")), 0);
  assert_int_equal(cairn_says("map score --json" + quoted("a.cmap") + " --truth" + quoted("truth.csv")), 0);
  assert_near(json["recall"].get<double>(), 1.0, 0.0);
  assert_true(json["rocks"].get<int>() > 0 && json["rocks"] == json["found"]);
  assert_near(json["shift_east_m"].get<double>(), 0.0, 1e-3);
  assert_true(json["sizes"].size() > 0);

  // Along a way fewer count; of a run's boulders those that are large enough.
  const int all = json["rocks"].get<int>();
  scratch.file("way.csv", "x,y\n100,5050\n200,5050\n");
  assert_int_equal(cairn_says("map score --json" + quoted("a.cmap") + " --truth" + quoted("truth.csv") +
                              " --way" + quoted("way.csv") + " --within 20"),
                   0);
  assert_true(json["rocks"].get<int>() > 0 && json["rocks"].get<int>() < all / 2);
  assert_near(json["recall"].get<double>(), 1.0, 0.0);
  scratch.file("boulders.csv",
               "id,x,y,z,size,sightings\n0,150,5050,0,0.3,4\n1,150,5051,0,0.9,4\n2,150,5080,0,0.9,4\n");
  assert_int_equal(cairn_says("map score --json" + quoted("boulders.csv") + " --truth" + quoted("truth.csv") +
                              " --way" + quoted("way.csv") + " --within 20 --entry-diameter 0.5"),
                   0);
  assert_int_equal(json["entries"].get<int>(), 1);
}

void test_diff(void**) {
  put_all();
  write_map("same.cmap");
  assert_int_equal(cairn_says("map diff --json" + quoted("a.cmap") + quoted("same.cmap")), 0);
  assert_true(json["same"].get<bool>());
  assert_int_equal(json["tiles"]["changed"].get<int>(), 0);

  content = decode_cmap(bytes, "a");
  const CmapLayout layout = content.layout;
  CmapOptions like;
  like.like = &layout;
  boulders.erase(boulders.begin(), boulders.begin() + 10);
  boulders[0].p_map_m.x() =
      boulders[0].p_map_m.x() > 150.0 ? boulders[0].p_map_m.x() - 0.03 : boulders[0].p_map_m.x() + 0.03;
  bytes = encode_cmap(boulders, kExtent, 0.01, {cmap::Method::kOtsu, 0.04, "p", kMars}, like);
  scratch.file("b.cmap", std::string(bytes.begin(), bytes.end()));
  assert_int_equal(cairn_says("map diff --json --within 0.05" + quoted("a.cmap") + quoted("b.cmap") +
                              " --csv" + quoted("d.csv")),
                   2);
  assert_false(json["same"].get<bool>());
  assert_int_equal(json["removed"].get<int>(), 10);
  assert_int_equal(json["added"].get<int>(), 0);
  assert_int_equal(json["moved"].get<int>(), 1);
  assert_int_equal(json["matched"].get<int>(), 2990);
  assert_near(json["repeatability"].get<double>(), 1.0, 0.0);
  assert_true(json["tiles"]["comparable"].get<bool>());
  const int changed = json["tiles"]["changed"].get<int>();
  assert_true(changed >= 1 && changed <= json["tiles"]["of"].get<int>());
  text = read_text("d.csv");
  assert_int_equal(std::count(text.begin(), text.end(), '\n'), 12);
  assert_int_equal(cairn_says("map diff" + quoted("a.cmap") + quoted("b.cmap")), 2);

  // Another registration.
  for (TableBoulder& b : boulders) b.p_map_m += Vec2(0.6, -0.4);
  bytes =
      encode_cmap(boulders, {100.0, 4990.0, 210.0, 5100.0}, 0.01, {cmap::Method::kOtsu, 0.04, "p", kMars});
  scratch.file("c.cmap", std::string(bytes.begin(), bytes.end()));
  assert_int_equal(cairn_says("map diff --json --align" + quoted("a.cmap") + quoted("c.cmap")), 2);
  assert_near(json["shift_taken_off_m"][0].get<double>(), 0.6, 0.006);
  assert_near(json["shift_taken_off_m"][1].get<double>(), -0.4, 0.006);
  assert_true(json["repeatability"].get<double>() > 0.999);
  assert_false(json["tiles"]["comparable"].get<bool>());

  make_boulders(10);
  write_map("earth.cmap", "EPSG:32633");
  check_refusal(scratch, "map diff" + quoted("a.cmap") + quoted("earth.cmap"), "earth.cmap",
                "reference system");
  check_refusal(scratch, "map diff" + quoted("a.cmap") + quoted("absent.cmap"), "absent.cmap",
                "check the name");
}

/// The same ground in longitudes of 0 to 360 and of -180 to 180.
void test_maps_apart(void**) {
  make_boulders(20);
  const auto write_at = [](const char* name, double x_m) {
    std::vector<TableBoulder> there = boulders;
    for (TableBoulder& b : there) b.p_map_m.x() += x_m;
    bytes =
        encode_cmap(there, {kExtent.min_x_m + x_m, kExtent.min_y_m, kExtent.max_x_m + x_m, kExtent.max_y_m},
                    0.02, {cmap::Method::kOtsu, 0.1, "p", "+proj=eqc +R=1737400"});
    scratch.file(name, std::string(bytes.begin(), bytes.end()));
  };
  write_at("east.cmap", 6064572.0);
  write_at("west.cmap", 6064572.0 - 2.0 * kPi * 1737400.0);
  assert_int_equal(cairn_says("map diff --json" + quoted("east.cmap") + quoted("west.cmap")), 2);
  assert_true(json["repeatability"].is_null() && json["common_extent"]["min_x_m"].is_null());
  assert_int_equal(cairn_says("map diff" + quoted("east.cmap") + quoted("west.cmap")), 2);
  assert_true(text.find("do not overlap") != std::string::npos);
  assert_int_equal(
      cairn_says("map merge" + quoted("east.cmap") + quoted("west.cmap") + " -o" + quoted("both.cmap")), 0);
  assert_true(ended.errors.find("from 0 to 360") != std::string::npos);
}

void test_merge(void**) {
  put_all();
  const std::vector<TableBoulder> all = boulders;
  boulders.assign(all.begin(), all.begin() + 2000);
  write_map("first.cmap");
  boulders.assign(all.begin() + 1000, all.end());
  write_map("second.cmap");
  assert_int_equal(cairn_says("map merge --json --within 0.005" + quoted("first.cmap") +
                              quoted("second.cmap") + " -o" + quoted("m1.cmap")),
                   0);
  assert_int_equal(json["boulders"].get<int>(), 3000);
  assert_int_equal(json["joined"].get<int>(), 1000);
  assert_int_equal(cairn_says("map merge --within 0.005" + quoted("second.cmap") + quoted("first.cmap") +
                              " -o" + quoted("m2.cmap")),
                   0);
  assert_true(read_file(scratch.path("m1.cmap")) == read_file(scratch.path("m2.cmap")));
  content = decode_cmap(read_file(scratch.path("m1.cmap")), "m1");
  assert_string_equal(content.reference_system.c_str(), kMars);
  assert_int_equal(content.site, 7);

  write_map("earth.cmap", "EPSG:32633");
  const std::string out = " -o" + quoted("refused/m.cmap");
  check_refusal(scratch, "map merge" + quoted("first.cmap") + quoted("earth.cmap") + out, "earth.cmap",
                "reference system");
  check_refusal(scratch, "map merge" + quoted("first.cmap") + out, "map merge", "two maps or more");
  check_refusal(scratch, "map merge" + quoted("first.cmap") + quoted("absent.cmap") + out, "absent.cmap",
                "check the name");
  scratch.file("text.cmap", std::string(300, 'x'));
  check_refusal(scratch, "map merge" + quoted("first.cmap") + quoted("text.cmap") + out, "text.cmap",
                "map build");
  check_refusal(
      scratch,
      "map merge" + quoted("first.cmap") + quoted("second.cmap") + " -o" + quoted("text.cmap") + "/m.cmap",
      "m.cmap", "folder");
  assert_true(fs::is_empty(scratch.path("refused/m.cmap").parent_path()));
}

fs::path ortho_with_discs() {
  GDALAllRegister();
  const fs::path path = scratch.path("ortho.tif");
  constexpr int kSide = 400;
  const std::unique_ptr<GDALDataset> data(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      path.c_str(), kSide, kSide, 1, GDT_Byte, nullptr));
  double geo[6] = {100.0, 0.05, 0.0, 5020.0, 0.0, -0.05};
  data->SetGeoTransform(geo);
  OGRSpatialReference system;
  system.SetFromUserInput(kMars);
  data->SetSpatialRef(&system);
  std::vector<std::uint8_t> row(kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const int u = x % 50 - 25;
      const int v = y % 50 - 25;
      row[static_cast<std::size_t>(x)] =
          u * u + v * v < 36 ? 40 : static_cast<std::uint8_t>(120 + (7 * x + 13 * y) % 10);
    }
    assert_int_equal(data->GetRasterBand(1)->RasterIO(GF_Write, 0, y, kSide, 1, row.data(), kSide, 1,
                                                      GDT_Byte, 0, 0, nullptr),
                     CE_None);
  }
  return path;
}

fs::path flat_dem(double x0_m) {
  const fs::path path = scratch.path("dem.tif");
  const std::unique_ptr<GDALDataset> data(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      path.c_str(), 50, 50, 1, GDT_Float32, nullptr));
  double geo[6] = {x0_m, 1.0, 0.0, 5030.0, 0.0, -1.0};
  data->SetGeoTransform(geo);
  data->GetRasterBand(1)->Fill(-2500.0);
  return path;
}

std::size_t files_of(const char* name) {
  std::size_t count = 0;
  for (const auto& entry : fs::directory_iterator(scratch.path(name).parent_path()))
    count += entry.exists() ? 1 : 0;
  return count;
}

void test_products_of_build(void**) {
  ortho_with_discs();
  flat_dem(90.0);
  const std::string products = " -o" + quoted("p/m.cmap") + " --csv" + quoted("p/m.csv") + " --gpkg" +
                               quoted("p/m.gpkg") + " --quicklook" + quoted("p/m.png") + " --dem" +
                               quoted("dem.tif");
  assert_int_equal(cairn_says("map build" + quoted("ortho.tif") + products), 0);
  assert_int_equal(files_of("p/m.cmap"), 7);  // with .csvt, .prj, .png.aux.xml
  boulders = read_csv(scratch.path("p/m.csv"));
  assert_int_equal(boulders.size(), 64);
  for (const TableBoulder& b : boulders) assert_near(b.ground_z_m, -2500.0, 0.0);
  content = decode_cmap(read_file(scratch.path("p/m.cmap")), "m.cmap");  // which carries them, too
  assert_near(content.heights.spacing * content.quantum_m, 2.0, 1e-9);   // two pixels of the model
  for (const cmap::Post& post : content.heights.posts) {
    if (post.known())
      assert_near(content.heights.base_m + post.value() * content.heights.quantum_m(), -2500.0, 1e-9);
  }
  assert_at_least(content.heights.known(), content.heights.posts.size() / 2);

  // What cannot be, is told before the work, and nothing is left.
  check_refusal(scratch,
                "map build" + quoted("ortho.tif") + " -o" + quoted("q/m.cmap") + " --height-sigma 0.1",
                "--height-sigma", "--dem");
  flat_dem(9000.0);
  const std::string elsewhere = " -o" + quoted("q/m.cmap") + " --dem" + quoted("dem.tif");
  check_refusal(scratch, "map build" + quoted("ortho.tif") + elsewhere, "dem.tif", "of this site");
  const std::string missing = " -o" + quoted("q/m.cmap") + " --gpkg" + quoted("dem.tif") + "/m.gpkg";
  check_refusal(scratch, "map build" + quoted("ortho.tif") + missing, "m.gpkg", "folder");
  assert_int_equal(files_of("q/m.cmap"), 0);
}

void test_quicklook(void**) {
  put_all();
  ortho_with_discs();
  assert_int_equal(cairn_says("map quicklook --json" + quoted("a.cmap") + " -o" + quoted("q.png") +
                              " --ortho" + quoted("ortho.tif")),
                   0);
  assert_int_equal(json["width_px"].get<int>(), 1600);
  assert_int_equal(
      cairn_says("map quicklook" + quoted("a.cmap") + " -o" + quoted("plain.png") + " --max-side 500"), 0);
  assert_true(fs::exists(scratch.path("plain.png.aux.xml")));
  check_refusal(scratch,
                "map quicklook" + quoted("a.cmap") + " -o" + quoted("n.png") + " --ortho" + quoted("no.tif"),
                "no.tif", "check the name");
  check_refusal(scratch, "map quicklook" + quoted("a.cmap") + " -o" + quoted("n.png") + " --max-side 5",
                "--max-side", "100");
  assert_false(fs::exists(scratch.path("n.png")));
}

/// A disk without space, by a limit on the size of files.
void test_full_disk(void**) {
  make_boulders(3000);
  write_map("a.cmap");
  const std::string full = "trap '' XFSZ; ulimit -f 4; ";
  for (const char* product : {" --gpkg", " --csv"}) {
    const Ended end =
        run_cairn(scratch, "map unpack" + quoted("a.cmap") + product + quoted("full/x.out"), full);
    if (end.code != 1 || !cairn::test::is_one_line(end.errors) ||
        end.errors.find("disk space") == std::string::npos)
      fail_msg("%s on a full disk: exit code %d, got:\n%s", product, end.code, end.errors.c_str());
    assert_int_equal(files_of("full/x.out"), 0);
  }
  const Ended picture =
      run_cairn(scratch, "map quicklook" + quoted("a.cmap") + " -o" + quoted("full/x.png"), full);
  assert_int_equal(picture.code, 1);
  assert_true(cairn::test::is_one_line(picture.errors) &&
              picture.errors.find("disk space") != std::string::npos);
  const Ended merged = run_cairn(
      scratch, "map merge" + quoted("a.cmap") + quoted("a.cmap") + " -o" + quoted("full/m.cmap"), full);
  assert_int_equal(merged.code, 1);
  assert_int_equal(files_of("full/x.out"), 0);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_info),      cmocka_unit_test(test_verify),
      cmocka_unit_test(test_unpack),    cmocka_unit_test(test_score),
      cmocka_unit_test(test_diff),      cmocka_unit_test(test_maps_apart),
      cmocka_unit_test(test_merge),     cmocka_unit_test(test_products_of_build),
      cmocka_unit_test(test_quicklook), cmocka_unit_test(test_full_disk),
  };
  return cmocka_run_group_tests_name("ground_tools/commands/cmd_map", tests, nullptr, nullptr);
}
