// A hypothesis carried along: no boulder counts twice, odometry's errors go into it, and what ends it.
#include "localizer/carried_hypothesis.hpp"

#include <cmath>

#include "support/cmocka.hpp"

using namespace cairn;

namespace {

Verdict window(VerdictStatus status, double log_ratio) {
  Verdict v;
  v.status = status;
  v.log_ratio = log_ratio;
  v.chance_log = 30.0;
  return v;
}
Verdict poor(double log_ratio) { return window(VerdictStatus::kTooLittleEvidence, log_ratio); }

LocalMap boulders(double first_x_m, std::size_t count) {
  LocalMap out;
  for (std::size_t i = 0; i < count; ++i) {
    LocalBoulder b;
    b.p_site_m = Vec2(first_x_m + static_cast<double>(i), 0.0);
    out.append(b);
  }
  return out;
}

const Mat3 covariance = Vec3(0.0025, 0.0016, 1e-4).asDiagonal();

CarriedHypothesis begun(double log_ratio = 8.0) {
  CarriedHypothesis h;
  h.begin(poor(log_ratio), Pose2{1.0, 2.0, 0.5}, covariance, boulders(0.0, 5));
  return h;
}

PlanarStep step_of(double x_m) {
  PlanarStep step;
  step.d_map_m = Vec2(x_m, 0.0);
  return step;
}

void carry(CarriedHypothesis& h, const PoseFusion& fusion, double yaw_rad = 0.5) {
  h.carry(fusion, yaw_rad, 0.3, 0.1);
}

PoseFusion driven(double x_m) {
  PoseFusion fusion;
  fusion.init(FusionParams(), 0.05, 0.01);
  fusion.propagate(step_of(x_m));
  return fusion;
}

/// Those of the windows before, and what may be one of them by odometry's errors.
void test_no_boulder_counts_twice(void**) {
  CarriedHypothesis h = begun();
  LocalMap local = boulders(3.0, 4);  // two of the first window
  assert_int_equal(h.mark(local, Vec2(0.0, 0.0)), 2);
  assert_true(local[1].counted && !local[2].counted);
  h.add(poor(1.0), h.T_map_site(), covariance, local);
  assert_int_equal(h.mark(local, Vec2(0.0, 0.0)), 0);

  LocalMap beside = boulders(0.3, 1);  // a block of the same cluster
  assert_int_equal(h.mark(beside, Vec2(0.0, 0.0)), 0);
  LocalMap aside = boulders(0.5, 1);
  aside[0].p_site_m.y() = 0.2;
  assert_int_equal(h.mark(aside, Vec2(0.0, 0.0)), 1);
  for (int k = 0; k < 5; ++k) carry(h, driven(2.0));
  assert_true(h.alive());
  assert_int_equal(h.mark(aside, Vec2(0.0, 0.0)), 0);
}

/// A turn that odometry does not know of moves what lies far from the rover, and little beside it.
void test_the_reach_grows_with_the_distance(void**) {
  CarriedHypothesis h = begun();
  for (int k = 0; k < 5; ++k) carry(h, driven(0.5));
  LocalMap aside = boulders(0.0, 1);
  aside[0].p_site_m.y() = 0.7;
  assert_int_equal(h.mark(aside, Vec2(0.0, 0.0)), 1);
  assert_int_equal(h.mark(aside, Vec2(0.0, -60.0)), 0);
}

void test_windows_prove_it_together(void**) {
  const VerdictParams params;
  CarriedHypothesis h = begun(6.0);
  LocalMap local = boulders(10.0, 5);
  h.mark(local, Vec2(0.0, 0.0));
  assert_status(h.sum().verdict(params), VerdictStatus::kTooLittleEvidence);
  h.add(poor(6.0), Pose2{1.01, 2.0, 0.5}, 0.5 * covariance, local);
  assert_status(h.sum().verdict(params), VerdictStatus::kAccepted);
  assert_int_equal(h.sum().windows(), 2);
  assert_near(h.T_map_site().x_m, 1.01, 0.0);
  assert_near(h.covariance()(0, 0), 0.5 * covariance(0, 0), 0.0);
}

/// Its heading is an eighth of a turn on from the pose's: a step along the pose's x takes it north-east, and
/// what its yaw may be off moves it north-west or south-east.
void test_steps_in_its_own_axes(void**) {
  CarriedHypothesis h;
  const Mat3 yaw_alone = Vec3(1e-6, 1e-6, 1e-3).asDiagonal();
  h.begin(poor(8.0), Pose2{1.0, 2.0, 0.5}, yaw_alone, boulders(0.0, 5));
  carry(h, driven(4.0), 0.5 - 0.25 * kPi);
  const double along = 0.5 * std::pow(4.0 * FusionParams().sigma_scale, 2);  // of the scale: north-east
  assert_near(h.covariance()(0, 1), along - 0.5 * 16.0 * 1e-3, 2e-4);
}

/// In the hypothesis' own heading: on a drive along its y axis what grows is x, by what its yaw may be off.
void test_odometry_carries_it(void**) {
  CarriedHypothesis h = begun();
  const PoseFusion fusion = driven(4.0);
  carry(h, fusion, 0.5 - 0.5 * kPi);
  assert_at_least(h.covariance()(0, 0), covariance(0, 0) + 16.0 * covariance(2, 2));
  assert_at_most(h.covariance()(1, 1),
                 covariance(1, 1) + std::pow(4.0 * FusionParams().sigma_scale, 2) + 0.001);
  assert_near(h.T_map_site().x_m, 1.0, 0.0);  // the site stays where it is
  const Mat3 same = fusion.carried(covariance);
  CarriedHypothesis straight = begun();
  carry(straight, fusion);
  for (int i = 0; i < 9; ++i) assert_near(straight.covariance()(i / 3, i % 3), same(i / 3, i % 3), 1e-12);
}

void test_what_ends_it(void**) {
  LocalMap local = boulders(10.0, 5);
  CarriedHypothesis h = begun(2.0);
  h.add(window(VerdictStatus::kNoHypothesis, -4.0), h.T_map_site(), covariance, local);
  assert_true(h.alive());
  h.add(window(VerdictStatus::kNoHypothesis, -4.0), h.T_map_site(), covariance, local);
  assert_false(h.alive());  // speaks against itself

  h = begun();
  h.add(window(VerdictStatus::kInconsistentWithPrior, 1.0), h.T_map_site(), covariance, local);
  assert_false(h.alive());  // contradicted

  h = begun();
  carry(h, driven(40.0));
  assert_false(h.alive());  // as uncertain as a start that is not known

  const Mat3 turned = Vec3(0.0025, 0.0016, 0.02).asDiagonal();  // 0.14 rad, of 0.1
  h.begin(poor(8.0), Pose2{1.0, 2.0, 0.5}, turned, boulders(0.0, 5));
  carry(h, driven(0.01));
  assert_false(h.alive());  // the same of its heading

  h = begun();
  const std::size_t room = CarriedHypothesis::kPlaces - 5;
  h.add(poor(1.0), h.T_map_site(), covariance, boulders(10.0, room));
  assert_true(h.alive());
  h.add(poor(1.0), h.T_map_site(), covariance, boulders(1000.0, 1));
  assert_false(h.alive());  // no room to tell which counted

  h = begun();
  h.reset();
  assert_false(h.alive());
  assert_int_equal(h.mark(local, Vec2(0.0, 0.0)), local.size());
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_no_boulder_counts_twice),
      cmocka_unit_test(test_the_reach_grows_with_the_distance),
      cmocka_unit_test(test_windows_prove_it_together),
      cmocka_unit_test(test_steps_in_its_own_axes),
      cmocka_unit_test(test_odometry_carries_it),
      cmocka_unit_test(test_what_ends_it),
  };
  return cmocka_run_group_tests_name("localizer/carried_hypothesis", tests, nullptr, nullptr);
}
