// The remap against its formula in double precision, at its corners, and in slices.
#include "image/remap.hpp"

#include <cmath>
#include <cstring>

#include "core/crc32.hpp"
#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

constexpr int kSpacing = remap::kSpacing;
constexpr int kOne = 1 << remap::kFractionBits;
constexpr int kWidth = 2 * kSpacing + 5, kHeight = kSpacing + 3;  // of the target
constexpr int kSourceWidth = 61, kSourceHeight = 47;
RemapTable table;
std::uint8_t source[kSourceWidth * kSourceHeight];
std::uint8_t target[kWidth * kHeight];
RemapJob job;

const ImageU8 kSource = packed_view<const std::uint8_t>(source, kSourceWidth, kSourceHeight);
const MutableImageU8 kTarget = packed_view(target, kWidth, kHeight);
constexpr int kColumns = remap::nodes_along(kWidth, kSpacing);
constexpr int kRows = remap::nodes_along(kHeight, kSpacing);

void fill_random(std::uint64_t seed) {
  Random random(seed);
  for (std::uint8_t& p : source) p = static_cast<std::uint8_t>(random.below(256));
}

template <typename Place>
void fill_table(const Place& place) {
  table = RemapTable();
  table.width_px = kWidth;
  table.height_px = kHeight;
  for (int r = 0; r < kRows; ++r) {
    for (int c = 0; c < kColumns; ++c) {
      table.nodes[static_cast<std::size_t>(r * kColumns + c)] = place(c * kSpacing, r * kSpacing);
    }
  }
}

void run() {
  assert_true(job.start(table, kSource, kTarget) == RemapStatus::kRunning);
  WorkBudget all = WorkBudget::unlimited();
  assert_true(job.step(all) == Progress::kDone && job.status() == RemapStatus::kDone);
  assert_int_equal(all.spent(), 4 * kWidth * kHeight);
}

/// The source at whole pixels, the border repeated.
double grey(int x, int y) {
  const int u = x < 0 ? 0 : x >= kSourceWidth ? kSourceWidth - 1 : x;
  const int v = y < 0 ? 0 : y >= kSourceHeight ? kSourceHeight - 1 : y;
  return source[v * kSourceWidth + u];
}

double by_formula(int x, int y) {
  const int c = x / kSpacing, r = y / kSpacing;
  const double i = x % kSpacing, j = y % kSpacing, s = kSpacing;
  double at[2] = {};
  for (int k = 0; k < 2; ++k) {
    const auto node = [&](int dc, int dr) {
      const RemapNode& n = table.nodes[static_cast<std::size_t>((r + dr) * kColumns + c + dc)];
      return static_cast<double>(k == 0 ? n.u : n.v) / kOne;
    };
    at[k] =
        ((s - i) * ((s - j) * node(0, 0) + j * node(0, 1)) + i * ((s - j) * node(1, 0) + j * node(1, 1))) /
        (s * s);
  }
  const double u = std::fmin(std::fmax(at[0], 0.0), kSourceWidth - 1.0);
  const double v = std::fmin(std::fmax(at[1], 0.0), kSourceHeight - 1.0);
  const int p = static_cast<int>(u), q = static_cast<int>(v);
  const double a = u - p, b = v - q;
  return (1.0 - b) * ((1.0 - a) * grey(p, q) + a * grey(p + 1, q)) +
         b * ((1.0 - a) * grey(p, q + 1) + a * grey(p + 1, q + 1));
}

void test_identity_and_whole_shifts(void**) {
  fill_random(1);
  fill_table([](int x, int y) { return RemapNode{(x + 3) * kOne, (y + 5) * kOne}; });
  run();
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x)
      assert_int_equal(target[y * kWidth + x], source[(y + 5) * kSourceWidth + x + 3]);
  }
}

// Nodes anywhere, beyond the border on all sides as well.
void test_formula(void**) {
  Random random(2);
  for (int round = 0; round < 50; ++round) {
    fill_random(10 + static_cast<std::uint64_t>(round));
    const int spread = round < 40 ? 12 : 2 * remap::kReach_px;
    fill_table([&](int x, int y) {
      const auto off = [&] {
        return (static_cast<int>(random.below(static_cast<std::uint32_t>(spread) * kOne)) -
                spread * kOne / 2);
      };
      const int reach = remap::kReach_px * kOne;
      const auto within = [reach](int v) { return v < -reach ? -reach : v > reach ? reach : v; };
      return RemapNode{within(x * kOne + off()), within(y * kOne + off())};
    });
    run();
    // Weights of 1/256 px, and half a level of rounding.
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x)
        assert_near(target[y * kWidth + x], by_formula(x, y), 0.5 + 2.0 * 255.0 / 256.0);
    }
  }
}

void test_sliced_anyhow_the_same(void**) {
  fill_random(3);
  fill_table([](int x, int y) { return RemapNode{x * kOne * 2 + y * 37, y * kOne + x * 11 - 900}; });
  run();
  static std::uint8_t whole[kWidth * kHeight];
  std::memcpy(whole, target, sizeof whole);
  for (const std::uint32_t slice : {1U, 150U, 4U * kWidth, 1000U}) {
    std::memset(target, 0, sizeof target);
    assert_true(job.start(table, kSource, kTarget) == RemapStatus::kRunning);
    Progress progress = Progress::kMore;
    while (progress == Progress::kMore) {
      WorkBudget budget(slice);
      progress = job.step(budget);
      assert_true(budget.spent() <= slice + RemapJob::kMostUnit);
    }
    assert_memory_equal(whole, target, sizeof whole);
  }
}

// On each target.
void test_same_bits(void**) {
  fill_random(4);
  fill_table([](int x, int y) { return RemapNode{x * 597 + y * 83 - 700, y * 603 - x * 41 + 300}; });
  run();
  if (kSpacing == 8) assert_int_equal(crc32(target, sizeof target), 0x74083ff2U);
}

void test_refusals(void**) {
  fill_table([](int x, int y) { return RemapNode{x * kOne, y * kOne}; });
  const auto status = [](const RemapTable& t, const ImageU8& s, const MutableImageU8& out) {
    const RemapStatus at = job.start(t, s, out);
    WorkBudget budget = WorkBudget::unlimited();
    assert_true(at == RemapStatus::kRunning || job.step(budget) == Progress::kDone);
    assert_true(at == RemapStatus::kRunning || job.status() == at);
    return at;
  };
  static RemapTable bad;
  const auto with = [](auto change) -> const RemapTable& {
    bad = table;
    change(bad);
    return bad;
  };
  const int reach = remap::kReach_px * kOne;
  assert_true(RemapJob().status() == RemapStatus::kIdle);
  assert_true(status(table, kSource, kTarget) == RemapStatus::kRunning);
  assert_true(status(with([](RemapTable& t) { t.width_px = 0; }), kSource, kTarget) ==
              RemapStatus::kBadTable);
  assert_true(status(with([](RemapTable& t) { t.width_px = cfg::kImageWidth + 1; }), kSource, kTarget) ==
              RemapStatus::kBadTable);
  assert_true(status(with([](RemapTable& t) { t.height_px = -1; }), kSource, kTarget) ==
              RemapStatus::kBadTable);
  assert_true(status(with([](RemapTable& t) { t.height_px = cfg::kImageHeight + 1; }), kSource, kTarget) ==
              RemapStatus::kBadTable);
  const std::size_t last = static_cast<std::size_t>(kColumns * kRows) - 1;
  assert_true(status(with([&](RemapTable& t) { t.nodes[last].u = reach; }), kSource, kTarget) ==
              RemapStatus::kRunning);
  assert_true(status(with([&](RemapTable& t) { t.nodes[last].u = reach + 1; }), kSource, kTarget) ==
              RemapStatus::kBadTable);
  assert_true(status(with([&](RemapTable& t) { t.nodes[0].v = -reach - 1; }), kSource, kTarget) ==
              RemapStatus::kBadTable);
  // Behind those that are used anything may lie.
  assert_true(status(with([&](RemapTable& t) { t.nodes[last + 1].v = INT32_MAX; }), kSource, kTarget) ==
              RemapStatus::kRunning);
  assert_true(status(table, packed_view<const std::uint8_t>(source, 1, 40), kTarget) ==
              RemapStatus::kBadImage);
  assert_true(status(table, packed_view<const std::uint8_t>(source, 40, 1), kTarget) ==
              RemapStatus::kBadImage);
  assert_true(status(table, ImageU8{nullptr, 40, 40, 40}, kTarget) == RemapStatus::kBadImage);
  assert_true(status(table, ImageU8{source, 2049, 1, 2049}, kTarget) == RemapStatus::kBadImage);
  assert_true(status(table, kSource, packed_view(target, kWidth - 1, kHeight)) == RemapStatus::kBadImage);
  assert_true(status(table, kSource, packed_view(target, kWidth, kHeight - 1)) == RemapStatus::kBadImage);
}

void test_both_tables_take_64_kib_at_most(void**) {
  assert_true(2 * sizeof(RemapNode) * remap::kMostNodes <= remap::kMostBytes);
  assert_true(kSpacing == 8 || 2 * sizeof(RemapNode) * remap::nodes_of(kSpacing / 2) > remap::kMostBytes);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_identity_and_whole_shifts),
      cmocka_unit_test(test_formula),
      cmocka_unit_test(test_sliced_anyhow_the_same),
      cmocka_unit_test(test_same_bits),
      cmocka_unit_test(test_refusals),
      cmocka_unit_test(test_both_tables_take_64_kib_at_most),
  };
  return cmocka_run_group_tests_name("image/remap", tests, nullptr, nullptr);
}
