// Search for a lost rover: found at any heading on random fields, nothing found on another place's map,
// lattices are ambiguous, regions are kept, sizes help, each status, slicing.
#include "registration/lost_search.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include "support/cmocka.hpp"
#include "support/noise.hpp"
#include "support/slices.hpp"

using namespace cairn;
using test::normal;
using test::uniform;

namespace {

constexpr double kNoise = 0.045;

WideMap map;
LostSearch search;
LostSearch other;
std::vector<MapBoulder> field;
LocalMap local_map;
Pose2 truth;

void lay_map(double side_m) {
  assert_true(map.begin(Vec2(500.0, -200.0), Vec2(side_m, side_m), 3.0 * kNoise));
  for (const MapBoulder& b : field) assert_true(map.add(b));
  assert_true(test::run_whole(map));
}

void scatter(Random& random, int count, double side_m) {
  field.clear();
  for (int i = 0; i < count; ++i) {
    const double diameter = 0.1 * std::pow(1.0 - uniform(random, 0.0, 1.0), -0.4);
    field.push_back({Vec2(500.0 + uniform(random, 0.0, side_m), -200.0 + uniform(random, 0.0, side_m)),
                     static_cast<float>(diameter)});
  }
  lay_map(side_m);
}

/// What a rover at a random place of the map sees: so many of its boulders, and others.
void see(Random& random, double side_m, double radius_m, int trues, int others, bool sizes) {
  local_map.clear();
  truth = {500.0 + uniform(random, radius_m, side_m - radius_m),
           -200.0 + uniform(random, radius_m, side_m - radius_m), uniform(random, -kPi, kPi)};
  const Pose2 T_site_map = truth.inverse();
  for (const MapBoulder& b : field) {
    const Vec2 p = T_site_map * b.p_map_m;
    if (p.norm() > radius_m || static_cast<int>(local_map.size()) == trues) continue;
    LocalBoulder seen;
    seen.p_site_m = p + kNoise * Vec2(normal(random), normal(random));
    if (sizes) seen.diameter_m = b.diameter_m * static_cast<float>(std::exp(0.15 * normal(random)));
    assert_true(local_map.push_back(seen));
  }
  while (others-- > 0) {
    const double r = radius_m * std::sqrt(uniform(random, 0.0, 1.0));
    const double a = uniform(random, -kPi, kPi);
    LocalBoulder seen;
    seen.p_site_m = Vec2(r * std::cos(a), r * std::sin(a));
    if (sizes) seen.diameter_m = static_cast<float>(0.1 * std::pow(1.0 - uniform(random, 0.0, 1.0), -0.4));
    assert_true(local_map.push_back(seen));
  }
}

LostSearchParams usual() {
  LostSearchParams p;
  p.sigma_pair_m = kNoise;
  p.sigma_size = 0.0;
  p.drift = 0.0;
  return p;
}

LostStatus run(const LostSearchParams& p, const SearchRegion& region = SearchRegion()) {
  if (search.start(p, map, local_map, Vec2(0.0, 0.0), region) == LostStatus::kRunning) {
    assert_true(test::run_whole(search));
  }
  return search.status();
}

double error_m() { return (search.hits()[0].T_map_site.translation() - truth.translation()).norm(); }

void test_found_in_a_square_kilometre(void**) {
  Random random(21);
  scatter(random, 10000, 1000.0);
  for (int trial = 0; trial < 8; ++trial) {
    see(random, 1000.0, 30.0, 20, 30, false);
    assert_int_equal(run(usual()), LostStatus::kFound);
    assert_true(error_m() < 0.1);
    assert_true(std::fabs(wrap_angle(search.hits()[0].T_map_site.yaw_rad - truth.yaw_rad)) < 0.005);
  }
}

/// Odometry that may drift, and did not, is as good as one that can't: nearly all of the evidence is
/// found, and the search ends early.
void test_drift_that_was_not(void**) {
  Random random(31);
  scatter(random, 10000, 1000.0);
  LostSearchParams p = usual();
  int pairs = 0;
  for (int trial = 0; trial < 8; ++trial) {
    see(random, 1000.0, 30.0, 10, 10, false);
    p.drift = 0.0;
    assert_int_equal(run(p), LostStatus::kFound);
    const double without = search.hits()[0].score_nats;
    p.drift = 0.01;
    assert_int_equal(run(p), LostStatus::kFound);
    assert_true(search.hits()[0].score_nats > without - 1.0);
    assert_true(error_m() < 0.2);
    pairs += search.pairs_tried();
  }
  assert_true(pairs < 8 * p.max_pairs / 2);
}

/// And that which did drift, by as much as is said.
void test_drift_that_was(void**) {
  Random random(32);
  scatter(random, 10000, 1000.0);
  LostSearchParams p = usual();
  p.drift = 0.02;
  for (int trial = 0; trial < 8; ++trial) {
    see(random, 1000.0, 30.0, 20, 20, false);
    const double stretch = trial % 2 == 0 ? 1.02 : 0.98;
    for (LocalBoulder& b : local_map) b.p_site_m *= stretch;
    assert_int_equal(run(p), LostStatus::kFound);
    assert_true(error_m() < 0.6);
  }
}

/// Every two map boulders as far apart as the local pair, within kLengthSigmas, both ways: against all.
void test_no_pair_of_the_map_is_missed(void**) {
  Random random(33);
  for (const double side : {60.0, 200.0}) {
    scatter(random, 1500, side);
    see(random, side, 8.0, 0, 12, false);
    LostSearchParams p = usual();
    p.max_pairs = 1;
    assert_int_equal(run(p), LostStatus::kNotFound);
    Vec2 middle(0.0, 0.0);
    for (const LocalBoulder& b : local_map) middle += b.p_site_m / static_cast<double>(local_map.size());
    double spread2 = 0.0;
    for (const LocalBoulder& b : local_map) spread2 += (b.p_site_m - middle).squaredNorm();
    const double least = 0.5 * std::sqrt(2.0 * spread2 / static_cast<double>(local_map.size()));
    double length = 1.0e9;  // of the first pair: the shortest of those that are long enough
    for (std::size_t i = 0; i < local_map.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        const double l = (local_map[i].p_site_m - local_map[k].p_site_m).norm();
        if (l >= least && l < length) length = l;
      }
    }
    const double play = LostSearch::kLengthSigmas * std::sqrt(2.0) * kNoise;
    std::uint32_t as_long = 0;
    for (std::size_t i = 0; i < field.size(); ++i) {
      for (std::size_t k = 0; k < field.size(); ++k)
        as_long += i != k && std::fabs((field[i].p_map_m - field[k].p_map_m).norm() - length) <= play;
    }
    assert_true(as_long > 150);
    assert_true(search.hypotheses() + 3 >= as_long && search.hypotheses() <= as_long + 3);  // floats
  }
}

void test_found_on_dense_ground(void**) {
  Random random(22);
  scatter(random, 8500, 77.0);
  for (int trial = 0; trial < 4; ++trial) {
    see(random, 77.0, 4.0, 30, 45, false);
    assert_int_equal(run(usual()), LostStatus::kFound);
    assert_true(error_m() < 0.15);
  }
}

/// With sizes, fewer boulders are enough: pairs of large ones come first.
void test_sizes_are_evidence(void**) {
  Random random(23);
  scatter(random, 8500, 77.0);
  double with = 0.0;
  double without = 0.0;
  for (int trial = 0; trial < 3; ++trial) {
    see(random, 77.0, 4.0, 30, 20, true);
    LostSearchParams p = usual();
    assert_int_equal(run(p), LostStatus::kFound);
    without += search.hits()[0].score_nats;
    p.sigma_size = 0.15;
    assert_int_equal(run(p), LostStatus::kFound);
    with += search.hits()[0].score_nats;
    assert_true(error_m() < 0.15);
  }
  assert_true(with > without + 15.0);
}

void test_another_place_is_not_found(void**) {
  Random random(24);
  scatter(random, 2000, 300.0);
  for (int trial = 0; trial < 6; ++trial) {
    see(random, 300.0, 20.0, 0, 30, false);
    assert_int_equal(run(usual()), LostStatus::kNotFound);
  }
}

/// The right place, but every other place of a lattice is as good.
void test_lattice_is_ambiguous(void**) {
  Random random(25);
  field.clear();
  for (int i = 0; i < 60; ++i) {
    for (int k = 0; k < 60; ++k) {
      field.push_back({Vec2(501.0 + i + 0.03 * normal(random), -199.0 + k + 0.03 * normal(random)), 0.2F});
    }
  }
  lay_map(62.0);
  see(random, 62.0, 5.0, 40, 10, false);
  assert_int_equal(run(usual()), LostStatus::kAmbiguous);
  assert_true(search.hits().size() > 1);
  assert_true(search.behind_nats() < usual().margin_nats);
}

/// The same ground twice, each time with errors of its own: the other one is seen whichever pair found one.
void test_ground_that_repeats_is_seen_twice(void**) {
  for (std::uint64_t seed = 40; seed < 100; ++seed) {
    Random random(seed);
    field.clear();
    for (int i = 0; i < 500; ++i) {
      const Vec2 p(500.0 + uniform(random, 0.3, 29.7), -200.0 + uniform(random, 0.3, 59.7));
      for (const double copy : {0.0, 30.0})
        field.push_back({p + Vec2(copy + 0.04 * normal(random), 0.04 * normal(random)), 0.2F});
    }
    lay_map(60.0);
    do see(random, 60.0, 5.0, 20, 8, false);
    while (std::fabs(truth.x_m - 530.0) < 5.0);
    const double away_m = truth.x_m < 530.0 ? 30.0 : -30.0;
    static_cast<void>(run(usual()));
    bool here = false;
    bool there = false;
    for (const SearchHit& hit : search.hits()) {
      const Vec2 off = hit.T_map_site.translation() - truth.translation();
      here = here || off.norm() < 0.5;
      there = there || (off - Vec2(away_m, 0.0)).norm() < 0.5;
    }
    assert_true(here && there);
  }
}

/// So are the other places of a lattice where the heading is all but outside the sector.
void test_lattice_at_the_edge_of_the_sector(void**) {
  for (std::uint64_t seed = 100; seed < 120; ++seed) {
    Random random(seed);
    field.clear();
    for (int i = 0; i < 30; ++i) {
      for (int k = 0; k < 30; ++k) {
        field.push_back({Vec2(501.0 + i + 0.04 * normal(random), -199.0 + k + 0.04 * normal(random)), 0.2F});
      }
    }
    lay_map(32.0);
    see(random, 32.0, 4.0, 20, 4, false);
    SearchRegion region;
    region.anywhere = false;
    region.centre_map_m = truth.translation();
    region.radius_m = 5.0;
    region.half_sector_rad = 0.4;
    region.yaw_rad = truth.yaw_rad + 0.395;
    static_cast<void>(run(usual(), region));
    assert_at_least(search.hits().size(), 6);
  }
}

/// A disc and a sector are kept: found inside, not looked for outside.
void test_region(void**) {
  Random random(26);
  scatter(random, 3000, 300.0);
  see(random, 300.0, 20.0, 20, 20, false);
  SearchRegion region;
  region.anywhere = false;
  region.centre_map_m = truth.translation() + Vec2(15.0, 0.0);
  region.radius_m = 20.0;
  assert_int_equal(run(usual(), region), LostStatus::kFound);
  const std::uint32_t few = search.hypotheses();
  region.radius_m = 14.0;
  assert_int_equal(run(usual(), region), LostStatus::kNotFound);
  region.radius_m = 20.0;
  region.yaw_rad = truth.yaw_rad + 0.3;
  region.half_sector_rad = 0.4;
  assert_int_equal(run(usual(), region), LostStatus::kFound);
  assert_true(search.hypotheses() < few);
  region.half_sector_rad = 0.2;
  assert_int_equal(run(usual(), region), LostStatus::kNotFound);
}

/// A smaller region asks for less evidence: the volume is the score's.
void test_volume_is_paid_for(void**) {
  Random random(27);
  scatter(random, 3000, 300.0);
  see(random, 300.0, 20.0, 20, 20, false);
  assert_int_equal(run(usual()), LostStatus::kFound);
  const double anywhere = search.hits()[0].score_nats;
  SearchRegion region;
  region.anywhere = false;
  region.centre_map_m = truth.translation();
  region.radius_m = 10.0;
  region.yaw_rad = truth.yaw_rad;
  region.half_sector_rad = 0.1;
  assert_int_equal(run(usual(), region), LostStatus::kFound);
  const double gain = std::log(300.0 * 300.0 * 2.0 * kPi) - std::log(kPi * 100.0 * 0.2);
  assert_true(std::fabs(search.hits()[0].score_nats - anywhere - gain) < 1e-6);
}

void test_statuses(void**) {
  Random random(28);
  assert_int_equal(LostSearch().status(), LostStatus::kIdle);
  scatter(random, 500, 100.0);
  see(random, 100.0, 20.0, 3, 0, false);
  assert_int_equal(run(usual()), LostStatus::kTooFewBoulders);
  local_map.clear();
  for (int i = 0; i < 10; ++i) {
    LocalBoulder b;
    b.p_site_m = Vec2(0.01 * i, 0.0);
    assert_true(local_map.push_back(b));
  }
  assert_int_equal(run(usual()), LostStatus::kTooFewBoulders);  // all in one place
  see(random, 100.0, 20.0, 20, 0, false);
  local_map[3].p_site_m.x() = std::numeric_limits<double>::quiet_NaN();
  assert_int_equal(run(usual()), LostStatus::kBadInput);
  see(random, 100.0, 20.0, 20, 0, false);
  for (int k = 0; k < 6; ++k) {
    LostSearchParams p = usual();
    double* const numbers[] = {&p.sigma_pair_m, &p.drift,       &p.true_share,
                               &p.sigma_size,   &p.accept_nats, &p.floor_nats};
    *numbers[k] = -1.0;
    assert_int_equal(run(p), LostStatus::kBadInput);
    *numbers[k] = std::numeric_limits<double>::quiet_NaN();
    assert_int_equal(run(p), LostStatus::kBadInput);
  }
  SearchRegion region;
  region.anywhere = false;
  assert_int_equal(run(usual(), region), LostStatus::kBadInput);  // a disc without a radius
  assert_true(map.begin(Vec2(0.0, 0.0), Vec2(10.0, 10.0), 0.1));
  assert_int_equal(run(usual()), LostStatus::kNoMap);  // not through its steps
  assert_true(test::run_whole(map));
  assert_int_equal(run(usual()), LostStatus::kNoMap);  // empty
}

void test_work_is_bounded(void**) {
  Random random(29);
  scatter(random, 8500, 77.0);
  see(random, 77.0, 4.0, 0, 75, false);
  LostSearchParams p = usual();
  p.max_ops = 1000000;
  assert_int_equal(run(p), LostStatus::kNotFound);
  assert_int_equal(search.pairs_tried(), 2);  // those in hand are finished
  p = usual();
  p.max_pairs = 3;
  assert_int_equal(run(p), LostStatus::kNotFound);
  assert_int_equal(search.pairs_tried(), 3);
}

void test_same_for_every_slicing(void**) {
  Random random(30);
  scatter(random, 1000, 60.0);
  see(random, 60.0, 8.0, 25, 20, true);
  LostSearchParams p = usual();
  p.sigma_size = 0.2;
  assert_int_equal(run(p), LostStatus::kFound);
  assert_int_equal(other.start(p, map, local_map, Vec2(0.0, 0.0), SearchRegion()), LostStatus::kRunning);
  int steps = 1;
  for (WorkBudget slice(1); other.step(slice) == Progress::kMore;
       slice = WorkBudget(steps % 3 == 0 ? 1 : 101))
    ++steps;
  assert_true(steps > 500);
  assert_int_equal(other.status(), search.status());
  assert_int_equal(other.hits().size(), search.hits().size());
  assert_int_equal(other.hypotheses(), search.hypotheses());
  assert_true(other.ops() == search.ops());
  for (std::size_t i = 0; i < search.hits().size(); ++i) {
    assert_true(other.hits()[i].score_nats == search.hits()[i].score_nats);
    assert_true(other.hits()[i].T_map_site.x_m == search.hits()[i].T_map_site.x_m);
    assert_true(other.hits()[i].T_map_site.yaw_rad == search.hits()[i].T_map_site.yaw_rad);
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_found_in_a_square_kilometre),
      cmocka_unit_test(test_drift_that_was_not),
      cmocka_unit_test(test_drift_that_was),
      cmocka_unit_test(test_no_pair_of_the_map_is_missed),
      cmocka_unit_test(test_found_on_dense_ground),
      cmocka_unit_test(test_sizes_are_evidence),
      cmocka_unit_test(test_another_place_is_not_found),
      cmocka_unit_test(test_lattice_is_ambiguous),
      cmocka_unit_test(test_ground_that_repeats_is_seen_twice),
      cmocka_unit_test(test_lattice_at_the_edge_of_the_sector),
      cmocka_unit_test(test_region),
      cmocka_unit_test(test_volume_is_paid_for),
      cmocka_unit_test(test_statuses),
      cmocka_unit_test(test_work_is_bounded),
      cmocka_unit_test(test_same_for_every_slicing),
  };
  return cmocka_run_group_tests_name("registration/lost_search", tests, nullptr, nullptr);
}
