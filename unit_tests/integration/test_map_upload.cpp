// Maps and deltas sent up in telecommands, through the host's hal, while the module goes on.
#include "core/random.hpp"
#include "hal/nvm.hpp"
#include "integration/ground_station.hpp"
#include "orbital_map/raw_map.hpp"

using namespace cairn;
using namespace cairn::test;
using app::CommandStatus;
using app::CommandType;

namespace {

constexpr unsigned kColumns = 30;
constexpr unsigned kTiles = kColumns * 10;
constexpr std::uint16_t kChunk = 16;

std::uint8_t payloads[2][kTiles][6];
RawBytes old_map;
RawBytes new_map;
RawBytes changes;
GroundStation down;
std::uint32_t sequence = 0;

RawTile one_boulder(int version, unsigned t) {
  std::uint8_t* p = payloads[version][t];
  const unsigned gap = 100U * t + 7U + 40U * static_cast<unsigned>(version);
  p[1] = 1;
  p[3] = static_cast<std::uint8_t>(gap << 5U >> 16U);
  p[4] = static_cast<std::uint8_t>(gap << 5U >> 8U);
  p[5] = static_cast<std::uint8_t>(gap << 5U);
  return {p, 6};
}

int make_maps(void**) {
  RawTile old_tiles[kTiles];
  RawTile tiles[kTiles];
  bool sent[kTiles] = {};
  for (unsigned t = 0; t < kTiles; ++t) {
    sent[t] = t % 50 == 2;
    old_tiles[t] = one_boulder(0, t);
    tiles[t] = one_boulder(sent[t] ? 1 : 0, t);
  }
  old_tiles[0] = {};
  sent[0] = true;
  raw_map(old_map, kColumns, kTiles / kColumns, 2, old_tiles, kTiles - 1);
  raw_map(new_map, kColumns, kTiles / kColumns, 2, tiles, kTiles);
  raw_delta(changes, old_map, 0, 0, new_map.bytes, kRawHead, sent, tiles, kTiles);
  return 0;
}

std::vector<std::uint8_t> bytes_of(const RawBytes& raw) { return {raw.bytes, raw.bytes + raw.size}; }
std::uint32_t id_of(const RawBytes& upload) { return crc32(upload.bytes, upload.size); }
unsigned chunks_of(const RawBytes& upload) {
  return static_cast<unsigned>(upload.size + kChunk - 1) / kChunk;
}

/// A module with the old map in use.
void begin() {
  down.begin({}, app::mission_rig());
  host::load_map_bank(bytes_of(old_map));
  send(app::Command());
  down.run();
  assert_status(down.healths.back().map_status, MapStatus::kUsable);
}

app::AckReport answer(const app::Command& unnumbered) {
  const app::Command command = numbered(unnumbered);
  const std::size_t acks = down.acks.size();
  send(command);
  down.run();
  assert_int_equal(down.acks.size(), acks + 1);
  assert_int_equal(down.acks.back().command_sequence, command.sequence);
  return down.acks.back();
}
void check_answer(const app::Command& command, CommandStatus status, int detail) {
  const app::AckReport ack = answer(command);
  assert_status(ack.status, status);
  assert_int_equal(ack.detail, detail);
}

app::Command begin_command(const RawBytes& upload, UploadKind kind) {
  app::Command c;
  c.type = CommandType::kBeginUpload;
  c.sequence = ++sequence;
  c.upload = {static_cast<std::uint8_t>(kind), id_of(upload), static_cast<std::uint32_t>(upload.size),
              kChunk};
  return c;
}
app::Command chunk_command(const RawBytes& upload, unsigned number) {
  static RawBytes chunk;
  chunk.size = 0;
  chunk.u32(id_of(upload));
  chunk.u16(number);
  const std::size_t at = std::size_t{number} * kChunk;
  chunk.append(upload.bytes + at, upload.size - at < kChunk ? upload.size - at : kChunk);
  chunk.u32(crc32(chunk.bytes, chunk.size));
  app::Command c;
  c.type = CommandType::kMapChunk;
  c.sequence = ++sequence;
  c.chunk = chunk.bytes;
  c.chunk_bytes = chunk.size;
  return c;
}
app::Command use_command(std::uint32_t id) {
  app::Command c;
  c.type = CommandType::kUseUpload;
  c.sequence = ++sequence;
  c.upload.id = id;
  return c;
}
app::Command report_command() {
  app::Command c;
  c.type = CommandType::kReportUpload;
  c.sequence = ++sequence;
  return c;
}
const app::UploadReport& report() {
  check_answer(report_command(), CommandStatus::kAccepted, 0);
  return down.uploads.back();
}

void give_all(const RawBytes& upload) {
  for (unsigned n = 0; n < chunks_of(upload); ++n)
    check_answer(chunk_command(upload, n), CommandStatus::kAccepted, static_cast<int>(ChunkStatus::kTaken));
}

/// What is in use: the bank, and how many boulders the module's map has.
void check_in_use(const RawBytes& map, std::uint32_t boulders) {
  const hal::Bytes bank = hal::map_bank();
  assert_true(bank.size >= map.size);
  assert_memory_equal(bank.data, map.bytes, map.size);
  assert_int_equal(app::root.localizer().map().count(), boulders);
}

void test_a_map_over_a_link_with_losses(void**) {
  begin();
  check_answer(begin_command(new_map, UploadKind::kMap), CommandStatus::kAccepted, 0);
  assert_status(down.uploads.back().status, TransferStatus::kReceiving);
  Random random(7);
  const unsigned chunks = chunks_of(new_map);
  std::vector<unsigned> to_send(chunks);
  for (unsigned n = 0; n < chunks; ++n) to_send[n] = n;
  int rounds = 0;
  while (!to_send.empty()) {  // the ground sends again what the report says is missing
    assert_true(++rounds < 20);
    for (const unsigned n : to_send) {
      if (random.below(3) != 0) static_cast<void>(answer(chunk_command(new_map, n)));
    }
    const app::UploadReport r = report();
    assert_int_equal(r.chunks, chunks);
    assert_int_equal(r.bytes, new_map.size);
    assert_int_equal(r.id, id_of(new_map));
    assert_int_equal(r.kind, 1);
    assert_int_equal(r.chunk_bytes, kChunk);
    to_send.clear();
    for (unsigned n = 0; n < 8 * sizeof r.missing; ++n) {
      if ((r.missing[n / 8] >> (7 - n % 8) & 1) != 0) to_send.push_back(r.first_missing + n);
    }
    assert_int_equal(to_send.size(), chunks - r.taken);
    assert_int_equal(to_send.empty() ? chunks : to_send.front(), r.first_missing);
    assert_int_equal(r.counts[0], r.taken);
  }
  assert_status(down.uploads.back().status, TransferStatus::kReady);
  assert_status(down.uploads.back().detail, MapStatus::kUsable);
  check_in_use(old_map, kTiles - 1);
  const std::size_t healths = down.healths.size();
  check_answer(use_command(id_of(new_map)), CommandStatus::kAccepted,
               static_cast<int>(TransferStatus::kInUse));
  assert_status(down.uploads.back().status, TransferStatus::kInUse);
  assert_int_equal(down.healths.size(), healths + 1);
  assert_status(down.healths.back().map_status, MapStatus::kUsable);
  check_in_use(new_map, kTiles);
  assert_memory_equal(hal::spare_map_bank().data, old_map.bytes, old_map.size);  // the way back
  // The bank may be validated again at any time.
  check_answer(app::Command(), CommandStatus::kAccepted, static_cast<int>(MapStatus::kChecking));
  assert_status(down.healths.back().map_status, MapStatus::kUsable);
  check_in_use(new_map, kTiles);
}

void test_a_delta_to_the_map_in_use(void**) {
  begin();
  assert_at_most(changes.size, new_map.size / 3);
  check_answer(begin_command(changes, UploadKind::kDelta), CommandStatus::kAccepted, 0);
  give_all(changes);
  assert_status(report().status, TransferStatus::kReady);
  check_in_use(old_map, kTiles - 1);
  check_answer(use_command(id_of(changes)), CommandStatus::kAccepted,
               static_cast<int>(TransferStatus::kInUse));
  check_in_use(new_map, kTiles);
  // Once more: its base is not in use any longer.
  host::give_spare_bank(host::kSpareBankBytes);
  check_answer(begin_command(changes, UploadKind::kDelta), CommandStatus::kAccepted, 0);
  give_all(changes);
  assert_status(report().status, TransferStatus::kBadDelta);
  assert_status(report().detail, DeltaStatus::kOtherBase);
  check_answer(use_command(id_of(changes)), CommandStatus::kRefused,
               static_cast<int>(TransferStatus::kBadDelta));
  check_in_use(new_map, kTiles);
}

void test_each_report(void**) {
  begin();
  const auto last = [](TransferStatus status) { assert_status(down.uploads.back().status, status); };
  check_answer(begin_command(new_map, UploadKind::kMap), CommandStatus::kAccepted, 0);
  assert_int_equal(down.uploads.size(), 1);
  last(TransferStatus::kReceiving);
  assert_int_equal(down.uploads.back().first_missing, 0);
  const unsigned chunks = chunks_of(new_map);
  for (unsigned n = 0; n < chunks; ++n) {
    assert_int_equal(down.uploads.size(), 1);
    static_cast<void>(answer(chunk_command(new_map, n)));
  }
  assert_int_equal(down.uploads.size(), 3);  // it is verified from here on, and it is ready
  assert_status(down.uploads[1].status, TransferStatus::kVerifying);
  assert_int_equal(down.uploads[1].first_missing, chunks);
  last(TransferStatus::kReady);
  for (const std::uint8_t missing : down.uploads.back().missing) assert_int_equal(missing, 0);
}

void test_faults_leave_the_map_in_use(void**) {
  begin();
  const auto refused = [](const app::Command& command, int detail) {
    check_answer(command, CommandStatus::kRefused, detail);
    check_in_use(old_map, kTiles - 1);
  };
  refused(use_command(0), static_cast<int>(TransferStatus::kIdle));
  refused(chunk_command(new_map, 0), static_cast<int>(ChunkStatus::kNoUpload));
  app::Command bad = begin_command(new_map, UploadKind::kMap);
  bad.upload.kind = 9;
  refused(bad, static_cast<int>(BeginStatus::kBadKind));
  host::give_spare_bank(new_map.size - 1);
  refused(begin_command(new_map, UploadKind::kMap), static_cast<int>(BeginStatus::kNoRoom));
  host::give_spare_bank(0);
  refused(begin_command(new_map, UploadKind::kMap), static_cast<int>(BeginStatus::kNoRoom));
  host::give_spare_bank(new_map.size);
  check_answer(begin_command(new_map, UploadKind::kMap), CommandStatus::kAccepted, 0);
  check_answer(begin_command(new_map, UploadKind::kMap), CommandStatus::kAccepted,
               static_cast<int>(BeginStatus::kUnderWay));
  refused(chunk_command(changes, 0), static_cast<int>(ChunkStatus::kOtherUpload));
  refused(use_command(id_of(new_map)), static_cast<int>(TransferStatus::kReceiving));
  give_all(new_map);
  check_answer(chunk_command(new_map, 5), CommandStatus::kAccepted, static_cast<int>(ChunkStatus::kRepeated));
  refused(use_command(id_of(changes)), static_cast<int>(TransferStatus::kReady));  // of another upload
  host::let_banks_switch(false);
  refused(use_command(id_of(new_map)), static_cast<int>(TransferStatus::kReady));
  host::let_banks_switch(true);
  const app::Command use = use_command(id_of(new_map));
  check_answer(use, CommandStatus::kAccepted, static_cast<int>(TransferStatus::kInUse));
  check_in_use(new_map, kTiles);
  // Too late, and counted.
  check_answer(use_command(id_of(new_map)), CommandStatus::kRefused,
               static_cast<int>(TransferStatus::kInUse));
  check_answer(chunk_command(new_map, 5), CommandStatus::kRefused, static_cast<int>(ChunkStatus::kNoUpload));
  // Once more, and overtaken: the banks are not switched back.
  check_answer(use, CommandStatus::kRepeated, static_cast<int>(TransferStatus::kInUse));
  app::Command late = use;
  late.sequence -= 1;
  check_answer(late, CommandStatus::kStale, 0);
  check_in_use(new_map, kTiles);
  host::load_map_bank({});
  send(app::Command());
  down.run();
  assert_int_equal(down.healths.back().commands[static_cast<int>(CommandStatus::kRefused)], 12);
}

/// What was damaged on its way is refused as a packet, or as a chunk; in the spare bank, by the CRC.
void test_damage(void**) {
  begin();
  check_answer(begin_command(new_map, UploadKind::kMap), CommandStatus::kAccepted, 0);
  std::vector<std::uint8_t> packet = packet_of(chunk_command(new_map, 0));
  packet[20] ^= 1U;
  host::feed_telecommand(packet);
  down.run();
  assert_status(down.acks.back().status, CommandStatus::kBadPacket);
  be::put_u32(packet.data() + packet.size() - 4, crc32(packet.data(), packet.size() - 4));
  host::feed_telecommand(packet);
  down.run();
  assert_status(down.acks.back().status, CommandStatus::kRefused);
  assert_status(down.acks.back().detail, ChunkStatus::kBadCrc);
  assert_int_equal(report().taken, 0);
  for (unsigned n = 1; n < chunks_of(new_map); ++n) static_cast<void>(answer(chunk_command(new_map, n)));
  hal::spare_map_bank().data[5 * kChunk] ^= 1U;
  check_answer(chunk_command(new_map, 0), CommandStatus::kAccepted, static_cast<int>(ChunkStatus::kTaken));
  assert_status(report().status, TransferStatus::kUploadCrc);
  check_in_use(old_map, kTiles - 1);
}

/// Farther chunks are told of when nearer ones have come.
void test_the_window_of_missing_chunks(void**) {
  begin();
  static RawBytes much;
  much.size = 2100 * kChunk;
  check_answer(begin_command(much, UploadKind::kMap), CommandStatus::kAccepted, 0);
  const auto bits = [](const app::UploadReport& r) {
    unsigned set = 0;
    for (const std::uint8_t byte : r.missing) {
      for (unsigned i = 0; i < 8; ++i) set += byte >> i & 1U;
    }
    return set;
  };
  assert_int_equal(bits(report()), 2048);
  for (unsigned n = 0; n < 60; ++n) static_cast<void>(answer(chunk_command(much, n)));
  assert_int_equal(report().first_missing, 60);
  assert_int_equal(bits(report()), 2040);
  assert_int_equal(report().missing[254], 0xFF);
  assert_int_equal(report().missing[255], 0);
}

/// However the module is sliced, the same packets come down.
void test_slicing_does_not_matter(void**) {
  for (const std::uint32_t slice : {cfg::kSliceOps, std::uint32_t{1}, std::uint32_t{1000}}) {
    begin();
    send(begin_command(changes, UploadKind::kDelta));
    for (unsigned n = 0; n < chunks_of(changes); ++n) send(chunk_command(changes, n));
    down.run(slice);
    assert_status(down.uploads.back().status, TransferStatus::kReady);
    assert_int_equal(down.uploads.size(), 3);
    check_answer(use_command(id_of(changes)), CommandStatus::kAccepted,
                 static_cast<int>(TransferStatus::kInUse));
    check_in_use(new_map, kTiles);
  }
}

/// The check of a bank ends where the bank is no longer in use: its verdict would bring the old map back.
void test_banks_switched_while_one_is_checked(void**) {
  begin();
  check_answer(begin_command(new_map, UploadKind::kMap), CommandStatus::kAccepted, 0);
  give_all(new_map);
  const std::size_t healths = down.healths.size();
  send(app::Command());
  send(use_command(id_of(new_map)));
  down.run();
  check_in_use(new_map, kTiles);
  assert_int_equal(down.healths.size(), healths + 1);
  assert_int_equal(down.healths.back().map_crc, app::root.localizer().map().head_crc());
}

/// A start of the module forgets the upload.
void test_init(void**) {
  begin();
  check_answer(begin_command(new_map, UploadKind::kMap), CommandStatus::kAccepted, 0);
  begin();
  assert_status(report().status, TransferStatus::kIdle);
  assert_int_equal(report().chunks, 0);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_a_map_over_a_link_with_losses),
      cmocka_unit_test(test_a_delta_to_the_map_in_use),
      cmocka_unit_test(test_each_report),
      cmocka_unit_test(test_faults_leave_the_map_in_use),
      cmocka_unit_test(test_damage),
      cmocka_unit_test(test_the_window_of_missing_chunks),
      cmocka_unit_test(test_slicing_does_not_matter),
      cmocka_unit_test(test_banks_switched_while_one_is_checked),
      cmocka_unit_test(test_init),
  };
  return cmocka_run_group_tests(tests, make_maps, nullptr);
}
