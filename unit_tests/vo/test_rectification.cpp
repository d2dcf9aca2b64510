// A rig that is off by milliradians is found out from its vertical disparities,
// and its matches are put right.
#include "vo/rectification.hpp"

#include "support/cmocka.hpp"
#include "support/noise.hpp"
#include "support/rig.hpp"

using namespace cairn;

namespace {

const StereoRig kRig = test::rig_of_the_paper();
using Angles = RectificationEstimator::Angles;

/// All is left to the angles.
RectificationParams angles_alone() {
  RectificationParams params;
  params.least_rows_px = 100.0;
  return params;
}

/// A prior that leaves the angles to the evidence.
RectificationParams open_minded() {
  RectificationParams params = angles_alone();
  params.prior_sigma_rad = 1.0e-2;
  return params;
}

Angles angles_of(double r_x, double r_z, double b_y, double b_z) {
  Angles a;
  a << r_x, r_z, b_y, b_z;
  return a;
}

/// What a rig sees whose right camera is turned and shifted by the angles: exact, not to first order.
StereoPixel see(const Vec3& p_cam, const Angles& a) {
  const Quat turned = quat_exp(Vec3(a[0], 0.0, a[1]));
  const Vec3 centre = Vec3(1.0, a[2], a[3]) * kRig.baseline_m;
  StereoRig mono = kRig;
  mono.baseline_m = 1e-12;
  const StereoPixel right = project(mono, turned.conjugate() * (p_cam - centre));
  const StereoPixel left = project(kRig, p_cam);
  return {left.u_left, left.v_left, right.u_left, right.v_left};
}

/// Points of a slope before the camera, with rocks and walls before it: at many depths.
Vec3 random_point(Random& random) {
  const double v = test::uniform(random, -170.0, 180.0);
  const double z = 1.0 / (0.6 + 0.5 * v / 200.0) * test::uniform(random, 0.3, 1.0);
  return {test::uniform(random, -230.0, 230.0) / kRig.fx_px * z, v / kRig.fy_px * z, z};
}

void observe_frames(RectificationEstimator& estimator, const Angles& truth, int frames, double sigma_px,
                    Random& random) {
  for (int k = 0; k < frames; ++k) {
    for (int i = 0; i < 300; ++i) {
      StereoPixel px = see(random_point(random), truth);
      px.v_right += sigma_px * test::normal(random);
      px.u_right += sigma_px * test::normal(random);
      estimator.observe(px);
    }
    estimator.end_frame();
  }
}

void test_correct_undoes_the_error_to_first_order(void**) {
  // Exact data of a misaligned rig: what is left after the correction is of second order.
  const Angles truth = angles_of(0.5e-3, -0.8e-3, 0.6e-3, 1.0e-3);
  RectificationEstimator estimator;
  estimator.init(open_minded(), kRig);
  Random random(1);
  observe_frames(estimator, truth, 60, 0.0, random);
  for (int k = 0; k < 4; ++k) assert_near(estimator.angles()[k], truth[k], 0.02e-3);
  double before = 0.0;
  double after_u = 0.0;
  double after_v = 0.0;
  for (int i = 0; i < 500; ++i) {
    const Vec3 p = random_point(random);
    const StereoPixel ideal = project(kRig, p);
    const StereoPixel measured = see(p, truth);
    const StereoPixel px = estimator.correct(measured);
    before = std::fmax(before, std::fabs(measured.u_right - ideal.u_right));
    after_u = std::fmax(after_u, std::fabs(px.u_right - ideal.u_right));
    after_v = std::fmax(after_v, std::fabs(px.v_right - ideal.v_right));
    assert_near(px.u_left, measured.u_left, 0.0);
    assert_near(px.v_left, measured.v_left, 0.0);
  }
  print_message("largest error in u: %.3f px before, %.4f px after (v: %.4f px)\n", before, after_u, after_v);
  assert_at_least(before, 0.2);
  assert_at_most(after_u, 0.02);
  assert_at_most(after_v, 0.01);
}

void test_each_angle_alone(void**) {
  for (int k = 0; k < 4; ++k) {
    Angles truth = Angles::Zero();
    truth[k] = 1.0e-3;
    RectificationEstimator estimator;
    estimator.init(open_minded(), kRig);
    Random random(2);
    observe_frames(estimator, truth, 60, 0.0, random);
    for (int i = 0; i < 4; ++i) assert_near(estimator.angles()[i], truth[i], 0.03e-3);
  }
}

void test_noisy_matches(void**) {
  const Angles truth = angles_of(0.4e-3, 0.5e-3, -0.7e-3, -1.0e-3);
  RectificationEstimator estimator;
  estimator.init(angles_alone(), kRig);
  Random random(3);
  observe_frames(estimator, truth, 100, 0.1, random);
  const Angles error = estimator.angles() - truth;
  print_message("errors after 100 frames of 300 matches, 0.1 px: %.4f %.4f %.4f %.4f mrad\n", 1e3 * error[0],
                1e3 * error[1], 1e3 * error[2], 1e3 * error[3]);
  for (int k = 0; k < 4; ++k) assert_near(error[k], 0.0, 0.05e-3);
}

void test_one_estimate_a_frame(void**) {
  RectificationEstimator estimator;
  estimator.init({}, kRig);
  Random random(4);
  const Angles truth = angles_of(0.0, 1.0e-3, 0.0, 0.0);
  for (int i = 0; i < 200; ++i) estimator.observe(see(random_point(random), truth));
  assert_true(estimator.angles() == Angles::Zero());
  estimator.end_frame();
  assert_true(estimator.angles() != Angles::Zero());
  estimator.init({}, kRig);
  assert_true(estimator.angles() == Angles::Zero());
  estimator.end_frame();
  assert_true(estimator.angles() == Angles::Zero());
}

void test_little_evidence_stays_at_the_prior(void**) {
  RectificationEstimator estimator;
  estimator.init({}, kRig);
  Random random(5);
  estimator.observe(see(random_point(random), angles_of(0.0, 1.0e-3, 0.0, 0.0)));
  estimator.end_frame();
  for (int k = 0; k < 4; ++k) assert_near(estimator.angles()[k], 0.0, 1.0e-3);
}

/// What was learnt in one size of pixels corrects matches seen in the other, as before; back, it is the same
/// to the bit.
void test_rescaled(void**) {
  const Angles truth = angles_of(0.4e-3, -0.6e-3, 0.5e-3, 0.8e-3);
  RectificationParams params;
  params.columns_px = 0.4;
  RectificationEstimator estimator;
  estimator.init(params, kRig);
  estimator.set_rows(0.8);
  Random random(12);
  for (int k = 0; k < 20; ++k) {
    for (int i = 0; i < 300; ++i) {
      StereoPixel px = see(random_point(random), truth);
      px.v_right += 0.8;
      estimator.observe(px);
    }
    estimator.observe_motion({100.0, 30.0, 10.0, 0.01, 0.2});
    estimator.end_frame();
  }
  assert_true(estimator.offset().rows_px > 0.3);
  assert_true(estimator.offset().columns_px != 0.4);
  const RectificationEstimator before = estimator;
  const StereoRig half = halved(kRig);
  const auto in_half = [](double px) { return 0.5 * (px - 0.5); };
  const StereoPixel seen = see(Vec3(0.3, 0.2, 1.7), truth);
  const StereoPixel seen_half = {in_half(seen.u_left), in_half(seen.v_left), in_half(seen.u_right),
                                 in_half(seen.v_right)};
  for (int frame = 0; frame < 2; ++frame) {  // as it is, and as the evidence says at the end of a frame
    const StereoPixel expected = before.correct(seen);
    if (frame == 0) estimator.rescale(half, 0.5);
    const StereoPixel got = estimator.correct(seen_half);
    const double tolerance_px = frame == 0 ? 1e-9 : 0.03;  // what is faked is as large in any pixels
    assert_near(from_halved(got.u_right), expected.u_right, tolerance_px);
    assert_near(from_halved(got.v_right), expected.v_right, tolerance_px);
    if (frame == 0) {
      RectificationEstimator back = estimator;
      back.rescale(kRig, 2.0);
      assert_true(back.angles() == before.angles());
      back.end_frame();
      RectificationEstimator went_on = before;
      went_on.end_frame();
      assert_true(back.angles() == went_on.angles());
      assert_true(back.offset().rows_px == went_on.offset().rows_px);
      assert_true(back.offset().columns_px == went_on.offset().columns_px);
      assert_true(back.offset().lens == went_on.offset().lens);
    }
    estimator.end_frame();
  }
}

void test_gate(void**) {
  RectificationParams params;
  RectificationEstimator estimator;
  estimator.init(params, kRig);
  Random random(6);
  for (int i = 0; i < 300; ++i) {
    StereoPixel px = project(kRig, random_point(random));
    px.v_right += i % 2 == 0 ? 1.001 * params.gate_px : static_cast<double>(NAN);
    estimator.observe(px);
  }
  estimator.end_frame();
  assert_true(estimator.angles() == Angles::Zero());
  for (int i = 0; i < 300; ++i) {
    StereoPixel px = project(kRig, random_point(random));
    px.v_right += 0.999 * params.gate_px;
    estimator.observe(px);
  }
  estimator.end_frame();
  assert_near(estimator.offset().rows_px, params.gate_px, 0.06);  // the garrote's t^2/x, and some of r_x
  // The gate moves with the estimate: the same matches now lie at its middle, those at 0 near its rim.
  StereoPixel far_px = project(kRig, Vec3(0.0, 0.0, 1.5));
  const Angles before = estimator.angles();
  far_px.v_right -= 0.2;
  estimator.observe(far_px);
  estimator.end_frame();
  assert_near((estimator.angles() - before).norm(), 0.0, 1e-5);
}

/// What the ideal rig sees, the right image `rows` lower.
void observe_rows(RectificationEstimator& estimator, double rows, int frames, Random& random) {
  for (int k = 0; k < frames; ++k) {
    for (int i = 0; i < 300; ++i) {
      StereoPixel px = project(kRig, random_point(random));
      px.v_right += rows + 0.1 * test::normal(random);
      estimator.observe(px);
    }
    estimator.end_frame();
  }
}

/// An image that lies lower is taken for that, and for nothing else.
void test_rows(void**) {
  for (const double rows : {-6.0, -0.5, 0.5, 1.0, 6.0}) {
    RectificationEstimator estimator;
    estimator.init({}, kRig);
    estimator.set_rows(rows + 0.2);
    Random random(9);
    observe_rows(estimator, rows, 20, random);
    assert_near(estimator.offset().rows_px, rows, 0.06);  // of 6 px the angles take one in a hundred
    assert_near(estimator.offset().columns_px, 0.0, 0.0);
    for (int k = 0; k < 4; ++k) assert_near(estimator.angles()[k], 0.0, 0.2e-3);
    const StereoPixel ideal = project(kRig, Vec3(0.4, 0.3, 2.5));
    StereoPixel seen = ideal;
    seen.v_right += rows;
    assert_near(estimator.correct(seen).v_right, ideal.v_right, 0.02);
    assert_near(estimator.correct(seen).u_right, ideal.u_right, 0.02);
  }
}

/// Up to what a perfect rig's matches fake there are no rows, to the bit; beyond it there is no jump.
void test_few_rows_are_none(void**) {
  const RectificationParams params;
  for (const double rows : {-0.08, 0.0, 0.08}) {
    RectificationEstimator estimator;
    RectificationEstimator alone;
    estimator.init(params, kRig);
    alone.init(angles_alone(), kRig);
    Random random(10);
    Random same(10);
    observe_rows(estimator, rows, 20, random);
    observe_rows(alone, rows, 20, same);
    assert_near(estimator.offset().rows_px, 0.0, 0.0);
    assert_true(estimator.angles() == alone.angles());
  }
  RectificationEstimator estimator;
  estimator.init(params, kRig);
  Random random(11);
  observe_rows(estimator, 1.1 * params.least_rows_px, 20, random);
  assert_at_least(estimator.offset().rows_px, 1e-3);
  assert_at_most(estimator.offset().rows_px, 0.5 * params.least_rows_px);
}

/// What matches have in common beside the model, 0.02 px here, is little evidence for angles, however many
/// there are; of a level ground, where the angles are hard to tell apart.
void test_common_errors_are_little_evidence(void**) {
  RectificationEstimator estimator;
  estimator.init({}, kRig);
  estimator.set_rows(1.0);
  Random random(13);
  for (int k = 0; k < 100; ++k) {
    for (int i = 0; i < 300; ++i) {
      const double v = test::uniform(random, -180.0, 180.0);
      const double u = test::uniform(random, -200.0, 200.0);
      const double bend = 2.0 * v * v / (180.0 * 180.0) - 1.0;
      StereoPixel px = {kRig.cx_px + u, kRig.cy_px + v, kRig.cx_px + u - 22.0 - 0.1 * v, kRig.cy_px + v};
      px.v_right += 1.0 + 0.02 * bend;
      estimator.observe(px);
    }
    estimator.end_frame();
  }
  print_message("r_x %.3f mrad, rows %.3f px\n", 1e3 * estimator.angles()[0], estimator.offset().rows_px);
  assert_near(estimator.angles()[0], 0.0, 0.4e-3);  // 0.5 with all that they say
}

/// A pitch moves all rows, most of it alike: rows take some of it, no baseline is made up, matches are right.
void test_pitch_among_rows(void**) {
  Angles truth = Angles::Zero();
  truth[0] = 2.0e-3;
  RectificationEstimator estimator;
  estimator.init({}, kRig);
  estimator.set_rows(truth[0] * kRig.fx_px);
  Random random(12);
  observe_frames(estimator, truth, 60, 0.1, random);
  assert_near(estimator.angles()[2], 0.0, 0.3e-3);
  assert_near(estimator.angles()[3], 0.0, 0.3e-3);
  for (int i = 0; i < 500; ++i) {
    const Vec3 p = random_point(random);
    const StereoPixel px = estimator.correct(see(p, truth));
    assert_near(px.v_right, px.v_left, 0.06);
    assert_near(px.u_right, project(kRig, p).u_right, 0.2);
  }
}

/// What a rig of this lens sees, its cameras turned by the angles; motions tell of `told`, and of columns
/// that such a lens fakes where it is not taken off.
void observe_lens(RectificationEstimator& estimator, double lens, double told, const Angles& angles,
                  int frames, Random& random) {
  for (int k = 0; k < frames; ++k) {
    for (int i = 0; i < 300; ++i) {
      StereoPixel px = with_lens(kRig, lens, see(random_point(random), angles));
      px.v_right += 0.1 * test::normal(random);
      estimator.observe(px);
    }
    const double missing = told - estimator.offset().lens;
    RigEvidence motion;
    motion.columns_information = 100.0;
    motion.lens_information = 1.0e6;
    motion.shared = 5.0e3;
    motion.columns_evidence = motion.shared * missing - 100.0 * estimator.offset().columns_px;
    motion.lens_evidence = motion.lens_information * missing - motion.shared * estimator.offset().columns_px;
    estimator.observe_motion(motion);
    estimator.end_frame();
  }
}

/// A lens that rows and motions tell is taken off, beside angles, and makes no columns.
void test_lens(void**) {
  for (const Angles& angles : {angles_of(0.0, 0.0, 0.0, 0.0), angles_of(0.5e-3, -0.8e-3, 0.6e-3, 0.8e-3)}) {
    for (const double lens : {-0.05, -0.02, 0.02, 0.05}) {
      RectificationEstimator estimator;
      estimator.init({}, kRig);
      Random random(14);
      observe_lens(estimator, lens, lens, angles, 60, random);
      assert_near(estimator.offset().lens, lens, 0.0016);  // the garrote's t^2/x, 0.0005, and what rows doubt
      assert_near(estimator.offset().columns_px, 0.0, 0.05);
      for (int i = 0; i < 500; ++i) {
        const Vec3 p = random_point(random);
        const StereoPixel ideal = project(kRig, p);
        const StereoPixel px = estimator.correct(with_lens(kRig, lens, see(p, angles)));
        assert_near(px.u_left, ideal.u_left, 0.5);  // 10 px in the corners where the lens is 0.05
        assert_near(px.v_left, ideal.v_left, 0.4);
        assert_near(px.v_right, px.v_left, 0.12);
        assert_near(px.disparity_px(), ideal.disparity_px(), 0.3);
      }
    }
  }
}

/// Zero to the bit: what a perfect rig fakes, what rows or motions tell alone or against each other, more
/// than is believed of what nobody told.
void test_a_lens_of_one_witness_is_none(void**) {
  const RectificationParams params;
  const double little = 0.8 * params.least_lens;
  const double absurd = 3.2 * params.prior_lens;
  const double cases[][2] = {{little, little}, {0.02, 0.0}, {0.0, 0.02}, {-0.02, 0.02}, {absurd, absurd}};
  for (const auto& [rows, motions] : cases) {
    RectificationEstimator estimator;
    estimator.init(params, kRig);
    Random random(15);
    observe_lens(estimator, rows, motions, Angles::Zero(), 20, random);
    assert_near(estimator.offset().lens, 0.0, 0.0);
  }
}

/// Each frame asks for what is missing: it converges on the truth, from a mean that was told, too.
double columns_after(const RectificationParams& params, double truth_px) {
  RectificationEstimator estimator;
  estimator.init(params, kRig);
  for (int k = 0; k < 200; ++k) {
    RigEvidence motion;
    motion.columns_information = 50.0;
    motion.columns_evidence = 50.0 * (truth_px - estimator.offset().columns_px);
    estimator.observe_motion(motion);
    estimator.end_frame();
  }
  return estimator.offset().columns_px;
}

void test_columns(void**) {
  RectificationParams params;
  for (const double truth : {-1.0, -0.4, 0.4, 1.0}) assert_near(columns_after(params, truth), truth, 0.02);
  assert_near(columns_after(params, 0.04), 0.0, 0.0);  // what a perfect rig may fake
  assert_near(columns_after(params, 1.4), 1.4, 0.02);
  assert_near(columns_after(params, 1.6), 0.0, 0.0);  // no rig is off by more than three sigmas
  params.columns_px = 1.2;
  assert_near(columns_after(params, 1.2), 1.2, 0.0);
  assert_near(columns_after(params, 0.8), 0.8, 0.02);
  params.prior_columns_px = 0.0;  // known for good
  assert_near(columns_after(params, 0.8), 1.2, 0.0);
}

/// Little is told yet: what counts is more than its own uncertainty.
void test_uncertain_columns_are_none(void**) {
  RectificationEstimator estimator;
  estimator.init({}, kRig);
  RigEvidence motion;
  motion.columns_information = 12.0;
  motion.columns_evidence = 12.0 * 0.4;  // 0.3 px, sigma 0.25
  estimator.observe_motion(motion);
  estimator.end_frame();
  assert_near(estimator.offset().columns_px, 0.0, 0.0);
}

void test_old_evidence_fades(void**) {
  RectificationParams params = open_minded();
  params.memory_frames = 20.0;
  RectificationEstimator estimator;
  estimator.init(params, kRig);
  Random random(7);
  const Angles first = angles_of(0.0, 0.8e-3, 0.0, 0.8e-3);
  const Angles second = angles_of(0.0, -0.2e-3, 0.0, 0.0);
  observe_frames(estimator, first, 50, 0.0, random);
  for (int k = 0; k < 4; ++k) assert_near(estimator.angles()[k], first[k], 0.05e-3);
  observe_frames(estimator, second, 150, 0.0, random);
  for (int k = 0; k < 4; ++k) assert_near(estimator.angles()[k], second[k], 0.1e-3);
}

void test_disabled_is_identity(void**) {
  RectificationParams params;
  params.enabled = false;
  RectificationEstimator estimator;
  estimator.init(params, kRig);
  Random random(8);
  observe_frames(estimator, angles_of(1e-3, 1e-3, 1e-3, 1e-3), 5, 0.0, random);
  assert_true(estimator.angles() == Angles::Zero());
  estimator.set_rows(3.0);
  assert_near(estimator.offset().rows_px, 0.0, 0.0);
  assert_near(columns_after(params, 1.0), 0.0, 0.0);
  const StereoPixel px = {100.0, 50.0, 70.0, 50.4};
  const StereoPixel same = estimator.correct(px);
  assert_true(same.u_left == 100.0 && same.v_left == 50.0 && same.u_right == 70.0 && same.v_right == 50.4);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_correct_undoes_the_error_to_first_order),
      cmocka_unit_test(test_each_angle_alone),
      cmocka_unit_test(test_noisy_matches),
      cmocka_unit_test(test_one_estimate_a_frame),
      cmocka_unit_test(test_little_evidence_stays_at_the_prior),
      cmocka_unit_test(test_rescaled),
      cmocka_unit_test(test_gate),
      cmocka_unit_test(test_rows),
      cmocka_unit_test(test_few_rows_are_none),
      cmocka_unit_test(test_common_errors_are_little_evidence),
      cmocka_unit_test(test_pitch_among_rows),
      cmocka_unit_test(test_lens),
      cmocka_unit_test(test_a_lens_of_one_witness_is_none),
      cmocka_unit_test(test_columns),
      cmocka_unit_test(test_uncertain_columns_are_none),
      cmocka_unit_test(test_old_evidence_fades),
      cmocka_unit_test(test_disabled_is_identity),
  };
  return cmocka_run_group_tests_name("rectification", tests, nullptr, nullptr);
}
