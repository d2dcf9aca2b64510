// Motion from stereo points: exact recovery, noise against the predicted covariance, outliers, each status,
// slices, and real stereo tracks with measured poses.
#include "vo/motion.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <limits>

#include "core/factors.hpp"
#include "support/cmocka.hpp"
#include "support/data.hpp"
#include "support/noise.hpp"
#include "support/rig.hpp"
#include "support/slices.hpp"

using namespace cairn;

namespace {

const StereoRig kRig = test::rig_of_the_paper();
const Pose3 kTruth = {quat_exp(Vec3(0.01, -0.03, 0.02)), Vec3(0.02, -0.01, -0.06)};
MotionPairs pairs;
RansacMotionJob ransac;
RansacMotionJob ransac_sliced;
RefineMotionJob refine;
RefineMotionJob refine_sliced;

/// Points in view of both frames. The noise is that of the header: u and v as measured, disparities of either
/// frame with 1.5 times their variance.
void fill_pairs(std::size_t count, double sigma_px, Random& random, const Pose3& T_cur_ref = kTruth) {
  pairs.clear();
  while (pairs.size() < count) {
    const double z = test::uniform(random, 0.6, 4.0);
    StereoPixel px;
    px.u_left = test::uniform(random, 20.0, 490.0);
    px.v_left = px.v_right = test::uniform(random, 20.0, 360.0);
    px.u_right = px.u_left - kRig.fx_px * kRig.baseline_m / z;
    const Vec3 p_cur = T_cur_ref * triangulate(kRig, px);
    if (p_cur.z() < 0.3) continue;
    MotionPair pair;
    pair.seen = project(kRig, p_cur);
    pair.seen.u_left += sigma_px * test::normal(random);
    pair.seen.v_left += sigma_px * test::normal(random);
    pair.seen.v_right = pair.seen.v_left;
    pair.seen.u_right = pair.seen.u_left - project(kRig, p_cur).disparity_px() -
                        std::sqrt(1.5) * sigma_px * test::normal(random);
    px.u_right += std::sqrt(1.5) * sigma_px * test::normal(random);
    pair.p_ref_m = triangulate(kRig, px);
    pair.d_ref_px = px.disparity_px();
    pair.source = static_cast<std::uint16_t>(pairs.size());
    assert_true(pairs.push_back(pair));
  }
}

/// Every k-th pair sees a point somewhere else.
void spoil(std::size_t outliers, Random& random) {
  for (std::size_t i = 0; i < outliers; ++i) {
    StereoPixel& seen = pairs[i * pairs.size() / outliers].seen;
    seen.u_left = test::uniform(random, 20.0, 490.0);
    seen.v_left = seen.v_right = test::uniform(random, 20.0, 360.0);
    seen.u_right = seen.u_left - test::uniform(random, 10.0, 80.0);
  }
}

/// Error of an estimate as a left perturbation.
Vec6 error_of(const Pose3& estimated, const Pose3& truth = kTruth) {
  const Quat dq = truth.q * estimated.q.conjugate();
  Vec6 e;
  e.head<3>() = quat_log(dq);
  e.tail<3>() = truth.t - dq * estimated.t;
  return e;
}

MotionStatus run_ransac(const MotionParams& params = {}) {
  assert_status(ransac.start(params, kRig, pairs), MotionStatus::kRunning);
  assert_true(test::run_whole(ransac));
  return ransac.status();
}

MotionStatus run_refine(const Pose3& start, const MotionParams& params = {}) {
  assert_status(refine.start(params, kRig, pairs, start), MotionStatus::kRunning);
  assert_true(test::run_whole(refine));
  return refine.status();
}

void test_exact_recovery(void**) {
  Random random(1);
  for (const std::size_t count : {12U, 50U, 600U}) {
    fill_pairs(count, 0.0, random);
    assert_status(run_ransac(), MotionStatus::kEstimated);
    assert_int_equal(ransac.result().inliers, count);
    assert_int_equal(ransac.result().pairs, count);
    assert_at_most(error_of(ransac.result().T_cur_ref).norm(), 1e-11);
    assert_status(run_refine(Pose3()), MotionStatus::kEstimated);
    assert_int_equal(refine.result().inliers, count);
    assert_at_most(error_of(refine.result().T_cur_ref).norm(), 1e-9);
    assert_at_most(refine.result().rms_px, 1e-6);
  }
}

void test_jacobians(void**) {
  // From a start far off, with exact data, only right derivatives converge quadratically:
  // four iterations are enough.
  Random random(2);
  fill_pairs(100, 0.0, random);
  MotionParams params;
  params.iterations = 5;
  params.cauchy = 1e6;
  const Pose3 start = {quat_exp(Vec3(0.05, 0.06, -0.04)) * kTruth.q, kTruth.t + Vec3(0.1, -0.08, 0.1)};
  assert_status(run_refine(start, params), MotionStatus::kEstimated);
  assert_at_most(error_of(refine.result().T_cur_ref).norm(), 1e-9);
}

void test_forty_percent_outliers(void**) {
  double worst_r = 0.0;
  double worst_t = 0.0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    fill_pairs(200, 0.15, random);
    spoil(80, random);
    MotionParams params;
    params.seed = seed;
    assert_status(run_ransac(params), MotionStatus::kEstimated);
    assert_at_least(ransac.result().inliers, 80);
    assert_at_most(ransac.result().inliers, 125);
    int spoiled = 0;
    for (std::size_t i = 0; i < 80; ++i) spoiled += ransac.is_inlier(i * 200 / 80) ? 1 : 0;
    assert_at_most(spoiled, 3);
    const double rough = error_of(ransac.result().T_cur_ref).tail<3>().norm();
    assert_status(run_refine(ransac.result().T_cur_ref), MotionStatus::kEstimated);
    const Vec6 e = error_of(refine.result().T_cur_ref);
    worst_r = std::max(worst_r, e.head<3>().norm());
    worst_t = std::max(worst_t, e.tail<3>().norm());
    assert_at_most(rough, 0.03);
    assert_at_least(refine.result().inliers, 112);
  }
  print_message("40 %% outliers, 0.15 px: worst %.5f rad, %.5f m\n", worst_r, worst_t);
  assert_at_most(worst_r, 0.0015);
  assert_at_most(worst_t, 0.003);
}

void test_inliers_are_judged_in_both_images(void**) {
  Random random(11);
  fill_pairs(60, 0.0, random);
  pairs[3].seen.u_left += 2.5;
  pairs[4].seen.u_right += 2.5;
  pairs[5].seen.v_left += 2.5;
  pairs[6].seen.u_left += 1.5;
  pairs[7].seen.u_right -= 1.5;
  assert_status(run_ransac(), MotionStatus::kEstimated);
  for (std::size_t i = 0; i < 60; ++i) assert_int_equal(ransac.is_inlier(i), i < 3 || i > 5);
}

/// Mean of e^T C^-1 e over many draws: 6 where the covariance is right.
double mean_nees(double sigma_px, std::size_t outliers, int draws) {
  double sum = 0.0;
  for (int k = 0; k < draws; ++k) {
    Random random(1000 + static_cast<std::uint64_t>(k));
    fill_pairs(120, sigma_px, random);
    if (outliers > 0) spoil(outliers, random);
    assert_status(run_refine(kTruth), MotionStatus::kEstimated);
    const Vec6 e = error_of(refine.result().T_cur_ref);
    const Mat6& C = refine.result().covariance;
    assert_at_most((C - C.transpose()).norm(), 1e-9 * C.norm());
    sum += e.dot(Factors(C).solve(e));
  }
  return sum / draws;
}

void test_covariance_against_monte_carlo(void**) {
  for (const double sigma : {0.05, 0.15, 0.4}) {
    const double nees = mean_nees(sigma, 0, 300);
    print_message("sigma %.2f px: mean NEES %.2f (6 is exact)\n", sigma, nees);
    assert_at_least(nees, 5.4);
    assert_at_most(nees, 7.0);
  }
  const double spoiled = mean_nees(0.15, 24, 300);
  print_message("sigma 0.15 px, 20 %% outliers: mean NEES %.2f\n", spoiled);
  assert_at_least(spoiled, 5.0);
  assert_at_most(spoiled, 7.5);
}

void test_refined_beats_absolute_orientation(void**) {
  double orientation = 0.0;
  double refined = 0.0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Random random(seed);
    fill_pairs(150, 0.15, random);
    assert_status(run_ransac(), MotionStatus::kEstimated);
    assert_status(run_refine(ransac.result().T_cur_ref), MotionStatus::kEstimated);
    orientation += error_of(ransac.result().T_cur_ref).squaredNorm();
    refined += error_of(refine.result().T_cur_ref).squaredNorm();
  }
  print_message("rms error: absolute orientation %.5f, refined %.5f\n", std::sqrt(orientation / 60),
                std::sqrt(refined / 60));
  assert_true(refined < 0.5 * orientation);
}

/// Every other pair is five times as far off, and told to be; in any unit.
void test_pairs_count_by_their_weights(void**) {
  Random random(35);
  double equal = 0.0;
  double weighed = 0.0;
  for (int draw = 0; draw < 30; ++draw) {
    fill_pairs(200, 0.1, random);
    const MotionPairs good = pairs;
    fill_pairs(200, 0.5, random);
    for (std::size_t i = 0; i < pairs.size(); i += 2) pairs[i] = good[i];
    const auto refined = [] {
      assert_status(refine.start({}, kRig, pairs, kTruth), MotionStatus::kRunning);
      assert_true(test::run_whole(refine));
      assert_status(refine.status(), MotionStatus::kEstimated);
      return refine.result().T_cur_ref;
    };
    equal += error_of(refined()).squaredNorm();
    for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i].weight = i % 2 == 0 ? 1.0F : 0.04F;
    const Pose3 estimated = refined();
    weighed += error_of(estimated).squaredNorm();
    for (MotionPair& pair : pairs) pair.weight /= 1024.0F;
    assert_true(error_of(refined(), estimated).norm() < 1.0e-12);
  }
  print_message("rms error: of equal weights %.5f, as told %.5f\n", std::sqrt(equal / 30),
                std::sqrt(weighed / 30));
  assert_true(weighed < 0.8 * equal);
}

/// All disparities of both frames are short by so much: motions tell by how much, to first order.
void test_columns_are_told(void**) {
  for (const double short_px : {0.0, 0.3, -0.3}) {
    Random random(31);
    double information = 0.0;
    double evidence = 0.0;
    for (int draw = 0; draw < 30; ++draw) {
      fill_pairs(300, 0.1, random);
      for (MotionPair& pair : pairs) {
        pair.p_ref_m *= pair.d_ref_px / (pair.d_ref_px - short_px);
        pair.d_ref_px -= short_px;
        pair.seen.u_right += short_px;
      }
      assert_status(refine.start({}, kRig, pairs, kTruth, true), MotionStatus::kRunning);
      assert_true(test::run_whole(refine));
      assert_status(refine.status(), MotionStatus::kEstimated);
      information += refine.result().rig.columns_information;
      evidence += refine.result().rig.columns_evidence;
    }
    print_message("%.1f px short: %.3f px, sigma %.3f\n", short_px, evidence / information,
                  1.0 / std::sqrt(information));
    assert_at_most(1.0 / std::sqrt(information), 0.05);
    assert_near(evidence / information, short_px, 3.0 / std::sqrt(information) + 0.25 * std::fabs(short_px));
  }
}

/// Both cameras have a lens that nobody told: motions tell how strong it is, beside columns, which it fakes.
void test_a_lens_is_told(void**) {
  for (const double lens : {0.0, 0.01, -0.01}) {
    Random random(34);
    double information = 0.0;
    double evidence = 0.0;
    for (int draw = 0; draw < 30; ++draw) {
      fill_pairs(300, 0.1, random);
      for (MotionPair& pair : pairs) {
        StereoPixel from = sampson_correct(with_lens(kRig, lens, project(kRig, pair.p_ref_m)));
        from.u_right =
            from.u_left - from.disparity_px() * pair.d_ref_px / project(kRig, pair.p_ref_m).disparity_px();
        pair.d_ref_px = from.disparity_px();
        pair.p_ref_m = triangulate(kRig, from);
        pair.seen = sampson_correct(with_lens(kRig, lens, pair.seen));
      }
      assert_status(refine.start({}, kRig, pairs, kTruth, true), MotionStatus::kRunning);
      assert_true(test::run_whole(refine));
      assert_status(refine.status(), MotionStatus::kEstimated);
      const RigEvidence& rig = refine.result().rig;
      assert_at_most(rig.shared * rig.shared, rig.columns_information * rig.lens_information);
      information += rig.lens_information - rig.shared * rig.shared / rig.columns_information;
      evidence += rig.lens_evidence - rig.shared * rig.columns_evidence / rig.columns_information;
    }
    const double sigma = 1.0 / std::sqrt(information);
    print_message("lens %.3f: %.4f, sigma %.4f\n", lens, evidence / information, sigma);
    assert_at_most(sigma, 0.001);
    assert_near(evidence / information, lens, 3.0 * sigma + 0.25 * std::fabs(lens));
  }
}

/// A wall that moves sideways is as well one at another distance: nothing is told, the less so without noise.
void test_a_wall_tells_nothing_of_columns(void**) {
  const Pose3 sideways{Quat::Identity(), Vec3(-0.045, 0.0, 0.0)};
  for (const double sigma : {0.0, 0.05}) {
    Random random(33);
    fill_pairs(300, 0.0, random);
    for (MotionPair& pair : pairs) {
      constexpr double kDisparity_px = 16.0;
      pair.p_ref_m *= pair.d_ref_px / kDisparity_px;
      pair.d_ref_px = kDisparity_px;
      pair.seen = project(kRig, sideways * pair.p_ref_m);
      pair.seen.u_left += sigma * test::normal(random);
      pair.seen.u_right += sigma * test::normal(random);
    }
    assert_status(refine.start({}, kRig, pairs, sideways, true), MotionStatus::kRunning);
    assert_true(test::run_whole(refine));
    assert_status(refine.status(), MotionStatus::kEstimated);
    assert_near(refine.result().rig.columns_information, 0.0, 0.0);
    assert_near(refine.result().rig.columns_evidence, 0.0, 0.0);
    assert_near(refine.result().rig.lens_information, 0.0, 0.0);
  }
}

void test_bad_input(void**) {
  Random random(5);
  fill_pairs(40, 0.1, random);
  const auto refused = [](const MotionParams& params, const StereoRig& rig) {
    return ransac.start(params, rig, pairs) == MotionStatus::kBadInput &&
           refine.start(params, rig, pairs, Pose3()) == MotionStatus::kBadInput;
  };
  assert_false(refused({}, kRig));
  const double inf = std::numeric_limits<double>::infinity();
  const MotionPair good = pairs[7];
  for (const float weight : {0.0F, -1.0F, NAN}) {
    pairs[7].weight = weight;
    assert_status(refine.start({}, kRig, pairs, Pose3()), MotionStatus::kBadInput);
  }
  pairs[7] = good;
  const auto pair_refused = [&] {
    const bool no = refused({}, kRig);
    pairs[7] = good;
    return no;
  };
  for (const double v : {static_cast<double>(NAN), inf, -inf}) {
    pairs[7].p_ref_m.x() = v;
    assert_true(pair_refused());
    pairs[7].seen.u_left = v;
    assert_true(pair_refused());
    pairs[7].seen.v_left = v;
    assert_true(pair_refused());
    pairs[7].seen.u_right = v;
    assert_true(pair_refused());
    pairs[7].d_ref_px = v;
    assert_true(pair_refused());
  }
  pairs[7].p_ref_m.z() = 0.0;
  assert_true(pair_refused());
  pairs[7].d_ref_px = 0.0;
  assert_true(pair_refused());
  pairs[7].seen.u_right = pairs[7].seen.u_left;
  assert_true(pair_refused());

  for (const int member : {0, 1, 2, 3, 4, 5, 6, 7, 8}) {
    MotionParams params;
    if (member == 0) params.max_hypotheses = 0;
    if (member == 1) params.inlier_px = 0.0;
    if (member == 2) params.min_inliers = 2;
    if (member == 3) params.confidence = 1.0;
    if (member == 4) params.confidence = NAN;
    if (member == 5) params.sigma_px = 0.0;
    if (member == 6) params.cauchy = 0.0;
    if (member == 7) params.iterations = 0;
    if (member == 8) params.sigma_px = NAN;
    assert_true(refused(params, kRig));
  }
  StereoRig rig = kRig;
  rig.baseline_m = 0.0;
  assert_true(refused({}, rig));
  Pose3 start;
  start.t.x() = NAN;
  assert_status(refine.start({}, kRig, pairs, start), MotionStatus::kBadInput);
  assert_true(test::run_whole(refine));
  assert_status(refine.status(), MotionStatus::kBadInput);
}

void test_too_few_pairs(void**) {
  Random random(6);
  fill_pairs(11, 0.1, random);
  assert_status(ransac.start({}, kRig, pairs), MotionStatus::kTooFewPairs);
  assert_status(refine.start({}, kRig, pairs, Pose3()), MotionStatus::kTooFewPairs);
  assert_int_equal(ransac.result().pairs, 11);
  MotionParams params;
  params.min_inliers = 3;
  pairs.resize(3);
  assert_status(run_ransac(params), MotionStatus::kEstimated);  // three fix a motion
  pairs.resize(2);
  assert_status(ransac.start(params, kRig, pairs), MotionStatus::kTooFewPairs);
}

void test_idle(void**) {
  static RansacMotionJob a;
  static RefineMotionJob b;
  assert_status(a.status(), MotionStatus::kIdle);
  assert_status(b.status(), MotionStatus::kIdle);
  assert_true(test::run_whole(a) && test::run_whole(b));
}

void test_no_consensus(void**) {
  Random random(7);
  fill_pairs(60, 0.1, random);
  spoil(60, random);
  assert_status(run_ransac(), MotionStatus::kNoConsensus);
  for (std::size_t i = 0; i < 60; ++i) assert_false(ransac.is_inlier(i));
  // A refinement that loses more than it may: twelve pairs, one of them wrong.
  fill_pairs(12, 0.1, random);
  pairs[5].seen.u_left += 40.0;
  assert_status(run_refine(kTruth), MotionStatus::kNoConsensus);
}

void test_degenerate(void**) {
  Random random(8);
  fill_pairs(30, 0.0, random);
  for (std::size_t i = 0; i < pairs.size(); ++i) {  // points on a line: turning about it changes nothing
    const Vec3 p = Vec3(-0.5, 0.1, 1.0) + Vec3(1.0, 0.2, 0.4) * (static_cast<double>(i) / 30.0);
    pairs[i].p_ref_m = p;
    pairs[i].d_ref_px = project(kRig, p).disparity_px();
    pairs[i].seen = project(kRig, kTruth * p);
  }
  assert_status(run_refine(kTruth), MotionStatus::kDegenerate);
  assert_status(run_ransac(), MotionStatus::kNoConsensus);  // no triple gives a hypothesis
  // A start behind all points leaves nothing to refine on.
  fill_pairs(30, 0.0, random);
  Pose3 behind;
  behind.t.z() = -100.0;
  assert_status(run_refine(behind), MotionStatus::kDegenerate);
}

void test_early_end(void**) {
  // Hypotheses are counted by the budget: clean pairs need few, a half of outliers many.
  Random random(9);
  const auto spent = [](const MotionParams& params) {
    assert_status(ransac.start(params, kRig, pairs), MotionStatus::kRunning);
    WorkBudget budget = WorkBudget::unlimited();
    assert_status(ransac.step(budget), Progress::kDone);
    return static_cast<int>(budget.spent() / RansacMotionJob::unit_ops(pairs.size())) - 1;
  };
  fill_pairs(100, 0.0, random);
  assert_at_most(spent({}), 2);
  spoil(50, random);
  const int many = spent({});
  // log(1 - 0.999) / log(1 - 0.5^3) = 51.7, if the best hypothesis holds just the half
  assert_at_least(many, 35);
  assert_at_most(many, 80);
  MotionParams few;
  few.max_hypotheses = 10;
  assert_at_most(spent(few), 10);
}

void test_slices_give_the_same_bits(void**) {
  Random random(10);
  fill_pairs(150, 0.2, random);
  spoil(50, random);
  assert_status(run_ransac(), MotionStatus::kEstimated);
  assert_status(ransac_sliced.start({}, kRig, pairs), MotionStatus::kRunning);
  assert_true(test::run_in_slices(ransac_sliced) > 2);
  const auto same = [](const MotionResult& a, const MotionResult& b) {
    return a.T_cur_ref.q.coeffs() == b.T_cur_ref.q.coeffs() && a.T_cur_ref.t == b.T_cur_ref.t &&
           a.covariance == b.covariance && a.inliers == b.inliers && a.rms_px == b.rms_px &&
           a.pairs == b.pairs;
  };
  assert_true(same(ransac.result(), ransac_sliced.result()));
  const Pose3 start = ransac.result().T_cur_ref;
  assert_status(run_refine(start), MotionStatus::kEstimated);
  assert_status(refine_sliced.start({}, kRig, pairs, start), MotionStatus::kRunning);
  assert_true(test::run_in_slices(refine_sliced) > 3);
  assert_true(same(refine.result(), refine_sliced.result()));
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    assert_int_equal(ransac.is_inlier(i), ransac_sliced.is_inlier(i));
    assert_int_equal(refine.is_inlier(i), refine_sliced.is_inlier(i));
  }
}

// ---- real tracks: a hand-held stereo head before 20 landmarks, poses by motion capture --------------------

constexpr int kFrames = 1900;
constexpr int kLandmarks = 20;
StereoPixel track[kFrames][kLandmarks];
bool tracked[kFrames][kLandmarks];
Pose3 T_world_vehicle[kFrames];

struct StarryNight {
  StereoRig rig;
  Pose3 T_vehicle_cam;
};

bool next_line(std::FILE* file, char (&line)[512]) {
  while (std::fgets(line, sizeof line, file) != nullptr) {
    if (line[0] != '#') return true;
  }
  return false;
}

Pose3 pose_from(const Mat3& R_cam_vehicle, const Vec3& t_vehicle) {
  return {Quat(R_cam_vehicle.transpose()).normalized(), t_vehicle};
}

bool read_starry_night(const std::string& folder, StarryNight& set) {
  char line[512];
  std::FILE* file = std::fopen((folder + "/calibration.txt").c_str(), "r");
  if (file == nullptr) return false;
  set.rig = kRig;
  set.rig.width_px = 640;
  set.rig.height_px = 480;
  Mat3 C = Mat3::Identity();
  Vec3 rho = Vec3::Zero();
  while (next_line(file, line)) {
    double v[9];
    char name[32];
    const int got = std::sscanf(line, "%31s %lf %lf %lf %lf %lf %lf %lf %lf %lf", name, &v[0], &v[1], &v[2],
                                &v[3], &v[4], &v[5], &v[6], &v[7], &v[8]);
    if (got < 2) continue;
    if (std::strcmp(name, "fu") == 0) set.rig.fx_px = v[0];
    if (std::strcmp(name, "fv") == 0) set.rig.fy_px = v[0];
    if (std::strcmp(name, "cu") == 0) set.rig.cx_px = v[0];
    if (std::strcmp(name, "cv") == 0) set.rig.cy_px = v[0];
    if (std::strcmp(name, "b") == 0) set.rig.baseline_m = v[0];
    if (std::strcmp(name, "C_c_v") == 0) C << v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8];
    if (std::strcmp(name, "rho_v_c_v") == 0) rho = Vec3(v[0], v[1], v[2]);
  }
  std::fclose(file);
  set.T_vehicle_cam = pose_from(C, rho);

  file = std::fopen((folder + "/poses.csv").c_str(), "r");
  if (file == nullptr) return false;
  for (int k = 0; k < kFrames && next_line(file, line); ++k) {
    double t = 0.0;
    Vec3 r;
    Vec3 theta;
    if (std::sscanf(line, "%lf,%lf,%lf,%lf,%lf,%lf,%lf", &t, &r[0], &r[1], &r[2], &theta[0], &theta[1],
                    &theta[2]) != 7)
      break;
    // Axis and angle of C_vk_i, which turns coordinates of the world into those of the vehicle:
    //   cos 1 + (1 - cos) a a^T - sin a^
    // the transpose of a rotation by that vector.
    T_world_vehicle[k] = {quat_exp(theta), r};
  }
  std::fclose(file);

  file = std::fopen((folder + "/stereo_tracks.csv").c_str(), "r");
  if (file == nullptr) return false;
  while (next_line(file, line)) {
    int k = 0;
    int j = 0;
    StereoPixel px;
    if (std::sscanf(line, "%d,%d,%lf,%lf,%lf,%lf", &k, &j, &px.u_left, &px.v_left, &px.u_right,
                    &px.v_right) != 6)
      break;
    if (k < 0 || k >= kFrames || j < 0 || j >= kLandmarks) continue;
    track[k][j] = px;
    tracked[k][j] = true;
  }
  std::fclose(file);
  return true;
}

void test_real_tracks(void**) {
  const std::string folder = test::find_data("starry_night");
  SKIP_WITHOUT(folder, "starry_night");
  static StarryNight set;
  assert_true(read_starry_night(folder, set));
  MotionParams params;
  params.min_inliers = 6;
  params.inlier_px = 4.0;
  params.sigma_px = 1.0;
  constexpr int kGap = 5;
  static double rotation[kFrames];
  static double translation[kFrames];
  static double moved[kFrames];
  std::size_t n = 0;
  int tried = 0;
  for (int k = 0; k + kGap < kFrames; ++k) {
    pairs.clear();
    for (int j = 0; j < kLandmarks; ++j) {
      if (!tracked[k][j] || !tracked[k + kGap][j]) continue;
      const StereoPixel a = sampson_correct(track[k][j]);
      MotionPair pair;
      pair.seen = sampson_correct(track[k + kGap][j]);
      if (a.disparity_px() < 2.0 || pair.seen.disparity_px() < 2.0) continue;
      pair.p_ref_m = triangulate(set.rig, a);
      pair.d_ref_px = a.disparity_px();
      assert_true(pairs.push_back(pair));
    }
    if (ransac.start(params, set.rig, pairs) != MotionStatus::kRunning) continue;
    ++tried;
    assert_true(test::run_whole(ransac));
    if (ransac.status() != MotionStatus::kEstimated) continue;
    assert_status(refine.start(params, set.rig, pairs, ransac.result().T_cur_ref), MotionStatus::kRunning);
    assert_true(test::run_whole(refine));
    if (refine.status() != MotionStatus::kEstimated) continue;
    const Pose3 truth =
        (T_world_vehicle[k + kGap] * set.T_vehicle_cam).inverse() * (T_world_vehicle[k] * set.T_vehicle_cam);
    const Vec6 e = error_of(refine.result().T_cur_ref, truth);
    rotation[n] = e.head<3>().norm();
    translation[n] = e.tail<3>().norm();
    moved[n] = truth.t.norm();
    ++n;
  }
  std::sort(rotation, rotation + n);
  std::sort(translation, translation + n);
  std::sort(moved, moved + n);
  print_message(
      "%zu of %d motions over %d frames (median %.3f m): median error %.4f rad, %.4f m; 90 %% below %.4f "
      "rad, %.4f m\n",
      n, tried, kGap, moved[n / 2], rotation[n / 2], translation[n / 2], rotation[n * 9 / 10],
      translation[n * 9 / 10]);
  // The poses themselves miss the tracks by 6 px in u and 11 px in v, which is 0.01 to 0.02 rad.
  assert_at_least(static_cast<double>(n), 0.8 * tried);
  assert_at_most(rotation[n / 2], 0.015);
  assert_at_most(translation[n / 2], 0.010);
  assert_at_most(rotation[n * 9 / 10], 0.04);
  assert_at_most(translation[n * 9 / 10], 0.03);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_exact_recovery),
      cmocka_unit_test(test_jacobians),
      cmocka_unit_test(test_forty_percent_outliers),
      cmocka_unit_test(test_inliers_are_judged_in_both_images),
      cmocka_unit_test(test_covariance_against_monte_carlo),
      cmocka_unit_test(test_refined_beats_absolute_orientation),
      cmocka_unit_test(test_pairs_count_by_their_weights),
      cmocka_unit_test(test_columns_are_told),
      cmocka_unit_test(test_a_lens_is_told),
      cmocka_unit_test(test_a_wall_tells_nothing_of_columns),
      cmocka_unit_test(test_bad_input),
      cmocka_unit_test(test_too_few_pairs),
      cmocka_unit_test(test_idle),
      cmocka_unit_test(test_no_consensus),
      cmocka_unit_test(test_degenerate),
      cmocka_unit_test(test_early_end),
      cmocka_unit_test(test_slices_give_the_same_bits),
      cmocka_unit_test(test_real_tracks),
  };
  return cmocka_run_group_tests_name("motion", tests, nullptr, nullptr);
}
