// cairn report: the page needs nothing but itself, holds what the run's files say, and a folder that is not
// whole is refused in one line.
#include "report/page.hpp"

#include <cmath>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>

#include "base/number_table.hpp"
#include "base/output_file.hpp"
#include "core/eigen.hpp"
#include "ground_tools/browser.hpp"
#include "ground_tools/program.hpp"
#include "localizer/localizer.hpp"
#include "replay/status_names.hpp"
#include "report/run_folder.hpp"

using namespace cairn;
using namespace cairn::ground;
using nlohmann::ordered_json;

namespace {

namespace fs = std::filesystem;

const test::Scratch scratch;
std::string page;
ordered_json run;
ordered_json data;

std::string text_of(const fs::path& path) {
  const std::vector<std::uint8_t> bytes = read_file(path);
  return {bytes.begin(), bytes.end()};
}

ordered_json summary(const std::string& dataset) {
  ordered_json s = {{"mission", "paper"}, {"dataset", dataset}, {"map", "site.cmap"}, {"map_pixel_m", 0.005},
                    {"variant", "cairn"}, {"degrade", ""},      {"frames", 3}};
  s["counts"] = {{"vo", {{"motion", 2}}},
                 {"boulders", ordered_json::object()},
                 {"fixes", ordered_json::object()},
                 {"overruns", ordered_json::object()}};
  s["memory_bytes"] = {{"images", 1024}};
  s["path_m"] = 1.0;
  s["vo"] = {{"end_xy_m", 0.1}, {"largest_xy_m", 0.1}, {"end_3d_m", 0.1}, {"end_yaw_deg", 0.0}};
  s["corrected"] = {{"end_xy_m", 0.03}, {"largest_xy_m", 0.03}, {"end_3d_m", 0.03}, {"end_yaw_deg", 0.1}};
  s["largest_excess_over_vo_m"] = 0.0;
  return s;
}

ordered_json picture() {
  return {{"frame", 11},
          {"width", 4},
          {"height", 2},
          {"jpeg", "QUJD"},
          {"camera_m", {0.5, 0.0}},
          {"heading_rad", 0.0},
          {"points", {{1, 1, 0.8, 0.1, 1, 7}}},
          {"boulders", {{7, 0.8, 0.1, 0.2, 1, 0}}},
          {"regions", {{"width", 2}, {"height", 1}, {"divisor", 2}, {"runs", {1, 1, 0, 1}}}}};
}

/// Three frames along x, 0.5 m apart; VO 0.1 m too far north at the end, the corrected path right until a fix
/// in frame 11 moves it by 0.03 m north.
fs::path make_run(const std::string& name, const std::string& dataset = "drive") {
  const auto tum = [](double end_y) {
    return fmt::format("# stamp\n1.0 0 0 1 0 0 0 1\n2.0 0.5 0 1 0 0 0 1\n3.0 1.0 {} 1 0 0 0 1\n", end_y);
  };
  scratch.file(name + "/truth.tum", tum(0.0));
  scratch.file(name + "/vo.tum", tum(0.1));
  scratch.file(name + "/corrected.tum", tum(0.03));
  scratch.file(name + "/summary.json", summary(dataset).dump());
  scratch.file(name + "/pairs.csv", "frame,x_m,y_m,map_x_m,map_y_m\n12,0.8,0.1,0.81,0.1\n");
  scratch.file(name + "/boulders.csv", "id,x,y,z,size,sightings\n3,0.8,0.1,0,0.2,5\n");
  scratch.file(
      name + "/orbital.csv",
      "x_m,y_m,diameter_m,area_m2,contrast,elongation\n0.81,0.1,0.2,0.03,0.3,1\n2,2,0.3,0.07,0.3,1\n");
  scratch.file(
      name + "/frames.csv",
      "frame,stamp_s,pose,vo,trust,sigma_xy_m,sigma_yaw_deg,inliers,boulders,vo_ops,boulder_ops,fix_ops,vo_ms,boulder_ms,fix_ms,ms\n"
      "10,1,start,first_frame,confirmed,0.05,0.5,0,0,5,6,0,1,2,0,3\n11,2,vo,motion,coasting,0.06,0.5,9,1,5,6,0,1,2,0,3\n"
      "12,3,vo,motion,confirmed,0.02,0.4,9,1,5,6,7,1,2,0.5,3.5\n");
  scratch.file(
      name + "/fixes.csv",
      "frame,status,snapshot,dx_m,dy_m,dyaw_deg,pairs,rms_m,trimmed,gated,local_boulders,map_boulders,sigma_x_m,"
      "sigma_y_m,correlation_xy,sigma_yaw_deg,lost,log_ratio,second_log_ratio\n12,applied,2,0,0.03,0.1,4,0.02,1,0,5,9,0.03,0.02,-0.5,0.4,0,21.5,-1000\n");
  const ordered_json pictures = {{"ortho", {{"low_m", {-1, -1}}, {"high_m", {2, 2}}, {"jpeg", "QUJD"}}},
                                 {"stride", 4},
                                 {"strips", {{picture()}}}};
  scratch.file(name + "/pictures.json", pictures.dump());
  return scratch.path(name);
}

std::size_t count(const std::string& text, const std::string& word) {
  std::size_t found = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++found;
  return found;
}

/// The JSON that the page's script finds.
ordered_json embedded(const std::string& html) {
  const std::string begin = "<script type=\"application/json\" id=\"data\">";
  const std::size_t from = html.find(begin) + begin.size();
  return ordered_json::parse(html.substr(from, html.find("</script>", from) - from));
}

void test_what_is_read(void**) {
  run = read_run_folder(make_run("read"));
  assert_string_equal(run.at("name").get<std::string>().c_str(), "read");
  assert_true(run.at("paths").at("vo") == ordered_json({0.0, 0.0, 0.5, 0.0, 1.0, 0.1}));
  assert_true(run.at("errors").at("distance_m") == ordered_json({0.0, 0.5, 1.0}));
  assert_true(run.at("errors").at("vo").at("xy_m") == ordered_json({0.0, 0.0, 0.1}));
  assert_true(run.at("errors").at("corrected").at("xyz_m") == ordered_json({0.0, 0.0, 0.03}));
  assert_true(run.at("frames").at("distance_m") == ordered_json({0.0, 0.5, 1.0}));
  // The fix moved the pose from the true place to 0.03 m beside it.
  const ordered_json& fixes = run.at("fixes");
  assert_true(fixes.at("status") == ordered_json({"applied"}));
  assert_true(fixes.at("x_m") == ordered_json({1.0}) && fixes.at("y_m") == ordered_json({0.03}));
  assert_true(fixes.at("distance_m") == ordered_json({1.0}));
  assert_true(fixes.at("before_m") == ordered_json({0.0}) && fixes.at("after_m") == ordered_json({0.03}));
  assert_true(fixes.at("correlation_xy") == ordered_json({-0.5}));
  assert_int_equal(run.at("orbital").at("x_m").size(), 2);
  assert_int_equal(run.at("ground").at("id").size(), 1);
}

void test_without_truth_map_and_pictures(void**) {
  const fs::path folder = make_run("bare");
  scratch.file("bare/truth.tum", "# stamp tx ty tz qx qy qz qw\n");
  scratch.file("bare/orbital.csv", "x_m,y_m,diameter_m\n");
  scratch.file("bare/pictures.json", R"({"ortho":null,"stride":4,"strips":[]})");
  run = read_run_folder(folder);
  assert_true(run.at("errors").is_null());
  assert_true(run.at("fixes").at("before_m").at(0).is_null());
  assert_true(run.at("frames").at("distance_m").at(1) == 0.5);  // along the corrected path
  data = embedded(report_page({run}));
  assert_true(data.at("pictures").empty());
}

void test_the_page_needs_nothing_else(void**) {
  page = report_page({read_run_folder(make_run("alone"))});
  assert_int_equal(page.find("<!DOCTYPE html>"), 0);
  assert_int_equal(count(page, "</html>"), 1);
  for (const char* word :
       {"http:", "https:", "src=", "<link", "@import", "url(", "fetch(", "XMLHttpRequest", "import("}) {
    if (count(page, word) != 0) fail_msg("the page has '%s'", word);
  }
  assert_int_equal(count(page, "default-src 'none'"), 1);
  assert_int_equal(count(page, "name=\"viewport\""), 1);
  assert_int_equal(count(page, "<script"), 2);
  assert_int_equal(count(page, "</script>"), 2);
  // Each element that the script asks for by name is in the page, or made by it.
  int asked = 0;
  for (std::size_t at = page.find("el('"); at != std::string::npos; at = page.find("el('", at + 1)) {
    const std::string id = page.substr(at + 4, page.find('\'', at + 4) - at - 4);
    if (count(page, "id=\"" + id + "\"") + count(page, "id: '" + id + "'") != 1)
      fail_msg("no element '%s' in the page", id.c_str());
    ++asked;
  }
  assert_at_least(asked, 20);
}

void test_every_status_has_words(void**) {
  page = report_page({read_run_folder(make_run("words"))});
  const auto check = [](const std::string& name) {
    if (count(page, "\n      " + name + ": '") + count(page, "\n    " + name + ": '") == 0)
      fail_msg("the page shows '%s' as it is", name.c_str());
  };
  // The first two of these, nothing yet and under way, are never an end.
  for (std::uint8_t i = 2; i < kFixStatusCount; ++i) check(fix_status_name(i));
  for (std::uint8_t i = 2; i < kVoStatusCount; ++i) check(vo_status_name(i));
  for (std::uint8_t i = 0; i < kObserveStatusCount; ++i) check(observe_status_name(i));
  for (std::uint8_t i = 0; i < kTrustCount; ++i) check(trust_name(i));
}

/// What a reader does: presses everything, once the page is drawn.
const char* const kProbe = R"js((() => {
  const all = (what) => [...document.querySelectorAll(what)];
  const colour = (e, property) => getComputedStyle(e)[property];
  const out = {
    runs: all('#runs tbody tr').length, fixes: all('#fixes tbody tr').length, curves: all('#charts .curve').length,
    claims: [all('#charts svg .band').length, all('#charts svg .span').length], layers: all('[data-layer=pairs]').length,
    pictures: all('#labels svg, #clusters svg, #regions svg').length, back: colour(document.body, 'backgroundColor'),
    vo: [all('#charts .said i')[0], all('#work-charts .said i')[0]].map((e) => colour(e, 'borderTopColor')),
    sideways: document.documentElement.scrollWidth - innerWidth};
  const canvas = document.getElementById('map');
  const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
  out.colours = new Set(new Uint32Array(pixels.buffer)).size;
  for (const e of all('#layers input, #show-points, #show-regions')) e.click();
  for (const key of ['ArrowLeft', '+', '-', 'n', 'p', '0', 'Escape']) {
    for (const e of all('canvas, .chart svg')) e.dispatchEvent(new KeyboardEvent('keydown', {key}));
  }
  for (const e of all('canvas, .chart svg')) {
    e.dispatchEvent(new PointerEvent('pointermove', {clientX: 300, clientY: 300}));
  }
  for (const e of all('button')) e.click();
  out.fault = document.getElementById('fault').hidden ? '' : document.getElementById('fault').textContent;
  return out;
})())js";

nlohmann::json told;

void test_in_a_browser(void**) {
  if (test::browser().empty()) {
    print_message("skipped: no browser is installed\n");
    skip();
  }
  page = report_page({read_run_folder(make_run("seen")), read_run_folder(make_run("seen_too"))});
  for (const bool dark : {false, true}) {
    for (const int width_px : {1280, 500}) {
      told = test::ask_page(scratch, page, kProbe, width_px, dark);
      print_message("%s\n", told.dump().c_str());
      assert_true(told.at("fault") == "");
      assert_true(told.at("runs") == 2 && told.at("fixes") == 1 && told.at("curves") == 8);
      // Bands in two of four charts; three stretches of trust in each.
      assert_true(told.at("claims") == nlohmann::json({2, 12}) && told.at("layers") == 1);
      assert_true(told.at("pictures") == 4 && told.at("sideways") <= 0 && told.at("colours") > 10);
      assert_true(told.at("back") == (dark ? "rgb(20, 23, 27)" : "rgb(255, 255, 255)"));
      assert_true(told.at("vo").at(0) == told.at("vo").at(1));  // a path, and the job that makes it
      if (!dark) assert_true(told.at("vo").at(0) == "rgb(213, 94, 0)");
    }
  }
  // A script that fails says so.
  ordered_json broken = read_run_folder(make_run("seen"));
  broken.erase("frames");
  told = test::ask_page(scratch, report_page({broken}), "document.getElementById('fault').textContent", 800);
  assert_true(told.get<std::string>().rfind("This page could not be drawn in full", 0) == 0);
}

/// A page without truth speaks of none, and says what a forecast says.
void test_without_truth_in_a_browser(void**) {
  if (test::browser().empty()) {
    print_message("skipped: no browser is installed\n");
    skip();
  }
  const char* const words = "document.body.innerText";
  make_run("untold");
  const std::string none = "# stamp tx ty tz qx qy qz qw\n";
  scratch.file("untold/truth.tum", none);
  ordered_json s = summary("drive");
  for (const char* key : {"path_m", "vo", "corrected", "largest_excess_over_vo_m"}) s.erase(key);
  scratch.file("untold/summary.json", s.dump());
  static std::string text;
  text = test::ask_page(scratch, report_page({read_run_folder(scratch.path("untold"))}), words, 1000);
  for (const char* word : {"true path", "truly", "truth", "error before"}) {
    if (text.find(word) != std::string::npos) fail_msg("the page without truth has '%s'", word);
  }
  assert_true(text.find("cairn report --forecast") != std::string::npos);
  assert_true(text.find("3 sigma") != std::string::npos);  // what it says of itself is still there
  s["forecast"] = {{"likely_wrong", true}, {"words", "The map or the start is likely wrong."}};
  scratch.file("untold/summary.json", s.dump());
  const ordered_json untold = read_run_folder(scratch.path("untold"));
  text = test::ask_page(scratch, report_page({untold}), words, 1000);
  assert_true(text.find("The map or the start is likely wrong.") != std::string::npos);
  assert_true(text.find("cairn report --forecast") == std::string::npos);
  // With truth in another run it is spoken of there alone.
  page = report_page({read_run_folder(make_run("told")), untold});
  text = test::ask_page(scratch, page, words, 1000);
  assert_true(text.find("truly went") != std::string::npos);
  const std::string other = "(el => { el.value = 1; el.dispatchEvent(new Event('change')); return ";
  text = test::ask_page(scratch, page, other + words + "; })(document.getElementById('run'))", 1000);
  assert_true(text.find("truly went") == std::string::npos);
}

void test_names_cannot_break_out(void**) {
  const std::string evil = "</script><script>alert(1)</script>&\"'<!--";
  page = report_page({read_run_folder(make_run("evil <&\" name", evil))});
  assert_int_equal(count(page, "<script"), 2);
  assert_int_equal(count(page, "<!--"), 0);
  assert_int_equal(count(page, "evil <"), 0);
  data = embedded(page);
  assert_true(data.at("runs").at(0).at("summary").at("dataset") == evil);
  assert_true(data.at("runs").at(0).at("name") == "evil <&\" name");
  // What is no UTF-8 is replaced, not refused.
  run["name"] = "caf\xe9";
  assert_true(embedded(report_page({run})).at("runs").at(0).at("name") == "caf\xef\xbf\xbd");
}

void test_several_runs(void**) {
  const ordered_json one = read_run_folder(make_run("a/same"));
  const ordered_json other = read_run_folder(make_run("b/same"));
  data = embedded(report_page({one, other}));
  assert_true(data.at("runs").at(0).at("name") == "same");
  assert_true(data.at("runs").at(1).at("name") == "same (2)");
  // Four pictures of the same bytes are kept once.
  assert_int_equal(data.at("pictures").size(), 1);
  assert_true(data.at("pictures").at(0) == "QUJD");
  assert_true(data.at("runs").at(1).at("ortho").at("jpeg") == 0);
  assert_true(data.at("runs").at(1).at("strips").at(0).at(0).at("jpeg") == 0);
}

void test_missing_images(void**) {
  const fs::path folder = make_run("dark");
  ordered_json without = picture();
  without["jpeg"] = "";
  without.erase("regions");
  const ordered_json pictures = {{"ortho", nullptr}, {"stride", 4}, {"strips", {{without}}}};
  scratch.file("dark/pictures.json", pictures.dump());
  data = embedded(report_page({read_run_folder(folder)}));
  assert_true(data.at("runs").at(0).at("strips").at(0).at(0).at("jpeg") == -1);
}

void test_folders_that_are_none(void**) {
  assert_refused(read_run_folder(scratch.path("nowhere")), "nowhere: no such folder");
  assert_refused(read_run_folder(scratch.file("a_file", "")), "a_file: no such folder");
  fs::create_directories(scratch.path("empty"));
  assert_refused(read_run_folder(scratch.path("empty")), "empty: holds no summary.json");
}

void test_missing_and_cut_files(void**) {
  for (const char* name : {"vo.tum", "corrected.tum", "truth.tum", "boulders.csv", "orbital.csv", "fixes.csv",
                           "frames.csv", "pairs.csv", "pictures.json", "summary.json"}) {
    const fs::path folder = make_run("broken");
    const std::string whole = text_of(folder / name);
    fs::remove(folder / name);
    assert_refused(read_run_folder(folder), name);
    for (const std::size_t size : {whole.size() - 1, whole.size() / 2, std::size_t{0}}) {
      scratch.file(std::string("broken/") + name, whole.substr(0, size));
      const std::string why = test::refusal([&] { static_cast<void>(read_run_folder(folder)); });
      if (why.find(name) == std::string::npos || why.find('\n') != std::string::npos)
        fail_msg("%s cut to %zu bytes: '%s'", name, size, why.c_str());
    }
    fs::remove_all(folder);
  }
}

void test_files_that_disagree(void**) {
  const fs::path folder = make_run("mixed");
  scratch.file("mixed/vo.tum", "1.0 0 0 1 0 0 0 1\n2.0 0.5 0 1 0 0 0 1\n");
  assert_refused(read_run_folder(folder), "vo.tum: has 2 poses, but summary.json tells of 3 frames");
  make_run("mixed");
  const std::string frames = text_of(folder / "frames.csv");
  scratch.file("mixed/frames.csv", frames.substr(0, frames.rfind("12,3")));
  assert_refused(read_run_folder(folder), "frames.csv: has 2 frames");
  make_run("mixed");
  std::string fixes = text_of(folder / "fixes.csv");
  scratch.file("mixed/fixes.csv", fixes.replace(fixes.find("\n12,"), 4, "\n99,"));
  assert_refused(read_run_folder(folder), "fixes.csv: frame 99 is not in frames.csv");
  make_run("mixed");
  scratch.file("mixed/boulders.csv", "id,x,y,z,size,sightings\n3,east,0.1,0,0.2,5\n");
  assert_refused(read_run_folder(folder), "boulders.csv:2: 'east'");
  scratch.file("mixed/boulders.csv", "id,x,y,z,size\n3,1,0.1,0,0.2\n");
  assert_refused(read_run_folder(folder), "boulders.csv: no column 'sightings'");
  scratch.file("mixed/boulders.csv", "id,x,y,z,size,sightings\n3,1,0.1,0,0.2\n");
  assert_refused(read_run_folder(folder), "boulders.csv:2: 5 fields under 6 column names");
  make_run("mixed");
  ordered_json old = summary("drive");
  old.erase("memory_bytes");
  scratch.file("mixed/summary.json", old.dump());
  assert_refused(read_run_folder(folder), "memory_bytes");
}

int cairn(const std::string& arguments) { return test::run_cairn(scratch, arguments).code; }

void test_a_run_of_the_sample(void**) {
  const std::string sample = CAIRN_SOURCE_DIR "/unit_tests/integration/sample";
  const fs::path out = scratch.path("sample");
  assert_int_equal(cairn("map build " + sample + "/ortho_5mm.tif -o " + scratch.path("map.cmap").string()),
                   0);
  assert_int_equal(cairn("run --dataset " + sample + " --map " + scratch.path("map.cmap").string() +
                         " --frames 0:30 --pictures 2 -o " + out.string()),
                   0);
  run = read_run_folder(out);
  assert_int_equal(run.at("frames").at("frame").size(), 30);
  double boulder_ms = 0.0;
  double ms = 0.0;
  for (std::size_t i = 0; i < 30; ++i) {
    const auto of = [&](const char* name) { return run.at("frames").at(name).at(i).get<double>(); };
    const double jobs = of("vo_ms") + of("boulder_ms") + of("fix_ms");
    assert_true(of("vo_ms") > 0.0 && of("boulder_ms") > 0.0 && jobs <= of("ms") + 0.01 &&
                jobs > 0.5 * of("ms"));
    boulder_ms += of("boulder_ms");
    ms += of("ms");
  }
  assert_true(boulder_ms > 0.25 * ms);  // half of it on every machine seen; less tells of time booked to VO
  // sigma_xy is the root of the mean variance.
  const CsvTable fixes(out / "fixes.csv");
  assert_int_equal(fixes.size(), 1);
  assert_true(fixes.word(0, fixes.column("status")) == "applied");
  const auto number = [&](const char* name) { return fixes.number(0, fixes.column(name)); };
  const double sx = number("sigma_x_m");
  const double sy = number("sigma_y_m");
  assert_true(std::fabs(std::sqrt(0.5 * (sx * sx + sy * sy)) - number("sigma_xy_m")) < 2.0e-5);
  assert_true(std::fabs(number("correlation_xy")) <= 1.0);

  assert_int_equal(run.at("strips").size(), 2);
  const ordered_json& strip = run.at("strips").at(1);  // chosen: 7 and 22
  assert_int_equal(strip.size(), 3);
  for (int i = 0; i < 3; ++i) assert_true(strip.at(i).at("frame") == 14 + 4 * i);
  const ordered_json& regions = strip.at(2).at("regions");
  int pixels = 0;
  for (std::size_t i = 1; i < regions.at("runs").size(); i += 2)
    pixels += regions.at("runs").at(i).get<int>();
  assert_int_equal(pixels, regions.at("width").get<int>() * regions.at("height").get<int>());
  // A label is one boulder of a frame, owns the points that it counts, and stays at its place over time.
  std::map<int, Vec2> before;
  int followed = 0;
  for (const ordered_json& p : strip) {
    std::map<int, Vec2> now;
    for (const ordered_json& b : p.at("boulders")) {
      const int label = b.at(0);
      assert_true(now.emplace(label, Vec2(b.at(1), b.at(2))).second);
      int points = 0;
      for (const ordered_json& q : p.at("points")) points += q.at(5) == label ? 1 : 0;
      assert_true(points == b.at(4));
      const auto then = before.find(label);
      if (then == before.end()) continue;
      ++followed;
      assert_true((then->second - now.at(label)).norm() < 0.25);
    }
    before = now;
  }
  if (followed < 4) fail_msg("only %d labels go on", followed);
}

/// The program: exit code 1, one line, and no page nor a part of one where something is wrong.
void check_refused(const std::string& arguments, const char* what) {
  assert_int_equal(cairn("report " + arguments), 1);
  const std::string said = text_of(scratch.path("stderr"));
  if (said.rfind("cairn: ", 0) != 0 || said.find('\n') != said.size() - 1 ||
      said.find(what) == std::string::npos)
    fail_msg("cairn report %s: expected one line with '%s', got '%s'", arguments.c_str(), what, said.c_str());
}

void test_the_program(void**) {
  const std::string one = make_run("one").string();
  const std::string two = make_run("two").string();
  assert_int_equal(cairn("report " + one + " " + two), 0);
  page = text_of(scratch.path("one/report.html"));
  assert_int_equal(embedded(page).at("runs").size(), 2);
  assert_false(fs::exists(scratch.path("two/report.html")));
  assert_int_equal(cairn("report " + one + " -o " + scratch.path("other.html").string()), 0);
  assert_true(fs::file_size(scratch.path("other.html")) > 10000);

  check_refused("", "runs");
  check_refused(scratch.path("none").string(), "none: no such folder");
  check_refused(two + " -o " + (scratch.path("none") / "x.html").string(), "x.html: cannot write here");
  scratch.file("two/summary.json", "{");
  check_refused(one + " " + two + " -o " + scratch.path("late.html").string(), "summary.json: is not whole");
  check_refused(two, "summary.json: is not whole");
  assert_false(fs::exists(scratch.path("two/report.html")));
  assert_false(fs::exists(scratch.path("late.html")));
}

/// The same words on stdout and in summary.json; what is wrong with the forecast leaves both as they were.
void test_beside_a_forecast(void**) {
  const std::string one = make_run("forecast").string();
  const std::string before = text_of(scratch.path("forecast/summary.json"));
  check_refused(one + " --forecast " + scratch.path("none.csv").string(), "none.csv");
  check_refused(one + " --forecast " + scratch.file("bad.csv", "arc_m\n1\n").string(), "p_applied");
  assert_true(text_of(scratch.path("forecast/summary.json")) == before);
  assert_false(fs::exists(scratch.path("forecast/report.html")));
  const std::string csv = scratch.file("good.csv", "arc_m,p_applied\n0.5,0.75\n").string();
  assert_int_equal(cairn("report " + one + " --forecast " + csv), 0);
  run = ordered_json::parse(text_of(scratch.path("forecast/summary.json")));
  const ordered_json& f = run.at("forecast");
  assert_true(f.at("tried") == 1 && f.at("observed") == 1 && f.at("expected") == 0.75);
  assert_true(f.at("probability_of_so_few") == 1.0 && f.at("likely_wrong") == false);
  assert_true(text_of(scratch.path("stdout")).rfind("forecast: " + f.at("words").get<std::string>(), 0) == 0);
  page = text_of(scratch.path("forecast/report.html"));
  assert_true(embedded(page).at("runs").at(0).at("summary").at("forecast") == f);
  run.erase("forecast");
  assert_true(run == ordered_json::parse(before));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_what_is_read),
      cmocka_unit_test(test_without_truth_map_and_pictures),
      cmocka_unit_test(test_the_page_needs_nothing_else),
      cmocka_unit_test(test_every_status_has_words),
      cmocka_unit_test(test_in_a_browser),
      cmocka_unit_test(test_without_truth_in_a_browser),
      cmocka_unit_test(test_names_cannot_break_out),
      cmocka_unit_test(test_several_runs),
      cmocka_unit_test(test_missing_images),
      cmocka_unit_test(test_folders_that_are_none),
      cmocka_unit_test(test_missing_and_cut_files),
      cmocka_unit_test(test_files_that_disagree),
      cmocka_unit_test(test_a_run_of_the_sample),
      cmocka_unit_test(test_the_program),
      cmocka_unit_test(test_beside_a_forecast),
  };
  return cmocka_run_group_tests_name("ground_tools/report/report", tests, nullptr, nullptr);
}
