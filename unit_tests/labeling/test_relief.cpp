// Large boulders in the relief: synthetic ground and domes, seen along rays from a mast, so that the far side
// of a dome and what lies behind it are hidden as they are to a rover.
#include "labeling/relief.hpp"

#include <algorithm>
#include <cstring>

#include "core/random.hpp"
#include "core/trig.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

ReliefStorage<128> storage;  // 16 m
ReliefStorage<128> other_storage;
Relief relief;
Relief other;

constexpr double kAtSide_rad = 0.05;  // of the picture

struct Dome {
  Vec2 p;
  double radius;
  double height;
};

/// Ground and domes, in axes of the scene; `shift` puts it elsewhere in the site.
struct Scene {
  FixedVector<Dome, 4> domes;
  double slope_x = 0.0;
  double slope_y = 0.0;
  double rough_m = 0.0;
  Vec2 shift = Vec2(0.0, 0.0);

  double height(double x, double y) const {
    double z = slope_x * x + slope_y * y;
    for (const Dome& d : domes) {
      const double r2 =
          ((x - d.p.x()) * (x - d.p.x()) + (y - d.p.y()) * (y - d.p.y())) / (d.radius * d.radius);
      if (r2 < 1.0) z = std::max(z, slope_x * x + slope_y * y + d.height * std::sqrt(1.0 - r2));
    }
    return z;
  }
};

Relief& fresh(Relief& r = relief, ReliefStorage<128>& s = storage) {
  ReliefParams p;
  p.cell_m = 0.125;
  p.max_range_m = 8.0;
  p.sigma_per_range2 = 0.0008;
  r.init(p, s.grid());
  return r;
}

/// Looks from a mast 2 m above (x, y) along `yaw`, 66 degrees wide: rays marched to the ground.
void look(Relief& r, const Scene& scene, double x, double y, double yaw, double way_m = 0.0,
          double from_rad = -0.576, double to_rad = 0.576) {
  Random random(7);
  const Vec3 eye(x, y, scene.slope_x * x + scene.slope_y * y + 2.0);
  for (double side = from_rad; side <= to_rad; side += 0.008) {
    const SinCos turn = sin_cos(yaw + side);
    for (double down = 0.2; down < 0.8; down += 0.008) {
      const SinCos dip = sin_cos(down);
      const Vec3 ray(turn.cos * dip.cos, turn.sin * dip.cos, -dip.sin);
      for (double t = 1.0; t < 12.0; t += 0.01) {
        const Vec3 p = eye + ray * t;
        if (p.z() > scene.height(p.x(), p.y())) continue;
        const double rough = scene.rough_m * (2.0 * random.below(1001) / 1000.0 - 1.0);
        const bool inside = side > from_rad + kAtSide_rad && side < to_rad - kAtSide_rad;
        r.add(p + Vec3(scene.shift.x(), scene.shift.y(), rough), ray * t, way_m, inside);
        break;
      }
    }
  }
}

void survey(Relief& r, const Vec2& at, double way_m = 0.0) {
  r.start(at, way_m);
  WorkBudget all = WorkBudget::unlimited();
  assert_status(r.step(all), Progress::kDone);
}

const ReliefBoulder& only(const Relief& r) {
  assert_int_equal(r.result().size(), 1);
  return r.result()[0];
}

Scene with_dome(double x, double y, double radius = 0.5, double height = 0.4) {
  Scene scene;
  scene.domes.append({Vec2(x, y), radius, height});
  return scene;
}

void test_bare_ground_holds_nothing(void**) {
  Scene scene;
  scene.slope_x = 0.15;
  scene.slope_y = -0.1;
  scene.rough_m = 0.05;
  look(fresh(), scene, 0.0, 0.0, 0.0);
  survey(relief, Vec2(0.0, 0.0));
  assert_int_equal(relief.result().size(), 0);
}

// From one side: the mean of what is seen lies a fifth of a boulder on the near side; the centre does not.
void test_centre_from_one_side(void**) {
  for (const double slope : {0.0, 0.1}) {
    for (const double yaw : {0.0, 0.7, 2.5, -1.9}) {
      const SinCos turn = sin_cos(yaw);
      Scene scene = with_dome(5.0 * turn.cos, 5.0 * turn.sin);
      scene.slope_x = slope;
      look(fresh(), scene, 0.0, 0.0, yaw);
      survey(relief, Vec2(0.0, 0.0));
      const ReliefBoulder& b = only(relief);
      const Vec2 error = b.p_site_m - scene.domes[0].p;
      assert_at_most(error.norm(), 0.09);
      assert_at_most(error.norm(), 3.0 * b.sigma_m);
      assert_near(b.view.x(), turn.cos, 0.05);
      assert_near(b.view.y(), turn.sin, 0.05);
      assert_near(b.diameter_m, 1.0, 0.2);
      assert_near(b.height_m, 0.4, 0.12);
      assert_near(b.range_m, 5.0, 0.1);
    }
  }
}

// Stereo's windows carry a boulder's top over the ground that it hides: a tail behind it is none of it.
void test_a_tail_behind_it_is_ground(void**) {
  const Scene scene = with_dome(5.0, 0.0);
  look(fresh(), scene, 0.0, 0.0, 0.0);
  for (double x = 5.1; x < 6.6; x += 0.06) {
    for (double y = -0.25; y < 0.25; y += 0.06) {
      for (int k = 0; k < 10; ++k) relief.add(Vec3(x, y, 0.35), Vec3(x, y, -1.65), 0.0, true);
    }
  }
  survey(relief, Vec2(0.0, 0.0));
  const ReliefBoulder& b = only(relief);
  assert_at_most((b.p_site_m - scene.domes[0].p).norm(), 0.3);
  assert_at_most(b.diameter_m, 1.35);
}

// From a second side: closer, and surer.
void test_more_views_are_better(void**) {
  const Scene scene = with_dome(4.0, 0.0, 0.8, 0.6);
  look(fresh(), scene, 0.0, 0.0, 0.0);
  survey(relief, Vec2(0.0, 0.0));
  const double before = only(relief).sigma_m;
  look(relief, scene, 4.0, 4.0, -1.5708);
  look(relief, scene, 8.0, 0.0, 3.1416);
  survey(relief, Vec2(4.0, 0.0));
  const ReliefBoulder& b = only(relief);
  assert_at_most((b.p_site_m - scene.domes[0].p).norm(), 0.07);
  assert_at_most(b.sigma_m, 0.9 * before);
}

// Cut by the rim of the picture: it says so, until the rest comes into view.
void test_cut_is_known(void**) {
  const Scene scene = with_dome(4.0, 0.0, 0.8, 0.6);
  look(fresh(), scene, 0.0, 0.0, 0.0, 0.0, 0.02, 0.576);
  survey(relief, Vec2(0.0, 0.0));
  assert_at_least(only(relief).open_share, 0.2);
  look(relief, scene, 0.0, 0.0, 0.0);
  survey(relief, Vec2(0.0, 0.0));
  assert_at_most(only(relief).open_share, 0.12);
}

// Half of it lies beyond the side of every picture: its centre is not known, and its sigma says so; one view
// of it whole is enough.
void test_what_a_side_cuts_is_not_yet_placed(void**) {
  const Scene scene = with_dome(4.0, 0.0, 0.8, 0.6);
  look(fresh(), scene, 0.0, 0.0, 0.0, 0.0, 0.0, 0.576);
  look(relief, scene, 0.5, 0.0, 0.0, 0.0, 0.0, 0.576);
  survey(relief, Vec2(0.0, 0.0));
  const double off = (only(relief).p_site_m - scene.domes[0].p).norm();
  assert_at_least(off, 0.3);
  const double cut = only(relief).sigma_m;
  assert_at_least(3.0 * cut, off);
  look(relief, scene, 0.0, 0.0, 0.0);
  survey(relief, Vec2(0.0, 0.0));
  const double whole = only(relief).sigma_m;
  assert_at_most(whole, 0.7 * cut);
  look(relief, scene, 0.5, 0.0, 0.0, 0.0, 0.0, 0.576);
  survey(relief, Vec2(0.0, 0.0));
  assert_at_most(only(relief).sigma_m, whole + 0.01);
}

void test_low_and_small_things_are_no_boulders(void**) {
  Scene scene = with_dome(4.0, 0.0, 0.5, 0.09);
  scene.domes.append({Vec2(4.0, 1.5), 0.1, 0.3});
  look(fresh(), scene, 0.0, 0.0, 0.0);
  survey(relief, Vec2(0.0, 0.0));
  assert_int_equal(relief.result().size(), 0);
}

void test_two_stay_two(void**) {
  Scene scene = with_dome(4.0, -1.0);
  scene.domes.append({Vec2(4.0, 1.0), 0.5, 0.4});
  look(fresh(), scene, 0.0, 0.0, 0.0);
  survey(relief, Vec2(0.0, 0.0));
  assert_int_equal(relief.result().size(), 2);
}

// The grid is a torus: wherever the site's origin lies, by whole grids, the answer is the same.
void test_place_does_not_matter(void**) {
  Scene scene = with_dome(5.0, 0.6);
  look(fresh(), scene, 0.0, 0.0, 0.0);
  survey(relief, Vec2(0.0, 0.0));
  const ReliefBoulder here = only(relief);
  for (const double far : {-1600.0, 8000.0}) {
    scene.shift = Vec2(far, -far);
    look(fresh(), scene, 0.0, 0.0, 0.0);
    survey(relief, scene.shift);
    const ReliefBoulder& there = only(relief);
    assert_near((there.p_site_m - scene.shift - here.p_site_m).norm(), 0.0, 1.0e-6);
    assert_int_equal(there.cells, here.cells);
  }
  // Half a grid away the old cells are other places.
  survey(relief, scene.shift + Vec2(16.0, 0.0));
  assert_int_equal(relief.result().size(), 0);
}

// What was seen a long way ago counts no more: odometry has drifted meanwhile.
void test_old_views_are_dropped(void**) {
  const Scene scene = with_dome(5.0, 0.0);
  look(fresh(), scene, 0.0, 0.0, 0.0, 0.0);
  survey(relief, Vec2(0.0, 0.0), 20.0);
  assert_near(only(relief).way_m, 0.0, 0.11);
  survey(relief, Vec2(0.0, 0.0), 40.0);
  assert_int_equal(relief.result().size(), 0);
  look(relief, Scene(), 0.0, 0.0, 0.0, 40.0);  // drifted: flat now
  survey(relief, Vec2(0.0, 0.0), 40.0);
  assert_int_equal(relief.result().size(), 0);
}

// A swell of six metres is no boulder, however high it stands; one of two metres is.
void test_swells_are_no_boulders(void**) {
  look(fresh(), with_dome(6.0, 0.0, 1.0, 0.7), 0.0, 0.0, 0.0);
  survey(relief, Vec2(0.0, 0.0));
  assert_int_equal(relief.result().size(), 1);
  look(fresh(), with_dome(7.5, 0.0, 3.0, 0.8), 0.0, 0.0, 0.0);
  survey(relief, Vec2(0.0, 0.0));
  assert_int_equal(relief.result().size(), 0);
}

void test_too_large_is_counted(void**) {
  Scene scene;  // a wall across the view: more cells than a boulder has
  scene.domes.append({Vec2(6.0, 0.0), 3.5, 1.2});
  look(fresh(), scene, 0.0, 0.0, 0.0);
  look(relief, scene, 0.0, 3.0, -0.4);
  look(relief, scene, 1.0, -4.0, 0.6);
  survey(relief, Vec2(0.0, 0.0));
  assert_true(relief.dropped() > 0 || relief.result().size() <= 1);
}

void test_absurd_points_are_left_out(void**) {
  fresh();
  relief.add(Vec3(1.0e9, 0.0, 1.0), Vec3(2.0, 0.0, -1.0), 0.0, true);
  relief.add(Vec3(1.0, 0.0, 1.0), Vec3(20.0, 0.0, -1.0), 0.0, true);
  relief.add(Vec3(std::nan(""), 0.0, 1.0), Vec3(2.0, 0.0, -1.0), 0.0, true);
  survey(relief, Vec2(0.0, 0.0));
  assert_int_equal(relief.result().size(), 0);
  relief.start(Vec2(1.0e9, 0.0), 0.0);
  assert_false(relief.surveying());
}

void test_slices_do_not_matter(void**) {
  Scene scene = with_dome(4.0, -1.2, 0.7, 0.5);
  scene.domes.append({Vec2(5.0, 1.0), 0.5, 0.4});
  scene.rough_m = 0.03;
  look(fresh(), scene, 0.0, 0.0, 0.0);
  look(fresh(other, other_storage), scene, 0.0, 0.0, 0.0);
  survey(relief, Vec2(0.0, 0.0));
  other.start(Vec2(0.0, 0.0), 0.0);
  std::uint32_t slice = 1;
  while (other.surveying()) {
    WorkBudget budget(slice);
    (void)other.step(budget);
    assert_at_most(budget.spent(), 4999.0 + slice);
    slice = slice % 7919 * 3 + 1;
  }
  assert_int_equal(other.result().size(), relief.result().size());
  assert_true(relief.result().size() >= 2);
  for (std::size_t i = 0; i < relief.result().size(); ++i) {
    assert_true(other.result()[i].p_site_m == relief.result()[i].p_site_m);
    assert_true(other.result()[i].sigma_m == relief.result()[i].sigma_m);
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_bare_ground_holds_nothing),
      cmocka_unit_test(test_centre_from_one_side),
      cmocka_unit_test(test_a_tail_behind_it_is_ground),
      cmocka_unit_test(test_more_views_are_better),
      cmocka_unit_test(test_cut_is_known),
      cmocka_unit_test(test_what_a_side_cuts_is_not_yet_placed),
      cmocka_unit_test(test_low_and_small_things_are_no_boulders),
      cmocka_unit_test(test_two_stay_two),
      cmocka_unit_test(test_place_does_not_matter),
      cmocka_unit_test(test_old_views_are_dropped),
      cmocka_unit_test(test_swells_are_no_boulders),
      cmocka_unit_test(test_too_large_is_counted),
      cmocka_unit_test(test_absurd_points_are_left_out),
      cmocka_unit_test(test_slices_do_not_matter),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
