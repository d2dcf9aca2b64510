// Maps compared and joined, boulder by boulder.
#include "map/diff.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/random.hpp"
#include "map/merge.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

const MapExtent kExtent{-100.0, 5000.0, 0.0, 5100.0};
std::vector<TableBoulder> a;
std::vector<TableBoulder> b;
std::vector<BoulderPair> pairs;
std::vector<MergePart> parts;
MapDiff diff;

TableBoulder at(double x_m, double y_m, double diameter_m = 0.5) {
  TableBoulder boulder;
  boulder.p_map_m = Vec2(x_m, y_m);
  boulder.diameter_m = diameter_m;
  return boulder;
}

double uniform(Random& random) { return 1e-9 * random.below(1000000001); }

std::vector<TableBoulder> field(int count, std::uint32_t seed) {
  Random random(seed);
  std::vector<TableBoulder> boulders;
  for (int i = 0; i < count; ++i) {
    const double x = -100.0 + 100.0 * uniform(random);
    boulders.push_back(at(x, 5000.0 + 100.0 * uniform(random), 0.2 + uniform(random)));
  }
  return boulders;
}

void test_nearest_first_one_to_one(void**) {
  a = {at(0.0, 0.0), at(1.0, 0.0)};
  b = {at(0.6, 0.0), at(5.0, 0.0), at(-0.7, 0.0)};
  pairs = pair_boulders(a, b, 0.8);
  assert_int_equal(pairs.size(), 2);  // 0.6 is nearer to 1.0, so 0.0 gets the other
  assert_int_equal(pairs[0].b, 2);
  assert_near(pairs[0].distance_m, 0.7, 1e-12);
  assert_int_equal(pairs[1].b, 0);
  // The border counts; beyond it there is nothing.
  a = {at(0.0, 0.0)};
  b = {at(0.5, 0.0)};
  assert_int_equal(pair_boulders(a, b, 0.5).size(), 1);
  assert_int_equal(pair_boulders(a, b, std::nextafter(0.5, 0.0)).size(), 0);
  assert_int_equal(pair_boulders(a, b, 0.1, Vec2(0.5, 0.0)).size(), 1);
  assert_int_equal(pair_boulders(a, {}, 1.0).size(), 0);
  assert_int_equal(pair_boulders(a, b, 0.0).size(), 0);
}

/// Against the same rule by brute force, negative coordinates and all; whatever the order of the tables.
void test_pairs_equal_brute_force(void**) {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    a = field(150, seed);
    b = field(180, seed + 100);
    static std::vector<bool> a_free;
    static std::vector<bool> b_free;
    a_free.assign(a.size(), true);
    b_free.assign(b.size(), true);
    std::size_t expected = 0;
    double sum_m = 0.0;
    while (true) {
      double nearest_m = 5.0;
      std::size_t best_i = a.size();
      std::size_t best_j = 0;
      for (std::size_t i = 0; i < a.size(); ++i) {
        for (std::size_t j = 0; j < b.size(); ++j) {
          const double distance_m = (a[i].p_map_m - b[j].p_map_m).norm();
          if (!a_free[i] || !b_free[j] || distance_m > nearest_m) continue;
          nearest_m = distance_m;
          best_i = i;
          best_j = j;
        }
      }
      if (best_i == a.size()) break;
      a_free[best_i] = false;
      b_free[best_j] = false;
      ++expected;
      sum_m += nearest_m;
    }
    for (int order = 0; order < 2; ++order) {
      pairs = pair_boulders(a, b, 5.0);
      assert_int_equal(pairs.size(), expected);
      double got_m = 0.0;
      for (const BoulderPair& pair : pairs) got_m += pair.distance_m;
      assert_near(got_m, sum_m, 1e-9);
      std::reverse(a.begin(), a.end());
      std::reverse(b.begin(), b.end());
    }
  }
}

/// Half of the boulders of each are its own, the rest shifted and noisy: the shift is found.
void test_common_shift(void**) {
  const Vec2 shifts[] = {{0.0, 0.0}, {-0.45, 0.10}, {3.1, -2.2}, {-4.4, -1.9}};
  for (const Vec2& shift_m : shifts) {
    Random random(9);
    a = field(400, 1);
    b = field(200, 2);
    for (std::size_t i = 0; i < 200; ++i) {
      b.push_back(a[i]);
      b.back().p_map_m += shift_m + Vec2(0.2 * uniform(random) - 0.1, 0.2 * uniform(random) - 0.1);
    }
    const Vec2 found_m = common_shift(a, b, 0.4, 5.0);
    assert_near(found_m.x(), shift_m.x(), 0.03);
    assert_near(found_m.y(), shift_m.y(), 0.03);
  }
  assert_near(common_shift(a, {}, 0.4, 5.0).norm(), 0.0, 0.0);
}

void test_what_changed(void**) {
  a = field(100, 4);
  b = a;
  diff = diff_maps(a, kExtent, b, kExtent, {});
  assert_int_equal(diff.pairs.size(), 100);
  assert_int_equal(diff.added.size() + diff.removed.size() + diff.moved, 0);
  assert_near(diff.repeatability(), 1.0, 0.0);

  b[3].p_map_m.x() += 0.02;
  b[4].diameter_m *= 2.0;
  b.erase(b.begin() + 50, b.begin() + 60);
  b.push_back(at(-50.0, 5200.0));  // where a does not look
  b.push_back(at(-1000.0, 5050.0));
  b.push_back(at(-0.001, 5099.999));  // in the very corner
  diff = diff_maps(a, kExtent, b, {-2000.0, 5000.0, 0.0, 5300.0}, {0.5, 0.01, false, 5.0});
  assert_int_equal(diff.removed.size(), 10);
  assert_int_equal(diff.removed[0], 50);
  assert_int_equal(diff.added.size(), 1);
  assert_int_equal(diff.added[0], b.size() - 1);
  assert_int_equal(diff.moved, 1);
  assert_int_equal(diff.a_inside, 100);
  assert_int_equal(diff.b_inside, 91);
  assert_near(diff.repeatability(), 90.0 / 91.0, 1e-12);
  assert_near(diff.mean_shift_map_m.x(), 0.02 / 90.0, 1e-12);
  assert_near(diff.rms_m, std::sqrt(0.0004 / 90.0), 1e-12);
}

void test_aligned(void**) {
  a = field(300, 5);
  b = a;
  for (TableBoulder& boulder : b) boulder.p_map_m += Vec2(2.0, -1.0);
  DiffParams params{0.2, 0.001, false, 5.0};
  const MapExtent moved{-98.0, 4999.0, 2.0, 5099.0};
  assert_true(diff_maps(a, kExtent, b, moved, params).repeatability() < 0.1);
  params.align = true;
  diff = diff_maps(a, kExtent, b, moved, params);
  assert_near(diff.shift_map_m.x(), 2.0, 1e-9);
  assert_near(diff.shift_map_m.y(), -1.0, 1e-9);
  assert_int_equal(diff.pairs.size(), 300);
  assert_int_equal(diff.moved, 0);
  assert_near(diff.mean_shift_map_m.x(), 2.0, 1e-9);
  assert_int_equal(diff.common.min_x_m, -100);  // both look at the same ground once aligned
}

void test_empty_maps(void**) {
  diff = diff_maps({}, kExtent, {}, kExtent, {});
  assert_near(diff.repeatability(), 1.0, 0.0);
  diff = diff_maps(field(3, 1), kExtent, {}, kExtent, {0.5, 0.0, true, 5.0});
  assert_near(diff.repeatability(), 0.0, 0.0);
  assert_int_equal(diff.removed.size(), 3);
}

// ---- merging

bool same_table(const std::vector<TableBoulder>& x, const std::vector<TableBoulder>& y) {
  return x.size() == y.size() && to_csv(x) == to_csv(y) &&
         std::equal(x.begin(), x.end(), y.begin(), [](const TableBoulder& p, const TableBoulder& q) {
           return p.p_map_m == q.p_map_m && p.diameter_m == q.diameter_m && p.confidence == q.confidence;
         });
}

void test_order_of_parts_does_not_matter(void**) {
  parts.clear();
  Random random(11);
  for (std::uint32_t k = 0; k < 3; ++k) {
    MergePart part{field(200, 7), k == 1 ? 0.0 : 0.25};
    for (TableBoulder& boulder : part.boulders) {
      boulder.p_map_m += Vec2(uniform(random) - 0.5, uniform(random) - 0.5);
      boulder.confidence = random.below(3) / 2.0;
      boulder.height_m = random.below(2);
    }
    parts.push_back(part);
  }
  const std::vector<TableBoulder> first = merge_boulders(parts, 1.0);
  assert_true(first.size() >= 200 && first.size() < 350);
  for (int turn = 0; turn < 5; ++turn) {
    if (turn % 2 == 0)
      std::swap(parts[0], parts[1]);
    else
      std::swap(parts[1], parts[2]);
    for (MergePart& part : parts) std::reverse(part.boulders.begin(), part.boulders.end());
    assert_true(same_table(merge_boulders(parts, 1.0), first));
  }
}

void test_who_stands(void**) {
  TableBoulder sure = at(0.0, 0.0, 1.0);
  sure.confidence = 0.9;
  TableBoulder unsure = at(0.3, 0.0, 3.0);
  unsure.confidence = 0.5;
  unsure.height_m = 0.7;
  unsure.ground_z_m = -12.0;
  a = merge_boulders({{{unsure}, 0.01}, {{sure}, 0.25}}, 0.5);
  assert_int_equal(a.size(), 1);
  assert_near(a[0].p_map_m.x(), 0.0, 0.0);
  assert_near(a[0].diameter_m, 1.0, 0.0);
  assert_near(a[0].confidence, 0.9, 0.0);
  assert_near(a[0].height_m, 0.7, 0.0);  // what the better one does not know
  assert_near(a[0].ground_z_m, -12.0, 0.0);
  // Equals: the finer image; equals again: their mean.
  unsure.confidence = 0.9;
  a = merge_boulders({{{unsure}, 0.01}, {{sure}, 0.25}}, 0.5);
  assert_near(a[0].p_map_m.x(), 0.3, 0.0);
  a = merge_boulders({{{unsure}, 0.25}, {{sure}, 0.25}}, 0.5);
  assert_near(a[0].p_map_m.x(), 0.15, 1e-12);
  assert_near(a[0].diameter_m, 2.0, 1e-12);
  // Too far, or of one part: two.
  assert_int_equal(merge_boulders({{{unsure}, 0.25}, {{sure}, 0.25}}, 0.29).size(), 2);
  assert_int_equal(merge_boulders({{{unsure, sure}, 0.25}}, 0.5).size(), 2);
  assert_int_equal(merge_boulders({}, 0.5).size(), 0);
}

/// A chain through three parts does not pull two boulders of one part together.
void test_one_of_each_part(void**) {
  a = merge_boulders({{{at(0.0, 0.0), at(0.8, 0.0)}, 0.1}, {{at(0.45, 0.0)}, 0.1}}, 0.5);
  assert_int_equal(a.size(), 2);
  assert_near(a[0].p_map_m.x(), 0.0, 0.0);
  assert_near(a[1].p_map_m.x(), 0.625, 1e-12);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_nearest_first_one_to_one),
      cmocka_unit_test(test_pairs_equal_brute_force),
      cmocka_unit_test(test_common_shift),
      cmocka_unit_test(test_what_changed),
      cmocka_unit_test(test_aligned),
      cmocka_unit_test(test_empty_maps),
      cmocka_unit_test(test_order_of_parts_does_not_matter),
      cmocka_unit_test(test_who_stands),
      cmocka_unit_test(test_one_of_each_part),
  };
  return cmocka_run_group_tests_name("ground_tools/map/diff", tests, nullptr, nullptr);
}
