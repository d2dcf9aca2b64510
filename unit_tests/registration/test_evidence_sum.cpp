// Evidence added up over windows: what adds up and how, each verdict of the sum.
#include "registration/evidence_sum.hpp"

#include <cmath>

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

Verdict window(VerdictStatus status, double log_ratio, double chance_log) {
  Verdict v;
  v.status = status;
  v.log_ratio = log_ratio;
  v.chance_log = chance_log;
  return v;
}

void test_poor_windows_add_up(void**) {
  const VerdictParams params;
  EvidenceSum sum;
  assert_status(sum.verdict(params), VerdictStatus::kNone);
  sum.add(window(VerdictStatus::kTooLittleEvidence, 6.0, 12.0));
  assert_status(sum.verdict(params), VerdictStatus::kTooLittleEvidence);
  sum.add(window(VerdictStatus::kTooLittleEvidence, 6.0, 12.0));
  assert_near(sum.log_ratio(), 12.0, 0.0);
  assert_status(sum.verdict(params), VerdictStatus::kAccepted);
  assert_int_equal(sum.windows(), 2);
}

/// A window that agrees with nothing takes back what others gave; below -3 nats the hypothesis is dropped.
void test_misses_count(void**) {
  const VerdictParams params;
  EvidenceSum sum;
  sum.add(window(VerdictStatus::kTooLittleEvidence, 8.0, 30.0));
  sum.add(window(VerdictStatus::kNoHypothesis, evidence_of_misses(10), 0.0));
  assert_near(
      evidence_of_misses(10),
      std::log(0.25 * (std::pow(0.75, 10) + std::pow(0.5, 10) + std::pow(0.25, 10) + std::pow(0.08, 10))),
      1e-12);
  assert_status(sum.verdict(params), VerdictStatus::kNoHypothesis);
  sum.add(window(VerdictStatus::kTooLittleEvidence, 5.0, 30.0));
  assert_status(sum.verdict(params), VerdictStatus::kTooLittleEvidence);
  assert_false(sum.drop());
  sum.add(window(VerdictStatus::kTooLittleEvidence, -14.0, 0.0));
  assert_true(sum.drop());
  sum.reset();
  assert_int_equal(sum.windows(), 0);
}

/// Fisher's rule: of n windows of pure chance (-ln of uniform tails) chance_log is -ln of a uniform again.
void test_chance_of_many_windows(void**) {
  Random random(1);
  constexpr int kTrials = 20000;
  int beyond = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    EvidenceSum sum;
    for (int n = 0; n < 4; ++n) {
      sum.add(
          window(VerdictStatus::kTooLittleEvidence, 0.0, -std::log((random.next() + 0.5) / 4294967296.0)));
    }
    beyond += sum.chance_log() > std::log(100.0) ? 1 : 0;
  }
  assert_in_range(beyond, 150, 250);  // one in a hundred
}

void test_last_window_has_a_say(void**) {
  const VerdictParams params;
  for (const VerdictStatus last : {VerdictStatus::kAmbiguous, VerdictStatus::kInconsistentWithPrior}) {
    EvidenceSum sum;
    sum.add(window(VerdictStatus::kTooLittleEvidence, 10.0, 30.0));
    sum.add(window(last, 10.0, 30.0));
    assert_status(sum.verdict(params), last);
  }
  EvidenceSum sum;  // a lattice: much agreement, no less at decoys
  sum.add(window(VerdictStatus::kChanceAgreement, 30.0, 1.0));
  sum.add(window(VerdictStatus::kChanceAgreement, 30.0, 1.0));
  assert_status(sum.verdict(params), VerdictStatus::kChanceAgreement);
}

/// A lattice that was met in its phase is so again: a prior that is narrow by then proves nothing against it.
void test_regular_ground_does_not_add_up(void**) {
  const VerdictParams params;
  EvidenceSum sum;
  Verdict narrow = window(VerdictStatus::kTooLittleEvidence, 8.0, 9.0);
  narrow.beyond_decoys = 0.5;
  sum.add(narrow);
  for (int n = 0; n < 5; ++n) sum.add(narrow);
  assert_status(sum.verdict(params), VerdictStatus::kChanceAgreement);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_poor_windows_add_up),
      cmocka_unit_test(test_misses_count),
      cmocka_unit_test(test_chance_of_many_windows),
      cmocka_unit_test(test_last_window_has_a_say),
      cmocka_unit_test(test_regular_ground_does_not_add_up),
  };
  return cmocka_run_group_tests_name("registration/evidence_sum", tests, nullptr, nullptr);
}
