// Uploads in chunks: any order, losses, repeats, faults of every kind; maps and deltas; resets.
#include "orbital_map/map_transfer.hpp"

#include "core/random.hpp"
#include "orbital_map/raw_map.hpp"
#include "support/cmocka.hpp"
#include "support/slices.hpp"

using namespace cairn;
using cairn::test::kRawHead;
using cairn::test::RawBytes;
using cairn::test::RawTile;

namespace {

constexpr unsigned kColumns = 5;
constexpr unsigned kRows = 4;
constexpr unsigned kTiles = kColumns * kRows;
constexpr unsigned kChunk = 16;
constexpr std::size_t kBank = 2048;

std::uint8_t payloads[2][kTiles][6];  // one boulder each, of two versions
RawBytes old_map;
RawBytes new_map;
RawBytes changes;
RawBytes chunk_bytes;
std::uint8_t bank[kBank];
std::uint8_t before[kBank];
MapTransfer transfer;
MapTransfer second;

/// One boulder: count, mode, its gap as 19 bits of truncated binary (cmap_format.hpp).
RawTile one_boulder(int version, unsigned t) {
  std::uint8_t* p = payloads[version][t];
  const unsigned gap = 100U * t + 7U + 40U * static_cast<unsigned>(version);
  p[1] = 1;
  p[3] = static_cast<std::uint8_t>(gap << 5U >> 16U);
  p[4] = static_cast<std::uint8_t>(gap << 5U >> 8U);
  p[5] = static_cast<std::uint8_t>(gap << 5U);
  return {p, 6};
}

/// A map, and a new version of it with four changed tiles and a new one; the first tile of both is empty.
int make_maps(void**) {
  RawTile old_tiles[kTiles];
  RawTile tiles[kTiles];
  bool sent[kTiles] = {};
  for (unsigned t = 1; t < kTiles; ++t) {
    sent[t] = t % 5 == 2;
    if (t != 7) old_tiles[t] = one_boulder(0, t);
    tiles[t] = one_boulder(sent[t] ? 1 : 0, t);
  }
  test::raw_map(old_map, kColumns, kRows, 2, old_tiles, kTiles - 2);
  test::raw_map(new_map, kColumns, kRows, 2, tiles, kTiles - 1);
  test::raw_delta(changes, old_map, 0, 0, new_map.bytes, kRawHead, sent, tiles, kTiles);
  return 0;
}

UploadPlan plan_of(const RawBytes& upload, UploadKind kind) {
  return {static_cast<std::uint8_t>(kind), crc32(upload.bytes, upload.size),
          static_cast<std::uint32_t>(upload.size), kChunk};
}
UploadPlan whole() { return plan_of(new_map, UploadKind::kMap); }
UploadPlan delta() { return plan_of(changes, UploadKind::kDelta); }
unsigned chunks_of(const RawBytes& upload) {
  return static_cast<unsigned>(upload.size + kChunk - 1) / kChunk;
}

void seal_chunk() {
  be::put_u32(chunk_bytes.bytes + chunk_bytes.size - 4, crc32(chunk_bytes.bytes, chunk_bytes.size - 4));
}
void make_chunk(const RawBytes& upload, unsigned number) {
  chunk_bytes.size = 0;
  chunk_bytes.u32(crc32(upload.bytes, upload.size));
  chunk_bytes.u16(number);
  const std::size_t at = number * kChunk;
  chunk_bytes.append(upload.bytes + at, upload.size - at < kChunk ? upload.size - at : kChunk);
  chunk_bytes.u32(0);
  seal_chunk();
}
ChunkStatus give() { return transfer.accept(chunk_bytes.bytes, chunk_bytes.size); }
ChunkStatus give(const RawBytes& upload, unsigned number) {
  make_chunk(upload, number);
  return give();
}

void begin(const UploadPlan& plan, std::size_t room = kBank) {
  std::memset(bank, 0xEE, sizeof bank);
  transfer = MapTransfer();
  assert_status(transfer.begin(plan, bank, room), BeginStatus::kBegun);
}
void give_all(const RawBytes& upload) {
  for (unsigned n = 0; n < chunks_of(upload); ++n) assert_status(give(upload, n), ChunkStatus::kTaken);
  assert_status(transfer.status(), TransferStatus::kComplete);
}
TransferStatus verified(const RawBytes* base) {
  static_cast<void>(base == nullptr ? transfer.verify(nullptr, 0) : transfer.verify(base->bytes, base->size));
  assert_true(test::run_whole(transfer));
  return transfer.status();
}

/// The result is the new map, at the front of the bank.
void check_ready() {
  assert_status(transfer.status(), TransferStatus::kReady);
  assert_status(transfer.detail(), MapStatus::kUsable);
  assert_memory_equal(bank, new_map.bytes, new_map.size);
  assert_int_equal(transfer.result().count(), kTiles - 1);
  static MapBoulders boulders;
  boulders.clear();
  assert_status(transfer.result().window(Vec2(-35.5 + 25.0, 2251000.25 + 20.0), 100.0, boulders),
                WindowStatus::kUsable);
  assert_int_equal(boulders.size(), kTiles - 1);
}

void test_plans_at_their_bounds(void**) {
  const std::uint16_t least = chunk::kMinDataBytes;
  const std::uint16_t most = chunk::kMaxDataBytes;
  const std::uint32_t all = cfg::kMaxMapChunks;
  const struct {
    UploadPlan plan;
    std::size_t room;
    BeginStatus status;
  } cases[] = {
      {{1, 0, 100, least}, 100, BeginStatus::kBegun},
      {{2, 0, 100, most}, 100, BeginStatus::kBegun},
      {{0, 0, 100, least}, 100, BeginStatus::kBadKind},
      {{3, 0, 100, least}, 100, BeginStatus::kBadKind},
      {{1, 0, 100, static_cast<std::uint16_t>(least - 1)}, 100, BeginStatus::kBadChunkBytes},
      {{1, 0, 100, static_cast<std::uint16_t>(most + 1)}, 100, BeginStatus::kBadChunkBytes},
      {{1, 0, 100, 0}, 100, BeginStatus::kBadChunkBytes},
      {{1, 0, 0, least}, 100, BeginStatus::kEmpty},
      {{1, 0, 1, least}, 1, BeginStatus::kBegun},
      {{1, 0, all * least, least}, all * least, BeginStatus::kBegun},
      {{1, 0, all * least + 1, least}, all * least + 1, BeginStatus::kTooManyChunks},
      {{1, 0, 0xFFFFFFFFU, least}, 100, BeginStatus::kTooManyChunks},
      {{1, 0, 101, least}, 100, BeginStatus::kNoRoom},
      {{2, 0, 101, least}, 100, BeginStatus::kNoRoom},
      {{1, 0, 100, least}, 0, BeginStatus::kNoRoom},
  };
  for (const auto& c : cases) {
    transfer = MapTransfer();
    assert_status(transfer.begin(c.plan, bank, c.room), c.status);
    const bool begun = c.status == BeginStatus::kBegun;
    assert_status(transfer.status(), begun ? TransferStatus::kReceiving : TransferStatus::kIdle);
  }
  transfer = MapTransfer();
  assert_status(transfer.begin(whole(), nullptr, kBank), BeginStatus::kNoRoom);
}

void test_a_map_in_any_order_with_losses_and_repeats(void**) {
  Random random(3);
  const unsigned chunks = chunks_of(new_map);
  for (int n = 0; n < 200; ++n) {
    begin(whole());
    while (transfer.status() == TransferStatus::kReceiving) {
      const unsigned number = random.below(chunks);
      const bool had = transfer.has(number);
      const unsigned taken = transfer.record().taken;
      assert_status(give(new_map, number), had ? ChunkStatus::kRepeated : ChunkStatus::kTaken);
      assert_true(transfer.has(number));
      assert_int_equal(transfer.record().taken, had ? taken : taken + 1);
      for (unsigned i = 0; i < transfer.first_missing(); ++i) assert_true(transfer.has(i));
      assert_false(transfer.has(transfer.first_missing()));
    }
    assert_int_equal(transfer.first_missing(), chunks);
    assert_status(verified(nullptr), TransferStatus::kReady);
    check_ready();
  }
}

void test_a_delta_in_any_order(void**) {
  Random random(4);
  for (int n = 0; n < 200; ++n) {
    begin(delta(), new_map.size + changes.size);
    while (transfer.status() == TransferStatus::kReceiving)
      static_cast<void>(give(changes, random.below(chunks_of(changes))));
    assert_status(verified(&old_map), TransferStatus::kReady);
    check_ready();
    assert_memory_equal(bank + new_map.size, changes.bytes, changes.size);
  }
}

void check_refused(ChunkStatus expected) {
  const TransferRecord record = transfer.record();
  std::memcpy(before, bank, sizeof bank);
  assert_status(give(), expected);
  assert_memory_equal(bank, before, sizeof bank);
  assert_memory_equal(transfer.record().have, record.have, sizeof record.have);
  assert_int_equal(transfer.record().taken, record.taken);
  assert_status(transfer.record().status, record.status);
  for (std::size_t i = 0; i < kChunkStatusCount; ++i) {
    assert_int_equal(transfer.record().counts[i],
                     record.counts[i] + (i == static_cast<int>(expected) ? 1U : 0U));
  }
}

void test_every_bad_chunk_has_its_status(void**) {
  transfer = MapTransfer();
  make_chunk(new_map, 0);
  check_refused(ChunkStatus::kNoUpload);
  const unsigned last = chunks_of(new_map) - 1;
  assert_true(new_map.size % kChunk > 1);  // so that the last one is shorter
  for (const bool has_all : {false, true}) {
    begin(whole());
    if (has_all) give_all(new_map);
    if (!has_all) assert_status(give(new_map, 1), ChunkStatus::kTaken);
    make_chunk(changes, 0);
    check_refused(ChunkStatus::kOtherUpload);
    for (const unsigned beyond : {last + 1, 0xFFFFU}) {
      make_chunk(new_map, 0);
      be::put_u16(chunk_bytes.bytes + 4, static_cast<std::uint16_t>(beyond));
      seal_chunk();
      check_refused(ChunkStatus::kOutOfRange);
    }
    for (const unsigned number : {0U, last}) {
      for (const int more : {-1, 1}) {
        make_chunk(new_map, number);
        chunk_bytes.size = static_cast<std::size_t>(static_cast<int>(chunk_bytes.size) + more);
        seal_chunk();
        check_refused(ChunkStatus::kBadSize);
      }
    }
    make_chunk(new_map, 1);
    chunk_bytes.bytes[9] ^= 1U;
    seal_chunk();
    check_refused(ChunkStatus::kContradicts);
    make_chunk(new_map, 1);
    check_refused(ChunkStatus::kRepeated);
    for (const std::size_t size : {0, 1, 10, 10 + 1025}) {
      chunk_bytes.size = size;
      check_refused(ChunkStatus::kBadSize);
    }
    assert_status(transfer.accept(nullptr, 20), ChunkStatus::kBadSize);
  }
}

void test_every_single_flip_of_a_chunk_is_detected(void**) {
  begin(whole());
  for (const unsigned number : {0U, chunks_of(new_map) - 1}) {
    make_chunk(new_map, number);
    for (std::size_t bit = 0; bit < 8 * chunk_bytes.size; ++bit) {
      chunk_bytes.bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
      check_refused(ChunkStatus::kBadCrc);
      chunk_bytes.bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
    }
  }
}

void test_as_many_chunks_as_there_may_be(void**) {
  constexpr std::size_t kBytes = cfg::kMaxMapChunks * kChunk;
  static std::uint8_t large[kBytes];
  UploadPlan plan = whole();
  plan.bytes = kBytes;
  transfer = MapTransfer();
  assert_status(transfer.begin(plan, large, kBytes), BeginStatus::kBegun);
  for (std::size_t n = cfg::kMaxMapChunks; n-- > 0;) {
    make_chunk(new_map, 0);
    be::put_u16(chunk_bytes.bytes + 4, static_cast<std::uint16_t>(n));
    seal_chunk();
    assert_status(give(), ChunkStatus::kTaken);
    assert_int_equal(transfer.first_missing(), n == 0 ? cfg::kMaxMapChunks : 0);
  }
  assert_status(transfer.status(), TransferStatus::kComplete);
  assert_memory_equal(large + kBytes - kChunk, new_map.bytes, kChunk);
}

void test_the_same_begin_again(void**) {
  begin(whole());
  assert_status(give(new_map, 3), ChunkStatus::kTaken);
  const auto again = [] {
    const TransferRecord record = transfer.record();
    assert_status(transfer.begin(whole(), bank, kBank), BeginStatus::kUnderWay);
    assert_status(transfer.status(), record.status);
    assert_true(transfer.has(3));
    assert_int_equal(transfer.record().taken, record.taken);
  };
  again();
  for (unsigned n = 0; n < chunks_of(new_map); ++n) static_cast<void>(give(new_map, n));
  assert_status(transfer.status(), TransferStatus::kComplete);
  again();
  assert_status(transfer.verify(nullptr, 0), TransferStatus::kVerifying);
  assert_status(transfer.verify(nullptr, 0), TransferStatus::kVerifying);
  again();
  assert_true(test::run_whole(transfer));
  assert_status(transfer.status(), TransferStatus::kReady);
  again();
  check_ready();
}

void test_another_begin_gives_the_upload_up(void**) {
  for (int field = 0; field < 4; ++field) {
    begin(whole());
    assert_status(give(new_map, 3), ChunkStatus::kTaken);
    UploadPlan other = whole();
    if (field == 0) other.kind = 2;
    if (field == 1) ++other.id;
    if (field == 2) ++other.bytes;
    if (field == 3) ++other.chunk_bytes;
    assert_status(transfer.begin(other, bank, kBank), BeginStatus::kBegun);
    assert_false(transfer.has(3));
    assert_int_equal(transfer.record().taken, 0);
    // One that is refused does not.
    UploadPlan bad = whole();
    bad.bytes = 0;
    assert_status(transfer.begin(bad, bank, kBank), BeginStatus::kEmpty);
    assert_true(transfer.record().plan == other);
    assert_status(transfer.status(), TransferStatus::kReceiving);
  }
}

void test_bytes_that_are_not_those_of_the_id(void**) {
  begin(whole());
  give_all(new_map);
  bank[100] ^= 1U;  // an upset in the bank
  assert_status(verified(nullptr), TransferStatus::kUploadCrc);
  assert_false(transfer.result().usable());
  make_chunk(new_map, 0);
  check_refused(ChunkStatus::kNoUpload);
  // The same upload again, afresh.
  assert_status(transfer.begin(whole(), bank, kBank), BeginStatus::kBegun);
  assert_int_equal(transfer.record().taken, 0);
  give_all(new_map);
  assert_status(verified(nullptr), TransferStatus::kReady);
  check_ready();
}

void test_maps_that_are_not_whole_and_good(void**) {
  const RawBytes good = new_map;
  const auto check = [](MapStatus status) {
    begin(whole());
    give_all(new_map);
    assert_status(verified(nullptr), TransferStatus::kBadMap);
    assert_status(transfer.detail(), status);
    assert_false(transfer.result().usable());
    assert_status(transfer.begin(whole(), bank, kBank), BeginStatus::kBegun);
    assert_int_equal(transfer.detail(), 0);
  };
  new_map.bytes[0] ^= 1U;
  check(MapStatus::kBadMagic);
  new_map = good;
  new_map.bytes[new_map.size - 7] ^= 1U;  // the last tile: other maps may be used without it
  check(MapStatus::kDamaged);
  new_map = good;
  new_map.size -= 1;
  check(MapStatus::kTruncated);
  const RawTile none[kTiles] = {};
  test::raw_map(new_map, kColumns, kRows, 2, none, 0);
  check(MapStatus::kNoBoulders);
  new_map = good;
}

void test_deltas_that_are_refused(void**) {
  const auto check = [](const RawBytes* base, std::size_t room, DeltaStatus status) {
    begin(delta(), room);
    give_all(changes);
    assert_status(verified(base), TransferStatus::kBadDelta);
    assert_status(transfer.detail(), status);
    assert_false(transfer.result().usable());
  };
  check(nullptr, kBank, DeltaStatus::kOtherBase);
  check(&new_map, kBank, DeltaStatus::kOtherBase);
  check(&old_map, new_map.size + changes.size - 1, DeltaStatus::kNoRoom);
  const RawBytes good = changes;
  changes.u8(0);
  check(&old_map, kBank, DeltaStatus::kLeftOver);
  changes = good;
  // A tile of the base that was damaged: its bytes go over, and the new head's CRCs tell.
  const RawBytes sound = old_map;
  old_map.bytes[old_map.size - 7] ^= 1U;
  begin(delta());
  give_all(changes);
  assert_status(verified(&old_map), TransferStatus::kBadMap);
  old_map = sound;
  begin(delta());
  give_all(changes);
  assert_status(verified(&old_map), TransferStatus::kReady);
  check_ready();
}

void test_slicing_does_not_matter(void**) {
  for (const bool is_delta : {false, true}) {
    const RawBytes& upload = is_delta ? changes : new_map;
    begin(is_delta ? delta() : whole());
    give_all(upload);
    assert_status(transfer.verify(old_map.bytes, old_map.size), TransferStatus::kVerifying);
    assert_false(transfer.result().usable());
    int steps = 0;
    for (;; ++steps) {
      WorkBudget budget(1);
      const Progress progress = transfer.step(budget);
      assert_at_most(budget.spent(), 2000);
      if (progress == Progress::kDone) break;
      assert_status(transfer.status(), TransferStatus::kVerifying);
    }
    assert_true(steps > 20);
    check_ready();
    assert_true(test::run_whole(transfer));  // nothing left to do
    check_ready();
  }
}

/// A reset at every moment: the record and the bank are all that is left.
void test_resets(void**) {
  for (const bool is_delta : {false, true}) {
    const RawBytes& upload = is_delta ? changes : new_map;
    const unsigned chunks = chunks_of(upload);
    for (unsigned reset = 0; reset <= chunks; ++reset) {
      begin(is_delta ? delta() : whole());
      for (unsigned n = 0; n < reset; ++n) assert_status(give(upload, chunks - 1 - n), ChunkStatus::kTaken);
      TransferRecord record;
      std::memcpy(&record, &transfer.record(), sizeof record);
      transfer = MapTransfer();
      assert_status(transfer.resume(record, bank, kBank), BeginStatus::kBegun);
      assert_int_equal(transfer.record().counts[0], reset);
      for (unsigned n = reset; n < chunks; ++n)
        assert_status(give(upload, chunks - 1 - n), ChunkStatus::kTaken);
      assert_status(verified(&old_map), TransferStatus::kReady);
      check_ready();
    }
    // While it is verified, and after.
    for (int steps = 0; transfer.status() != TransferStatus::kIdle; ++steps) {
      const TransferRecord ready = transfer.record();
      assert_status(transfer.resume(ready, bank, kBank), BeginStatus::kBegun);
      assert_status(transfer.status(), TransferStatus::kComplete);
      assert_int_equal(transfer.detail(), 0);
      static_cast<void>(transfer.verify(old_map.bytes, old_map.size));
      for (int n = 0; n < steps; ++n) {
        WorkBudget budget(1);
        static_cast<void>(transfer.step(budget));
      }
      if (transfer.status() == TransferStatus::kReady) break;
      const TransferRecord record = transfer.record();
      transfer = MapTransfer();
      assert_status(transfer.resume(record, bank, kBank), BeginStatus::kBegun);
      assert_status(verified(&old_map), TransferStatus::kReady);
      check_ready();
    }
  }
}

void test_records_that_contradict_themselves(void**) {
  begin(whole());
  assert_status(give(new_map, 3), ChunkStatus::kTaken);
  const TransferRecord good = transfer.record();
  const auto check = [](const TransferRecord& record, BeginStatus status) {
    second = MapTransfer();
    assert_status(second.resume(record, bank, kBank), status);
    assert_status(second.status(),
                  status == BeginStatus::kBegun ? TransferStatus::kReceiving : TransferStatus::kIdle);
  };
  check(good, BeginStatus::kBegun);
  check(TransferRecord(), BeginStatus::kEmpty);
  TransferRecord r = good;
  r.status = TransferStatus::kInUse;
  check(r, BeginStatus::kEmpty);
  r.status = TransferStatus::kBadMap;
  check(r, BeginStatus::kEmpty);
  r = good;
  r.plan.kind = 0;
  check(r, BeginStatus::kBadKind);
  r = good;
  r.plan.chunk_bytes = 0;
  check(r, BeginStatus::kBadChunkBytes);
  r = good;
  ++r.chunks;
  check(r, BeginStatus::kEmpty);
  r = good;
  ++r.taken;
  check(r, BeginStatus::kEmpty);
  r = good;
  r.have[0] ^= 1U;
  check(r, BeginStatus::kEmpty);
  r = good;
  r.have[sizeof r.have - 1] = 0x80;  // a chunk beyond the last
  r.taken = 2;
  check(r, BeginStatus::kEmpty);
  r = good;
  std::uint8_t& beyond = r.have[r.chunks / 8];  // the first one beyond it
  beyond = static_cast<std::uint8_t>(beyond | 1U << r.chunks % 8);
  r.taken = 2;
  check(r, BeginStatus::kEmpty);
  second = MapTransfer();
  assert_status(second.resume(good, bank, new_map.size - 1), BeginStatus::kNoRoom);
  assert_status(second.resume(good, nullptr, kBank), BeginStatus::kNoRoom);
}

void test_leaving(void**) {
  transfer = MapTransfer();
  transfer.leave();
  assert_status(transfer.status(), TransferStatus::kIdle);
  begin(whole());
  give_all(new_map);
  transfer.leave();
  assert_status(transfer.status(), TransferStatus::kIdle);
  make_chunk(new_map, 0);
  check_refused(ChunkStatus::kNoUpload);
  begin(whole());
  give_all(new_map);
  assert_status(verified(nullptr), TransferStatus::kReady);
  transfer.leave();
  assert_status(transfer.status(), TransferStatus::kInUse);
  assert_false(transfer.result().usable());
  make_chunk(new_map, 0);
  check_refused(ChunkStatus::kNoUpload);
  assert_status(transfer.begin(whole(), bank, kBank), BeginStatus::kBegun);
}

void test_verify_waits_for_all_chunks(void**) {
  transfer = MapTransfer();
  assert_status(transfer.verify(nullptr, 0), TransferStatus::kIdle);
  begin(whole());
  assert_status(transfer.verify(nullptr, 0), TransferStatus::kReceiving);
  assert_true(test::run_whole(transfer));
  assert_status(transfer.status(), TransferStatus::kReceiving);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_plans_at_their_bounds),
      cmocka_unit_test(test_a_map_in_any_order_with_losses_and_repeats),
      cmocka_unit_test(test_a_delta_in_any_order),
      cmocka_unit_test(test_every_bad_chunk_has_its_status),
      cmocka_unit_test(test_every_single_flip_of_a_chunk_is_detected),
      cmocka_unit_test(test_as_many_chunks_as_there_may_be),
      cmocka_unit_test(test_the_same_begin_again),
      cmocka_unit_test(test_another_begin_gives_the_upload_up),
      cmocka_unit_test(test_bytes_that_are_not_those_of_the_id),
      cmocka_unit_test(test_maps_that_are_not_whole_and_good),
      cmocka_unit_test(test_deltas_that_are_refused),
      cmocka_unit_test(test_slicing_does_not_matter),
      cmocka_unit_test(test_resets),
      cmocka_unit_test(test_records_that_contradict_themselves),
      cmocka_unit_test(test_leaving),
      cmocka_unit_test(test_verify_waits_for_all_chunks),
  };
  return cmocka_run_group_tests(tests, make_maps, nullptr);
}
