// Data sets on disk: both layouts, what may be absent, and each refusal.
#include "dataset/dataset.hpp"

#include "ground_tools/scratch.hpp"
#include "ground_tools/test_images.hpp"
#include "support/data.hpp"

using namespace cairn;
using namespace cairn::ground;
using cairn::test::Scratch;

namespace {

const Scratch scratch;
const char kPlainCalibration[] = "# a comment\n400 401 31.5 23.5 0.12\n";
const char kRows[] =
    "500 0 30 0 0 500 20 0 0 0 1 0\n"
    "500 0 30 -250 0 500 20 0 0 0 1 0";  // no line end, as in real files

void make_pairs(const std::string& set, const char* left, const char* right,
                std::initializer_list<const char*> stems) {
  for (const char* stem : stems) {
    test::write_grey_png(scratch.path(set + "/" + left + "/" + stem + ".png"), 64, 48);
    test::write_grey_png(scratch.path(set + "/" + right + "/" + stem + ".png"), 64, 48);
  }
}

void test_plain_layout(void**) {
  make_pairs("plain", "left", "right", {"000003", "000004", "000007"});
  scratch.file("plain/calib.txt", kPlainCalibration);
  scratch.file("plain/left/notes.txt", "not an image");
  scratch.file("plain/truth_left_camera.tum", "# stamp\n3 1 2 3 0 0 0 1\n4 2 2 3 0 0 0.6 0.8\n");
  scratch.file("plain/truth_rover.txt", "# frame\n4 0.06 5 6 7 90 0 0\n");
  scratch.file("plain/truth_rocks.csv", "id,x,y,z_ground,diameter,height,shape\n9,1.5,-2.5,0.1,0.4,0.2,8\n");
  static Dataset data;
  data = Dataset::open(scratch.path("plain"));
  assert_int_equal(data.frames().size(), 3);
  assert_int_equal(data.frames()[2].number, 7);
  assert_near(data.frames()[2].stamp_s, 7.0, 0.0);
  assert_int_equal(data.rig().width_px, 64);
  assert_int_equal(data.rig().height_px, 48);
  assert_near(data.rig().fx_px, 400.0, 0.0);
  assert_near(data.rig().fy_px, 401.0, 0.0);
  assert_near(data.rig().cx_px, 31.5, 0.0);
  assert_near(data.rig().cy_px, 23.5, 0.0);
  assert_near(data.rig().baseline_m, 0.12, 0.0);
  assert_true(data.truth_cam(0).has_value());
  assert_near(data.truth_cam(1)->t.x(), 2.0, 0.0);
  assert_near(data.truth_cam(1)->q.z(), 0.6, 1e-12);
  assert_false(data.truth_cam(2).has_value());
  assert_false(data.truth_rover(0).has_value());
  assert_near(attitude_of(data.truth_rover(1)->q).yaw_rad, kPi / 2.0, 1e-12);
  assert_near(data.truth_rover(1)->t.z(), 7.0, 0.0);
  assert_int_equal(data.truth_rocks().size(), 1);
  assert_int_equal(data.truth_rocks()[0].id, 9);
  assert_near(data.truth_rocks()[0].p_map_m.y(), -2.5, 0.0);
  assert_near(data.truth_rocks()[0].diameter_m, 0.4, 0.0);
}

// A camera moves 2 m forward, 1 m right and 0.5 m down in a KITTI-style world: in the map 2 m east, 1 m
// south, 0.5 m down.
void test_kitti_layout(void**) {
  make_pairs("kitti", "image_0", "image_1", {"000000", "000001"});
  scratch.file("kitti/calib.txt", kRows);
  scratch.file("kitti/times.txt", "0\n0.1044989\n");
  scratch.file("kitti/poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0.5 0 0 1 2\n");
  static Dataset data;
  data = Dataset::open(scratch.path("kitti"));
  assert_near(data.rig().fx_px, 500.0, 0.0);
  assert_near(data.rig().cy_px, 20.0, 0.0);
  assert_near(data.rig().baseline_m, 0.5, 1e-15);
  assert_near(data.frames()[1].stamp_s, 0.1044989, 0.0);
  const Pose3 pose = *data.truth_cam(1);
  assert_near((pose.t - Vec3(2.0, -1.0, -0.5)).norm(), 0.0, 1e-12);
  assert_near((pose.q * Vec3(0.0, 0.0, 1.0) - Vec3(1.0, 0.0, 0.0)).norm(), 0.0, 1e-12);   // forward is east
  assert_near((pose.q * Vec3(0.0, 1.0, 0.0) - Vec3(0.0, 0.0, -1.0)).norm(), 0.0, 1e-12);  // down is down
}

// P2 stands 0.06 m left of the camera of the poses: (fx * 0.06 = 30), and the pair's baseline comes from P3.
void test_kitti_colour_pair(void**) {
  make_pairs("colour", "image_2", "image_3", {"0", "1"});
  scratch.file("colour/calib.txt",
               "P0: 500 0 30 0 0 500 20 0 0 0 1 0\nP1: 500 0 30 -250 0 500 20 0 0 0 1 0\n"
               "P2: 500 0 30 30 0 500 20 0 0 0 1 0\nP3: 500 0 30 -240 0 500 20 0 0 0 1 0\n"
               "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n");
  scratch.file("colour/poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 2\n");
  static Dataset data;
  data = Dataset::open(scratch.path("colour"));
  assert_near(data.rig().baseline_m, 0.54, 1e-12);
  assert_near((data.truth_cam(1)->t - Vec3(2.0, 0.06, 0.0)).norm(), 0.0, 1e-12);
}

/// KITTI's poses as they are handed out: poses/07.txt beside sequences/07.
void test_poses_beside_sequences(void**) {
  make_pairs("odometry/sequences/07", "image_0", "image_1", {"000000", "000001"});
  scratch.file("odometry/sequences/07/calib.txt", kRows);
  scratch.file("odometry/poses/07.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 2\n");
  static Dataset data;
  data = Dataset::open(scratch.path("odometry/sequences/07"));
  assert_near(data.truth_cam(1)->t.x(), 2.0, 1e-12);
  std::filesystem::rename(scratch.path("odometry/sequences"), scratch.path("odometry/others"));
  data = Dataset::open(scratch.path("odometry/others/07"));
  assert_false(data.truth_cam(1).has_value());
}

/// Calibrations under names that no list has: the one, kalibr's among others, left's and right's, or one in
/// each folder of images. Where there is doubt, files are named.
void test_calibrations_by_any_name(void**) {
  const auto info = [](const char* tx) {
    return std::string("image_width: 64\nimage_height: 48\nprojection_matrix:\n  data: [400, 0, 31.5, ") +
           tx + ", 0, 400, 23.5, 0, 0, 0, 1, 0]\n";
  };
  const auto opens = [](const std::string& set) { return Dataset::open(scratch.path(set)).rig().baseline_m; };
  const std::string keys = "fx: 400\nfy: 400\ncx: 31.5\ncy: 23.5\nbaseline: 0.12\n";
  for (const char* set : {"alone", "chain", "sides", "within", "doubt"})
    make_pairs(set, "left", "right", {"0"});
  scratch.file("alone/rig.yaml", keys);
  assert_near(opens("alone"), 0.12, 1e-12);
  scratch.file("chain/bag-camchain.yaml", keys);
  scratch.file("chain/imu.yaml", "rate: 200\n");
  assert_near(opens("chain"), 0.12, 1e-12);
  scratch.file("sides/right_info.yaml", info("-48"));
  scratch.file("sides/left_info.yaml", info("0"));
  scratch.file("sides/imu.yaml", "rate: 200\n");
  assert_near(opens("sides"), 0.12, 1e-12);
  scratch.file("within/left/ost.yaml", info("0"));
  scratch.file("within/right/ost.yaml", info("-48"));
  assert_near(opens("within"), 0.12, 1e-12);
  scratch.file("doubt/rig.yaml", keys);
  scratch.file("doubt/imu.yaml", "rate: 200\n");
  assert_refused(opens("doubt"), "of imu.yaml, rig.yaml give the rig's by --calibration");
}

// The camera of poses.txt is the left one, wherever the calibration has an IMU.
void test_poses_are_the_cameras(void**) {
  const char kCamera[] =
      "  camera_model: pinhole\n  intrinsics: [80, 80, 31.5, 23.5]\n  distortion_model: radtan\n"
      "  distortion_coeffs: [0, 0, 0, 0]\n  resolution: [64, 48]\n";
  make_pairs("imu", "left", "right", {"0", "1"});
  scratch.file("imu/camchain.yaml",
               std::string("cam0:\n  T_cam_imu: [[0,-1,0,3],[1,0,0,2],[0,0,1,1],[0,0,0,1]]\n") + kCamera +
                   "cam1:\n  T_cn_cnm1: [[1,0,0,-0.12],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n" + kCamera);
  scratch.file("imu/poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 7\n");
  static Dataset data;
  data = Dataset::open(scratch.path("imu"));
  assert_near((data.truth_cam(1)->t - Vec3(7.0, 0.0, 0.0)).norm(), 0.0, 1e-12);
  assert_near((data.truth_cam(1)->q * Vec3(0.0, 0.0, 1.0) - Vec3(1.0, 0.0, 0.0)).norm(), 0.0, 1e-12);
}

void test_missing_images_are_frames(void**) {
  make_pairs("holes", "left", "right", {"8", "9", "10", "11"});
  scratch.file("holes/calib.txt", kPlainCalibration);
  std::filesystem::remove(scratch.path("holes/left/9.png"));
  std::filesystem::remove(scratch.path("holes/right/10.png"));
  scratch.file("holes/left/8.png", "not a PNG");  // the size comes from another image
  static Dataset data;
  data = Dataset::open(scratch.path("holes"));
  assert_int_equal(data.frames().size(), 4);
  assert_int_equal(data.frames()[0].number, 8);
  assert_int_equal(data.frames()[3].number, 11);
  assert_true(data.frames()[1].left.empty());
  assert_false(data.frames()[1].right.empty());
  assert_true(data.frames()[2].right.empty());
  assert_int_equal(data.rig().width_px, 64);
}

void test_stamps_by_number(void**) {
  make_pairs("stamps", "left", "right", {"000000", "000003"});
  scratch.file("stamps/calib.txt", kPlainCalibration);
  scratch.file("stamps/timestamps.txt",
               "000000 1403715274000000000 0\n000001 1 0\n000003 1403715274500000000 0\n");
  // Rows of poses.txt go by number where there are enough, else by frame.
  scratch.file(
      "stamps/poses.txt",
      "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 1\n1 0 0 0 0 1 0 0 0 0 1 2\n1 0 0 0 0 1 0 0 0 0 1 3\n");
  static Dataset data;
  data = Dataset::open(scratch.path("stamps"));
  assert_near(data.frames()[1].stamp_s - data.frames()[0].stamp_s, 0.5, 1e-6);
  assert_near(data.truth_cam(1)->t.x(), 3.0, 1e-12);
  scratch.file("stamps/poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 7\n");
  data = Dataset::open(scratch.path("stamps"));
  assert_near(data.truth_cam(1)->t.x(), 7.0, 1e-12);
  scratch.file("stamps/poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n");
  assert_refused(Dataset::open(scratch.path("stamps")), "poses.txt: 1 rows for 2 frames");
  scratch.file("stamps/poses.txt", "1 0 0 0 0 2 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 7\n");
  assert_refused(Dataset::open(scratch.path("stamps")), "poses.txt:1: the left 3x3 part is not a rotation");
  scratch.file("stamps/timestamps.txt", "0 5\n3 5\n");
  assert_refused(Dataset::open(scratch.path("stamps")), "timestamps.txt: the stamp of frame 3 is not after");
  scratch.file("stamps/timestamps.txt", "0 5\n");
  assert_refused(Dataset::open(scratch.path("stamps")), "no stamp for frame 3");
  scratch.file("stamps/timestamps.txt", "0.5 5\n");
  assert_refused(Dataset::open(scratch.path("stamps")), "timestamps.txt:1: 0.5 is not a whole number");
}

void make_side(const std::string& folder, std::initializer_list<const char*> names) {
  for (const char* name : names) test::write_grey_png(scratch.path(folder + "/" + name), 64, 48);
}

void check_all_paired(const Dataset& data, std::size_t frames) {
  assert_int_equal(data.frames().size(), frames);
  for (const Frame& frame : data.frames()) assert_false(frame.left.empty() || frame.right.empty());
}

// Names as cameras and tools give them.
void test_which_image_belongs_to_which(void**) {
  static Dataset data;
  const auto open = [](const std::string& set) {
    scratch.file(set + "/calib.txt", kPlainCalibration);
    data = Dataset::open(scratch.path(set));
  };
  make_side("named/left", {"left0001.png", "left0002.png"});
  make_side("named/right", {"right0001.png", "right0002.png"});
  open("named");
  check_all_paired(data, 2);
  assert_int_equal(data.frames()[1].number, 2);
  make_side("padded/left", {"000009.png", "000010.png"});
  make_side("padded/right", {"9.png", "10.png"});
  open("padded");
  check_all_paired(data, 2);
  make_side("viso/img", {"I1_000000.png", "I2_000000.png", "I1_000001.png", "I2_000001.png"});
  open("viso");
  check_all_paired(data, 2);
  assert_true(data.notes().empty());
  make_side("times/left", {"1403715273262142976.png", "1403715273312142976.png"});
  make_side("times/right", {"1403715273262143104.png", "1403715273312143104.png"});
  open("times");
  check_all_paired(data, 2);
  assert_int_equal(data.frames()[1].number, 1);
  assert_near(data.frames()[1].stamp_s, 1403715273.312142976, 1e-6);
  assert_int_equal(data.notes().size(), 1);
  assert_true(data.notes()[0].find("differ by up to 0.000128 ms") != std::string::npos);
  make_side("apart/left", {"1403715273262142976.png", "1403715273312142976.png"});
  make_side("apart/right", {"1403715274262142976.png", "1403715274312142976.png"});
  scratch.file("apart/calib.txt", kPlainCalibration);
  assert_refused(Dataset::open(scratch.path("apart")), "name left and right of a frame alike");
}

/// Where people put both cameras: folders of other names, one folder, names that tell the side.
void test_other_places(void**) {
  static Dataset data;
  const auto open = [](const std::string& set, std::initializer_list<const char*> left,
                       std::initializer_list<const char*> right) {
    make_side(set, left);
    make_side(set, right);
    scratch.file(set + "/calib.txt", kPlainCalibration);
    data = Dataset::open(scratch.path(set));
    check_all_paired(data, left.size());
    assert_true(data.notes().empty());
    const auto begins = [](const std::filesystem::path& path, const char* name) {
      return std::filesystem::path(name).filename().string() == path.filename().string();
    };
    for (std::size_t i = 0; i < left.size(); ++i) {
      if (!begins(data.frames()[i].left, left.begin()[i]) ||
          !begins(data.frames()[i].right, right.begin()[i]))
        fail_msg("%s: frame %zu is %s and %s", set.c_str(), i, data.frames()[i].left.c_str(),
                 data.frames()[i].right.c_str());
    }
  };
  open("LR", {"img_9_L.png", "img_10_L.png"}, {"img_9_R.png", "img_10_R.png"});
  assert_int_equal(data.frames()[1].number, 10);
  open("words", {"left_0001.png", "left_0002.png"}, {"right_0001.png", "right_0002.png"});
  open("cams", {"cam0_7.png", "cam0_8.png"}, {"cam1_7.png", "cam1_8.png"});
  open("last", {"1_155_0.png", "1_179_0.png"}, {"1_155_1.png", "1_179_1.png"});
  assert_int_equal(data.frames()[0].number, 155);
  open("inside", {"images/a_left.png"}, {"images/a_right.png"});
  open("Named", {"Left/3.png", "Left/4.png"}, {"Right/3.png", "Right/4.png"});
  open("LEFT_right", {"LEFT/3.png", "LEFT/4.png"}, {"right/3.png", "right/4.png"});
  open("left_RIGHT", {"left/3.png", "left/4.png"}, {"RIGHT/3.png", "RIGHT/4.png"});
  open("tartan", {"image_left/0_left.png", "image_left/1_left.png"},
       {"image_right/0_right.png", "image_right/1_right.png"});
  open("robot", {"camera1/raw/3.png"}, {"camera2/raw/3.png"});
  open("nested", {"left/images/3.png"}, {"right/images/3.png"});
  make_side("rest", {"1_0.png", "1_1.png", "2_0.png", "2_1.png", "3_0.png", "3_1.png", "logo.png"});
  scratch.file("rest/calib.txt", kPlainCalibration);
  data = Dataset::open(scratch.path("rest"));
  check_all_paired(data, 3);
  assert_true(data.notes().size() == 1 &&
              data.notes()[0].find("1 of 7 images are left out") != std::string::npos);
}

/// Names that are times are in the order of time, however many digits they have.
void test_names_are_times(void**) {
  static Dataset data;
  const auto open = [](const std::string& set, std::initializer_list<const char*> left,
                       std::initializer_list<const char*> right) {
    make_side(set + "/left", left);
    make_side(set + "/right", right);
    scratch.file(set + "/calib.txt", kPlainCalibration);
    data = Dataset::open(scratch.path(set));
    check_all_paired(data, left.size());
    for (std::size_t i = 1; i < data.frames().size(); ++i)
      assert_near(data.frames()[i].stamp_s - data.frames()[i - 1].stamp_s, 0.25, 1e-6);
  };
  const auto same = [&](const std::string& set, std::initializer_list<const char*> names) {
    open(set, names, names);
  };
  same("seconds", {"1403715273.25.png", "1403715273.5.png", "1403715273.75.png", "1403715274.0.png"});
  same("short", {"9.5.png", "9.75.png", "10.0.png", "10.25.png"});
  same("since_start", {"0.png", "250000000.png", "500000000.png", "1000000000.png", "750000000.png"});
  same("microseconds", {"750000.png", "1000000.png"});
  same("prefixed", {"t_1403715273250000000.png", "t_1403715273500000000.png"});
  open("two_names", {"cam0_1403715273250000000.png", "cam0_1403715273500000000.png"},
       {"cam1_1403715273250000128.png", "cam1_1403715273500000128.png"});
}

void test_units_of_stamps(void**) {
  assert_near(unit_of_stamps({0.0, 0.1}), 1.0, 0.0);
  assert_near(unit_of_stamps({1403715273.2, 1403715273.3}), 1.0, 0.0);
  assert_near(unit_of_stamps({1403715273262.0, 1403715273312.0}), 1e-3, 0.0);
  assert_near(unit_of_stamps({1403715273262142.0, 1403715273312142.0}), 1e-6, 0.0);
  assert_near(unit_of_stamps({1403715273262142976.0, 1403715273312142976.0}), 1e-9, 0.0);
  assert_near(unit_of_stamps({1.4e12, 1.4e12 + 5e7}), 1e-9, 0.0);  // since the start
  assert_near(unit_of_stamps({0.0, 5e7, 1e8}), 1e-9, 0.0);
  assert_near(unit_of_stamps({0.0, 5e4, 1e5}), 1e-6, 0.0);
  assert_near(unit_of_stamps({0.0, 1e3, 2e3}), 1.0, 0.0);
}

// EuRoC's layout whole: names are times, the calibration lies beside the images, truth is the body's.
void test_euroc_layout(void**) {
  const auto sensor = [](const char* y) {
    return std::string("T_BS:\n  data: [0, 0, 1, 0.1, -1, 0, 0, ") + y +
           ", 0, -1, 0, 0, 0, 0, 0, 1]\nintrinsics: [400, 401, 31.5, 23.5]\nresolution: [64, 48]\n"
           "distortion_model: radial-tangential\ndistortion_coefficients: [0, 0, 0, 0]\n";
  };
  for (const char* camera : {"cam0", "cam1"}) {
    make_side(std::string("euroc/mav0/") + camera + "/data",
              {"1403715273262142976.png", "1403715273312142976.png", "1403715273362142976.png"});
  }
  scratch.file("euroc/mav0/cam0/sensor.yaml", sensor("0.2"));
  scratch.file("euroc/mav0/cam1/sensor.yaml", sensor("0.08"));
  scratch.file("euroc/mav0/state_groundtruth_estimate0/data.csv",
               "#timestamp, p_RS_R_x [m], ...\n1403715273257142976,1,2,3,1,0,0,0,9,9\n"
               "1403715273267142976,3,2,3,1,0,0,0,9,9\n1403715273312142976,3,4,3,1,0,0,0,9,9\n");
  static Dataset data;
  data = Dataset::open(scratch.path("euroc"));
  check_all_paired(data, 3);
  assert_near(data.rig().baseline_m, 0.12, 1e-9);
  // Halfway between two poses; the camera 0.1 m before and 0.2 m left of the body, which looks along x.
  assert_near((data.truth_cam(0)->t - Vec3(2.1, 2.2, 3.0)).norm(), 0.0, 1e-4);
  assert_near((data.truth_cam(0)->q * Vec3(0.0, 0.0, 1.0) - Vec3(1.0, 0.0, 0.0)).norm(), 0.0, 1e-9);
  assert_near((data.truth_cam(1)->t - Vec3(3.1, 4.2, 3.0)).norm(), 0.0, 1e-6);
  assert_false(data.truth_cam(2).has_value());
  assert_int_equal(data.notes().size(), 1);
  assert_true(data.notes()[0].find("2 of 3 frames") != std::string::npos);
  // Body and camera turned to north, where they drive, as qx qy qz qw; then as it is asked for.
  const char* const north =
      "#\n1403715273262142976,1,2,3,0,0,0.7071068,0.7071068\n"
      "1403715273362142976,1,4,3,0,0,0.7071068,0.7071068\n";
  scratch.file("euroc/mav0/state_groundtruth_estimate0/data.csv", north);
  assert_refused(Dataset::open(scratch.path("euroc")), "data.csv: the camera would drive sideways");
  scratch.file("euroc/mav0/state_groundtruth_estimate0/data.csv",
               "#\n1403715273262142976,1,2,3,0.7071068,0,0,0.7071068\n"
               "1403715273362142976,1,4,3,0.7071068,0,0,0.7071068\n");
  data = Dataset::open(scratch.path("euroc"));
  assert_near((data.truth_cam(2)->q * Vec3(0.0, 0.0, 1.0) - Vec3(0.0, 1.0, 0.0)).norm(), 0.0, 1e-6);
}

void test_kitti_raw_layout(void**) {
  make_side("drives/raw/image_00/data", {"0000000000.png", "0000000001.png"});
  make_side("drives/raw/image_01/data", {"0000000000.png", "0000000001.png"});
  scratch.file(
      "drives/calib_cam_to_cam.txt",
      "calib_time: 09-Jan-2012 13:57:47\nS_rect_00: 64 48\nP_rect_00: 500 0 30 0 0 500 20 0 0 0 1 0\n"
      "S_rect_01: 64 48\nP_rect_01: 500 0 30 -250 0 500 20 0 0 0 1 0\n");
  scratch.file("drives/raw/image_00/timestamps.txt",
               "2011-09-26 13:02:59.900000000\n2011-09-26 13:03:00.003000000\n");
  static Dataset data;
  data = Dataset::open(scratch.path("drives/raw"));
  assert_near(data.rig().baseline_m, 0.5, 1e-12);
  assert_near(data.frames()[0].stamp_s, 1317042179.9, 1e-5);
  assert_near(data.frames()[1].stamp_s - data.frames()[0].stamp_s, 0.103, 1e-6);
  scratch.file("drives/raw/image_00/timestamps.txt", "2011-09-26 13:02:59.9\nlater\n");
  assert_refused(Dataset::open(scratch.path("drives/raw")), "timestamps.txt:2: not a date");
}

void test_truth_that_does_not_fit_is_told(void**) {
  make_pairs("truths", "left", "right", {"0", "1", "2"});
  scratch.file("truths/calib.txt", kPlainCalibration);
  static Dataset data;
  const auto open = [](const char* text) {
    scratch.file("truths/truth_left_camera.tum", text);
    data = Dataset::open(scratch.path("truths"));
  };
  open("0 0 0 0 0.5 -0.5 0.5 -0.5\n1 1 0 0 0.5 -0.5 0.5 -0.5\n2 2 0 0 0.5 -0.5 0.5 -0.5\n");
  assert_true(data.notes().empty());
  open("10 0 0 0 0.5 -0.5 0.5 -0.5\n11 1 0 0 0.5 -0.5 0.5 -0.5\n");
  assert_int_equal(data.notes().size(), 1);
  assert_true(data.notes()[0].find("0 of 3 frames (frames 0 to 2, truth 10 to 11); no error is computed") !=
              std::string::npos);
  // A camera that looks 39 degrees down and east, and drives there, as qw qx qy qz.
  scratch.file(
      "truths/truth_left_camera.tum",
      "0 0 0 0 0.304417 -0.638224 0.638224 -0.304417\n1 1 0 0 0.304417 -0.638224 0.638224 -0.304417\n");
  assert_refused(Dataset::open(scratch.path("truths")), "write them as qx qy qz qw");
  open("0 0 0 0 -0.638224 0.638224 -0.304417 0.304417\n1 1 0 0 -0.638224 0.638224 -0.304417 0.304417\n");
  assert_near(data.truth_cam(1)->t.x(), 1.0, 0.0);
}

/// Angles of truth_rover.txt that fit the drive in another unit, with the camera's poses or by the course
/// alone; slopes on which a rover slips, and one that stands, fit as they are.
void test_angles_of_rover_truth(void**) {
  make_pairs("angles", "left", "right", {"0", "1", "2"});
  scratch.file("angles/calib.txt", kPlainCalibration);
  const auto open = [](const char* rows) {
    scratch.file("angles/truth_rover.txt", rows);
    return Dataset::open(scratch.path("angles"));
  };
  const char radians[] = "fit the drive as radians; write degrees";
  static Dataset data;
  assert_refused(open("0 0 0 0 0 0.6435 0 0\n1 1 0.8 0.6 0 0.6435 0 0\n2 2 1.6 1.2 0 0.6435 0 0\n"), radians);
  assert_refused(open("0 0 0 0 0 80 0 0\n1 1 0.98 0.17 0 80 0 0\n2 2 1.96 0.34 0 80 0 0\n"),
                 "truth_rover.txt: yaw fits the drive as a compass'");
  data = open("0 0 0 0 0 36.87 0 0\n1 1 0.8 0.6 0 36.87 0 0\n2 2 1.6 1.2 0 36.87 0 0\n");
  assert_near(attitude_of(data.truth_rover(2)->q).yaw_rad, 36.87 * kRadPerDeg, 1e-12);
  // It slips by 10 degrees.
  data = open("0 0 0 0 0 40 0 0\n1 1 0.643 0.766 0 40 0 0\n2 2 1.286 1.532 0 40 0 0\n");
  data = open("0 0 0 0 0 0.7 0 0\n1 0 0 0 0 0.7 0 0\n2 0 0 0 0 0.7 0 0\n");
  assert_near(attitude_of(data.truth_rover(2)->q).yaw_rad, 0.7 * kRadPerDeg, 1e-12);
  // Pitch and roll alone, which the camera's poses have, too: 0, 0.1 and -0.1 rad of roll about east.
  scratch.file("angles/truth_left_camera.tum",
               "0 0 0 0 0 0 0 1\n1 1 0 0 0.0499792 0 0 0.9987503\n2 2 0 0 -0.0499792 0 0 0.9987503\n");
  assert_refused(open("0 0 0 0 0 0 0 0\n1 1 1 0 0 0 0 0.1\n2 2 2 0 0 0 0 -0.1\n"), radians);
  data = open("0 0 0 0 0 0 0 0\n1 1 1 0 0 0 0 5.7296\n2 2 2 0 0 0 0 -5.7296\n");
  assert_near(attitude_of(data.truth_rover(2)->q).roll_rad, -0.1, 1e-5);
}

void test_sizes_and_depths(void**) {
  make_pairs("depth", "left", "right", {"0", "1"});
  scratch.file("depth/calib.txt", kPlainCalibration);
  static Dataset data;
  for (const char* image :
       {"depth/left/0.png", "depth/left/1.png", "depth/right/0.png", "depth/right/1.png"}) {
    test::write_image(scratch.path(image), "PNG", GDT_UInt16, 64, 48, 1,
                      [](int, int x, int y) { return 16 * test::texture(x, y); });
  }
  data = Dataset::open(scratch.path("depth"));
  assert_int_equal(data.notes().size(), 1);
  assert_true(data.notes()[0].find("12 are used") != std::string::npos);
  static PairImages pair;
  pair = data.images(0);
  assert_int_equal(pair.left.view().at(5, 3), (16 * test::texture(5, 3) * 255 + 2047) / 4095);
  test::write_grey_png(scratch.path("depth/left/1.png"), 32, 48);
  data = Dataset::open(scratch.path("depth"));
  pair = data.images(1);
  assert_int_equal(pair.faults.size(), 1);
  test::write_grey_png(scratch.path("depth/right/0.png"), 32, 48);
  assert_refused(Dataset::open(scratch.path("depth")), "right images are 32 x 48, left ones 64 x 48");
}

/// Bytes in files of 16 bits: as they are, or scaled up.
void test_bytes_in_16_bits(void**) {
  make_pairs("bytes", "left", "right", {"0"});
  scratch.file("bytes/calib.txt", kPlainCalibration);
  static Dataset data;
  static PairImages pair;
  for (const int factor : {1, 256, 257}) {
    for (const int most : {255, 50}) {  // a dark scene is no camera of fewer bits
      for (const char* image : {"bytes/left/0.png", "bytes/right/0.png"}) {
        test::write_image(scratch.path(image), "PNG", GDT_UInt16, 64, 48, 1,
                          [&](int, int x, int y) { return factor * std::min(most, test::texture(x, y)); });
      }
      data = Dataset::open(scratch.path("bytes"));
      assert_int_equal(data.notes().size(), factor == 1 ? 1 : 0);
      pair = data.images(0);
      for (int x = 0; x < 64; ++x)
        assert_true(std::abs(pair.left.view().at(x, 7) - std::min(most, test::texture(x, 7))) <= 1);
    }
  }
}

/// What most images have is the drive's size, whatever the first one has.
void test_a_first_pair_of_another_size(void**) {
  make_pairs("first", "left", "right", {"0", "1", "2", "3"});
  scratch.file("first/calib.txt", kPlainCalibration);
  for (const char* image : {"first/left/0.png", "first/right/0.png"})
    test::write_grey_png(scratch.path(image), 32, 24);
  static Dataset data;
  data = Dataset::open(scratch.path("first"));
  assert_int_equal(data.rig().width_px, 64);
  assert_int_equal(data.rig().height_px, 48);
  static PairImages pair;
  pair = data.images(0);
  assert_int_equal(pair.faults.size(), 2);
  assert_true(pair.faults[0].find("left/0.png: is 32 x 24, most others 64 x 48; not used") !=
              std::string::npos);
  assert_true(data.images(1).faults.empty());
}

// Right images of another principal point, by whole pixels: each side moves by half of the difference.
void test_a_pair_that_is_not_rectified(void**) {
  make_pairs("raw", "left", "right", {"0", "1"});
  scratch.file("raw/calib.txt", "400 0 25 0 0 400 24 0 0 0 1 0\n400 0 27 -48 0 400 26 0 0 0 1 0\n");
  scratch.file("raw/truth_left_camera.tum", "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n");
  static Dataset data;
  data = Dataset::open(scratch.path("raw"));
  assert_near(data.rig().cx_px, 26.0, 1e-9);
  assert_near(data.rig().cy_px, 25.0, 1e-9);
  assert_near(data.rig().baseline_m, 0.12, 1e-9);
  assert_int_equal(data.rig().width_px, 64);
  assert_int_equal(data.notes().size(), 1);
  assert_true(data.notes()[0].find("principal points differ") != std::string::npos);
  assert_true(data.notes()[0].find("rectified here to 64 x 48") != std::string::npos);
  static PairImages pair;
  pair = data.images(0);
  static Image plain;
  plain = load_grey(scratch.path("raw/left/0.png"));
  const Image& left = pair.left;
  const Image& right = pair.right;
  static Image plain_right;
  plain_right = load_grey(scratch.path("raw/right/0.png"));
  for (int y = 1; y < 47; ++y) {
    for (int x = 1; x < 63; ++x) {
      assert_int_equal(left.view().at(x, y), plain.view().at(x - 1, y - 1));
      assert_int_equal(right.view().at(x, y), plain_right.view().at(x + 1, y + 1));
    }
  }
}

// A raw left camera that is turned: truth is of the camera whose images are flown.
void test_truth_of_a_turned_camera(void**) {
  const auto sensor = [](const char* T_BS) {
    return std::string("T_BS:\n  data: [") + T_BS +
           "]\nintrinsics: [400, 400, 31.5, 23.5]\nresolution: [64, 48]\n"
           "distortion_model: radial-tangential\ndistortion_coefficients: [-0.1, 0, 0, 0]\n";
  };
  for (const char* camera : {"cam0", "cam1"})
    make_side(std::string("turned/mav0/") + camera + "/data", {"0.png", "1.png"});
  // Both rolled by asin 0.1, which the baseline undoes.
  const std::string R = "0.99498743710662, -0.1, 0, ",
                    S = ", 0.1, 0.99498743710662, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1";
  scratch.file("turned/mav0/cam0/sensor.yaml", sensor((R + "0" + S).c_str()));
  scratch.file("turned/mav0/cam1/sensor.yaml", sensor((R + "0.12" + S).c_str()));
  scratch.file("turned/truth_left_camera.tum",
               "0 0 0 0 0 0 0.05006285 0.99874607\n1 1 0 0 0 0 0.05006285 0.99874607\n");
  static Dataset data;
  data = Dataset::open(scratch.path("turned"));
  assert_near((data.truth_cam(1)->q * Vec3(1.0, 0.0, 0.0) - Vec3(1.0, 0.0, 0.0)).norm(), 0.0, 1e-6);
  assert_near(data.truth_cam(1)->t.x(), 1.0, 0.0);
}

// Which of a calibration's two kinds the images are: by size, else as told.
void test_raw_or_rectified(void**) {
  make_pairs("both", "image_00/data", "image_01/data", {"0", "1"});
  const auto calibration = [](const char* S, const char* S_rect) {
    std::string text = "calib_time: now\n";
    for (const char* i : {"00", "01"}) {
      const bool right = i[1] == '1';
      const std::string n = i;
      text += "S_" + n + ": " + S + "\nK_" + n + ": 450 0 32 0 450 24 0 0 1\nD_" + n +
              ": -0.3 0.1 0 0 0\nR_" + n + ": 1 0 0 0 1 0 0 0 1\nT_" + n + ": " + (right ? "-0.5" : "0") +
              " 0 0\nS_rect_" + n + ": " + S_rect + "\nR_rect_" + n + ": 1 0 0 0 1 0 0 0 1\nP_rect_" + n +
              ": 500 0 30 " + (right ? "-250" : "0") + " 0 500 20 0 0 0 1 0\n";
    }
    scratch.file("both/calib_cam_to_cam.txt", text);
  };
  static Dataset data;
  const auto fx = [](ImagesAre are) {
    data = Dataset::open(scratch.path("both"), {}, are);
    return data.rig().fx_px;
  };
  calibration("64 48", "64 48");
  assert_near(fx(ImagesAre::kRectified), 500.0, 1e-9);
  assert_near(fx(ImagesAre::kRaw), 450.0, 1e-9);
  calibration("64 48", "60 40");
  assert_near(fx(ImagesAre::kRectified), 450.0, 1e-9);
  calibration("70 50", "64 48");
  assert_near(fx(ImagesAre::kRectified), 500.0, 1e-9);
}

void test_refusals_of_images(void**) {
  assert_refused(Dataset::open(scratch.path("nowhere")), "nowhere: no such folder");
  std::filesystem::create_directories(scratch.path("empty") / "left");
  assert_refused(Dataset::open(scratch.path("empty")), "right: no such folder");
  std::filesystem::create_directories(scratch.path("empty") / "right");
  assert_refused(Dataset::open(scratch.path("empty")), "left: no image here");
  scratch.file("empty/left/0.png.gz", "x");
  assert_refused(Dataset::open(scratch.path("empty")), "but 0.png.gz: unpack or convert it");
  scratch.file("empty/left/0.png", "x");
  assert_refused(Dataset::open(scratch.path("empty")), "right: no image here");
  scratch.file("empty/right/0.png", "x");
  assert_refused(Dataset::open(scratch.path("empty")), "no image can be read");
  scratch.file("empty/right/0.jpg", "x");
  assert_refused(Dataset::open(scratch.path("empty")), "frame '0' has two images");
  std::filesystem::create_directories(scratch.path("bare") / "other");
  assert_refused(Dataset::open(scratch.path("bare")), "no folder of left images");
  test::write_grey_png(scratch.path("bare/0.png"), 64, 48);
  assert_refused(Dataset::open(scratch.path("bare")), "names of images (0.png) tell no side");
  make_pairs("above/drive", "left", "right", {"0"});
  assert_refused(Dataset::open(scratch.path("above")), "above/drive; give that one");
  make_pairs("digits", "left", "right", {"5", "05"});
  assert_refused(Dataset::open(scratch.path("digits")), "the same number of digits");
}

void test_refusals_of_calibration(void**) {
  make_pairs("calib", "left", "right", {"0"});
  const auto refuse = [](const char* text, const char* word) {
    scratch.file("calib/calib.txt", text);
    assert_refused(Dataset::open(scratch.path("calib")), word);
  };
  assert_refused(Dataset::open(scratch.path("calib")), "calib.txt: no such file");
  refuse("", "neither one line");
  refuse("400 400 31.5 23.5\n", "neither one line");
  refuse("400 400 31.5 x 0.12\n", "calib.txt:1: 'x' is not a finite number");
  refuse("400 400 31.5 nan 0.12\n", "calib.txt:1: 'nan' is not a finite number");
  refuse("400 400 31.5 23.5 -0.12\n", "above 0");
  refuse("0 400 31.5 23.5 0.12\n", "above 0");
  refuse("P0: 500 0 30 0 0 500 20 0 0 0 1 0\n", "neither one line");
  refuse("500 0 30 0 0 500 20 0 0 0 1 0\n500 0 30 250 0 500 20 0 0 0 1 0\n", "swapped");
  refuse("400 400 3100.5 23.5 0.12\n", "outside of the image of 64 x 48");
  refuse("400 400 31.5 23.5 120\n", "millimetres");
  refuse(
      "cam0=[400 0 30; 0 400 20; 0 0 1]\ncam1=[400 0 30; 0 400 20; 0 0 1]\nbaseline=120\nwidth=32\nheight=24\n",
      "images of 32 x 24, these are 64 x 48");
  refuse("500 9 30 0 0 500 20 0 0 0 1 0\n500 0 30 -250 0 500 20 0 0 0 1 0\n", "calib.txt:1: not the 3x4");
}

// The two truth files tell the same: the camera sits on a 0.7 m mast, 39 degrees down (the set's README).
void check_rendered_truth(const Dataset& data, std::size_t i) {
  const Pose3 T_rover_cam = mast_pose(0.7, 39.0 * kRadPerDeg, data.rig().baseline_m);
  const Pose3 difference = (*data.truth_rover(i) * T_rover_cam).inverse() * *data.truth_cam(i);
  assert_near(difference.t.norm(), 0.0, 1e-5);
  assert_near(quat_log(difference.q).norm(), 0.0, 1e-6);
}

// The sample that lies in the repository is whole: pairs, truth that agrees with itself, rocks.
void test_sample(void**) {
  static Dataset data;
  data = Dataset::open(CAIRN_SOURCE_DIR "/unit_tests/integration/sample");
  assert_int_equal(data.frames().size(), 91);
  assert_int_equal(data.rig().width_px, 512);
  assert_int_equal(data.rig().height_px, 384);
  assert_int_equal(data.truth_rocks().size(), 537);
  for (std::size_t i = 0; i < data.frames().size(); ++i) {
    assert_false(data.frames()[i].left.empty() || data.frames()[i].right.empty());
    check_rendered_truth(data, i);
  }
}

void test_real_sets(void**) {
  static std::string rendered, kitti, euroc;
  rendered = test::find_data("rendered_dev");
  kitti = test::find_data("kitti06");
  euroc = test::find_data("euroc_still");
  SKIP_WITHOUT(rendered, "rendered_dev");
  SKIP_WITHOUT(kitti, "kitti06");
  SKIP_WITHOUT(euroc, "euroc_still");
  static Dataset data;
  data = Dataset::open(rendered);
  assert_int_equal(data.frames().size(), 417);
  assert_int_equal(data.rig().width_px, 512);
  assert_true(data.truth_rocks().size() > 1000);
  for (std::size_t i = 0; i < data.frames().size(); i += 50) check_rendered_truth(data, i);
  data = Dataset::open(kitti);
  assert_int_equal(data.frames().size(), 51);
  assert_near(data.rig().baseline_m, 0.5371506, 1e-6);
  assert_true(data.truth_cam(50)->t.x() > 50.0);
  data = Dataset::open(euroc);
  assert_int_equal(data.frames().size(), 25);
  assert_int_equal(data.frames()[24].number, 72);
  assert_near(data.frames()[1].stamp_s - data.frames()[0].stamp_s, 0.15, 1e-6);
  assert_true(data.truth_cam(24)->t.norm() < 0.02);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_plain_layout),
      cmocka_unit_test(test_kitti_layout),
      cmocka_unit_test(test_kitti_colour_pair),
      cmocka_unit_test(test_poses_beside_sequences),
      cmocka_unit_test(test_calibrations_by_any_name),
      cmocka_unit_test(test_poses_are_the_cameras),
      cmocka_unit_test(test_missing_images_are_frames),
      cmocka_unit_test(test_stamps_by_number),
      cmocka_unit_test(test_which_image_belongs_to_which),
      cmocka_unit_test(test_other_places),
      cmocka_unit_test(test_names_are_times),
      cmocka_unit_test(test_units_of_stamps),
      cmocka_unit_test(test_euroc_layout),
      cmocka_unit_test(test_kitti_raw_layout),
      cmocka_unit_test(test_truth_that_does_not_fit_is_told),
      cmocka_unit_test(test_angles_of_rover_truth),
      cmocka_unit_test(test_sizes_and_depths),
      cmocka_unit_test(test_bytes_in_16_bits),
      cmocka_unit_test(test_a_first_pair_of_another_size),
      cmocka_unit_test(test_a_pair_that_is_not_rectified),
      cmocka_unit_test(test_truth_of_a_turned_camera),
      cmocka_unit_test(test_raw_or_rectified),
      cmocka_unit_test(test_refusals_of_images),
      cmocka_unit_test(test_refusals_of_calibration),
      cmocka_unit_test(test_sample),
      cmocka_unit_test(test_real_sets),
  };
  return cmocka_run_group_tests_name("ground_tools/dataset/dataset", tests, nullptr, nullptr);
}
