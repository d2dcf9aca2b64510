// How many of some events happen, against counting every outcome; the detection curve and its fit.
#include "base/event_count.hpp"

#include <cmath>

#include "forecast/detection.hpp"
#include "forecast/unmapped.hpp"
#include "sim/rocks.hpp"
#include "support/cmocka.hpp"
#include "support/noise.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

std::vector<double> drawn(Random& random, std::size_t n) {
  std::vector<double> p;
  for (std::size_t i = 0; i < n; ++i) p.push_back(test::uniform(random, 0.0, 1.0));
  return p;
}

/// Of each of the 2^n outcomes its probability, and what happened in it.
template <typename Visit>
void for_each_outcome(const std::vector<double>& p, const Visit& visit) {
  for (std::uint32_t outcome = 0; outcome < (1U << p.size()); ++outcome) {
    double probability = 1.0;
    std::size_t events = 0;
    for (std::size_t i = 0; i < p.size(); ++i) {
      const bool happens = ((outcome >> i) & 1U) != 0;
      probability *= happens ? p[i] : 1.0 - p[i];
      events += happens ? 1 : 0;
    }
    visit(outcome, probability, events);
  }
}

void test_counts_against_every_outcome(void**) {
  Random random(1);
  for (std::size_t n = 0; n <= 12; ++n) {
    static std::vector<double> p;
    static std::vector<double> expected;
    p = drawn(random, n);
    if (n > 3) p[1] = 0.0;
    if (n > 4) p[3] = 1.0;
    expected.assign(n + 2, 0.0);
    for_each_outcome(
        p, [](std::uint32_t, double probability, std::size_t events) { expected[events] += probability; });
    double tail = 0.0;
    for (std::size_t k = n + 2; k-- > 0;) {
      assert_near(at_most(p, k), 1.0 - tail, 1e-14);
      tail += expected[k];
      assert_near(at_least(p, k), tail, 1e-14);
    }
  }
}

/// What hardly ever happens keeps its digits.
void test_small_tails(void**) {
  const std::vector<double> p(20, 0.99);
  assert_near(at_most(p, 0) / 1e-40, 1.0, 1e-12);
  assert_near(at_most(p, 1) / (20.0 * 0.99 * 1e-38 + 1e-40), 1.0, 1e-12);
}

void test_conditions_against_every_outcome(void**) {
  Random random(2);
  static std::vector<double> p;
  p = drawn(random, 10);
  for (std::size_t least = 0; least <= 11; ++least) {
    static std::vector<double> expected;
    static double all;
    expected.assign(p.size(), 0.0);
    all = 0.0;
    static std::size_t wanted;
    wanted = least;
    for_each_outcome(p, [](std::uint32_t outcome, double probability, std::size_t events) {
      if (events < wanted) return;
      all += probability;
      for (std::size_t i = 0; i < p.size(); ++i)
        expected[i] += ((outcome >> i) & 1U) != 0 ? probability : 0.0;
    });
    const std::vector<double> given = given_at_least(p, least);
    for (std::size_t i = 0; i < p.size(); ++i)
      assert_near(given[i], all > 0.0 ? expected[i] / all : 0.0, 1e-12);
  }
}

/// Far in the tail nothing cancels: the binomial's last term.
void test_far_tails_keep_their_digits(void**) {
  const std::vector<double> p(60, 0.01);
  assert_near(at_least(p, 60) / std::pow(0.01, 60), 1.0, 1e-12);
  assert_near(at_least(p, 61), 0.0, 0.0);
  assert_near(given_at_least(p, 60)[7], 1.0, 1e-12);
  assert_near(at_least({}, 0), 1.0, 0.0);
  assert_near(at_least({}, 1), 0.0, 0.0);
}

void test_curve(void**) {
  const DetectionCurve curve{0.8, 0.12, 4.0, 0.5};
  assert_near(curve(0.12), 0.4, 1e-15);
  assert_near(curve(0.0), 0.0, 0.0);
  assert_near(curve(-1.0), 0.0, 0.0);
  assert_near(curve(100.0), 0.8, 1e-9);
  assert_near(curve(0.24), 0.8 / (1.0 + std::pow(0.5, 4.0)), 1e-15);
}

/// Looks drawn from a known curve, a part of them paired by chance.
void test_a_curve_is_found_again(void**) {
  const DetectionCurve truth{0.75, 0.14, 5.0, 0.0};
  static std::vector<Look> looks;
  Random random(3);
  for (int i = 0; i < 40000; ++i) {
    Look look;
    look.diameter_m = std::exp(test::uniform(random, std::log(0.03), std::log(1.0)));
    look.confidence = i % 2 == 0 ? 1.0 : 0.6;
    look.by_chance = 0.08;
    look.paired = test::uniform(random, 0.0, 1.0) < look.confidence * truth(look.diameter_m) ||
                  test::uniform(random, 0.0, 1.0) < look.by_chance;
    looks.push_back(look);
  }
  const DetectionFit fit = fit_detection({looks});
  assert_int_equal(fit.looks, looks.size());
  assert_near(fit.curve.most, truth.most, 0.015);
  assert_near(fit.curve.half_m, truth.half_m, 0.004);
  assert_near(fit.curve.power, truth.power, 0.4);
}

/// However one-sided the drives are, the curve stays in its ranges.
void test_fits_of_nothing_but_hits_or_misses(void**) {
  for (const bool paired : {false, true}) {
    const DetectionFit fit = fit_detection({std::vector<Look>(50, Look{0.2, 1.0, 0.0, paired})});
    assert_true(fit.curve.most >= 0.02 && fit.curve.most <= 1.0);
    assert_true(fit.curve.half_m >= 0.0049 && fit.curve.half_m <= 2.001);
    assert_true(fit.curve.power >= 0.499 && fit.curve.power <= 20.001);
    if (paired) {
      assert_at_least(fit.curve(0.2), 0.99);
    } else {
      assert_at_most(fit.curve(0.2), 0.021);
    }
    assert_int_equal(fit.paired, paired ? 50 : 0);
  }
}

/// A drive where nothing is found as elsewhere: the spread is that of the drives.
void test_drives_differ(void**) {
  static std::vector<std::vector<Look>> drives;
  Random random(4);
  const DetectionCurve truth{0.6, 0.1, 6.0, 1.0};
  for (const double shift : {-1.0, 0.0, 1.0}) {
    drives.emplace_back();
    for (int i = 0; i < 10000; ++i) {
      Look look;
      look.diameter_m = test::uniform(random, 0.05, 0.5);
      look.paired = test::uniform(random, 0.0, 1.0) < truth(look.diameter_m, shift);
      drives.back().push_back(look);
    }
  }
  drives.emplace_back();  // one that saw nothing changes nothing
  const DetectionFit fit = fit_detection(drives);
  assert_near(fit.curve.spread, 1.0, 0.08);
  assert_near(fit.curve.most, 0.6, 0.02);
  assert_near(fit.curve.half_m, 0.1, 0.005);
  // The shift of the log-odds, by hand; nodes that are those of the normal distribution.
  const double odds = 0.3 / 0.7 * std::exp(1.0);
  assert_near(truth(0.1, 1.0), odds / (1.0 + odds), 1e-12);
  double moments[5] = {};
  for (const ShiftNode& n : kShiftNodes) {
    for (int k = 0; k < 5; ++k) moments[k] += n.weight * std::pow(n.shift, k);
  }
  const double normal[5] = {1.0, 0.0, 1.0, 0.0, 3.0};
  for (int k = 0; k < 5; ++k) assert_near(moments[k], normal[k], 1e-12);
}

/// Boulders drawn from the law, the map cut off where its resolution ends.
void test_what_a_coarse_map_leaves_out(void**) {
  constexpr double k = 0.07;
  constexpr double kSide_m = 200.0;
  const MapExtent extent{0.0, 0.0, kSide_m, kSide_m};
  const DetectionCurve curve{0.7, 0.09, 6.0, 0.0};
  Random random(5);
  for (const double cut_m : {0.1, 0.2, 0.35}) {
    static std::vector<TableBoulder> boulders;
    boulders.clear();
    double expected = 0.0;
    constexpr double kStep_m = 0.002;
    for (double d = 0.04; d < 2.0; d += kStep_m) {
      const double per_m2 = sim::rocks_per_m2(k, d, d + kStep_m);
      if (d < cut_m) expected += per_m2 * curve(d + 0.5 * kStep_m);
      for (double n = per_m2 * kSide_m * kSide_m; d >= cut_m && test::uniform(random, 0.0, 1.0) < n;
           n -= 1.0) {
        TableBoulder b;
        b.diameter_m = d + test::uniform(random, 0.0, kStep_m);
        boulders.push_back(b);
      }
    }
    // The tenth percentile lies a little above the cut.
    assert_near(unmapped_per_m2(boulders, extent, curve) / expected, 1.1, 0.2);
    for (TableBoulder& b : boulders) b.confidence = 0.5;
    assert_true(unmapped_per_m2(boulders, extent, curve) < 0.8 * expected);
    boulders.resize(9);
    assert_near(unmapped_per_m2(boulders, extent, curve), 0.0, 0.0);
  }
  assert_near(unmapped_per_m2({}, extent, curve), 0.0, 0.0);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_counts_against_every_outcome),
      cmocka_unit_test(test_small_tails),
      cmocka_unit_test(test_conditions_against_every_outcome),
      cmocka_unit_test(test_far_tails_keep_their_digits),
      cmocka_unit_test(test_curve),
      cmocka_unit_test(test_a_curve_is_found_again),
      cmocka_unit_test(test_fits_of_nothing_but_hits_or_misses),
      cmocka_unit_test(test_drives_differ),
      cmocka_unit_test(test_what_a_coarse_map_leaves_out),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
