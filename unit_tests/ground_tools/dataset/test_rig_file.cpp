// Calibrations as people have them: each format's numbers come out where they belong.
#include "dataset/rig_file.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "ground_tools/scratch.hpp"
#include "support/data.hpp"

using namespace cairn;
using namespace cairn::ground;
using cairn::test::Scratch;

namespace {

const Scratch scratch;

CameraPair read(const char* name, const std::string& text, ImagesAre images = ImagesAre::kRectified) {
  return read_rig({scratch.file(name, text)}, {images, false, false});
}
CameraPair read_two(const char* name, const std::string& left, const std::string& right,
                    ImagesAre images = ImagesAre::kRectified) {
  return read_rig(
      {scratch.file(std::string("left_") + name, left), scratch.file(std::string("right_") + name, right)},
      {images, false, false});
}

void check_pinhole(const CameraModel& camera, double fx, double fy, double cx, double cy) {
  assert_near(camera.fx_px, fx, 1e-12);
  assert_near(camera.fy_px, fy, 1e-12);
  assert_near(camera.cx_px, cx, 1e-12);
  assert_near(camera.cy_px, cy, 1e-12);
}
/// Both cameras alike, rectified, 0.12 m apart.
void check_rectified(const CameraPair& pair, const char* format) {
  if (pair.format.find(format) == std::string::npos) fail_msg("%s is not %s", pair.format.c_str(), format);
  check_pinhole(pair.left, 400.0, 401.0, 31.5, 23.5);
  check_pinhole(pair.right, 400.0, 401.0, 31.5, 23.5);
  assert_near(baseline_m(pair), 0.12, 1e-9);
  assert_string_equal(why_not_rectified(pair).c_str(), "");
}

void test_plain_and_kitti_rows(void**) {
  check_rectified(read("a.txt", "400 401 31.5 23.5 0.12\r\n"), "fx fy cx cy baseline");
  check_rectified(read("a.txt", "400 401 31.5 23.5 0.12  # the mast's\n"), "fx fy cx cy baseline");
  check_rectified(read("a.txt",
                       "\xEF\xBB\xBF"
                       "400 401 31.5 23.5 0.12\n"),
                  "fx fy cx cy baseline");
  const std::string P0 = "400 0 31.5 0 0 401 23.5 0 0 0 1 0\n", P1 = "400 0 31.5 -48 0 401 23.5 0 0 0 1 0\n";
  check_rectified(read("b.txt", P0 + P1), "3x4");
  check_rectified(read("b.txt", "P0: " + P0 + "P1: " + P1), "KITTI rows P0, P1");
  const std::string colour = "P0: " + P0 + "P1: " + P1 + "P2: 400 0 31.5 20 0 401 23.5 0 0 0 1 0\n" +
                             "P3: 400 0 31.5 -28 0 401 23.5 0 0 0 1 0\nTr: 1 0 0 0 0 1 0 0 0 0 1 0\n";
  const CameraPair pair = read_rig({scratch.file("c.txt", colour)}, {ImagesAre::kRectified, false, true});
  check_rectified(pair, "KITTI rows P2, P3");
  assert_near(pair.T_cam0_left.t.x(), -0.05, 1e-12);
}

// The numbers of 2011_09_26: the raw pair stands 0.5371 m apart, turned by a degree or so.
const char kKittiRaw[] =
    "calib_time: 09-Jan-2012 13:57:47\ncorner_dist: 9.950000e-02\nS_00: 1.392000e+03 5.120000e+02\n"
    "K_00: 9.842439e+02 0 6.900000e+02 0 9.808141e+02 2.331966e+02 0 0 1\n"
    "D_00: -3.728755e-01 2.037299e-01 2.219027e-03 1.383707e-03 -7.233722e-02\n"
    "R_00: 1 0 0 0 1 0 0 0 1\nT_00: 2.573699e-16 -1.059758e-16 1.614870e-16\n"
    "S_rect_00: 1.242000e+03 3.750000e+02\n"
    "R_rect_00: 9.999239e-01 9.837760e-03 -7.445048e-03 -9.869795e-03 9.999421e-01 -4.278459e-03 7.402527e-03 "
    "4.351614e-03 9.999631e-01\n"
    "P_rect_00: 721.5377 0 609.5593 0 0 721.5377 172.854 0 0 0 1 0\nS_01: 1.392000e+03 5.120000e+02\n"
    "K_01: 9.895267e+02 0 7.020000e+02 0 9.878386e+02 2.455590e+02 0 0 1\n"
    "D_01: -3.644661e-01 1.790019e-01 1.148107e-03 -6.298563e-04 -5.314062e-02\n"
    "R_01: 9.993513e-01 1.860866e-02 -3.083487e-02 -1.887662e-02 9.997863e-01 -8.421873e-03 3.067156e-02 "
    "8.998467e-03 9.994890e-01\nT_01: -5.370000e-01 4.822061e-03 -1.252488e-02\n"
    "S_rect_01: 1.242000e+03 3.750000e+02\nP_rect_01: 721.5377 0 609.5593 -387.5744 0 721.5377 172.854 0 0 0 1 0\n";

void test_kitti_raw(void**) {
  const CameraPair rectified = read("raw.txt", kKittiRaw);
  check_pinhole(rectified.left, 721.5377, 721.5377, 609.5593, 172.854);
  assert_int_equal(rectified.left.width_px, 1242);
  assert_near(baseline_m(rectified), 387.5744 / 721.5377, 1e-9);
  assert_string_equal(why_not_rectified(rectified).c_str(), "");
  assert_int_equal(rectified.notes.size(), 1);
  const CameraPair raw = read("raw.txt", kKittiRaw, ImagesAre::kRaw);
  check_pinhole(raw.right, 989.5267, 987.8386, 702.0, 245.559);
  assert_int_equal(raw.right.width_px, 1392);
  assert_true(raw.left.lens == Lens::kRadialTangential && raw.left.k[4] == -7.233722e-02);
  assert_near(baseline_m(raw), 0.53717, 1e-4);
  assert_near(quat_log(raw.T_right_left.q).norm() * kDegPerRad, 2.12, 0.02);
}

void test_middlebury(void**) {
  const std::string text =
      "cam0=[400 0 31.5; 0 401 23.5; 0 0 1]\ncam1=[400 0 31.5; 0 401 23.5; 0 0 1]\ndoffs=0\nbaseline=120\n"
      "width=64\nheight=48\nndisp=20\n";
  const CameraPair pair = read("calib.txt", text);
  check_rectified(pair, "Middlebury");
  assert_int_equal(pair.right.height_px, 48);
  std::string shifted = text;
  shifted.replace(shifted.rfind("31.5"), 4, "33.5");
  assert_refused(read("calib.txt", shifted), "doffs is 0, and the centres' columns differ by 2");
  shifted.replace(shifted.find("doffs=0"), 7, "doffs=2");
  assert_true(why_not_rectified(read("calib.txt", shifted)).find("principal points differ") == 0);
}

std::string sensor(const char* T_BS, const char* rest) {
  return std::string("sensor_type: camera\ncomment: VI-Sensor\nT_BS:\n  cols: 4\n  rows: 4\n  data: [") +
         T_BS + "]\nrate_hz: 20\nresolution: [64, 48]\ncamera_model: pinhole\n" + rest;
}

// EuRoC's own numbers of MH_01: 0.110 m apart.
void test_euroc(void**) {
  const char kLeft[] =
      "0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975, 0.999557249008, 0.0149672133247, "
      "0.025715529948, -0.064676986768, -0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949, 0, 0, 0, 1";
  const char kRight[] =
      "0.0125552670891, -0.999755099723, 0.0182237714554, -0.0198435579556, 0.999598781151, 0.0130119051815, "
      "0.0251588363115, 0.0453689425024, -0.0253898008918, 0.0179005838253, 0.999517347078, 0.00786212447038, 0, 0, 0, 1";
  const CameraPair pair =
      read_two("sensor.yaml",
               sensor(kLeft,
                      "intrinsics: [400, 401, 31.5, 23.5]\ndistortion_model: radial-tangential\n"
                      "distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n"),
               sensor(kRight,
                      "intrinsics: [410, 411, 30.5, 22.5]\ndistortion_model: equidistant\n"
                      "distortion_coefficients: [-0.1, 0.01, 0, 0]\n"));
  check_pinhole(pair.left, 400.0, 401.0, 31.5, 23.5);
  check_pinhole(pair.right, 410.0, 411.0, 30.5, 22.5);
  assert_true(pair.left.lens == Lens::kRadialTangential && pair.left.k[3] == 1.76187114e-05);
  assert_true(pair.right.lens == Lens::kEquidistant && pair.right.k[0] == -0.1);
  assert_near(baseline_m(pair), 0.110078, 1e-6);
  assert_at_most((pair.T_right_left.t - Vec3(-0.11007, 0.0003991, -0.0008537)).norm(), 1e-4);
  assert_at_most((pair.T_body_left.t - Vec3(-0.0216401, -0.0646770, 0.0098107)).norm(), 1e-6);
  assert_int_equal(pair.left.width_px, 64);
  assert_true(why_not_rectified(pair).find("lens (radial-tangential)") != std::string::npos);

  const char kUnit[] = "1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1", kBeside[] = "1,0,0,0.12,0,1,0,0,0,0,1,0,0,0,0,1";
  const char kPlain[] = "intrinsics: [400, 401, 31.5, 23.5]\ndistortion_coefficients: [0, 0, 0, 0]\n";
  check_rectified(read_two("sensor.yaml", sensor(kUnit, kPlain), sensor(kBeside, kPlain)), "EuRoC");
  assert_refused(read("sensor.yaml", sensor(kUnit, kPlain)), "one camera; give two files");
  assert_refused(read_two("sensor.yaml", sensor(kUnit, "intrinsics: [400, 401]\n"), sensor(kBeside, kPlain)),
                 "has no `intrinsics`");
}

std::string camchain(const char* model, const char* coefficients, const char* camera_model = "pinhole") {
  const auto camera = [&](const char* name, const char* chain) {
    return std::string(name) + ":\n" + chain + "  camera_model: " + camera_model +
           "\n  intrinsics: [400, 401, 31.5, 23.5]\n  distortion_model: " + model +
           "\n  distortion_coeffs: [" + coefficients + "]\n  resolution: [64, 48]\n  rostopic: /cam\n";
  };
  return camera("cam0", "") +
         camera("cam1",
                "  T_cn_cnm1:\n  - [1, 0, 0, -0.12]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n");
}

void test_kalibr(void**) {
  check_rectified(read("camchain.yaml", camchain("radtan", "0, 0, 0, 0")), "kalibr");
  const CameraPair pair = read("camchain.yaml", camchain("equidistant", "0.01, 0, 0, 0"));
  assert_true(pair.right.lens == Lens::kEquidistant);
  // A fish-eye whose coefficients are 0 still is one.
  assert_true(read("camchain.yaml", camchain("equidistant", "0, 0, 0, 0")).left.lens == Lens::kEquidistant);
  // OpenVINS' way: each camera's pose in the IMU.
  std::string vins = camchain("radtan", "0, 0, 0, 0");
  const std::string chain = "T_cn_cnm1:\n  - [1, 0, 0, -0.12]";
  vins.replace(vins.find(chain), chain.size(), "T_imu_cam:\n  - [1, 0, 0, 3.12]");
  vins.insert(vins.find("cam0:\n") + 6,
              "  T_imu_cam: [[1, 0, 0, 3], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n");
  check_rectified(read("vins.yaml", vins), "kalibr");
  assert_near(read("vins.yaml", vins).T_body_left.t.x(), 3.0, 1e-12);
  // The same the other way round, where there is no chain.
  std::string imus = vins;
  for (const char* here : {"[1, 0, 0, 3.12]", "[1, 0, 0, 3]"}) {
    imus.replace(imus.find("T_imu_cam"), 9, "T_cam_imu");
    imus.replace(imus.find(here), 10, "[1,0,0,-");
  }
  check_rectified(read("imus.yaml", imus), "kalibr");
  assert_refused(read("camchain.yaml", camchain("fov", "0.9, 0, 0, 0")), "'fov' is not known");
  assert_refused(read("camchain.yaml", camchain("radtan", "0, 0, 0, 0", "omni")), "'omni' is not known");
  assert_refused(read("camchain.yaml", "cam0:\n  intrinsics: [1, 2, 3, 4]\n"), "one camera");
}

std::string camera_info(double tx, const char* d, const char* r = "1, 0, 0, 0, 1, 0, 0, 0, 1") {
  return "image_width: 64\nimage_height: 48\ncamera_name: c\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
         "  data: [390, 0, 30, 0, 391, 22, 0, 0, 1]\ndistortion_model: plumb_bob\ndistortion_coefficients:\n"
         "  rows: 1\n  cols: 5\n  data: [" +
         std::string(d) + "]\nrectification_matrix:\n  rows: 3\n  cols: 3\n  data: [" + r +
         "]\nprojection_matrix:\n  rows: 3\n  cols: 4\n  data: [400, 0, 31.5, " + std::to_string(tx) +
         ", 0, 401, 23.5, 0, 0, 0, 1, 0]\n";
}

void test_ros(void**) {
  const CameraPair pair =
      read_two("a.yaml", camera_info(0.0, "-0.1, 0.02, 0, 0, 0"), camera_info(-48.0, "0, 0, 0, 0, 0"));
  check_rectified(pair, "ROS");
  assert_int_equal(pair.right.width_px, 64);
  assert_int_equal(pair.notes.size(), 1);
  // The raw left camera is turned by R, of p_rect = R p_raw: what both see at infinity is where they say.
  const CameraPair raw =
      read_two("a.yaml", camera_info(0.0, "-0.1, 0.02, 0, 0, 0", "0.8, 0, -0.6, 0, 1, 0, 0.6, 0, 0.8"),
               camera_info(-48.0, "0, 0, 0, 0, 0"), ImagesAre::kRaw);
  check_pinhole(raw.left, 390.0, 391.0, 30.0, 22.0);
  assert_true(raw.left.lens == Lens::kRadialTangential && raw.right.lens == Lens::kNone);
  assert_near((raw.T_right_left.q * Vec3(0.0, 0.0, 1.0) - Vec3(-0.6, 0.0, 0.8)).norm(), 0.0, 1e-9);
  assert_near((raw.T_right_left.t - Vec3(-0.12, 0.0, 0.0)).norm(), 0.0, 1e-9);
  // The message, as `rostopic echo` prints it.
  const auto message = [](const char* tx) {
    return std::string(
               "height: 48\nwidth: 64\ndistortion_model: \"plumb_bob\"\nD: []\n"
               "K: [400.0, 0.0, 31.5, 0.0, 401.0, 23.5, 0.0, 0.0, 1.0]\n"
               "P: [400.0, 0.0, 31.5, ") +
           tx + ", 0.0, 401.0, 23.5, 0.0, 0.0, 0.0, 1.0, 0.0]\n";
  };
  check_rectified(read_two("b.yaml", message("0"), message("-48.0")), "ROS");
  assert_refused(read("b.yaml", message("0")), "give two files");
  const std::string none = "height: 48\nwidth: 64\nP: [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]\n";
  assert_refused(read_two("b.yaml", none, none), "never calibrated");
}

std::string matrix(const char* name, int rows, int cols, const char* data) {
  return std::string(name) + ": !!opencv-matrix\n   rows: " + std::to_string(rows) +
         "\n   cols: " + std::to_string(cols) + "\n   dt: d\n   data: [ " + data + " ]\n";
}

void test_opencv(void**) {
  const std::string head = "%YAML:1.0\n---\n";
  const std::string P = matrix("P1", 3, 4, "400., 0., 31.5, 0., 0., 401., 23.5, 0., 0., 0., 1., 0.") +
                        matrix("P2", 3, 4, "400., 0., 31.5, -48., 0., 401., 23.5, 0., 0., 0., 1., 0.");
  const std::string M = matrix("M1", 3, 3, "390., 0., 30., 0., 391., 22., 0., 0., 1.") +
                        matrix("D1", 1, 8, "0.4, -0.1, 0., 0., 0.01, 0.7, 0.02, 0.03") +
                        matrix("M2", 3, 3, "392., 0., 33., 0., 393., 24., 0., 0., 1.") +
                        matrix("D2", 1, 5, "-0.1, 0.02, 0., 0., 0.");
  const std::string RT =
      matrix("R", 3, 3, "1., 0., 0., 0., 0.8, -0.6, 0., 0.6, 0.8") + matrix("T", 3, 1, "-0.12, 0., 0.");
  check_rectified(read("extrinsics.yml", head + P), "OpenCV");
  check_rectified(read_two("both.yml", head + M, head + RT + P), "OpenCV");
  for (const CameraPair& raw :
       {read_two("both.yml", head + M, head + RT + P, ImagesAre::kRaw), read("one.yml", head + M + RT)}) {
    check_pinhole(raw.right, 392.0, 393.0, 33.0, 24.0);
    assert_true(raw.left.lens == Lens::kRational && raw.left.k[7] == 0.03);
    assert_true(raw.right.lens == Lens::kRadialTangential);
    assert_near(quat_log(raw.T_right_left.q).x(), std::asin(0.6), 1e-9);
  }
  const auto rodrigues = [&](const char* r) {
    return read("vector.yml", head + M + matrix("R", 3, 1, r) + matrix("T", 3, 1, "-0.12, 0., 0."));
  };
  assert_near(quat_log(rodrigues("0.02, 0., 0.").T_right_left.q).x(), 0.02, 1e-12);
  assert_refused(rodrigues("5., 0., 0."), "is it degrees?");
  assert_refused(read("half.yml", head + M), "neither P1 and P2");
  // Raw cameras by the turns of rectification, p_rect = R p_raw, where that is what is told.
  const std::string turns = matrix("R1", 3, 3, "1., 0., 0., 0., 1., 0., 0., 0., 1.") +
                            matrix("R2", 3, 3, "1., 0., 0., 0., 0.8, 0.6, 0., -0.6, 0.8");
  const CameraPair turned = read("turns.yml", head + M + P + turns, ImagesAre::kRaw);
  check_pinhole(turned.right, 392.0, 393.0, 33.0, 24.0);
  assert_true(turned.left.lens == Lens::kRational && turned.right.lens == Lens::kRadialTangential);
  assert_near(quat_log(turned.T_right_left.q).x(), std::asin(0.6), 1e-9);
  check_rectified(read("turns.yml", head + M + P + turns), "OpenCV");
  assert_true(read("turns.yml", head + M + P + turns).notes.at(0).find("raw images, too") !=
              std::string::npos);
  assert_true(read("lens.yml", head + M + P).notes.at(0).find("taken as rectified") != std::string::npos);
  assert_refused(read_rig({scratch.file("lens.yml", head + M + P)}, {ImagesAre::kRaw, true, false}),
                 "rectified images alone");
  const std::string tilted = matrix("D1", 1, 14, "0.1,0,0,0,0,0,0,0,0,0,0,0,0.01,0");
  std::string without_D1 = M;
  without_D1.replace(without_D1.find("D1:"), 3, "was:");
  assert_refused(read("tilt.yml", head + without_D1 + tilted + RT), "known are 4, 5 and 8");
}

void test_keys(void**) {
  check_rectified(read("calib.txt", "fx: 400\nfy: 401\ncx: 31.5\ncy: 23.5\nbf: 48\n"), "bf by key");
  check_rectified(read("orb.yaml",
                       "%YAML:1.0\nCamera.fx: 400.0\nCamera.fy: 401.0\nCamera.cx: 31.5\nCamera.cy: 23.5\n"
                       "Camera.k1: 0.0\nCamera.bf: 48.0\n"),
                  "bf by key");
  check_rectified(read("b.yaml", "fx: 400\nfy: 401\ncx: 31.5\ncy: 23.5\nbaseline: 0.12\n"),
                  "baseline by key");
  const std::string equations = "# a rig\nfx=400\nfy = 401\ncx= 31.5  # px\ncy=23.5\nbaseline=0.12\n";
  check_rectified(read("rig.cfg", equations), "baseline by key");
  assert_int_equal(read("rig.cfg", equations + "width=64\nheight=48\n").left.height_px, 48);
  assert_refused(read("rig.cfg", equations + "k1=-0.3\nd1=4\n"), "d1: looks like a lens'");
  assert_refused(read("rig.cfg", equations + "\n[RIGHT]\nfx=402\n"), "rig.cfg:8: not `key = value`");
  assert_refused(read("rig.cfg", equations + "fx=402\n"), "rig.cfg: fx: stands there twice; keep one");
  assert_refused(read("rig.cfg", "fx=400\nfy=401\ncx=31.5\ncy=23.5\n"), "has no `baseline`; add it");
  assert_refused(read("b.yaml", "fx: 400\nfy: 401\ncx: 31.5\nfy: 40\ncy: 23.5\nb: 0.12\n"),
                 "fy: stands there");
}

// ORB-SLAM3: two cameras, and the right one's pose in the left one; what is half told is refused.
void test_orb_slam3(void**) {
  const auto camera = [](const char* name, const char* centre, const char* lens) {
    const std::string n(name);
    return n + ".fx: 400.0\n" + n + ".fy: 401.0\n" + n + ".cx: " + centre + "\n" + n + ".cy: 23.5\n" + n +
           ".k1: -0.28\n" + n + ".k2: 0.07\n" + lens;
  };
  const std::string pinhole = "%YAML:1.0\nCamera.type: \"PinHole\"\nCamera.width: 64\nCamera.height: 48\n";
  const std::string pose = matrix("Stereo.T_c1_c2", 4, 4, "1,0,0,0.12, 0,0.8,0.6,0, 0,-0.6,0.8,0, 0,0,0,1");
  const std::string both = camera("Camera1", "31.5", "") + camera("Camera2", "33.5", "Camera2.p2: 0.001\n");
  const CameraPair pair = read("orb3.yaml", pinhole + both + pose);
  check_pinhole(pair.left, 400.0, 401.0, 31.5, 23.5);
  check_pinhole(pair.right, 400.0, 401.0, 33.5, 23.5);
  assert_int_equal(pair.right.width_px, 64);
  assert_true(pair.left.lens == Lens::kRadialTangential && pair.left.k[0] == -0.28);
  assert_true(pair.right.lens == Lens::kRadialTangential && pair.right.k[3] == 0.001);
  assert_near(baseline_m(pair), 0.12, 1e-12);
  const Vec3 seen = pair.T_right_left * Vec3(0.12, 0.6, 0.8);  // what lies on the right camera's axis
  assert_near((seen - Vec3(0.0, 0.0, 1.0)).norm(), 0.0, 1e-12);
  assert_refused(read("orb3.yaml", pinhole + both + "Stereo.b: 0.12\n"), "add `Stereo.T_c1_c2`");
  assert_refused(read("orb3.yaml", pinhole + camera("Camera1", "31.5", "") + "Camera2.fx: 1\n" + pose),
                 "no `Camera2.fy`");
  const std::string fisheye = "%YAML:1.0\nCamera.type: \"KannalaBrandt8\"\nCamera.bf: 48.0\n";
  const CameraPair bent =
      read("kb.yaml", fisheye + camera("Camera", "31.5", "Camera.k3: -0.002\nCamera.k4: 0.001\n") +
                          matrix("Tlr", 3, 4, "1,0,0,0.11,0,1,0,0,0,0,1,0"));
  assert_true(bent.right.lens == Lens::kEquidistant && bent.right.k[3] == 0.001);
  assert_near(baseline_m(bent), 0.11, 1e-12);
  assert_refused(read("kb.yaml", fisheye + camera("Camera", "31.5", "")), "no `k3`");
}

// No lens is left out in silence.
void test_lenses_that_are_not_understood(void**) {
  assert_refused(read("a.yaml", "fx: 400\nfy: 401\ncx: 31.5\ncy: 23.5\nbf: 48\nrear.k1: -0.1\n"),
                 "a.yaml: rear.k1: looks like a lens");
  check_rectified(read("a.yaml", "fx: 400\nfy: 401\ncx: 31.5\ncy: 23.5\nbf: 48\nrear.k1: 0.0\nThDepth: 40\n"),
                  "bf by key");
  std::string other = camchain("radtan", "-0.28, 0.07, 0, 0");
  for (std::size_t at = 0; (at = other.find("distortion_coeffs", at)) != std::string::npos;)
    other.replace(at, 17, "distortion_parameters");
  assert_refused(read("k.yaml", other), "distortion model 'radtan' without coefficients");
  std::string unnamed = other;
  for (std::size_t at = 0; (at = unnamed.find("distortion_model: radtan", at)) != std::string::npos;)
    unnamed.replace(at, 24, "topic: cam");
  assert_refused(read("k.yaml", unnamed), "distortion_parameters: looks like a lens");
  assert_refused(read_two("a.yaml", camera_info(0.0, "0, 0, 0, 0, 0") + "binning_x: 2\n",
                          camera_info(-48.0, "0, 0, 0, 0, 0")),
                 "scale and move K and P");
  assert_refused(read_two("a.yaml", camera_info(0.0, "0, 0, 0, 0, 0") + "roi:\n  x_offset: 8\n  width: 20\n",
                          camera_info(-48.0, "0, 0, 0, 0, 0")),
                 "scale and move K and P");
  check_rectified(
      read_two("a.yaml", camera_info(0.0, "0, 0, 0, 0, 0") + "binning_x: 1\nroi:\n  x_offset: 0\n",
               camera_info(-48.0, "0, 0, 0, 0, 0")),
      "ROS");
}

// What is not read is refused with the way to what is.
void test_kinds_that_are_not_read(void**) {
  const std::string xml = "<?xml version=\"1.0\"?>\n<opencv_storage>\n</opencv_storage>\n";
  assert_refused(read("a.xml", xml), "a.xml: XML is not read; write OpenCV's as .yml");
  assert_refused(read_two("a.xml", xml, xml), "XML is not read");
  assert_refused(read_two("a.ini", "# oST version 5.0 parameters\n\n[image]\n\nwidth\n512\n", ""),
                 ".ini is not read; write it as .yaml");
  assert_refused(read("k.yaml", "cam0:\n  ? [1,2]\n  : 3\ncam1:\n  a: 1\n"), "k.yaml: cam0: has a key that");
  check_rectified(
      read("a.json",
           "{\"P1\": {\"type_id\":\"opencv-matrix\",\"data\":[400.0,0,31.5,0,0,401,23.5,0,0,0,1,0]},\n"
           "\"P2\": {\"data\":[400.0,0,31.5,-48,0,401,23.5,0,0,0,1,0]}}"),
      "OpenCV");
  assert_refused(read_rig({scratch.file("raw.txt",
                                        "P0: 400 0 31.5 0 0 401 23.5 0 0 0 1 0\n"
                                        "P1: 400 0 31.5 -48 0 401 23.5 0 0 0 1 0\n")},
                          {ImagesAre::kRaw, true, false}),
                 "raw.txt: tells of rectified images alone");
}

std::string label(const char* type, const char* centre, const char* rest, const char* index = "(1,2,3)") {
  return std::string(
             "PDS_VERSION_ID = PDS3\r\n/* MODEL */\r\nGROUP = GEOMETRIC_CAMERA_MODEL\r\n  MODEL_TYPE = ") +
         type + "\r\n  MODEL_COMPONENT_ID = (C,A,H,V,\r\n      O,R)\r\n  MODEL_COMPONENT_1 = (" + centre +
         ")\r\n  MODEL_COMPONENT_2 = (0.0,0.0,1.0)\r\n  MODEL_COMPONENT_3 = (400.0,0.0,\r\n     31.5)\r\n"
         "  MODEL_COMPONENT_4 = (0.0,401.0,23.5)\r\n" +
         rest + "  REFERENCE_COORD_SYSTEM_NAME = ROVER_FRAME\r\n  REFERENCE_COORD_SYSTEM_INDEX = " + index +
         "\r\nEND_GROUP = GEOMETRIC_CAMERA_MODEL\r\nOBJECT = IMAGE\r\n  LINES = 48\r\n  LINE_SAMPLES = 64\r\n"
         "END_OBJECT = IMAGE\r\nEND\r\nbytes = of the image";
}

void test_labels(void**) {
  const char kLens[] = "  MODEL_COMPONENT_5 = (0.0,0.0,1.0)\r\n  MODEL_COMPONENT_6 = (0.0,-0.01,0.02)\r\n";
  check_rectified(read_two("a.LBL", label("CAHV", "1.0,2.0,3.0", ""), label("CAHV", "1.12,2.0,3.0", "")),
                  "CAHV");
  const CameraPair cahvor =
      read_two("a.LBL", label("CAHVOR", "0,0,0", kLens), label("CAHVOR", "0.12,0,0", kLens));
  assert_true(cahvor.left.lens == Lens::kCahvor && cahvor.left.k[1] == -0.01);
  assert_int_equal(cahvor.left.width_px, 64);
  assert_near(baseline_m(cahvor), 0.12, 1e-12);
  const std::string general = std::string(kLens) +
                              "  MODEL_COMPONENT_7 = (0.001,0.002,0.003)\r\n"
                              "  MODEL_COMPONENT_8 = 3.0\r\n  MODEL_COMPONENT_9 = 0.4\r\n";
  const CameraPair cahvore = read_two("a.LBL", label("CAHVORE", "0,0,0", general.c_str()),
                                      label("CAHVORE", "0.12,0,0", general.c_str()));
  assert_true(cahvore.right.lens == Lens::kCahvore && cahvore.right.k[5] == 0.003 &&
              cahvore.right.k[6] == 0.4);
  // Comments, units, and brackets in texts that go on over lines.
  const std::string noisy = label("CAHV /* linear */", "1.0 <m>, 2.0 <m>,3.0 <m>", "");
  const std::string before = "/* MSL */\r\n", text = "DESCRIPTION = \"see (a) and (b\r\nGROUP = X\"\r\n";
  const CameraPair read_well =
      read_two("b.LBL", before + noisy, before + label("CAHV", "1.12,2.0,3.0", text.c_str()));
  check_rectified(read_well, "CAHV");
  assert_refused(read("a.LBL", label("CAHV", "0,0,0", "")), "give two files");
  assert_refused(read_two("a.LBL", label("CAHV", "0,0,0", ""), label("CAHV", "0.12,0,0", "", "(1,2,4)")),
                 "taken together");
  assert_refused(read_two("a.LBL", label("CAHVOR", "0,0,0", ""), label("CAHVOR", "0.12,0,0", "")),
                 "MODEL_COMPONENT_5");
  assert_refused(read_two("a.LBL", label("PSPH", "0,0,0", ""), label("PSPH", "0,0,0", "")),
                 "'PSPH' is not known");
  assert_refused(read_two("a.LBL", "PDS_VERSION_ID = PDS3\nEND\n", "PDS_VERSION_ID = PDS3\nEND\n"),
                 "no GEOMETRIC");
}

void test_refusals(void**) {
  assert_refused(read_rig({scratch.path("nowhere.yaml")}), "nowhere.yaml: no such file");
  assert_refused(read("a.yaml", "- 1\n- 2\n"), "a.yaml: not a calibration");
  assert_refused(read("a.yaml", "a: [1, 2\nb: 3\n"), "not YAML");
  assert_refused(read("a.yaml", "P1: [1, x]\nP2: [1]\n"), "not a list of finite numbers");
  assert_refused(read("raw.txt", "P_rect_00: 721.5 0 609.5 0 0 721.5 172.8 0 0 0 1 0\n"),
                 "no row `P_rect_01`");
  assert_refused(read("raw.txt", "P_rect_02: 721.5 0 609.5 0 0 721.5 172.8 0 0 0 1 0\n"), "no row `P_rect_0");
  assert_refused(read("a.yaml", "cam0:\n  camera_model: |\n    of two\n    lines\ncam1:\n  a: 1\n"),
                 "a.yaml");
  assert_refused(read("a.txt", "394,205 394,205 255,5 191,5 0,12\n"), "the decimal sign is the point");
  assert_refused(read("a.txt", "400 0 31.5\n0 401 23.5\n0 0 1\n"), "neither one line");
  assert_refused(
      read("a.txt", "400 0.5 31.5 0 0 401 23.5 0 0 0 1 0\n400 0.5 31.5 -48 0 401 23.5 0 0 0 1 0\n"),
      "rectified images have no skew");
  assert_refused(read("a.txt", "400 401 31.5 23.5 120\n"), "0.12 if these are millimetres");
  assert_refused(read("a.txt", "400 401 31.5 23.5 12\n"), "0.12 if centimetres");
  assert_refused(read("a.txt", "P1: 400 0 31.5 0 0 401 23.5 0 0 0 1 0\n\xFF\xFE"), "?");
  for (const char* name : {"wide.txt", "wide.yaml"})
    assert_refused(read(name, std::string("\xFF\xFE\x34\0\x30\0", 6)), "save it in UTF-8");
  assert_refused(read("a.txt", "0.77 1.03 0.499 0.499 0.12\n"), "look normalised");
}

std::string label_of(const std::string& image) {
  std::ifstream in(image, std::ios::binary);
  std::string text(65536, ' ');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  return text;
}

// Opportunity's left camera. Twice there is no baseline, and so it is refused, but for the right reason; and
// with a second one beside it the pair sees points where the label's own model says, over the whole image.
void test_a_real_label(void**) {
  static std::string folder, text;
  folder = test::find_data("mer_navcam");
  SKIP_WITHOUT(folder, "mer_navcam");
  const std::string one = folder + "/1N491020376ILFCNY9P0706L0M1.IMG";
  assert_refused(read_rig({one, one}), "same place");

  const Vec3 C(0.442604, -0.0611635, -1.25106), A(0.93995, -0.338133, 0.0464979);
  const Vec3 H(884.72, 981.763, 24.1472), V(418.579, -152.039, 1245.75);
  const Vec3 O(0.946551, -0.315595, 0.0666419), R(0.00096, -0.002183, 0.018547);
  const Vec3 C_right(0.510604, 0.1268365, -1.25106);
  text = label_of(one);
  const std::string centre = "(0.442604,-0.0611635,-1.25106)";
  assert_true(text.find(centre) != std::string::npos);
  text.replace(text.find(centre), centre.size(), "(0.510604,0.1268365,-1.25106)");
  const CameraPair pair = read_rig({one, scratch.file("navcam_right.LBL", text)});
  assert_near(baseline_m(pair), (C_right - C).norm(), 1e-9);
  assert_int_equal(pair.left.width_px, 1024);

  const auto by_label = [&](const Vec3& p_rover_m, const Vec3& centre_m) {
    const Vec3 p = p_rover_m - centre_m;
    const double omega = p.dot(O);
    const Vec3 lambda = p - omega * O;
    const double tau = lambda.squaredNorm() / (omega * omega);
    const Vec3 bent = p + (R.x() + R.y() * tau + R.z() * tau * tau) * lambda;
    return Vec2(bent.dot(H) / bent.dot(A), bent.dot(V) / bent.dot(A));
  };
  // From the rover's frame into the left camera's, by what the reader's own axes must be.
  const Vec3 z = A.normalized(), y = (V - V.dot(z) * z).normalized(), x = y.cross(z);
  int inside = 0;
  double most = 0.0;
  for (double across = -0.45; across <= 0.45; across += 0.025) {
    for (double down = -0.45; down <= 0.45; down += 0.025) {
      for (const double range_m : {1.5, 30.0}) {
        const Vec3 p_left_m = range_m * Vec3(across, down, 1.0);
        const Vec3 p_rover_m = C + p_left_m.x() * x + p_left_m.y() * y + p_left_m.z() * z;
        const Vec2 expected = by_label(p_rover_m, C);
        if (expected.x() < 0.0 || expected.x() > 1023.0 || expected.y() < 0.0 || expected.y() > 1023.0)
          continue;
        ++inside;
        const std::optional<Vec2> left = project(pair.left, p_left_m);
        const std::optional<Vec2> right = project(pair.right, pair.T_right_left * p_left_m);
        assert_true(left && right);
        most = std::max({most, (*left - expected).norm(), (*right - by_label(p_rover_m, C_right)).norm()});
      }
    }
  }
  print_message("reprojection against the label's model: %.4f px at most, %d points\n", most, inside);
  assert_true(inside > 1500);
  assert_at_most(most, 0.05);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_plain_and_kitti_rows),
      cmocka_unit_test(test_kitti_raw),
      cmocka_unit_test(test_middlebury),
      cmocka_unit_test(test_euroc),
      cmocka_unit_test(test_kalibr),
      cmocka_unit_test(test_ros),
      cmocka_unit_test(test_opencv),
      cmocka_unit_test(test_keys),
      cmocka_unit_test(test_orb_slam3),
      cmocka_unit_test(test_lenses_that_are_not_understood),
      cmocka_unit_test(test_kinds_that_are_not_read),
      cmocka_unit_test(test_labels),
      cmocka_unit_test(test_refusals),
      cmocka_unit_test(test_a_real_label),
  };
  return cmocka_run_group_tests_name("ground_tools/dataset/rig_file", tests, nullptr, nullptr);
}
