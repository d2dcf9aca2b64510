// The program `cairn sim` itself: what it writes is a data set that `cairn run` reads, it goes on where it
// was stopped, and each bad input ends in one line on stderr that names it and the mend.
#include <algorithm>
#include <cmath>

#include "dataset/dataset.hpp"
#include "ground_tools/program.hpp"
#include "ground_tools/raster_in_memory.hpp"
#include "replay/attitude_file.hpp"

using namespace cairn;
using namespace cairn::ground;
using test::Raster;
using test::read_orthoimage;

namespace {

namespace fs = std::filesystem;

const test::Scratch scratch;
std::string errors;  // what the last run wrote on stderr

int cairn(const std::string& arguments, const std::string& before = "") {
  const test::Ended ended = test::run_cairn(scratch, arguments, before);
  errors = ended.errors;
  return ended.code;
}

/// Small enough for the sanitizers: 64 x 64 pixels, four frames.
const std::string kSmall =
    " --set site.size_m=6 --set traverse.kind=straight --set traverse.length_m=0.18 --set traverse.margin_m=1"
    " --set rig.width_px=64 --set rig.height_px=64 --set rig.cx_px=31.5 --set rig.cy_px=31.5 --set "
    "rig.fx_px=50"
    " --set rig.fy_px=50 --set rocks.pebbles=0";

std::string out(const char* name) { return " -o " + scratch.path(name).string(); }

void check_refused(const std::string& arguments, const char* what, const char* mend) {
  test::check_refusal(scratch, "sim" + arguments, what, mend);
}

void test_writes_a_data_set(void**) {
  assert_int_equal(cairn("sim" + kSmall + out("set") + " --ortho 0.01,0.025 --set attitude.every_m=0.1"), 0);
  const Dataset set = Dataset::open(scratch.path("set"));
  assert_int_equal(set.size(), 4);
  assert_int_equal(set.rig().width_px, 64);
  for (std::size_t i = 0; i < set.size(); ++i) {
    const PairImages pair = set.images(i);
    assert_true(pair.faults.empty() && pair.left.width == 64 && pair.right.height == 64);
    assert_true(pair.left.pixels != pair.right.pixels);
    const Pose3 left = *set.truth_rover(i) * mast_pose(0.7, 39.0 * kRadPerDeg, 0.12);
    assert_near((left.t - set.truth_cam(i)->t).norm(), 0.0, 2.0e-6);
  }
  assert_near((set.truth_cam(3)->t - set.truth_cam(0)->t).norm(), 0.18, 0.01);
  for (const TruthRock& rock : set.truth_rocks()) assert_true(rock.diameter_m >= 0.05);

  assert_int_equal(read_attitudes(scratch.path("set/attitude.csv")).count(2), 1);  // after 0.12 m

  const Raster fine = read_orthoimage(scratch.path("set/ortho_10mm.tif"));
  const Raster coarse = read_orthoimage(scratch.path("set/ortho_25mm.tif"));
  assert_int_equal(fine.width, 600);
  assert_int_equal(coarse.width, 240);
  assert_near(fine.geo.c[0], coarse.geo.c[0], 1e-9);
  assert_near(fine.geo.c[3], coarse.geo.c[3], 1e-9);
  assert_near(coarse.geo.pixel_m(), 0.025, 1e-9);
  // The coarse image is the fine one's mean over 2.5 x 2.5 pixels; both are blurred by half
  // of their own pixel.
  double sum = 0.0;
  for (int v = 0; v < 240; ++v)
    for (int u = 0; u < 240; ++u) {
      const double a = coarse.grey_view().at(u, v);
      const int x = static_cast<int>(2.5 * u + 1.25);
      const int y = static_cast<int>(2.5 * v + 1.25);
      double b = 0.0;
      for (int k = 0; k < 9; ++k) {
        const double grey =
            fine.grey_view().at(std::clamp(x - 1 + k % 3, 0, 599), std::clamp(y - 1 + k / 3, 0, 599));
        b += grey * grey / 9.0;
      }
      sum += a - std::sqrt(b);
    }
  assert_near(sum / (240.0 * 240.0), 0.0, 1.0);
}

void test_goes_on_where_it_was_stopped(void**) {
  assert_int_equal(cairn("sim" + kSmall + out("stopped") + " --frames 0:2"), 0);
  const fs::path first = scratch.path("stopped/left/000000.png");
  const fs::path last = scratch.path("stopped/left/000003.png");
  const std::vector<std::uint8_t> whole = read_file(first);
  assert_false(fs::exists(last));
  fs::remove(first);
  scratch.file("stopped/left/000001.png", "stays");
  assert_int_equal(cairn("sim" + kSmall + out("stopped")), 0);
  assert_true(read_file(first) == whole);
  assert_int_equal(read_file(scratch.path("stopped/left/000001.png")).size(), 5);
  assert_true(fs::exists(last));
  check_refused(kSmall + " --set seed=9" + out("stopped"), "scene.toml", "another folder");
}

void test_refusals(void**) {
  check_refused(" nowhere.toml" + out("no"), "nowhere.toml", "file");
  check_refused(kSmall + " --set rocks.k=0.5" + out("no"), "rocks.k", "0.3");
  check_refused(kSmall + " --set rig.baseline_m=0" + out("no"), "baseline_m", "");
  check_refused(kSmall + " --set rig.pitch_down_deg=-60" + out("no"), "rig", "ground");
  check_refused(kSmall + " --set craters.k=-1" + out("no"), "craters.k", "0 to");
  check_refused(kSmall + " --frames 7:9" + out("no"), "--frames", "0:4");
  check_refused(kSmall + " --ortho 0" + out("no"), "ortho", "0.001");
  check_refused(kSmall + " --ortho 9" + out("no"), "ortho", "site");
  scratch.file("file", "no folder");
  check_refused(kSmall + " -o " + scratch.path("file").string() + "/within", "within", "");
  assert_false(fs::exists(scratch.path("no")));
}

/// A disk without space: /dev/full stands for it as far as a single file goes; a folder is simulated by a
/// limit on the size of files.
void test_full_disk(void**) {
  assert_int_equal(cairn("sim" + kSmall + out("full") + " --ortho 0.005", "trap '' XFSZ; ulimit -f 200; "),
                   1);
  assert_true(test::is_one_line(errors));
  assert_true(errors.find("ortho_5mm.tif") != std::string::npos);
  for (const auto& entry : fs::directory_iterator(scratch.path("full")))
    assert_true(entry.path().string().find(".part") == std::string::npos);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_writes_a_data_set),
      cmocka_unit_test(test_goes_on_where_it_was_stopped),
      cmocka_unit_test(test_refusals),
      cmocka_unit_test(test_full_disk),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
