// The wide map: grid and raster against brute force, density, what it refuses, slicing.
#include "registration/wide_map.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include "support/cmocka.hpp"
#include "support/noise.hpp"
#include "support/slices.hpp"

using namespace cairn;
using test::uniform;

namespace {

WideMap map;
WideMap other;

void fill(WideMap& out, Random& random, int count, const Vec2& origin, const Vec2& extent, double reach_m) {
  assert_true(out.begin(origin, extent, reach_m));
  for (int i = 0; i < count; ++i) {
    const Vec2 p = origin + Vec2(uniform(random, 0.0, extent.x()), uniform(random, 0.0, extent.y()));
    assert_true(out.add({p, static_cast<float>(uniform(random, 0.1, 1.5))}));
  }
}

/// Every boulder stands once, in the bucket that its position says, and those of a bucket in rising order.
void test_grid_holds_each_boulder_once(void**) {
  Random random(3);
  for (const Vec2& extent : {Vec2(77.0, 77.0), Vec2(1000.0, 3.0), Vec2(0.5, 900.0)}) {
    fill(map, random, 5000, Vec2(-100.0, 2000.0), extent, 0.15);
    assert_true(test::run_whole(map));
    assert_int_equal(map.size(), 5000);
    std::vector<int> seen(5000, 0);
    for (int row = 0; row < map.rows(); ++row) {
      for (int column = 0; column < map.columns(); ++column) {
        for (std::uint32_t k = map.first_in(column, row); k < map.end_in(column, row); ++k) {
          const std::uint16_t i = map.by_bucket(k);
          ++seen[i];
          if (k > map.first_in(column, row)) assert_true(map.by_bucket(k - 1) < i);
          assert_int_equal(map.column_of(static_cast<double>(map.point(i).x_m)), column);
          assert_int_equal(map.row_of(static_cast<double>(map.point(i).y_m)), row);
        }
      }
    }
    for (const int n : seen) assert_int_equal(n, 1);
  }
}

/// A cell is set exactly where a boulder lies within reach of it.
void test_raster_against_brute_force(void**) {
  Random random(4);
  const double reach = 0.31;
  fill(map, random, 60, Vec2(10.0, 20.0), Vec2(30.0, 17.0), reach);
  assert_true(test::run_whole(map));
  const double c = map.cell_m();
  for (int trial = 0; trial < 20000; ++trial) {
    const int x = static_cast<int>(uniform(random, -3.0, map.cells_x() + 3.0));
    const int y = static_cast<int>(uniform(random, -3.0, map.cells_y() + 3.0));
    bool near = false;
    for (std::size_t i = 0; i < map.size(); ++i) {
      const auto gap = [&](double at, int k) {
        return std::fmax(0.0, std::fmax(k * c - at, at - (k + 1) * c));
      };
      near = near || std::hypot(gap(static_cast<double>(map.point(i).x_m), x),
                                gap(static_cast<double>(map.point(i).y_m), y)) <= reach;
    }
    const bool on_map = x >= 0 && y >= 0 && x < map.cells_x() && y < map.cells_y();
    assert_int_equal(map.raster().occupied(x, y), near && on_map);
  }
}

/// A kilometre and 77 m alike fit the raster, with cells as small as it has room for.
void test_raster_uses_its_room(void**) {
  assert_true(map.begin(Vec2(0.0, 0.0), Vec2(1000.0, 1000.0), 0.15));
  assert_true(test::run_whole(map));
  const double cells = 1.0 * map.cells_x() * map.cells_y();
  assert_true(cells <= cfg::kOccupancyBits && cells > 0.8 * cfg::kOccupancyBits);
  assert_true(map.begin(Vec2(0.0, 0.0), Vec2(77.0, 77.0), 0.15));
  assert_true(test::run_whole(map));
  assert_true(map.cell_m() == WideMap::kMinCellM);
}

/// The share of set cells gives back the boulders per square metre, here dense, there sparse.
void test_density_is_local(void**) {
  Random random(5);
  assert_true(map.begin(Vec2(0.0, 0.0), Vec2(100.0, 100.0), 0.15));
  for (int i = 0; i < 6000; ++i)
    (void)map.add({Vec2(uniform(random, 0.0, 50.0), uniform(random, 0.0, 100.0)), 0.2F});
  for (int i = 0; i < 1000; ++i)
    (void)map.add({Vec2(uniform(random, 50.0, 100.0), uniform(random, 0.0, 100.0)), 0.2F});
  assert_true(test::run_whole(map));
  const auto lambda = [&](double x, double y) {
    const double q =
        map.density(static_cast<int>(x / map.cell_m()), static_cast<int>(y / map.cell_m())) / 65536.0;
    return -std::log(1.0 - q) / map.spread_of_boulder_m2();
  };
  double dense = 0.0;
  double sparse = 0.0;
  for (double y = 5.0; y < 100.0; y += 10.0) {
    dense += 0.1 * lambda(20.0, y);
    sparse += 0.1 * lambda(80.0, y);
  }
  assert_true(std::fabs(dense / 1.2 - 1.0) < 0.1);
  assert_true(std::fabs(sparse / 0.2 - 1.0) < 0.15);
  assert_true(map.density(-5, 1 << 20) >= 0);  // off the map is clamped, not out of bounds
}

void test_sizes(void**) {
  Random random(6);
  fill(map, random, 4000, Vec2(0.0, 0.0), Vec2(50.0, 50.0), 0.1);
  double sum = 0.0;
  for (double s = -3.5; s < 2.1; s += 0.01) sum += 0.01 * map.size_density(s, 0.15);
  assert_true(std::fabs(sum - 1.0) < 0.02);  // a density
  assert_true(map.size_density(std::log(1.0), 0.15) > 20.0 * map.size_density(std::log(0.05), 0.15));
}

/// A boulder seen as a tenth larger than any of the map's is one of its largest, not one in a million.
void test_beyond_the_largest(void**) {
  assert_true(map.begin(Vec2(0.0, 0.0), Vec2(50.0, 50.0), 0.1));
  for (int k = 0; k < 1000; ++k) {
    MapBoulder b;
    b.p_map_m = Vec2(0.05 * k, 25.0);
    b.diameter_m = k % 100 == 0 ? 2.0F : 0.3F;
    assert_true(map.add(b));
  }
  assert_true(test::run_whole(map));
  assert_true(map.size_density(std::log(2.2), 0.15) > 0.005);
  assert_true(map.size_density(std::log(6.0), 0.15) < 0.001);
}

void test_what_is_left_out(void**) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {0.0, -1.0, 1.0e6, kNan, std::numeric_limits<double>::infinity()}) {
    assert_false(map.begin(Vec2(0.0, 0.0), Vec2(bad, 10.0), 0.1));
    assert_false(map.begin(Vec2(0.0, 0.0), Vec2(10.0, 10.0), bad));
  }
  assert_false(map.begin(Vec2(kNan, 0.0), Vec2(10.0, 10.0), 0.1));
  assert_true(map.begin(Vec2(0.0, 0.0), Vec2(10.0, 10.0), 0.1));
  assert_false(map.add({Vec2(-0.1, 5.0), 0.1F}));
  assert_false(map.add({Vec2(5.0, 10.1), 0.1F}));
  assert_false(map.add({Vec2(kNan, 5.0), 0.1F}));
  for (std::size_t i = 0; i < WideMap::kCapacity; ++i) assert_true(map.add({Vec2(5.0, 5.0), 0.1F}));
  assert_false(map.add({Vec2(5.0, 5.0), 0.1F}));
  assert_int_equal(map.left_out(), 4);
  assert_true(test::run_whole(map));              // all of them in one bucket
  assert_false(map.add({Vec2(5.0, 5.0), 0.1F}));  // too late
}

void test_same_for_every_slicing(void**) {
  Random a(7);
  Random b(7);
  fill(map, a, 3000, Vec2(0.0, 0.0), Vec2(60.0, 40.0), 0.15);
  fill(other, b, 3000, Vec2(0.0, 0.0), Vec2(60.0, 40.0), 0.15);
  assert_true(test::run_whole(map));
  assert_true(test::run_in_slices(other) > 20);
  for (int k = 0; k < 3000; ++k)
    assert_int_equal(map.by_bucket(static_cast<unsigned>(k)), other.by_bucket(static_cast<unsigned>(k)));
  for (int y = 0; y < map.cells_y(); ++y) {
    for (int x = 0; x < map.cells_x(); ++x)
      assert_int_equal(map.raster().occupied(x, y), other.raster().occupied(x, y));
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_grid_holds_each_boulder_once),
      cmocka_unit_test(test_raster_against_brute_force),
      cmocka_unit_test(test_raster_uses_its_room),
      cmocka_unit_test(test_density_is_local),
      cmocka_unit_test(test_sizes),
      cmocka_unit_test(test_beyond_the_largest),
      cmocka_unit_test(test_what_is_left_out),
      cmocka_unit_test(test_same_for_every_slicing),
  };
  return cmocka_run_group_tests_name("registration/wide_map", tests, nullptr, nullptr);
}
