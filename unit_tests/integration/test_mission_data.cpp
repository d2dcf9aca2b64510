// The figures that the project promises of odometry, on whole data sets: each mission runs the one that its
// sizes are made for (make MISSION=kitti build/host-kitti/tests/integration/test_mission_data).
#include <cstring>

#include "integration/replay.hpp"
#include "support/data.hpp"

using namespace cairn;
using namespace cairn::ground;
using namespace cairn::test;

namespace {

Localizer localizer;
Pair pair;

std::string folder;
Dataset data;

/// VO alone on a data set with camera poses: position error of the last frame, the first being given.
struct VoDrive {
  double path_m = 0.0;
  double end_m = 0.0;
  double end_deg = 0.0;
  double moved_m = 0.0;  ///< from first to last, as VO has it
};

VoDrive vo_drive(std::uint64_t seed = 1) {
  VoDrive out;
  LocalizerParams params;
  params.vo.motion.seed = seed;
  const StereoRig rig = rig_of(data);
  assert_status(localizer.init(params, rig), LocalizerStatus::kReady);
  assert_status(localizer.set_start(*data.truth_cam(0) * rig.T_rover_cam.inverse(), 0.02, 0.004),
                LocalizerStatus::kReady);
  WorkBudget all = WorkBudget::unlimited();
  for (std::size_t i = 0; i < data.frames().size(); ++i) {
    load(data.frames()[i], pair);
    assert_status(localizer.begin_frame(pair.left.view(), pair.right.view(), nullptr),
                  LocalizerStatus::kReady);
    assert_status(localizer.step_vo(all), Progress::kDone);
    assert_status(localizer.pose_source(), i == 0 ? PoseSource::kStart : PoseSource::kVo);
    if (i > 0) out.path_m += (data.truth_cam(i)->t - data.truth_cam(i - 1)->t).norm();
  }
  const Pose3 truth = *data.truth_cam(data.frames().size() - 1);
  out.end_m = (localizer.vo_T_map_cam().t - truth.t).norm();
  out.end_deg = rotation_error_deg(localizer.vo_T_map_cam(), truth);
  out.moved_m = (localizer.vo_T_map_cam().t - data.truth_cam(0)->t).norm();
  print_message("%.2f m: VO %.4f m (%.2f %%) %.3f deg, moved %.4f m\n", out.path_m, out.end_m,
                100.0 * out.end_m / out.path_m, out.end_deg, out.moved_m);
  return out;
}

void test_kitti(void**) {
  NEEDS_DATA(folder, "kitti06");
  data = Dataset::open(folder);
  const VoDrive d = vo_drive();
  assert_at_least(d.path_m, 50.0);
  assert_at_most(d.end_m, 0.010 * d.path_m);
  // Which triples RANSAC draws must not matter: where it does, some frame was left with a poor start.
  assert_at_most(std::fabs(vo_drive(4).end_m - d.end_m), 0.001 * d.path_m);
}

void test_euroc_standing_still(void**) {
  NEEDS_DATA(folder, "euroc_still");
  data = Dataset::open(folder);
  assert_at_most(vo_drive().end_m, 0.005);
}

// A lunar drive without truth: what is known is that ways over different frames lead to the same place.
constexpr const char* kLunarFrames[] = {"155", "179", "185", "191", "247", "283"};

StereoRig lunar_rig() {
  const cfg::Mission& m = cfg::kMission;
  StereoRig rig;
  rig.width_px = m.image_width_px;
  rig.height_px = m.image_height_px;
  rig.fx_px = m.fx_px;
  rig.fy_px = m.fy_px;
  rig.cx_px = m.cx_px;
  rig.cy_px = m.cy_px;
  rig.baseline_m = m.baseline_m;
  return rig;
}

/// Motion of the camera over the frames given (T_first_last), each step of which must succeed.
Pose3 lunar_way(std::initializer_list<int> frames) {
  Pose3 way;
  static VisualOdometry vo;
  assert_true(vo.init({}, lunar_rig()));
  WorkBudget all = WorkBudget::unlimited();
  bool first = true;
  for (const int i : frames) {
    Frame frame;
    frame.left = folder + "/1_" + kLunarFrames[i] + "_0.png";
    frame.right = folder + "/1_" + kLunarFrames[i] + "_1.png";
    load(frame, pair);
    assert_status(vo.start(pair.left.view(), pair.right.view()), VoStatus::kRunning);
    assert_status(vo.step(all), Progress::kDone);
    assert_status(vo.status(), first ? VoStatus::kFirstFrame : VoStatus::kMotion);
    if (!first) way = way * vo.result().T_prev_cur;
    first = false;
  }
  return way;
}

double apart_m(const Pose3& a, const Pose3& b) {
  print_message("ways of %.3f m, %.4f m apart\n", a.t.norm(), (a.t - b.t).norm());
  return (a.t - b.t).norm();
}

void test_lunar_ways_agree(void**) {
  NEEDS_DATA(folder, "lac_stereo");
  const Pose3 whole = lunar_way({0, 1, 2, 3, 4, 5});
  assert_at_least(whole.t.norm(), 1.5);
  assert_at_most(whole.t.norm(), 2.5);
  assert_at_most(apart_m(lunar_way({0, 1, 2, 3}), lunar_way({0, 3})), 0.005);
  assert_at_most(apart_m(lunar_way({1, 2, 3}), lunar_way({1, 3})), 0.005);
}

}  // namespace

int main() {
  const CMUnitTest kitti[] = {cmocka_unit_test(test_kitti)};
  const CMUnitTest euroc[] = {cmocka_unit_test(test_euroc_standing_still)};
  const CMUnitTest lunar[] = {cmocka_unit_test(test_lunar_ways_agree)};
  const auto is = [](const char* mission) { return std::strcmp(cfg::kMission.name, mission) == 0; };
  if (is("kitti")) return cmocka_run_group_tests_name("mission_data, kitti", kitti, nullptr, nullptr);
  if (is("euroc")) return cmocka_run_group_tests_name("mission_data, euroc", euroc, nullptr, nullptr);
  if (is("lunar")) return cmocka_run_group_tests_name("mission_data, lunar", lunar, nullptr, nullptr);
  print_message("mission %s has no data set here\n", cfg::kMission.name);
  return 1;
}
