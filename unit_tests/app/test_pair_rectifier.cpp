// Raw pairs on board: what tables and buffers are refused, sides that are missing, and slices.
#include "app/pair_rectifier.hpp"

#include <cstring>

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using app::PairRectifier;
using app::RawPairs;

namespace {

constexpr int kWidth = 64, kHeight = 48;  // rectified
constexpr int kRawWidth = 80, kRawHeight = 60;
RemapTable tables[2];
std::uint8_t raw_pixels[2][kRawWidth * kRawHeight];
std::uint8_t made[2][kWidth * kHeight];
PairRectifier rectifier;

StereoRig rig() {
  StereoRig r;
  r.width_px = kWidth;
  r.height_px = kHeight;
  return r;
}

RawPairs good() {
  for (int side = 0; side < 2; ++side) {
    RemapTable& t = tables[side];
    t = RemapTable();
    t.width_px = kWidth;
    t.height_px = kHeight;
    const int columns = remap::nodes_along(kWidth, remap::kSpacing);
    const int rows = remap::nodes_along(kHeight, remap::kSpacing);
    for (int i = 0; i < columns * rows; ++i) {
      t.nodes[static_cast<std::size_t>(i)] = {(i % columns * remap::kSpacing + 5 + side) * 517,
                                              (i / columns * remap::kSpacing + 2) * 509};
    }
  }
  Random random(3);
  for (auto& pixels : raw_pixels) {
    for (std::uint8_t& p : pixels) p = static_cast<std::uint8_t>(random.below(256));
  }
  return {&tables[0], &tables[1], crc_of(tables[0]), crc_of(tables[1]),
          kRawWidth,  kRawHeight, raw_pixels[0],     raw_pixels[1]};
}

void refused(const RawPairs& raw, const StereoRig& r = rig()) {
  assert_false(rectifier.init(&raw, r));
  assert_false(rectifier.needed());
}

void test_refusals(void**) {
  assert_true(rectifier.init(nullptr, rig()));
  assert_false(rectifier.needed());
  RawPairs raw = good();
  assert_true(rectifier.init(&raw, rig()));
  assert_true(rectifier.needed());
  StereoRig other = rig();
  other.width_px += 8;
  refused(raw, other);
  raw.left_table = nullptr;
  refused(raw);
  raw = good();
  raw.right_crc ^= 1U;
  refused(raw);
  raw = good();
  ++tables[0].nodes[7].u;
  refused(raw);
  raw = good();
  tables[1].nodes[7].v = (remap::kReach_px + 1) << remap::kFractionBits;
  refused(raw);
  raw = good();
  raw.left = nullptr;
  refused(raw);
  raw = good();
  raw.width_px = 1;
  refused(raw);
  raw = good();
  raw.height_px = 2049;
  refused(raw);
}

/// Width, height, and each node count, in their order.
void test_crc(void**) {
  good();
  const std::uint32_t crc = crc_of(tables[0]);
  RemapTable& t = tables[0];
  std::swap(t.nodes[3].u, t.nodes[3].v);
  assert_true(crc_of(t) != crc);
  std::swap(t.nodes[3].u, t.nodes[3].v);
  assert_int_equal(crc_of(t), crc);
  const auto used = static_cast<std::size_t>(remap::nodes_along(kWidth, remap::kSpacing) *
                                             remap::nodes_along(kHeight, remap::kSpacing));
  t.nodes[used].u = 9;  // of no pixel
  assert_int_equal(crc_of(t), crc);
  t.nodes[used - 1].v += 1;
  assert_true(crc_of(t) != crc);
}

void test_sliced_anyhow_the_same(void**) {
  const RawPairs raw = good();
  assert_true(rectifier.init(&raw, rig()));
  rectifier.start(kRawWidth, kRawHeight, kRawWidth, kRawHeight, made[0], made[1]);
  WorkBudget all = WorkBudget::unlimited();
  assert_true(rectifier.busy());
  assert_status(rectifier.step(all), Progress::kDone);
  assert_false(rectifier.busy());
  assert_int_equal(all.spent(), 2U * 4U * kWidth * kHeight);
  static std::uint8_t whole[2][kWidth * kHeight];
  std::memcpy(whole, made, sizeof made);
  for (int side = 0; side < 2; ++side) {  // as the job by itself
    static std::uint8_t alone[kWidth * kHeight];
    RemapJob job;
    assert_status(
        job.start(tables[side], packed_view<const std::uint8_t>(raw_pixels[side], kRawWidth, kRawHeight),
                  packed_view(alone, kWidth, kHeight)),
        RemapStatus::kRunning);
    WorkBudget budget = WorkBudget::unlimited();
    assert_status(job.step(budget), Progress::kDone);
    assert_memory_equal(alone, whole[side], sizeof alone);
  }
  for (const std::uint32_t slice : {1U, 300U, 5000U}) {
    std::memset(made, 0, sizeof made);
    rectifier.start(kRawWidth, kRawHeight, kRawWidth, kRawHeight, made[0], made[1]);
    for (bool more = true; more;) {
      WorkBudget budget(slice);
      more = rectifier.step(budget) == Progress::kMore;
      assert_true(more == rectifier.busy());
    }
    assert_memory_equal(made, whole, sizeof made);
    assert_true(rectifier.left().data == made[0] && rectifier.right().data == made[1]);
  }
}

void test_missing_sides(void**) {
  const RawPairs raw = good();
  assert_true(rectifier.init(&raw, rig()));
  rectifier.start(0, 0, kRawWidth, kRawHeight, made[0], made[1]);
  WorkBudget all = WorkBudget::unlimited();
  assert_status(rectifier.step(all), Progress::kDone);
  assert_true(rectifier.left().data == nullptr && rectifier.right().data == made[1]);
  rectifier.start(kRawWidth, kRawHeight, kRawWidth, kRawHeight - 1, made[0], made[1]);
  assert_status(rectifier.step(all), Progress::kDone);
  assert_true(rectifier.left().data == made[0] && rectifier.right().data == nullptr);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_refusals),
      cmocka_unit_test(test_crc),
      cmocka_unit_test(test_sliced_anyhow_the_same),
      cmocka_unit_test(test_missing_sides),
  };
  return cmocka_run_group_tests_name("pair_rectifier", tests, nullptr, nullptr);
}
