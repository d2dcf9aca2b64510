// The program `cairn tape`: each bad input ends in one line on stderr that names it and the mend, exit code 1
// and no file; what a good run writes is the tape of doc/ICD.md, byte for byte.
#include "app/telecommand.hpp"
#include "base/output_file.hpp"
#include "cmap/cmap_file.hpp"
#include "core/big_endian.hpp"
#include "ground_tools/program.hpp"
#include "ground_tools/test_images.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

namespace fs = std::filesystem;

const test::Scratch scratch;
std::vector<std::uint8_t> map;
std::vector<std::uint8_t> tape;

std::string set(const char* name = "set") { return " --dataset " + scratch.path(name).string(); }
std::string out() { return " -o " + scratch.path("out.tape").string(); }
std::string map_at(const char* name) { return " --map " + scratch.path(name).string(); }

void check_refused(const std::string& arguments, const char* what, const char* mend) {
  test::check_refusal(scratch, "tape" + arguments, what, mend);
  for (const auto& entry : fs::directory_iterator(scratch.path("out.tape").parent_path())) {
    if (entry.path().filename().string().rfind("out.tape", 0) == 0)
      fail_msg("cairn tape%s: left %s", arguments.c_str(), entry.path().c_str());
  }
}

void make_set(const std::string& name) {
  for (const char* image : {"/left/0.png", "/right/0.png", "/left/5.png", "/right/5.png"})
    test::write_grey_png(scratch.path(name + image), 66, 64);
  scratch.file(name + "/calib.txt", "80 81 31.5 30.5 0.12\n");
}

int make_input(void**) {
  make_set("set");
  scratch.file("set/truth_rover.txt", "0 0 1 2 0.5 0 0 0\n5 1 2 2 0.5 0 0 0\n");
  scratch.file("set/times.txt", "0.5\n1.25\n");
  make_set("nowhere_to_start");
  std::vector<TableBoulder> boulders(3);
  for (int i = 0; i < 3; ++i) {
    boulders[i].p_map_m = Vec2(i, 2.0 * i);
    boulders[i].diameter_m = 0.2;
  }
  map = encode_cmap(boulders, extent_of(boulders), 0.01, {});
  OutputFile file(scratch.path("good.cmap"));
  file.write(map);
  file.commit();
  return 0;
}

/// Body of the record at `at`, which must be of this type; `at` goes behind its padding, which must be zeros.
std::vector<std::uint8_t> record(std::size_t& at, std::uint32_t type) {
  assert_true(at + 8 <= tape.size());
  assert_int_equal(be::get_u32(&tape[at]), type);
  const std::size_t size = be::get_u32(&tape[at + 4]);
  at += 8;
  assert_true(at + size <= tape.size());
  std::vector<std::uint8_t> body(tape.begin() + static_cast<std::ptrdiff_t>(at),
                                 tape.begin() + static_cast<std::ptrdiff_t>(at + size));
  for (at += size; at % 4 != 0; ++at) assert_int_equal(tape.at(at), 0);
  return body;
}

void make_tape(const std::string& arguments) {
  const test::Ended ended = test::run_cairn(scratch, "tape" + set() + out() + arguments);
  if (ended.code != 0 || !ended.errors.empty()) fail_msg("%s: %s", arguments.c_str(), ended.errors.c_str());
  tape = read_file(scratch.path("out.tape"));
  fs::remove(scratch.path("out.tape"));
}

void check_pair(const std::vector<std::uint8_t>& body, std::uint32_t number, std::uint64_t t_us) {
  assert_int_equal(body.size(), 28 + 2 * 66 * 64);
  assert_int_equal(be::get_u32(&body[0]), number);
  assert_true(be::get_u64(&body[4]) == t_us);
  for (const std::size_t side : {12U, 20U}) {
    assert_int_equal(be::get_u32(&body[side]), 66);
    assert_int_equal(be::get_u32(&body[side + 4]), 64);
  }
  for (const std::size_t side : {0U, 1U})
    assert_int_equal(body[28 + side * 66 * 64 + 66 * 3 + 7], test::texture(7, 3));
}

void test_whole_tape(void**) {
  make_tape(map_at("good.cmap"));
  assert_int_equal(be::get_u32(&tape[0]), 0x43544150);
  assert_int_equal(be::get_u32(&tape[4]), 1);
  static std::size_t at;
  static std::vector<std::uint8_t> body;
  at = 8;
  body = record(at, 1);
  assert_int_equal(body.size(), 48);
  assert_int_equal(be::get_u32(&body[0]), 66);
  assert_int_equal(be::get_u32(&body[4]), 64);
  static const double intrinsics[] = {80, 81, 31.5, 30.5, 0.12};
  for (std::size_t i = 0; i < 5; ++i) assert_near(be::get_f64(&body[8 + 8 * i]), intrinsics[i], 0);
  body = record(at, 2);
  app::Command command;
  assert_status(app::decode(body.data(), body.size(), command), app::CommandStatus::kAccepted);
  assert_status(command.type, app::CommandType::kSetStart);
  assert_near(command.pose.t.x(), 1, 0);
  assert_near(command.number[0], 0.05, 0);
  assert_near(command.number[1], 0.01, 0);
  body = record(at, 3);
  assert_true(body == map);
  body = record(at, 2);
  assert_status(app::decode(body.data(), body.size(), command), app::CommandStatus::kAccepted);
  assert_status(command.type, app::CommandType::kLoadMap);
  check_pair(record(at, 4), 0, 500000);
  check_pair(record(at, 4), 5, 1250000);
  assert_true(record(at, 0).empty());
  assert_int_equal(at, tape.size());
}

void test_a_part_without_map(void**) {
  make_tape(" --frames 1:");
  static std::size_t at;
  at = 8;
  static_cast<void>(record(at, 1));
  static std::vector<std::uint8_t> body;
  body = record(at, 2);
  app::Command command;
  assert_status(app::decode(body.data(), body.size(), command), app::CommandStatus::kAccepted);
  assert_near(command.pose.t.x(), 2, 0);
  check_pair(record(at, 4), 5, 1250000);
  static_cast<void>(record(at, 0));
  assert_int_equal(at, tape.size());
}

void test_data_sets(void**) {
  check_refused(set("nowhere") + out(), "nowhere", "folder");
  check_refused(out(), "--dataset", "--help");
  check_refused(set("nowhere_to_start") + out(), "no true pose of the rover", "truth_rover.txt");
}

void test_maps(void**) {
  check_refused(set() + out() + map_at("none.cmap"), "none.cmap", "check the name");
  scratch.file("text.cmap", std::string(500, 'x'));
  check_refused(set() + out() + map_at("text.cmap"), "text.cmap: is not a .cmap map", "cairn map build");
}

void test_frames(void**) {
  for (const char* part : {"1", "a:b", "-1:2", "1:x"})
    check_refused(set() + out() + " --frames " + part, "--frames", "FIRST:END");
  for (const char* part : {"2:", "1:1", ":0"})
    check_refused(set() + out() + " --frames " + part, "--frames", "a range within 0:2");
}

void test_outputs(void**) {
  check_refused(set(), "--output", "--help");
  check_refused(set() + " -o " + (scratch.path("file") / "under").string(), "file/under", "choose a folder");
  check_refused(set() + " -o /proc/cairn", "/proc/cairn", "choose a folder");
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_whole_tape), cmocka_unit_test(test_a_part_without_map),
      cmocka_unit_test(test_data_sets),  cmocka_unit_test(test_maps),
      cmocka_unit_test(test_frames),     cmocka_unit_test(test_outputs),
  };
  return cmocka_run_group_tests(tests, make_input, nullptr);
}
