// The program `cairn fix`: the right pose by the flight module's own verdict, exit status 0; whatever cannot
// be proved is declined, exit status 3; bad input ends in one line, exit status 1.
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "base/number_table.hpp"
#include "base/output_file.hpp"
#include "cmap/cmap_file.hpp"
#include "geometry/pose2.hpp"
#include "ground_tools/program.hpp"
#include "support/noise.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

using nlohmann::json;

constexpr double kSide_m = 60.0;
constexpr int kMapBoulders = 1800;  // 0.5 a square metre
constexpr int kTrue = 16;
constexpr int kClutter = 7;
constexpr double kNoise_m = 0.04;
constexpr double kRadius_m = 5.0;

const test::Scratch scratch;
Random dice(7);
std::vector<TableBoulder> rocks;
json answer;  // of the last `cairn fix --json`
std::string errors;

int make_input(void**) {
  for (int i = 0; i < kMapBoulders; ++i) {
    TableBoulder b;
    b.p_map_m = Vec2(test::uniform(dice, 0.0, kSide_m), test::uniform(dice, 0.0, kSide_m));
    b.diameter_m = test::uniform(dice, 0.1, 0.4);
    rocks.push_back(b);
  }
  write_file(scratch.path("rocks.csv"), to_csv(rocks));
  const std::vector<std::uint8_t> map = encode_cmap(rocks, {0.0, 0.0, kSide_m, kSide_m}, 0.002, {});
  OutputFile file(scratch.path("site.cmap"));
  file.write(map);
  file.commit();
  return 0;
}

struct View {
  Vec2 around_map_m = Vec2(30.0, 30.0);
  int trues = kTrue;
  int clutter = kClutter;
  bool mirrored = false;
  double scale = 1.0;  ///< of the map's metres
  double sizes = 0.0;  ///< factor on the diameters that are told; 0: none are
};

/// What a rover sees about a place, in the frame that T_map_local puts into the map.
void see(const Pose2& T_map_local, const View& view) {
  std::vector<Vec2> seen;
  std::vector<double> diameters_m;
  for (const TableBoulder& b : rocks) {
    if (static_cast<int>(seen.size()) == view.trues) break;
    if ((b.p_map_m - view.around_map_m).norm() > kRadius_m) continue;
    seen.push_back(b.p_map_m + kNoise_m * Vec2(test::normal(dice), test::normal(dice)));
    diameters_m.push_back(view.sizes * b.diameter_m);
  }
  for (int i = 0; i < view.clutter; ++i) {
    const double r = kRadius_m * std::sqrt(test::uniform(dice, 0.0, 1.0));
    const SinCos at = sin_cos(test::uniform(dice, -kPi, kPi));
    seen.push_back(view.around_map_m + r * Vec2(at.cos, at.sin));
    diameters_m.push_back(view.sizes * test::uniform(dice, 0.1, 0.4));
  }
  std::string text = view.sizes > 0.0 ? "x,y,diameter\n" : "x,y\n";
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Vec2 p = (T_map_local.inverse() * seen[i]) / view.scale;
    text += fmt::format("{:.5f},{:.5f}", view.mirrored ? -p.x() : p.x(), p.y());
    if (view.sizes > 0.0) text += fmt::format(",{:.3f}", diameters_m[i]);
    text += '\n';
  }
  scratch.file("local.csv", text);
}

std::string call(const std::string& more, const char* local = "local.csv") {
  return "fix " + scratch.path("site.cmap").string() + " --boulders " + scratch.path(local).string() + more;
}

int fix(const std::string& more) {
  const test::Ended ended = test::run_cairn(scratch, call(more + " --json"));
  errors = ended.errors;
  const std::vector<std::uint8_t> bytes = read_file(scratch.path("stdout"));
  answer = json::parse(bytes.begin(), bytes.end(), nullptr, false);
  return ended.code;
}

std::string prior(const Pose2& pose, const char* sigma = "0.3,0.3,2") {
  return fmt::format(" --prior {},{},{} --sigma {}", pose.x_m, pose.y_m, pose.yaw_rad * kDegPerRad, sigma);
}

void check_declined(const std::string& more, const char* status) {
  assert_int_equal(fix(more), 3);
  assert_string_equal(errors.c_str(), "");
  assert_false(answer["accepted"].get<bool>());
  for (const char* unknown : {"pose", "sigma", "covariance"}) assert_true(answer[unknown].is_null());
  if (answer["status"] != status) fail_msg("%s, not %s", answer["status"].dump().c_str(), status);
}

/// Accepted, at the pose, within four of its own sigmas; the boulders come to lie where they are.
void check_found(const Pose2& T_map_local, const Vec2& around_map_m) {
  assert_true(answer["accepted"].get<bool>());
  assert_true(answer["status"] == "accepted");
  const json& p = answer["pose"];
  const Pose2 found{p["x_m"], p["y_m"], p["yaw_deg"].get<double>() * kRadPerDeg};
  const Vec2 seen = found * (T_map_local.inverse() * around_map_m) - around_map_m;
  if (seen.norm() > 0.1) fail_msg("the boulders are %.3f m off", seen.norm());
  Mat3 covariance;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) covariance(i, k) = answer["covariance"][i][k];
  }
  const Vec3 off(found.x_m - T_map_local.x_m, found.y_m - T_map_local.y_m,
                 wrap_angle(found.yaw_rad - T_map_local.yaw_rad) * kDegPerRad);
  const double nees = off.dot(Vec3(covariance.inverse() * off));
  if (!(nees < 16.0 && nees > 1.0e-3)) fail_msg("%.1f sigmas off", std::sqrt(nees));
  assert_float_equal(answer["sigma"]["yaw_deg"].get<double>(), std::sqrt(covariance(2, 2)), 1e-9);
  assert_true(answer["pairs"] > 0.7 * kTrue && answer["pairs"] < kTrue + 3.0);
  assert_true(answer["log_ratio"] > answer["log_ratio_needed"]);
  assert_true(answer["operations"] > 10000);
  assert_int_equal(answer["local_boulders"].get<int>(), kTrue + kClutter);
}

void test_with_a_prior(void**) {
  const Pose2 truth{28.0, 31.0, 2.1};
  see(truth, {});
  const Pose2 thought{28.3, 30.6, 2.1 + 1.5 * kRadPerDeg};
  assert_int_equal(fix(prior(thought)), 0);
  check_found(truth, {30.0, 30.0});
  assert_false(answer["whole_search"].get<bool>());
  assert_float_equal(answer["prior_sigma"]["yaw_deg"].get<double>(), 2.0, 1e-9);
  assert_true(answer["sector_deg"].is_null());
}

/// The prior speaks of the frame's origin, wherever the boulders are in it.
void test_an_origin_away_from_the_boulders(void**) {
  const Pose2 truth{12.0, 18.0, -1.0};
  see(truth, {{30.0, 40.0}});
  assert_int_equal(fix(prior({12.2, 18.2, -1.0 + 0.02})), 0);
  check_found(truth, {30.0, 40.0});
}

void test_a_prior_that_is_wide_or_wrong(void**) {
  const Pose2 truth{28.0, 31.0, 2.1};
  see(truth, {});
  assert_int_equal(fix(prior({23.0, 35.0, 2.1 + 0.6}, "4,4,30")), 0);
  check_found(truth, {30.0, 30.0});
  assert_true(answer["whole_search"].get<bool>());
  assert_int_equal(fix(prior({48.0, 15.0, 2.1}, "0.3,0.3,2")), 3);
  assert_int_equal(fix(prior({30.0, 31.0, 2.1}, "0.3,0.3,2")), 3);
}

void test_lost(void**) {
  for (const Pose2& truth : {Pose2{15.0, 40.0, -2.5}, Pose2{-3000.0, 2000.0, 0.7}}) {
    see(truth, {{18.0, 38.0}});
    for (const char* how : {" --lost", ""}) {
      assert_int_equal(fix(how), 0);
      check_found(truth, {18.0, 38.0});
      assert_true(answer["prior"].is_null());
    }
  }
}

/// Where the map's metre is longer, the frame's origin lies as far from the boulders as the map has it, and
/// is as unsure as scale and heading leave it.
void test_lost_on_a_map_that_is_too_large(void**) {
  View view;
  view.scale = 1.04;
  view.trues = 26;
  const Pose2 T_map_local{55.0, 38.0, 2.0};
  for (int trial = 0; trial < 5; ++trial) {
    see(T_map_local, view);
    assert_int_equal(fix(" --lost"), 0);
    assert_near(answer["scale"].get<double>(), 1.04, 0.02);
    const json& p = answer["pose"];
    const Vec2 off = Vec2(p["x_m"], p["y_m"]) - T_map_local.translation();
    const double sigma_m = std::hypot(answer["sigma"]["x_m"].get<double>(), answer["sigma"]["y_m"]);
    assert_at_most(off.norm(), 3.0 * sigma_m);
    assert_at_most(sigma_m, 1.0);
  }
}

/// Diameters speak for the place where they are the map's, and against it where they are not. What places
/// prove in spite of them is the right pose.
void test_diameters_are_evidence(void**) {
  const Pose2 truth{28.0, 31.0, 2.1};
  constexpr double kSizes[3] = {0.4, 0.0, 1.0};  // times the map's; 0: not told
  for (const std::uint32_t seed : {11U, 12U, 13U, 14U}) {
    double log_ratio[3] = {};
    for (int k = 0; k < 3; ++k) {
      dice = Random(seed);
      View view;
      view.sizes = kSizes[k];
      see(truth, view);
      const int code = fix(prior({28.3, 30.6, 2.1}));
      assert_true(code == 0 || (k == 0 && code == 3));
      if (code == 0) check_found(truth, {30.0, 30.0});
      log_ratio[k] = answer["log_ratio"];
    }
    assert_at_least(log_ratio[1], log_ratio[0] + 3.0);
    assert_at_least(log_ratio[2], log_ratio[1] + 3.0);
  }
}

/// Headings outside are not looked at, inside they are; with a prior, both must hold.
void test_sectors(void**) {
  const Pose2 truth{28.0, 31.0, 175.0 * kRadPerDeg};
  see(truth, {});
  for (const char* with : {"150,200", "-190,-180", "170,-175", "0,360"}) {
    assert_int_equal(fix(std::string(" --sector ") + with), 0);
    check_found(truth, {30.0, 30.0});
  }
  for (const char* without : {"-170,160", "185,190", "0,170"}) {
    assert_int_equal(fix(std::string(" --sector ") + without), 3);
  }
  assert_int_equal(fix(prior({28.2, 30.7, truth.yaw_rad}) + " --sector 150,200"), 0);
  check_found(truth, {30.0, 30.0});
  assert_int_equal(fix(prior({28.2, 30.7, truth.yaw_rad}) + " --sector -30,150"), 3);
  check_declined(prior({28.2, 30.7, truth.yaw_rad - 0.3}) + " --sector 150,200", "inconsistent");
}

void test_what_cannot_be_proved(void**) {
  const Pose2 truth{28.0, 31.0, 0.4};
  see(truth, {{30.0, 30.0}, kTrue, kClutter, true});
  check_declined(" --lost", "too_little_evidence");
  check_declined(prior(truth), "too_little_evidence");
  see(truth, {{30.0, 30.0}, 0, 20, false});
  assert_int_equal(fix(" --lost"), 3);
  see(truth, {{30.0, 30.0}, 4, 0, false});
  check_declined(prior(truth), "too_little_evidence");
  scratch.file("local.csv", "x,y\n1,2\n");
  check_declined(prior(truth), "no_local_boulders");
  assert_true(answer["log_ratio"].is_null() && answer["pairs"].is_null());
  scratch.file("local.csv", "x,y\n1,2\n1.1,2\n1,2.1\n1.1,2.1\n");
  check_declined(" --lost", "no_local_boulders");
  scratch.file("local.csv", "x,y\n1,2\n3,4\n1,5\n");
  check_declined(prior({500.0, 500.0, 0.0}), "no_map_boulders");
}

void test_in_words(void**) {
  const Pose2 truth{28.0, 31.0, 0.4};
  see(truth, {});
  assert_int_equal(test::run_cairn(scratch, call(prior(truth))).code, 0);
  std::vector<std::uint8_t> bytes = read_file(scratch.path("stdout"));
  std::string text(bytes.begin(), bytes.end());
  for (const char* word : {"accepted (accepted)", "pose", "sigma", "log ratio", "second best", "operations"})
    assert_non_null(std::strstr(text.c_str(), word));
  see(truth, {{30.0, 30.0}, kTrue, kClutter, true});
  assert_int_equal(test::run_cairn(scratch, call(" --lost")).code, 3);
  bytes = read_file(scratch.path("stdout"));
  text.assign(bytes.begin(), bytes.end());
  assert_true(text.rfind("declined (too_little_evidence): unrelated boulders could", 0) == 0);
  assert_null(std::strstr(text.c_str(), "pose  "));
}

/// Names of columns, and those that are known beside x and y; blanks where not.
void test_columns(void**) {
  const Pose2 truth{28.0, 31.0, 0.4};
  see(truth, {});
  const std::vector<std::uint8_t> bytes = read_file(scratch.path("local.csv"));
  std::string text = "id,y_m,x_m,diameter_m,height,sigma_m\n";
  int id = 0;
  const std::string rows(bytes.begin() + 4, bytes.end());
  for (std::size_t at = 0, end; (end = rows.find('\n', at)) != std::string::npos; at = end + 1) {
    ++id;
    const std::size_t comma = rows.find(',', at);
    text += fmt::format("{},{},{},{},,0.03\n", id, rows.substr(comma + 1, end - comma - 1),
                        rows.substr(at, comma - at), id % 2 == 0 ? "0.2" : "");
  }
  scratch.file("local.csv", text);
  assert_int_equal(fix(prior(truth)), 0);
  check_found(truth, {30.0, 30.0});
}

/// Of no use, and no harm.
void test_strays_and_vague_boulders(void**) {
  const Pose2 truth{28.0, 31.0, 0.4};
  see(truth, {});
  const std::vector<std::uint8_t> bytes = read_file(scratch.path("local.csv"));
  const std::string rows(bytes.begin(), bytes.end());
  for (const char* stray : {"120,-90\n", "0,38\n-4000,0\n"}) {
    scratch.file("local.csv", rows + stray);
    for (const std::string& how : {prior(truth), std::string(" --lost")}) {
      assert_int_equal(fix(how), 0);
      check_found(truth, {30.0, 30.0});
      assert_non_null(std::strstr(errors.c_str(), "left out; check coordinates"));
    }
  }
  std::string with_sigma = "x,y,sigma\n";
  const std::string body = rows.substr(4);
  for (const std::string_view row : split(body, '\n'))
    if (!row.empty()) with_sigma += std::string(row) + ",\n";
  scratch.file("local.csv", with_sigma + "1,1,50\n");
  assert_int_equal(fix(" --lost"), 0);
  check_found(truth, {30.0, 30.0});
  assert_non_null(std::strstr(errors.c_str(), "1 boulder is left out; check sigma"));
}

/// Two groups of boulders far apart are two windows of one drive.
void test_a_group_far_away_stays(void**) {
  const Pose2 truth{28.0, 31.0, 0.4};
  see(truth, {});
  const std::vector<std::uint8_t> bytes = read_file(scratch.path("local.csv"));
  std::string rows(bytes.begin(), bytes.end());
  for (int i = 0; i < 6; ++i) rows += fmt::format("{},{}\n", 300 + i, i * i);
  scratch.file("local.csv", rows);
  static_cast<void>(fix(prior(truth)));
  assert_string_equal(errors.c_str(), "");
  assert_int_equal(answer["local_boulders"].get<int>(), kTrue + kClutter + 6);
}

void check_refused(const std::string& arguments, const char* what, const char* mend) {
  test::check_refusal(scratch, arguments, what, mend);
}

void test_bad_options(void**) {
  see({28.0, 31.0, 0.4}, {});
  check_refused(call(" --prior 1,2,3"), "--prior", "--sigma");
  check_refused(call(" --sigma 1,2,3"), "--sigma", "--prior");
  check_refused(call(" --lost --prior 1,2,3 --sigma 1,1,1"), "--lost", "leave one out");
  check_refused(call(" --prior 1,2 --sigma 1,1,1"), "--prior: 2 values", "X,Y,YAW");
  check_refused(call(" --prior 1,2,x --sigma 1,1,1"), "'x'", "X,Y,YAW");
  check_refused(call(" --prior 1,2,nan --sigma 1,1,1"), "'nan'", "X,Y,YAW");
  check_refused(call(" --prior 1e200,2,3 --sigma 1,1,1"), "--prior: 1e+200", "give");
  check_refused(call(" --prior 1,2,1e300 --sigma 1,1,1"), "--prior: 1e+300", "give");
  check_refused(call(" --prior 1,2,3 --sigma 0,1,1"), "--sigma: 0", "give");
  check_refused(call(" --prior 1,2,3 --sigma 1,-1,1"), "--sigma: -1", "give");
  check_refused(call(" --prior 1,2,3 --sigma 1,1,181"), "--sigma: 181", "give");
  check_refused(call(" --prior 1,2,3 --sigma 1,1e9,1"), "--sigma: 1000000000", "give");
  check_refused(call(" --sector 10"), "--sector: 1 values", "A,B");
  check_refused(call(" --sector 10,10"), "0 degrees wide", "A,B");
  check_refused(call(" --sector 10,400"), "390 degrees wide", "A,B");
  check_refused("fix " + scratch.path("site.cmap").string(), "--boulders", "--help");
}

void test_bad_files(void**) {
  const std::string site = "fix " + scratch.path("site.cmap").string() + " --boulders ";
  const auto with = [&](const std::string& csv) { return site + scratch.file("bad.csv", csv).string(); };
  check_refused(site + "missing.csv", "missing.csv", "check the name");
  check_refused(with(""), "bad.csv", "empty");
  check_refused(with("x,z\n1,2\n"), "bad.csv", "'y");
  check_refused(with("x,y\n1,2\n3,nan\n"), "bad.csv:3", "correct or remove this line");
  check_refused(with("x,y,sigma\n1,2,-1\n"), "bad.csv:2: sigma -1", "leave it empty");
  check_refused(with("x,y,height\n1,2,tall\n"), "bad.csv:2", "correct");
  check_refused(with("x,y\n1,2\n3e8,4\n"), "bad.csv:3", "origin");
  check_refused(with("x,y\n1,2\n400000,4\n"), "bad.csv", "metres");
  check_refused(with("x,y\n500000,2\n500003,4\n") + " --prior 1,2,3 --sigma 1,1,1", "bad.csv", "--prior");
  std::string many = "x,y\n";
  for (int i = 0; i < 5000; ++i) many += fmt::format("{},{}\n", i % 70, i / 70);
  check_refused(with(many), "bad.csv: has 5000 boulders", "keep the surest");
  const std::string local = " --boulders " + scratch.path("local.csv").string();
  check_refused("fix missing.cmap" + local, "missing.cmap", "check the name");
  check_refused("fix " + scratch.file("no.cmap", "no map").string() + local, "no.cmap", "is truncated");
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_with_a_prior),
      cmocka_unit_test(test_an_origin_away_from_the_boulders),
      cmocka_unit_test(test_a_prior_that_is_wide_or_wrong),
      cmocka_unit_test(test_lost),
      cmocka_unit_test(test_lost_on_a_map_that_is_too_large),
      cmocka_unit_test(test_diameters_are_evidence),
      cmocka_unit_test(test_sectors),
      cmocka_unit_test(test_what_cannot_be_proved),
      cmocka_unit_test(test_in_words),
      cmocka_unit_test(test_columns),
      cmocka_unit_test(test_strays_and_vague_boulders),
      cmocka_unit_test(test_a_group_far_away_stays),
      cmocka_unit_test(test_bad_options),
      cmocka_unit_test(test_bad_files),
  };
  return cmocka_run_group_tests(tests, make_input, nullptr);
}
