// The program `cairn map uplink`: what it writes is ready to be sent; bad input ends in one line
// and nothing written.
#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "app/telecommand.hpp"
#include "base/output_file.hpp"
#include "cmap/uplink.hpp"
#include "ground_tools/program.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

namespace fs = std::filesystem;

const test::Scratch scratch;
std::vector<std::uint8_t> map;

std::string good() {
  return " " + scratch.path("site.cmap").string() + " --path " + scratch.path("path.csv").string();
}
std::string said() {
  const std::vector<std::uint8_t> bytes = read_file(scratch.path("stdout"));
  return {bytes.begin(), bytes.end()};
}
std::string to(const char* folder) { return " -o " + scratch.path(folder).string(); }

int make_input(void**) {
  std::vector<TableBoulder> boulders(200);
  for (int i = 0; i < 200; ++i) {
    boulders[i].p_map_m = Vec2(0.37 * (i * 7 % 100), 0.23 * (i * 31 % 100));
    boulders[i].diameter_m = 0.2 + 0.001 * i;
  }
  map = encode_cmap(boulders, extent_of(boulders), 0.01, {});
  OutputFile file(scratch.path("site.cmap"));
  file.write(map);
  file.commit();
  scratch.file("path.csv", "x,y\n1,1\n30,20\n");
  return 0;
}

void test_packets(void**) {
  const test::Ended ended =
      test::run_cairn(scratch, "map uplink" + good() + to("up") + " --chunk 64 --sequence 7");
  assert_int_equal(ended.code, 0);
  const PlannedPath path = path_of({Vec2(1, 1), Vec2(30, 20)});
  UplinkParams params;
  params.chunk_bytes = 64;
  static Cut cut;
  cut = cut_corridor(map, "site.cmap", path, params, std::nullopt);
  assert_true(read_file(scratch.path("up/map.cmap")) == cut.map);
  static std::vector<std::uint8_t> expected;
  expected = begin_packet(cut.upload, 7);
  std::uint32_t sequence = 8;
  for (const std::uint32_t n : send_order(cut.upload, cut.rank_of_tile)) {
    const PacketBytes packet = chunk_packet(cut.upload, n, sequence++);
    expected.insert(expected.end(), packet.begin(), packet.end());
  }
  assert_true(read_file(scratch.path("up/upload.tc")) == expected);
  assert_true(read_file(scratch.path("up/use.tc")) == use_packet(cut.upload, sequence));
  assert_int_equal(expected.size() + 16, link_bytes(cut.upload.plan));
}

/// The folder may be that of the map, and then what is whole stays whole.
void test_the_whole_map_stays(void**) {
  fs::create_directory(scratch.path("own"));
  fs::copy_file(scratch.path("site.cmap"), scratch.path("own/map.cmap"));
  const std::string path = " --path " + scratch.path("path.csv").string();
  test::check_refusal(scratch, "map uplink " + scratch.path("own/map.cmap").string() + path + to("own"),
                      "overwritten", "another folder");
  test::check_refusal(scratch,
                      "map uplink" + good() + to("own") + " --base " + scratch.path("own/map.cmap").string(),
                      "overwritten", "another folder");
  assert_true(read_file(scratch.path("own/map.cmap")) == map);
}

void test_lost_chunks_alone(void**) {
  static std::vector<std::uint8_t> sent;
  static std::vector<std::uint8_t> all;
  assert_int_equal(test::run_cairn(scratch, "map uplink" + good() + to("up5") + " --chunk 64").code, 0);
  all = read_file(scratch.path("up5/upload.tc"));
  assert_int_equal(
      test::run_cairn(scratch, "map uplink" + good() + to("up5") + " --chunk 64 --only 1,0").code, 0);
  sent = read_file(scratch.path("up5/lost.tc"));
  assert_true(read_file(scratch.path("up5/upload.tc")) == all);
  test::check_refusal(scratch, "map uplink" + good() + to("up5") + " --chunk 60 --only 1,0", "--only",
                      "give all else as it was before");
  assert_int_equal(sent.size(), 2 * (64 + 22));
  assert_int_equal(sent[8 + 5], 0);  // head first: chunk 0, then 1
  assert_memory_equal(sent.data() + 8, all.data() + 23 + 8, 64 + 10);
}

void test_json(void**) {
  assert_int_equal(test::run_cairn(scratch, "map uplink" + good() + to("up2") + " --json").code, 0);
  assert_true(read_file(scratch.path("stdout")) == read_file(scratch.path("up2/report.json")));
}

void test_base(void**) {
  assert_int_equal(test::run_cairn(scratch, "map uplink" + good() + to("up3")).code, 0);
  const std::string base = " --base " + scratch.path("up3/map.cmap").string();
  assert_int_equal(test::run_cairn(scratch, "map uplink" + good() + to("up4") + base).code, 0);
  assert_true(read_file(scratch.path("up4/upload.tc")).size() < 400);
  assert_non_null(std::strstr(said().c_str(), "nothing has changed"));
}

/// Numbers go on from upload to upload; who leaves them out with a base, which was an upload, is told.
void test_sequences_go_on(void**) {
  const auto next = [](const char* folder) {
    const std::vector<std::uint8_t> bytes = read_file(scratch.path(folder) / "report.json");
    return nlohmann::json::parse(bytes).at("upload").at("next_sequence").get<std::uint32_t>();
  };
  const auto number_in = [](const char* folder, const char* file) {  // of the first packet
    const std::vector<std::uint8_t> bytes = read_file(scratch.path(folder) / file);
    app::Command command;
    const std::size_t size = std::string(file) == "use.tc" ? bytes.size() : begin_packet({}, 0).size();
    assert_status(app::decode(bytes.data(), size, command), app::CommandStatus::kAccepted);
    return command.sequence;
  };
  assert_int_equal(test::run_cairn(scratch, "map uplink" + good() + to("first")).code, 0);
  assert_int_equal(number_in("first", "upload.tc"), 0);
  assert_int_equal(next("first"), number_in("first", "use.tc") + 1);
  const std::string told = "next upload       --sequence " + std::to_string(next("first"));
  assert_non_null(std::strstr(said().c_str(), told.c_str()));
  const std::string base = " --base " + scratch.path("first/map.cmap").string();
  test::Ended ended = test::run_cairn(scratch, "map uplink" + good() + to("second") + base);
  assert_int_equal(ended.code, 0);
  assert_non_null(std::strstr(ended.errors.c_str(), "warning: --sequence"));
  ended = test::run_cairn(
      scratch, "map uplink" + good() + to("second") + base + " --sequence " + std::to_string(next("first")));
  assert_int_equal(ended.code, 0);
  assert_true(ended.errors.empty());
  assert_int_equal(number_in("second", "upload.tc"), next("first"));
  assert_true(next("second") > next("first"));
}

/// A boulder struck out in a spreadsheet is a small delta.
void test_an_edited_map_is_a_delta(void**) {
  const std::string site = scratch.path("site.cmap").string();
  assert_int_equal(test::run_cairn(scratch, "map uplink" + good() + to("up6") + " --tile 5 --width 40").code,
                   0);
  const std::string table = scratch.path("edited.csv").string();
  assert_int_equal(test::run_cairn(scratch, "map unpack " + site + " --csv " + table).code, 0);
  static std::string text;
  const std::vector<std::uint8_t> bytes = read_file(table);
  text.assign(bytes.begin(), bytes.end());
  text.erase(text.rfind('\n', text.size() - 2) + 1);
  scratch.file("edited.csv", text.c_str());
  const std::string edited = scratch.path("edited.cmap").string();
  assert_int_equal(
      test::run_cairn(scratch, "map build --from-csv " + table + " --like " + site + " -o " + edited).code,
      0);
  const std::string base = " --base " + scratch.path("up6/map.cmap").string();
  const std::string way = " --path " + scratch.path("path.csv").string();
  assert_int_equal(
      test::run_cairn(scratch, "map uplink " + edited + way + base + to("up7") + " --width 40").code, 0);
  assert_non_null(std::strstr(said().c_str(), ", delta: "));
  assert_null(std::strstr(said().c_str(), "nothing has changed"));
  assert_true(2 * fs::file_size(scratch.path("up7/upload.tc")) <
              fs::file_size(scratch.path("up6/upload.tc")));
}

/// Fixes that a forecast counts on end the growth of the corridor; sizes are given as people write them.
void test_fixes_of_a_forecast(void**) {
  scratch.file("forecast.csv", "arc_m,p_applied,blind\n5,0.9,0\n20,0.9,0\n30,0.1,1\n");
  const std::string fixes = " --fixes " + scratch.path("forecast.csv").string();
  assert_int_equal(
      test::run_cairn(scratch, "map uplink" + good() + to("up8") + " --drift 10 --budget 1M" + fixes).code,
      0);
  const double length_m = std::hypot(29.0, 19.0);
  const std::string end =
      fmt::format("{:.1f} m at its end", UplinkParams().half_width_m + 0.1 * (length_m - 20.0));
  assert_non_null(std::strstr(said().c_str(), end.c_str()));
  scratch.file("forecast.csv", "arc_m,x_m,y_m,blind\n5,5.18,3.74,0\n20,18,2,0\n");
  test::check_refusal(scratch, "map uplink" + good() + to("no") + fixes, "forecast.csv",
                      "of the same --path");
}

/// As people write sizes; what is none is told in one short line.
void test_budgets(void**) {
  assert_int_equal(
      test::run_cairn(scratch, "map uplink" + good() + to("up1500") + " --budget 1500 --json").code, 0);
  static std::string expected;
  expected = said();
  for (const char* same : {"1.5k", "1.5K", "1.5kB", "0.0015M"}) {
    assert_int_equal(
        test::run_cairn(scratch, "map uplink" + good() + to("up1500") + " --json --budget " + same).code, 0);
    assert_string_equal(said().c_str(), expected.c_str());
  }
  for (const char* bad : {"0", "-5", "2q", "k", "1.5kk", "1e3", "0.5", "9t"}) {
    test::check_refusal(scratch, "map uplink" + good() + to("no") + " --budget=" + bad, "--budget", "1.5k");
    assert_true(
        test::run_cairn(scratch, "map uplink" + good() + to("no") + " --budget=" + bad).errors.size() < 200);
  }
  const test::Ended ended = test::run_cairn(scratch, "map build --from-csv x.csv --quantum 0" + to("no"));
  assert_true(ended.code == 1 && ended.errors.size() < 200);
}

void test_a_short_way_is_doubted(void**) {
  const std::string way = scratch.file("degrees.csv", "x,y\n1.1,1.2\n1.2,1.3\n").string();
  const test::Ended ended = test::run_cairn(
      scratch, "map uplink " + scratch.path("site.cmap").string() + " --path " + way + to("up9"));
  assert_int_equal(ended.code, 0);
  assert_non_null(std::strstr(ended.errors.c_str(), "are they degrees?"));
}

void check_refused(const std::string& arguments, const char* what, const char* mend) {
  test::check_refusal(scratch, "map uplink" + arguments + to("none"), what, mend);
  assert_false(fs::exists(scratch.path("none")));
}

void test_refusals(void**) {
  const std::string site = " " + scratch.path("site.cmap").string();
  const auto with = [&](const char* csv) { return site + " --path " + scratch.file("p.csv", csv).string(); };
  check_refused(site + " --path missing.csv", "missing.csv", "check the name");
  check_refused(with("x,y\n1,1\n2,a\n"), "p.csv:3", "correct or remove this line");
  check_refused(with("x,y\n1,1\n"), "p.csv", "two or more");
  check_refused(with("x,y\n1,1\n2000,1\n"), "way-point 2", "move it");
  check_refused(" " + scratch.path("path.csv").string() + " --path " + scratch.path("path.csv").string(),
                "path.csv", "is truncated");
  check_refused(good() + " --budget 60", "--budget", "needs at least");
  check_refused(good() + " --chunk 8", "--chunk", "16 to 490");
  check_refused(good() + " --base " + scratch.path("path.csv").string(), "path.csv", "is truncated");
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_packets),
      cmocka_unit_test(test_the_whole_map_stays),
      cmocka_unit_test(test_lost_chunks_alone),
      cmocka_unit_test(test_json),
      cmocka_unit_test(test_base),
      cmocka_unit_test(test_sequences_go_on),
      cmocka_unit_test(test_an_edited_map_is_a_delta),
      cmocka_unit_test(test_fixes_of_a_forecast),
      cmocka_unit_test(test_budgets),
      cmocka_unit_test(test_a_short_way_is_doubted),
      cmocka_unit_test(test_refusals),
  };
  return cmocka_run_group_tests(tests, make_input, nullptr);
}
