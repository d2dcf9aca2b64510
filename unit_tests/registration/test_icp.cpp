// ICP: known motions on random and real boulder fields, closed forms against Eigen's umeyama, nearest
// neighbours against brute force, covariance against Monte Carlo, each status, slicing.
#include "registration/icp.hpp"

#include <Eigen/Dense>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include "core/random.hpp"
#include "support/cmocka.hpp"
#include "support/data.hpp"
#include "support/text_file.hpp"

using namespace cairn;

namespace {

IcpJob job;
IcpJob other_job;
MapBoulders map_boulders;
LocalMap local_map;

const Vec2 kPivot(12.0, -7.0);
const Pose2 kTruth{40.0, 55.0, 0.8};

double uniform(Random& random, double low, double high) {
  return low + (high - low) * (random.next() + 0.5) / 4294967296.0;
}
double gauss(Random& random) {
  const double u = uniform(random, 0.0, 1.0);
  return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * kPi * uniform(random, 0.0, 1.0));
}

void add_map(const Vec2& p, double diameter_m = 0.2) {
  assert_true(map_boulders.push_back({p, static_cast<float>(diameter_m)}));
}
void add_local(const Vec2& p, double diameter_m = 0.2) {
  LocalBoulder b;
  b.p_site_m = p;
  b.diameter_m = static_cast<float>(diameter_m);
  assert_true(local_map.push_back(b));
}

/// A map of `count` boulders in a square of `side_m` about the pivot, at least `apart_m` from each other.
void scatter_map(Random& random, int count, double side_m, double apart_m) {
  map_boulders.clear();
  const Vec2 centre = kTruth * kPivot;
  for (int tries = 0; tries < 200000 && static_cast<int>(map_boulders.size()) < count; ++tries) {
    const Vec2 p = centre + Vec2(uniform(random, -0.5, 0.5), uniform(random, -0.5, 0.5)) * side_m;
    bool free = true;
    for (const MapBoulder& b : map_boulders) free = free && (b.p_map_m - p).norm() >= apart_m;
    if (free) add_map(p);
  }
  assert_int_equal(map_boulders.size(), count);
}

/// The first `count` map boulders as seen from site: about the pivot, `scale` too small,
/// with noise on each axis.
void see_locals(Random& random, int count, double noise_m, double scale) {
  local_map.clear();
  const Pose2 T_site_map = kTruth.inverse();
  for (int i = 0; i < count; ++i) {
    const Vec2 q = T_site_map * map_boulders[i].p_map_m - kPivot;
    add_local(kPivot + q / scale + noise_m * Vec2(gauss(random), gauss(random)));
  }
}

/// The truth, moved by (dx, dy) at the pivot and turned by dyaw about it.
Pose2 moved_truth(double dx_m, double dy_m, double dyaw_rad) {
  Pose2 prior{0.0, 0.0, kTruth.yaw_rad + dyaw_rad};
  const Vec2 at = kTruth * kPivot + Vec2(dx_m, dy_m);
  const Vec2 t = at - prior * kPivot;
  prior.x_m = t.x();
  prior.y_m = t.y();
  return prior;
}

IcpParams plain() {
  IcpParams p;
  p.gate_start_m = p.gate_final_m = 0.5;
  p.gate_shrink = 1.0;
  p.trim_fraction = 0.0;
  return p;
}

IcpStatus run(const IcpParams& params, const Pose2& prior_pose, const IcpPrior& prior = IcpPrior()) {
  (void)job.start(params, map_boulders, local_map, prior_pose, kPivot, prior);
  WorkBudget all = WorkBudget::unlimited();
  assert_int_equal(static_cast<int>(job.step(all)), static_cast<int>(Progress::kDone));
  return job.status();
}

Vec3 pose_error() {
  const IcpResult& r = job.result();
  const Vec2 e = r.T_map_site * kPivot - kTruth * kPivot;
  return {e.x(), e.y(), wrap_angle(r.T_map_site.yaw_rad - kTruth.yaw_rad)};
}

// ---- known motions ----------------------------------------------------------------------------------------

void test_recovers_rigid_exactly(void**) {
  Random random(1);
  for (int trial = 0; trial < 30; ++trial) {
    scatter_map(random, 60, 8.0, 0.8);
    see_locals(random, 30, 0.0, 1.0);
    const Pose2 start =
        moved_truth(uniform(random, -0.2, 0.2), uniform(random, -0.2, 0.2), uniform(random, -0.02, 0.02));
    assert_status(run(plain(), start), IcpStatus::kConverged);
    assert_near(pose_error().norm(), 0.0, 1e-12);
    assert_near(job.result().rms_m, 0.0, 1e-12);
    assert_int_equal(job.result().pairs_used, 30);
    const Vec2 correction = kTruth * kPivot - start * kPivot;
    assert_near(job.result().dx_m, correction.x(), 1e-12);
    assert_near(job.result().dy_m, correction.y(), 1e-12);
    assert_near(job.result().dyaw_rad, wrap_angle(kTruth.yaw_rad - start.yaw_rad), 1e-12);
    for (const IcpPair& pair : job.result().pairs) assert_int_equal(pair.local, pair.map);
  }
}

void test_recovers_similarity_exactly(void**) {
  Random random(2);
  for (const double scale : {0.96, 1.04}) {
    scatter_map(random, 60, 8.0, 0.8);
    see_locals(random, 30, 0.0, scale);
    IcpParams p = plain();
    p.model = IcpModel::kSimilarity;
    assert_status(run(p, moved_truth(0.1, -0.1, 0.01)), IcpStatus::kConverged);
    assert_near(job.result().scale, scale, 1e-12);
    assert_near(pose_error().norm(), 0.0, 1e-12);  // the rigid part maps the pivot exactly
    assert_near(job.result().rms_m, 0.0, 1e-12);
    // What the header says of scale and pose gives the map boulder.
    const Vec2 site = local_map[7].p_site_m;
    const Vec2 there = job.result().T_map_site * Vec2(kPivot + job.result().scale * (site - kPivot));
    assert_near((there - map_boulders[7].p_map_m).norm(), 0.0, 1e-12);
  }
}

void test_perfect_start_converges_at_once(void**) {
  Random random(3);
  scatter_map(random, 40, 8.0, 0.8);
  see_locals(random, 20, 0.0, 1.0);
  IcpParams p = plain();
  p.step_m = p.step_rad = 1e-12;
  for (const IcpModel model : {IcpModel::kRigid, IcpModel::kSimilarity}) {
    p.model = model;
    assert_status(run(p, kTruth), IcpStatus::kConverged);
    assert_int_equal(job.result().iterations, 1);
  }
  // A fixed point is one to the bit: it converges even where no step at all is allowed.
  p.step_m = p.step_rad = 0.0;
  p.model = IcpModel::kRigid;
  assert_status(run(p, moved_truth(0.1, 0.1, 0.01)), IcpStatus::kConverged);
}

/// Noise 0.04 m, of 30 local boulders nine nowhere in the map, map boulders that nobody saw.
void test_noise_outliers_and_clutter(void**) {
  Random random(4);
  const int kTrials = 200;
  int converged = 0;
  int good = 0;
  double sum = 0.0;
  double sum_yaw = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    scatter_map(random, 50, 6.0, 0.4);
    see_locals(random, 21, 0.04, 1.0);
    for (int i = 0; i < 9; ++i)
      add_local(kPivot + 6.0 * Vec2(uniform(random, -0.5, 0.5), uniform(random, -0.5, 0.5)));
    IcpParams p;  // the mission's
    const Pose2 start =
        moved_truth(uniform(random, -0.1, 0.1), uniform(random, -0.1, 0.1), uniform(random, -0.03, 0.03));
    if (run(p, start) != IcpStatus::kConverged) continue;
    ++converged;
    const Vec3 e = pose_error();
    sum += e.head<2>().squaredNorm();
    sum_yaw += e.z() * e.z();
    if (e.head<2>().norm() <= 0.05 && std::fabs(e.z()) <= 0.03) ++good;
  }
  print_message(
      "noise and outliers: %d of %d converged, %d within 0.05 m and 1.7 degrees; rms %.4f m %.4f rad\n",
      converged, kTrials, good, std::sqrt(sum / converged), std::sqrt(sum_yaw / converged));
  assert_at_least(converged, 0.97 * kTrials);
  assert_at_least(good, 0.95 * kTrials);
}

// ---- against others ---------------------------------------------------------------------------------------

void test_closed_forms_against_umeyama(void**) {
  constexpr int kCount = 40;
  Random random(5);
  for (const IcpModel model : {IcpModel::kRigid, IcpModel::kSimilarity}) {
    scatter_map(random, 80, 10.0, 0.8);
    see_locals(random, kCount, 0.05, 1.01);
    IcpParams p = plain();
    p.model = model;
    assert_status(run(p, moved_truth(0.1, 0.05, -0.01)), IcpStatus::kConverged);
    const IcpResult& r = job.result();
    assert_int_equal(r.pairs.size(), kCount);
    Eigen::Matrix<double, 2, kCount> from;
    Eigen::Matrix<double, 2, kCount> to;
    for (int i = 0; i < kCount; ++i) {
      from.col(i) = local_map[r.pairs[i].local].p_site_m - kPivot;
      to.col(i) = map_boulders[r.pairs[i].map].p_map_m;
    }
    const Mat3 oracle = Eigen::umeyama(from, to, model == IcpModel::kSimilarity);
    const SinCos yaw = sin_cos(r.T_map_site.yaw_rad);
    assert_near(oracle(0, 0), r.scale * yaw.cos, 1e-12);
    assert_near(oracle(1, 0), r.scale * yaw.sin, 1e-12);
    const Vec2 pivot_map = r.T_map_site * kPivot;
    assert_near(oracle(0, 2), pivot_map.x(), 1e-11);
    assert_near(oracle(1, 2), pivot_map.y(), 1e-11);
  }
}

/// The prior's estimate against a dense Gauss-Newton on the cost as it is meant.
void test_prior_against_gauss_newton(void**) {
  Random random(6);
  scatter_map(random, 20, 6.0, 0.9);
  see_locals(random, 7, 0.05, 1.0);
  IcpParams p = plain();
  p.min_lever_m = 0.0;
  const IcpPrior prior{true, 0.03, 0.004};
  const Pose2 start = moved_truth(0.06, -0.03, 0.01);
  assert_status(run(p, start, prior), IcpStatus::kConverged);
  const IcpResult& r = job.result();
  Vec3 x(0.0, 0.0, 0.0);
  Mat3 H;
  for (int iteration = 0; iteration < 20; ++iteration) {
    H = Vec3(1.0 / (0.03 * 0.03), 1.0 / (0.03 * 0.03), 1.0 / (0.004 * 0.004)).asDiagonal();
    Vec3 g = H * x;
    for (const IcpPair& pair : r.pairs) {
      const Vec2 q = Eigen::Rotation2Dd(start.yaw_rad + x.z()) * (local_map[pair.local].p_site_m - kPivot);
      const Vec2 e = start * kPivot + x.head<2>() + q - map_boulders[pair.map].p_map_m;
      Eigen::Matrix<double, 2, 3> J;
      J << 1.0, 0.0, -q.y(), 0.0, 1.0, q.x();
      H += J.transpose() * J / (p.sigma_pair_m * p.sigma_pair_m);
      g += J.transpose() * e / (p.sigma_pair_m * p.sigma_pair_m);
    }
    x -= H.inverse() * g;
  }
  assert_near(r.dx_m, x.x(), 1e-6);  // the prior's cost on yaw is 2 (1 - cos), not the square
  assert_near(r.dy_m, x.y(), 1e-6);
  assert_near(r.dyaw_rad, x.z(), 1e-6);
  if (r.covariance(2, 2) > 0.0 && r.rms_m * r.rms_m * 7 / (2 * 7 - 3) <= p.sigma_pair_m * p.sigma_pair_m) {
    const Mat3 dense = H.inverse();  // the floor sigma_pair holds: the same information
    for (int i = 0; i < 9; ++i) assert_near(r.covariance(i), dense(i), 1e-9);
  } else {
    fail_msg("%s", "the trial was meant to stay at the floor of sigma_pair");
  }
}

void test_prior_holds_the_yaw_of_clumped_pairs(void**) {
  Random random(7);
  double free_yaw = 0.0;
  double held_yaw = 0.0;
  for (int trial = 0; trial < 50; ++trial) {
    scatter_map(random, 4, 1.2, 0.55);
    see_locals(random, 4, 0.06, 1.0);
    IcpParams p = plain();
    p.min_lever_m = 0.0;
    p.min_pairs = 2;
    p.max_correction_rad = kPi;
    (void)run(p, kTruth);
    free_yaw += pose_error().z() * pose_error().z();
    assert_status(run(p, kTruth, {true, 0.1, 0.01}), IcpStatus::kConverged);
    held_yaw += pose_error().z() * pose_error().z();
  }
  assert_at_most(std::sqrt(held_yaw / 50.0), 0.01);
  assert_at_least(std::sqrt(free_yaw / 50.0), 0.03);
}

struct Nearest {
  int index;
  double r2;
};

Nearest brute_nearest(const Vec2& p, double gate_m, double diameter_m, double ratio) {
  Nearest best{-1, gate_m * gate_m};
  for (std::size_t i = 0; i < map_boulders.size(); ++i) {
    const double d = static_cast<double>(map_boulders[i].diameter_m);
    if (ratio > 0.0 && (d > ratio * diameter_m || diameter_m > ratio * d)) continue;
    const double r2 = (map_boulders[i].p_map_m - p).squaredNorm();
    if (r2 < best.r2 || (best.index < 0 && r2 <= best.r2)) best = {static_cast<int>(i), r2};
  }
  return best;
}

/// One pairing at the prior: the grid's nearest neighbours are the brute force's.
void test_grid_equals_brute_force(void**) {
  Random random(8);
  const Pose2 identity;
  for (int trial = 0; trial < 40; ++trial) {
    map_boulders.clear();
    const double side = trial % 3 == 0 ? 300.0 : 12.0;
    const int count = trial % 4 == 0 ? static_cast<int>(cfg::kMaxMapWindowBoulders) : 50 + 20 * trial;
    for (int i = 0; i < count; ++i) {
      if (i % 7 == 6) {
        add_map(map_boulders[i - 3].p_map_m, uniform(random, 0.1, 0.6));  // a tie
      } else {
        const double narrow = trial % 5 == 0 ? 0.01 : 1.0;
        add_map({uniform(random, -0.5, 0.5) * side, uniform(random, -0.5, 0.5) * side * narrow},
                uniform(random, 0.1, 0.6));
      }
    }
    local_map.clear();
    for (int i = 0; i < 200; ++i) {
      add_local({uniform(random, -0.7, 0.7) * side, uniform(random, -0.7, 0.7) * side},
                uniform(random, 0.1, 0.6));
    }
    IcpParams p = plain();
    p.gate_start_m = p.gate_final_m = trial % 2 == 0 ? 0.7 : 40.0;
    p.one_to_one = false;
    p.max_iterations = 1;
    p.min_pairs = 2;
    p.max_size_ratio = trial % 3 == 1 ? 1.5 : 0.0;
    (void)job.start(p, map_boulders, local_map, identity, Vec2(0.0, 0.0));
    WorkBudget all = WorkBudget::unlimited();
    (void)job.step(all);
    int paired = 0;
    static int partner[cfg::kMaxLocalBoulders];
    for (int& i : partner) i = -1;
    for (const IcpPair& pair : job.result().pairs) partner[pair.local] = pair.map;
    for (std::size_t i = 0; i < local_map.size(); ++i) {
      const Nearest best = brute_nearest(local_map[i].p_site_m, p.gate_start_m,
                                         static_cast<double>(local_map[i].diameter_m), p.max_size_ratio);
      assert_int_equal(partner[i], best.index);
      paired += best.index >= 0 ? 1 : 0;
    }
    assert_int_equal(job.result().pairs_used, paired);
    assert_int_equal(job.result().pairs_gated, 200 - paired);
  }
}

// ---- pairs ------------------------------------------------------------------------------------------------

void test_one_to_one_and_trim(void**) {
  map_boulders.clear();
  local_map.clear();
  for (int i = 0; i < 10; ++i) add_map({1.0 * i, i % 2 == 0 ? 0.0 : 2.0});
  for (int i = 0; i < 10; ++i) add_local(map_boulders[i].p_map_m);
  add_local({0.1, 0.0});  // also nearest to map boulder 0, but farther
  IcpParams p = plain();
  const auto go = [&p]() {
    (void)job.start(p, map_boulders, local_map, Pose2(), Vec2(4.0, 1.0));
    WorkBudget all = WorkBudget::unlimited();
    (void)job.step(all);
  };
  go();
  assert_status(job.status(), IcpStatus::kConverged);
  assert_int_equal(job.result().pairs_used, 10);
  assert_int_equal(job.result().pairs_gated, 1);
  assert_near(job.result().rms_m, 0.0, 1e-15);
  p.one_to_one = false;
  go();
  assert_int_equal(job.result().pairs_used, 11);
  p.trim_fraction = 0.2;  // 2 of 11: the false one goes first
  go();
  assert_int_equal(job.result().pairs_used, 9);
  assert_int_equal(job.result().pairs_trimmed, 2);
  assert_int_equal(job.result().pairs_gated, 0);
  assert_near(job.result().rms_m, 0.0, 1e-15);
}

void test_gate_at_its_corner(void**) {
  map_boulders.clear();
  local_map.clear();
  for (const double x : {0.0, 4.0, 8.0}) add_map({x, 0.0});
  add_local({0.5, 0.0});
  add_local({4.0, 0.5});
  add_local({8.0, std::nextafter(0.5, 1.0)});
  IcpParams p = plain();
  p.max_iterations = 1;
  p.min_pairs = 2;
  (void)job.start(p, map_boulders, local_map, Pose2(), Vec2(0.0, 0.0));
  WorkBudget all = WorkBudget::unlimited();
  (void)job.step(all);
  assert_int_equal(job.result().pairs_used, 2);
  assert_int_equal(job.result().pairs_gated, 1);
}

/// The gate narrows to the final one and no further: pairs of mirrored locals, which leave the estimate
/// where it is.
void test_gate_narrows(void**) {
  map_boulders.clear();
  local_map.clear();
  for (int i = 0; i < 8; ++i) add_map({5.0 * (i % 4), 5.0 * (i / 4)});
  const double off[] = {0.0, 0.45, 0.8, 0.0, 0.0, -0.45, -0.8, 0.0};
  for (int i = 0; i < 8; ++i) add_local(map_boulders[i].p_map_m + Vec2(off[i], 0.0));
  IcpParams p = plain();
  p.gate_start_m = 1.0;
  p.gate_final_m = 0.5;
  p.gate_shrink = 0.1;
  p.step_m = 1.0;  // any step is small enough: only the gate holds it back
  p.step_rad = 1.0;
  (void)job.start(p, map_boulders, local_map, Pose2(), Vec2(7.5, 2.5));
  WorkBudget all = WorkBudget::unlimited();
  (void)job.step(all);
  assert_status(job.status(), IcpStatus::kConverged);
  assert_int_equal(job.result().iterations, 2);
  assert_int_equal(job.result().pairs_used, 6);
}

// ---- covariance -------------------------------------------------------------------------------------------

double mean_nees(std::uint64_t seed, const IcpParams& p, bool use_prior, int outliers) {
  Random random(seed);
  const int kTrials = 400;
  double sum = 0.0;
  int count = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    scatter_map(random, 45, 8.0, 0.8);
    see_locals(random, 30 - outliers, 0.04, 1.0);
    for (int i = 0; i < outliers; ++i) {
      add_local(kTruth.inverse() * map_boulders[30 + i].p_map_m +
                Vec2(uniform(random, 0.15, 0.3), uniform(random, -0.2, 0.2)));
    }
    const IcpPrior prior{use_prior, 0.02, 0.005};
    const double xy = use_prior ? prior.sigma_xy_m : 0.05;
    const double yaw = use_prior ? prior.sigma_yaw_rad : 0.01;
    const Pose2 start = moved_truth(xy * gauss(random), xy * gauss(random), yaw * gauss(random));
    if (run(p, start, prior) != IcpStatus::kConverged) continue;
    const Vec3 e = pose_error();
    sum += e.dot(job.result().covariance.inverse() * e);
    ++count;
  }
  assert_at_least(count, 0.98 * kTrials);
  return sum / count;
}

/// Mean normalised error squared: 3 where the covariance tells the truth.
void test_covariance_against_monte_carlo(void**) {
  IcpParams p = plain();
  p.gate_start_m = p.gate_final_m = 0.35;
  p.sigma_pair_m = 0.001;  // the residuals' own variance
  const double rigid = mean_nees(11, p, false, 0);
  p.model = IcpModel::kSimilarity;
  const double similar = mean_nees(12, p, false, 0);
  p.model = IcpModel::kRigid;
  p.trim_fraction = 0.3;
  const double trimmed = mean_nees(13, p, false, 0);
  const double outliers = mean_nees(14, p, false, 6);
  p.trim_fraction = 0.0;
  p.sigma_pair_m = 0.04;
  const double with_prior = mean_nees(15, p, true, 0);
  print_message(
      "NEES (3 is right): rigid %.2f similarity %.2f trimmed %.2f trimmed outliers %.2f prior %.2f\n", rigid,
      similar, trimmed, outliers, with_prior);
  assert_near(rigid, 3.1, 0.5);
  assert_near(similar, 3.1, 0.5);
  // Trimmed fits have fixed points near their start, here the truth: better than the asymptotic variance.
  assert_near(trimmed, 2.6, 0.8);
  assert_at_most(outliers, 4.0);  // what was trimmed were outliers: pessimistic
  assert_at_least(outliers, 0.5);
  assert_near(with_prior, 3.0, 0.5);
  // Whole at the pivot: symmetric, positive, and the pivot in the middle of the boulders hardly tied
  // to the yaw.
  const Mat3& c = job.result().covariance;
  assert_near((c - c.transpose()).norm(), 0.0, 0.0);
  assert_at_most(std::fabs(c(0, 2)) / std::sqrt(c(0, 0) * c(2, 2)), 0.5);
}

/// The formula of the header, inverted densely; a pivot well off the boulders, so that nothing hides.
void test_covariance_against_dense_inverse(void**) {
  Random random(16);
  const Vec2 pivot = kPivot + Vec2(-9.0, 4.0);
  for (const IcpModel model : {IcpModel::kRigid, IcpModel::kSimilarity}) {
    const int unknowns = model == IcpModel::kRigid ? 3 : 4;
    scatter_map(random, 40, 8.0, 0.8);
    see_locals(random, 25, 0.04, 1.0);
    IcpParams p = plain();
    p.model = model;
    p.trim_fraction = 0.2;
    p.sigma_pair_m = 0.001;
    (void)job.start(p, map_boulders, local_map, kTruth, pivot);
    WorkBudget all = WorkBudget::unlimited();
    (void)job.step(all);
    assert_status(job.status(), IcpStatus::kConverged);
    const IcpResult& r = job.result();
    Eigen::Matrix4d H = Eigen::Matrix4d::Zero();
    double sum = 0.0;
    for (const IcpPair& pair : r.pairs) {
      const Vec2 d =
          r.scale * (Eigen::Rotation2Dd(r.T_map_site.yaw_rad) * Vec2(local_map[pair.local].p_site_m - pivot));
      Eigen::Matrix<double, 2, 4> J;
      J << 1.0, 0.0, -d.y(), d.x(), 0.0, 1.0, d.x(), d.y();
      H += J.transpose() * J;
      const Vec2 e = r.T_map_site * pivot + d - map_boulders[pair.map].p_map_m;
      sum += e.squaredNorm();
      assert_near(pair.residual_m, e.norm(), 1e-7);
    }
    if (unknowns == 3) {
      H.row(3).setZero();
      H.col(3).setZero();
      H(3, 3) = 1.0;
    }
    assert_int_equal(r.pairs_trimmed, 5);
    const double loss = 0.8 / (0.8 + 0.2 * std::log(0.2));
    const Eigen::Matrix4d dense = H.inverse() * (sum * loss * loss / (2.0 * r.pairs_used - unknowns));
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) assert_near(r.covariance(i, k), dense(i, k), 1e-9);
    }
  }
}

// ---- extrapolation ----------------------------------------------------------------------------------------

/// Boulders along the rim of a crater, an ellipse: nearest neighbours lie across, so that plain ICP creeps
/// along the rim. The case that extrapolation was made for.
void lay_rim(Random& random) {
  map_boulders.clear();
  local_map.clear();
  const Vec2 centre = kTruth * kPivot;
  for (int i = 0; i < 2000; ++i) {
    const double a = 2.0 * kPi * i / 2000.0;
    add_map(centre + Vec2(5.0 * std::cos(a), 3.0 * std::sin(a)));
  }
  for (int i = 0; i < 200; ++i) {
    add_local(kTruth.inverse() * map_boulders[random.below(2000)].p_map_m +
              0.01 * Vec2(gauss(random), gauss(random)));
  }
}

void test_extrapolation_saves_iterations(void**) {
  Random random(20);
  int with = 0;
  int without = 0;
  int kept = 0;
  for (int trial = 0; trial < 20; ++trial) {
    lay_rim(random);
    IcpParams p = plain();
    p.max_iterations = 500;
    p.gate_start_m = p.gate_final_m = 2.0;
    p.one_to_one = false;
    const double turn = uniform(random, 0.05, 0.12) * (trial % 2 == 0 ? 1.0 : -1.0);
    const Pose2 start = moved_truth(uniform(random, -0.1, 0.1), uniform(random, -0.1, 0.1), turn);
    p.extrapolate = false;
    assert_status(run(p, start), IcpStatus::kConverged);
    const int plain_iterations = job.result().iterations;
    const Vec3 plain_error = pose_error();
    assert_int_equal(job.result().extrapolations, 0);
    // Its fixed point is one of the other too.
    const Pose2 fixed = job.result().T_map_site;
    p.extrapolate = true;
    assert_status(run(p, fixed), IcpStatus::kConverged);
    assert_near(job.result().dyaw_rad, 0.0, 1e-6);
    assert_status(run(p, start), IcpStatus::kConverged);
    assert_near((pose_error() - plain_error).norm(), 0.0, 0.01);
    with += job.result().iterations;
    without += plain_iterations;
    kept += job.result().extrapolations;
  }
  print_message("iterations on rims: %d with extrapolation (%d kept), %d without\n", with, kept, without);
  assert_at_least(kept, 20);
  assert_at_most(with, 0.8 * without);
}

/// A trial that raises the objective is taken back: from one iteration to the next it only falls.
void test_extrapolation_never_climbs(void**) {
  Random random(22);
  int trials_kept = 0;
  for (int trial = 0; trial < 30; ++trial) {
    lay_rim(random);
    // Every third boulder inside the crater, within a narrow gate once it is near: the creeping ends
    // all at once.
    for (std::size_t i = 0; i < local_map.size(); i += 3) {
      const Vec2 p = kPivot + Vec2(uniform(random, -3.0, 3.0), uniform(random, -2.0, 2.0));
      local_map[i].p_site_m = p;
      map_boulders[10 * i].p_map_m = kTruth * p;
    }
    const Pose2 start =
        moved_truth(uniform(random, -0.05, 0.05), uniform(random, -0.05, 0.05), uniform(random, -0.15, 0.15));
    IcpParams p = plain();
    p.gate_start_m = p.gate_final_m = 0.12;
    p.one_to_one = false;
    p.step_m = p.step_rad = 0.0;
    double before = 1e9;
    for (p.max_iterations = 1; p.max_iterations < 60; ++p.max_iterations) {
      const IcpStatus status = run(p, start);
      const IcpResult& r = job.result();
      const double gated = p.gate_final_m * p.gate_final_m * r.pairs_gated;
      const double objective = r.rms_m * r.rms_m * r.pairs_used + gated;
      assert_at_most(objective, before * (1.0 + 1e-12));
      before = objective;
      if (status == IcpStatus::kConverged) break;
    }
    trials_kept += job.result().extrapolations;
  }
  assert_at_least(trials_kept, 6);
}

/// In an ordinary field the same fixed point is reached, to the last digits.
void test_extrapolation_keeps_the_fixed_point(void**) {
  Random random(21);
  for (int trial = 0; trial < 40; ++trial) {
    scatter_map(random, 150, 10.0, 0.4);
    see_locals(random, 80, 0.02, 1.0);
    IcpParams p = plain();
    p.extrapolate = false;
    const Pose2 start =
        moved_truth(uniform(random, -0.1, 0.1), uniform(random, -0.1, 0.1), uniform(random, -0.03, 0.03));
    assert_status(run(p, start), IcpStatus::kConverged);
    const Vec3 plain_error = pose_error();
    p.extrapolate = true;
    assert_status(run(p, start), IcpStatus::kConverged);
    assert_near((pose_error() - plain_error).norm(), 0.0, 1e-9);
  }
}

// ---- statuses ---------------------------------------------------------------------------------------------

void good_scene() {
  Random random(30);
  scatter_map(random, 40, 8.0, 0.8);
  see_locals(random, 20, 0.02, 1.0);
}

void test_statuses(void**) {
  static IcpJob fresh;
  assert_status(fresh.status(), IcpStatus::kIdle);
  WorkBudget any(100);
  assert_int_equal(static_cast<int>(fresh.step(any)), static_cast<int>(Progress::kDone));

  good_scene();
  assert_status(fresh.start(plain(), map_boulders, local_map, kTruth, kPivot), IcpStatus::kRunning);
  assert_status(run(plain(), kTruth), IcpStatus::kConverged);

  IcpParams p = plain();
  p.max_iterations = 1;
  assert_status(run(p, moved_truth(0.1, 0.1, 0.0)), IcpStatus::kIterationLimit);
  assert_int_equal(job.result().iterations, 1);

  p = plain();
  p.min_pairs = 21;
  assert_status(run(p, kTruth), IcpStatus::kTooFewPairs);
  assert_int_equal(job.result().pairs_used, 20);
  p.min_pairs = 20;
  assert_status(run(p, kTruth), IcpStatus::kConverged);
  p.trim_fraction = 0.05;
  assert_status(run(p, kTruth), IcpStatus::kTooFewPairs);
  assert_status(run(plain(), moved_truth(900.0, 0.0, 0.0)), IcpStatus::kTooFewPairs);
  assert_int_equal(job.result().pairs_used, 0);
  assert_int_equal(job.result().pairs_gated, 20);

  p = plain();
  p.max_correction_m = 0.1;
  assert_status(run(p, moved_truth(0.2, 0.0, 0.0)), IcpStatus::kBeyondLimit);
  assert_near(job.result().dx_m, -0.2, 0.05);
  p = plain();
  p.max_correction_rad = 0.01;
  assert_status(run(p, moved_truth(0.0, 0.0, 0.03)), IcpStatus::kBeyondLimit);
  p.max_correction_rad = 0.05;
  assert_status(run(p, moved_truth(0.0, 0.0, 0.03)), IcpStatus::kConverged);
  p = plain();
  p.model = IcpModel::kSimilarity;
  p.max_scale_change = 0.02;
  Random random(31);
  see_locals(random, 20, 0.0, 1.03);
  assert_status(run(p, kTruth), IcpStatus::kBeyondLimit);
  see_locals(random, 20, 0.0, 1.01);
  assert_status(run(p, kTruth), IcpStatus::kConverged);

  local_map.clear();
  assert_status(run(plain(), kTruth), IcpStatus::kNoLocalBoulders);
  good_scene();
  map_boulders.clear();
  assert_status(run(plain(), kTruth), IcpStatus::kNoMapBoulders);
  assert_near(job.result().T_map_site.x_m, kTruth.x_m, 0.0);
  assert_int_equal(job.result().pairs.size(), 0);
}

void test_weak_geometry(void**) {
  map_boulders.clear();
  local_map.clear();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      add_map({0.1 * i, 0.1 * j});
      add_local({0.1 * i, 0.1 * j});
    }
  }
  const auto go = [](const IcpParams& p, const IcpPrior& prior) {
    (void)job.start(p, map_boulders, local_map, Pose2(), Vec2(0.0, 0.0), prior);
    WorkBudget all = WorkBudget::unlimited();
    (void)job.step(all);
    return job.status();
  };
  IcpParams p = plain();
  const double lever_m = std::sqrt(2.0 * 0.02 / 3.0);  // of a 3 x 3 raster of 0.1 m
  p.min_lever_m = lever_m * 1.001;
  assert_status(go(p, {}), IcpStatus::kWeakGeometry);
  assert_near(job.result().lever_m, lever_m, 1e-12);
  p.min_lever_m = lever_m * 0.999;
  assert_status(go(p, {}), IcpStatus::kConverged);
  // All local boulders in one place: no yaw at all, unless a prior gives it.
  map_boulders.clear();
  local_map.clear();
  for (int i = 0; i < 4; ++i) add_local({0.0, 0.0});
  add_map({0.05, 0.0});
  p.min_lever_m = 0.0;
  p.one_to_one = false;
  assert_status(go(p, {}), IcpStatus::kWeakGeometry);
  assert_near(job.result().covariance.norm(), 0.0, 0.0);
  assert_status(go(p, {true, 1.0, 0.02}), IcpStatus::kConverged);
  assert_near(job.result().dyaw_rad, 0.0, 1e-15);
  assert_near(job.result().dx_m, 0.05, 1e-3);
  assert_near(std::sqrt(job.result().covariance(2, 2)), 0.02, 1e-9);
}

void test_single_pair_with_a_prior(void**) {
  map_boulders.clear();
  local_map.clear();
  add_map({1.0, 0.0});
  add_local({1.1, 0.0});
  IcpParams p = plain();
  p.min_lever_m = 0.0;
  p.min_pairs = 1;
  p.sigma_pair_m = 0.1;
  (void)job.start(p, map_boulders, local_map, Pose2(), Vec2(0.0, 0.0), {true, 0.1, 0.02});
  WorkBudget all = WorkBudget::unlimited();
  (void)job.step(all);
  assert_status(job.status(), IcpStatus::kConverged);
  assert_near(job.result().dx_m, -0.05, 1e-9);  // prior and pair weigh the same
  assert_near(std::sqrt(job.result().covariance(0, 0)), 0.1 / std::sqrt(2.0), 1e-9);
}

/// A similarity without one-to-one pairs can shrink onto few map boulders: it must be named, not used.
void test_collapsing_similarity(void**) {
  Random random(32);
  map_boulders.clear();
  local_map.clear();
  for (int i = 0; i < 30; ++i) add_local({uniform(random, -3.0, 3.0), uniform(random, -3.0, 3.0)});
  for (int i = 0; i < 3; ++i) add_map({0.2 * i, 0.1 * i * i});
  IcpParams p = plain();
  p.model = IcpModel::kSimilarity;
  p.one_to_one = false;
  p.gate_start_m = p.gate_final_m = 10.0;
  (void)job.start(p, map_boulders, local_map, Pose2(), Vec2(0.0, 0.0));
  WorkBudget all = WorkBudget::unlimited();
  (void)job.step(all);
  assert_status(job.status(), IcpStatus::kBeyondLimit);
}

IcpStatus start_with(const IcpParams& p) { return job.start(p, map_boulders, local_map, kTruth, kPivot); }

void test_bad_input(void**) {
  good_scene();
  const double bad[] = {NAN, INFINITY, -INFINITY};
  for (const double v : bad) {
    assert_status(job.start(plain(), map_boulders, local_map, {v, 0.0, 0.0}, kPivot), IcpStatus::kBadInput);
    assert_status(job.start(plain(), map_boulders, local_map, {0.0, 0.0, v}, kPivot), IcpStatus::kBadInput);
    assert_status(job.start(plain(), map_boulders, local_map, kTruth, {0.0, v}), IcpStatus::kBadInput);
    assert_status(job.start(plain(), map_boulders, local_map, kTruth, kPivot, {true, v, 0.1}),
                  IcpStatus::kBadInput);
    assert_status(job.start(plain(), map_boulders, local_map, kTruth, kPivot, {true, 0.1, v}),
                  IcpStatus::kBadInput);
    map_boulders[3].p_map_m.x() = v;
    assert_status(run(plain(), kTruth), IcpStatus::kBadInput);
    good_scene();
    map_boulders[3].diameter_m = static_cast<float>(v);
    assert_status(run(plain(), kTruth), IcpStatus::kBadInput);
    good_scene();
    local_map[3].p_site_m.y() = v;
    assert_status(start_with(plain()), IcpStatus::kBadInput);
    good_scene();
    local_map[3].diameter_m = static_cast<float>(v);
    assert_status(start_with(plain()), IcpStatus::kBadInput);
    good_scene();
  }
  WorkBudget any(100);
  assert_int_equal(static_cast<int>(job.step(any)), static_cast<int>(Progress::kDone));
  local_map[0].p_site_m.x() = 1.1e7;
  assert_status(start_with(plain()), IcpStatus::kBadInput);
  good_scene();
  assert_status(run(plain(), kTruth), IcpStatus::kConverged);  // the next good call works again
}

/// Each parameter at its bounds and just outside.
void test_parameter_bounds(void**) {
  good_scene();
  struct Bound {
    double IcpParams::*member;
    double low;
    double high;
  };
  const Bound bounds[] = {
      {&IcpParams::trim_fraction, 0.0, 0.8},      {&IcpParams::min_lever_m, 0.0, 1e3},
      {&IcpParams::sigma_pair_m, 1e-6, 1e3},      {&IcpParams::step_m, 0.0, 1.0},
      {&IcpParams::step_rad, 0.0, 1.0},           {&IcpParams::max_correction_m, 0.0, 1e6},
      {&IcpParams::max_correction_rad, 0.0, kPi}, {&IcpParams::max_scale_change, 0.0, 0.5},
      {&IcpParams::gate_final_m, 1e-3, 0.6},      {&IcpParams::gate_start_m, 0.25, 1e3},
      {&IcpParams::gate_shrink, 0.01, 0.99},      {&IcpParams::max_size_ratio, 1.0, 1e6},
  };
  for (const Bound& b : bounds) {
    IcpParams p;
    p.gate_start_m = 0.6;
    p.gate_final_m = 0.25;
    p.*b.member = b.low;
    assert_status(start_with(p), IcpStatus::kRunning);
    p.*b.member = b.high;
    assert_status(start_with(p), IcpStatus::kRunning);
    p.*b.member = b.low - 1e-7 - 1e-9 * std::fabs(b.low);
    if (b.member != &IcpParams::sigma_pair_m) assert_status(start_with(p), IcpStatus::kBadInput);
    p.*b.member = b.high * (1.0 + 1e-9) + (b.member == &IcpParams::gate_shrink ? 0.011 : 0.0);
    assert_status(start_with(p), IcpStatus::kBadInput);
    p.*b.member = NAN;
    assert_status(start_with(p), IcpStatus::kBadInput);
  }
  IcpParams p = plain();
  p.max_size_ratio = 0.0;
  assert_status(start_with(p), IcpStatus::kRunning);
  p.sigma_pair_m = 0.0;
  assert_status(start_with(p), IcpStatus::kBadInput);
  p = plain();
  p.gate_final_m = 0.4;  // asks to shrink, but never does
  assert_status(start_with(p), IcpStatus::kBadInput);
  const int iterations[][2] = {{0, 0}, {1, 1}, {1000, 1}, {1001, 0}};
  for (const auto& c : iterations) {
    p = plain();
    p.max_iterations = c[0];
    assert_status(start_with(p), c[1] != 0 ? IcpStatus::kRunning : IcpStatus::kBadInput);
  }
  const int most = static_cast<int>(cfg::kMaxLocalBoulders);
  const int pairs[][2] = {{1, 0}, {2, 1}, {most, 1}, {most + 1, 0}};
  for (const auto& c : pairs) {
    p = plain();
    p.min_pairs = c[0];
    assert_status(start_with(p), c[1] != 0 ? IcpStatus::kRunning : IcpStatus::kBadInput);
  }
  p = plain();
  p.model = static_cast<IcpModel>(7);
  assert_status(start_with(p), IcpStatus::kBadInput);
}

// ---- slicing ----------------------------------------------------------------------------------------------

void assert_same_result(const IcpResult& a, const IcpResult& b) {
  assert_memory_equal(&a.T_map_site, &b.T_map_site, sizeof a.T_map_site);
  assert_memory_equal(&a.scale, &b.scale, sizeof a.scale);
  assert_memory_equal(a.covariance.data(), b.covariance.data(), 9 * sizeof(double));
  assert_memory_equal(&a.rms_m, &b.rms_m, sizeof a.rms_m);
  assert_memory_equal(&a.dx_m, &b.dx_m, 3 * sizeof(double));
  assert_int_equal(a.iterations, b.iterations);
  assert_int_equal(a.extrapolations, b.extrapolations);
  assert_int_equal(a.pairs.size(), b.pairs.size());
  assert_memory_equal(a.pairs.data(), b.pairs.data(), a.pairs.size() * sizeof(IcpPair));
}

void test_same_bits_for_every_slicing(void**) {
  Random random(40);
  scatter_map(random, 600, 20.0, 0.3);
  see_locals(random, 90, 0.04, 1.0);
  const Pose2 start = moved_truth(0.15, -0.1, 0.02);
  for (const IcpModel model : {IcpModel::kRigid, IcpModel::kSimilarity}) {
    IcpParams p;
    p.model = model;
    const IcpPrior prior{model == IcpModel::kRigid, 0.2, 0.05};
    assert_status(run(p, start, prior), IcpStatus::kConverged);
    for (const std::uint32_t ops : {1U, 7U, 333U, 10007U, 100000U}) {
      (void)other_job.start(p, map_boulders, local_map, start, kPivot, prior);
      int steps = 0;
      for (; steps < 1000000; ++steps) {
        WorkBudget slice(ops + static_cast<std::uint32_t>(steps % 3));
        if (other_job.step(slice) == Progress::kDone) break;
      }
      if (ops == 1U) assert_at_least(steps, 300);
      assert_status(other_job.status(), job.status());
      assert_same_result(other_job.result(), job.result());
    }
  }
}

/// A start in the middle of another registration leaves no trace of it.
void test_restart_midway(void**) {
  Random random(41);
  lay_rim(random);
  IcpParams p = plain();
  p.max_iterations = 500;
  p.gate_start_m = p.gate_final_m = 2.0;
  p.one_to_one = false;
  const Pose2 start = moved_truth(0.05, 0.05, 0.1);
  assert_status(run(p, start), IcpStatus::kConverged);
  assert_at_least(job.result().extrapolations, 1);
  for (std::uint32_t share = 1; share <= 60; ++share) {
    (void)other_job.start(p, map_boulders, local_map, moved_truth(-0.05, 0.0, -0.12), kPivot);
    WorkBudget part(share * 100000U);
    (void)other_job.step(part);
    (void)other_job.start(p, map_boulders, local_map, start, kPivot);
    WorkBudget all = WorkBudget::unlimited();
    (void)other_job.step(all);
    assert_status(other_job.status(), IcpStatus::kConverged);
    assert_same_result(other_job.result(), job.result());
  }
}

// ---- real boulder fields ----------------------------------------------------------------------------------

std::vector<double> numbers_in(const std::string& text) {
  std::vector<double> numbers;
  const char* p = text.c_str();
  while (*p != '\0') {
    char* end = nullptr;
    const double v = std::strtod(p, &end);
    if (end == p) {
      ++p;
    } else {
      numbers.push_back(v);
      p = end;
    }
  }
  return numbers;
}

/// Adds a detection to the local map: into the mean of the boulder within 0.25 m, or as a new one.
void merge_detection(const Vec2& p) {
  for (LocalBoulder& b : local_map) {
    if ((b.p_site_m - p).norm() > 0.25) continue;
    ++b.sightings;
    b.p_site_m += (p - b.p_site_m) / b.sightings;
    return;
  }
  if (local_map.full()) return;
  add_local(p);
  local_map.back().sightings = 1;
}

void keep_seen_twice() {
  std::size_t kept = 0;
  for (const LocalBoulder& b : local_map) {
    if (b.sightings >= 2) local_map[kept++] = b;
  }
  local_map.resize(kept);
}

struct Tally {
  int tried = 0;
  int converged = 0;
  int good = 0;
  double sum2 = 0.0;
  double sum2_yaw = 0.0;
};

void register_drifted(const Vec2& rover, Random& random, Tally& tally) {
  // The detections stand where they truly are: site = map, and the drift is in the prior.
  const double yaw = uniform(random, -0.035, 0.035);
  const Vec2 at = rover + Vec2(uniform(random, -0.25, 0.25), uniform(random, -0.25, 0.25));
  Pose2 start{0.0, 0.0, yaw};
  const Vec2 t = at - start * rover;
  start = {t.x(), t.y(), yaw};
  const IcpParams p;
  (void)job.start(p, map_boulders, local_map, start, rover, {true, 0.15, 0.02});
  WorkBudget all = WorkBudget::unlimited();
  (void)job.step(all);
  ++tally.tried;
  if (job.status() != IcpStatus::kConverged) return;
  ++tally.converged;
  const double e = (job.result().T_map_site * rover - rover).norm();
  tally.sum2 += e * e;
  tally.sum2_yaw += job.result().T_map_site.yaw_rad * job.result().T_map_site.yaw_rad;
  if (e <= 0.10 && std::fabs(job.result().T_map_site.yaw_rad) <= 0.035) ++tally.good;
}

Tally lac_traverse(const std::string& path, Random& random) {
  Tally tally;
  cairn::test::TextFile in(path);
  std::string line;
  (void)in.line(line);
  local_map.clear();
  int frames = 0;
  Vec2 rover(0.0, 0.0);
  while (in.line(line)) {
    const std::vector<double> v = numbers_in(line);  // frame, x, y, z, detections, then x, y, z of each
    if (v.size() < 5 || v[4] == 0.0) continue;
    rover = Vec2(v[1], v[2]);
    for (std::size_t i = 5; i + 2 < v.size(); i += 3) merge_detection({v[i], v[i + 1]});
    if (++frames % 30 != 0) continue;
    keep_seen_twice();
    if (local_map.size() >= 8) register_drifted(rover, random, tally);
    local_map.clear();
  }
  return tally;
}

void test_lunar_traverses(void**) {
  const std::string folder = cairn::test::find_data("lac_registration");
  SKIP_WITHOUT(folder, "lac_registration");
  Random random(50);
  map_boulders.clear();
  cairn::test::TextFile rocks(folder + "/gt_rocks_x_y_z.csv");
  std::string line;
  (void)rocks.line(line);
  while (rocks.line(line)) {
    const std::vector<double> v = numbers_in(line);
    if (v.size() == 3) add_map({v[0], v[1]});
  }
  assert_int_equal(map_boulders.size(), 1728);
  Tally sum;
  for (const char* name : {"1", "3", "5", "7", "9", "11", "13", "15", "17"}) {
    const Tally t = lac_traverse(folder + "/traverse_" + name + ".csv", random);
    sum.tried += t.tried;
    sum.converged += t.converged;
    sum.good += t.good;
    sum.sum2 += t.sum2;
    sum.sum2_yaw += t.sum2_yaw;
  }
  print_message(
      "lunar traverses: %d windows, %d converged, %d within 0.10 m and 2 degrees; rms %.3f m %.4f rad\n",
      sum.tried, sum.converged, sum.good, std::sqrt(sum.sum2 / sum.converged),
      std::sqrt(sum.sum2_yaw / sum.converged));
  assert_at_least(sum.tried, 50);
  assert_at_least(sum.converged, 0.9 * sum.tried);
  assert_at_least(sum.good, 0.85 * sum.converged);
}

void test_martian_field(void**) {
  const std::string path = cairn::test::find_data("oracles/rosco/ESP_046282_Rocks_north_bot.txt");
  SKIP_WITHOUT(path, "oracles/rosco");
  static std::vector<Vec3> field;  // x, y, diameter, metres
  cairn::test::TextFile in(path);
  std::string line;
  while (in.line(line)) {
    const std::vector<double> v = numbers_in(line);
    if (line[0] != '%' && v.size() >= 13) field.emplace_back(0.273 * v[5], -0.273 * v[6], 0.273 * v[11]);
  }
  assert_at_least(field.size(), 12000);
  Random random(51);
  int tried = 0;
  int good = 0;
  for (int trial = 0; trial < 2000 && tried < 60; ++trial) {
    const Vec3 at = field[random.below(static_cast<std::uint32_t>(field.size()))];
    const Pose2 truth = moved_truth(at.x() - (kTruth * kPivot).x(), at.y() - (kTruth * kPivot).y(), 0.0);
    map_boulders.clear();
    local_map.clear();
    for (const Vec3& rock : field) {
      const Vec2 p = rock.head<2>();
      const double range = (p - at.head<2>()).norm();
      if (range < 400.0 && !map_boulders.full()) add_map(p, rock.z());
      if (range < 150.0 && random.below(10) < 7 && !local_map.full()) {
        add_local(truth.inverse() * p + 0.3 * Vec2(gauss(random), gauss(random)), rock.z());
      }
    }
    if (local_map.size() < 15) continue;
    for (std::size_t i = 0, n = local_map.size(); i < n / 5; ++i) {
      add_local(kPivot + 150.0 * Vec2(uniform(random, -1.0, 1.0), uniform(random, -1.0, 1.0)), 1.0);
    }
    IcpParams p;
    p.gate_start_m = 8.0;
    p.gate_final_m = 2.0;
    p.sigma_pair_m = 0.3;
    p.max_correction_m = 20.0;
    p.max_iterations = 80;
    ++tried;
    Pose2 start = truth;
    start.x_m += uniform(random, -2.0, 2.0);
    start.y_m += uniform(random, -2.0, 2.0);
    if (run(p, start) != IcpStatus::kConverged) continue;
    if ((job.result().T_map_site * kPivot - truth * kPivot).norm() <= 0.4) ++good;
  }
  print_message("Martian field: %d of %d within 0.4 m\n", good, tried);
  assert_at_least(tried, 50);
  assert_at_least(good, 0.9 * tried);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_recovers_rigid_exactly),
      cmocka_unit_test(test_recovers_similarity_exactly),
      cmocka_unit_test(test_perfect_start_converges_at_once),
      cmocka_unit_test(test_noise_outliers_and_clutter),
      cmocka_unit_test(test_closed_forms_against_umeyama),
      cmocka_unit_test(test_prior_against_gauss_newton),
      cmocka_unit_test(test_prior_holds_the_yaw_of_clumped_pairs),
      cmocka_unit_test(test_grid_equals_brute_force),
      cmocka_unit_test(test_one_to_one_and_trim),
      cmocka_unit_test(test_gate_at_its_corner),
      cmocka_unit_test(test_gate_narrows),
      cmocka_unit_test(test_covariance_against_monte_carlo),
      cmocka_unit_test(test_covariance_against_dense_inverse),
      cmocka_unit_test(test_extrapolation_saves_iterations),
      cmocka_unit_test(test_extrapolation_never_climbs),
      cmocka_unit_test(test_extrapolation_keeps_the_fixed_point),
      cmocka_unit_test(test_statuses),
      cmocka_unit_test(test_weak_geometry),
      cmocka_unit_test(test_single_pair_with_a_prior),
      cmocka_unit_test(test_collapsing_similarity),
      cmocka_unit_test(test_bad_input),
      cmocka_unit_test(test_parameter_bounds),
      cmocka_unit_test(test_same_bits_for_every_slicing),
      cmocka_unit_test(test_restart_midway),
      cmocka_unit_test(test_lunar_traverses),
      cmocka_unit_test(test_martian_field),
  };
  return cmocka_run_group_tests_name("registration/icp", tests, nullptr, nullptr);
}
