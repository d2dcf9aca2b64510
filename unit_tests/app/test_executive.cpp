// The executive: the walk of the schedule, and what follows from each overrun.
#include "app/executive.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

#include "orbital_map/small_map.hpp"
#include "support/cmocka.hpp"
#include "support/death.hpp"
#include "support/plane_scene.hpp"

using namespace cairn;
using namespace cairn::app;
using cfg::Task;

namespace {

constexpr int kBeginMinor = 24;  // of kFixBegin in the table, and where kFixApply is due
constexpr int kApplyMinor = 29;
constexpr int kVo = static_cast<int>(Task::kVo);
constexpr int kBoulders = static_cast<int>(Task::kBoulders);
constexpr int kFix = static_cast<int>(Task::kFix);
const Vec3 kStart(-25.5, 2251010.25, 0.0);  // in the middle of small_map.hpp's ground

test::PlaneScene scene;
std::uint8_t left_pixels[2][cfg::kImagePixels];
std::uint8_t right_pixels[2][cfg::kImagePixels];
Localizer localizer;
Localizer reference;
Executive executive;
test::MapBytes map;
test::GridBoulder grid[4000];
BoulderSightings sightings;

StereoRig rig() {
  StereoRig r;
  r.width_px = cfg::kImageWidth;
  r.height_px = cfg::kImageHeight;
  r.fx_px = cfg::kMission.fx_px;
  r.fy_px = cfg::kMission.fy_px;
  r.cx_px = cfg::kMission.cx_px;
  r.cy_px = cfg::kMission.cy_px;
  r.baseline_m = cfg::kMission.baseline_m;
  r.T_rover_cam = mast_pose(cfg::kMission.camera_height_m, cfg::kMission.camera_pitch_down_rad, r.baseline_m);
  return r;
}

ImageU8 image(const std::uint8_t* pixels) { return packed_view(pixels, cfg::kImageWidth, cfg::kImageHeight); }
ImageU8 left(int i) { return image(left_pixels[i]); }
ImageU8 right(int i) { return image(right_pixels[i]); }

/// Two pairs, 6 cm apart.
int make_scene(void**) {
  Random random(5);
  scene.make(3);
  for (int i = 0; i < 2; ++i) {
    const Pose3 T_world_cam = Pose3{Quat::Identity(), Vec3(0.06 * i, 0.0, 0.0)} * rig().T_rover_cam;
    scene.render(rig(), T_world_cam, false, 1.5, random, left_pixels[i]);
    scene.render(rig(), T_world_cam, true, 1.5, random, right_pixels[i]);
  }
  return 0;
}

/// Boulders come by the window of frames, whatever the map's pixel.
void start(Localizer& l, LocalizerParams params) {
  params.landmarks.least_pixel_m = 1.0e3;
  assert_status(l.init(params, rig()), LocalizerStatus::kReady);
  assert_status(l.set_start({Quat::Identity(), kStart}, 0.05, 0.01), LocalizerStatus::kReady);
  executive.init();
}

/// A whole minor frame in slices.
void minor_frame(const ImageU8& l, const ImageU8& r, std::uint32_t slice_ops = UINT32_MAX) {
  assert_status(executive.begin_minor(localizer, l, r, nullptr), LocalizerStatus::kReady);
  for (;;) {
    WorkBudget slice(slice_ops);
    if (executive.run(localizer, slice) == Progress::kDone) break;
  }
  assert_false(executive.busy());
}
void blind_minor_frame() { minor_frame(ImageU8(), ImageU8()); }

using Rows = cfg::ScheduleRow[cfg::kScheduleRows];

/// The mission's table, and one fault in it.
template <typename Fault>
bool sound_with(Fault fault) {
  Rows rows = {};
  std::copy(std::begin(cfg::kSchedule), std::end(cfg::kSchedule), rows);
  fault(rows);
  return cfg::is_sound(rows, cfg::kScheduleRows);
}

/// The order of rows that never share a minor frame does not matter; that of the others does.
void test_what_a_sound_table_is(void**) {
  static_assert(cfg::kFixBeginMinor == kBeginMinor && cfg::kFixDueMinor == kApplyMinor);
  assert_true(sound_with([](Rows&) {}));
  assert_true(sound_with([](Rows& rows) { std::swap(rows[4], rows[5]); }));
  assert_true(sound_with([](Rows& rows) { std::swap(rows[1], rows[5]); }));
  assert_false(sound_with([](Rows& rows) { std::swap(rows[0], rows[1]); }));     // VO second
  assert_false(sound_with([](Rows& rows) { rows[0].last_minor = 28; }));         // not always
  assert_false(sound_with([](Rows& rows) { rows[1].task = Task::kVo; }));        // twice
  assert_false(sound_with([](Rows& rows) { rows[2].last_minor = 25; }));         // two fixes begin
  assert_false(sound_with([](Rows& rows) { rows[2].task = Task::kBoulders; }));  // none
  assert_false(sound_with([](Rows& rows) { rows[3].last_minor = 23; }));         // not worked on before
  assert_false(sound_with([](Rows& rows) {                                       // ... nor in time
    rows[3].first_minor = 29;
    std::swap(rows[3], rows[5]);
  }));
  assert_false(sound_with([](Rows& rows) { rows[5].first_minor = 25; }));        // applied before it is due
  assert_false(sound_with([](Rows& rows) { rows[5].task = Task::kBoulders; }));  // never
  assert_false(sound_with([](Rows& rows) { rows[4].last_minor = 24; }));         // in the frame it begins in
  assert_false(sound_with([](Rows& rows) { rows[5].last_minor = 30; }));         // beyond the major frame
  assert_false(sound_with([](Rows& rows) { rows[1].first_minor = -1; }));
  assert_false(sound_with([](Rows& rows) { rows[1].ops = 0; }));
}

void test_walk_of_the_table(void**) {
  start(localizer, LocalizerParams());
  for (int n = 0; n < 2 * cfg::kMinorFrames + 3; ++n) {
    const int minor = n % cfg::kMinorFrames;
    blind_minor_frame();
    assert_int_equal(executive.minor(), minor);
    assert_int_equal(executive.fix_closed(), minor == kApplyMinor);
    if (minor == kBeginMinor) assert_int_equal(localizer.last_fix().frame, n + 1);
    if (n < kBeginMinor) assert_status(localizer.last_fix().status, FixStatus::kNone);
    if (minor == kApplyMinor) assert_status(localizer.last_fix().status, FixStatus::kNoMap);
  }
  for (const std::uint32_t overruns : executive.counts().overruns) assert_int_equal(overruns, 0);
  assert_int_equal(executive.counts().dropped_pairs, 0);
  assert_int_equal(localizer.health().frames, 2 * cfg::kMinorFrames + 3);
  assert_int_equal(localizer.health().fixes[static_cast<int>(FixStatus::kNoMap)], 2);
}

void test_no_start_no_minor_frame(void**) {
  assert_status(localizer.init(LocalizerParams(), rig()), LocalizerStatus::kReady);
  executive.init();
  assert_status(executive.begin_minor(localizer, left(0), right(0), nullptr), LocalizerStatus::kNoStart);
  assert_false(executive.busy());
  assert_false(localizer.vo_open());
  assert_int_equal(executive.minor(), cfg::kMinorFrames - 1);
  WorkBudget slice(1000);
  assert_status(executive.run(localizer, slice), Progress::kDone);
  assert_int_equal(slice.spent(), 0);
}

void test_vo_comes_first(void**) {
  start(localizer, LocalizerParams());
  assert_status(executive.begin_minor(localizer, left(0), right(0), nullptr), LocalizerStatus::kReady);
  std::uint32_t vo_ops = 0;
  int slices = 0;
  for (bool more = true; more; ++slices) {
    const bool vo_was_open = localizer.vo_open();
    WorkBudget slice(300007);
    more = executive.run(localizer, slice) == Progress::kMore;
    assert_at_most(slice.spent(), 300007 + 20000);  // by one unit of work
    const std::uint32_t(&ops)[cfg::kTaskCount] = executive.work().ops;
    if (localizer.vo_open()) assert_int_equal(ops[kBoulders], 0);
    if (!vo_was_open) assert_int_equal(ops[kVo], vo_ops);
    vo_ops = ops[kVo];
  }
  assert_at_least(slices, 20);
  assert_true(vo_ops > 1000000 && executive.work().ops[kBoulders] > 1000000);
}

// A slice is a time: of a task whose operations take longer it does fewer.
void test_slices_weigh_operations(void**) {
  constexpr std::uint32_t kSlice = 300007;
  constexpr std::uint32_t kUnit = 5000;  // no unit of the boulders is longer
  start(localizer, LocalizerParams());
  assert_status(executive.begin_minor(localizer, left(0), right(0), nullptr), LocalizerStatus::kReady);
  int whole = 0;  // slices that were the boulders' alone
  for (bool more = true; more;) {
    const bool vo_was_open = localizer.vo_open();
    const std::uint32_t before = executive.work().ops[kBoulders];
    WorkBudget slice(kSlice);
    more = executive.run(localizer, slice) == Progress::kMore;
    const std::uint32_t done = executive.work().ops[kBoulders] - before;
    assert_at_most(done, kSlice / cfg::kTaskWeight[kBoulders] + kUnit);
    if (vo_was_open || !more) continue;
    ++whole;
    assert_at_least(done, kSlice / cfg::kTaskWeight[kBoulders] - kUnit);
    assert_int_equal(slice.spent(), done * cfg::kTaskWeight[kBoulders]);
  }
  assert_at_least(whole, 10);
}

void test_slices_change_nothing(void**) {
  static MinorWork work[2];
  static Pose3 poses[2];
  for (int way = 0; way < 2; ++way) {
    start(localizer, LocalizerParams());
    for (int i = 0; i < 2; ++i) minor_frame(left(i), right(i), way == 0 ? UINT32_MAX : 10007);
    work[way] = executive.work();
    poses[way] = localizer.T_map_cam();
    assert_status(localizer.pose_source(), PoseSource::kVo);
  }
  for (std::size_t t = 0; t < cfg::kTaskCount; ++t) assert_int_equal(work[0].ops[t], work[1].ops[t]);
  assert_true(poses[0].t == poses[1].t && poses[0].q.coeffs() == poses[1].q.coeffs());
  WorkBudget none(0);  // a slice of nothing does nothing
  assert_status(executive.begin_minor(localizer, left(0), right(0), nullptr), LocalizerStatus::kReady);
  assert_status(executive.run(localizer, none), Progress::kMore);
  assert_int_equal(executive.work().ops[kVo], 0);
}

/// So many hypotheses that RANSAC takes more than a minor frame has, and less than two. One that few pairs
/// agree with ends no search early.
LocalizerParams slow_vo() {
  LocalizerParams params;
  params.vo.motion.max_hypotheses = 5000;
  params.vo.motion.confidence = 1.0 - 1e-15;
  params.vo.motion.inlier_px = 0.04;
  params.vo.motion.min_inliers = 4;
  return params;
}

void test_vo_overrun_drops_the_next_pair(void**) {
  start(localizer, slow_vo());
  minor_frame(left(0), right(0));
  assert_int_equal(executive.counts().overruns[kVo], 0);
  minor_frame(left(1), right(1));
  assert_int_equal(executive.counts().overruns[kVo], 1);
  assert_true(localizer.vo_open());
  assert_status(localizer.vo().status(), VoStatus::kRunning);
  assert_int_equal(executive.work().ops[kBoulders], 0);
  assert_at_least(executive.work().ops[kVo], cfg::kVoOps);
  assert_status(localizer.pose_source(), PoseSource::kStart);

  minor_frame(left(0), right(0));  // this pair is dropped; VO finishes the one before, and boulders follow
  assert_int_equal(executive.counts().dropped_pairs, 1);
  assert_int_equal(executive.counts().overruns[kVo], 1);
  assert_false(localizer.vo_open());
  assert_int_equal(localizer.health().frames, 2);
  assert_int_equal(localizer.health().abandoned_boulders, 0);
  assert_true(executive.work().ops[kBoulders] > 1000000);
  assert_status(localizer.pose_source(), PoseSource::kVo);
  assert_int_equal(executive.minor(), 2);

  // The same bits as with all the time in the world.
  assert_status(reference.init(slow_vo(), rig()), LocalizerStatus::kReady);
  assert_status(reference.set_start({Quat::Identity(), kStart}, 0.05, 0.01), LocalizerStatus::kReady);
  for (int i = 0; i < 2; ++i) {
    assert_status(reference.begin_frame(left(i), right(i), nullptr), LocalizerStatus::kReady);
    WorkBudget all = WorkBudget::unlimited();
    assert_status(reference.step_vo(all), Progress::kDone);
    assert_status(reference.step_boulders(all), Progress::kDone);
  }
  assert_true(reference.T_map_cam().t == localizer.T_map_cam().t);
  assert_true(reference.T_map_cam().q.coeffs() == localizer.T_map_cam().q.coeffs());
  assert_status(reference.observer().status(), localizer.observer().status());

  minor_frame(left(0), right(0));  // and the next one is taken again
  assert_int_equal(executive.counts().dropped_pairs, 1);
  assert_int_equal(localizer.health().frames, 3);
}

void test_boulder_overrun_is_abandoned(void**) {
  LocalizerParams params;
  params.boulders.segmentation.spatial_radius_px = 32;
  start(localizer, params);
  minor_frame(left(0), right(0));
  assert_int_equal(executive.counts().overruns[kBoulders], 1);
  assert_int_equal(executive.counts().overruns[kVo], 0);
  assert_false(localizer.vo_open());
  assert_status(localizer.observer().status(), ObserveStatus::kRunning);
  assert_at_least(executive.work().ops[kBoulders], cfg::kBoulderOps);
  assert_int_equal(localizer.health().abandoned_boulders, 0);
  blind_minor_frame();
  assert_int_equal(localizer.health().abandoned_boulders, 1);
  assert_status(localizer.observer().status(), ObserveStatus::kIdle);
  assert_int_equal(localizer.tracks().created(), 0);
  assert_int_equal(executive.counts().dropped_pairs, 0);
  assert_int_equal(executive.work().ops[kBoulders], 0);
}

void see_boulders() {
  for (std::uint32_t frame = 1; frame <= 5; ++frame) {
    WorkBudget all = WorkBudget::unlimited();
    localizer.tracks().start(sightings, frame);
    assert_status(localizer.tracks().step(all), Progress::kDone);
  }
}

/// A map about the start, and boulders beside its own as if they had been seen.
void make_boulders(unsigned count = 4000) {
  for (unsigned i = 0; i < count; ++i) grid[i] = {0, 25 * (i % 80), 40 * (i / 80), 300};
  test::make_map(map, 1, 1, 10000, 0.01, grid, count);
  MapValidation validation;
  assert_status(validation.start(map.bytes, map.size), MapStatus::kChecking);
  WorkBudget budget = WorkBudget::unlimited();
  assert_status(validation.step(budget), Progress::kDone);
  assert_status(validation.status(), MapStatus::kUsable);
  localizer.set_map(validation.result());
  sightings.clear();
  Random random(9);
  for (unsigned i = 0; i < 120; ++i) {
    BoulderSighting s;
    s.p_site_m = Vec3(0.5 * (i % 12) - 3.0 + 0.03 + 1e-5 * random.below(1000),
                      0.8 * (i / 12) - 4.0 + 0.02 + 1e-5 * random.below(1000), 0.1);
    s.diameter_m = 0.3F;
    s.range_m = 1.0F;
    s.points = 10;
    assert_true(sightings.push_back(s));
  }
  see_boulders();
}

void test_late_fix_is_counted(void**) {
  LocalizerParams params;
  params.correction = CorrectionMode::kWhole;
  params.map_window_radius_m = 100.0;
  params.icp.gate_start_m = 1000.0;  // every boulder is near to every other: much to compare
  params.icp.gate_final_m = 1000.0;
  params.icp.max_iterations = 1000;
  params.icp.step_m = 0.0;
  params.icp.step_rad = 0.0;
  start(localizer, params);
  make_boulders();
  for (std::uint32_t round = 1; round <= 2; ++round) {
    for (int n = 0; n < cfg::kMinorFrames; ++n) blind_minor_frame();
    assert_true(executive.fix_closed());
    assert_status(localizer.last_fix().status, FixStatus::kLate);
    assert_int_equal(localizer.last_fix().local_boulders, 120);
    assert_int_equal(localizer.last_fix().map_boulders, 4000);
    assert_int_equal(executive.counts().overruns[kFix], round);
    assert_int_equal(localizer.health().fixes[static_cast<int>(FixStatus::kLate)], round);
    assert_near((localizer.T_map_rover().t - kStart).norm(), 0.0, 0.0);
  }
}

/// A search that takes longer than to the row of its major frame is closed in the frame that ends it, and the
/// next fix begins in its own; how far it is, the last minor frame tells.
void test_a_long_search_is_closed_once_it_is_done(void**) {
  LocalizerParams params;
  start(localizer, params);
  assert_status(localizer.set_start({Quat::Identity(), kStart}, 2.0e4, 3.0), LocalizerStatus::kReady);
  make_boulders(300);
  localizer.tracks().init(params.tracks);
  sightings.resize(24);
  Random random(17);  // boulders of no place on it
  for (BoulderSighting& s : sightings)
    s.p_site_m = Vec3(1e-3 * random.below(9000) - 4.5, 1e-3 * random.below(9000) - 4.5, 0.1);
  see_boulders();
  int late = 0;
  for (int n = 0; late == 0 && n < 20 * cfg::kMinorFrames; ++n) {
    const bool open = localizer.last_fix().status == FixStatus::kRunning;
    blind_minor_frame();
    const int minor = executive.minor();
    const bool closed = open && localizer.last_fix().status != FixStatus::kRunning;
    assert_int_equal(executive.fix_closed(), closed || minor == kApplyMinor);
    if (minor == kApplyMinor || !open || minor > 22) continue;
    // Done in the frame that had operations to spare.
    assert_int_equal(closed, executive.work().ops[kFix] < 2'000'000);
    late += closed;
  }
  assert_int_equal(late, 1);
}

void test_fix_in_time_is_not(void**) {
  LocalizerParams params;
  params.correction = CorrectionMode::kWhole;  // the scene is a lattice: a search would find it ambiguous
  start(localizer, params);
  make_boulders();
  std::uint32_t most = 0;
  for (int n = 0; n < cfg::kMinorFrames; ++n) {
    blind_minor_frame();
    const std::uint32_t ops = executive.work().ops[kFix];
    assert_int_equal(ops > 0, n >= kBeginMinor && n < kApplyMinor && ops > 0);
    if (ops > most) most = ops;
    if (n < kApplyMinor) assert_near((localizer.T_map_rover().t - kStart).norm(), 0.0, 0.0);
  }
  assert_true(most > 0);
  assert_status(localizer.last_fix().status, FixStatus::kApplied);
  assert_int_equal(localizer.last_fix().frame, kBeginMinor + 1);
  assert_int_equal(executive.counts().overruns[kFix], 0);
  assert_true(localizer.last_fix().correction.x_m != 0.0);
}

void test_restart_keeps_the_counts(void**) {
  start(localizer, slow_vo());
  minor_frame(left(0), right(0));
  minor_frame(left(1), right(1));
  minor_frame(left(0), right(0));
  minor_frame(left(0), right(0));
  const std::uint32_t overruns = executive.counts().overruns[kVo];
  assert_int_equal(executive.counts().dropped_pairs, 1);
  assert_status(localizer.set_start({Quat::Identity(), kStart}, 0.05, 0.01), LocalizerStatus::kReady);
  executive.restart();
  assert_false(localizer.vo_open());
  assert_int_equal(executive.counts().overruns[kVo], overruns);
  assert_int_equal(executive.counts().dropped_pairs, 1);
  minor_frame(left(0), right(0));
  assert_int_equal(executive.minor(), 0);
  assert_status(localizer.pose_source(), PoseSource::kStart);
  executive.init();
  assert_int_equal(executive.counts().overruns[kVo], 0);
  assert_int_equal(executive.counts().dropped_pairs, 0);
}

void test_a_frame_within_a_frame_is_our_own_error(void**) {
  start(localizer, LocalizerParams());
  assert_true(test::asserts([] {
    for (int i = 0; i < 2; ++i)
      static_cast<void>(executive.begin_minor(localizer, ImageU8(), ImageU8(), nullptr));
  }));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_what_a_sound_table_is),
      cmocka_unit_test(test_walk_of_the_table),
      cmocka_unit_test(test_no_start_no_minor_frame),
      cmocka_unit_test(test_vo_comes_first),
      cmocka_unit_test(test_slices_weigh_operations),
      cmocka_unit_test(test_slices_change_nothing),
      cmocka_unit_test(test_vo_overrun_drops_the_next_pair),
      cmocka_unit_test(test_boulder_overrun_is_abandoned),
      cmocka_unit_test(test_late_fix_is_counted),
      cmocka_unit_test(test_a_long_search_is_closed_once_it_is_done),
      cmocka_unit_test(test_fix_in_time_is_not),
      cmocka_unit_test(test_restart_keeps_the_counts),
      cmocka_unit_test(test_a_frame_within_a_frame_is_our_own_error),
  };
  return cmocka_run_group_tests(tests, make_scene, nullptr);
}
