// The sample drive, over the map of its true rocks: the same telemetry to the bit on every target, compiler
// and optimisation. A change of a sum needs its reason in the commit that changes it; the new values are in
// the message of the failed test.
#include "mission_cfg.hpp"
#include "platform/tape/player.hpp"
#include "support/cmocka.hpp"
#include "support/sanitized.hpp"

using namespace cairn;

namespace {

struct Golden {
  int frames;
  std::uint32_t poses, fixes, boulders;
};
constexpr Golden kShort = {5, 0xA9018175U, 0, 0};
constexpr Golden kWhole = {35, 0x442BCD15U, 0x7BE513E2U, 0xB4F30F74U};  // with the fix of frame 30

tape::Telemetry t;

void check(const Golden& golden) {
  assert_status(tape::play(golden.frames, t), tape::TapeStatus::kReady);
  assert_int_equal(t.frames, golden.frames);
  assert_int_equal(t.bad, 0);
  if (t.poses != golden.poses || t.fixes != golden.fixes || t.boulders != golden.boulders) {
    fail_msg("now {%d, 0x%08lXU, 0x%08lXU, 0x%08lXU}", t.frames, static_cast<unsigned long>(t.poses),
             static_cast<unsigned long>(t.fixes), static_cast<unsigned long>(t.boulders));
  }
}

void test_first_frames(void**) { check(kShort); }

void test_with_a_fix(void**) {
  if (test::kSanitized) {
    print_message("skipped: all but %d frames, with the sanitizers\n", kShort.frames);
    skip();
  }
  check(kWhole);
  assert_int_equal(t.applied, 1);
}

}  // namespace

int main() {
  if (cfg::kImageWidth != 512) {
    print_message("skipped: the sums are of mission 'paper'\n");
    return 0;
  }
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_first_frames),
      cmocka_unit_test(test_with_a_fix),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
