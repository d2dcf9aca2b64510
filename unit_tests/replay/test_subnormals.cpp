// Flight code neither makes a subnormal number nor meets one: the sample drive gives the same telemetry with
// underflow flushed to zero, and nothing traps where both are trapped. A GRFPU of a LEON3 does the one, or
// the other, whatever is asked of it.
#if defined(__SSE2__) && !defined(__SANITIZE_ADDRESS__)

#include <xmmintrin.h>

#include <csignal>

#include "mission_cfg.hpp"
#include "platform/tape/player.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

constexpr int kFrames = 35;  // with the fix of frame 30
constexpr unsigned kFlushResults = 0x8000;
constexpr unsigned kFlushOperands = 0x0040;
constexpr unsigned kDenormalMasked = 0x0100;
constexpr unsigned kUnderflowMasked = 0x0800;

tape::Telemetry usual;

tape::Telemetry played(unsigned set, unsigned cleared) {
  const unsigned before = _mm_getcsr();
  tape::Telemetry telemetry;
  _mm_setcsr((before | set) & ~cleared);
  const tape::TapeStatus status = tape::play(kFrames, telemetry);
  _mm_setcsr(before);
  assert_status(status, tape::TapeStatus::kReady);
  return telemetry;
}

void check_same(const tape::Telemetry& t) {
  assert_int_equal(t.frames, usual.frames);
  assert_true(t.poses == usual.poses);
  assert_true(t.fixes == usual.fixes);
  assert_true(t.boulders == usual.boulders);
}

int play_as_usual(void**) {
  usual = played(0, 0);
  return usual.frames == kFrames ? 0 : -1;
}

void test_flushed_to_zero(void**) { check_same(played(kFlushResults | kFlushOperands, 0)); }

/// SIGFPE would end the test.
void test_trapped(void**) { check_same(played(0, kDenormalMasked | kUnderflowMasked)); }

volatile std::sig_atomic_t traps = 0;

/// The traps are there: else the test before would prove nothing.
void test_traps_are_there(void**) {
  struct sigaction action {};
  struct sigaction old {};
  action.sa_sigaction = [](int, siginfo_t*, void* context) {
    ++traps;
    auto* const machine = static_cast<ucontext_t*>(context);
    machine->uc_mcontext.fpregs->mxcsr |= kDenormalMasked | kUnderflowMasked;
  };
  action.sa_flags = SA_SIGINFO;
  assert_int_equal(sigaction(SIGFPE, &action, &old), 0);
  const unsigned before = _mm_getcsr();
  volatile double small = 1.0e-200;
  volatile double subnormal = 0x1p-1060;
  for (const bool operand : {false, true}) {
    traps = 0;
    _mm_setcsr(before & ~(kDenormalMasked | kUnderflowMasked));
    volatile double product = operand ? subnormal * 2.0 : small * small;
    static_cast<void>(product);
    _mm_setcsr(before);
    assert_int_equal(traps, 1);
  }
  assert_int_equal(sigaction(SIGFPE, &old, nullptr), 0);
}

}  // namespace

int main() {
  if (cfg::kImageWidth != 512) {
    print_message("skipped: the sample is of mission 'paper'\n");
    return 0;
  }
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_flushed_to_zero),
      cmocka_unit_test(test_trapped),
      cmocka_unit_test(test_traps_are_there),
  };
  return cmocka_run_group_tests(tests, play_as_usual, nullptr);
}

#else

#include "support/cmocka.hpp"

int main() {
  print_message("skipped: this machine's traps are not SSE's, or the sanitizers are in\n");
  return 0;
}

#endif
