// Which regions stand above the local ground: synthetic ground with slope and roughness, seen from above on a
// grid of pixels, with boulders as raised points.
#include "labeling/evidence.hpp"

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

RegionEvidenceJob job;
SurfacePoints points;
SurfacePoints sliced_points;
RegionBoxes regions;

constexpr int kSpacing = 5;
constexpr double kMetresPerPx = 0.004;

/// A plane, and how rough: uniform within +-roughness.
struct Ground {
  double slope_x = 0.0;
  double slope_y = 0.0;
  double roughness_m = 0.0;
};

void lay_ground(const Ground& ground) {
  Random random(5);
  points.clear();
  regions.clear();
  for (int v = 0; v < cfg::kImageHeight; v += kSpacing) {
    for (int u = 0; u < cfg::kImageWidth; u += kSpacing) {
      SurfacePoint p;
      p.u = static_cast<std::int16_t>(u);
      p.v = static_cast<std::int16_t>(v);
      const double x = (cfg::kImageHeight - v) * kMetresPerPx;
      const double y = -u * kMetresPerPx;
      const double rough = ground.roughness_m * (2.0 * random.below(10001) / 10000.0 - 1.0);
      p.p_site_m = Vec3(x, y, -0.7 + ground.slope_x * x + ground.slope_y * y + rough);
      p.sigma_height_m = 0.002F;
      assert_true(points.push_back(p));
    }
  }
}

SurfacePoint& at(int u, int v) {
  constexpr int kColumns = (cfg::kImageWidth + kSpacing - 1) / kSpacing;
  return points[static_cast<std::size_t>(v / kSpacing * kColumns + u / kSpacing)];
}

/// A dome of `radius_px` with `height_m` at its top over the ground; `label` 0 leaves the points
/// without a region.
void raise(int cu, int cv, int radius_px, double height_m, std::uint8_t label) {
  for (SurfacePoint& p : points) {
    const double r2 =
        ((p.u - cu) * (p.u - cu) + (p.v - cv) * (p.v - cv)) / static_cast<double>(radius_px * radius_px);
    if (r2 > 1.0) continue;
    p.p_site_m.z() += height_m * (1.0 - 0.5 * r2);
    p.label = label;
  }
  if (label == 0) return;
  const auto low = [&](int c) { return static_cast<std::int16_t>(c - radius_px); };
  const auto high = [&](int c) { return static_cast<std::int16_t>(c + radius_px); };
  assert_true(regions.push_back({label, low(cu), high(cu), low(cv), high(cv)}));
}

void judge(const RegionEvidenceParams& params = {}) {
  assert_status(job.start(params, regions, points), RegionEvidenceStatus::kRunning);
  WorkBudget all = WorkBudget::unlimited();
  assert_status(job.step(all), Progress::kDone);
  assert_status(job.status(), RegionEvidenceStatus::kDone);
}

int raised_of(std::uint8_t label) {
  int count = 0;
  for (const SurfacePoint& p : points) count += p.raised && p.label == label ? 1 : 0;
  return count;
}

int points_of(std::uint8_t label) {
  int count = 0;
  for (const SurfacePoint& p : points) count += p.label == label ? 1 : 0;
  return count;
}

void test_boulders_on_slopes(void**) {
  const Ground grounds[] = {
      {0.0, 0.0, 0.0}, {0.3, 0.0, 0.008}, {0.0, -0.3, 0.008}, {-0.2, 0.2, 0.008}, {0.0, 0.0, 0.008}};
  for (const Ground& ground : grounds) {
    lay_ground(ground);
    raise(150, 200, 20, 0.08, 1);
    raise(350, 120, 30, 0.15, 2);
    judge();
    assert_int_equal(job.boulders(), 2);
    assert_int_equal(job.untested(), 0);
    assert_int_equal(raised_of(1), points_of(1));
    assert_int_equal(raised_of(2), points_of(2));
    assert_int_equal(raised_of(0), 0);
  }
}

/// Of thousands of points around a region some are enough: those of all sides.
void test_much_ground_around(void**) {
  for (const int radius_px : {20, 60, 100}) {
    for (const double slope : {-0.3, 0.0, 0.3}) {
      lay_ground({slope, 0.2, 0.008});
      raise(260, 190, radius_px, 0.12, 1);
      judge();
      assert_int_equal(job.boulders(), 1);
      assert_int_equal(raised_of(1), points_of(1));
      assert_int_equal(raised_of(0), 0);
    }
  }
}

/// Sand, shadow, a step down: regions, but nothing stands there.
void test_what_does_not_stand_is_left_out(void**) {
  for (const double height : {0.0, 0.01, -0.05, -0.3}) {
    lay_ground({0.2, -0.1, 0.008});
    raise(250, 200, 25, height, 1);
    judge();
    assert_int_equal(job.boulders(), 0);
    assert_int_equal(raised_of(1) + raised_of(0), 0);
  }
}

/// Level and smooth ground, one region of 9 points that are lifted by hand: the heights
/// at which verdicts change.
void lift_block(double top_m, double others_m, int raised) {
  lay_ground({});
  for (int i = 0; i < 9; ++i) {
    SurfacePoint& p = at(200 + kSpacing * (i % 3), 200 + kSpacing * (i / 3));
    p.label = 1;
    p.p_site_m.z() += i == 0 ? top_m : (i < raised ? others_m : 0.0);
  }
  assert_true(regions.push_back({1, 200, 210, 200, 210}));
}

void test_bounds_of_height(void**) {
  const RegionEvidenceParams params;
  constexpr double kHair = 1.0e-5;
  lift_block(params.min_top_m + kHair, params.min_height_m + kHair, 9);
  judge();
  assert_int_equal(job.boulders(), 1);
  assert_int_equal(raised_of(1), 9);
  lift_block(params.min_top_m - kHair, params.min_height_m + kHair, 9);
  judge();
  assert_int_equal(job.boulders(), 0);
  lift_block(params.min_top_m + kHair, params.min_height_m - kHair, 9);  // one raised point
  judge();
  assert_int_equal(job.boulders(), 0);
  lift_block(params.min_top_m + kHair, params.min_height_m + kHair, params.min_raised);
  judge();
  assert_int_equal(job.boulders(), 1);
  assert_int_equal(raised_of(1), params.min_raised);
}

void test_uncertain_heights_do_not_count(void**) {
  for (const float sigma : {0.0199F, 0.0201F}) {
    lift_block(0.06, 0.06, 9);
    for (SurfacePoint& p : points) p.sigma_height_m = sigma;
    judge();
    assert_int_equal(job.boulders(), sigma < 0.02F ? 1 : 0);
  }
}

/// A lit face of the ground's grey joins; a face of another region, and what stands apart, do not.
void test_raised_points_without_label_join(void**) {
  lay_ground({0.1, 0.1, 0.005});
  raise(200, 200, 20, 0.10, 1);
  at(225, 200).p_site_m.z() += 0.05;
  at(225, 205).p_site_m.z() += 0.05;
  at(225, 205).label = 2;  // of a region that is not in the list
  at(200, 225).p_site_m.z() += 0.01;
  at(300, 200).p_site_m.z() += 0.05;
  at(100, 200).p_site_m.z() += 0.05;
  judge();
  assert_true(at(225, 200).raised);
  assert_false(at(225, 205).raised);
  assert_false(at(200, 225).raised);
  assert_false(at(300, 200).raised || at(100, 200).raised);
  assert_int_equal(raised_of(0), 1);
}

void test_paper_variant(void**) {
  lay_ground({0.1, 0.1, 0.005});
  raise(200, 200, 20, 0.10, 1);
  raise(350, 200, 20, 0.0, 2);
  at(225, 200).p_site_m.z() += 0.05;
  RegionEvidenceParams params;
  params.test_height = false;
  judge(params);
  assert_int_equal(job.boulders(), 2);
  assert_int_equal(raised_of(1), points_of(1));
  assert_int_equal(raised_of(2), points_of(2));
  assert_int_equal(raised_of(0), 0);
}

/// Boulders stand close together: half of what surrounds the small one is no ground,
/// and all of it on one side.
void test_other_boulders_around(void**) {
  lay_ground({0.2, 0.0, 0.005});
  raise(200, 200, 12, 0.06, 1);
  raise(243, 200, 30, 0.12, 2);
  raise(200, 167, 20, 0.08, 3);
  judge();
  assert_int_equal(job.boulders(), 3);
  assert_int_equal(raised_of(1), points_of(1));
  assert_int_equal(raised_of(0), 0);
}

/// A block fills most of what surrounds a small boulder: its plane takes many iterations to come down.
void test_plane_comes_to_rest(void**) {
  for (const double block_m : {0.05, 0.10, 0.20}) {
    lay_ground({0.1, 0.0, 0.004});
    raise(246, 200, 34, block_m, 0);
    raise(200, 200, 10, 0.06, 1);
    judge();
    assert_int_equal(job.boulders(), 1);
    assert_int_equal(raised_of(1), points_of(1));
  }
}

/// Moved by what they would never be, points outside all surroundings change nothing.
void test_only_surroundings_matter(void**) {
  lay_ground({0.1, 0.05, 0.008});
  raise(150, 200, 20, 0.08, 1);
  raise(350, 120, 30, 0.15, 2);
  raise(20, 370, 14, 0.06, 3);
  judge();
  const SurfacePoints before = points;
  int moved = 0;
  for (SurfacePoint& p : points) {
    bool near = false;
    for (const RegionBox& region : regions) {
      const PixelBounds b = RegionEvidenceJob::surroundings(region);
      near |= p.u >= b.u_min && p.u <= b.u_max && p.v >= b.v_min && p.v <= b.v_max;
    }
    if (near) continue;
    p.p_site_m.z() += 3.0;
    ++moved;
  }
  assert_at_least(moved, 1000);
  judge();
  for (std::size_t i = 0; i < points.size(); ++i) assert_true(points[i].raised == before[i].raised);
}

void test_corners_of_the_image(void**) {
  lay_ground({0.1, -0.1, 0.005});
  raise(0, 0, 20, 0.10, 1);
  raise(cfg::kImageWidth - 1, 0, 20, 0.10, 2);
  raise(0, cfg::kImageHeight - 1, 20, 0.10, 3);
  raise(cfg::kImageWidth - 1, cfg::kImageHeight - 1, 20, 0.10, 4);
  judge();
  assert_int_equal(job.boulders(), 4);
  assert_int_equal(raised_of(0), 0);
}

/// A region and `count` points of ground beside it, in one row: the tilt across is not to be had from them.
void few_points(int count) {
  points.clear();
  regions.clear();
  for (int i = 0; i < count + 3; ++i) {
    SurfacePoint p;
    p.u = static_cast<std::int16_t>(100 + 2 * i);
    p.v = 100;
    p.p_site_m = Vec3(1.0, -0.01 * i, i < 3 ? 0.06 : 0.0);
    p.label = i < 3 ? 1 : 0;
    assert_true(points.push_back(p));
  }
  assert_true(regions.push_back({1, 100, 120, 96, 104}));
}

void test_few_ground_points(void**) {
  const RegionEvidenceParams params;
  few_points(params.min_ground_points);
  judge();
  assert_int_equal(job.untested(), 0);
  assert_int_equal(job.boulders(), 1);
  few_points(params.min_ground_points - 1);
  judge();
  assert_int_equal(job.untested(), 1);
  assert_int_equal(job.boulders(), 0);
  assert_int_equal(raised_of(1), 0);
}

void test_statuses(void**) {
  static RegionEvidenceJob fresh;
  WorkBudget all = WorkBudget::unlimited();
  assert_status(fresh.status(), RegionEvidenceStatus::kIdle);
  assert_status(fresh.step(all), Progress::kDone);
  points.clear();
  regions.clear();
  assert_status(fresh.start({}, regions, points), RegionEvidenceStatus::kNoPoints);
  assert_status(fresh.step(all), Progress::kDone);
  assert_status(fresh.status(), RegionEvidenceStatus::kNoPoints);
  lay_ground({});
  at(0, 0).raised = true;  // of the frame before
  judge();                 // no region
  assert_int_equal(job.boulders(), 0);
  assert_false(at(0, 0).raised);
}

void test_slices_give_the_same(void**) {
  lay_ground({0.1, -0.2, 0.008});
  for (int i = 0; i < 12; ++i) {
    raise(40 + 40 * i, 60 + 25 * i, 10 + i, i % 3 == 0 ? 0.005 : 0.03 + 0.01 * i,
          static_cast<std::uint8_t>(i + 1));
  }
  sliced_points = points;
  judge();
  const int boulders = job.boulders();
  assert_true(boulders > 4 && boulders < 12);
  for (const std::uint32_t ops : {1U, 997U, 2011U}) {
    assert_status(job.start({}, regions, sliced_points), RegionEvidenceStatus::kRunning);
    int steps = 0;
    for (Progress progress = Progress::kMore; progress == Progress::kMore; ++steps) {
      WorkBudget budget(ops);
      progress = job.step(budget);
      assert_at_most(budget.spent(), ops + 20 + 12 * RegionEvidenceJob::kUnitPoints);  // by one unit
      assert_at_most(steps, 2000);
    }
    assert_true(steps > 1);
    assert_int_equal(job.boulders(), boulders);
    for (std::size_t i = 0; i < points.size(); ++i) {
      assert_int_equal(sliced_points[i].raised, points[i].raised);
    }
  }
}

/// A region as large as the image, all of it ground around a small boulder: the longest units there are.
void test_no_unit_is_long(void**) {
  lay_ground({0.1, -0.1, 0.008});
  raise(250, 200, 20, 0.10, 1);
  regions[0] = {1, 0, cfg::kImageWidth - 1, 0, cfg::kImageHeight - 1};
  sliced_points = points;
  judge();
  assert_int_equal(job.boulders(), 1);
  assert_status(job.start({}, regions, sliced_points), RegionEvidenceStatus::kRunning);
  int units = 0;
  for (Progress progress = Progress::kMore; progress == Progress::kMore; ++units) {
    WorkBudget one(1);
    progress = job.step(one);
    assert_at_most(one.spent(), 20 + 12 * RegionEvidenceJob::kUnitPoints);
  }
  assert_at_least(units, 100);
  assert_int_equal(job.boulders(), 1);
  for (std::size_t i = 0; i < points.size(); ++i) assert_int_equal(sliced_points[i].raised, points[i].raised);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_boulders_on_slopes),
      cmocka_unit_test(test_much_ground_around),
      cmocka_unit_test(test_what_does_not_stand_is_left_out),
      cmocka_unit_test(test_bounds_of_height),
      cmocka_unit_test(test_uncertain_heights_do_not_count),
      cmocka_unit_test(test_raised_points_without_label_join),
      cmocka_unit_test(test_paper_variant),
      cmocka_unit_test(test_other_boulders_around),
      cmocka_unit_test(test_plane_comes_to_rest),
      cmocka_unit_test(test_only_surroundings_matter),
      cmocka_unit_test(test_corners_of_the_image),
      cmocka_unit_test(test_few_ground_points),
      cmocka_unit_test(test_statuses),
      cmocka_unit_test(test_slices_give_the_same),
      cmocka_unit_test(test_no_unit_is_long),
  };
  return cmocka_run_group_tests_name("labeling/evidence", tests, nullptr, nullptr);
}
