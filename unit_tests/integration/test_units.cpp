// No unit of work is longer than doc/BUDGETS.md says: what a slice, however small, is held up by. A budget of
// one operation grants one unit, so that what a step spends is that unit's cost.
#include <algorithm>
#include <cmath>

#include "app/unit_bounds.hpp"
#include "integration/replay.hpp"
#include "schedule.hpp"
#include "support/noise.hpp"

using namespace cairn;
using namespace cairn::test;

namespace {

constexpr std::size_t kFrames = kSanitized ? 3 : 31;  // with a fix in the last

Localizer localizer;
std::uint64_t longest_vo, longest_boulders, longest_fix;

template <typename Step>
void by_units(std::uint64_t& longest, const Step& step) {
  for (Progress progress = Progress::kMore; progress == Progress::kMore;) {
    WorkBudget one(1);
    progress = step(one);
    longest = std::max(longest, one.spent());
  }
}

void drive_by_units(const LocalizerParams& params) {
  static FlightMap map;
  static Pair pair;
  const ground::Dataset data = ground::Dataset::open(kSample);
  assert_status(map.make(true_rocks(kSample)), MapStatus::kUsable);
  assert_status(localizer.init(params, rig_of(data)), LocalizerStatus::kReady);
  localizer.set_map(map.map);
  assert_status(localizer.set_start(*data.truth_rover(0), 0.02, 0.004), LocalizerStatus::kReady);
  longest_vo = longest_boulders = longest_fix = 0;
  for (std::size_t i = 0; i < kFrames; ++i) {
    load(data.frames()[i], pair);
    assert_status(localizer.begin_frame(pair.left.view(), pair.right.view(), nullptr),
                  LocalizerStatus::kReady);
    by_units(longest_vo, [](WorkBudget& b) { return localizer.step_vo(b); });
    by_units(longest_boulders, [](WorkBudget& b) { return localizer.step_boulders(b); });
  }
  localizer.begin_fix();
  assert_true(kSanitized || localizer.last_fix().status == FixStatus::kRunning);
  by_units(longest_fix, [](WorkBudget& b) { return localizer.step_fix(b); });
  localizer.apply_fix();
  print_message("longest unit, operations: VO %llu, boulders %llu, fix %llu\n",
                static_cast<unsigned long long>(longest_vo),
                static_cast<unsigned long long>(longest_boulders),
                static_cast<unsigned long long>(longest_fix));
}

void test_sample(void**) {
  drive_by_units({});
  assert_at_most(longest_vo, app::longest_unit(cfg::Task::kVo));
  assert_at_most(longest_boulders, app::longest_unit(cfg::Task::kBoulders));
  assert_at_most(longest_fix, 5000);
}

// Weighted, of the usual mission's capacities.
void test_bounds(void**) {
  if (cfg::kImageWidth == 512) assert_at_most(app::longest_weighted_unit(), 20000);
}

void test_paper_variant(void**) {
  drive_by_units(paper_params());
  assert_at_most(longest_vo, 20000);
  assert_at_most(longest_boulders, 5000);
  assert_at_most(longest_fix, 30000);  // ICP's estimate from all pairs
}

// Steps of half a metre are searched for far and wide: VO's row of the schedule has to hold that, too.
void test_long_steps_fit_the_schedule(void**) {
  static Pair pair;
  const ground::Dataset data = ground::Dataset::open(kSample);
  assert_status(localizer.init({}, rig_of(data)), LocalizerStatus::kReady);
  assert_status(localizer.set_start(*data.truth_rover(0), 0.02, 0.004), LocalizerStatus::kReady);
  std::uint64_t longest = 0;
  for (std::size_t i = 0; i < data.frames().size(); i += kSanitized ? 40 : 8) {
    load(data.frames()[i], pair);
    assert_status(localizer.begin_frame(pair.left.view(), pair.right.view(), nullptr),
                  LocalizerStatus::kReady);
    WorkBudget all = WorkBudget::unlimited();
    assert_status(localizer.step_vo(all), Progress::kDone);
    longest = std::max(longest, all.spent());
  }
  print_message("longest VO, operations: %llu of %u\n", static_cast<unsigned long long>(longest),
                cfg::kVoOps);
  assert_at_most(longest, 0.9 * cfg::kVoOps);
}

// In noise most disparities have rivals, each of which is compared to the end, and all is full of regions.
void test_noise_fits_the_schedule(void**) {
  static Pair pair;
  const ground::Dataset data = ground::Dataset::open(kSample);
  assert_status(localizer.init({}, rig_of(data)), LocalizerStatus::kReady);
  assert_status(localizer.set_start(*data.truth_rover(0), 0.02, 0.004), LocalizerStatus::kReady);
  Random random(3);
  int thinned_rows = 0;
  for (int i = 0; i < (kSanitized ? 2 : 6); ++i) {
    load(data.frames()[static_cast<std::size_t>(i)], pair);
    for (ground::Image* image : {&pair.left, &pair.right}) {
      for (std::uint8_t& p : image->pixels)
        p = static_cast<std::uint8_t>(std::clamp(std::lround(p + 10.0 * i * normal(random)), 0L, 255L));
    }
    assert_status(localizer.begin_frame(pair.left.view(), pair.right.view(), nullptr),
                  LocalizerStatus::kReady);
    WorkBudget vo = WorkBudget::unlimited();
    assert_status(localizer.step_vo(vo), Progress::kDone);
    WorkBudget boulders = WorkBudget::unlimited();
    assert_status(localizer.step_boulders(boulders), Progress::kDone);
    thinned_rows += localizer.observer().counts().thinned_rows;
    print_message("noise of %d: VO %.2f of %.2f million operations, boulders %.2f of %.2f\n", 10 * i,
                  1e-6 * static_cast<double>(vo.spent()), 1e-6 * cfg::kVoPlanOps,
                  1e-6 * static_cast<double>(boulders.spent()), 1e-6 * cfg::kProbePlanOps);
    assert_true(i > 0 || thinned_rows == 0);
    assert_at_most(vo.spent(), 1.1 * cfg::kVoPlanOps);
    assert_at_most(boulders.spent(), 1.3 * cfg::kProbePlanOps);
  }
  assert_true(kSanitized || thinned_rows > 0);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_sample),
      cmocka_unit_test(test_bounds),
      cmocka_unit_test(test_paper_variant),
      cmocka_unit_test(test_long_steps_fit_the_schedule),
      cmocka_unit_test(test_noise_fits_the_schedule),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
