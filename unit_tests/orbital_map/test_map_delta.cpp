// Deltas: the new map comes out byte for byte; whatever does not fit together is a status, and nothing is
// read or written beyond what was given.
#include "orbital_map/map_delta.hpp"

#include "core/random.hpp"
#include "orbital_map/raw_map.hpp"
#include "support/cmocka.hpp"
#include "support/slices.hpp"

using namespace cairn;
using cairn::test::kRawHead;
using cairn::test::raw_delta;
using cairn::test::raw_map;
using cairn::test::RawBytes;
using cairn::test::RawTile;

namespace {

constexpr unsigned kColumns = 4;
constexpr unsigned kRows = 3;
constexpr unsigned kTiles = kColumns * kRows;
constexpr std::size_t kMargin = 16;

std::uint8_t noise[3000];
RawBytes base;
RawBytes wanted;
RawBytes made;
RawBytes changes;
std::uint8_t out[60000 + 2 * kMargin];
DeltaJob job;

/// Tile t of the base: 1 + 90 t bytes of noise, the third one empty.
RawTile old_tile(unsigned t) { return t == 2 ? RawTile{} : RawTile{noise + 7 * t, 1 + 90 * t}; }
/// A changed tile.
RawTile new_tile(unsigned t) { return {noise + 1000 + 11 * t, 300 - 13 * t}; }

int make_noise(void**) {
  Random random(5);
  for (std::uint8_t& b : noise) b = static_cast<std::uint8_t>(random.below(256));
  return 0;
}

/// A base of the shape above, and a new version of it in which tiles 1, 2 and 11 are changed and 5 is empty.
void make_pair_of_versions(unsigned base_entry = 2, unsigned new_entry = 2) {
  RawTile old_tiles[kTiles];
  RawTile tiles[kTiles];
  bool sent[kTiles] = {};
  for (unsigned t = 0; t < kTiles; ++t) {
    old_tiles[t] = tiles[t] = old_tile(t);
    if (t == 1 || t == 2 || t == 11) tiles[t] = new_tile(t);
    if (t == 5) tiles[t] = {};
    sent[t] = t == 1 || t == 2 || t == 5 || t == 11;
  }
  raw_map(base, kColumns, kRows, base_entry, old_tiles);
  raw_map(wanted, kColumns, kRows, new_entry, tiles);
  raw_delta(changes, base, 0, 0, wanted.bytes, kRawHead, sent, tiles, kTiles);
}

DeltaStatus apply(std::size_t delta_bytes, std::size_t base_bytes, std::size_t room) {
  std::memset(out, 0xA5, sizeof out);
  if (job.start(changes.bytes, delta_bytes, base.bytes, base_bytes, out + kMargin, room) ==
      DeltaStatus::kApplying) {
    assert_true(test::run_whole(job));
  }
  for (std::size_t i = 0; i < kMargin; ++i) assert_int_equal(out[i], 0xA5);
  for (std::size_t i = kMargin + room; i < sizeof out; ++i) assert_int_equal(out[i], 0xA5);
  return job.status();
}
DeltaStatus apply() { return apply(changes.size, base.size, wanted.size); }

void check_made() {
  assert_status(apply(), DeltaStatus::kApplied);
  assert_int_equal(job.result_bytes(), wanted.size);
  assert_memory_equal(out + kMargin, wanted.bytes, wanted.size);
}

void test_changed_and_emptied_tiles(void**) {
  for (unsigned base_entry = 2; base_entry <= 4; ++base_entry) {
    for (unsigned new_entry = 2; new_entry <= 4; ++new_entry) {
      make_pair_of_versions(base_entry, new_entry);
      check_made();
    }
  }
}

/// The new map's grid lies otherwise on the base's: tiles that both have are shared, and sealed anew.
void test_shifted_grids(void**) {
  RawTile old_tiles[kTiles];
  for (unsigned t = 0; t < kTiles; ++t) old_tiles[t] = old_tile(t);
  raw_map(base, kColumns, kRows, 2, old_tiles);
  for (int dx = -5; dx <= 5; ++dx) {
    for (int dy = -4; dy <= 4; ++dy) {
      constexpr unsigned kNewColumns = 3;
      constexpr unsigned kNewTiles = 6;
      RawTile tiles[kNewTiles];
      const bool sent[kNewTiles] = {};
      for (int t = 0; t < static_cast<int>(kNewTiles); ++t) {
        const int column = t % 3 + dx;
        const int row = t / 3 + dy;
        const bool shared = column >= 0 && column < 4 && row >= 0 && row < 3;
        tiles[t] = shared ? old_tile(static_cast<unsigned>(row * 4 + column)) : RawTile{};
      }
      raw_map(wanted, kNewColumns, 2, 3, tiles);
      raw_delta(changes, base, dx, dy, wanted.bytes, kRawHead, sent, tiles, kNewTiles);
      check_made();
    }
  }
}

void test_slicing_does_not_matter(void**) {
  make_pair_of_versions();
  std::memset(out, 0, sizeof out);
  assert_status(job.start(changes.bytes, changes.size, base.bytes, base.size, out, wanted.size),
                DeltaStatus::kApplying);
  assert_true(test::run_in_slices(job) >= 3);
  assert_status(job.status(), DeltaStatus::kApplied);
  assert_memory_equal(out, wanted.bytes, wanted.size);
  // A unit, no more, for each step of a tiny budget.
  assert_status(job.start(changes.bytes, changes.size, base.bytes, base.size, out, wanted.size),
                DeltaStatus::kApplying);
  for (;;) {
    WorkBudget budget(1);
    const Progress progress = job.step(budget);
    assert_at_most(budget.spent(), 800);
    if (progress == Progress::kDone) break;
  }
  assert_status(job.status(), DeltaStatus::kApplied);
}

void test_every_truncation(void**) {
  make_pair_of_versions();
  for (std::size_t size = 0; size < changes.size; ++size) {
    const DeltaStatus status = apply(size, base.size, wanted.size);
    // Less than a head is no head.
    if (size >= 18 && size < 18 + kRawHead) {
      assert_status(status, DeltaStatus::kBadHead);
    } else {
      assert_status(status, DeltaStatus::kTruncated);
    }
  }
  assert_status(job.start(nullptr, changes.size, base.bytes, base.size, out, wanted.size),
                DeltaStatus::kTruncated);
}

void test_magic_and_version(void**) {
  make_pair_of_versions();
  changes.bytes[3] ^= 1U;
  assert_status(apply(), DeltaStatus::kBadMagic);
  changes.bytes[3] ^= 1U;
  changes.bytes[4] = 2;
  assert_status(apply(), DeltaStatus::kUnknownVersion);
  changes.bytes[4] = 1;
  changes.bytes[5] = 1;
  assert_status(apply(), DeltaStatus::kUnknownVersion);
}

void put_new_head(std::size_t at, std::uint32_t value, unsigned bytes) {
  for (unsigned i = 0; i < bytes; ++i)
    changes.bytes[18 + at + i] = static_cast<std::uint8_t>(value >> 8 * (bytes - 1 - i));
}

void test_heads_that_are_none(void**) {
  const struct {
    std::size_t at;
    std::uint32_t value;
    unsigned bytes;
  } faults[] = {
      {0, 0x434D4151U, 4},  // magic
      {4, 1, 1},            // version
      {6, 1, 1},
      {6, 5, 1},  // width of an entry
      {8, 80, 2},
      {8, 65535, 2},  // head shorter than it can be, or than is there
      {12, kRawHead, 4},
      {12, kRawHead + 2 * kTiles - 1, 4},  // file without room for head and directory
      {48, 0, 4},
      {48, 1, 4},  // tile side: none, or too many tiles
      {36, 0x7FFFFFFFU, 4},
      {40, 0xFFFFFFFFU, 4},
  };
  for (const auto& fault : faults) {
    make_pair_of_versions();
    put_new_head(fault.at, fault.value, fault.bytes);
    assert_status(apply(), DeltaStatus::kBadHead);
  }
  make_pair_of_versions();
  put_new_head(8, static_cast<std::uint32_t>(changes.size) - 18 + 1, 2);  // one byte more than is there
  assert_status(apply(), DeltaStatus::kBadHead);
  put_new_head(8, static_cast<std::uint32_t>(changes.size) - 18, 2);  // but then there are no flags
  assert_status(apply(), DeltaStatus::kTruncated);
}

void test_other_bases(void**) {
  make_pair_of_versions();
  assert_status(apply(changes.size, base.size - 1, wanted.size), DeltaStatus::kOtherBase);
  assert_status(apply(changes.size, 0, wanted.size), DeltaStatus::kOtherBase);
  assert_status(job.start(changes.bytes, changes.size, nullptr, 0, out, wanted.size),
                DeltaStatus::kOtherBase);
  for (const std::size_t at : {std::size_t{0}, std::size_t{4}, std::size_t{15}, kRawHead - 1}) {
    make_pair_of_versions();
    base.bytes[at] ^= 4U;
    assert_status(apply(), DeltaStatus::kOtherBase);
  }
  make_pair_of_versions();
  changes.bytes[13] ^= 1U;  // the size that it names
  assert_status(apply(), DeltaStatus::kOtherBase);
  changes.bytes[13] ^= 1U;
  changes.bytes[17] ^= 1U;  // the CRC that it names
  assert_status(apply(), DeltaStatus::kOtherBase);
  changes.bytes[17] ^= 1U;
  // Of a bank that is larger than its map, the rest does not matter.
  assert_status(apply(changes.size, base.size + 100, wanted.size), DeltaStatus::kApplied);
}

void test_room(void**) {
  make_pair_of_versions();
  assert_status(apply(changes.size, base.size, wanted.size - 1), DeltaStatus::kNoRoom);
  assert_status(apply(changes.size, base.size, 0), DeltaStatus::kNoRoom);
  assert_status(job.start(changes.bytes, changes.size, base.bytes, base.size, nullptr, wanted.size),
                DeltaStatus::kNoRoom);
  assert_status(apply(changes.size, base.size, wanted.size + 1), DeltaStatus::kApplied);
}

/// The base's directory was changed after the base had been validated.
void test_a_base_that_contradicts_itself(void**) {
  const auto spoil = [](unsigned tile, unsigned offset) {
    make_pair_of_versions();
    be::put_u16(base.bytes + kRawHead + 2 * tile, static_cast<std::uint16_t>(offset));
    return apply();
  };
  const unsigned end = static_cast<unsigned>(base.size - kRawHead - 2 * kTiles);
  assert_status(spoil(4, 0xFFFF), DeltaStatus::kBadBase);    // tile 3 would end far beyond the file
  assert_status(spoil(4, 5), DeltaStatus::kBadBase);         // and before it begins
  assert_status(spoil(11, end + 1), DeltaStatus::kBadBase);  // tile 10 would end one beyond the file
  const unsigned begin = be::get_u16(base.bytes + kRawHead + 2 * 3);
  assert_status(spoil(4, begin + 4), DeltaStatus::kBadBase);  // a payload of its CRC alone
}

void test_sizes_that_do_not_add_up(void**) {
  make_pair_of_versions();
  put_new_head(12, static_cast<std::uint32_t>(wanted.size) - 1, 4);
  // The last tile does not fit any more.
  assert_status(apply(changes.size, base.size, wanted.size - 1), DeltaStatus::kBadSize);
  make_pair_of_versions();
  put_new_head(12, static_cast<std::uint32_t>(wanted.size) + 1, 4);
  assert_status(apply(changes.size, base.size, wanted.size + 1), DeltaStatus::kBadSize);
  make_pair_of_versions();
  changes.u8(0);
  assert_status(apply(), DeltaStatus::kLeftOver);
  assert_int_equal(job.result_bytes(), wanted.size);
}

/// A base tile that was damaged comes out with a CRC that the new head does not know.
void test_a_damaged_base_tile_shows_in_the_crcs(void**) {
  make_pair_of_versions();
  base.bytes[base.size - 100 - 91 * 11 + 20] ^= 4U;  // in tile 10
  assert_status(apply(), DeltaStatus::kApplied);
  std::uint32_t differences = 0;
  for (std::size_t i = 0; i < wanted.size; ++i) differences += out[kMargin + i] != wanted.bytes[i] ? 1U : 0U;
  assert_true(differences >= 2 && differences <= 5);  // the bit, and the tile's CRC
}

/// Whatever bytes come, the job ends, and writes where it may.
void test_noise(void**) {
  Random random(11);
  int applied = 0;
  for (int n = 0; n < 20000; ++n) {
    make_pair_of_versions();
    for (std::uint32_t flips = random.below(4); flips-- > 0;) {
      RawBytes& victim = random.below(2) == 0 ? base : changes;
      victim.bytes[random.below(static_cast<std::uint32_t>(victim.size))] ^=
          static_cast<std::uint8_t>(1U + random.below(255));
    }
    std::memset(out, 0xA5, kMargin);
    std::memset(out + kMargin + wanted.size, 0xA5, kMargin);
    if (job.start(changes.bytes, changes.size, base.bytes, base.size, out + kMargin, wanted.size) ==
        DeltaStatus::kApplying) {
      assert_true(test::run_whole(job));
    }
    applied += job.status() == DeltaStatus::kApplied ? 1 : 0;
    for (std::size_t i = 0; i < kMargin; ++i) assert_int_equal(out[i], 0xA5);
    for (std::size_t i = 0; i < kMargin; ++i) assert_int_equal(out[kMargin + wanted.size + i], 0xA5);
  }
  assert_at_least(applied, 1000);
  assert_at_most(applied, 19900);
}

void test_idle(void**) {
  static DeltaJob fresh;
  assert_status(fresh.status(), DeltaStatus::kIdle);
  assert_true(test::run_whole(fresh));
  assert_status(fresh.status(), DeltaStatus::kIdle);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_changed_and_emptied_tiles),
      cmocka_unit_test(test_shifted_grids),
      cmocka_unit_test(test_slicing_does_not_matter),
      cmocka_unit_test(test_every_truncation),
      cmocka_unit_test(test_magic_and_version),
      cmocka_unit_test(test_heads_that_are_none),
      cmocka_unit_test(test_other_bases),
      cmocka_unit_test(test_room),
      cmocka_unit_test(test_a_base_that_contradicts_itself),
      cmocka_unit_test(test_sizes_that_do_not_add_up),
      cmocka_unit_test(test_a_damaged_base_tile_shows_in_the_crcs),
      cmocka_unit_test(test_noise),
      cmocka_unit_test(test_idle),
  };
  return cmocka_run_group_tests(tests, make_noise, nullptr);
}
