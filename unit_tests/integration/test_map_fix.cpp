// One fix by the map, tracked, wide and lost, on ground strewn at random: it says what the map alone knows,
// in the map's frame, and each cause of declining comes out.
#include "localizer/map_fix.hpp"

#include <cmath>
#include <limits>

#include "integration/replay.hpp"
#include "support/noise.hpp"
#include "support/slices.hpp"

using namespace cairn;
using namespace cairn::test;

namespace {

MapFix job;
MapFix other_job;
FlightMap flight_map;
LocalMap local_map;

const Vec2 kPivot(12.0, -7.0);
const Pose2 kTruth{1040.0, -2055.0, 0.8};
const Vec2 kRover = kTruth * kPivot;
constexpr double kSigmaPair_m = 0.045;

struct World {
  double per_m2 = 0.5;
  double half_m = 30.0;  ///< of the map's square about the rover
  int truths = 18;
  int others = 8;
  double see_m = 5.0;
  double scale = 1.0;  ///< lengths of the map over those of the ground
  double yaw_rad = kTruth.yaw_rad;
  bool twice = false;  ///< the same ground once more, beside itself
};

Pose2 about_rover(double yaw_rad, const Vec2& off_m = Vec2(0.0, 0.0)) {
  Pose2 out{0.0, 0.0, yaw_rad};
  const Vec2 t = kRover + off_m - out * kPivot;
  out.x_m = t.x();
  out.y_m = t.y();
  return out;
}

/// The map about the rover, and what is seen there.
void lay(std::uint64_t seed, const World& world = {}) {
  Random random(seed);
  std::vector<ground::TableBoulder> boulders;
  local_map.clear();
  const double h = world.half_m;
  const Pose2 T_site_map = about_rover(world.yaw_rad).inverse();
  const auto count = static_cast<int>(world.per_m2 * 4.0 * h * h);
  int truths = 0;
  for (int i = 0; i < count; ++i) {
    const Vec2 p(uniform(random, -h, h), uniform(random, -h, h));
    ground::TableBoulder b;
    b.p_map_m = kRover + world.scale * p;
    boulders.push_back(b);
    if (world.twice) {
      b.p_map_m.x() += 2.0 * h;
      boulders.push_back(b);
    }
    if (p.norm() > world.see_m || truths == world.truths) continue;
    ++truths;
    LocalBoulder seen;
    seen.p_site_m = T_site_map * Vec2(kRover + p) + kSigmaPair_m * Vec2(normal(random), normal(random));
    assert_true(local_map.push_back(seen));
  }
  assert_int_equal(truths, world.truths);
  for (int i = 0; i < world.others; ++i) {
    LocalBoulder seen;
    seen.p_site_m = kPivot + Vec2(uniform(random, -3.0, 3.0), uniform(random, -3.0, 3.0));
    assert_true(local_map.push_back(seen));
  }
  assert_status(flight_map.make(boulders), MapStatus::kUsable);
}

Mat3 covariance(double sigma_m, double sigma_rad) {
  return Vec3(sigma_m * sigma_m, sigma_m * sigma_m, sigma_rad * sigma_rad).asDiagonal();
}

MapFixStatus tracked(const Pose2& from, const Mat3& prior, const MapFixParams& params = {}) {
  if (job.start_tracked(params, flight_map.map, local_map, from, kPivot, prior) == MapFixStatus::kRunning)
    assert_true(run_whole(job));
  return job.status();
}
MapFixStatus lost(const Pose2& from, const SearchRegion& region = {}, const MapFixParams& params = {}) {
  if (job.start_lost(params, flight_map.map, local_map, from, kPivot, region) == MapFixStatus::kRunning)
    assert_true(run_whole(job));
  return job.status();
}

/// Where the map says that the rover is, from the start `from`.
Vec2 place(const Pose2& from) { return from * kPivot + job.result().offset.head<2>(); }

/// Of what the map alone says, in squares of its own sigmas.
double chi2_of_offset(const Pose2& from, double yaw_rad) {
  const Vec2 off = place(from) - kRover;
  const Vec3 error(off.x(), off.y(), wrap_angle(from.yaw_rad + job.result().offset[2] - yaw_rad));
  return error.dot(Vec3(job.result().covariance.inverse() * error));
}

// ---- tracked

/// The start is wrong, in place and heading; the fix is right, in the map's axes, and as sure as it is good.
void test_tracked_fix_is_right(void**) {
  double sum = 0.0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    lay(seed);
    const Pose2 from = about_rover(kTruth.yaw_rad + 0.04, Vec2(0.25, -0.1));
    assert_status(tracked(from, covariance(0.2, 0.05)), MapFixStatus::kAccepted);
    assert_false(job.lost());
    const MapFixResult& r = job.result();
    assert_at_most((r.T_map_site * kPivot - kRover).norm(), 0.08);
    assert_near(r.T_map_site.yaw_rad, kTruth.yaw_rad, 0.03);
    assert_at_most((place(from) - kRover).norm(), 0.08);
    sum += chi2_of_offset(from, kTruth.yaw_rad);
    assert_at_least(r.hypotheses, 1);
    assert_near(r.pairs, 18.0, 5.0);
    assert_in_range(r.sightings, 20, 26);
  }
  assert_at_least(sum / 20.0, 1.5);  // 3, if the claim is right
  assert_at_most(sum / 20.0, 5.0);
}

/// A prior as good as the fix itself and wrong pulls the best pose, never what the map alone says: a filter
/// would count it twice. The more certain the prior, the more would be seen of it.
void test_the_prior_is_taken_out_again(void**) {
  lay(3);
  const Pose2 good = about_rover(kTruth.yaw_rad);
  assert_status(tracked(good, covariance(0.25, 0.09)), MapFixStatus::kAccepted);
  const Vec2 alone = place(good);
  const double yaw = good.yaw_rad + job.result().offset[2];
  const Mat3 own = job.result().covariance;
  const double sigma = std::sqrt(own(0, 0));
  const Pose2 from = about_rover(kTruth.yaw_rad + std::sqrt(own(2, 2)), Vec2(sigma, -sigma));
  Mat3 tight = own;
  tight(0, 1) = tight(1, 0) = tight(0, 2) = tight(2, 0) = tight(1, 2) = tight(2, 1) = 0.0;
  assert_status(tracked(from, tight), MapFixStatus::kAccepted);
  const MapFixResult& r = job.result();
  assert_at_least((r.T_map_site * kPivot - alone).norm(), 0.3 * sigma);  // half way between the two
  assert_at_most((place(from) - alone).norm(), 0.45 * sigma);
  assert_near(from.yaw_rad + r.offset[2], yaw, 0.3 * std::sqrt(own(2, 2)));
  for (int k = 0; k < 3; ++k) {
    assert_near(std::sqrt(r.covariance(k, k) / own(k, k)), 1.0, 0.15);
    assert_near(r.posterior(k, k) / own(k, k), 0.5, 0.15);
  }
}

/// A heading next to the half turn: offsets stay small.
/// Half of the boulders made a fix before, and since then the local map was bent between them and the others.
/// What the fresh ones say is theirs alone, and as sure as they make it.
void test_what_fresh_boulders_say(void**) {
  constexpr double kBent_m = 0.07;
  const Vec2 aside = Pose2{0.0, 0.0, kTruth.yaw_rad} * Vec2(kBent_m, 0.0) / kBent_m;
  double all_aside = 0.0, fresh_aside = 0.0, chi2 = 0.0;
  constexpr int kTrials = 20;
  for (std::uint64_t seed = 0; seed < kTrials; ++seed) {
    lay(seed);
    for (std::size_t i = 0; i < 9; ++i) {
      local_map[i].fresh = 0.0F;
      local_map[i].p_site_m.x() -= kBent_m;  // the map lies farther along x, for them
    }
    const Pose2 from = about_rover(kTruth.yaw_rad + 0.02, Vec2(0.06, -0.05));
    assert_status(tracked(from, covariance(0.1, 0.03)), MapFixStatus::kAccepted);
    const MapFixResult& r = job.result();
    const Vec2 off = from * kPivot + r.fresh_offset.head<2>() - kRover;
    const Vec3 error(off.x(), off.y(), wrap_angle(from.yaw_rad + r.fresh_offset[2] - kTruth.yaw_rad));
    all_aside += (place(from) - kRover).dot(aside) / kTrials;
    fresh_aside += off.dot(aside) / kTrials;
    chi2 += error.dot(Vec3(r.fresh_covariance.inverse() * error)) / kTrials;
    int still = 0;
    for (std::size_t i = 0; i < 18; ++i) still += job.local()[i].fresh > 0.0F ? 1 : 0;
    assert_at_most(still, 4);
  }
  assert_at_least(all_aside, 0.02);
  assert_near(fresh_aside, 0.0, 0.015);
  assert_at_least(chi2, 1.5);  // 3, if the claim is right
  assert_at_most(chi2, 5.0);
}

/// Boulders of which a fix was told three quarters tell a quarter of what they would tell unused, of the same
/// offset; those that are fresh in part are proven by their share of what proves the fix.
void test_what_was_told_in_part(void**) {
  lay(5);
  const Pose2 from = about_rover(kTruth.yaw_rad + 0.02, Vec2(0.06, -0.05));
  assert_status(tracked(from, covariance(0.1, 0.03)), MapFixStatus::kAccepted);
  const MapFixResult whole = job.result();
  for (LocalBoulder& b : local_map) b.fresh = 0.25F;
  assert_status(tracked(from, covariance(0.1, 0.03)), MapFixStatus::kAccepted);
  const MapFixResult& part = job.result();
  assert_near((0.25 * part.fresh_covariance - whole.fresh_covariance).norm(), 0.0, 1.0e-8);
  assert_near((part.fresh_offset - whole.fresh_offset).norm(), 0.0, 1.0e-6);
  assert_near((part.offset - whole.offset).norm(), 0.0, 0.0);
  assert_false(part.fresh_unproven);
  // Of a hundredth nothing is a proof, however well all of them prove the fix.
  for (LocalBoulder& b : local_map) b.fresh = 0.01F;
  assert_status(tracked(from, covariance(0.1, 0.03)), MapFixStatus::kAccepted);
  assert_true(job.result().fresh_unproven);
}

/// A lone fresh boulder that happens to lie by one of the map's is told from nine that are on it.
void test_fresh_boulders_need_a_proof_of_their_own(void**) {
  const Pose2 from = about_rover(kTruth.yaw_rad + 0.02, Vec2(0.06, -0.05));
  int unproven = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    lay(seed);
    for (std::size_t i = 0; i < 17; ++i) local_map[i].fresh = 0.0F;
    local_map[17].p_site_m.x() += 0.1;
    assert_status(tracked(from, covariance(0.1, 0.03)), MapFixStatus::kAccepted);
    const bool silent = job.result().fresh_covariance(0, 0) > 1.0e5;
    assert_true(job.result().fresh_unproven || silent);
    unproven += job.result().fresh_unproven ? 1 : 0;
    lay(seed);
    for (std::size_t i = 0; i < 9; ++i) local_map[i].fresh = 0.0F;
    assert_status(tracked(from, covariance(0.1, 0.03)), MapFixStatus::kAccepted);
    assert_false(job.result().fresh_unproven);
    // Without others they prove the fix themselves.
    for (LocalBoulder& b : local_map) b.fresh = 1.0F;
    assert_status(tracked(from, covariance(0.1, 0.03)), MapFixStatus::kAccepted);
    assert_false(job.result().fresh_unproven);
  }
  assert_at_least(unproven, 10);
}

/// None is fresh: the fix is proven, and says nothing.
void test_no_boulder_is_fresh(void**) {
  lay(5);
  for (LocalBoulder& b : local_map) b.fresh = 0.0F;
  const Pose2 from = about_rover(kTruth.yaw_rad, Vec2(0.05, 0.0));
  assert_status(tracked(from, covariance(0.1, 0.03)), MapFixStatus::kAccepted);
  for (int k = 0; k < 3; ++k) assert_at_least(job.result().fresh_covariance(k, k), 1.0e5);
  assert_false(job.result().fresh_unproven);
}

/// Little lies in reach of a wide prior on sparse ground: it is a prior still, and pays for its own volume.
void test_a_wide_prior_on_sparse_ground(void**) {
  World sparse;
  sparse.per_m2 = 0.02;
  sparse.half_m = 80.0;
  sparse.truths = 12;
  sparse.others = 6;
  sparse.see_m = 25.0;
  lay(2, sparse);
  const Pose2 from = about_rover(kTruth.yaw_rad + 0.02, Vec2(0.9, -0.5));
  assert_status(tracked(from, covariance(0.8, 0.05)), MapFixStatus::kAccepted);
  assert_false(job.lost());
  assert_at_most((place(from) - kRover).norm(), 0.08);
  assert_status(tracked(from, covariance(6.0, 0.05)), MapFixStatus::kAccepted);
  assert_true(job.lost());
  // Where it was searched as if lost, it is made of all of them.
  const MapFixResult& r = job.result();
  assert_near(r.fresh_covariance(0, 0), r.covariance(0, 0), 0.0);
  assert_near((r.fresh_offset - r.offset).norm(), 0.0, 0.0);
  int used = 0;
  for (const LocalBoulder& b : job.local()) used += b.fresh > 0.0F ? 0 : 1;
  assert_in_range(used, 8, 14);
}

void test_headings_wrap(void**) {
  World world;
  world.yaw_rad = kPi - 0.02;
  lay(5, world);
  const Pose2 from = about_rover(0.02 - kPi);
  assert_status(tracked(from, covariance(0.1, 0.05)), MapFixStatus::kAccepted);
  assert_near(job.result().offset[2], -0.04, 0.02);
  assert_status(lost(from), MapFixStatus::kAccepted);
  assert_near(job.result().offset[2], -0.04, 0.02);
  assert_near(wrap_angle(job.result().T_map_site.yaw_rad - world.yaw_rad), 0.0, 0.02);
}

/// The window holds the local map wherever the prior leaves room, and grows with both.
void test_the_window_grows_with_what_it_must_hold(void**) {
  lay(6);
  MapFixParams params;
  params.search.ring = 0.0;
  params.map_window_radius_m = 0.1;
  double far = 0.0;
  for (const LocalBoulder& b : local_map) far = std::fmax(far, (b.p_site_m - kPivot).norm());
  const auto in_disc = [&](double radius_m) {
    MapReader reader;
    MapReader::Chunk chunk;
    assert_status(reader.start(flight_map.map, kRover, radius_m), WindowStatus::kUsable);
    WorkBudget all = WorkBudget::unlimited();
    std::size_t count = 0;
    for (Progress progress = Progress::kMore; progress == Progress::kMore;) {
      progress = reader.step(all, chunk);
      count += chunk.size();
    }
    return count;
  };
  const Pose2 from = about_rover(kTruth.yaw_rad);
  for (const double sigma : {0.05, 0.1, 0.25}) {
    Mat3 prior = covariance(0.05, 0.02);
    prior(1, 1) = sigma * sigma;  // the larger one counts
    static_cast<void>(tracked(from, prior, params));
    assert_int_equal(job.result().map_boulders, in_disc(params.search.reach_sigmas * sigma + far));
  }
  params.map_window_radius_m = 11.0;  // at least
  static_cast<void>(tracked(from, covariance(0.05, 0.02), params));
  assert_int_equal(job.result().map_boulders, in_disc(11.0));
}

/// A map whose metre is none: said as scale, and the rover is where it is in that map, or nothing is said.
void test_scale_is_said(void**) {
  int accepted = 0;
  for (const double scale : {0.97, 0.98, 1.02, 1.03}) {
    World world;
    world.scale = scale;
    world.truths = 26;
    world.see_m = 8.0;
    world.others = 4;
    lay(7, world);
    const Pose2 from = about_rover(kTruth.yaw_rad);
    for (const bool whole_map : {false, true}) {
      const MapFixStatus status = whole_map ? lost(from) : tracked(from, covariance(0.1, 0.03));
      if (status != MapFixStatus::kAccepted) continue;
      ++accepted;
      const MapFixResult& r = job.result();
      assert_at_most(std::fabs(r.scale - scale), 3.0 * r.scale_sigma);
      assert_at_most(r.scale_sigma, 0.005);
      assert_at_most((place(from) - kRover).norm(), 0.05);
    }
  }
  assert_at_least(accepted, 6);
}

// ---- wide

/// A prior too wide for a window is a disc and a sector: the pose is found there. Where only fresh boulders
/// may count, it is not looked for.
void test_wide_priors(void**) {
  lay(8);
  struct Wide {
    Vec2 off_m;
    double yaw_rad, sigma_m, sigma_rad;
  };
  for (const Wide& w : {Wide{Vec2(3.0, -4.0), 0.02, 2.0, 0.03}, Wide{Vec2(0.1, 0.1), 1.0, 0.1, 0.5}}) {
    const Pose2 from = about_rover(kTruth.yaw_rad + w.yaw_rad, w.off_m);
    assert_status(tracked(from, covariance(w.sigma_m, w.sigma_rad)), MapFixStatus::kAccepted);
    assert_true(job.lost());
    assert_at_most((place(from) - kRover).norm(), 0.08);
    assert_at_most(chi2_of_offset(from, kTruth.yaw_rad), 16.0);
    MapFixParams fresh;
    fresh.search.fresh_only = true;
    assert_status(tracked(from, covariance(w.sigma_m, w.sigma_rad), fresh), MapFixStatus::kNoSearchRoom);
  }
}

/// What the prior excludes, by place or by heading, is not found; what it leaves room for at five sigmas is.
void test_wide_priors_bound_the_search(void**) {
  lay(9);
  struct Edge {
    Vec2 off_m;
    double yaw_rad;
    bool found;
  };
  const double reach = MapFixParams().search.reach_sigmas;
  for (const Edge& e :
       {Edge{Vec2(0.9 * reach, 0.0), 0.0, true}, Edge{Vec2(0.0, 0.0), 0.9 * reach * 0.2, true},
        Edge{Vec2(1.6 * reach, 0.0), 0.0, false}, Edge{Vec2(0.0, 0.0), 1.3 * reach * 0.2, false}}) {
    const Pose2 from = about_rover(kTruth.yaw_rad + e.yaw_rad, e.off_m);
    const MapFixStatus status = tracked(from, covariance(1.0, 0.2));
    assert_int_equal(status == MapFixStatus::kAccepted, e.found);
  }
}

// ---- lost

/// Anywhere, at any heading; the fix is one of the rover's place, however far from where it was thought.
void test_lost_fix_is_right(void**) {
  double sum = 0.0;
  for (std::uint64_t seed = 30; seed < 40; ++seed) {
    lay(seed);
    const Pose2 from = about_rover(kTruth.yaw_rad - 0.35 * static_cast<double>(seed - 29U), Vec2(9.0, 4.0));
    assert_status(lost(from), MapFixStatus::kAccepted);
    assert_true(job.lost());
    const MapFixResult& r = job.result();
    assert_at_most((r.T_map_site * kPivot - kRover).norm(), 0.08);
    assert_at_most((place(from) - kRover).norm(), 0.08);
    assert_near(wrap_angle(r.T_map_site.yaw_rad - kTruth.yaw_rad), 0.0, 0.03);
    sum += chi2_of_offset(from, kTruth.yaw_rad);
    assert_int_equal(r.map_boulders, flight_map.map.count());
    assert_int_equal(r.sightings, local_map.size());
  }
  assert_at_least(sum / 10.0, 1.2);
  assert_at_most(sum / 10.0, 6.0);
}

/// Within a disc: a pose out of it is not the answer, though it is the true one.
void test_lost_within_a_region(void**) {
  lay(11);
  SearchRegion region;
  region.anywhere = false;
  region.radius_m = 6.0;
  region.centre_map_m = kRover + Vec2(0.0, 5.0);
  const Pose2 from = about_rover(kTruth.yaw_rad);
  assert_status(lost(from, region), MapFixStatus::kAccepted);
  assert_at_most((place(from) - kRover).norm(), 0.08);
  assert_at_most(job.result().map_boulders, flight_map.map.count() / 2);
  region.centre_map_m = kRover + Vec2(0.0, 8.0);
  assert_true(lost(from, region) != MapFixStatus::kAccepted);
}

/// The same ground twice in one map: nobody knows which.
void test_ground_that_repeats_is_ambiguous(void**) {
  World world;
  world.twice = true;
  world.half_m = 12.0;
  lay(12, world);
  const Pose2 from = about_rover(0.0);
  assert_status(lost(from), MapFixStatus::kAmbiguous);
  assert_near(job.result().verdict.second_log_ratio, job.result().verdict.log_ratio, 3.0);
  SearchRegion here;  // but known to be in this half
  here.anywhere = false;
  here.radius_m = 8.0;
  here.centre_map_m = kRover;
  assert_status(lost(from, here), MapFixStatus::kAccepted);
}

/// Of another place, nothing is accepted. Whether a proof was to be expected is told apart: by how many
/// boulders there are, and the more of them it takes the more poses were looked at.
void test_other_ground(void**) {
  struct Other {
    int boulders;
    bool expected_tracked, expected_lost;
  };
  for (const Other& o : {Other{6, false, false}, Other{45, true, false}, Other{75, true, true}}) {
    World world;
    world.truths = 0;
    world.others = o.boulders;
    lay(50, world);
    const Pose2 from = about_rover(kTruth.yaw_rad);
    assert_true(tracked(from, covariance(0.1, 0.03)) != MapFixStatus::kAccepted);
    assert_int_equal(job.result().proof_expected, o.expected_tracked);
    assert_true(lost(from) != MapFixStatus::kAccepted);
    assert_int_equal(job.result().proof_expected, o.expected_lost);
  }
}

/// What agrees with nothing in reach speaks against the prior, be it narrow, or so wide that it is looked for
/// as when lost.
void test_nothing_that_agrees_speaks_against_the_prior(void**) {
  for (const auto& [sigma_m, sigma_rad] : {std::pair{0.1, 0.03}, std::pair{0.5, 0.03}}) {
    int nothing = 0;
    for (std::uint64_t seed = 61; seed < 81; ++seed) {
      World world;
      world.per_m2 = 0.05;
      world.truths = 0;
      world.others = 12;
      lay(seed, world);
      const MapFixStatus status = tracked(about_rover(kTruth.yaw_rad), covariance(sigma_m, sigma_rad));
      assert_true(status != MapFixStatus::kAccepted);
      if (status != MapFixStatus::kNoHypothesis) continue;
      ++nothing;
      assert_near(job.result().verdict.log_ratio, evidence_of_misses(local_map.size()), 1.5);
      assert_at_most(job.result().verdict.log_ratio, -3.0);
    }
    assert_at_least(nothing, 5);
  }
}

// ---- statuses and slices

void test_statuses(void**) {
  lay(13);
  const Pose2 from = about_rover(kTruth.yaw_rad);
  const Mat3 prior = covariance(0.1, 0.03);
  const MapFixParams params;
  const SearchRegion anywhere;
  assert_status(job.start_tracked(params, OrbitalMap(), local_map, from, kPivot, prior),
                MapFixStatus::kNoMap);
  assert_status(job.start_lost(params, OrbitalMap(), local_map, from, kPivot, anywhere),
                MapFixStatus::kNoMap);
  const Pose2 away = about_rover(0.0, Vec2(900.0, 0.0));
  assert_status(tracked(away, prior), MapFixStatus::kNoMapBoulders);
  // A prior that is none is no licence to look just where the pose is thought to be.
  for (int i = 0; i < 3; ++i) {
    Mat3 none = prior;
    none(i, i) = std::numeric_limits<double>::quiet_NaN();
    assert_status(tracked(from, none), MapFixStatus::kBadInput);
  }
  // What only the search itself finds out.
  const Vec2 good = local_map[2].p_site_m;
  local_map[2].p_site_m.x() = std::numeric_limits<double>::quiet_NaN();
  assert_status(tracked(from, prior), MapFixStatus::kBadInput);
  local_map[2].p_site_m = good;
  SearchRegion elsewhere;
  elsewhere.anywhere = false;
  elsewhere.radius_m = 5.0;
  elsewhere.centre_map_m = kRover + Vec2(900.0, 0.0);
  assert_status(lost(from, elsewhere), MapFixStatus::kNoMap);
  local_map.resize(3);
  assert_status(job.start_lost(params, flight_map.map, local_map, from, kPivot, anywhere),
                MapFixStatus::kNoLocalBoulders);
  local_map.resize(1);
  assert_status(job.start_tracked(params, flight_map.map, local_map, from, kPivot, prior),
                MapFixStatus::kNoLocalBoulders);
}

bool same(const MapFixResult& a, const MapFixResult& b) {
  return a.verdict.status == b.verdict.status && a.verdict.log_ratio == b.verdict.log_ratio &&
         a.offset == b.offset && a.covariance == b.covariance && a.posterior == b.posterior &&
         a.hypotheses == b.hypotheses && a.map_boulders == b.map_boulders && a.scale == b.scale;
}

void test_slices_give_the_same(void**) {
  lay(14);
  const Pose2 from = about_rover(kTruth.yaw_rad + 0.05, Vec2(0.1, 0.1));
  for (const bool whole_map : {false, true}) {
    static_cast<void>(whole_map ? lost(from) : tracked(from, covariance(0.2, 0.05)));
    assert_status(whole_map ? other_job.start_lost({}, flight_map.map, local_map, from, kPivot, {})
                            : other_job.start_tracked({}, flight_map.map, local_map, from, kPivot,
                                                      covariance(0.2, 0.05)),
                  MapFixStatus::kRunning);
    assert_at_least(run_in_slices(other_job), 5);
    assert_true(same(job.result(), other_job.result()));
  }
}

/// A fix that was left anywhere on its way, tracked or lost, leaves nothing behind: the next one, which uses
/// its window and its ground, is as the first.
void test_one_left_unfinished_leaves_nothing(void**) {
  lay(15);
  const Pose2 from = about_rover(kTruth.yaw_rad + 0.05, Vec2(0.1, 0.1));
  const auto begin = [&](bool whole_map) {
    return whole_map ? job.start_lost({}, flight_map.map, local_map, from, kPivot, {})
                     : job.start_tracked({}, flight_map.map, local_map, from, kPivot, covariance(0.2, 0.05));
  };
  MapFixResult whole[2];
  for (const bool whole_map : {false, true}) {
    assert_status(begin(whole_map), MapFixStatus::kRunning);
    assert_true(run_whole(job));
    assert_status(job.status(), MapFixStatus::kAccepted);
    whole[whole_map ? 1 : 0] = job.result();
  }
  for (const std::uint32_t operations : {2'000U, 20'000U, 60'000U, 200'000U, 1'000'000U}) {
    for (const int pair : {0, 1, 2, 3}) {
      const bool left_lost = pair >= 2;
      const bool next_lost = pair % 2 == 1;
      assert_status(begin(left_lost), MapFixStatus::kRunning);
      WorkBudget some(operations);
      static_cast<void>(job.step(some));
      assert_status(begin(next_lost), MapFixStatus::kRunning);
      assert_true(run_whole(job));
      assert_true(same(job.result(), whole[next_lost ? 1 : 0]));
    }
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_tracked_fix_is_right),
      cmocka_unit_test(test_the_prior_is_taken_out_again),
      cmocka_unit_test(test_what_fresh_boulders_say),
      cmocka_unit_test(test_what_was_told_in_part),
      cmocka_unit_test(test_fresh_boulders_need_a_proof_of_their_own),
      cmocka_unit_test(test_no_boulder_is_fresh),
      cmocka_unit_test(test_a_wide_prior_on_sparse_ground),
      cmocka_unit_test(test_headings_wrap),
      cmocka_unit_test(test_the_window_grows_with_what_it_must_hold),
      cmocka_unit_test(test_scale_is_said),
      cmocka_unit_test(test_wide_priors),
      cmocka_unit_test(test_wide_priors_bound_the_search),
      cmocka_unit_test(test_lost_fix_is_right),
      cmocka_unit_test(test_lost_within_a_region),
      cmocka_unit_test(test_ground_that_repeats_is_ambiguous),
      cmocka_unit_test(test_other_ground),
      cmocka_unit_test(test_nothing_that_agrees_speaks_against_the_prior),
      cmocka_unit_test(test_statuses),
      cmocka_unit_test(test_slices_give_the_same),
      cmocka_unit_test(test_one_left_unfinished_leaves_nothing),
  };
  return cmocka_run_group_tests_name("integration/map_fix", tests, nullptr, nullptr);
}
