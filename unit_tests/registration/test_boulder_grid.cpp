// The grid of neighbours against a search through all boulders: nearest, all within a radius, ties, corners,
// full windows; its cost as it says; its building in slices; each status.
#include "registration/boulder_grid.hpp"

#include <limits>
#include <vector>

#include "core/random.hpp"
#include "support/cmocka.hpp"
#include "support/death.hpp"
#include "support/noise.hpp"
#include "support/slices.hpp"

using namespace cairn;
using test::uniform;

namespace {

BoulderGrid grid;
BoulderGrid other_grid;
MapBoulders boulders;
const Vec2 kOrigin(1200.0, -340.0);
constexpr int kFull = static_cast<int>(cfg::kMaxMapWindowBoulders);

void add(const Vec2& p_m, double diameter_m = 0.2) {
  assert_true(boulders.push_back({kOrigin + p_m, static_cast<float>(diameter_m)}));
}

/// Boulders over `width` by `height` about the origin; every seventh stands on another one, size unknown.
void scatter(Random& random, int count, double width_m, double height_m) {
  boulders.clear();
  for (int i = 0; i < count; ++i) {
    if (i % 7 == 6) {
      add(boulders[i - 3].p_map_m - kOrigin, 0.0);
    } else {
      add({uniform(random, -0.5, 0.5) * width_m, uniform(random, -0.5, 0.5) * height_m},
          uniform(random, 0.1, 0.6));
    }
  }
}

void build(double least_cell_m) {
  assert_status(grid.start(boulders, kOrigin, least_cell_m), GridStatus::kRunning);
  assert_true(test::run_whole(grid));
  assert_status(grid.status(), GridStatus::kReady);
}

double distance2(const GridPoint& at, std::size_t i) {
  const Vec2 p = boulders[i].p_map_m - kOrigin;
  const double dx = p.x() - at.x_m;
  const double dy = p.y() - at.y_m;
  return dx * dx + dy * dy;
}

/// Both questions at one point and radius, against all boulders; returns how many are near.
int check(const GridPoint& at, double radius_m, const SizeRule& sizes) {
  static int visits[cfg::kMaxMapWindowBoulders];
  for (int& count : visits) count = 0;
  const BoulderQuery query = grid.query(at, radius_m);
  int visited = 0;
  grid.for_each_near(query, [&](std::uint16_t index, double r2) {
    ++visits[index];
    ++visited;
    assert_near(r2, distance2(at, index), 0.0);
  });
  NearestBoulder best{BoulderGrid::kNone, radius_m * radius_m};
  int near = 0;
  for (std::size_t i = 0; i < boulders.size(); ++i) {
    const double r2 = distance2(at, i);
    const bool within = r2 <= radius_m * radius_m;
    assert_int_equal(visits[i], within ? 1 : 0);
    near += within ? 1 : 0;
    if (!within || !sizes.agree(at.diameter_m, boulders[i].diameter_m)) continue;
    if (best.index == BoulderGrid::kNone || r2 < best.r2_m2) best = {static_cast<std::uint16_t>(i), r2};
  }
  assert_int_equal(visited, near);
  const NearestBoulder nearest = grid.nearest(query, sizes);
  assert_int_equal(nearest.index, best.index);
  assert_near(nearest.r2_m2, best.r2_m2, 0.0);
  return near;
}

// ---- against brute force ----------------------------------------------------------------------------------

/// Fields wide and narrow, few boulders and a full window; radii below, at and far above the cell.
void test_equals_brute_force(void**) {
  Random random(1);
  long near = 0;
  for (int trial = 0; trial < 24; ++trial) {
    const double side = trial % 3 == 0 ? 300.0 : 12.0;
    const double narrow = trial % 5 == 0 ? 0.01 : 1.0;
    scatter(random, trial % 4 == 0 ? kFull : 1 + 20 * trial, side, side * narrow);
    const double cell = trial % 2 == 0 ? 0.7 : 4.0;
    build(cell);
    for (int i = 0; i < 60; ++i) {
      const double radius = cell * (i % 3 == 0 ? 0.4 : i % 3 == 1 ? 1.0 : 9.3);
      const GridPoint at{uniform(random, -0.7, 0.7) * side, uniform(random, -0.7, 0.7) * side * narrow,
                         static_cast<float>(uniform(random, 0.1, 0.6))};
      near += check(at, radius, {i % 2 == 0 ? 0.0 : 1.5});
    }
  }
  assert_at_least(near, 10000);
}

/// Boulders on the corners of cells, asked about from where they lie on the circle to the last bit.
void test_on_cells_and_circles(void**) {
  boulders.clear();
  for (int i = 0; i < 20 * 20; ++i) add({0.5 * (i % 20), 0.5 * (i / 20)});
  build(0.5);
  for (const double radius : {0.0, 0.5, std::nextafter(0.5, 0.0), 1.0, 2.5}) {
    for (int i = 0; i < 22 * 22; ++i) {
      (void)check({0.5 * (i % 22) - 0.5, 0.5 * (i / 22) - 0.5}, radius, SizeRule());
    }
  }
  assert_int_equal(check({3.0, 3.0}, 0.0, SizeRule()), 1);
  assert_int_equal(check({3.0, 3.0}, 0.5, SizeRule()), 5);
  assert_int_equal(check({3.0, 3.0}, std::nextafter(0.5, 0.0), SizeRule()), 1);
}

/// A full window on one spot, all in one cell: visited in order, and the lowest index wins.
void test_all_on_one_spot(void**) {
  boulders.clear();
  for (int i = 0; i < kFull; ++i) add({1.0, 2.0});
  build(0.3);
  assert_int_equal(check({1.1, 2.0}, 0.3, SizeRule()), kFull);
  assert_int_equal(grid.nearest(grid.query({1.1, 2.0}, 0.3)).index, 0);
  int next = 0;
  grid.for_each_near(grid.query({1.1, 2.0}, 0.3),
                     [&](std::uint16_t k, double) { assert_int_equal(k, next++); });
  assert_int_equal(check({1.1, 2.4}, 0.3, SizeRule()), 0);
}

void test_points_that_are_nowhere(void**) {
  Random random(2);
  scatter(random, 300, 20.0, 20.0);
  build(1.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, inf, -inf, 1.0e300}) {
    assert_int_equal(check({bad, 0.0}, 1.0, SizeRule()), 0);
    assert_int_equal(check({0.0, bad}, 1.0, SizeRule()), 0);
  }
  assert_int_equal(check({0.0, 0.0}, 1.0e6, SizeRule()), 300);
}

// ---- sizes ------------------------------------------------------------------------------------------------

void test_sizes_at_their_corner(void**) {
  const SizeRule twice{2.0};
  assert_true(twice.agree(0.25F, 0.5F));
  assert_true(twice.agree(0.5F, 0.25F));
  assert_false(twice.agree(0.25F, std::nextafter(0.5F, 1.0F)));
  assert_false(twice.agree(std::nextafter(0.5F, 1.0F), 0.25F));
  assert_true(twice.agree(0.0F, 9.0F));  // unknown
  assert_true(twice.agree(9.0F, 0.0F));
  assert_true(SizeRule().agree(0.1F, 9.0F));
}

// ---- cost -------------------------------------------------------------------------------------------------

void test_cost_is_bounded_and_told(void**) {
  Random random(3);
  scatter(random, kFull, 60.0, 60.0);
  build(1.5);
  for (int i = 0; i < 500; ++i) {
    const GridPoint at{uniform(random, -29.0, 29.0), uniform(random, -29.0, 29.0)};
    const BoulderQuery q = grid.query(at, 1.5);  // as wide as a cell
    assert_at_most(q.x1 - q.x0, 2);
    assert_at_most(q.y1 - q.y0, 2);
    std::uint32_t around = 0;
    for (const MapBoulder& b : boulders) {
      const Vec2 d = b.p_map_m - kOrigin - Vec2(at.x_m, at.y_m);
      if (std::fabs(d.x()) <= 3.0 && std::fabs(d.y()) <= 3.0) ++around;
    }
    assert_at_most(q.candidates, around);
    assert_int_equal(q.ops(), 20U + 4U * q.candidates);
  }
  const BoulderQuery all = grid.query({0.0, 0.0}, 1000.0);
  assert_int_equal(all.candidates, kFull);
  assert_int_equal(all.ops(), 5 * (all.y1 - all.y0 + 1) + 4 * kFull);
}

/// Where boulders crowd, pieces of a question visit what the whole does, in its order, and find the same.
void test_pieces_are_the_whole(void**) {
  Random random(8);
  boulders.clear();
  for (int i = 0; i < 1500; ++i) {
    const double side = i % 2 == 0 ? 0.5 : 40.0;
    add({uniform(random, -0.5, 0.5) * side, uniform(random, -0.5, 0.5) * side}, uniform(random, 0.1, 0.6));
  }
  build(0.8);
  for (const double radius : {0.2, 0.9, 6.0, 100.0}) {
    const GridPoint at{uniform(random, -0.2, 0.2), uniform(random, -0.2, 0.2), 0.3F};
    const BoulderQuery whole = grid.query(at, radius);
    std::vector<std::uint16_t> order;
    grid.for_each_near(whole, [&](std::uint16_t k, double) { order.push_back(k); });
    NearestBoulder best = BoulderGrid::none(whole);
    std::vector<std::uint16_t> pieces;
    std::uint32_t seen = 0;
    while (seen < whole.candidates) {
      BoulderQuery piece = whole;
      assert_true(piece.cut(seen) == (seen + piece.candidates == whole.candidates));
      assert_at_most(piece.candidates, BoulderQuery::kPiece);
      assert_at_most(piece.ops(), BoulderGrid::most_piece_ops());
      grid.for_each_near(piece, [&](std::uint16_t k, double) { pieces.push_back(k); });
      grid.nearest(piece, {1.5}, best);
      seen += piece.candidates;
    }
    assert_true(seen > 2 * BoulderQuery::kPiece);
    assert_true(pieces == order);
    assert_int_equal(best.index, grid.nearest(whole, {1.5}).index);
    assert_near(best.r2_m2, grid.nearest(whole, {1.5}).r2_m2, 0.0);
  }
}

void test_building_costs_what_it_says(void**) {
  Random random(4);
  scatter(random, 1000, 20.0, 20.0);
  (void)grid.start(boulders, kOrigin, 1.0);
  WorkBudget all = WorkBudget::unlimited();
  assert_int_equal(static_cast<int>(grid.step(all)), static_cast<int>(Progress::kDone));
  assert_int_equal(all.spent(), 5 * 1000 + 2 * 4 * 1024 + 2 * 4096);
}

// ---- building ---------------------------------------------------------------------------------------------

void test_same_for_every_slicing(void**) {
  Random random(5);
  scatter(random, kFull, 50.0, 30.0);
  build(0.8);
  assert_status(other_grid.start(boulders, kOrigin, 0.8), GridStatus::kRunning);
  int steps = 1;  // one unit each
  for (WorkBudget little(1); other_grid.step(little) == Progress::kMore; little = WorkBudget(1)) ++steps;
  assert_int_equal(steps, 3 * ((kFull + 255) / 256) + 2);
  assert_status(other_grid.status(), GridStatus::kReady);
  for (int i = 0; i < 300; ++i) {
    const GridPoint at{uniform(random, -25.0, 25.0), uniform(random, -15.0, 15.0)};
    std::uint32_t order = 1;  // of the visits, too
    std::uint32_t other_order = 1;
    grid.for_each_near(grid.query(at, 2.0), [&](std::uint16_t k, double) { order = order * 31U + k; });
    other_grid.for_each_near(other_grid.query(at, 2.0),
                             [&](std::uint16_t k, double) { other_order = other_order * 31U + k; });
    assert_int_equal(order, other_order);
  }
}

void test_restart_midway(void**) {
  Random random(6);
  scatter(random, kFull, 50.0, 50.0);
  (void)grid.start(boulders, kOrigin, 0.8);
  for (int i = 0; i < 5; ++i) {
    WorkBudget little(1);
    assert_int_equal(static_cast<int>(grid.step(little)), static_cast<int>(Progress::kMore));
  }
  scatter(random, 50, 5.0, 5.0);
  build(0.8);
  assert_int_equal(grid.size(), 50);
  for (int i = 0; i < 50; ++i) (void)check(grid[i], 1.0, SizeRule());
}

void test_points_are_those_given(void**) {
  Random random(7);
  scatter(random, 40, 10.0, 10.0);
  build(1.0);
  assert_int_equal(grid.size(), 40);
  for (int i = 0; i < 40; ++i) {
    const Vec2 p = boulders[i].p_map_m - kOrigin;
    assert_near(grid[i].x_m, p.x(), 0.0);
    assert_near(grid[i].y_m, p.y(), 0.0);
    assert_near(grid[i].diameter_m, boulders[i].diameter_m, 0.0);
  }
}

void test_statuses(void**) {
  static BoulderGrid fresh;
  assert_status(fresh.status(), GridStatus::kIdle);
  WorkBudget any(1000);
  assert_int_equal(static_cast<int>(fresh.step(any)), static_cast<int>(Progress::kDone));
  assert_true(test::asserts([] { (void)fresh.query({0.0, 0.0}, 1.0); }));

  boulders.clear();
  assert_status(fresh.start(boulders, kOrigin, 1.0), GridStatus::kNoBoulders);
  add({0.0, 0.0});
  add({1.0, 1.0});
  assert_status(fresh.start(boulders, kOrigin, 1.0), GridStatus::kRunning);
  assert_true(test::asserts([] { (void)fresh.query({0.0, 0.0}, 1.0); }));
  WorkBudget all = WorkBudget::unlimited();
  (void)fresh.step(all);
  assert_status(fresh.status(), GridStatus::kReady);
  assert_false(test::asserts([] { (void)fresh.query({0.0, 0.0}, 1.0); }));
}

void test_bad_input(void**) {
  constexpr double kLimit = BoulderGrid::kMaxCoordinate_m;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto start = [](const MapBoulder& b, const Vec2& origin, double cell) {
    boulders.clear();
    assert_true(boulders.push_back({Vec2(1.0, 1.0), 0.1F}) && boulders.push_back(b));
    const GridStatus started = grid.start(boulders, origin, cell);
    assert_true(test::run_whole(grid));
    return started == GridStatus::kRunning ? grid.status() : started;
  };
  const MapBoulder good{Vec2(2.0, 1.0), 0.1F};
  const Vec2 zero(0.0, 0.0);
  for (const double cell : {1.0e-3, 1.0e3}) assert_status(start(good, zero, cell), GridStatus::kReady);
  for (const double cell : {0.9e-3, 1.1e3, nan, -1.0}) {
    assert_status(start(good, zero, cell), GridStatus::kBadInput);
  }
  assert_status(start(good, Vec2(nan, 0.0), 1.0), GridStatus::kBadInput);
  assert_status(start({Vec2(kLimit, -kLimit), 0.1F}, zero, 1.0), GridStatus::kReady);
  const double beyond = std::nextafter(kLimit, 2.0 * kLimit);
  for (const Vec2& p : {Vec2(beyond, 0.0), Vec2(0.0, -beyond), Vec2(nan, 0.0), Vec2(0.0, nan)}) {
    assert_status(start({p, 0.1F}, zero, 1.0), GridStatus::kBadInput);
  }
  const float inf = std::numeric_limits<float>::infinity();
  assert_status(start({Vec2(0.0, 0.0), inf}, zero, 1.0), GridStatus::kBadInput);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_equals_brute_force),
      cmocka_unit_test(test_on_cells_and_circles),
      cmocka_unit_test(test_all_on_one_spot),
      cmocka_unit_test(test_points_that_are_nowhere),
      cmocka_unit_test(test_sizes_at_their_corner),
      cmocka_unit_test(test_cost_is_bounded_and_told),
      cmocka_unit_test(test_pieces_are_the_whole),
      cmocka_unit_test(test_building_costs_what_it_says),
      cmocka_unit_test(test_same_for_every_slicing),
      cmocka_unit_test(test_restart_midway),
      cmocka_unit_test(test_points_are_those_given),
      cmocka_unit_test(test_statuses),
      cmocka_unit_test(test_bad_input),
  };
  return cmocka_run_group_tests_name("boulder_grid", tests, nullptr, nullptr);
}
