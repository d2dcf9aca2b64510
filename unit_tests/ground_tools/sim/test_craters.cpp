// Craters: their number and sizes against the law, their form against what is asked and told.
#include "sim/craters.hpp"

#include <algorithm>
#include <cmath>

#include "sim/terrain.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;
using namespace cairn::ground::sim;

namespace {

/// Level but for craters; a hectare.
Scene cratered_scene() {
  Scene scene;
  scene.seed = 5;
  scene.site.width_m = scene.site.height_m = 100.0;
  scene.site.origin_y_m = -100.0;
  scene.site.relief_rms_m = 0.0;
  scene.site.ripple_height_m = 0.0;
  scene.craters.k = 300.0;
  return scene;
}

/// Kolmogorov and Smirnov's test at 1 %, the number against Poisson's.
void test_number_and_sizes_follow_the_law(void**) {
  for (const double b : {1.5, 2.0, 3.0}) {
    Scene scene = cratered_scene();
    scene.craters.k = 2000.0;
    scene.craters.b = b;
    const auto more_than = [&](double d) { return 2000.0 * (std::pow(d, -b) - std::pow(20.0, -b)); };
    const std::vector<Crater> craters = make_craters(scene);
    const auto n = static_cast<double>(craters.size());
    assert_near(n, more_than(1.0), 4.0 * std::sqrt(more_than(1.0)));
    double worst = 0.0;
    for (std::size_t i = 0; i < craters.size(); ++i) {
      assert_true(i == 0 || craters[i].diameter_m <= craters[i - 1].diameter_m);
      const double share = more_than(craters[i].diameter_m) / more_than(1.0);
      worst = std::max(worst, std::fabs(share - (static_cast<double>(i) + 0.5) / n));
    }
    assert_at_most(worst * std::sqrt(n), 1.63);
  }
}

/// Floor, crest and surroundings of one crater after the other.
void test_depth_and_rim_as_asked(void**) {
  const Scene scene = cratered_scene();
  for (const Crater& c : make_craters(scene)) {
    const double left = 1.0 - 0.85 * c.degradation;
    assert_near(crater_height_m(c, Vec2(0.0, 0.0)), -c.depth_m, 1e-9);
    assert_near(c.depth_m, left * 0.16 * c.diameter_m, 1e-9);
    assert_true(c.rim_m <= left * 0.04 * c.diameter_m);
    double crest = 0.0;
    for (int k = 0; k < 64; ++k) {
      const double a = 2.0 * kPi * k / 64.0;
      const Vec2 to(std::cos(a), std::sin(a));
      double highest = -1.0;
      for (double r = 0.7; r < 1.4; r += 0.01)
        highest = std::max(highest, crater_height_m(c, 0.5 * c.diameter_m * r * to));
      crest += highest / 64.0;
      assert_near(crater_height_m(c, 0.5 * c.diameter_m * kCraterReach * to), 0.0, 0.0);
      const double outside = crater_height_m(c, c.diameter_m * to);
      assert_true(outside >= 0.0 && outside <= c.crest_m / 4.0);
    }
    // The crest lies a little beyond r = 1, where the bowl's wall is the steeper side.
    assert_true(crest >= c.rim_m - 1e-9 && crest <= c.crest_m);
  }
  Scene fresh = cratered_scene();
  fresh.craters.max_degradation = 0.0;
  for (const Crater& c : make_craters(fresh)) assert_near((c.depth_m + c.rim_m) / c.diameter_m, 0.2, 0.01);
}

/// Steepest slope along one way out of the middle.
double steepest(const Crater& c) {
  double most = 0.0;
  const double h = 0.005 * c.diameter_m;
  for (double r = 0.0; r < 1.5 * c.diameter_m; r += h)
    most = std::max(most,
                    std::fabs(crater_height_m(c, Vec2(r + h, 0.0)) - crater_height_m(c, Vec2(r, 0.0))) / h);
  return most;
}

void test_wear_makes_shallow_and_soft(void**) {
  double before = 1e9;
  for (const double g : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    Scene scene = cratered_scene();
    scene.craters.min_degradation = scene.craters.max_degradation = g;
    const Crater c = make_craters(scene).front();
    assert_near(c.degradation, g, 0.0);
    const double slope = steepest(c);
    assert_true(slope < 0.9 * before);
    before = slope;
  }
  assert_at_most(before, 0.15);  // worn: a dell of less than 9 degrees
}

/// The ground is that of the same scene without craters, and each crater of the truth on top; nothing else of
/// the scene is drawn otherwise.
void test_ground_is_what_truth_says(void**) {
  Scene scene = cratered_scene();
  scene.site.width_m = scene.site.height_m = 25.0;
  scene.site.relief_rms_m = 0.3;
  scene.site.ripple_height_m = 0.012;
  scene.craters.k = 2000.0;
  const Terrain cratered(scene);
  scene.craters.k = 0.0;
  const Terrain plain(scene);
  assert_true(plain.craters().empty());
  assert_true(cratered.craters().size() > 50);
  for (std::size_t j = 0; j < plain.rows(); j += 7) {
    for (std::size_t i = 0; i < plain.columns(); i += 7) {
      const Vec2 p(plain.origin_x_m() + Terrain::kSpacing_m * static_cast<double>(i),
                   plain.origin_y_m() + Terrain::kSpacing_m * static_cast<double>(j));
      double sum = 0.0;
      for (const Crater& c : cratered.craters()) sum += crater_height_m(c, p - c.p_map_m);
      assert_near(static_cast<double>(cratered.at(i, j) - plain.at(i, j)), sum, 1e-5);
    }
  }
  assert_near(static_cast<double>(cratered.albedo(3.0F, -3.0F)),
              static_cast<double>(plain.albedo(3.0F, -3.0F)), 0.0);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_number_and_sizes_follow_the_law),
      cmocka_unit_test(test_depth_and_rim_as_asked),
      cmocka_unit_test(test_wear_makes_shallow_and_soft),
      cmocka_unit_test(test_ground_is_what_truth_says),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
