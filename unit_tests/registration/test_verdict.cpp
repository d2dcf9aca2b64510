// Verdict: the evidence against the formula written down once more, what each term of it does, the pose and
// its covariance by Monte Carlo, each status, slicing.
#include "registration/verdict.hpp"

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

Ground ground;
EvidenceJob job;
EvidenceJob other_job;
MapBoulders map_boulders;
LocalMap local_map;
Sightings seen;

const Vec2 kPivot(3.0, -2.0);
const Vec2 kCentre(40.0, 55.0);  // where the pivot is
constexpr double kYaw = 0.8;
constexpr double kWindow_m = 8.0;

void add_local(const Vec2& p_map, float diameter_m = 0.0F) {
  LocalBoulder b;
  const SinCos r = sin_cos(kYaw);
  const Vec2 d = p_map - kCentre;
  b.p_site_m = kPivot + Vec2(r.cos * d.x() + r.sin * d.y(), -r.sin * d.x() + r.cos * d.y());
  b.diameter_m = diameter_m;
  assert_true(local_map.push_back(b));
}

void lay_map(Random& random, double per_m2) {
  map_boulders.clear();
  const int count = static_cast<int>(per_m2 * kPi * kWindow_m * kWindow_m);
  while (static_cast<int>(map_boulders.size()) < count) {
    const Vec2 p(uniform(random, -kWindow_m, kWindow_m), uniform(random, -kWindow_m, kWindow_m));
    if (p.norm() > kWindow_m) continue;
    MapBoulder b;
    b.p_map_m = kCentre + p;
    assert_true(map_boulders.push_back(b));
  }
}

/// Scattered boulders in the window; `truths` of those within 5 m seen with noise, and `others`.
void lay(Random& random, double per_m2, int truths, int others, double noise_m) {
  local_map.clear();
  lay_map(random, per_m2);
  for (const MapBoulder& b : map_boulders) {
    if (truths == 0) break;
    if ((b.p_map_m - kCentre).norm() > 5.0) continue;
    add_local(b.p_map_m + noise_m * Vec2(normal(random), normal(random)));
    --truths;
  }
  assert_int_equal(truths, 0);
  while (others-- > 0) {
    add_local(kCentre + Vec2(uniform(random, -2.8, 2.8), uniform(random, -2.8, 2.8)));
  }
}

PosePrior prior_of(double sigma_m, double sigma_rad, const Hypothesis& mean) {
  const Mat3 covariance = Vec3(sigma_m * sigma_m, sigma_m * sigma_m, sigma_rad * sigma_rad).asDiagonal();
  PosePrior prior;
  assert_true(gaussian_prior(mean, covariance, prior));
  return prior;
}

bool see(const EvidenceParams& params) {
  seen.clear();
  for (std::size_t i = 0; i < local_map.size(); ++i) {
    if (sight(params, ground, local_map, i, kPivot, seen) == Sighted::kBad) return false;
  }
  return true;
}

void weigh(const EvidenceParams& params, const PosePrior& prior, const Hypothesis& from) {
  assert_status(ground.start(map_boulders, kCentre, kWindow_m, 0.05, 0.4), GridStatus::kRunning);
  assert_true(test::run_whole(ground));
  assert_true(see(params));
  assert_status(job.start(params, ground, seen, prior, from), EvidenceStatus::kRunning);
  assert_true(test::run_whole(job));
}

const Hypothesis kTruth = {0.0, 0.0, kYaw, 1.0};

// ---- the evidence -----------------------------------------------------------------------------------------

/// S as the header has it, from the pose, through all boulders.
double written_out(const EvidenceParams& params, const Hypothesis& h) {
  const std::size_t n = seen.size();
  double ratio[64] = {};
  int nearest[64] = {};
  for (std::size_t i = 0; i < n; ++i) {
    const double c = std::cos(h.yaw_rad);
    const double s = std::sin(h.yaw_rad);
    const Vec2 at(h.x_m + c * seen[i].x_m - s * seen[i].y_m, h.y_m + s * seen[i].x_m + c * seen[i].y_m);
    const double s2 = params.sigma_pair_m * params.sigma_pair_m;
    double most = 0.0;
    nearest[i] = -1;
    for (std::size_t k = 0; k < map_boulders.size(); ++k) {
      const double r2 = (map_boulders[k].p_map_m - kCentre - at).squaredNorm();
      if (r2 > 16.0 * s2) continue;
      const double part = std::exp(-r2 / (2.0 * s2)) / (2.0 * kPi * s2);
      ratio[i] += part / ground.density(at.x(), at.y());
      if (part > most) nearest[i] = static_cast<int>(k);
      if (part > most) most = part;
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < n; ++k) {
      if (i != k && nearest[i] >= 0 && nearest[i] == nearest[k] && ratio[k] > ratio[i]) ratio[i] = 0.0;
    }
  }
  double mean = 0.0;
  for (const double p : {0.25, 0.5, 0.75, 0.92}) {
    double product = 1.0;
    for (std::size_t i = 0; i < n; ++i) product *= 1.0 - p + p * ratio[i];
    mean += 0.25 * product;
  }
  return std::log(mean);
}

void test_evidence_is_the_formula(void**) {
  Random random(1);
  EvidenceParams params;
  params.sigma_pair_m = 0.05;
  for (const double density : {0.3, 1.0, 3.0}) {
    for (int trial = 0; trial < 10; ++trial) {
      lay(random, density, 12, 6, 0.045);
      const PosePrior prior = prior_of(0.2, 0.03, {0.05, -0.03, kYaw + 0.01, 1.0});
      weigh(params, prior, {0.03, 0.02, kYaw - 0.01, 1.0});
      assert_status(job.status(), EvidenceStatus::kDone);
      const Evidence& e = job.result();
      assert_near(e.S, written_out(params, e.pose), 1e-9);
      const double dx = e.pose.x_m - 0.05;
      const double dy = e.pose.y_m + 0.03;
      const double turn = e.pose.yaw_rad - kYaw - 0.01;
      assert_near(e.chi2, (dx * dx + dy * dy) / 0.04 + turn * turn / 0.0009, 1e-9);
      assert_near(e.log_ratio, e.S - 0.5 * e.chi2 + e.log_volume - prior.log_volume, 1e-12);
      assert_true(e.innovation2 >= e.chi2);
    }
  }
}

void test_volume_of_priors(void**) {
  const PosePrior prior = prior_of(0.2, 0.03, kTruth);
  assert_near(prior.log_volume, std::log(std::pow(2.0 * kPi, 1.5) * 0.2 * 0.2 * 0.03), 1e-12);
  assert_near(flat_prior(kTruth, 50.0, 0.4).log_volume, std::log(20.0), 1e-12);
  PosePrior out;
  assert_false(gaussian_prior(kTruth, Mat3::Zero(), out));
  Mat3 negative = Mat3::Identity();
  negative(0, 1) = negative(1, 0) = 2.0;
  assert_false(gaussian_prior(kTruth, negative, out));
  assert_false(gaussian_prior(kTruth, Mat3::Identity() * std::numeric_limits<double>::quiet_NaN(), out));
}

/// A prior ten times wider on each axis costs 3 ln 10 nats where the boulders hold the pose.
void test_wider_priors_cost_their_volume(void**) {
  Random random(2);
  EvidenceParams params;
  lay(random, 0.5, 14, 4, 0.0);
  weigh(params, prior_of(1.0, 0.1, kTruth), kTruth);
  const double narrow = job.result().log_ratio;
  weigh(params, prior_of(10.0, 1.0, kTruth), kTruth);
  assert_near(narrow - job.result().log_ratio, 3.0 * std::log(10.0), 0.05);
}

/// The mean of the likelihood ratio under the null is 1: scattered local boulders, at a pose held fixed.
void test_mean_ratio_of_chance_is_one(void**) {
  Random random(3);
  EvidenceParams params;
  params.sigma_pair_m = 0.1;
  double mean = 0.0;
  constexpr int kTrials = 4000;
  for (int trial = 0; trial < kTrials; ++trial) {
    lay(random, 1.0, 0, 2, 0.0);
    weigh(params, prior_of(1e-4, 1e-5, kTruth), kTruth);
    if (job.status() != EvidenceStatus::kDiverged) mean += std::exp(job.result().S) / kTrials;
  }
  assert_true(mean > 0.7 && mean < 1.3);
}

/// Two local boulders on one map boulder are not two pieces of evidence; nor are near duplicates.
void test_a_map_boulder_is_evidence_once(void**) {
  Random random(4);
  EvidenceParams params;
  lay(random, 0.3, 10, 0, 0.02);
  weigh(params, prior_of(0.2, 0.03, kTruth), kTruth);
  const double once = job.result().S;
  const LocalMap before = local_map;
  for (const LocalBoulder& b : before) {
    LocalBoulder twin = b;
    twin.p_site_m += Vec2(0.13, 0.0);  // farther than 2 sigma: a sighting of its own
    assert_true(local_map.push_back(twin));
  }
  weigh(params, prior_of(0.2, 0.03, kTruth), kTruth);
  assert_int_equal(seen.size(), 20);
  assert_true(job.result().S < once);
  local_map = before;
  for (const LocalBoulder& b : before) {
    LocalBoulder twin = b;
    twin.p_site_m += Vec2(0.05, 0.0);
    assert_true(local_map.push_back(twin));
  }
  weigh(params, prior_of(0.2, 0.03, kTruth), kTruth);
  assert_int_equal(seen.size(), 10);
  assert_near(job.result().S, once, 0.0);
}

/// Clutter costs, truths pay, and on dense ground they pay less.
void test_what_pays(void**) {
  Random random(5);
  EvidenceParams params;
  double last = 1e9;
  for (const double density : {0.5, 1.0, 2.0, 4.0}) {
    double ratio = 0.0;
    for (int trial = 0; trial < 20; ++trial) {
      lay(random, density, 16, 4, 0.045);
      weigh(params, prior_of(0.2, 0.03, kTruth), kTruth);
      ratio += job.result().log_ratio / 20.0;
    }
    assert_true(ratio > 5.0 && ratio < last);
    last = ratio;
  }
}

/// Sizes that agree are evidence, sizes that do not agree speak against.
void test_sizes(void**) {
  Random random(6);
  EvidenceParams params;
  params.size_sigma = 0.2;
  const auto sized = [&](bool right) {
    random = Random(6);
    lay(random, 2.0, 15, 0, 0.045);
    for (MapBoulder& b : map_boulders)
      b.diameter_m = static_cast<float>(0.1 * std::pow(uniform(random, 0.01, 1.0), -0.5));
    for (LocalBoulder& l : local_map) {
      const SinCos r = sin_cos(kYaw);
      const Vec2 q = l.p_site_m - kPivot;
      const Vec2 at = kCentre + Vec2(r.cos * q.x() - r.sin * q.y(), r.sin * q.x() + r.cos * q.y());
      const MapBoulder* nearest = &map_boulders[0];
      for (const MapBoulder& b : map_boulders) {
        if ((b.p_map_m - at).norm() < (nearest->p_map_m - at).norm()) nearest = &b;
      }
      l.diameter_m = nearest->diameter_m * static_cast<float>(right ? std::exp(0.15 * normal(random)) : 3.0);
    }
    weigh(params, prior_of(0.2, 0.03, kTruth), kTruth);
    return job.result().S;
  };
  const double agree = sized(true);
  const double disagree = sized(false);
  params.size_sigma = 0.0;
  const double unknown = sized(true);
  assert_true(agree > unknown + 5.0);
  assert_true(disagree < unknown - 5.0);
}

// ---- the pose ---------------------------------------------------------------------------------------------

/// 300 fixes: half of them inside the 50 % ellipsoid, 95 % inside the 95 % one, though sigma is
/// taken too large.
void test_covariance_holds(void**) {
  Random random(7);
  EvidenceParams params;
  params.sigma_pair_m = 0.06;
  int half = 0;
  int most = 0;
  constexpr int kTrials = 300;
  for (int trial = 0; trial < kTrials; ++trial) {
    lay(random, 1.0, 20, 8, 0.045);
    weigh(params, prior_of(0.5, 0.1, kTruth), {0.03, -0.03, kYaw + 0.01, 1.0});
    const Evidence& e = job.result();
    const Vec3 off(e.pose.x_m, e.pose.y_m, e.pose.yaw_rad - kYaw);
    const Mat3 c = e.covariance.topLeftCorner<3, 3>();
    const double d2 = off.dot(Vec3(c.inverse() * off));
    half += d2 <= 2.366 ? 1 : 0;
    most += d2 <= 7.815 ? 1 : 0;
  }
  assert_in_range(half, 120, 195);
  assert_in_range(most, 273, 298);
}

void test_scale_is_found(void**) {
  Random random(8);
  EvidenceParams params;
  params.scale_sigma = 0.03;
  lay(random, 0.5, 16, 4, 0.02);
  for (MapBoulder& b : map_boulders) b.p_map_m = kCentre + 1.03 * (b.p_map_m - kCentre);
  weigh(params, prior_of(0.5, 0.05, kTruth), kTruth);
  assert_status(job.status(), EvidenceStatus::kDone);
  assert_near(job.result().pose.scale, 1.03, 4.0 * std::sqrt(job.result().covariance(3, 3)));
  assert_true(job.result().covariance(3, 3) < 0.005 * 0.005);
  const double free = job.result().log_ratio;
  params.scale_sigma = 0.0;
  weigh(params, prior_of(0.5, 0.05, kTruth), kTruth);
  assert_near(job.result().pose.scale, 1.0, 0.0);
  assert_near(job.result().covariance(3, 3), 0.0, 0.0);
  assert_true(free > job.result().log_ratio + 10.0);
}

/// The expected number of true pairs, whatever the share: each by its density over that and the null's.
void test_matched_is_the_formula(void**) {
  Random random(21);
  EvidenceParams params;
  params.sigma_pair_m = 0.05;
  for (const double share : {0.1, 0.5, 0.9}) {
    params.match_share = share;
    lay(random, 2.0, 12, 8, 0.06);
    weigh(params, prior_of(0.2, 0.03, kTruth), kTruth);
    assert_status(job.status(), EvidenceStatus::kDone);
    const Hypothesis& h = job.result().pose;
    double want = 0.0;
    for (const Sighting& s : seen) {
      const double c = std::cos(h.yaw_rad);
      const double t = std::sin(h.yaw_rad);
      const Vec2 at(h.x_m + c * s.x_m - t * s.y_m, h.y_m + t * s.x_m + c * s.y_m);
      const double s2 = s.sigma_m * s.sigma_m;
      double density = 0.0;
      for (const MapBoulder& b : map_boulders) {
        const double r2 = (b.p_map_m - kCentre - at).squaredNorm();
        if (r2 <= 16.0 * s2) density += std::exp(-r2 / (2.0 * s2)) / (2.0 * kPi * s2);
      }
      want += share * density / ((1.0 - share) * ground.density(at.x(), at.y()) + share * density);
    }
    assert_near(job.result().matched, want, 1e-6);
  }
}

/// Pairs that agree better than they are said to are believed to be better, by ten degrees of freedom against
/// their own, 2 n - 3, and fourfold at the most.
void test_covariance_of_pairs_that_agree_well(void**) {
  for (const int truths : {3, 5, 8, 40}) {
    Random random(22);
    EvidenceParams params;
    params.sigma_pair_m = 0.02;
    lay(random, truths < 10 ? 0.1 : 0.6, truths, 0, 0.0);
    weigh(params, flat_prior(kTruth, 1.0, 0.1), kTruth);
    assert_status(job.status(), EvidenceStatus::kDone);
    assert_near(job.result().matched, truths, 0.02 * truths);
    Mat3 information = Mat3::Zero();
    for (const Sighting& s : seen) {
      const double x = std::cos(kYaw) * s.x_m - std::sin(kYaw) * s.y_m;
      const double y = std::sin(kYaw) * s.x_m + std::cos(kYaw) * s.y_m;
      Eigen::Matrix<double, 2, 3> H;
      H << 1.0, 0.0, -y, 0.0, 1.0, x;
      information += H.transpose() * H / (0.02 * 0.02);
    }
    const double own = 10.0 / (10.0 + 2.0 * truths - 3.0);
    const Mat3 want = (own > 0.25 ? own : 0.25) * Mat3(information.inverse());
    const Mat3 got = job.result().covariance.topLeftCorner<3, 3>();
    for (int i = 0; i < 3; ++i) assert_near(got(i, i), want(i, i), 0.03 * want(i, i));
  }
}

/// Of the fix without the prior: it lies farther off than where the prior has pulled it.
void test_innovation_is_of_the_fix_alone(void**) {
  Random random(23);
  EvidenceParams params;
  params.sigma_pair_m = 0.05;
  lay(random, 0.3, 16, 0, 0.02);
  weigh(params, flat_prior(kTruth, 1.0, 0.1), kTruth);
  const Hypothesis alone = job.result().pose;
  const PosePrior prior = prior_of(0.01, 0.002, {0.03, -0.02, kYaw + 0.004, 1.0});
  weigh(params, prior, kTruth);
  const auto from = [&](const Hypothesis& h) {
    return Vec3(h.x_m - prior.mean.x_m, h.y_m - prior.mean.y_m, h.yaw_rad - prior.mean.yaw_rad);
  };
  const Vec3 held = prior.information * from(job.result().pose);
  assert_near(job.result().chi2, from(job.result().pose).dot(held), 1e-9);
  const double want = from(alone).dot(held);  // d' (P + C)^-1 d
  assert_near(job.result().innovation2, want, 0.05 * want);
  assert_at_least(job.result().innovation2, 1.5 * job.result().chi2);
}

/// A size that is wholly wrong is a size mistaken, one in ten, and not proof of another boulder.
void test_sizes_mistaken(void**) {
  EvidenceParams params;
  params.sigma_pair_m = 0.05;
  params.size_sigma = 0.2;
  double S[2] = {};
  for (const bool known : {false, true}) {
    Random random(24);
    lay(random, 0.2, 12, 0, 0.02);
    for (MapBoulder& b : map_boulders) b.diameter_m = 0.2F;
    for (LocalBoulder& b : local_map) b.diameter_m = known ? 4.0F : 0.0F;
    weigh(params, prior_of(0.2, 0.03, kTruth), kTruth);
    S[known ? 1 : 0] = job.result().S;
  }
  assert_near(S[1] - S[0], 12.0 * std::log(0.1), 2.0);
}

void test_nothing_near_diverges(void**) {
  Random random(9);
  lay(random, 0.05, 3, 0, 0.0);
  EvidenceParams params;
  params.sigma_pair_m = 0.001;
  weigh(params, flat_prior(kTruth, 10.0, 1.0), {0.31, 0.17, kYaw + 0.2, 1.0});
  assert_status(job.status(), EvidenceStatus::kDiverged);
}

/// A refinement that ends at longer steps takes fewer passes, and scores a wrong pose nearly the same.
void test_roughly_settled(void**) {
  Random random(23);
  EvidenceParams params;
  params.sigma_pair_m = 0.05;
  EvidenceParams roughly = params;
  roughly.settled = 0.2;
  int near = 0;
  int passes = 0;
  int passes_roughly = 0;
  constexpr int kTrials = 60;
  for (int trial = 0; trial < kTrials; ++trial) {
    lay(random, 2.0, 8, 6, 0.045);
    const Hypothesis wrong = {uniform(random, 0.5, 1.0), uniform(random, 0.5, 1.0), kYaw, 1.0};
    const PosePrior anywhere = flat_prior(wrong, 10.0, 0.2);
    weigh(params, anywhere, wrong);
    const Evidence exact = job.result();
    weigh(roughly, anywhere, wrong);
    passes += exact.iterations;
    passes_roughly += job.result().iterations;
    if (std::fabs(job.result().S - exact.S) < 0.2) ++near;
  }
  assert_true(near >= kTrials * 9 / 10);
  assert_true(10 * passes_roughly < 9 * passes);
}

void test_bad_input(void**) {
  Random random(10);
  lay(random, 1.0, 5, 5, 0.0);
  const PosePrior prior = prior_of(0.2, 0.03, kTruth);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EvidenceParams params;
  weigh(params, prior, kTruth);
  for (const double bad : {nan, -1.0, 1e9}) {
    params = EvidenceParams();
    params.sigma_pair_m = bad;
    assert_status(job.start(params, ground, seen, prior, kTruth), EvidenceStatus::kBadInput);
    params = EvidenceParams();
    params.size_sigma = bad;
    assert_status(job.start(params, ground, seen, prior, kTruth), EvidenceStatus::kBadInput);
    params = EvidenceParams();
    params.scale_sigma = bad;
    assert_status(job.start(params, ground, seen, prior, kTruth), EvidenceStatus::kBadInput);
    params = EvidenceParams();
    params.match_share = bad;
    assert_status(job.start(params, ground, seen, prior, kTruth), EvidenceStatus::kBadInput);
    params = EvidenceParams();
    params.settled = bad;
    assert_status(job.start(params, ground, seen, prior, kTruth), EvidenceStatus::kBadInput);
    params = EvidenceParams();
    params.scale_sigma = 0.03;
    Hypothesis h = kTruth;
    h.scale = bad;
    assert_status(job.start(params, ground, seen, prior, h), EvidenceStatus::kBadInput);
  }
  params = EvidenceParams();
  Hypothesis h = kTruth;
  h.x_m = nan;
  assert_status(job.start(params, ground, seen, prior, h), EvidenceStatus::kBadInput);
  local_map[0].p_site_m.x() = nan;
  assert_false(see(params));
  local_map[0].p_site_m.x() = 0.0;
  local_map[0].sigma_m = static_cast<float>(nan);
  assert_false(see(params));
  const Sightings none;
  assert_status(job.start(params, ground, none, prior, kTruth), EvidenceStatus::kBadInput);
}

void test_slices_give_the_same(void**) {
  Random random(11);
  lay(random, 2.0, 15, 10, 0.045);
  const PosePrior prior = prior_of(0.2, 0.03, kTruth);
  EvidenceParams params;
  weigh(params, prior, {0.05, 0.05, kYaw, 1.0});
  assert_status(other_job.start(params, ground, seen, prior, {0.05, 0.05, kYaw, 1.0}),
                EvidenceStatus::kRunning);
  int slices = 0;
  for (bool more = true; more; ++slices) {
    WorkBudget budget(1);
    more = other_job.step(budget) == Progress::kMore;
    assert_true(budget.spent() < 20000);
  }
  assert_true(slices > 100);
  assert_near(other_job.result().log_ratio, job.result().log_ratio, 0.0);
  assert_near(other_job.result().pose.x_m, job.result().pose.x_m, 0.0);
  assert_true(other_job.result().covariance == job.result().covariance);
}

// ---- the ground -------------------------------------------------------------------------------------------

/// Half of the window twice as dense: each half's density within its counting error; beyond the map's edge
/// no ground is claimed to be empty.
void test_density_is_local(void**) {
  Random random(12);
  map_boulders.clear();
  while (map_boulders.size() < 1800) {
    const Vec2 p(uniform(random, -kWindow_m, kWindow_m), uniform(random, -kWindow_m, kWindow_m));
    if (p.x() > 0.0 && random.below(2) == 0) continue;
    if (p.y() > 4.0) continue;  // the map ends here
    MapBoulder b;
    b.p_map_m = kCentre + p;
    assert_true(map_boulders.push_back(b));
  }
  assert_status(ground.start(map_boulders, kCentre, kWindow_m, 0.05, 0.4), GridStatus::kRunning);
  assert_true(test::run_whole(ground));
  const double left = 1200.0 / (12.0 * 8.0);
  for (const double y : {-4.0, 0.0, 2.0, 3.8}) {
    assert_near(ground.density(-4.0, y), left, 0.5 * left);
    assert_near(ground.density(4.0, y), 0.5 * left, 0.3 * left);
  }
  assert_near(ground.area_m2(), 3.14159 * 64.0 * 0.804, 10.0);  // disc below y = 4 m
  assert_true(ground.size_density(0.2) == 0.0);                 // no diameters known
}

/// Crowding is about 1 on scattered ground and many times that in clusters; there a second local boulder of
/// a cluster counts for less than one by itself.
void test_clusters_count_for_less(void**) {
  Random random(13);
  EvidenceParams params;
  params.sigma_pair_m = 0.05;
  const PosePrior prior = prior_of(0.2, 0.03, kTruth);
  lay(random, 2.0, 12, 0, 0.02);
  weigh(params, prior, kTruth);
  assert_near(ground.crowding(), 1.0, 0.3);
  map_boulders.clear();
  local_map.clear();
  for (int c = 0; c < 16; ++c) {
    const Vec2 middle(uniform(random, -7.0, 7.0), uniform(random, -7.0, 7.0));
    for (int k = 0; k < 6; ++k) {
      MapBoulder b;
      b.p_map_m = kCentre + middle + 0.15 * Vec2(normal(random), normal(random));
      assert_true(map_boulders.push_back(b));
      if (c % 4 == 0) add_local(b.p_map_m);
    }
  }
  weigh(params, prior, kTruth);
  assert_true(ground.crowding() > 5.0);
  const std::size_t n = seen.size();
  const double together = job.result().S;
  for (Sighting& s : seen) s.cluster = static_cast<std::uint16_t>(&s - seen.begin());  // each by itself
  assert_status(job.start(params, ground, seen, prior, kTruth), EvidenceStatus::kRunning);
  assert_true(test::run_whole(job));
  assert_true(n > 10 && together < 0.75 * job.result().S && together > 0.3 * job.result().S);
}

/// Boulders in a row, each within reach of the next, are one cluster in whatever order they come; a row apart
/// from it is another.
void test_links_join_clusters(void**) {
  map_boulders.clear();
  local_map.clear();
  EvidenceParams params;
  params.sigma_pair_m = 0.05;
  const double link_m = 0.9 * kCrowdSigmas * params.sigma_pair_m;
  for (const int place : {0, 2, 4, 20, 1, 3, 21}) add_local(kCentre + Vec2(link_m * place, 0.0));
  Random random(3);
  lay_map(random, 0.5);
  assert_status(ground.start(map_boulders, kCentre, kWindow_m, 0.05, 0.4), GridStatus::kRunning);
  assert_true(test::run_whole(ground));
  assert_true(see(params));
  assert_int_equal(seen.size(), 7);
  for (const int i : {1, 2, 4, 5})
    assert_int_equal(seen[static_cast<std::size_t>(i)].cluster, seen[0].cluster);
  assert_int_equal(seen[6].cluster, seen[3].cluster);
  assert_true(seen[3].cluster != seen[0].cluster);
}

/// A local boulder that knows its own place worse is looked for farther off, and pulls less.
void test_own_sigma_of_a_boulder(void**) {
  Random random(5);
  EvidenceParams params;
  params.sigma_pair_m = 0.05;
  const PosePrior prior = prior_of(0.2, 0.03, kTruth);
  lay(random, 0.3, 10, 0, 0.02);
  weigh(params, prior, kTruth);
  const double exact = job.result().covariance(0, 0);
  for (LocalBoulder& b : local_map) b.sigma_m = 0.12F;
  weigh(params, prior, kTruth);
  for (const Sighting& s : seen) assert_near(s.sigma_m, 0.13, 1e-6);  // 5, 12, 13
  assert_at_least(job.result().covariance(0, 0), 2.0 * exact);
}

/// A prior whose heading is told a whole turn on is the same prior.
void test_headings_of_priors_wrap(void**) {
  Random random(6);
  EvidenceParams params;
  params.sigma_pair_m = 0.05;
  lay(random, 0.5, 12, 4, 0.03);
  weigh(params, prior_of(0.2, 0.03, kTruth), kTruth);
  const double once = job.result().log_ratio;
  weigh(params, prior_of(0.2, 0.03, {0.0, 0.0, kYaw + 2.0 * kPi, 1.0}), kTruth);
  assert_near(job.result().log_ratio, once, 1e-6);
}

// ---- the verdict ------------------------------------------------------------------------------------------

Evidence strong() {
  Evidence e;
  e.S = 40.0;
  e.log_volume = -10.0;
  e.log_ratio = 30.0;
  e.innovation2 = 3.0;
  return e;
}

void test_each_verdict(void**) {
  const VerdictParams params;
  const PosePrior prior = prior_of(0.1, 0.02, kTruth);
  Decoys none;
  none.log_volume = 1.0;
  assert_status(judge(params, strong(), -1e3, prior, none).status, VerdictStatus::kAccepted);
  Evidence e = strong();
  e.log_ratio = params.ln_threshold - params.calibration - 0.01;
  assert_status(judge(params, e, -1e3, prior, none).status, VerdictStatus::kTooLittleEvidence);
  VerdictParams confirmed;
  confirmed.prior_log_odds = 6.9;
  assert_status(judge(confirmed, e, -1e3, prior, none).status, VerdictStatus::kAccepted);
  assert_status(judge(params, strong(), 30.0 - params.second_margin + 0.01, prior, none).status,
                VerdictStatus::kAmbiguous);
  assert_status(judge(params, strong(), 30.0 - params.second_margin - 0.01, prior, none).status,
                VerdictStatus::kAccepted);
  e = strong();
  e.innovation2 = params.innovation2_limit + 0.01;
  assert_status(judge(params, e, -1e3, prior, none).status, VerdictStatus::kInconsistentWithPrior);
}

/// Boulders in view that are unrelated to the map, where those before agree: likelier the more they are.
/// Where all agree alike it speaks for the pose; with none in view it tells nothing.
void test_boulders_in_view(void**) {
  Random random(77);
  const PosePrior prior = prior_of(0.1, 0.02, kTruth);
  const VerdictParams params;
  const auto view_log = [&](int truths, int others, int true_ones_in_view, int others_in_view) {
    lay(random, 1.0, truths, others, 0.04);
    for (int i = 0; i < truths + others; ++i)
      local_map[static_cast<std::size_t>(i)].in_view =
          i < truths ? i < true_ones_in_view : i - truths < others_in_view;
    weigh(EvidenceParams(), prior, kTruth);
    return job.result();
  };
  const auto judged = [&](const Evidence& e) {
    Decoys none;
    none.log_volume = 1.0;
    return judge(params, e, -1e3, prior, none);
  };
  const Evidence slipped = view_log(14, 12, 0, 12);
  assert_true(slipped.view_log > params.view_limit);
  assert_status(judged(slipped).status, VerdictStatus::kViewDisagrees);
  assert_near(judged(slipped).view_log, slipped.view_log, 0.0);
  // Those before prove the pose, and together with those in view they don't: no want of evidence, a slip.
  Evidence outvoted = slipped;
  outvoted.log_ratio = params.ln_threshold - 0.5 * slipped.view_log;
  assert_status(judged(outvoted).status, VerdictStatus::kViewDisagrees);
  outvoted.log_ratio = params.ln_threshold - 1.5 * slipped.view_log - params.calibration;
  assert_status(judged(outvoted).status, VerdictStatus::kTooLittleEvidence);
  assert_true(view_log(14, 6, 0, 6).view_log < slipped.view_log);
  const Evidence mixed = view_log(14, 8, 6, 4);
  assert_true(mixed.view_log < 0.0);
  assert_status(judged(mixed).status, VerdictStatus::kAccepted);
  assert_near(view_log(14, 8, 0, 0).view_log, 0.0, 0.0);
  const Evidence all = view_log(14, 8, 14, 8);
  assert_near(all.view_log, -all.S, 1e-12);
}

/// Where the boulders in view are the map's as those before are, a ratio against them of t has a probability
/// of e^-t at most: Markov's inequality, over shares as the verdict has them.
void test_view_log_is_a_bound(void**) {
  Random random(78);
  const PosePrior prior = prior_of(0.1, 0.02, kTruth);
  constexpr int kTrials = 2000;
  constexpr double kShares[] = {0.25, 0.5, 0.75, 0.92};
  int beyond[3] = {};
  for (int k = 0; k < kTrials; ++k) {
    int truths = 0;
    const double share = kShares[k % 4];
    for (int i = 0; i < 18; ++i) truths += uniform(random, 0.0, 1.0) < share ? 1 : 0;
    lay(random, 1.0, truths, 18 - truths, 0.05);
    for (LocalBoulder& b : local_map) b.in_view = uniform(random, 0.0, 1.0) < 0.4;
    weigh(EvidenceParams(), prior, kTruth);
    for (int t = 1; t <= 3; ++t) beyond[t - 1] += job.result().view_log > t ? 1 : 0;
  }
  for (int t = 1; t <= 3; ++t) {
    const double most = kTrials * std::exp(-t);
    assert_true(beyond[t - 1] <= most + 3.0 * std::sqrt(most));
  }
}

/// Decoys that score as scattered boulders do change nothing; one that scores as well, or many that show a
/// long tail, do.
void test_decoys(void**) {
  const VerdictParams params;
  const PosePrior prior = prior_of(0.1, 0.02, kTruth);
  Decoys decoys;
  decoys.log_volume = 1.0;
  for (const double score : {2.0, 5.0, 7.0, 9.0}) assert_true(decoys.scores.push_back(score));
  Verdict v = judge(params, strong(), -1e3, prior, decoys);
  assert_status(v.status, VerdictStatus::kAccepted);
  assert_near(v.theta, 1.0, 0.0);
  assert_near(v.chance_log,
              40.0 - 9.0 - std::log(1.0 + std::exp(-2.0) + std::exp(-4.0) + std::exp(-7.0)) -
                  (prior.log_volume - 1.0),
              1e-9);
  assert_true(decoys.scores.push_back(39.0));
  v = judge(params, strong(), -1e3, prior, decoys);
  assert_status(v.status, VerdictStatus::kChanceAgreement);
  decoys.scores.clear();
  for (int i = 0; i < 12; ++i) assert_true(decoys.scores.push_back(16.0 + 1.5 * i));  // clusters, say
  v = judge(params, strong(), -1e3, prior, decoys);
  assert_true(v.theta > 5.0);
  assert_status(v.status, VerdictStatus::kChanceAgreement);
}

/// The distance from the prior takes off what decoys are held against, and is why a fix off the prior is told
/// as such though its ratio is too low.
void test_distance_from_the_prior(void**) {
  const VerdictParams params;
  const PosePrior prior = prior_of(0.1, 0.02, kTruth);
  Decoys decoys;
  decoys.log_volume = 1.0;
  assert_true(decoys.scores.push_back(5.0));
  Evidence e = strong();
  const double at_mean = judge(params, e, -1e3, prior, decoys).chance_log;
  e.chi2 = 8.0;
  assert_near(judge(params, e, -1e3, prior, decoys).chance_log, at_mean - 4.0, 1e-9);
  e.chi2 = 24.0;
  e.innovation2 = params.innovation2_limit + 0.01;
  e.log_ratio = params.ln_threshold - params.calibration - 11.9;
  assert_status(judge(params, e, -1e3, prior, decoys).status, VerdictStatus::kInconsistentWithPrior);
  e.log_ratio -= 0.2;
  assert_status(judge(params, e, -1e3, prior, decoys).status, VerdictStatus::kTooLittleEvidence);
}

/// theta as the header has it: the mean excess of the best twelve over what scattered boulders reach, or over
/// the thirteenth, with four of 1 mixed in.
void test_tail_of_decoys(void**) {
  const VerdictParams params;
  const PosePrior prior = prior_of(0.1, 0.02, kTruth);
  Decoys decoys;
  decoys.log_volume = 1.0;
  const double reached = 1.0 - strong().log_volume;
  double sum = 0.0;
  for (int i = 0; i < 12; ++i) {
    assert_true(decoys.scores.push_back(reached + 5.0 + i));
    sum += 5.0 + i;
    assert_near(judge(params, strong(), -1e3, prior, decoys).theta, (4.0 + sum) / (5.0 + i), 1e-12);
  }
  assert_true(decoys.scores.push_back(reached - 0.1));  // what scattered boulders reach tells nothing
  assert_near(judge(params, strong(), -1e3, prior, decoys).theta, (4.0 + sum) / 16.0, 1e-12);
  assert_true(decoys.scores.push_back(reached + 2.0));
  assert_near(judge(params, strong(), -1e3, prior, decoys).theta, (4.0 + sum - 12.0 * 2.0) / 16.0, 1e-12);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_evidence_is_the_formula),
      cmocka_unit_test(test_volume_of_priors),
      cmocka_unit_test(test_wider_priors_cost_their_volume),
      cmocka_unit_test(test_mean_ratio_of_chance_is_one),
      cmocka_unit_test(test_a_map_boulder_is_evidence_once),
      cmocka_unit_test(test_what_pays),
      cmocka_unit_test(test_sizes),
      cmocka_unit_test(test_covariance_holds),
      cmocka_unit_test(test_scale_is_found),
      cmocka_unit_test(test_matched_is_the_formula),
      cmocka_unit_test(test_covariance_of_pairs_that_agree_well),
      cmocka_unit_test(test_innovation_is_of_the_fix_alone),
      cmocka_unit_test(test_sizes_mistaken),
      cmocka_unit_test(test_nothing_near_diverges),
      cmocka_unit_test(test_roughly_settled),
      cmocka_unit_test(test_bad_input),
      cmocka_unit_test(test_slices_give_the_same),
      cmocka_unit_test(test_density_is_local),
      cmocka_unit_test(test_clusters_count_for_less),
      cmocka_unit_test(test_links_join_clusters),
      cmocka_unit_test(test_own_sigma_of_a_boulder),
      cmocka_unit_test(test_headings_of_priors_wrap),
      cmocka_unit_test(test_each_verdict),
      cmocka_unit_test(test_boulders_in_view),
      cmocka_unit_test(test_view_log_is_a_bound),
      cmocka_unit_test(test_decoys),
      cmocka_unit_test(test_distance_from_the_prior),
      cmocka_unit_test(test_tail_of_decoys),
  };
  return cmocka_run_group_tests_name("registration/verdict", tests, nullptr, nullptr);
}
