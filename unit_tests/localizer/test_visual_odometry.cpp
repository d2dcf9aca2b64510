// Visual odometry over a textured plane whose pictures and exact motion the test makes itself: accuracy, each
// status and what comes after it, priors, the paper's variant, slices.
#include "localizer/visual_odometry.hpp"

#include <algorithm>
#include <cstring>

#include "core/factors.hpp"
#include "support/cmocka.hpp"
#include "support/noise.hpp"
#include "support/plane_scene.hpp"
#include "support/slices.hpp"

using namespace cairn;

namespace {

constexpr int kWidth = test::kSmallWidth;
constexpr int kHeight = test::kSmallHeight;
constexpr std::size_t kPixels = static_cast<std::size_t>(kWidth) * kHeight;
constexpr int kFrames = 8;

const StereoRig kRig = test::small_rig();
test::PlaneScene scene;
test::PlaneScene other_scene;
std::uint8_t left_pixels[kFrames][kPixels];
std::uint8_t right_pixels[kFrames][kPixels];
std::uint8_t elsewhere[2][kPixels];
std::uint8_t scratch[2][kPixels];
Pose3 T_world_cam[kFrames];
VisualOdometry vo;
VisualOdometry sliced;

ImageU8 view(const std::uint8_t* pixels) { return packed_view(pixels, kWidth, kHeight); }

/// A drive of 0.06 m a frame that turns, pitches and rolls.
Pose3 rover_pose(int k) {
  return {quat_from_attitude({0.03 * k, 0.01 * std::sin(1.3 * k), 0.012 * std::sin(0.9 * k)}),
          Vec3(0.06 * k, 0.001 * k * k, 0.003 * std::sin(0.8 * k))};
}

int render_all(void**) {
  scene.make(5);
  other_scene.make(77);
  Random random(1);
  for (int k = 0; k < kFrames; ++k) {
    T_world_cam[k] = rover_pose(k) * kRig.T_rover_cam;
    scene.render(kRig, T_world_cam[k], false, 1.5, random, left_pixels[k]);
    scene.render(kRig, T_world_cam[k], true, 1.5, random, right_pixels[k]);
  }
  other_scene.render(kRig, T_world_cam[1], false, 1.5, random, elsewhere[0]);
  other_scene.render(kRig, T_world_cam[1], true, 1.5, random, elsewhere[1]);
  return 0;
}

VoStatus run(VisualOdometry& v, const ImageU8& left, const ImageU8& right, const Pose3* prior = nullptr) {
  const VoStatus started = v.start(left, right, prior);
  if (started == VoStatus::kRunning) assert_true(test::run_whole(v));
  return v.status();
}

VoStatus run(int k, const Pose3* prior = nullptr) {
  return run(vo, view(left_pixels[k]), view(right_pixels[k]), prior);
}

Pose3 true_step(int from, int to) { return T_world_cam[from].inverse() * T_world_cam[to]; }

struct StepError {
  double rotation_rad, translation_m;
};

StepError error_of(const Pose3& step, int from, int to) {
  const Pose3 off = step.inverse() * true_step(from, to);
  return {quat_log(off.q).norm(), off.t.norm()};
}

void assert_good_step(int from, int to) {
  const StepError e = error_of(vo.result().T_prev_cur, from, to);
  assert_at_most(e.rotation_rad, 0.0015);
  assert_at_most(e.translation_m, 0.0015);
}

void begin(const VoParams& params = {}) {
  assert_true(vo.init(params, kRig));
  assert_status(run(0), VoStatus::kFirstFrame);
}

/// Root mean square errors over the drive.
StepError drive(const VoParams& params) {
  begin(params);
  StepError sum = {};
  for (int k = 1; k < kFrames; ++k) {
    assert_status(run(k), VoStatus::kMotion);
    const StepError e = error_of(vo.result().T_prev_cur, k - 1, k);
    sum.rotation_rad += e.rotation_rad * e.rotation_rad / (kFrames - 1);
    sum.translation_m += e.translation_m * e.translation_m / (kFrames - 1);
  }
  return {std::sqrt(sum.rotation_rad), std::sqrt(sum.translation_m)};
}

void test_first_frame(void**) {
  assert_true(vo.init({}, kRig));
  assert_status(vo.status(), VoStatus::kIdle);
  assert_status(run(0), VoStatus::kFirstFrame);
  const VoResult& r = vo.result();
  assert_near(r.T_prev_cur.t.norm() + quat_log(r.T_prev_cur.q).norm(), 0.0, 0.0);
  assert_true(r.reference_renewed);
  assert_true(r.features_left > 200 && r.features_right > 200 && r.stereo > 100);
}

void test_motion_is_recovered(void**) {
  const StepError e = drive({});
  const VoResult& r = vo.result();
  print_message(
      "rms of a step: %.5f rad, %.5f m; last: %d features, %d stereo, %d matches, %d inliers, %.3f px\n",
      e.rotation_rad, e.translation_m, r.features_left, r.stereo, r.matches, r.inliers, r.rms_px);
  assert_at_most(e.rotation_rad, 6e-5);
  assert_at_most(e.translation_m, 6e-5);
  assert_true(r.inliers <= r.stereo && r.inliers > 80);
  assert_at_most(r.rms_px, 0.06);
}

void test_ground_plane(void**) {
  // Disparity of level ground: d = b (n . ray f) / h, with n the ground's normal in the camera.
  begin();
  const Vec3 n = T_world_cam[0].q.conjugate() * Vec3(0.0, 0.0, -1.0);
  const double h = T_world_cam[0].t.z();
  const double c = kRig.baseline_m / h;
  const Vec3& plane = vo.disparity_plane();
  for (const auto& at : {Vec2(40.0, 200.0), Vec2(160.0, 120.0), Vec2(280.0, 60.0)}) {
    const double expected =
        c * (n.x() * (at.x() - kRig.cx_px) + n.y() * (at.y() - kRig.cy_px) + n.z() * kRig.fx_px);
    assert_near(plane[0] * at.x() + plane[1] * at.y() + plane[2], expected, 0.3);
  }
}

void test_covariance_is_of_the_right_size(void**) {
  // Of the step, as a perturbation in the current camera: T_true = T (exp(w), t).
  begin();
  double sum = 0.0;
  for (int k = 1; k < kFrames; ++k) {
    assert_status(run(k), VoStatus::kMotion);
    const Mat6& C = vo.result().covariance;
    const Pose3 off = vo.result().T_prev_cur.inverse() * true_step(k - 1, k);
    Vec6 e;
    e.head<3>() = quat_log(off.q);
    e.tail<3>() = off.t;
    sum += e.dot(Factors(C).solve(e));
    for (int i = 0; i < 6; ++i) assert_true(C(i, i) > 1e-12 && C(i, i) < 1e-5);
  }
  print_message("mean NEES of %d steps: %.1f (6 is exact)\n", kFrames - 1, sum / (kFrames - 1));
  assert_at_most(sum / (kFrames - 1), 30.0);
}

void test_reference_of_several_frames(void**) {
  VoParams params;
  params.max_reference_age = 3;
  begin(params);
  int renewed = 0;
  Pose3 sum;
  for (int k = 1; k < kFrames; ++k) {
    assert_status(run(k), VoStatus::kMotion);
    assert_good_step(k - 1, k);
    renewed += vo.result().reference_renewed ? 1 : 0;
    sum = sum * vo.result().T_prev_cur;
  }
  assert_in_range(renewed, 2, 4);
  const StepError e = error_of(sum, 0, kFrames - 1);
  assert_at_most(e.rotation_rad, 0.003);
  assert_at_most(e.translation_m, 0.003);
}

void test_standing_still(void**) {
  begin();
  Random random(9);
  scene.render(kRig, T_world_cam[0], false, 1.5, random, scratch[0]);
  scene.render(kRig, T_world_cam[0], true, 1.5, random, scratch[1]);
  assert_status(run(vo, view(scratch[0]), view(scratch[1])), VoStatus::kMotion);
  assert_at_most(vo.result().T_prev_cur.t.norm(), 0.001);
  assert_at_most(quat_log(vo.result().T_prev_cur.q).norm(), 0.001);
}

/// Each pair has noise of its own. The reference stays: errors do not add up, and it serves the drive on.
void test_standing_for_long_does_not_drift(void**) {
  begin();
  Random random(10);
  Pose3 T_first_cur;
  double one2 = 0.0;  // error after a step from the first, on the average
  constexpr int kStanding = 24;
  for (int k = 1; k <= kStanding; ++k) {
    scene.render(kRig, T_world_cam[0], false, 1.5, random, scratch[0]);
    scene.render(kRig, T_world_cam[0], true, 1.5, random, scratch[1]);
    assert_status(run(vo, view(scratch[0]), view(scratch[1])), VoStatus::kMotion);
    assert_false(vo.result().reference_renewed);
    T_first_cur = T_first_cur * vo.result().T_prev_cur;
    one2 += T_first_cur.t.squaredNorm() / kStanding;
  }
  print_message("standing: %.6f m at the end, %.6f m rms\n", T_first_cur.t.norm(), std::sqrt(one2));
  assert_at_most(T_first_cur.t.norm(), 5e-5);
  assert_status(run(1), VoStatus::kMotion);
  assert_true(vo.result().reference_renewed);
  assert_good_step(0, 1);
}

/// Root mean square errors over the drive with pictures that `change(k, right, pixels, out)` made.
template <typename Change>
StepError drive_changed(const Change& change) {
  VoParams params;
  params.rectification.enabled = false;
  assert_true(vo.init(params, kRig));
  StepError sum = {};
  for (int k = 0; k < kFrames; ++k) {
    change(k, false, left_pixels[k], scratch[0]);
    change(k, true, right_pixels[k], scratch[1]);
    const VoStatus status = run(vo, view(scratch[0]), view(scratch[1]));
    if (k == 0) continue;
    assert_status(status, VoStatus::kMotion);
    const StepError e = error_of(vo.result().T_prev_cur, k - 1, k);
    sum.rotation_rad += e.rotation_rad * e.rotation_rad / (kFrames - 1);
    sum.translation_m += e.translation_m * e.translation_m / (kFrames - 1);
  }
  return {std::sqrt(sum.rotation_rad), std::sqrt(sum.translation_m)};
}

/// What stands before the lens, and moves not with the ground, is in a third of the patches: they look less
/// alike than the others, and count less.
void test_patches_that_change_count_less(void**) {
  const StepError e = drive_changed([](int, bool, const std::uint8_t* pixels, std::uint8_t* out) {
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const std::size_t i = static_cast<std::size_t>(v) * kWidth + static_cast<std::size_t>(u);
        const double dust = u < kWidth / 3 ? 0.15 * std::sin(0.7 * u) * std::sin(0.6 * v) : 0.0;
        out[i] = static_cast<std::uint8_t>(pixels[i] * (0.8 + dust));
      }
    }
  });
  print_message("soiled: rms of a step %.6f rad\n", e.rotation_rad);
  assert_at_most(e.rotation_rad, 1e-4);  // 1.2e-4 where all count alike
}

/// Small shadows that wander over the ground, all one way. Their contrast is more than the ground's. Errors
/// in m, in pictures of so much of the contrast.
double wander(double contrast) {
  constexpr int kSpots = 60;
  constexpr double kWander_m = 0.0005;  // a frame
  const StepError e =
      drive_changed([contrast](int k, bool right, const std::uint8_t* pixels, std::uint8_t* out) {
        std::memcpy(out, pixels, kPixels);
        Random random(9);
        for (int n = 0; n < kSpots; ++n) {
          const double x = test::uniform(random, 0.8, 3.0);
          const double y = test::uniform(random, -1.0, 1.0);
          const StereoPixel at = project(kRig, T_world_cam[k].inverse() * Vec3(x, y + kWander_m * k, 0.0));
          const double u0 = right ? at.u_right : at.u_left;
          const double v0 = at.v_left;
          for (int v = static_cast<int>(v0) - 6; v <= static_cast<int>(v0) + 6; ++v) {
            for (int u = static_cast<int>(u0) - 6; u <= static_cast<int>(u0) + 6; ++u) {
              if (u < 0 || v < 0 || u >= kWidth || v >= kHeight) continue;
              const std::size_t i = static_cast<std::size_t>(v) * kWidth + static_cast<std::size_t>(u);
              const double r2 = (u - u0) * (u - u0) + (v - v0) * (v - v0);
              out[i] = static_cast<std::uint8_t>(out[i] * (1.0 - 0.8 * std::exp(-0.15 * r2)));
            }
          }
        }
        for (std::size_t i = 0; i < kPixels; ++i) {
          out[i] = static_cast<std::uint8_t>(128.0 + contrast * (out[i] - 128.0) + 0.5);
        }
      });
  print_message("spots that wander, contrast %.2f: rms of a step %.6f m\n", contrast, e.translation_m);
  return e.translation_m;
}

void test_contrast_counts_less(void**) {
  assert_at_most(wander(1.0), 7e-5);  // 8.7e-5 where all count alike
}

/// What is much contrast depends on scene and light: a picture that is flatter all over says the same.
void test_contrast_counts_by_that_of_the_others(void**) {
  assert_at_most(wander(0.15), 9.8e-5);  // 10.6e-5 where a grey level is one whatever the contrast
}

void test_paper_exact_is_less_accurate(void**) {
  VoParams paper;
  paper.paper_exact = true;
  const StepError rough = drive(paper);
  const StepError fine = drive({});
  print_message("rms of a step, paper's variant: %.5f rad, %.5f m\n", rough.rotation_rad,
                rough.translation_m);
  assert_at_most(rough.rotation_rad, 0.03);
  assert_at_most(rough.translation_m, 0.03);
  assert_true(rough.translation_m > 3.0 * fine.translation_m);
  assert_true(rough.rotation_rad > 3.0 * fine.rotation_rad);
}

/// After a frame without motion that leaves the reference: the next good frame is measured
/// from the last good one.
void assert_reference_stayed() {
  assert_status(run(2), VoStatus::kMotion);
  assert_good_step(0, 2);
}

void test_bad_images(void**) {
  const ImageU8 good = view(left_pixels[1]);
  const ImageU8 bad[] = {{},
                         {nullptr, kWidth, kHeight, kWidth},
                         {left_pixels[1], kWidth - 1, kHeight, kWidth},
                         {left_pixels[1], kWidth, kHeight - 1, kWidth},
                         {left_pixels[1], kWidth, kHeight, kWidth - 1}};
  for (const ImageU8& image : bad) {
    begin();
    assert_status(run(vo, image, good), VoStatus::kBadImage);
    assert_status(run(vo, good, image), VoStatus::kBadImage);
    assert_near(vo.result().T_prev_cur.t.norm(), 0.0, 0.0);
    assert_reference_stayed();
  }
}

void test_images_without_features(void**) {
  for (const int grey : {0, 255}) {  // black, saturated
    begin();
    std::memset(scratch, grey, sizeof scratch);
    assert_status(run(vo, view(scratch[0]), view(scratch[1])), VoStatus::kFewFeatures);
    assert_status(run(vo, view(left_pixels[1]), view(scratch[1])), VoStatus::kFewFeatures);
    assert_status(run(vo, view(scratch[0]), view(right_pixels[1])), VoStatus::kFewFeatures);
    assert_reference_stayed();
  }
}

void test_left_and_right_swapped(void**) {
  begin();
  assert_status(run(vo, view(right_pixels[1]), view(left_pixels[1])), VoStatus::kFewStereo);
  assert_reference_stayed();
}

void test_noise_only(void**) {
  begin();
  Random random(3);
  for (auto& image : scratch) {
    for (std::uint8_t& p : image) p = static_cast<std::uint8_t>(random.below(256));
  }
  assert_status(run(vo, view(scratch[0]), view(scratch[1])), VoStatus::kFewStereo);
  assert_reference_stayed();
}

void test_bad_first_frames(void**) {
  assert_true(vo.init({}, kRig));
  assert_status(run(vo, {}, {}), VoStatus::kBadImage);
  std::memset(scratch, 0, sizeof scratch);
  assert_status(run(vo, view(scratch[0]), view(scratch[1])), VoStatus::kFewFeatures);
  assert_status(run(vo, view(right_pixels[0]), view(left_pixels[0])), VoStatus::kFewStereo);
  assert_status(run(0), VoStatus::kFirstFrame);
  assert_status(run(1), VoStatus::kMotion);
  assert_good_step(0, 1);
}

/// After a frame without motion that becomes the reference.
void assert_reference_moved_on() {
  assert_true(vo.result().reference_renewed);
  assert_near(vo.result().T_prev_cur.t.norm(), 0.0, 0.0);
}

/// The frame of another place has nothing to do with the reference: it becomes the next one,
/// and so does the frame after.
void another_place(const VoParams& params, VoStatus status) {
  begin(params);
  assert_status(run(1), VoStatus::kMotion);
  assert_status(run(vo, view(elsewhere[0]), view(elsewhere[1])), status);
  assert_reference_moved_on();
  assert_status(run(2), status);
  assert_reference_moved_on();
  assert_status(run(3), VoStatus::kMotion);
  assert_good_step(2, 3);
}

VoParams lax() {
  VoParams params;
  params.match.ratio = 0.95F;
  return params;
}

void test_another_place(void**) {
  another_place(lax(), VoStatus::kNoConsensus);  // chance matches, which agree on nothing
  VoParams strict;
  strict.match.ratio = 0.6F;
  another_place(strict, VoStatus::kFewMatches);
}

/// The rover's step counts: the camera on its mast makes another where the rover pitches.
void test_implausible_motion(void**) {
  const double length = (rover_pose(0).inverse() * rover_pose(1)).t.norm();
  assert_true(std::fabs(true_step(0, 1).t.norm() / length - 1.0) > 0.06);
  const double turn = quat_log(true_step(0, 1).q).norm();
  for (const bool longer : {true, false}) {
    VoParams params;
    (longer ? params.max_step_m : params.max_step_rad) = 0.95 * (longer ? length : turn);
    begin(params);
    assert_status(run(1), VoStatus::kImplausible);
    assert_reference_moved_on();
    (longer ? params.max_step_m : params.max_step_rad) = 1.05 * (longer ? length : turn);
    begin(params);
    assert_status(run(1), VoStatus::kMotion);
  }
}

void test_dropped_frames(void**) {
  begin();
  assert_status(run(1), VoStatus::kMotion);
  assert_status(run(4), VoStatus::kMotion);  // two missing
  assert_good_step(1, 4);
  assert_status(run(5), VoStatus::kMotion);
  assert_good_step(4, 5);
}

/// Pairs that never came: what is allowed, and what is predicted, is that of all frames that went by; the
/// step of one frame is its share.
void test_missed_pairs(void**) {
  VoParams params;
  params.max_step_m = 0.1;
  begin(params);
  assert_status(run(3), VoStatus::kImplausible);
  begin(params);
  assert_status(run(1), VoStatus::kMotion);
  assert_int_equal(vo.result().frames, 1);
  const Pose3 step = vo.result().T_prev_cur;
  vo.miss(2);
  assert_status(run(4), VoStatus::kMotion);
  assert_int_equal(vo.result().frames, 3);
  assert_good_step(1, 4);
  assert_true((vo.predicted().t - (step * step * step).t).norm() < 1e-12);
  const Pose3 three = vo.result().T_prev_cur;
  assert_status(run(5), VoStatus::kMotion);
  assert_int_equal(vo.result().frames, 1);
  assert_good_step(4, 5);
  assert_near((vo.predicted().t - three.t / 3.0).norm(), 0.0, 1e-12);
  // A frame that cannot be used counts like one that never came, and priors are put together.
  begin(params);
  const Pose3 a = true_step(0, 1);
  const Pose3 b = true_step(1, 2);
  vo.miss(1, &a);
  assert_status(run(vo, ImageU8(), ImageU8(), &b), VoStatus::kBadImage);
  const Pose3 c = true_step(2, 3);
  assert_status(run(3, &c), VoStatus::kMotion);
  assert_good_step(0, 3);
  assert_near((vo.predicted().t - true_step(0, 3).t).norm(), 0.0, 1e-9);
  assert_status(run(4), VoStatus::kMotion);
  assert_int_equal(vo.result().frames, 1);
}

void test_priors(void**) {
  // A turn of 0.3 rad moves features out of all windows but those that the prior places.
  Random random(4);
  const Pose3 T_turned = Pose3{quat_from_attitude({0.3, 0.0, 0.0}), Vec3(0.05, 0.0, 0.0)} * kRig.T_rover_cam;
  scene.render(kRig, T_turned, false, 1.5, random, scratch[0]);
  scene.render(kRig, T_turned, true, 1.5, random, scratch[1]);
  VoParams narrow;
  narrow.search_radius_px = narrow.first_search_radius_px = 20;
  begin(narrow);
  assert_true(run(vo, view(scratch[0]), view(scratch[1])) != VoStatus::kMotion);
  begin(narrow);
  const Pose3 prior = T_world_cam[0].inverse() * T_turned;
  assert_status(run(vo, view(scratch[0]), view(scratch[1]), &prior), VoStatus::kMotion);
  const Pose3 off = vo.result().T_prev_cur.inverse() * prior;
  assert_at_most(off.t.norm(), 0.003);
  assert_at_most(quat_log(off.q).norm(), 0.003);

  // A prior that is wrong costs windows, not the frame.
  begin();
  const Pose3 wrong = {quat_exp(Vec3(0.0, 0.3, 0.0)), Vec3(0.2, 0.1, -0.2)};
  assert_status(run(1, &wrong), VoStatus::kMotion);
  assert_good_step(0, 1);
}

void test_rigs(void**) {
  StereoRig rig = kRig;
  rig.fx_px = NAN;
  assert_false(vo.init({}, rig));
  rig = kRig;
  rig.width_px = cfg::kImageWidth + 2;
  assert_false(vo.init({}, rig));
  rig = kRig;
  rig.height_px = cfg::kImageHeight + 2;
  assert_false(vo.init({}, rig));
  assert_true(vo.init({}, kRig));
}

void test_init_forgets(void**) {
  begin();
  assert_status(run(1), VoStatus::kMotion);
  assert_true(vo.init({}, kRig));
  assert_status(vo.status(), VoStatus::kIdle);
  assert_status(run(2), VoStatus::kFirstFrame);
}

std::uint64_t work_on(int k) {
  assert_status(vo.start(view(left_pixels[k]), view(right_pixels[k])), VoStatus::kRunning);
  WorkBudget budget = WorkBudget::unlimited();
  assert_int_equal(static_cast<int>(vo.step(budget)), static_cast<int>(Progress::kDone));
  return budget.spent();
}

/// Fewer points are aligned where all would take more than is planned, and the step is nearly as good.
void test_work_is_planned(void**) {
  VoParams params;
  params.plan_ops = UINT32_MAX;
  begin(params);
  const std::uint64_t all = work_on(1);
  const int inliers = vo.result().inliers;
  params.plan_ops = static_cast<std::uint32_t>(all) - 1'000'000U;
  begin(params);
  const std::uint64_t planned = work_on(1);
  print_message("%llu operations, planned %u: %llu; %d inliers, %d\n", static_cast<unsigned long long>(all),
                params.plan_ops, static_cast<unsigned long long>(planned), inliers, vo.result().inliers);
  assert_status(vo.status(), VoStatus::kMotion);
  assert_at_most(planned, static_cast<double>(params.plan_ops) * 1.01);
  assert_at_least(planned, static_cast<double>(params.plan_ops) * 0.9);
  assert_at_most(vo.result().inliers, 0.95 * inliers);
  assert_good_step(0, 1);
  // However little there is, enough for a motion are aligned.
  params.plan_ops = 1;
  begin(params);
  assert_at_most(work_on(1), planned);
  assert_status(vo.status(), VoStatus::kMotion);
  assert_good_step(0, 1);
}

// ---- noise ------------------------------------------------------------------------------------------------

constexpr double kNoise = 32.0;  // of this ground, half of what its keypoints show
std::uint8_t noisy_left[kFrames][kPixels];
std::uint8_t noisy_right[kFrames][kPixels];

void render_noisy() {
  Random random(8);
  for (int k = 0; k < kFrames; ++k) {
    scene.render(kRig, T_world_cam[k], false, kNoise, random, noisy_left[k]);
    scene.render(kRig, T_world_cam[k], true, kNoise, random, noisy_right[k]);
  }
}

VoStatus run_noisy(int k) { return run(vo, view(noisy_left[k]), view(noisy_right[k])); }

void assert_noisy_step(int k) {
  const StepError e = error_of(vo.result().T_prev_cur, k - 1, k);
  assert_at_most(e.rotation_rad, 0.006);
  assert_at_most(e.translation_m, 0.006);
}

/// Noise halves the images, and steps are measured from the first one on.
void test_noise_is_looked_at_halved(void**) {
  render_noisy();
  assert_true(vo.init({}, kRig));
  assert_status(run_noisy(0), VoStatus::kFirstFrame);
  assert_true(vo.halved());
  for (int k = 1; k < kFrames; ++k) {
    assert_status(run_noisy(k), VoStatus::kMotion);
    assert_true(vo.halved());
    assert_noisy_step(k);
    assert_at_least(vo.result().covariance(3, 3), 1e-10);
  }
}

/// A change of the pixels' size costs no step, nor does the way back; plane and offsets are told in those
/// of the images.
void test_noise_comes_and_goes(void**) {
  render_noisy();
  begin();
  assert_status(run(1), VoStatus::kMotion);
  assert_false(vo.halved());
  const Vec3 uv1(160.0, 120.0, 1.0);
  const double d_px = vo.disparity_plane().dot(uv1);
  VoStatus status = run_noisy(2);  // may be too noisy to be measured from a reference of the smaller pixels
  assert_true(vo.halved());
  assert_true(status == VoStatus::kMotion || status == VoStatus::kFewMatches);
  assert_near(vo.disparity_plane().dot(uv1), d_px, 0.7);
  for (int k = 3; k < 6; ++k) {
    assert_status(run_noisy(k), VoStatus::kMotion);
    assert_noisy_step(k);
  }
  assert_status(run(6), VoStatus::kMotion);
  assert_noisy_step(6);
  assert_false(vo.halved());
  assert_near(vo.disparity_plane().dot(uv1), d_px, 0.7);
  assert_status(run(7), VoStatus::kMotion);
  assert_good_step(6, 7);
}

/// A pair that shows nothing at either size leaves size and reference as they were.
void test_noise_that_hides_all(void**) {
  begin();
  Random random(9);
  for (int side = 0; side < 2; ++side) {
    for (std::uint8_t& p : scratch[side]) {
      const double grey = 128.0 + 40.0 * test::normal(random);
      p = static_cast<std::uint8_t>(grey > 254.0 ? 254.0 : (grey < 1.0 ? 1.0 : grey));
    }
  }
  const VoStatus status = run(vo, view(scratch[0]), view(scratch[1]));
  assert_true(status == VoStatus::kFewStereo);
  assert_false(vo.halved());
  assert_status(run(1), VoStatus::kMotion);
  assert_good_step(0, 1);
}

void test_the_papers_way_knows_no_noise(void**) {
  render_noisy();
  VoParams paper;
  paper.paper_exact = true;
  assert_true(vo.init(paper, kRig));
  static_cast<void>(run_noisy(0));
  assert_false(vo.halved());
}

void test_noise_in_slices(void**) {
  render_noisy();
  begin();
  assert_true(sliced.init({}, kRig));
  for (int k = 0; k < 4; ++k) {
    const bool noisy = k == 1 || k == 2;
    const ImageU8 left = view(noisy ? noisy_left[k] : left_pixels[k]);
    const ImageU8 right = view(noisy ? noisy_right[k] : right_pixels[k]);
    if (k > 0) static_cast<void>(run(vo, left, right));
    assert_status(sliced.start(left, right), VoStatus::kRunning);
    assert_true(test::run_in_slices(sliced) > 100);
    assert_status(sliced.status(), vo.status());
    assert_true(sliced.halved() == vo.halved());
    assert_true(sliced.result().T_prev_cur.t == vo.result().T_prev_cur.t);
    assert_true(sliced.result().covariance == vo.result().covariance);
    assert_true(sliced.disparity_plane() == vo.disparity_plane());
  }
}

bool same(const VoResult& a, const VoResult& b) {
  return a.T_prev_cur.t == b.T_prev_cur.t && a.T_prev_cur.q.coeffs() == b.T_prev_cur.q.coeffs() &&
         a.covariance == b.covariance && a.features_left == b.features_left &&
         a.features_right == b.features_right && a.stereo == b.stereo && a.matches == b.matches &&
         a.inliers == b.inliers && a.rms_px == b.rms_px && a.reference_renewed == b.reference_renewed;
}

void test_slices_give_the_same_bits(void**) {
  begin(lax());
  assert_true(sliced.init(lax(), kRig));
  for (int k = 0; k < 4; ++k) {
    // The third frame is another place: the wide search is sliced too.
    const ImageU8 left = view(k == 2 ? elsewhere[0] : left_pixels[k]);
    const ImageU8 right = view(k == 2 ? elsewhere[1] : right_pixels[k]);
    if (k > 0) assert_status(run(vo, left, right), k == 1 ? VoStatus::kMotion : VoStatus::kNoConsensus);
    assert_status(sliced.start(left, right), VoStatus::kRunning);
    assert_true(test::run_in_slices(sliced) > 100);
    assert_status(sliced.status(), vo.status());
    assert_true(same(sliced.result(), vo.result()));
    assert_true(sliced.rectification().angles() == vo.rectification().angles());
    assert_true(sliced.disparity_plane() == vo.disparity_plane());
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_first_frame),
      cmocka_unit_test(test_motion_is_recovered),
      cmocka_unit_test(test_ground_plane),
      cmocka_unit_test(test_covariance_is_of_the_right_size),
      cmocka_unit_test(test_reference_of_several_frames),
      cmocka_unit_test(test_standing_still),
      cmocka_unit_test(test_standing_for_long_does_not_drift),
      cmocka_unit_test(test_patches_that_change_count_less),
      cmocka_unit_test(test_contrast_counts_less),
      cmocka_unit_test(test_contrast_counts_by_that_of_the_others),
      cmocka_unit_test(test_paper_exact_is_less_accurate),
      cmocka_unit_test(test_bad_images),
      cmocka_unit_test(test_images_without_features),
      cmocka_unit_test(test_left_and_right_swapped),
      cmocka_unit_test(test_noise_only),
      cmocka_unit_test(test_bad_first_frames),
      cmocka_unit_test(test_another_place),
      cmocka_unit_test(test_implausible_motion),
      cmocka_unit_test(test_dropped_frames),
      cmocka_unit_test(test_missed_pairs),
      cmocka_unit_test(test_priors),
      cmocka_unit_test(test_rigs),
      cmocka_unit_test(test_init_forgets),
      cmocka_unit_test(test_work_is_planned),
      cmocka_unit_test(test_noise_is_looked_at_halved),
      cmocka_unit_test(test_noise_comes_and_goes),
      cmocka_unit_test(test_noise_that_hides_all),
      cmocka_unit_test(test_the_papers_way_knows_no_noise),
      cmocka_unit_test(test_noise_in_slices),
      cmocka_unit_test(test_slices_give_the_same_bits),
  };
  return cmocka_run_group_tests_name("visual_odometry", tests, render_all, nullptr);
}
