// What one stereo pair gives, over a textured plane whose pictures and geometry the test makes itself: points
// and plane against the truth, the rectification learnt, each status, slices.
#include "localizer/stereo_frame.hpp"

#include <cstring>

#include "support/cmocka.hpp"
#include "support/plane_scene.hpp"
#include "support/slices.hpp"

using namespace cairn;

namespace {

constexpr int kWidth = test::kSmallWidth;
constexpr int kHeight = test::kSmallHeight;
constexpr std::size_t kPixels = static_cast<std::size_t>(kWidth) * kHeight;
constexpr int kMinPoints = 12;

const StereoRig kRig = test::small_rig();
test::PlaneScene scene;
std::uint8_t left_pixels[kPixels];
std::uint8_t right_pixels[kPixels];
std::uint8_t scratch[2][kPixels];
StereoFrame frame;
StereoFrame other_frame;
StereoFrameJob job;
StereoFrameJob other_job;

ImageU8 view(const std::uint8_t* pixels) { return packed_view(pixels, kWidth, kHeight); }

int render(void**) {
  scene.make(5);
  Random random(1);
  scene.render(kRig, kRig.T_rover_cam, false, 1.5, random, left_pixels);
  scene.render(kRig, kRig.T_rover_cam, true, 1.5, random, right_pixels);
  return 0;
}

void begin(const StereoFrameParams& params = {}, int min_points = kMinPoints) {
  job.init(params, kRig, min_points);
  assert_status(job.status(), StereoStatus::kIdle);
}

StereoStatus run(const ImageU8& left, const ImageU8& right) {
  const StereoStatus started = job.start(left, right, frame);
  if (started == StereoStatus::kRunning) assert_true(test::run_whole(job));
  return job.status();
}

StereoStatus run() { return run(view(left_pixels), view(right_pixels)); }

/// Hardware in view gives no points.
void test_own_hardware(void**) {
  begin();
  assert_status(run(), StereoStatus::kPoints);
  const int all = job.points();
  StereoFrameParams params;
  params.own.cover({0, 0, kWidth, kHeight * 5 / 6});
  begin(params);
  assert_status(run(), StereoStatus::kPoints);  // a sixth of the features, nearly all of which are good
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    if (frame.points[i].valid) assert_at_least(frame.feature(i).iv, kHeight * 5 / 6);
  }
  assert_at_least(job.points(), all / 10);
  assert_at_most(job.points(), all / 3);
  params.own.cover({0, 0, kWidth, kHeight});
  begin(params);
  assert_status(run(), StereoStatus::kFewPoints);
}

/// Disparity of level ground at a pixel of the left image.
double true_disparity(double u, double v) {
  const Vec3 n = kRig.T_rover_cam.q.conjugate() * Vec3(0.0, 0.0, -1.0);
  const double c = kRig.baseline_m / kRig.T_rover_cam.t.z();
  return c * (n.x() * (u - kRig.cx_px) + n.y() * (v - kRig.cy_px) + n.z() * kRig.fx_px);
}

/// Root mean square error of the disparities of valid points that lie on the plane. Of the others there are
/// few: matches gone wrong that have texture and row in common.
double disparity_error_px(double least_share = 0.985) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    if (!frame.points[i].valid || !frame.on_plane(i)) continue;
    const double e = frame.points[i].d_px - true_disparity(frame.feature(i).iu, frame.points[i].v_px);
    sum += e * e;
    ++count;
  }
  assert_at_least(static_cast<double>(count), least_share * static_cast<double>(frame.valid_points));
  return std::sqrt(sum / static_cast<double>(count));
}

// ---- points and plane -------------------------------------------------------------------------------------

void test_points_lie_on_the_ground(void**) {
  begin();
  assert_status(run(), StereoStatus::kPoints);
  assert_int_equal(frame.points.size(), job.features_left());
  int valid = 0;
  double height2 = 0.0;
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    if (!frame.points[i].valid) continue;
    ++valid;
    if (!frame.on_plane(i)) continue;
    const Vec3 p = kRig.T_rover_cam * frame.point_m(kRig, i);
    height2 += p.z() * p.z();
  }
  assert_int_equal(valid, frame.valid_points);
  assert_int_equal(valid, job.points());
  assert_at_least(valid, 100);
  print_message("%d points of %d features: %.3f px, %.4f m off the ground\n", valid, job.features_left(),
                disparity_error_px(), std::sqrt(height2 / valid));
  assert_at_most(disparity_error_px(), 0.1);
  assert_at_most(std::sqrt(height2 / valid), 0.01);
  for (const auto& at : {Vec2(40.0, 200.0), Vec2(160.0, 120.0), Vec2(280.0, 60.0)}) {
    const Vec3 uv1(at.x(), at.y(), 1.0);
    assert_near(frame.plane.dot(uv1), true_disparity(at.x(), at.y()), 0.3);
  }
}

/// Rows that are off by a part of a pixel are read for what they are: a share too much would stay in each
/// reference, with the same sign.
void test_rows_are_read_without_bias(void**) {
  static std::uint8_t aside[kPixels];
  for (const double off : {-0.25, -0.15, 0.15, 0.25}) {
    StereoRig rig = kRig;
    rig.cy_px += off;
    Random random(2);
    scene.render(rig, kRig.T_rover_cam, true, 1.5, random, aside);
    begin();
    assert_status(run(view(left_pixels), view(aside)), StereoStatus::kPoints);
    double sum = 0.0;
    int count = 0;
    for (std::size_t i = 0; i < frame.points.size(); ++i) {
      if (!frame.points[i].valid || !frame.on_plane(i)) continue;
      sum += static_cast<double>(frame.points[i].found_v_px) - frame.feature(i).iv;
      ++count;
    }
    print_message("%+.2f px: %+.4f of %d points\n", off, sum / count, count);
    assert_near(sum / count, off, 0.03 * std::fabs(off));
  }
}

/// Halved, points and plane are told in the larger pixels, and are those of the same ground. Hardware is
/// where it is.
void test_halved(void**) {
  StereoFrameParams params;
  params.own.cover({0, 0, kWidth / 2, kHeight});
  begin(params);
  job.look(true);
  assert_true(job.halved());
  assert_int_equal(job.rig().width_px, kWidth / 2);
  assert_status(run(), StereoStatus::kPoints);
  double height2 = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    if (!frame.points[i].valid) continue;
    assert_at_least(frame.feature(i).iu, kWidth / 4 - 1);
    if (!frame.on_plane(i)) continue;
    const double height = (kRig.T_rover_cam * frame.point_m(job.rig(), i)).z();
    height2 += height * height;
    ++count;
  }
  assert_at_least(count, 30);
  assert_at_most(std::sqrt(height2 / count), 0.02);
  const Vec3 uv1(120.0, 60.0, 1.0);
  assert_near(frame.plane.dot(uv1), 0.5 * true_disparity(from_halved(120.0), from_halved(60.0)), 0.2);
  job.look(false);
  assert_int_equal(job.rig().width_px, kWidth);
  assert_status(run(), StereoStatus::kPoints);
  assert_at_most(disparity_error_px(), 0.1);
}

/// A point well off the plane is no longer said to be on it: half a pixel and 3 % of its disparity.
void test_on_plane_at_its_corner(void**) {
  begin();
  assert_status(run(), StereoStatus::kPoints);
  const Feature& f = frame.feature(0);
  const double d = frame.plane.dot(Vec3(f.iu, f.iv, 1.0));
  const double high = (d + 0.5) / 0.97;  // off = 0.5 + 0.03 d_px
  const double low = (d - 0.5) / 1.03;
  for (const double inside : {high - 1e-6, low + 1e-6}) {
    frame.points[0].d_px = inside;
    assert_true(frame.on_plane(0));
  }
  for (const double outside : {high + 1e-6, low - 1e-6}) {
    frame.points[0].d_px = outside;
    assert_false(frame.on_plane(0));
  }
}

void test_as_detected_is_less_accurate(void**) {
  begin();
  assert_status(run(), StereoStatus::kPoints);
  const double fine = disparity_error_px();
  StereoFrameParams paper;
  paper.paper_exact = true;
  begin(paper);
  assert_status(run(), StereoStatus::kPoints);
  for (const StereoPoint& p : frame.points) {
    if (p.valid) assert_near(p.d_px, p.keypoint.disparity_px(), 0.0);
  }
  assert_at_least(disparity_error_px(), 2.0 * fine);
}

/// One estimate holds for all of a frame; what the pair told counts from end_frame() on.
void test_rectification_is_learnt_at_the_end(void**) {
  begin();
  assert_status(run(), StereoStatus::kPoints);
  assert_near(job.rectification().angles().norm(), 0.0, 0.0);
  job.end_frame();
  assert_true(job.rectification().angles().norm() > 0.0);
  begin();
  assert_near(job.rectification().angles().norm(), 0.0, 0.0);
}

/// The right image is lower by whole rows: found in the first pair, and nothing is lost by it.
void test_rows_are_found(void**) {
  begin();
  assert_status(run(), StereoStatus::kPoints);
  const int points = job.points();
  const double error_px = disparity_error_px();
  for (const int rows : {-6, -3, -1, 1, 2, 3, 6}) {
    for (int v = 0; v < kHeight; ++v) {
      const int from = v - rows < 0 ? 0 : (v - rows < kHeight ? v - rows : kHeight - 1);
      std::memcpy(scratch[0] + v * kWidth, right_pixels + from * kWidth, kWidth);
    }
    begin();
    for (int pair = 0; pair < 2; ++pair) {
      assert_status(run(view(left_pixels), view(scratch[0])), StereoStatus::kPoints);
      job.end_frame();
      assert_near(job.rectification().offset().rows_px, rows, 0.1);
      assert_at_least(job.points(), points * 8 / 10);  // rows left the image
      assert_at_most(disparity_error_px(), 1.1 * error_px);
    }
  }
}

/// What never shows is looked for in eight pairs and no more.
void test_rows_are_not_looked_for_for_good(void**) {
  begin();
  std::uint64_t first = 0;
  for (int pair = 0; pair < 10; ++pair) {
    assert_status(job.start(view(left_pixels), view(left_pixels), frame), StereoStatus::kRunning);
    WorkBudget budget = WorkBudget::unlimited();
    assert_true(job.step(budget) == Progress::kDone);
    assert_status(job.status(), StereoStatus::kFewPoints);  // no disparities
    job.end_frame();
    if (pair == 0) first = budget.spent();
    assert_true((budget.spent() < first) == (pair >= 8));
    assert_near(job.rectification().offset().rows_px, 0.0, 1.0);  // of chance matches
  }
}

/// An estimate that changes once the frame is whole moves its points with it.
void test_points_move_with_the_estimate(void**) {
  begin();
  assert_status(run(), StereoStatus::kPoints);
  const Vec3 plane = frame.plane;
  const std::size_t valid = frame.valid_points;
  std::size_t one = 0;
  while (!frame.points[one].valid) ++one;
  const StereoPoint point = frame.points[one];
  RectificationEstimator other;
  RectificationParams params;
  other.init(params, kRig);
  frame.correct(other, {});
  assert_true(frame.points[one].d_px == point.d_px && frame.points[one].v_px == point.v_px);
  params.columns_px = 0.25;
  other.init(params, kRig);
  frame.correct(other, {});
  assert_near(frame.points[one].d_px, point.d_px + 0.25, 1e-12);
  assert_near(frame.points[one].u_px, point.u_px, 0.0);
  assert_near(frame.plane[2], plane[2] + 0.25, 1e-12);
  assert_true(frame.valid_points == valid);
  params.columns_px = -1000.0;
  other.init(params, kRig);
  frame.correct(other, {});
  assert_true(frame.valid_points == 0 && !frame.points[one].valid);
}

// ---- statuses ---------------------------------------------------------------------------------------------

void test_bad_images(void**) {
  const ImageU8 good = view(left_pixels);
  const ImageU8 bad[] = {{},
                         {nullptr, kWidth, kHeight, kWidth},
                         {left_pixels, kWidth - 1, kHeight, kWidth},
                         {left_pixels, kWidth, kHeight - 1, kWidth},
                         {left_pixels, kWidth, kHeight, kWidth - 1}};
  begin();
  for (const ImageU8& image : bad) {
    assert_status(run(image, good), StereoStatus::kBadImage);
    assert_status(run(good, image), StereoStatus::kBadImage);
    assert_int_equal(job.points(), 0);
  }
  assert_status(run(), StereoStatus::kPoints);
}

void test_images_without_features(void**) {
  begin();
  for (const int grey : {0, 255}) {  // black, saturated
    std::memset(scratch, grey, sizeof scratch);
    assert_status(run(view(scratch[0]), view(right_pixels)), StereoStatus::kFewFeatures);
    assert_int_equal(job.features_left(), 0);
    assert_at_least(job.features_right(), 100);
    assert_status(run(view(left_pixels), view(scratch[1])), StereoStatus::kFewFeatures);
    assert_at_least(job.features_left(), 100);
    assert_int_equal(job.features_right(), 0);
  }
}

void test_left_and_right_swapped(void**) {
  begin();
  assert_status(run(view(right_pixels), view(left_pixels)), StereoStatus::kFewPoints);
  assert_status(run(), StereoStatus::kPoints);
}

void test_fewest_points_at_their_corner(void**) {
  begin();
  assert_status(run(), StereoStatus::kPoints);
  const int points = job.points();
  begin({}, points);
  assert_status(run(), StereoStatus::kPoints);
  begin({}, points + 1);
  assert_status(run(), StereoStatus::kFewPoints);
  assert_int_equal(job.points(), points);
}

/// The right image as a rover sees it that is 0.06 m farther on: matches that are found lie off their rows.
void test_images_of_two_times(void**) {
  Random random(2);
  Pose3 ahead = kRig.T_rover_cam;
  for (const double step_m : {0.06, -0.06}) {
    ahead.t = kRig.T_rover_cam.t + Vec3(step_m, 0.0, 0.0);
    scene.render(kRig, ahead, true, 1.5, random, scratch[0]);
    begin();
    for (int k = 0; k < 6; ++k)
      assert_status(run(view(left_pixels), view(scratch[0])), StereoStatus::kFewPoints);
  }
}

/// Noise leaves few points, but on their rows.
void test_few_points_on_their_rows(void**) {
  Random random(3);
  for (const bool right : {false, true})
    scene.render(kRig, kRig.T_rover_cam, right, 30.0, random, scratch[right ? 1 : 0]);
  begin();
  assert_status(run(view(scratch[0]), view(scratch[1])), StereoStatus::kPoints);
  print_message("%d points of %d features\n", job.points(), job.features_left());
  assert_at_most(job.points(), job.features_left() / 6);
  assert_at_most(disparity_error_px(0.75), 0.6);
}

/// All disparities of this scene lie between 10 and 100 px.
void test_disparities_outside_the_range(void**) {
  StereoFrameParams params;
  params.min_disparity_px = 1;
  params.max_disparity_px = 8;
  begin(params);
  assert_status(run(), StereoStatus::kFewPoints);
}

// ---- slices -----------------------------------------------------------------------------------------------

bool same(const StereoFrame& a, const StereoFrame& b) {
  bool equal = a.points.size() == b.points.size() && a.valid_points == b.valid_points && a.plane == b.plane;
  for (std::size_t i = 0; equal && i < a.points.size(); ++i) {
    const StereoPoint& p = a.points[i];
    const StereoPoint& q = b.points[i];
    equal = p.valid == q.valid && p.d_px == q.d_px && p.v_px == q.v_px &&
            p.keypoint.u_left == q.keypoint.u_left && p.keypoint.u_right == q.keypoint.u_right;
  }
  return equal;
}

void test_slices_give_the_same_bits(void**) {
  begin();
  other_job.init({}, kRig, kMinPoints);
  for (int round = 0; round < 2; ++round) {  // the second one with the rectification of the first
    assert_status(run(), StereoStatus::kPoints);
    assert_status(other_job.start(view(left_pixels), view(right_pixels), other_frame),
                  StereoStatus::kRunning);
    assert_true(test::run_in_slices(other_job) > 100);
    assert_status(other_job.status(), job.status());
    assert_true(same(frame, other_frame));
    assert_int_equal(other_job.features_right(), job.features_right());
    job.end_frame();
    other_job.end_frame();
    assert_true(job.rectification().angles() == other_job.rectification().angles());
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_points_lie_on_the_ground),
      cmocka_unit_test(test_rows_are_read_without_bias),
      cmocka_unit_test(test_halved),
      cmocka_unit_test(test_own_hardware),
      cmocka_unit_test(test_on_plane_at_its_corner),
      cmocka_unit_test(test_as_detected_is_less_accurate),
      cmocka_unit_test(test_rectification_is_learnt_at_the_end),
      cmocka_unit_test(test_rows_are_found),
      cmocka_unit_test(test_rows_are_not_looked_for_for_good),
      cmocka_unit_test(test_points_move_with_the_estimate),
      cmocka_unit_test(test_bad_images),
      cmocka_unit_test(test_images_without_features),
      cmocka_unit_test(test_left_and_right_swapped),
      cmocka_unit_test(test_fewest_points_at_their_corner),
      cmocka_unit_test(test_images_of_two_times),
      cmocka_unit_test(test_few_points_on_their_rows),
      cmocka_unit_test(test_disparities_outside_the_range),
      cmocka_unit_test(test_slices_give_the_same_bits),
  };
  return cmocka_run_group_tests_name("stereo_frame", tests, render, nullptr);
}
