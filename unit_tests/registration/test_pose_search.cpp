// Search and verdict together: the pose from far off, wrong maps and lattices declined,
// each status, slicing.
#include "registration/pose_search.hpp"

#include <cmath>
#include <limits>

#include "core/random.hpp"
#include "support/cmocka.hpp"
#include "support/noise.hpp"
#include "support/slices.hpp"

using namespace cairn;
using test::normal;
using test::uniform;

namespace {

PoseSearchJob job;
PoseSearchJob other_job;
MapBoulders map_boulders;
LocalMap local_map;

const Vec2 kPivot(12.0, -7.0);
const Pose2 kTruth{40.0, 55.0, 0.8};

struct World {
  double per_m2 = 1.0;
  double window_m = 12.0;
  int truths = 18;
  int others = 8;
  double see_m = 4.0;
  double noise_m = 0.045;
  double lattice_jitter_m = -1.0;  ///< -1: scattered
};

/// Map about the true pivot and what is seen there. The window is about where the rover thinks it is.
void lay(Random& random, const World& world, const Vec2& think_off) {
  map_boulders.clear();
  local_map.clear();
  const Vec2 centre = kTruth * kPivot;
  const double half = world.window_m + 8.0;
  const double spacing = 1.0 / std::sqrt(world.per_m2);
  const int side = static_cast<int>(2.0 * half / spacing);
  const Pose2 T_site_map = kTruth.inverse();
  int truths = world.truths;
  for (int i = 0; i < side * side; ++i) {
    Vec2 p(uniform(random, -half, half), uniform(random, -half, half));
    if (world.lattice_jitter_m >= 0.0) {
      p = Vec2(i % side * spacing - half, i / side * spacing - half) +
          world.lattice_jitter_m * Vec2(normal(random), normal(random));
    }
    if ((p - think_off).norm() <= world.window_m) {
      MapBoulder b;
      b.p_map_m = centre + p;
      assert_true(map_boulders.push_back(b));
    }
    if (p.norm() > world.see_m || truths == 0 || random.below(3) == 0) continue;
    --truths;
    LocalBoulder b;
    b.p_site_m = T_site_map * Vec2(centre + p) + world.noise_m * Vec2(normal(random), normal(random));
    assert_true(local_map.push_back(b));
  }
  for (int i = 0; i < world.others; ++i) {
    LocalBoulder b;
    b.p_site_m = kPivot + Vec2(uniform(random, -3.0, 3.0), uniform(random, -3.0, 3.0));
    assert_true(local_map.push_back(b));
  }
}

Mat3 covariance(double sigma_m, double sigma_rad) {
  return Vec3(sigma_m * sigma_m, sigma_m * sigma_m, sigma_rad * sigma_rad).asDiagonal();
}

/// The truth, the pivot moved and turned about.
Pose2 moved(const Vec2& off, double turn) {
  Pose2 prior{0.0, 0.0, kTruth.yaw_rad + turn};
  const Vec2 t = kTruth * kPivot + off - prior * kPivot;
  prior.x_m = t.x();
  prior.y_m = t.y();
  return prior;
}

SearchStatus run(const World& world, const Vec2& off, double turn, const Mat3& c,
                 const PoseSearchParams& params = PoseSearchParams()) {
  if (job.start(params, map_boulders, world.window_m, local_map, moved(off, turn), kPivot, c) ==
      SearchStatus::kRunning) {
    assert_true(test::run_whole(job));
  }
  return job.status();
}
Vec2 error() { return job.result().T_map_site * kPivot - kTruth * kPivot; }

void test_finds_the_pose_in_all_that_sigma_allows(void**) {
  Random random(1);
  for (const double sigma : {0.05, 0.3, 1.5}) {
    for (int trial = 0; trial < 6; ++trial) {
      const double a = uniform(random, -kPi, kPi);
      const Vec2 off = 3.0 * sigma * Vec2(std::cos(a), std::sin(a));
      World world;
      world.window_m = 9.0 + 5.0 * sigma;
      lay(random, world, off);
      assert_status(run(world, off, trial % 2 == 0 ? 0.05 : -0.05, covariance(sigma, 0.03)),
                    SearchStatus::kDone);
      assert_status(job.result().verdict.status, VerdictStatus::kAccepted);
      assert_true(error().norm() < 0.1);
      assert_true(error().norm() < 5.0 * std::sqrt(job.result().covariance.topLeftCorner<2, 2>().trace()));
      assert_near(job.result().T_map_site.yaw_rad, kTruth.yaw_rad, 0.03);
    }
  }
}

/// As far as the prior's reach in yaw, five sigmas of 0.1 rad; farther off nothing is looked at.
void test_reach_in_yaw(void**) {
  Random random(11);
  for (int trial = 0; trial < 8; ++trial) {
    const double side = trial % 2 == 0 ? 1.0 : -1.0;
    World world;
    lay(random, world, Vec2(0.0, 0.0));
    assert_status(run(world, Vec2(0.0, 0.0), side * 0.45, covariance(0.2, 0.1)), SearchStatus::kDone);
    assert_true(error().norm() < 0.1);
    assert_near(job.result().T_map_site.yaw_rad, kTruth.yaw_rad, 0.03);

    assert_status(run(world, Vec2(0.0, 0.0), side * 0.9, covariance(0.2, 0.1)), SearchStatus::kDone);
    assert_true(job.result().verdict.status != VerdictStatus::kAccepted);
    assert_true(job.result().verdict.status != VerdictStatus::kInconsistentWithPrior);
  }
}

/// There are no more headings than all: however uncertain yaw is beyond that, what lies outside of the
/// prior's reach is weighed the same.
void test_no_more_than_all_headings(void**) {
  Random random(13);
  World world;
  lay(random, world, Vec2(1.5, 0.0));
  double before = 0.0;
  for (const double sigma : {1.0, 2.0}) {
    assert_status(run(world, Vec2(1.5, 0.0), 0.0, covariance(0.1, sigma)), SearchStatus::kDone);
    const Evidence& e = job.result().elsewhere;
    assert_near(e.pose.x_m, -1.5, 0.1);
    assert_true(e.log_ratio > 10.0);
    if (before > 0.0) assert_near(e.log_ratio, before, 1e-9);
    before = e.log_ratio;
  }
}

/// Two rings of twelve look alike at each twelfth of a turn, about the same middle: where yaw leaves room for
/// a turn, that is another pose and as good.
void test_a_turn_is_another_pose(void**) {
  Random random(14);
  for (const double sigma_rad : {0.2, 0.03}) {
    World world;
    world.truths = 0;
    world.others = 0;
    lay(random, world, Vec2(0.0, 0.0));
    const MapBoulders scattered = map_boulders;
    const Vec2 centre = kTruth * kPivot;
    const Pose2 T_site_map = kTruth.inverse();
    map_boulders.clear();
    for (const MapBoulder& b : scattered) {
      if ((b.p_map_m - centre).norm() > 4.5) assert_true(map_boulders.push_back(b));
    }
    for (int k = 0; k < 24; ++k) {
      const double a = kPi / 6.0 * (k % 12);
      MapBoulder b;
      b.p_map_m = centre + (k < 12 ? 3.0 : 1.8) * Vec2(std::cos(a), std::sin(a));
      assert_true(map_boulders.push_back(b));
      LocalBoulder l;
      l.p_site_m = T_site_map * b.p_map_m + 0.03 * Vec2(normal(random), normal(random));
      assert_true(local_map.push_back(l));
    }
    assert_status(run(world, Vec2(0.0, 0.0), 0.0, covariance(0.1, sigma_rad)), SearchStatus::kDone);
    const VerdictStatus v = job.result().verdict.status;
    assert_true(sigma_rad > 0.1 ? v == VerdictStatus::kAmbiguous || v == VerdictStatus::kChanceAgreement
                                : v == VerdictStatus::kAccepted);
  }
}

/// What is seen stands on the map twice, among so many poor rivals that not all are kept: the two must be.
void test_the_best_are_kept(void**) {
  Random random(15);
  for (int trial = 0; trial < 10; ++trial) {
    World world;
    world.per_m2 = 2.0;
    lay(random, world, Vec2(0.0, 0.0));
    for (int k = 0; k < world.truths; ++k) {
      MapBoulder b;
      b.p_map_m = kTruth * local_map[static_cast<std::size_t>(k)].p_site_m + Vec2(1.2, 0.5) +
                  world.noise_m * Vec2(normal(random), normal(random));
      assert_true(map_boulders.push_back(b));
    }
    assert_status(run(world, Vec2(0.0, 0.0), 0.0, covariance(0.5, 0.1)), SearchStatus::kDone);
    assert_true(job.result().best.log_ratio > 5.0);
    assert_true(job.result().verdict.second_log_ratio > 5.0);
  }
}

/// Each two local boulders that are 0.5 to 2 rms radii apart make one pair, be their number odd or even.
void test_each_pair_once(void**) {
  Random random(12);
  PoseSearchParams params;
  params.max_pairs = 4096;
  for (const std::size_t n : {5U, 6U, 7U, 8U, 12U}) {
    World world;
    lay(random, world, Vec2(0.0, 0.0));
    local_map.clear();
    while (local_map.size() < n) {
      LocalBoulder b;
      b.p_site_m = kPivot + Vec2(uniform(random, -3.0, 3.0), uniform(random, -3.0, 3.0));
      bool apart = true;
      for (const LocalBoulder& other : local_map) apart = apart && (other.p_site_m - b.p_site_m).norm() > 0.6;
      if (apart) assert_true(local_map.push_back(b));
    }
    Vec2 middle(0.0, 0.0);
    for (const LocalBoulder& b : local_map) middle += b.p_site_m / static_cast<double>(n);
    double rms2 = 0.0;
    for (const LocalBoulder& b : local_map)
      rms2 += (b.p_site_m - middle).squaredNorm() / static_cast<double>(n);
    int pairs = 0;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) {
        const double length2 = (local_map[i].p_site_m - local_map[j].p_site_m).squaredNorm();
        if (length2 >= 0.25 * rms2 && length2 <= 4.0 * rms2) ++pairs;
      }
    }
    assert_status(run(world, Vec2(0.0, 0.0), 0.0, covariance(0.3, 0.03), params), SearchStatus::kDone);
    assert_int_equal(job.result().sightings, n);
    assert_int_equal(job.result().pairs, pairs);
  }
}

void test_other_ground_is_declined(void**) {
  Random random(2);
  for (int trial = 0; trial < 40; ++trial) {
    World world;
    world.per_m2 = trial % 2 == 0 ? 0.5 : 2.0;
    lay(random, world, Vec2(0.0, 0.0));
    const LocalMap elsewhere = local_map;
    lay(random, world, Vec2(0.0, 0.0));
    local_map = elsewhere;
    assert_status(run(world, Vec2(0.0, 0.0), 0.0, covariance(0.5, 0.03)), SearchStatus::kDone);
    assert_true(job.result().verdict.status != VerdictStatus::kAccepted);
  }
}

/// A lattice agrees with itself at every cell, whether or not the place is right: told by the decoys where
/// the prior leaves one cell alone, by the second best where it leaves more.
void test_lattices_are_declined(void**) {
  Random random(3);
  for (const double sigma : {0.1, 0.5}) {
    int chance = 0;
    for (int trial = 0; trial < 10; ++trial) {
      World world;
      world.lattice_jitter_m = 0.02;
      lay(random, world, Vec2(0.0, 0.0));
      const LocalMap elsewhere = local_map;
      if (trial % 2 == 0) lay(random, world, Vec2(0.0, 0.0));
      local_map = elsewhere;
      assert_status(run(world, Vec2(0.0, 0.0), 0.0, covariance(sigma, 0.01)), SearchStatus::kDone);
      const VerdictStatus v = job.result().verdict.status;
      assert_true(v == VerdictStatus::kChanceAgreement || v == VerdictStatus::kAmbiguous);
      chance += v == VerdictStatus::kChanceAgreement ? 1 : 0;
    }
    assert_true(sigma > 0.2 ? chance < 5 : chance > 5);
  }
}

/// The rover is 1.5 m from where it claims to be within 0.1 m: never accepted, and the search says
/// where it is.
void test_a_wrong_claim_is_told(void**) {
  Random random(4);
  World world;
  lay(random, world, Vec2(1.5, 0.0));
  assert_status(run(world, Vec2(1.5, 0.0), 0.0, covariance(0.1, 0.02)), SearchStatus::kDone);
  assert_status(job.result().verdict.status, VerdictStatus::kInconsistentWithPrior);
  const Evidence& e = job.result().elsewhere;
  assert_near(e.pose.x_m, -1.5, 0.1);
  assert_true(e.log_ratio > 20.0);
  // Just outside: the fix itself is inconsistent.
  lay(random, world, Vec2(0.6, 0.0));
  assert_status(run(world, Vec2(0.6, 0.0), 0.0, covariance(0.1, 0.02)), SearchStatus::kDone);
  assert_status(job.result().verdict.status, VerdictStatus::kInconsistentWithPrior);
}

/// A lever long enough for a scale to show, and boulders few enough for it to cost nothing.
const World kSeenFar = [] {
  World world;
  world.per_m2 = 0.3;
  world.truths = 20;
  world.see_m = 6.0;
  return world;
}();

/// A map 4 % too large is said to be so, whether its scale is free from the start or asked about in the end;
/// a map whose metre is one is not.
void test_scale_is_said(void**) {
  Random random(5);
  World world = kSeenFar;
  world.per_m2 = 0.5;
  lay(random, world, Vec2(0.0, 0.0));
  const Vec2 about = kTruth * kPivot;
  for (MapBoulder& b : map_boulders) b.p_map_m = about + 1.04 * (b.p_map_m - about);
  PoseSearchParams params;
  params.evidence.scale_sigma = 0.03;
  assert_status(run(world, Vec2(0.0, 0.0), 0.0, covariance(0.3, 0.02), params), SearchStatus::kDone);
  assert_status(job.result().verdict.status, VerdictStatus::kAccepted);
  assert_near(job.result().scale, 1.04, 4.0 * job.result().scale_sigma);
  assert_true(error().norm() < 0.1);
  int said = 0;
  for (int k = 0; k < 20; ++k) {
    world.per_m2 = 0.3;
    lay(random, world, Vec2(0.0, 0.0));
    assert_status(run(world, Vec2(0.0, 0.0), 0.0, covariance(0.3, 0.02)), SearchStatus::kDone);
    assert_status(job.result().verdict.status, VerdictStatus::kAccepted);
    assert_true(std::fabs(job.result().scale - 1.0) <= 4.0 * job.result().scale_sigma);
    const Vec2 centre = kTruth * kPivot;
    for (MapBoulder& b : map_boulders) b.p_map_m = centre + 1.03 * (b.p_map_m - centre);
    assert_status(run(world, Vec2(0.0, 0.0), 0.0, covariance(0.3, 0.02)), SearchStatus::kDone);
    if (job.result().verdict.status != VerdictStatus::kAccepted) continue;
    assert_true(error().norm() < 0.1);
    if (job.result().scale_sigma == 0.0) continue;
    assert_near(job.result().scale, 1.03, 4.0 * job.result().scale_sigma);
    ++said;
  }
  assert_at_least(said, 15);
}

/// The length to a boulder that is badly placed tells no scale: none is looked at that the prior rules out.
void test_a_badly_placed_boulder_tells_no_scale(void**) {
  Random random(17);
  PoseSearchParams params;
  params.evidence.scale_sigma = 0.03;
  for (int k = 0; k < 40; ++k) {
    lay(random, kSeenFar, Vec2(0.0, 0.0));
    local_map[0].sigma_m = 0.8F;
    assert_status(run(kSeenFar, Vec2(0.0, 0.0), 0.0, covariance(1.0, 0.05), params), SearchStatus::kDone);
    assert_near(job.result().scale, 1.0, 5.0 * params.evidence.scale_sigma);
  }
}

/// Of a map whose metre is one a scale is told once in fifty times at most.
void test_no_scale_of_its_own(void**) {
  Random random(16);
  int said = 0;
  for (int k = 0; k < 100; ++k) {
    lay(random, kSeenFar, Vec2(0.0, 0.0));
    assert_status(run(kSeenFar, Vec2(0.0, 0.0), 0.0, covariance(0.3, 0.02)), SearchStatus::kDone);
    said += job.result().scale_sigma > 0.0 ? 1 : 0;
  }
  print_message("a scale told of %d maps of 100\n", said);
  assert_at_most(said, 2);
}

void test_statuses(void**) {
  Random random(6);
  World world;
  lay(random, world, Vec2(0.0, 0.0));
  const Mat3 c = covariance(0.3, 0.02);
  assert_status(run(world, Vec2(0.0, 0.0), 0.0, covariance(3.0, 0.02)), SearchStatus::kNoSearchRoom);
  World narrow = world;
  narrow.window_m = 5.5;
  narrow.per_m2 = 0.05;
  const LocalMap kept = local_map;
  lay(random, narrow, Vec2(0.0, 0.0));
  local_map = kept;
  assert_status(run(narrow, Vec2(0.0, 0.0), 0.0, covariance(0.1, 0.02)), SearchStatus::kNoSearchRoom);
  map_boulders.clear();
  assert_status(run(world, Vec2(0.0, 0.0), 0.0, c), SearchStatus::kNoMapBoulders);
  lay(random, world, Vec2(0.0, 0.0));
  local_map.resize(1);
  assert_status(run(world, Vec2(0.0, 0.0), 0.0, c), SearchStatus::kNoLocalBoulders);
  // Two boulders that agree with nothing.
  local_map.resize(2);
  local_map[0].p_site_m = kPivot;
  local_map[1].p_site_m = kPivot + Vec2(0.6, 0.0);
  map_boulders.resize(60);
  assert_status(run(world, Vec2(0.0, 0.0), 0.0, c), SearchStatus::kDone);
  const VerdictStatus v = job.result().verdict.status;
  assert_true(v == VerdictStatus::kNoHypothesis || v == VerdictStatus::kTooLittleEvidence);
}

void test_bad_input(void**) {
  Random random(7);
  World world;
  lay(random, world, Vec2(0.0, 0.0));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Mat3 c = covariance(0.3, 0.02);
  assert_status(run(world, Vec2(nan, 0.0), 0.0, c), SearchStatus::kBadInput);
  assert_status(run(world, Vec2(0.0, 0.0), nan, c), SearchStatus::kBadInput);
  assert_status(run(world, Vec2(0.0, 0.0), 0.0, covariance(nan, 0.02)), SearchStatus::kBadInput);
  assert_status(run(world, Vec2(0.0, 0.0), 0.0, covariance(1e160, 0.02)), SearchStatus::kBadInput);
  assert_status(run(world, Vec2(0.0, 0.0), 0.0, covariance(0.0, 0.02)), SearchStatus::kBadInput);
  PoseSearchParams params;
  params.max_pairs = 0;
  assert_status(run(world, Vec2(0.0, 0.0), 0.0, c, params), SearchStatus::kBadInput);
  params = PoseSearchParams();
  params.verdict.prior_log_odds = 20.0;
  assert_status(run(world, Vec2(0.0, 0.0), 0.0, c, params), SearchStatus::kBadInput);
  world.window_m = nan;
  assert_status(run(world, Vec2(0.0, 0.0), 0.0, c), SearchStatus::kBadInput);
  world.window_m = 12.0;
  map_boulders[3].p_map_m.y() = nan;
  assert_status(run(world, Vec2(0.0, 0.0), 0.0, c), SearchStatus::kBadInput);
  lay(random, world, Vec2(0.0, 0.0));
  local_map[2].p_site_m.x() = nan;
  assert_status(run(world, Vec2(0.0, 0.0), 0.0, c), SearchStatus::kBadInput);
}

/// The whole in one step and in tiny ones; no unit above its bound.
void same_in_slices(const World& world, const PoseSearchParams& params) {
  const Mat3 c = covariance(0.3, 0.02);
  assert_status(run(world, Vec2(0.4, 0.0), 0.02, c, params), SearchStatus::kDone);
  assert_status(other_job.start(params, map_boulders, world.window_m, local_map, moved(Vec2(0.4, 0.0), 0.02),
                                kPivot, c),
                SearchStatus::kRunning);
  std::uint64_t most = 0;
  for (bool more = true; more;) {
    WorkBudget budget(1);
    more = other_job.step(budget) == Progress::kMore;
    if (budget.spent() > most) most = budget.spent();
  }
  const std::uint32_t sorting = PoseSearchJob::sort_ops(cfg::kMaxLocalBoulders);
  assert_at_most(most, sorting > 5000 ? sorting : 5000);
  const SearchResult& a = job.result();
  const SearchResult& b = other_job.result();
  assert_true(a.T_map_site.x_m == b.T_map_site.x_m && a.T_map_site.yaw_rad == b.T_map_site.yaw_rad);
  assert_true(a.covariance == b.covariance);
  assert_true(a.verdict.log_ratio == b.verdict.log_ratio && a.verdict.chance_log == b.verdict.chance_log);
  assert_int_equal(a.looks, b.looks);
}

void test_slices_give_the_same(void**) {
  Random random(8);
  World world;
  lay(random, world, Vec2(0.4, 0.0));
  same_in_slices(world, PoseSearchParams());
}

/// Two thousand of the map's boulders in one place, and as many local ones as there may be.
void test_slices_of_a_crowd(void**) {
  Random random(9);
  World world;
  world.others = static_cast<int>(cfg::kMaxLocalBoulders) - world.truths;
  lay(random, world, Vec2(0.4, 0.0));
  for (int i = 0; i < 2000; ++i) {
    MapBoulder b;
    b.p_map_m = kTruth * kPivot + Vec2(1.0 + 0.02 * normal(random), 0.02 * normal(random));
    assert_true(map_boulders.push_back(b));
  }
  PoseSearchParams params;
  params.max_pairs = 1;
  same_in_slices(world, params);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_finds_the_pose_in_all_that_sigma_allows),
      cmocka_unit_test(test_reach_in_yaw),
      cmocka_unit_test(test_no_more_than_all_headings),
      cmocka_unit_test(test_a_turn_is_another_pose),
      cmocka_unit_test(test_the_best_are_kept),
      cmocka_unit_test(test_each_pair_once),
      cmocka_unit_test(test_other_ground_is_declined),
      cmocka_unit_test(test_lattices_are_declined),
      cmocka_unit_test(test_a_wrong_claim_is_told),
      cmocka_unit_test(test_scale_is_said),
      cmocka_unit_test(test_a_badly_placed_boulder_tells_no_scale),
      cmocka_unit_test(test_no_scale_of_its_own),
      cmocka_unit_test(test_statuses),
      cmocka_unit_test(test_bad_input),
      cmocka_unit_test(test_slices_give_the_same),
      cmocka_unit_test(test_slices_of_a_crowd),
  };
  return cmocka_run_group_tests_name("registration/pose_search", tests, nullptr, nullptr);
}
