// Matching against a brute force over random descriptors: windows, signs, ratio, uniqueness, slices.
#include "features/match.hpp"

#include <cstring>

#include "features/sift_descriptor.hpp"
#include "support/cmocka.hpp"
#include "support/death.hpp"
#include "support/noise.hpp"
#include "support/slices.hpp"

using namespace cairn;

namespace {

using Windows = FixedVector<SearchWindow, cfg::kMaxFeatures>;

constexpr int kHeight = 100;
constexpr int kWidth = 200;
FeatureSet query;
FeatureSet target;
Windows windows;
MatchJob job;
MatchJob sliced;

constexpr SearchWindow kEverywhere = {0, kWidth - 1, 0, kHeight - 1};

void clear(FeatureSet& set) {
  set.features.clear();
  set.descriptors.clear();
  set.height = kHeight;
  std::memset(set.row_begin, 0, sizeof set.row_begin);
}

/// Features must come in scan order.
void add(FeatureSet& set, int u, int v, std::int16_t response, const Descriptor& d) {
  Feature f;
  f.iu = static_cast<std::int16_t>(u);
  f.iv = static_cast<std::int16_t>(v);
  f.response = response;
  assert_true(set.features.push_back(f));
  assert_true(set.descriptors.push_back(d));
  for (int row = v + 1; row <= kHeight; ++row) ++set.row_begin[row];
}

Descriptor constant(int value) {
  Descriptor d;
  std::memset(d.bin, value, sizeof d.bin);
  return d;
}

/// Few kinds of descriptors with little noise, so that ratios and rivals decide.
void fill_random(FeatureSet& set, std::uint64_t seed, int count) {
  clear(set);
  Random random(seed);
  for (int i = 0; i < count; ++i) {
    Descriptor d;
    Random kind(random.below(150));
    for (std::uint8_t& b : d.bin) b = static_cast<std::uint8_t>(kind.below(100) + random.below(30));
    add(set, static_cast<int>(random.below(kWidth)), i * kHeight / count, random.below(2) == 0 ? 300 : -300,
        d);
  }
}

/// The contract, read literally.
void brute_force(const MatchParams& params, std::int16_t* partner) {
  static std::uint32_t distance[cfg::kMaxFeatures];
  for (std::size_t i = 0; i < query.features.size(); ++i) {
    const SearchWindow& w = windows[i];
    std::uint32_t best = UINT32_MAX;
    std::uint32_t second = UINT32_MAX;
    partner[i] = MatchJob::kNone;
    for (std::size_t j = 0; j < target.features.size(); ++j) {
      const Feature& t = target.features[j];
      const bool inside = t.iu >= w.u0 && t.iu <= w.u1 && t.iv >= w.v0 && t.iv <= w.v1;
      if (!inside || (t.response < 0) != (query.features[i].response < 0)) continue;
      const std::uint32_t d = chi_squared(query.descriptors[i], target.descriptors[j], UINT32_MAX);
      if (d < best) {
        second = best;
        best = d;
        partner[i] = static_cast<std::int16_t>(j);
      } else if (d < second) {
        second = d;
      }
    }
    distance[i] = best;
    const bool rivalled =
        second != UINT32_MAX && static_cast<float>(best) > params.ratio * static_cast<float>(second);
    if (best > params.max_distance || rivalled) partner[i] = MatchJob::kNone;
  }
  for (std::size_t i = 0; i < query.features.size(); ++i) {
    for (std::size_t k = 0; k < query.features.size() && partner[i] != MatchJob::kNone; ++k) {
      if (k == i || partner[k] != partner[i]) continue;
      if (distance[k] > distance[i] || (distance[k] == distance[i] && k > i)) partner[k] = MatchJob::kNone;
    }
  }
}

void run(const MatchParams& params) {
  job.start(params, query, target, windows);
  assert_true(test::run_whole(job));
}

void test_equals_brute_force(void**) {
  static std::int16_t expected[cfg::kMaxFeatures];
  int contested = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    fill_random(query, seed, 240);
    fill_random(target, 100 + seed, 260);
    Random random(seed);
    windows.clear();
    for (const Feature& f : query.features) {
      const int r = 5 + static_cast<int>(random.below(80));
      // Reaches beyond the image on purpose; some are empty.
      SearchWindow w = {static_cast<std::int16_t>(f.iu - r), static_cast<std::int16_t>(f.iu + r),
                        static_cast<std::int16_t>(f.iv - r), static_cast<std::int16_t>(f.iv + r)};
      if (random.below(10) == 0) w = SearchWindow();
      assert_true(windows.push_back(w));
    }
    MatchParams params;
    params.ratio = seed % 2 == 0 ? 0.8F : 0.95F;
    params.max_distance = 600 * 256;
    run(params);
    brute_force(params, expected);
    std::size_t count = 0;
    for (std::size_t i = 0; i < query.features.size(); ++i) {
      assert_int_equal(job.partner(i), expected[i]);
      count += expected[i] == MatchJob::kNone ? 0 : 1;
    }
    assert_int_equal(job.count(), count);
    contested += static_cast<int>(count);
  }
  print_message("%d matches of 1440 queries\n", contested);
  assert_true(contested > 100 && contested < 1200);
}

void one_query(const Descriptor& d, const SearchWindow& w, std::int16_t response = 300) {
  clear(query);
  add(query, 50, 50, response, d);
  windows.clear();
  assert_true(windows.push_back(w));
}

void test_window_corners_are_inclusive(void**) {
  clear(target);
  add(target, 40, 30, 300, constant(50));
  const SearchWindow at = {40, 40, 30, 30};
  one_query(constant(50), at);
  run({});
  assert_int_equal(job.partner(0), 0);
  for (const SearchWindow& off :
       {SearchWindow{41, 45, 30, 30}, SearchWindow{30, 39, 30, 30}, SearchWindow{40, 40, 31, 40},
        SearchWindow{40, 40, 20, 29}, SearchWindow{41, 39, 30, 30}, SearchWindow{40, 40, 31, 29},
        SearchWindow{-50, -1, 30, 30}, SearchWindow{40, 40, -9, -1},
        SearchWindow{40, 40, kHeight, kHeight + 9}}) {
    one_query(constant(50), off);
    run({});
    assert_int_equal(job.partner(0), MatchJob::kNone);
    assert_int_equal(job.count(), 0);
  }
}

void test_signs_do_not_mix(void**) {
  clear(target);
  add(target, 40, 30, -300, constant(50));
  add(target, 90, 30, 300, constant(60));
  one_query(constant(50), kEverywhere, 300);
  run({});
  assert_int_equal(job.partner(0), 1);
  one_query(constant(60), kEverywhere, -300);
  run({});
  assert_int_equal(job.partner(0), 0);
}

void test_ratio(void**) {
  // Chi-squared of constants a, b is proportional to (a - b)^2 / (a + b): 50 to 52 and to 54, ratio 0.255.
  clear(target);
  add(target, 40, 30, 300, constant(52));
  add(target, 90, 60, 300, constant(54));
  one_query(constant(50), kEverywhere);
  MatchParams params;
  params.ratio = 0.26F;
  run(params);
  assert_int_equal(job.partner(0), 0);
  params.ratio = 0.25F;
  run(params);
  assert_int_equal(job.partner(0), MatchJob::kNone);
  // A single candidate has no rival.
  one_query(constant(50), {0, 45, 0, kHeight});
  run(params);
  assert_int_equal(job.partner(0), 0);
}

void test_equal_rivals_cancel(void**) {
  clear(target);
  add(target, 40, 30, 300, constant(52));
  add(target, 90, 60, 300, constant(52));
  one_query(constant(50), kEverywhere);
  run({});
  assert_int_equal(job.partner(0), MatchJob::kNone);
}

void test_largest_distance_is_inclusive(void**) {
  clear(target);
  add(target, 40, 30, 300, constant(60));
  one_query(constant(40), kEverywhere);
  const std::uint32_t d = chi_squared(constant(40), constant(60), UINT32_MAX);
  MatchParams params;
  params.max_distance = d;
  run(params);
  assert_int_equal(job.partner(0), 0);
  params.max_distance = d - 1;
  run(params);
  assert_int_equal(job.partner(0), MatchJob::kNone);
}

void test_a_partner_is_used_once(void**) {
  // The nearer query wins, whichever comes first; equal ones: the first.
  clear(target);
  add(target, 40, 30, 300, constant(50));
  for (int winner = 0; winner < 2; ++winner) {
    clear(query);
    add(query, 10, 10, 300, constant(winner == 0 ? 51 : 53));
    add(query, 20, 20, 300, constant(winner == 0 ? 53 : 51));
    windows.clear();
    assert_true(windows.push_back(kEverywhere));
    assert_true(windows.push_back(kEverywhere));
    run({});
    assert_int_equal(job.partner(static_cast<std::size_t>(winner)), 0);
    assert_int_equal(job.partner(static_cast<std::size_t>(1 - winner)), MatchJob::kNone);
    assert_int_equal(job.count(), 1);
  }
  clear(query);
  add(query, 10, 10, 300, constant(52));
  add(query, 20, 20, 300, constant(52));
  run({});
  assert_int_equal(job.partner(0), 0);
  assert_int_equal(job.partner(1), MatchJob::kNone);
}

void test_nothing_to_match(void**) {
  clear(query);
  clear(target);
  windows.clear();
  run({});
  assert_int_equal(job.count(), 0);
  one_query(constant(50), kEverywhere);
  run({});
  assert_int_equal(job.partner(0), MatchJob::kNone);
}

void test_a_window_for_each_query(void**) {
  one_query(constant(50), kEverywhere);
  clear(target);
  windows.clear();
  assert_true(test::asserts([] { job.start({}, query, target, windows); }));
}

void test_what_is_not_described_has_no_partner(void**) {
  one_query(constant(50), kEverywhere);
  clear(target);
  add(target, 20, 20, 300, constant(50));
  add(target, 30, 30, 300, constant(60));
  run({});
  assert_int_equal(job.partner(0), 0);
  target.features[0].described = false;
  run({});
  assert_int_equal(job.partner(0), 1);
}

std::uint16_t grey[2][kWidth * kHeight];
const SmoothImage kPictures[2] = {packed_view<const std::uint16_t>(grey[0], kWidth, kHeight),
                                  packed_view<const std::uint16_t>(grey[1], kWidth, kHeight)};

/// A field of noise, moved to the left by `shift` in the second picture and darker there; features on a grid.
void fill_pictures(int shift) {
  Random random(51);
  clear(query);
  clear(target);
  for (int i = 0; i < kWidth * kHeight; ++i) grey[0][i] = static_cast<std::uint16_t>(random.below(65281));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x)
      grey[1][y * kWidth + x] = static_cast<std::uint16_t>(grey[0][y * kWidth + (x + shift) % kWidth] / 2);
  }
  for (int y = 20; y < kHeight - 10; y += 7) {
    for (int x = 40; x < kWidth - 10; x += 9) {
      const auto response = static_cast<std::int16_t>(random.below(2) == 0 ? 300 : -300);
      add(query, x, y, response, {});
      add(target, x - shift, y, response, {});
      query.features[query.features.size() - 1].described = false;
      target.features[target.features.size() - 1].described = false;
    }
  }
}

/// Nothing is described: each patch is found among others of its row.
void test_patches_find_their_like(void**) {
  fill_pictures(12);
  windows.clear();
  for (const Feature& f : query.features)
    assert_true(windows.push_back({0, static_cast<std::int16_t>(f.iu), f.iv, f.iv}));
  job.start({0.8F, SparsePatch::kUnlike / 2}, query, target, windows, kPictures[0], kPictures[1]);
  assert_true(test::run_whole(job));
  for (std::size_t i = 0; i < query.features.size(); ++i) assert_int_equal(job.partner(i), i);
  sliced.start({0.8F, SparsePatch::kUnlike / 2}, query, target, windows, kPictures[0], kPictures[1]);
  assert_true(test::run_in_slices(sliced) > 10);
  for (std::size_t i = 0; i < query.features.size(); ++i) assert_int_equal(sliced.partner(i), i);
  // Where the partner is none of the candidates, nothing else is like it.
  for (SearchWindow& w : windows) w.u1 = static_cast<std::int16_t>(w.u1 - 13);
  job.start({0.8F, SparsePatch::kUnlike / 4}, query, target, windows, kPictures[0], kPictures[1]);
  assert_true(test::run_whole(job));
  assert_int_equal(job.count(), 0);
}

void test_slices_give_the_same_matches(void**) {
  fill_random(query, 31, 300);
  fill_random(target, 32, 300);
  windows.clear();
  for (std::size_t i = 0; i < query.features.size(); ++i) assert_true(windows.push_back(kEverywhere));
  MatchParams params;
  params.ratio = 0.95F;
  run(params);
  sliced.start(params, query, target, windows);
  assert_true(test::run_in_slices(sliced) > 50);
  assert_int_equal(sliced.count(), job.count());
  assert_true(job.count() > 20);
  for (std::size_t i = 0; i < query.features.size(); ++i) assert_int_equal(sliced.partner(i), job.partner(i));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_what_is_not_described_has_no_partner),
      cmocka_unit_test(test_patches_find_their_like),
      cmocka_unit_test(test_equals_brute_force),
      cmocka_unit_test(test_window_corners_are_inclusive),
      cmocka_unit_test(test_signs_do_not_mix),
      cmocka_unit_test(test_ratio),
      cmocka_unit_test(test_equal_rivals_cancel),
      cmocka_unit_test(test_largest_distance_is_inclusive),
      cmocka_unit_test(test_a_partner_is_used_once),
      cmocka_unit_test(test_nothing_to_match),
      cmocka_unit_test(test_a_window_for_each_query),
      cmocka_unit_test(test_slices_give_the_same_matches),
  };
  return cmocka_run_group_tests_name("match", tests, nullptr, nullptr);
}
