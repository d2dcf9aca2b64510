// The whole flight module gives the same telemetry, bit for bit, however its work is sliced.
#include "integration/replay_bytes.hpp"

using namespace cairn;
using namespace cairn::test;

namespace {

constexpr std::size_t kFrames = kSanitized ? 4 : 40;  // plain: a fix and the frames after it

ReplayBytes whole;
ReplayBytes sliced;

void check_slices(std::uint32_t slice_ops) {
  sliced = replay_sample(kFrames, slice_ops);
  assert_true(sliced.frames == whole.frames);
  assert_true(sliced.fixes == whole.fixes);
  assert_true(sliced.boulders == whole.boulders);
  assert_true(sliced.counts == whole.counts);
}

int run_whole_frames(void**) {
  whole = replay_sample(kFrames, UINT32_MAX);
  return 0;
}

void test_there_is_a_fix_to_compare(void**) {
  if (kSanitized) {
    print_message("skipped: the fix, which the sanitizers' pass is too short for\n");
    skip();
  }
  assert_int_equal(whole.applied, 1);
  assert_true(whole.boulders.size() > 0);
}
void test_slices_of_the_mission(void**) { check_slices(cfg::kSliceOps); }
void test_small_odd_slices(void**) { check_slices(10007); }
void test_slices_of_one_unit(void**) {
  if (kSanitized) return;
  check_slices(1);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_there_is_a_fix_to_compare),
      cmocka_unit_test(test_slices_of_the_mission),
      cmocka_unit_test(test_small_odd_slices),
      cmocka_unit_test(test_slices_of_one_unit),
  };
  return cmocka_run_group_tests(tests, run_whole_frames, nullptr);
}
