// `cairn map forecast`: its files, and inputs that are refused in one line.
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "base/number_table.hpp"
#include "cmap/cmap_file.hpp"
#include "forecast/forecast.hpp"
#include "forecast/forecast_files.hpp"
#include "ground_tools/program.hpp"
#include "support/noise.hpp"

using namespace cairn;
using namespace cairn::ground;
using cairn::test::Scratch;
using nlohmann::json;

namespace {

const Scratch scratch;

std::string text_of(const std::filesystem::path& path) {
  const std::vector<std::uint8_t> bytes = read_file(path);
  return {bytes.begin(), bytes.end()};
}

/// Boulders for x below 15 alone, in a map of 30 x 20 m.
std::filesystem::path make_map(const std::string& name, const std::string& reference_system) {
  Random random(5);
  std::vector<TableBoulder> boulders;
  for (int i = 0; i < 600; ++i) {
    TableBoulder b;
    b.p_map_m = Vec2(test::uniform(random, 0.0, 15.0), test::uniform(random, 0.0, 20.0));
    b.diameter_m = test::uniform(random, 0.1, 0.4);
    boulders.push_back(b);
  }
  CmapSource source;
  source.reference_system = reference_system;
  const std::vector<std::uint8_t> map = encode_cmap(boulders, {0.0, 0.0, 30.0, 20.0}, 0.001, source);
  write_file(scratch.path(name), {reinterpret_cast<const char*>(map.data()), map.size()});
  return scratch.path(name);
}

std::string quoted(const std::filesystem::path& path) { return "'" + path.string() + "'"; }

void test_all_files(void**) {
  static std::string map, way, out;
  map = quoted(make_map("site.cmap", "EPSG:3395"));
  way = quoted(scratch.file("way.csv", "x,y\n2,10\n14,11\n28,8\n"));
  out = scratch.path("out/x").parent_path().string();
  const test::Ended ended =
      test::run_cairn(scratch, "map forecast " + map + " --path " + way + " -o '" + out + "'");
  assert_int_equal(ended.code, 0);
  assert_string_equal(ended.errors.c_str(), "");
  const std::string table = text_of(scratch.path("stdout"));
  assert_non_null(std::strstr(table.c_str(), "blind from"));

  // The summary and the stations agree with the CSV table, line by line.
  static json summary;
  summary = json::parse(text_of(out + "/forecast.json"));
  assert_true(summary["reference_system"] == "EPSG:3395");
  static std::size_t stations;
  stations = summary["stations"].size();
  assert_int_equal(stations, summary["fixes"].get<std::size_t>());
  const CsvTable csv(out + "/forecast.csv");
  assert_int_equal(csv.size(), stations);
  double applied = 0.0;
  for (std::size_t i = 0; i < stations; ++i) {
    const auto at = [&](const char* name) { return csv.number(i, csv.column(name)); };
    const json& s = summary["stations"][i];
    assert_near(at("arc_m"), s["arc_m"].get<double>(), 1e-9);
    assert_near(at("p_applied"), s["p_applied"].get<double>(), 1e-9);
    assert_near(at("before_along_m"), s["before"]["along_m"].get<double>(), 1e-9);
    assert_near(at("ellipse_azimuth_deg"), s["ellipse"]["azimuth_deg"].get<double>(), 1e-9);
    assert_near(at("blind"), s["blind"].get<bool>() ? 1.0 : 0.0, 0.0);
    applied += s["p_applied"].get<double>();
  }
  assert_near(summary["expected_applied"].get<double>(), applied, 0.02);
  // Boulders to x = 15, none beyond: the last stretch is blind to the end, and longer than 8 m.
  const json& last = summary["blind"].back();
  assert_near(last["to_m"].get<double>(), summary["length_m"].get<double>(), 1e-9);
  assert_at_least(last["length_m"].get<double>(), 8.0);

  // GeoJSON: what there is, where it is, in which reference system.
  static json geo;
  geo = json::parse(text_of(out + "/forecast.geojson"));
  assert_true(geo["crs"]["properties"]["name"] == "urn:ogc:def:crs:EPSG::3395");
  static std::map<std::string, std::size_t> kinds;
  for (const json& f : geo["features"]) {
    const std::string kind = f["properties"]["kind"];
    ++kinds[kind];
    const json& at = f["geometry"]["coordinates"];
    if (kind == "station") {
      assert_true(f["geometry"]["type"] == "Point");
      assert_near(at[0].get<double>(), f["properties"]["x_m"].get<double>(), 1e-9);
      assert_near(at[1].get<double>(), f["properties"]["y_m"].get<double>(), 1e-9);
      assert_true(at[0] > 2.0 && at[0] < 28.0);
    }
    if (kind == "ellipse") assert_true(at[0].front() == at[0].back());  // a closed ring
    if (kind == "blind") assert_true(f["geometry"]["type"] == "LineString" && at.size() >= 2);
  }
  assert_int_equal(kinds["drive"], 1);
  assert_int_equal(kinds["station"], stations);
  assert_int_equal(kinds["blind"], summary["blind"].size());
  assert_true(kinds["ellipse"] > 2 && kinds["ellipse"] <= stations);

  const std::string svg = text_of(out + "/forecast.svg");
  assert_int_equal(svg.rfind("<svg", 0), 0);
  assert_non_null(std::strstr(svg.c_str(), "</svg>"));
  assert_null(std::strstr(svg.c_str(), "nan"));
}

void test_single_files_and_json(void**) {
  static std::string map, way;
  map = quoted(make_map("local.cmap", "local"));
  way = quoted(scratch.file("xm.csv", "name_no,x_m,y_m\n1,2,10\n2,13,10\n"));
  const std::string files = " --csv " + quoted(scratch.path("a.csv")) + " --geojson " +
                            quoted(scratch.path("a.geojson")) + " --plot " + quoted(scratch.path("a.svg"));
  assert_int_equal(
      test::run_cairn(scratch, "map forecast " + map + " --path " + way + files + " --json").code, 0);
  const json told = json::parse(text_of(scratch.path("stdout")));
  assert_near(told["length_m"].get<double>(), 11.0, 0.061);
  assert_true(std::filesystem::exists(scratch.path("a.svg")));
  assert_int_equal(CsvTable(scratch.path("a.csv")).size(), told["fixes"].get<std::size_t>());
  assert_false(json::parse(text_of(scratch.path("a.geojson"))).contains("crs"));
  // A model file, then an option that replaces a part of it.
  const std::string model =
      " --model " + quoted(scratch.file("m.json", R"({"clutter_per_m2": 0.7, "detection": {"most": 0.2}})"));
  assert_int_equal(
      test::run_cairn(scratch, "map forecast " + map + " --path " + way + model + " --detect-most 0.3 --json")
          .code,
      0);
  const json other = json::parse(text_of(scratch.path("stdout")));
  assert_near(other["model"]["clutter_per_m2"].get<double>(), 0.7, 0.0);
  assert_near(other["model"]["detection"]["most"].get<double>(), 0.3, 0.0);
  assert_true(other["expected_applied"].get<double>() < told["expected_applied"].get<double>());
}

void test_refusals_of_the_command(void**) {
  static std::string map, way, begin;
  map = quoted(make_map("again.cmap", "local"));
  way = quoted(scratch.file("good.csv", "x,y\n2,10\n13,10\n"));
  begin = "map forecast " + map + " --path " + way;
  test::check_refusal(scratch, "map forecast " + map, "--path", "required");
  test::check_refusal(scratch, "map forecast nowhere.cmap --path " + way, "nowhere.cmap", "");
  test::check_refusal(scratch, "map forecast " + way + " --path " + way, "good.csv", "");
  test::check_refusal(scratch, "map forecast " + map + " --path nowhere.csv", "nowhere.csv", "");
  test::check_refusal(scratch, begin + " --mission venus", "'venus'", "build with MISSION=venus");
  test::check_refusal(scratch, begin + " --model nowhere.json", "nowhere.json", "");
  test::check_refusal(scratch, begin + " --detect-most 2", "most: 2 is out of range", "give 0.001 to 1");
  test::check_refusal(scratch, begin + " --step 0", "--step", "");
  test::check_refusal(scratch, begin + " --blind-below 2", "--blind-below", "");
  test::check_refusal(scratch, begin + " --csv /nowhere/a.csv", "/nowhere/a.csv", "");
  assert_int_equal(test::run_cairn(scratch, begin + " --mission paper").code, 0);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_all_files),
      cmocka_unit_test(test_single_files_and_json),
      cmocka_unit_test(test_refusals_of_the_command),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
