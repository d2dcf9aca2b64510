// Large boulders over time: which survey goes on which landmark, what is forgotten, kept and offered.
#include "localizer/landmarks.hpp"

#include "support/cmocka.hpp"

using namespace cairn;

namespace {

Landmarks landmarks;
Relief::Boulders survey;
LocalMap map;

constexpr double kSure_m = 12.0;
constexpr double kFresh_m = 25.0;

void fresh() {
  LandmarkParams p;
  p.least_pixel_m = 0.2;
  p.window_m = 60.0;
  p.same_m = 0.5;
  p.min_diameter_m = 0.35;
  landmarks.init(p);
}

ReliefBoulder at(double x, double y, double diameter, double way_m, double open = 0.0) {
  ReliefBoulder b;
  b.p_site_m = Vec2(x, y);
  b.diameter_m = diameter;
  b.sigma_m = 0.1;
  b.way_m = way_m;
  b.open_share = open;
  return b;
}

/// The rover drives along x.
void take(std::initializer_list<ReliefBoulder> boulders, double x, double way_m) {
  survey.clear();
  for (ReliefBoulder b : boulders) {
    b.range_m = (b.p_site_m - Vec2(x, 0.0)).norm();
    survey.append(b);
  }
  landmarks.start(survey, Vec2(x, 0.0), way_m, kSure_m, kFresh_m);
  WorkBudget all = WorkBudget::unlimited();
  assert_status(landmarks.step(all), Progress::kDone);
}

const LocalMap& offered(double way_m, double pixel_m = 0.25) {
  landmarks.build(pixel_m, way_m, map);
  return map;
}

void test_serves_coarse_maps(void**) {
  fresh();
  assert_true(landmarks.serve(0.25));
  assert_true(landmarks.serve(0.2));
  assert_false(landmarks.serve(0.05));
  assert_false(landmarks.serve(0.0));  // a table: nobody knows
  LandmarkParams none;
  none.least_pixel_m = 0.0;
  landmarks.init(none);
  assert_false(landmarks.serve(0.25));
}

// The newest survey's word on a boulder stands, under its number.
void test_goes_on(void**) {
  fresh();
  take({at(5.0, 2.0, 0.8, 0.0), at(7.0, -3.0, 1.5, 0.0)}, 0.0, 0.0);
  take({at(7.3, -2.7, 1.6, 2.0), at(5.2, 2.0, 0.9, 2.0), at(9.0, 0.0, 1.0, 2.0)}, 2.0, 2.0);
  assert_int_equal(landmarks.size(), 3);
  assert_int_equal(landmarks.created(), 3);
  const LocalMap& m = offered(2.0);
  assert_int_equal(m.size(), 3);
  assert_int_equal(m[0].id, 0);
  assert_near(m[0].p_site_m.x(), 5.2, 0.0);
  assert_int_equal(m[0].sightings, 2);
  assert_near(m[1].p_site_m.x(), 7.3, 0.0);
  assert_near(m[1].diameter_m, 1.6 - LandmarkParams().rims_m, 1.0e-6);
  assert_int_equal(m[2].sightings, 1);
}

// What a survey should show and does not was a part of another one, or nothing. What is far, or was seen so
// long ago that the relief has dropped it, stays.
void test_forgets_what_is_not_found(void**) {
  fresh();
  take({at(5.0, 2.0, 0.8, 0.0), at(-10.0, 0.0, 1.0, 0.0)}, 0.0, 0.0);
  take({}, 3.0, 3.0);
  assert_int_equal(landmarks.size(), 1);
  assert_near(offered(3.0)[0].p_site_m.x(), -10.0, 0.0);
  take({}, -9.0, 26.0);  // back there
  assert_int_equal(landmarks.size(), 1);
  take({}, 0.0, 61.0);  // beyond the window of way
  assert_int_equal(landmarks.size(), 0);
}

void test_beyond_what_is_sure_nothing_changes(void**) {
  fresh();
  take({at(11.0, 0.0, 0.8, 0.0)}, 0.0, 0.0);
  take({at(11.2, 0.0, 0.4, 0.0), at(30.0, 0.0, 1.0, 24.0)}, 24.0, 24.0);
  const LocalMap& m = offered(24.0, 0.2);
  assert_int_equal(m.size(), 2);
  assert_near(m[0].p_site_m.x(), 11.0, 0.0);
}

void test_offers_what_the_map_can_hold(void**) {
  fresh();
  const double rims = LandmarkParams().rims_m;
  take({at(4.0, 0.0, 0.5 + rims, 0.0), at(5.0, 2.0, 0.65 + rims, 0.0), at(7.0, 0.0, 1.3 + rims, 0.0),
        at(7.0, 3.0, 1.8 + rims, 0.0, 0.6)},
       0.0, 0.0);
  assert_int_equal(offered(0.0, 0.2).size(), 3);
  assert_int_equal(offered(0.0, 0.25).size(), 2);
  assert_int_equal(offered(0.0, 0.5).size(), 1);
}

// Sigma grows with the way since a boulder was seen, faster than its root; boulders in view are told apart.
void test_drift_between_boulders(void**) {
  fresh();
  take({at(5.0, 0.0, 1.0, 0.0)}, 0.0, 0.0);
  take({at(25.0, 0.0, 1.0, 20.0)}, 20.0, 20.0);
  const LocalMap& m = offered(20.0);
  assert_int_equal(m.size(), 2);
  const LandmarkParams p;
  const double own2 = 0.01 + 25.0 * p.range_share * p.range_share;
  assert_near(m[1].sigma_m, std::sqrt(own2), 1.0e-6);
  assert_near(m[0].sigma_m,
              std::sqrt(own2 + p.noise_m * p.noise_m * 20.0 + 400.0 * p.drift_share * p.drift_share), 1.0e-6);
  assert_true(m[0].sigma_m > 0.12F);
  assert_true(m[1].in_view);
  assert_false(m[0].in_view);
}

/// However often a landmark is seen and a fix made of it, all fixes together take from it what the last and
/// best sight of it tells: never more than where the map has it is known.
void test_nothing_is_told_twice(void**) {
  constexpr double kPixel_m = 0.25;
  const LandmarkParams p;
  const auto tells = [&](const LocalBoulder& b) {
    const double pair = landmarks.sigma_pair_m(kPixel_m);
    return 1.0 / (static_cast<double>(b.sigma_m * b.sigma_m) + pair * pair);
  };
  fresh();
  take({at(10.0, 0.0, 1.0, 0.0), at(10.0, 3.0, 1.0, 0.0)}, 0.0, 0.0);
  LocalMap used = offered(0.0);
  assert_true(used[0].fresh == 1.0F && used[1].fresh == 1.0F);
  double told = tells(used[0]);
  used[0].fresh = 0.0F;  // of the two, a fix was made of it
  landmarks.used(used, kPixel_m);
  assert_true(offered(0.0)[0].fresh == 0.0F);
  assert_true(map[1].fresh == 1.0F);
  int again = 0;
  for (double x = 1.0; x < 9.0; x += 1.0) {
    take({at(10.0, 0.0, 1.0, x), at(10.0, 3.0, 1.0, x)}, x, x);
    LocalMap now = offered(x);
    again += now[0].fresh > 0.0F ? 1 : 0;
    told += tells(now[0]) * static_cast<double>(now[0].fresh);
    assert_near(told / tells(now[0]), 1.0, 1.0e-3);
    assert_at_most(told, 1.0 / std::pow(landmarks.sigma_pair_m(kPixel_m), 2));
    now[0].fresh = 0.0F;
    landmarks.used(now, kPixel_m);
    assert_true(offered(x)[0].fresh == 0.0F);
  }
  assert_at_least(again, 8);
  // Left behind, it is known ever worse against the rover.
  take({}, 40.0, 40.0);
  assert_true(offered(40.0)[0].fresh == 0.0F);
  // A fix made of it there takes nothing back: seen again as well as before, it has nothing new.
  landmarks.used(offered(40.0), kPixel_m);
  take({at(10.0, 0.0, 1.0, 44.0), at(10.0, 3.0, 1.0, 44.0)}, 8.0, 44.0);
  assert_true(offered(44.0)[0].fresh == 0.0F);
}

/// What landmarks lie aside as one, by the side that they were seen from, is an error of all fixes by them,
/// as a map's own shift is; a fine pixel takes nothing of it.
void test_what_all_pairs_have_in_common(void**) {
  fresh();
  const LandmarkParams p;
  assert_near(landmarks.common_m(1.0e-6), p.common_own_m, 1.0e-9);
  assert_near(landmarks.common_m(1.0e3), p.common_share * 1.0e3, 1.0e-3);
  assert_near(landmarks.common_m(0.25), std::hypot(p.common_own_m, p.common_share * 0.25), 1.0e-9);
}

void test_full_replaces_the_oldest(void**) {
  fresh();
  const auto room = static_cast<int>(cfg::kMaxLandmarks);
  for (int k = 0; k <= room; ++k) take({at(20.0 * k + 3.0, 0.0, 1.0, 0.01 * k)}, 20.0 * k, 0.01 * k);
  assert_int_equal(landmarks.size(), cfg::kMaxLandmarks);
  assert_int_equal(landmarks.created(), room + 1);
  bool first = false;
  for (const LocalBoulder& b : offered(1.0)) first = first || b.id == 0;
  assert_false(first);
}

void test_slices_do_not_matter(void**) {
  fresh();
  survey.clear();
  for (int k = 0; k < 7; ++k) survey.append(at(1.5 * k, 0.0, 1.0, 0.0));
  landmarks.start(survey, Vec2(0.0, 0.0), 0.0, kSure_m, kFresh_m);
  int steps = 0;
  while (landmarks.open()) {
    WorkBudget one(1);
    (void)landmarks.step(one);
    ++steps;
  }
  assert_int_equal(steps, 8);
  assert_int_equal(landmarks.size(), 7);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_serves_coarse_maps),
      cmocka_unit_test(test_goes_on),
      cmocka_unit_test(test_forgets_what_is_not_found),
      cmocka_unit_test(test_beyond_what_is_sure_nothing_changes),
      cmocka_unit_test(test_offers_what_the_map_can_hold),
      cmocka_unit_test(test_drift_between_boulders),
      cmocka_unit_test(test_nothing_is_told_twice),
      cmocka_unit_test(test_what_all_pairs_have_in_common),
      cmocka_unit_test(test_full_replaces_the_oldest),
      cmocka_unit_test(test_slices_do_not_matter),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
