// Assignment: OR-Library's optima, all permutations, statuses, slicing.
#include "labeling/assignment.hpp"

#include <string>

#include "core/random.hpp"
#include "support/cmocka.hpp"
#include "support/data.hpp"

using namespace cairn;

namespace {

constexpr int kLarge = 700;
std::uint16_t entries[kLarge * kLarge];
AssignmentJob<kLarge> large;
AssignmentJob<8> small;
AssignmentJob<64> job;
AssignmentJob<64> sliced;

template <typename Job>
void solve(Job& j, const AssignmentMatrix& m, AssignmentSense sense) {
  (void)j.start(m, sense);
  WorkBudget all = WorkBudget::unlimited();
  assert_int_equal(static_cast<int>(j.step(all)), static_cast<int>(Progress::kDone));
  assert_status(j.status(), AssignmentStatus::kSolved);
}

/// Each column once, the shorter side whole, and the total that of the entries.
template <typename Job>
void check_assignment(const Job& j, const AssignmentMatrix& m) {
  static bool used[kLarge];
  for (bool& u : used) u = false;
  int assigned = 0;
  std::int64_t sum = 0;
  for (int i = 0; i < m.rows; ++i) {
    const std::uint16_t c = j.col_of_row(i);
    if (c == j.kNone) continue;
    assert_true(c < m.cols);
    assert_false(used[c]);
    used[c] = true;
    ++assigned;
    sum += m.data[i * m.stride + c];
  }
  assert_int_equal(assigned, m.rows < m.cols ? m.rows : m.cols);
  assert_int_equal(sum, j.total());
}

void test_or_library(void**) {
  const std::string folder = cairn::test::find_data("oracles/lap_orlib");
  SKIP_WITHOUT(folder, "oracles/lap_orlib");
  int files = 0;
  std::FILE* optima = std::fopen((folder + "/optima_verified.txt").c_str(), "r");
  assert_non_null(optima);
  char name[64];
  long optimum = 0;
  while (std::fscanf(optima, "%63s %ld", name, &optimum) == 2) {
    std::FILE* in = std::fopen((folder + "/" + name + ".txt").c_str(), "r");
    assert_non_null(in);
    int n = 0;
    assert_int_equal(std::fscanf(in, "%d", &n), 1);
    assert_in_range(n, 100, kLarge);
    int read = 0;
    while (read < n * n && std::fscanf(in, "%hu", &entries[read]) == 1) ++read;
    assert_int_equal(read, n * n);
    std::fclose(in);
    const AssignmentMatrix m{entries, n, n, n};
    solve(large, m, AssignmentSense::kLeastCost);
    check_assignment(large, m);
    assert_int_equal(large.total(), optimum);
    for (int i = 0; i < n * n; ++i) entries[i] = static_cast<std::uint16_t>(1000 - entries[i]);
    solve(large, m, AssignmentSense::kMostVotes);
    assert_int_equal(large.total(), 1000L * n - optimum);
    ++files;
  }
  std::fclose(optima);
  assert_int_equal(files, 4);
}

/// The optimum over all ways to give rows 0 .. n-1 their columns, one digit of an odometer a row.
std::int64_t brute_force(const AssignmentMatrix& m, bool least) {
  const bool tall = m.rows > m.cols;
  const int n = tall ? m.cols : m.rows;
  const int wide = tall ? m.rows : m.cols;
  int choice[8] = {};
  std::int64_t best = least ? INT64_MAX : INT64_MIN;
  for (;;) {
    bool distinct = true;
    std::int64_t sum = 0;
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k < i; ++k) distinct = distinct && choice[k] != choice[i];
      sum += tall ? m.data[choice[i] * m.stride + i] : m.data[i * m.stride + choice[i]];
    }
    if (distinct && (least ? sum < best : sum > best)) best = sum;
    int digit = 0;
    while (digit < n && ++choice[digit] == wide) choice[digit++] = 0;
    if (digit == n) return best;
  }
}

void test_against_all_permutations(void**) {
  Random random(1);
  for (int trial = 0; trial < 400; ++trial) {
    const int rows = 1 + static_cast<int>(random.below(trial % 20 == 0 ? 8 : 6));
    const int cols = 1 + static_cast<int>(random.below(trial % 20 == 0 ? 7 : 6));
    const std::uint32_t span = trial % 3 == 0   ? 3U
                               : trial % 3 == 1 ? 100U
                                                : 65536U;  // many ties, some, extremes
    for (int i = 0; i < 100; ++i) entries[i] = static_cast<std::uint16_t>(random.below(span));
    const AssignmentMatrix m{entries, rows, cols, cols + 2};  // a stride wider than the rows
    for (const bool least : {true, false}) {
      solve(small, m, least ? AssignmentSense::kLeastCost : AssignmentSense::kMostVotes);
      check_assignment(small, m);
      assert_int_equal(small.total(), brute_force(m, least));
    }
  }
}

void test_extreme_entries(void**) {
  for (int i = 0; i < 64 * 64; ++i) entries[i] = i % 65 == 0 ? 0xFFFF : 0;
  const AssignmentMatrix m{entries, 64, 64, 64};
  solve(job, m, AssignmentSense::kMostVotes);
  assert_int_equal(job.total(), 64L * 65535L);
  for (int i = 0; i < 64; ++i) assert_int_equal(job.col_of_row(i), i);
  solve(job, m, AssignmentSense::kLeastCost);
  assert_int_equal(job.total(), 0);
  for (int i = 0; i < 64 * 64; ++i) entries[i] = 7;
  solve(job, m, AssignmentSense::kLeastCost);
  assert_int_equal(job.total(), 64 * 7);
}

void test_statuses(void**) {
  static AssignmentJob<8> fresh;
  assert_status(fresh.status(), AssignmentStatus::kIdle);
  WorkBudget any(10);
  assert_int_equal(static_cast<int>(fresh.step(any)), static_cast<int>(Progress::kDone));
  for (int i = 0; i < 100; ++i) entries[i] = static_cast<std::uint16_t>(i % 9);
  const auto start = [](const AssignmentMatrix& m) { return small.start(m, AssignmentSense::kLeastCost); };
  assert_status(start({entries, 8, 8, 8}), AssignmentStatus::kRunning);
  assert_status(start({entries, 9, 2, 2}), AssignmentStatus::kTooLarge);
  assert_status(start({entries, 2, 9, 9}), AssignmentStatus::kTooLarge);
  assert_status(start({entries, -1, 2, 2}), AssignmentStatus::kBadInput);
  assert_status(start({entries, 2, -1, 2}), AssignmentStatus::kBadInput);
  assert_status(start({entries, 2, 3, 2}), AssignmentStatus::kBadInput);
  assert_status(start({nullptr, 2, 2, 2}), AssignmentStatus::kBadInput);
  assert_status(small.start({entries, 2, 2, 2}, static_cast<AssignmentSense>(9)),
                AssignmentStatus::kBadInput);
  assert_status(start({nullptr, 0, 0, 0}), AssignmentStatus::kSolved);
  assert_status(start({entries, 5, 0, 0}), AssignmentStatus::kSolved);
  assert_int_equal(small.col_of_row(4), small.kNone);
  assert_status(start({entries, 0, 5, 5}), AssignmentStatus::kSolved);
  assert_int_equal(small.total(), 0);
}

void test_same_for_every_slicing(void**) {
  Random random(3);
  for (const int cols : {64, 40}) {
    for (int i = 0; i < 64 * 64; ++i) entries[i] = static_cast<std::uint16_t>(random.below(20));
    const AssignmentMatrix m{entries, 64, cols, cols};
    solve(job, m, AssignmentSense::kMostVotes);
    for (const std::uint32_t ops : {1U, 300U, 5000U}) {
      (void)sliced.start(m, AssignmentSense::kMostVotes);
      int steps = 0;
      for (; steps < 100000; ++steps) {
        WorkBudget slice(ops);
        if (sliced.step(slice) == Progress::kDone) break;
      }
      if (ops == 1U) assert_at_least(steps, 39);
      assert_status(sliced.status(), AssignmentStatus::kSolved);
      for (int i = 0; i < 64; ++i) assert_int_equal(sliced.col_of_row(i), job.col_of_row(i));
      assert_int_equal(sliced.total(), job.total());
    }
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_or_library),
      cmocka_unit_test(test_against_all_permutations),
      cmocka_unit_test(test_extreme_entries),
      cmocka_unit_test(test_statuses),
      cmocka_unit_test(test_same_for_every_slicing),
  };
  return cmocka_run_group_tests_name("labeling/assignment", tests, nullptr, nullptr);
}
