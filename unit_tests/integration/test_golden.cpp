// Golden replay: the CRC-32 of the telemetry of the sample's first frames. Every target, compiler and
// optimisation gives these bits. A change of a hash needs its reason in the commit that changes it; the new
// value is in the message of the failed test.
#include "core/crc32.hpp"
#include "integration/replay_bytes.hpp"

using namespace cairn;
using namespace cairn::test;

namespace {

constexpr std::size_t kFirstFrames = 5;
constexpr std::uint32_t kGoldenFirst = 0x0A7E2D62U;

constexpr std::size_t kFrames = 35;  // with the fix of frame 30
constexpr std::uint32_t kGoldenFrames = 0xF4A43C10U;
constexpr std::uint32_t kGoldenFixes = 0xABB087DFU;
constexpr std::uint32_t kGoldenBoulders = 0x320F94FAU;

ReplayBytes bytes;

std::uint32_t hash(const std::vector<std::uint8_t>& packets) { return crc32(packets.data(), packets.size()); }

void test_first_frames(void**) {
  bytes = replay_sample(kFirstFrames, cfg::kSliceOps);
  if (hash(bytes.frames) != kGoldenFirst) fail_msg("now kGoldenFirst = 0x%08XU", hash(bytes.frames));
}

void test_frames_with_a_fix(void**) {
  if (kSanitized) {
    print_message("skipped: all but %d frames, with the sanitizers\n", static_cast<int>(kFirstFrames));
    skip();
  }
  bytes = replay_sample(kFrames, cfg::kSliceOps);
  assert_int_equal(bytes.applied, 1);
  if (hash(bytes.frames) != kGoldenFrames || hash(bytes.fixes) != kGoldenFixes ||
      hash(bytes.boulders) != kGoldenBoulders) {
    fail_msg("now kGoldenFrames = 0x%08XU, kGoldenFixes = 0x%08XU, kGoldenBoulders = 0x%08XU",
             hash(bytes.frames), hash(bytes.fixes), hash(bytes.boulders));
  }
}

}  // namespace

int main() {
  if (cfg::kImageWidth != 512) {
    print_message("skipped: the golden replay is of mission 'paper'\n");
    return 0;
  }
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_first_frames),
      cmocka_unit_test(test_frames_with_a_fix),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
