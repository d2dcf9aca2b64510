// The program `cairn run` itself: each bad input ends in one line on stderr that names it and the mend, exit
// code 1 and no file; a good run leaves its eleven files and nothing else.
#include <ogr_spatialref.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <limits>
#include <nlohmann/json.hpp>

#include <cstring>

#include "base/output_file.hpp"
#include "cmap/cmap_file.hpp"
#include "core/big_endian.hpp"
#include "core/crc32.hpp"
#include "ground_tools/program.hpp"
#include "ground_tools/test_images.hpp"
#include "support/plane_scene.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

namespace fs = std::filesystem;

const test::Scratch scratch;
std::string errors;  // what the last run wrote on stderr
std::vector<std::uint8_t> map;

int cairn(const std::string& arguments) {
  const test::Ended ended = test::run_cairn(scratch, arguments);
  errors = ended.errors;
  return ended.code;
}

std::string set(const char* name = "set") { return " --dataset " + scratch.path(name).string(); }
std::string out() { return " -o " + scratch.path("out").string(); }
std::string map_at(const char* name) { return " --map " + scratch.path(name).string(); }
const std::string kStart = " --start 1,2,0,0,0,90";

/// `cairn run ARGUMENTS` in a process of its own, that gets the signal once it has begun to
/// write into `folder`.
int code_of_interrupted(std::vector<std::string> arguments, const fs::path& folder, int signal) {
  static std::string program;
  program = fs::read_symlink("/proc/self/exe").parent_path() / "../../../cairn";
  arguments.insert(arguments.begin(), {program, "run"});
  static std::vector<char*> words;
  words.clear();
  for (std::string& word : arguments) words.push_back(word.data());
  words.push_back(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    ::execv(program.c_str(), words.data());
    ::_exit(127);
  }
  int how = 0;
  const auto ended = [&] { return ::waitpid(child, &how, WNOHANG) == child; };
  const auto begun = [&] { return fs::exists(folder) && !fs::is_empty(folder); };
  while (!begun()) {
    if (ended()) return -1;
    ::usleep(1000);
  }
  ::kill(child, signal);
  assert_int_equal(::waitpid(child, &how, 0), child);
  return WIFEXITED(how) ? WEXITSTATUS(how) : -1;
}

/// Refused, without results: not even a folder.
void check_refused(const std::string& arguments, const char* what, const char* mend) {
  test::check_refusal(scratch, "run" + arguments, what, mend);
  if (fs::exists(scratch.path("out"))) fail_msg("cairn run%s: left an output folder", arguments.c_str());
}

void save(const char* name, const std::vector<std::uint8_t>& bytes) {
  OutputFile file(scratch.path(name));
  file.write(bytes);
  file.commit();
}

void make_set(const std::string& name, int width, int height) {
  for (const char* image : {"/left/0.png", "/right/0.png", "/left/1.png", "/right/1.png"})
    test::write_grey_png(scratch.path(name + image), width, height);
  scratch.file(name + "/calib.txt", "80 80 " + std::to_string((width - 1) / 2.0) + " " +
                                        std::to_string((height - 1) / 2.0) + " 0.12\n");
}

/// Pairs over a textured plane, a step apart: a drive that can be measured. Right images are `lower_px` rows
/// lower; `swapped`: left for right.
void make_drive(const std::string& name, int lower_px = 0, bool swapped = false, int frames = 2,
                double step_m = 0.05) {
  static test::PlaneScene scene;
  static bool made = false;
  if (!made) scene.make(7);
  made = true;
  StereoRig rig{256, 192, 200.0, 200.0, 127.5, 95.5, 0.12, {}};
  const Pose3 T_rover_cam = mast_pose(0.7, 39.0 * kRadPerDeg, rig.baseline_m);
  Random random(3);
  static std::vector<std::uint8_t> pixels;
  pixels.resize(256 * 192);
  for (int i = 0; i < frames; ++i) {
    for (const bool right : {false, true}) {
      const Pose3 T_map_rover{Quat(1.0, 0.0, 0.0, 0.0), Vec3(step_m * i, 0.0, 0.0)};
      scene.render(rig, T_map_rover * T_rover_cam, right, 1.0, random, pixels.data());
      const auto grey = [&](int, int x, int y) {
        return pixels[256 * std::max(0, y - (right ? lower_px : 0)) + x];
      };
      test::write_image(
          scratch.path(name + (right != swapped ? "/right/" : "/left/") + std::to_string(i) + ".png"), "PNG",
          GDT_Byte, 256, 192, 1, grey);
    }
  }
  scratch.file(name + "/calib.txt", "200 200 127.5 95.5 0.12\n");
}

int make_input(void**) {
  make_drive("set");
  make_set("large", cfg::kImageWidth + 2, cfg::kImageHeight);
  std::vector<TableBoulder> boulders(3);
  for (int i = 0; i < 3; ++i) {
    boulders[i].p_map_m = Vec2(i, 2.0 * i);
    boulders[i].diameter_m = 0.2;
  }
  map = encode_cmap(boulders, extent_of(boulders), 0.01, {});
  save("good.cmap", map);
  return 0;
}

int files_in(const fs::path& folder) {
  int count = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder)) ++count;
  return count;
}

void test_good_runs(void**) {
  for (const std::string& arguments :
       {kStart + " --no-map", kStart + map_at("good.cmap"), std::string(" --no-map"),
        std::string(" --start -1.5,-2,0,0,0,-90 --no-map --frames 1: --degrade scale=1.02,yaw=-0.1deg/m")}) {
    const int code = cairn("run" + set() + out() + arguments);
    if (code != 0 || !errors.empty()) fail_msg("%s: %d, %s", arguments.c_str(), code, errors.c_str());
    for (const char* name :
         {"vo.tum", "corrected.tum", "truth.tum", "boulders.csv", "orbital.csv", "fixes.csv", "frames.csv",
          "pairs.csv", "summary.json", "pictures.json", "plot.svg"}) {
      assert_true(fs::file_size(scratch.path("out") / name) > 0);
    }
    assert_int_equal(files_in(scratch.path("out")), 11);
  }
  fs::remove_all(scratch.path("out"));
}

void test_an_image_that_cannot_be_read_is_a_warning(void**) {
  make_drive("holes", 0, false, 3);
  scratch.file("holes/left/1.png", "no PNG");
  assert_int_equal(cairn("run" + set("holes") + out() + kStart + " --no-map"), 0);
  assert_true(errors.find("cairn: warning: ") == 0 && errors.find("left/1.png") != std::string::npos);
  fs::remove_all(scratch.path("out"));
  // Of many five are told by name.
  make_drive("ruins", 0, false, 10);
  for (int i = 2; i < 10; ++i) scratch.file("ruins/left/" + std::to_string(i) + ".png", "no PNG");
  assert_int_equal(cairn("run" + set("ruins") + out() + kStart + " --no-map"), 0);
  assert_true(errors.find("ruins/left/6.png") != std::string::npos &&
              errors.find("ruins/left/7.png") == std::string::npos);
  assert_true(errors.find("cairn: warning: and 3 more of that kind\n") != std::string::npos);
  fs::remove_all(scratch.path("out"));
}

/// Times in milliseconds from 0; then two pairs of frames that changed places.
void test_order_and_times_are_told(void**) {
  const auto expect = [](const char* words) {
    assert_int_equal(cairn("run" + set("mixed") + out() + kStart + " --no-map"), 0);
    if (!test::is_one_line(errors) || errors.find(words) == std::string::npos)
      fail_msg("no '%s' in '%s'", words, errors.c_str());
    fs::remove_all(scratch.path("out"));
  };
  make_drive("mixed", 0, false, 8);
  scratch.file("mixed/times.txt", "0\n50\n100\n150\n200\n250\n300\n350\n");
  expect("mixed: stamps are 50 s and ");
  for (const char* side : {"mixed/left/", "mixed/right/"}) {
    const auto image = [&](const char* name) { return scratch.path(std::string(side) + name); };
    for (const auto& [a, b] : {std::pair("1.png", "4.png"), {"3.png", "6.png"}}) {
      fs::rename(image(a), image("spare"));
      fs::rename(image(b), image(a));
      fs::rename(image("spare"), image(b));
    }
  }
  expect("mixed: VO turns back at ");
}

// The one exit code that scripts look at: results are written, and yet nothing was driven. No pair is usable,
// so that the start pose is held from the first frame on.
void test_a_drive_that_never_moved_fails(void**) {
  make_set("still", 64, 64);  // too small for VO
  assert_int_equal(cairn("run" + set("still") + out() + kStart + " --no-map"), 1);
  assert_true(errors.find("no step of the drive was measured (of 2 frames 2 held") != std::string::npos);
  assert_true(fs::exists(scratch.path("out/vo.tum")));
  fs::remove_all(scratch.path("out"));
}

/// Pictures of a rover that stands differ by their noise; those of a camera that froze do not.
void test_a_rover_that_stands_is_told_from_frozen_images(void**) {
  make_drive("standing", 0, false, 4, 0.0);
  assert_int_equal(cairn("run" + set("standing") + out() + kStart + " --no-map"), 3);
  assert_true(test::is_one_line(errors) && errors.find("nothing moved: over 4 frames") != std::string::npos);
  assert_true(fs::exists(scratch.path("out/vo.tum")));
  fs::remove_all(scratch.path("out"));
  std::string truth;
  for (int i = 0; i < 4; ++i) truth += std::to_string(i) + " 0 0 0 -0.638224 0.638224 -0.304417 0.304417\n";
  scratch.file("standing/truth_left_camera.tum", truth);
  assert_int_equal(cairn("run" + set("standing") + out() + kStart + " --no-map"), 0);
  assert_true(errors.empty());
  fs::remove_all(scratch.path("out"));
  make_drive("single", 0, false, 1);
  assert_int_equal(cairn("run" + set("single") + out() + kStart + " --no-map"), 3);
  assert_true(errors.find("one pair alone") != std::string::npos);
  fs::remove_all(scratch.path("out"));
  for (const char* side : {"left", "right"}) {
    for (int i = 0; i < 4; ++i)
      fs::copy_file(scratch.path("set") / side / "0.png",
                    scratch.path(std::string("frozen/") + side + "/" + std::to_string(i) + ".png"));
  }
  scratch.file("frozen/calib.txt", "200 200 127.5 95.5 0.12\n");
  assert_int_equal(cairn("run" + set("frozen") + out() + kStart + " --no-map"), 1);
  assert_true(errors.find("no step of the drive was measured (of 4 frames 3 held, 0 extrapolated): left and "
                          "right images repeat") != std::string::npos);
  fs::remove_all(scratch.path("out"));
}

void test_what_images_say_is_told(void**) {
  make_drive("lower", 3);
  assert_true(cairn("run" + set("lower") + out() + kStart + " --no-map") >= 0);
  if (errors.find("right images lie 3.0") == std::string::npos)
    fail_msg("no word of 3 px in '%s'", errors.c_str());
  fs::remove_all(scratch.path("out"));
  make_drive("swapped", 0, true);
  check_refused(set("swapped") + out() + kStart + " --no-map", "swapped", "exchange the folders");
}

void test_truth_of_another_drive_is_told(void**) {
  make_drive("scale", 0, false, 8);
  const auto told = [](double x_m, double y_m, const char* words, int first = 0, int end = 8) {
    std::string truth;
    for (int i = first; i < end; ++i) {
      truth += std::to_string(i) + " " + std::to_string(x_m * i) + " " + std::to_string(y_m * i) +
               " 0 -0.638224 0.638224 -0.304417 0.304417\n";
    }
    scratch.file("scale/truth_left_camera.tum", truth);
    assert_int_equal(cairn("run" + set("scale") + out() + " --no-map"), 0);
    if (errors.find(words) == std::string::npos) fail_msg("no '%s' in '%s'", words, errors.c_str());
    const nlohmann::json summary = nlohmann::json::parse(read_file(scratch.path("out/summary.json")));
    fs::remove_all(scratch.path("out"));
    return summary;
  };
  static_cast<void>(told(0.5, 0.0, "the true one 3.5 m; are baseline"));
  static_cast<void>(told(0.5, 0.0, "the true one 3 m; are baseline", 0, 7));
  static_cast<void>(told(0.0, 0.0, "the true one 0 m (it never moves); are baseline"));
  static_cast<void>(told(0.0, 0.05, "off the truth after 0.35 m; is the truth that of the left camera"));
  static_cast<void>(
      told(0.0, 0.05, "off the truth after 0.30 m; is the truth that of the left camera", 0, 7));
  static_cast<void>(told(0.05, 0.0, ""));
  assert_true(errors.empty());
  // Truth that begins later, of a camera that looks east as the drive from the origin does not: no error.
  const nlohmann::json late = told(0.05, 0.0, "the truth begins at frame 3", 3);
  assert_true(errors.find("off the truth") == std::string::npos);
  assert_true(late.at("vo").at("end_3d_m").get<double>() < 0.01);
  assert_true(late.at("vo").at("end_rotation_deg").get<double>() < 0.5);
  assert_int_equal(cairn("run" + set("scale") + out() + map_at("good.cmap")), 1);
  assert_true(errors.find("no truth to start from; give --start") != std::string::npos);
  assert_true(errors.find("--frames 3: where it begins") != std::string::npos);
}

// A calibration from elsewhere takes the place of the data set's own.
void test_calibration_option(void**) {
  scratch.file("ros_left.yaml",
               "image_width: 256\nimage_height: 192\nP: [200, 0, 127.5, 0, 0, 200, 95.5, 0, 0, 0, 1, 0]\n");
  scratch.file("ros_right.yaml",
               "image_width: 256\nimage_height: 192\nP: [200, 0, 127.5, -24, 0, 200, 95.5, 0, 0, 0, 1, 0]\n");
  const std::string both = " --calibration " + scratch.path("ros_left.yaml").string() + " " +
                           scratch.path("ros_right.yaml").string();
  assert_int_equal(cairn("run" + set() + both + out() + kStart + " --no-map"), 0);
  fs::remove_all(scratch.path("out"));
  check_refused(set() + " --calibration " + scratch.path("ros_left.yaml").string() + out() + " --no-map",
                "ros_left.yaml", "two files");
}

void test_data_sets(void**) {
  check_refused(set("nowhere") + out() + kStart + " --no-map", "nowhere", "folder");
  check_refused(out() + kStart + " --no-map", "--dataset", "--scene");
  check_refused(set() + " --scene nowhere.toml" + out() + " --no-map", "--dataset", "remove one");
  check_refused(" --scene " + scratch.path("nowhere.toml").string() + out() + " --no-map", "nowhere.toml",
                "file");
  check_refused(" --set rig.height_m=1" + out() + " --no-map", "custom", "MISSION");
  check_refused(set() + kStart + " --no-map", "--output", "--help");
  check_refused(set("large") + out() + kStart + " --no-map", "large", "MISSION");
  check_refused(set() + out() + kStart + " --no-map --start-sigma 0,1", "--start-sigma: 0", "0.001");
  check_refused(set() + out() + kStart + " --no-map --start-sigma 1,1e9", "--start-sigma: 1000000000", "572");
  check_refused(set() + out() + map_at("good.cmap"), "no truth to start from", "--start");
}

/// A map that this mission makes little of is driven over, with a word on which would.
void test_coarse_maps(void**) {
  const std::vector<TableBoulder> boulders(3);
  CmapSource source;
  for (const double pixel_m : {0.02, 0.05}) {
    source.pixel_m = pixel_m;
    save("coarse.cmap", encode_cmap(boulders, {-1.0, -1.0, 1.0, 1.0}, 0.01, source));
    assert_int_equal(cairn("run" + set() + out() + kStart + map_at("coarse.cmap")), 0);
    const bool told = errors.find("50 mm a pixel; mission 'paper' keeps no landmarks") != std::string::npos;
    assert_true(told == (pixel_m > 0.035 && !cfg::kHaveLandmarks));
  }
  fs::remove_all(scratch.path("out"));
}

/// One line for each fault; what is good is taken, and told in frames.csv.
void test_attitudes(void**) {
  const std::string drive = set() + out() + kStart + " --no-map";
  const std::string head = "frame,up_x,up_y,up_z,up_sigma_deg,yaw_deg,yaw_sigma_deg\n";
  const auto table = [&](const std::string& rows) {
    scratch.file("attitude.csv", head + rows);
    return " --attitude " + scratch.path("attitude.csv").string();
  };
  check_refused(drive + table("1,0,0,9.81,0.2,,\n"), "attitude.csv:2", "divide");
  check_refused(drive + table("1,0,0,1,,,\n"), "attitude.csv:2", "sigma is missing");
  check_refused(drive + table("1,,,,,12,0\n"), "attitude.csv:2", "yaw_sigma_deg");
  check_refused(drive + table("1,0,0,1,-0.2,,\n"), "attitude.csv:2", "up_sigma_deg");
  check_refused(drive + table("1,,,,,400,0.2\n"), "attitude.csv:2", "yaw_deg");
  check_refused(drive + table("1,,,,,,\n"), "attitude.csv:2", "leave the row out");
  check_refused(drive + table("1,0,0,1,20,,\n1,0,0,1,20,,\n"), "attitude.csv:3", "twice");
  check_refused(drive + table("x,0,0,1,20,,\n"), "attitude.csv:2", "stereo pair");
  check_refused(drive + table("1,0,0,one,20,,\n"), "attitude.csv", "one");
  check_refused(drive + table("9999,0,0,1,20,,\n"), "9999", "is not in");
  check_refused(drive + table(""), "attitude.csv: has column names and no row", "leave it out");
  assert_int_equal(cairn("run" + drive + table("1,0,0,1,20,,\n")), 0);
  assert_true(errors.empty());
  // Pointing down, and a heading of the other side: nothing is taken, and that is said.
  assert_int_equal(cairn("run" + drive + table("1,0,0,-1,0.2,-90,0.2\n")), 0);
  for (const char* words :
       {"attitude.csv: of 1 measured gravities none was taken (1 inconsistent); is `up` away",
        "attitude.csv: of 1 measured headings none was taken (1 inconsistent); is yaw in degrees"}) {
    if (errors.find(words) == std::string::npos) fail_msg("no '%s' in '%s'", words, errors.c_str());
  }
  assert_int_equal(cairn("run" + drive + " --frames 0:1" + table("1,0,0,1,20,,\n")), 0);
  assert_true(errors.find("none of its rows is of a frame that is driven") != std::string::npos);
  fs::remove_all(scratch.path("out"));
}

/// The rover in the drive's own pictures: of their size, and neither nothing nor all.
void test_masks(void**) {
  const auto mask = [](int width, int height, int from) {
    test::write_image(scratch.path("mask.png"), "PNG", GDT_Byte, width, height, 1,
                      [from](int, int, int y) { return y >= from ? 255 : 0; });
    return " --mask " + scratch.path("mask.png").string();
  };
  const std::string drive = set() + out() + kStart + " --no-map";
  assert_int_equal(cairn("run" + drive + mask(256, 192, 160)), 0);
  fs::remove_all(scratch.path("out"));
  check_refused(drive + mask(256, 96, 32), "256 x 96", "draw");
  check_refused(drive + mask(256, 192, 192), "black", "leave");
  check_refused(drive + mask(256, 192, 0), "white", "alone");
  check_refused(drive + " --mask nowhere.png", "nowhere.png", "white");
  // Of a raw rig, on its raw images, whatever their size is.
  const std::string raw =
      " --calibration " +
      scratch.file("raw.txt", "200 0 127.5 0 0 200 95.5 0 0 0 1 0\n200 0 131.5 -24 0 200 95.5 0 0 0 1 0\n")
          .string();
  assert_int_equal(cairn("run" + drive + raw + mask(256, 192, 160)), 0);
  fs::remove_all(scratch.path("out"));
  assert_int_equal(cairn("run" + drive + raw + mask(256, 96, 32)), 1);
  assert_true(errors.find("the raw left images 256 x 192") != std::string::npos);
  // The same by the command for the mission's table, which has the size from the calibration alone.
  const auto camera = [](const char* more) {
    return std::string("  intrinsics: [200, 200, 127.5, 95.5]\n  resolution: [256, 192]\n") +
           "  distortion_model: radtan\n  distortion_coeffs: [-0.1, 0, 0, 0]\n" + more;
  };
  const std::string chain =
      scratch
          .file("chain.yaml", "cam0:\n" + camera("") + "cam1:\n" +
                                  camera("  T_cn_cnm1: [[1,0,0,-0.12],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n"))
          .string();
  const std::string table = "mask " + scratch.path("mask.png").string() + " -o " +
                            scratch.path("own_hardware.hpp").string() + " --calibration ";
  mask(256, 192, 160);
  assert_int_equal(cairn(table + chain), 0);
  assert_true(fs::exists(scratch.path("own_hardware.hpp")));
  test::check_refusal(scratch, table + scratch.path("raw.txt").string(), "raw.txt: tells no size", "add it");
  mask(256, 96, 32);
  test::check_refusal(scratch, table + chain, "mask.png: has 256 x 96", "the raw left images 256 x 192");
}

/// A map with a bad tile flies without that tile; who looks at such a flight on the ground says so.
void test_a_damaged_map(void**) {
  std::vector<TableBoulder> boulders(40);
  for (int i = 0; i < 40; ++i) {
    boulders[i].p_map_m = Vec2(i, 2.0 * i);
    boulders[i].diameter_m = 0.2;
  }
  CmapOptions small;
  small.boulders_per_tile = 4;
  static std::vector<std::uint8_t> damaged;
  damaged = encode_cmap(boulders, extent_of(boulders), 0.01, {}, small);
  damaged.back() ^= 1;
  save("damaged.cmap", damaged);
  const std::string rest = set() + out() + kStart + map_at("damaged.cmap");
  check_refused(rest, "damaged.cmap", "--salvage");
  assert_int_equal(cairn("run" + rest + " --salvage"), 0);
  assert_non_null(std::strstr(errors.c_str(), "1 damaged tile left out"));
  fs::remove_all(scratch.path("out"));
}

/// Neither parts nor the folder that was made for them, and the status that shells give to a signal.
void test_an_interrupted_run_leaves_nothing(void**) {
  constexpr int kFrames = 3000;  // some seconds
  for (int i = 0; i < kFrames; ++i) {
    for (const char* side : {"long/left/", "long/right/"})
      fs::create_symlink(scratch.path("set") / (side + 5) / (i % 2 == 0 ? "0.png" : "1.png"),
                         scratch.path(side + std::to_string(i) + ".png"));
  }
  scratch.file("long/calib.txt", "200 200 127.5 95.5 0.12\n");
  const fs::path made = scratch.path("interrupted");
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const int code = code_of_interrupted({"--dataset", scratch.path("long"), "--no-map", "-o", made / "out"},
                                         made / "out", signal);
    assert_int_equal(code, 128 + signal);
    assert_false(fs::exists(made));
  }
}

void test_which_map(void**) {
  check_refused(set() + out() + kStart, "--map", "--no-map");
  check_refused(set() + out() + kStart + map_at("good.cmap") + " --no-map", "--map", "remove one");
}

void test_maps(void**) {
  const std::string rest = set() + out() + kStart;
  check_refused(rest + map_at("none.cmap"), "none.cmap", "check the name");
  check_refused(rest + " --map " + scratch.path("set").string(), "set", "is it a file");
  std::vector<std::uint8_t> bad = map;
  bad.back() ^= 4U;
  save("payload.cmap", bad);
  check_refused(rest + map_at("payload.cmap"), "payload.cmap", "build it again");
  bad = map;
  bad[20] ^= 1U;
  save("header.cmap", bad);
  check_refused(rest + map_at("header.cmap"), "header.cmap", "build it again");
  bad = map;
  bad[cmap::kVersionAt] = cmap::kHeightsVersion + 1;
  const std::size_t crc_at = be::get_u16(bad.data() + cmap::kHeadBytesAt) - cmap::kCrcBytes;
  be::put_u32(bad.data() + crc_at, crc32(bad.data(), crc_at));
  save("version.cmap", bad);
  check_refused(rest + map_at("version.cmap"), "version.cmap: has a version", "build it again");
  bad.assign(map.begin(), map.end() - 3);
  save("short.cmap", bad);
  check_refused(rest + map_at("short.cmap"), "short.cmap: is truncated", "build it again");
  save("empty.cmap", {});
  check_refused(rest + map_at("empty.cmap"), "empty.cmap: is empty", "build it again");
  save("barren.cmap", encode_cmap({}, {0.0, 0.0, 10.0, 10.0}, 0.01, {}));
  check_refused(rest + map_at("barren.cmap"), "barren.cmap: contains no boulders", "build it");
  scratch.file("text.cmap", std::string(500, 'x'));
  check_refused(rest + map_at("text.cmap"), "text.cmap: is not a .cmap map", "cairn map build");
}

void test_frames(void**) {
  const std::string rest = set() + out() + kStart + " --no-map --frames ";
  for (const char* part : {"1", "a:b", "1:2:3", "1:x", "-1:2", "1.5:2", "99999999999:", "'1 :2'"})
    check_refused(rest + part, "--frames", "FIRST:END");
  for (const char* part : {"2:", "1:1", "1:0", ":0"})
    check_refused(rest + part, "--frames", "a range within 0:2");
}

void test_starts(void**) {
  const std::string rest = set() + out() + " --no-map --start ";
  for (const char* pose : {"1", "1,2,3,4,5", "1,2,3,4,5,6,7", "1,2,3,4,5,", "x,2,3,4,5,6", "nan,2,3,4,5,6",
                           "1,inf,3,4,5,6", "1,2,3,4,5,nan", "1e999,2,3,4,5,6", "1,2,3,4,5,6m"})
    check_refused(rest + pose, "--start", "x,y,z,roll,pitch,yaw");
}

void test_degrades(void**) {
  const std::string rest = set() + out() + kStart + " --no-map --degrade ";
  for (const char* trim : {"1.02", "scale", "scale=", "scale=x", "size=1", "yaw=0.1", "yaw=deg/m",
                           "yaw=xdeg/m", "scale=1,,yaw=0deg/m", "scale=nan", "scale=inf", "yaw=nanrad/m"})
    check_refused(rest + trim, "--degrade", "scale=1.02,yaw=0.1deg/m");
  for (const char* trim : {"scale=0.4", "scale=3", "yaw=90deg/m"})
    check_refused(rest + trim, "--degrade", "scale is 0.5 to 2");
}

void test_outputs(void**) {
  const std::string rest = set() + kStart + " --no-map -o ";
  scratch.file("file", "");
  check_refused(rest + scratch.path("file").string(), "file", "choose another");
  check_refused(rest + (scratch.path("file") / "under").string(), "file/under", "choose another");
  check_refused(rest + "/proc/cairn", "/proc/cairn", "choose another");
}

void test_pictures(void**) {
  const std::string rest = set() + out() + kStart + " --no-map --pictures ";
  for (const char* count : {"-1", "x", "101", "1.5"}) check_refused(rest + count, "--pictures", "--help");
  for (const auto& [count, strips] : {std::pair("0", 0), {"1", 1}, {"100", 2}}) {
    assert_int_equal(cairn("run" + rest + count), 0);
    const std::vector<std::uint8_t> bytes = read_file(scratch.path("out/pictures.json"));
    const nlohmann::json json = nlohmann::json::parse(bytes.begin(), bytes.end());
    assert_int_equal(json.at("strips").size(), strips);
    for (const auto& strip : json.at("strips"))
      assert_true(strip.back().at("jpeg").get<std::string>().size() > 100);
  }
  fs::remove_all(scratch.path("out"));
}

void test_orthoimages(void**) {
  const std::string rest = set() + out() + kStart + " --no-map --ortho ";
  check_refused(rest + scratch.path("no.tif").string(), "no.tif", "check the name");
  check_refused(rest + scratch.path("set/left/0.png").string(), "0.png", "gdalwarp");

  // In another system than the map.
  const fs::path ortho = scratch.path("zone34.tif");
  test::write_image(ortho, "GTiff", GDT_Byte, 20, 20, 1,
                    [](int, int x, int y) { return test::texture(x, y); });
  {
    const std::unique_ptr<GDALDataset> data(
        GDALDataset::Open(ortho.c_str(), GDAL_OF_RASTER | GDAL_OF_UPDATE));
    double geo[6] = {500000.0, 1.0, 0.0, 4000000.0, 0.0, -1.0};
    data->SetGeoTransform(geo);
    OGRSpatialReference system;
    system.importFromEPSG(32634);
    data->SetSpatialRef(&system);
  }
  std::vector<TableBoulder> boulders(1);
  boulders[0].p_map_m = Vec2(500010.0, 3999990.0);
  boulders[0].diameter_m = 0.5;
  save("zone33.cmap",
       encode_cmap(boulders, extent_of(boulders), 0.01, {cmap::Method::kTable, 0.0, "p", "EPSG:32633"}));
  check_refused(set() + out() + kStart + map_at("zone33.cmap") + " --ortho " + ortho.string(), "zone34.tif",
                "EPSG:32633");
}

void test_old_results_stay_where_a_run_is_refused(void**) {
  scratch.file("old/vo.tum", "old");
  assert_int_equal(cairn("run" + set() + kStart + " --no-map --frames 7: -o " + scratch.path("old").string()),
                   1);
  assert_int_equal(files_in(scratch.path("old")), 1);
  assert_int_equal(fs::file_size(scratch.path("old/vo.tum")), 3);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_good_runs),
      cmocka_unit_test(test_an_image_that_cannot_be_read_is_a_warning),
      cmocka_unit_test(test_order_and_times_are_told),
      cmocka_unit_test(test_a_drive_that_never_moved_fails),
      cmocka_unit_test(test_a_rover_that_stands_is_told_from_frozen_images),
      cmocka_unit_test(test_what_images_say_is_told),
      cmocka_unit_test(test_truth_of_another_drive_is_told),
      cmocka_unit_test(test_calibration_option),
      cmocka_unit_test(test_data_sets),
      cmocka_unit_test(test_attitudes),
      cmocka_unit_test(test_masks),
      cmocka_unit_test(test_a_damaged_map),
      cmocka_unit_test(test_an_interrupted_run_leaves_nothing),
      cmocka_unit_test(test_which_map),
      cmocka_unit_test(test_maps),
      cmocka_unit_test(test_coarse_maps),
      cmocka_unit_test(test_frames),
      cmocka_unit_test(test_starts),
      cmocka_unit_test(test_degrades),
      cmocka_unit_test(test_outputs),
      cmocka_unit_test(test_pictures),
      cmocka_unit_test(test_orthoimages),
      cmocka_unit_test(test_old_results_stay_where_a_run_is_refused),
  };
  return cmocka_run_group_tests(tests, make_input, nullptr);
}
