// What a map says of itself: its sizes against Golombek and Rapp's law, its boulders against its craters.
#include "map/quality.hpp"

#include <cmath>

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

constexpr MapExtent kField = {0.0, 0.0, 200.0, 200.0};
std::vector<TableBoulder> boulders, craters;

double next(Random& random) { return (random.below(1000000) + 0.5) / 1e6; }

TableBoulder at(double x, double y, double diameter_m) {
  TableBoulder b;
  b.p_map_m = Vec2(x, y);
  b.diameter_m = diameter_m;
  return b;
}

/// Of the law, by the number in each of many thin classes of size.
void draw_field(double k, double least_m) {
  boulders.clear();
  Random random(3);
  const double q = 1.79 + 0.152 / k;
  double wanted = 0.0;
  for (double d = least_m; d < 12.0; d *= 1.01) {
    const double upper = 1.01 * d;
    const double share = k * (std::exp(-q * d) - std::exp(-q * upper));
    wanted += 200.0 * 200.0 * share / (0.25 * 3.14159265 * d * upper);
    for (; wanted >= 1.0; wanted -= 1.0)
      boulders.push_back(at(200.0 * next(random), 200.0 * next(random), d));
  }
}

void test_field_is_as_expected(void**) {
  craters.clear();
  for (const double k : {0.03, 0.08, 0.15}) {
    draw_field(k, 0.6);
    const MapQuality q = quality_of(boulders, craters, kField);
    print_message("k %.2f: %s\n", k, to_text(q).c_str());
    assert_near(q.k, k, 0.15 * k);
    assert_near(q.of_expected, 1.0, 0.25);
    assert_true(q.doubts().empty());
  }
}

// Large ones as a field of k = 0.15 has them, and hardly any of the small ones that go with them.
void test_sizes_of_no_field(void**) {
  draw_field(0.15, 0.6);
  std::vector<TableBoulder> large;
  for (const TableBoulder& b : boulders)
    if (b.diameter_m > 1.4) large.push_back(b);
  for (int i = 0; i < static_cast<int>(boulders.size()) / 100; ++i) large.push_back(at(5.0 * i, 5.0, 0.41));
  const MapQuality q = quality_of(large, {}, kField);
  print_message("%s\n", to_text(q).c_str());
  assert_at_most(q.of_expected, 0.1);
  assert_int_equal(q.doubts().size(), 1);
}

void test_boulders_at_craters(void**) {
  boulders.clear();
  craters.clear();
  Random random(9);
  for (int i = 0; i < 30; ++i) {
    craters.push_back(at(200.0 * next(random), 200.0 * next(random), 8.0));
    boulders.push_back(at(craters.back().p_map_m.x() + 4.0, craters.back().p_map_m.y(), 2.0));
  }
  const MapQuality near = quality_of(boulders, craters, kField);
  assert_near(near.share_near_craters, 1.0, 1e-12);
  assert_near(near.ground_near_craters, 30 * 3.1416 * 36.0 / 40000.0, 0.04);
  assert_false(near.doubts().empty());
  assert_int_equal(to_json(near)["doubts"].size(), near.doubts().size());
  for (TableBoulder& b : boulders) b.p_map_m = Vec2(200.0 * next(random), 200.0 * next(random));
  assert_at_most(quality_of(boulders, craters, kField).share_near_craters, 0.3);
}

void test_few_or_none(void**) {
  craters.clear();
  boulders.clear();
  const MapQuality none = quality_of(boulders, craters, kField);
  assert_true(none.k == 0.0 && none.of_expected == 0.0 && none.share_near_craters == 0.0);
  assert_true(to_json(none)["golombek_rapp_k"].is_null());
  for (int i = 0; i < 21; ++i) craters.push_back(at(9.0 * i, 50.0, 5.0));
  assert_int_equal(quality_of(boulders, craters, kField).doubts().size(), 1);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_field_is_as_expected),
      cmocka_unit_test(test_sizes_of_no_field),
      cmocka_unit_test(test_boulders_at_craters),
      cmocka_unit_test(test_few_or_none),
  };
  return cmocka_run_group_tests_name("ground_tools/map/quality", tests, nullptr, nullptr);
}
