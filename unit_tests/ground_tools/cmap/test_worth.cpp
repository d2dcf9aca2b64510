// Which boulders an uplink can spare: cases whose answer is known.
#include "cmap/worth.hpp"

#include <algorithm>

#include "support/cmocka.hpp"
#include "support/noise.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

const PlannedPath path = path_of({Vec2(0.0, 0.0), Vec2(40.0, 0.0)});
const double view_m = cfg::kMission.boulder_max_range_m;

std::vector<TableBoulder> boulders;
std::vector<std::size_t> order;

double always(const TableBoulder&) { return 1.0; }

void scatter(std::size_t count, double from_x, double to_x, double most_y, std::uint64_t seed) {
  Random random(seed);
  for (std::size_t i = 0; i < count; ++i) {
    TableBoulder b;
    b.p_map_m = Vec2(test::uniform(random, from_x, to_x), test::uniform(random, -most_y, most_y));
    b.diameter_m = test::uniform(random, 0.1, 0.4);
    boulders.push_back(b);
  }
}

/// The order, checked to name each boulder once.
const std::vector<CorridorBoulder>& rank(const std::function<double(const TableBoulder&)>& found) {
  static std::vector<CorridorBoulder> reached;
  reached = boulders_within_reach(boulders, path, CorridorParams());
  order = by_worth(reached, path, CorridorParams(), found);
  std::vector<std::size_t> each = order;
  std::sort(each.begin(), each.end());
  for (std::size_t i = 0; i < each.size(); ++i) assert_int_equal(each[i], i);
  assert_int_equal(each.size(), reached.size());
  return reached;
}

/// What is never found is of no worth.
void test_what_nobody_finds(void**) {
  boulders.clear();
  scatter(300, 0.0, 40.0, view_m, 1);
  const auto found = [](const TableBoulder& b) { return b.diameter_m < 0.2 ? 0.0 : 1.0; };
  const std::vector<CorridorBoulder>& reached = rank(found);
  bool small = false;
  for (const std::size_t j : order) {
    const bool is_small = reached[j].boulder->diameter_m < 0.2;
    assert_true(is_small || !small);
    small = small || is_small;
  }
}

/// Of boulders that are alike, those that only a drift across the path brings into view are spared first.
void test_what_is_out_of_view(void**) {
  boulders.clear();
  scatter(200, 5.0, 35.0, 0.5 * view_m, 2);
  const std::size_t near = boulders.size();
  CorridorParams params;
  for (std::size_t i = 0; i < near; ++i) {
    TableBoulder b = boulders[i];
    b.p_map_m.y() = view_m + 0.6 * (params.half_width_m - view_m);
    boulders.push_back(b);
  }
  const std::vector<CorridorBoulder>& reached = rank(always);
  std::size_t far = 0;
  for (std::size_t i = 0; i < near; ++i) far += reached[order[i]].boulder->p_map_m.y() > view_m ? 1U : 0U;
  assert_int_equal(far, 0);
}

/// Where there are ten times as many, more can go: poor ground keeps what it has.
void test_poor_ground_keeps_its_boulders(void**) {
  boulders.clear();
  scatter(1200, 0.0, 20.0, view_m, 3);
  scatter(120, 20.0, 40.0, view_m, 4);
  const std::vector<CorridorBoulder>& reached = rank(always);
  const auto poor = [&](std::size_t j) { return reached[j].boulder->p_map_m.x() > 20.0 + view_m; };
  const auto all = std::count_if(order.begin(), order.end(), poor);
  const auto kept =
      std::count_if(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(order.size() / 3), poor);
  assert_at_least(static_cast<double>(kept), 0.9 * static_cast<double>(all));
}

/// Sizes alike, half of the boulders: the poorest stretch is richer than by any of a hundred random halves.
void test_better_than_by_chance(void**) {
  boulders.clear();
  scatter(400, 0.0, 40.0, view_m, 5);
  const std::vector<CorridorBoulder>& reached = rank(always);
  const auto poorest = [&](const std::vector<std::size_t>& kept) {
    double least = 1e9;
    for (double x = 2.0; x <= 38.0; x += 0.5) {
      double in_view = 0.0;
      for (std::size_t i = 0; i < reached.size() / 2; ++i)
        in_view += (reached[kept[i]].boulder->p_map_m - Vec2(x, 0.0)).norm() < view_m ? 1.0 : 0.0;
      least = std::min(least, in_view);
    }
    return least;
  };
  const double ours = poorest(order);
  Random random(6);
  for (int trial = 0; trial < 100; ++trial) {
    std::vector<std::size_t> other = order;
    for (std::size_t i = other.size(); i > 1; --i) std::swap(other[i - 1], other[random.below(i)]);
    assert_at_least(ours, poorest(other));
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_what_nobody_finds),
      cmocka_unit_test(test_what_is_out_of_view),
      cmocka_unit_test(test_poor_ground_keeps_its_boulders),
      cmocka_unit_test(test_better_than_by_chance),
  };
  return cmocka_run_group_tests_name("ground_tools/cmap/worth", tests, nullptr, nullptr);
}
