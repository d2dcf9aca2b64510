// The score of a map, on cases small enough to count by hand.
#include "map/score.hpp"

#include <cmath>

#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

const MapExtent kExtent{0.0, 0.0, 10.0, 10.0};
std::vector<TableBoulder> truth;
std::vector<TableBoulder> entries;

TableBoulder at(double x_m, double y_m, double diameter_m) {
  TableBoulder b;
  b.p_map_m = Vec2(x_m, y_m);
  b.diameter_m = diameter_m;
  return b;
}

void test_counted_by_hand(void**) {
  truth = {
      at(2.0, 2.0, 0.2),   // found 0.05 m east
      at(4.0, 4.0, 1.0),   // found 0.45 m north: within half its diameter
      at(6.0, 6.0, 0.2),   // missed: nearest entry 0.11 m away
      at(7.0, 7.0, 0.14),  // too small to be asked for, but makes its entry right
      at(8.0, 8.0, 0.07),  // too small to make an entry right
      at(0.4, 5.0, 0.5),   // on the rim: does not count
  };
  entries = {
      at(2.05, 2.0, 0.1), at(4.0, 4.45, 0.1), at(6.11, 6.0, 0.1),
      at(7.0, 7.1, 0.1),  at(8.0, 8.0, 0.1),  at(0.4, 5.0, 0.1),
  };
  const MapScore s = score_map(entries, truth, kExtent);
  assert_int_equal(s.rocks, 3);
  assert_int_equal(s.found, 2);
  assert_int_equal(s.entries, 5);
  assert_int_equal(s.right, 3);
  assert_near(s.recall(), 2.0 / 3.0, 1e-12);
  assert_near(s.precision(), 0.6, 1e-12);
  assert_near(s.median_error_m, 0.25, 1e-12);
  assert_near(s.mean_shift_map_m.x(), 0.025, 1e-12);
  assert_near(s.mean_shift_map_m.y(), 0.225, 1e-12);
  // sun in the north, south, east, and in between
  assert_near(sunward_shift_m(s, parse_sun("30,0")), 0.225, 1e-12);
  assert_near(sunward_shift_m(s, parse_sun("30,180")), -0.225, 1e-12);
  assert_near(sunward_shift_m(s, parse_sun("30,90")), 0.025, 1e-12);
  assert_near(sunward_shift_m(s, parse_sun("30,45")), 0.25 * std::sqrt(0.5), 1e-12);

  const std::vector<SizeClass> classes = score_by_size(entries, truth, kExtent);
  assert_int_equal(classes.size(), 3);  // 0.15 to 0.3, 0.6, 1.2 m
  assert_near(classes[2].to_m, 1.2, 1e-12);
  assert_int_equal(classes[0].rocks, 2);
  assert_int_equal(classes[0].found, 1);
  assert_near(classes[0].recall(), 0.5, 1e-12);
  assert_near(classes[0].median_error_m, 0.05, 1e-12);
  assert_near(classes[0].diameter_ratio, 0.5, 1e-12);
  assert_int_equal(classes[1].rocks, 0);
  assert_near(classes[1].recall(), 0.0, 0.0);
  assert_int_equal(classes[2].found, 1);
  assert_near(classes[2].diameter_ratio, 0.1, 1e-12);
}

// Of several entries at a rock the nearest is its own, wherever it stands in the table.
void test_the_nearest_counts(void**) {
  truth = {at(2.0, 2.0, 0.2), at(6.0, 6.0, 0.2)};
  entries = {at(2.02, 2.0, 0.1), at(2.09, 2.0, 0.1), at(6.09, 6.0, 0.1), at(6.01, 6.0, 0.1)};
  const MapScore s = score_map(entries, truth, kExtent);
  assert_int_equal(s.found, 2);
  assert_near(s.median_error_m, 0.015, 1e-12);
  assert_near(s.mean_shift_map_m.x(), 0.015, 1e-12);
}

/// Along a way with a bend, what lies nearer than two metres.
void test_along_a_way(void**) {
  truth = {at(3.0, 3.0, 0.2), at(5.0, 6.9, 0.2), at(4.9, 7.1, 0.2), at(8.0, 3.0, 0.2), at(1.0, 5.0, 0.2)};
  entries = {at(3.0, 3.02, 0.1), at(4.9, 7.1, 0.1), at(7.9, 8.0, 0.1)};
  ScoreParams params;
  params.way_map_m = {Vec2(2.0, 5.0), Vec2(7.0, 5.0), Vec2(7.0, 9.0)};
  params.within_m = 2.0;
  const MapScore s = score_map(entries, truth, kExtent, params);
  assert_int_equal(s.rocks, 3);  // (3, 3) and (1, 5) within two metres, (5, 6.9); not (4.9, 7.1), nor (8, 3)
  assert_int_equal(s.found, 1);
  assert_int_equal(s.entries, 2);  // not (4.9, 7.1)
  assert_int_equal(s.right, 1);
}

void test_nothing_to_count(void**) {
  truth.clear();
  entries.clear();
  const MapScore s = score_map(entries, truth, kExtent);
  assert_near(s.recall(), 0.0, 0.0);
  assert_near(s.precision(), 0.0, 0.0);
  assert_true(score_by_size(entries, truth, kExtent).empty());
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_counted_by_hand),
                              cmocka_unit_test(test_the_nearest_counts), cmocka_unit_test(test_along_a_way),
                              cmocka_unit_test(test_nothing_to_count)};
  return cmocka_run_group_tests_name("ground_tools/map/score", tests, nullptr, nullptr);
}
