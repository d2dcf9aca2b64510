// The program `cairn rig`: what a calibration says and what rectification makes of it, in words, JSON and a
// picture; exit status 0 for a rectified pair, 3 for a raw one.
#include <nlohmann/json.hpp>

#include "core/trig.hpp"
#include "ground_tools/program.hpp"

using namespace cairn;

namespace {

using nlohmann::json;

const test::Scratch scratch;

/// A kalibr chain of a wide lens; the right camera turned by so many degrees about y.
std::string chain(double turn_deg, const char* size = "[512, 384]", const char* lens = "-0.28, 0.07, 0, 0") {
  const double a = turn_deg / kDegPerRad;
  const std::string c = std::to_string(std::cos(a)), s = std::to_string(std::sin(a));
  const std::string camera =
      std::string("  camera_model: pinhole\n  intrinsics: [394, 394, 255.5, 191.5]\n") +
      "  distortion_model: radtan\n  distortion_coeffs: [" + lens + "]\n" + "  resolution: " + size + "\n";
  return "cam0:\n" + camera + "cam1:\n  T_cn_cnm1:\n  - [" + c + ", 0, " + s +
         ", -0.12]\n  - [0, 1, 0, 0]\n" + "  - [-" + s + ", 0, " + c + ", 0]\n  - [0, 0, 0, 1]\n" + camera;
}

std::string rig(const std::string& arguments, int code) {
  const test::Ended ended = test::run_cairn(scratch, "rig " + arguments);
  if (ended.code != code)
    fail_msg("cairn rig %s: exit code %d: %s", arguments.c_str(), ended.code, ended.errors.c_str());
  const std::vector<std::uint8_t> bytes = ground::read_file(scratch.path("stdout"));
  return {bytes.begin(), bytes.end()};
}

bool says(const std::string& text, const char* word) { return text.find(word) != std::string::npos; }

int count(const std::string& text, const std::string& word) {
  int found = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++found;
  return found;
}

void test_a_rectified_pair(void**) {
  const std::string file = scratch.file("calib.txt", "394.2 394.2 255.5 191.5 0.12\n").string();
  const std::string text = rig(file, 0);
  assert_true(says(text, "rectified, as far as a calibration can tell"));
  assert_true(says(text, "0.1200 m, along 1.0000 0.0000 0.0000"));
  assert_true(!says(text, "table") && !says(text, "warning"));
  assert_true(!json::parse(rig(file + " --json", 0)).contains("rectification"));
  test::check_refusal(scratch, "rig " + file + " --svg " + scratch.path("no.svg").string(),
                      "rectified as it is", "nothing to draw");
}

void test_a_raw_pair(void**) {
  const std::string file = scratch.file("chain.yaml", chain(1.5)).string();
  const std::string text = rig(file, 3);
  assert_true(says(text, "not rectified") && says(text, "turned    the right camera by"));
  assert_true(says(text, "1572864 operations a pair, 3.8 % of odometry's budget"));
  assert_true(!says(text, "warning"));
  const json told = json::parse(rig(file + " --json", 3));
  const json& made = told["rectification"];
  assert_near(std::fabs(told["right_turned_deg"][1].get<double>()), 1.5, 1e-3);
  assert_int_equal(made["table_bytes"], 2 * 8 * 65 * 49);
  const json& share = made["source_share"];
  assert_true(share["both"] <= share["left"] && share["both"] <= share["right"]);
  assert_at_least(share["both"].get<double>(), 0.9);
}

void test_the_picture(void**) {
  const std::string file = scratch.file("chain.yaml", chain(4.0, "[512, 384]", "0, 0, 0, 0")).string();
  const std::filesystem::path picture = scratch.path("rig.svg");
  rig(file + " --svg " + picture.string(), 3);
  const std::vector<std::uint8_t> bytes = ground::read_file(picture);
  const std::string svg(bytes.begin(), bytes.end());
  assert_true(says(svg, "left, rectified, 512 x 384 px") && says(svg, "right, rectified, 512 x 384 px"));
  assert_int_equal(count(svg, "class=\"frame\""), 2);
  assert_at_least(count(svg, "<polyline"), 2 * 2 * 10);  // sides, directions
  assert_at_least(count(svg, "class=\"none\""), 1);
}

void test_warnings(void**) {
  assert_true(
      says(rig(scratch.file("turned.yaml", chain(12.0)).string(), 3), "warning: the cameras are turned"));
  const std::string large = rig(scratch.file("large.yaml", chain(0.0, "[4096, 3072]")).string(), 3);
  assert_true(says(large, "warning: images are larger than this mission's"));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_a_rectified_pair),
      cmocka_unit_test(test_a_raw_pair),
      cmocka_unit_test(test_the_picture),
      cmocka_unit_test(test_warnings),
  };
  return cmocka_run_group_tests_name("cmd_rig", tests, nullptr, nullptr);
}
