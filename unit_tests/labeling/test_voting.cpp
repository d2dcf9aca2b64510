// Temporal association: who goes on with whom, who is new, who is lost.
#include "labeling/voting.hpp"

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

VotingJob job;
VotingJob sliced;
constexpr int kMost = static_cast<int>(cfg::kMaxLabels);

void vote(VotingJob& j, int t, int t1, int times) {
  for (int i = 0; i < times; ++i) assert_true(j.add_vote(t, t1));
}

void finish(VotingJob& j) {
  (void)j.associate();
  WorkBudget all = WorkBudget::unlimited();
  assert_int_equal(static_cast<int>(j.step(all)), static_cast<int>(Progress::kDone));
  assert_status(j.status(), VotingStatus::kDone);
}

void test_matched_new_lost(void**) {
  assert_status(job.start(4, 3, 1), VotingStatus::kCollecting);
  vote(job, 1, 2, 9);
  vote(job, 2, 2, 5);  // outvoted: lost, though it has votes
  vote(job, 4, 1, 1);
  finish(job);
  const VotingResult& r = job.result();
  assert_int_equal(r.previous_of[2], 1);
  assert_int_equal(r.previous_of[1], 4);
  assert_int_equal(r.previous_of[3], 0);
  assert_int_equal(r.next_of[1], 2);
  assert_int_equal(r.next_of[2], 0);
  assert_int_equal(r.next_of[3], 0);
  assert_int_equal(r.next_of[4], 1);
  assert_int_equal(r.matched, 2);
  assert_int_equal(r.new_labels, 1);
  assert_int_equal(r.lost_labels, 2);
}

/// The most votes in all, not the best one first: greedy would take (1,1) and leave 10.
void test_assignment_is_global(void**) {
  (void)job.start(2, 2, 1);
  vote(job, 1, 1, 10);
  vote(job, 1, 2, 9);
  vote(job, 2, 1, 9);
  finish(job);
  assert_int_equal(job.result().next_of[1], 2);
  assert_int_equal(job.result().next_of[2], 1);
}

/// Pairs below the minimum cannot push aside one that reaches it.
void test_minimum_votes(void**) {
  for (const int minimum : {3, 4}) {
    (void)job.start(2, 2, minimum);
    vote(job, 1, 1, 3);
    vote(job, 1, 2, 2);
    vote(job, 2, 1, 2);
    finish(job);
    assert_int_equal(job.result().next_of[1], minimum == 3 ? 1 : 0);
    assert_int_equal(job.result().matched, minimum == 3 ? 1 : 0);
    assert_int_equal(job.result().next_of[2], 0);
  }
}

void test_no_votes_no_match(void**) {
  (void)job.start(5, 7, 1);
  finish(job);
  assert_int_equal(job.result().matched, 0);
  assert_int_equal(job.result().new_labels, 7);
  assert_int_equal(job.result().lost_labels, 5);
}

void test_votes_that_do_not_count(void**) {
  (void)job.start(3, 2, 1);
  for (const auto& pair : {std::pair<int, int>{0, 1}, {1, 0}, {4, 1}, {1, 3}, {-1, 1}}) {
    assert_false(job.add_vote(pair.first, pair.second));
    assert_int_equal(job.votes(pair.first, pair.second), 0);
  }
  vote(job, 3, 2, 70000);
  assert_int_equal(job.votes(3, 2), 65535);
  finish(job);
  assert_false(job.add_vote(1, 1));
  assert_int_equal(job.result().next_of[3], 2);
}

void test_statuses(void**) {
  static VotingJob fresh;
  assert_status(fresh.status(), VotingStatus::kIdle);
  assert_status(fresh.associate(), VotingStatus::kIdle);
  assert_false(fresh.add_vote(1, 1));
  assert_status(job.start(kMost, kMost, 1), VotingStatus::kCollecting);
  assert_status(job.associate(), VotingStatus::kRunning);
  assert_status(job.start(kMost + 1, 1, 1), VotingStatus::kBadInput);
  assert_status(job.start(1, kMost + 1, 1), VotingStatus::kBadInput);
  assert_status(job.start(-1, 1, 1), VotingStatus::kBadInput);
  assert_status(job.start(1, -1, 1), VotingStatus::kBadInput);
  assert_status(job.start(1, 1, 0), VotingStatus::kBadInput);
  assert_status(job.associate(), VotingStatus::kBadInput);
  assert_status(job.start(0, 4, 1), VotingStatus::kCollecting);
  assert_status(job.associate(), VotingStatus::kDone);
  assert_int_equal(job.result().new_labels, 4);
  (void)job.start(4, 0, 1);
  assert_status(job.associate(), VotingStatus::kDone);
  assert_int_equal(job.result().lost_labels, 4);
}

void test_same_for_every_slicing(void**) {
  Random random(2);
  (void)job.start(kMost, kMost - 5, 2);
  (void)sliced.start(kMost, kMost - 5, 2);
  for (int i = 0; i < 3000; ++i) {
    const int t = 1 + static_cast<int>(random.below(kMost));
    const int t1 = 1 + (t + static_cast<int>(random.below(4))) % (kMost - 5);
    assert_true(job.add_vote(t, t1));
    assert_true(sliced.add_vote(t, t1));
  }
  finish(job);
  assert_at_least(job.result().matched, kMost / 2);
  (void)sliced.associate();
  int steps = 0;
  for (; steps < 100000; ++steps) {
    WorkBudget slice(1 + static_cast<std::uint32_t>(steps) % 1000U);
    if (sliced.step(slice) == Progress::kDone) break;
  }
  assert_at_least(steps, 100);
  assert_memory_equal(job.result().next_of, sliced.result().next_of, sizeof job.result().next_of);
  assert_memory_equal(job.result().previous_of, sliced.result().previous_of, sizeof job.result().previous_of);
  assert_int_equal(job.result().matched, sliced.result().matched);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_matched_new_lost),        cmocka_unit_test(test_assignment_is_global),
      cmocka_unit_test(test_minimum_votes),           cmocka_unit_test(test_no_votes_no_match),
      cmocka_unit_test(test_votes_that_do_not_count), cmocka_unit_test(test_statuses),
      cmocka_unit_test(test_same_for_every_slicing),
  };
  return cmocka_run_group_tests_name("labeling/voting", tests, nullptr, nullptr);
}
