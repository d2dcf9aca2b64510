// Uploads: any sequence of telecommands, chunks, resets and slices against a model of what
// the bank must hold.
//
// Input: options, size of the base, the base, size of the upload, the upload, then operations to the end.
// The base is kept as it is; the upload is named by its true CRC unless the options say otherwise.
#include <vector>

#include "app/telecommand.hpp"
#include "fuzz/fuzz_support.hpp"
#include "orbital_map/map_transfer.hpp"

using namespace cairn;
using namespace cairn::fuzz;

namespace {

struct Session {
  Session(Input& in, std::uint8_t options)
      : base(in, in.u16()), upload(in, in.u16()), bank(64U * in.u8()), chunk_bytes(in.u8()) {
    if ((options & 1U) == 0) repair_map(base.data(), base.size());
    if ((options & 2U) == 0) repair_upload();
    plan.kind = static_cast<std::uint8_t>((options & 4U) != 0 ? UploadKind::kDelta : UploadKind::kMap);
    plan.id = crc32(upload.data(), upload.size()) ^ ((options & 8U) != 0 ? 1U : 0U);
    plan.bytes = static_cast<std::uint32_t>(upload.size());
    plan.chunk_bytes = chunk_bytes;
  }

  void repair_upload() {
    MapShape shape;
    const bool is_delta = upload.size() >= delta::kHeadAt && upload.data()[1] == 'D';
    if (!is_delta) {
      repair_map(upload.data(), upload.size());
    } else if (shape.read(base.data(), base.size())) {
      be::put_u32(upload.data() + delta::kBaseBytesAt, shape.file_bytes);
      std::memcpy(upload.data() + delta::kBaseHeadCrcAt, base.data() + shape.head_bytes - cmap::kCrcBytes,
                  cmap::kCrcBytes);
    }
  }

  Block base;
  Block upload;
  Block bank;
  std::uint16_t chunk_bytes;
  UploadPlan plan;
  MapTransfer transfer;
};

void check(const Session& s, const std::vector<std::uint8_t>& before, bool may_write) {
  const TransferRecord& r = s.transfer.record();
  std::uint32_t taken = 0;
  for (std::uint32_t n = 0; n < r.chunks; ++n) taken += s.transfer.has(n) ? 1U : 0U;
  CAIRN_ASSERT(taken == r.taken);
  CAIRN_ASSERT(r.status != TransferStatus::kReady || (taken == r.chunks && s.transfer.result().usable()));
  CAIRN_ASSERT(s.transfer.result().usable() == (r.status == TransferStatus::kReady));
  if (!may_write && !before.empty())
    CAIRN_ASSERT(std::memcmp(before.data(), s.bank.data(), before.size()) == 0);
}

/// A chunk of the upload; `fault` spoils it, before or after its CRC is made.
void give_chunk(Session& s, std::uint16_t number, std::uint8_t fault) {
  const std::size_t at = std::min(std::size_t{number} * s.chunk_bytes, s.upload.size());
  const std::size_t data = std::min<std::size_t>(s.chunk_bytes, s.upload.size() - at);
  Block chunk(data + chunk::kOverheadBytes);
  be::put_u32(chunk.data() + chunk::kIdAt, s.plan.id);
  be::put_u16(chunk.data() + chunk::kNumberAt, number);
  if (data > 0) std::memcpy(chunk.data() + chunk::kDataAt, s.upload.data() + at, data);
  if ((fault & 3U) == 1) chunk.data()[fault % chunk.size()] ^= 1U;
  be::put_u32(chunk.data() + chunk::kDataAt + data, crc32(chunk.data(), chunk::kDataAt + data));
  if ((fault & 3U) == 2) chunk.data()[fault % chunk.size()] ^= 1U;
  const std::uint32_t taken = s.transfer.record().taken;
  const ChunkStatus status = s.transfer.accept(chunk.data(), chunk.size());
  CAIRN_ASSERT((status == ChunkStatus::kTaken) == (s.transfer.record().taken == taken + 1));
  CAIRN_ASSERT((fault & 3U) != 2 || status != ChunkStatus::kTaken);
}

/// Bytes of the input as a packet, its CRC made to hold.
void give_packet(Session& s, Input& in) {
  Block packet(in, in.u8());
  if (packet.size() >= 12) {
    packet.data()[1] = 1;
    be::put_u16(packet.data() + 2, static_cast<std::uint16_t>(packet.size()));
    be::put_u32(packet.data() + packet.size() - 4, crc32(packet.data(), packet.size() - 4));
  }
  app::Command command;
  if (app::decode(packet.data(), packet.size(), command) != app::CommandStatus::kAccepted) return;
  if (command.type == app::CommandType::kBeginUpload)
    static_cast<void>(s.transfer.begin(command.upload, s.bank.data(), s.bank.size()));
  if (command.type == app::CommandType::kMapChunk)
    static_cast<void>(s.transfer.accept(command.chunk, command.chunk_bytes));
}

/// A reset: the record comes back as it was, or damaged.
void reset(Session& s, std::uint16_t at, std::uint8_t damage) {
  TransferRecord record = s.transfer.record();
  std::uint8_t bytes[sizeof record.plan + sizeof record.have];
  std::memcpy(bytes, &record.plan, sizeof record.plan);
  std::memcpy(bytes + sizeof record.plan, record.have, sizeof record.have);
  bytes[at % sizeof bytes] ^= damage;
  std::memcpy(&record.plan, bytes, sizeof record.plan);
  std::memcpy(record.have, bytes + sizeof record.plan, sizeof record.have);
  s.transfer = MapTransfer();
  static_cast<void>(s.transfer.resume(record, s.bank.data(), s.bank.size()));
}

void operate(Session& s, Input& in) {
  const std::vector<std::uint8_t> before(s.bank.data(), s.bank.data() + s.bank.size());
  const std::uint8_t operation = in.u8();
  bool may_write = false;
  switch (operation % 8) {
    case 0: static_cast<void>(s.transfer.begin(s.plan, s.bank.data(), s.bank.size())); break;
    case 1: {
      may_write = true;
      const std::uint16_t number = in.u16();
      give_chunk(s, number, in.u8());
      break;
    }
    case 2: {  // many at once
      may_write = true;
      const std::uint16_t last = std::min<std::uint16_t>(in.u16(), 47);
      for (std::uint16_t n = 0; n <= last; ++n) give_chunk(s, n, 0);
      break;
    }
    case 3: static_cast<void>(s.transfer.verify(s.base.data(), s.base.size())); break;
    case 4: {
      may_write = true;
      WorkBudget budget(1U + in.u8());
      static_cast<void>(s.transfer.step(budget));
      break;
    }
    case 5:
      may_write = true;
      run(s.transfer, UINT32_MAX);
      break;
    case 6:
      may_write = true;
      give_packet(s, in);
      break;
    default: {
      const std::uint16_t at = in.u16();
      const std::uint8_t damage = in.u8();
      if (damage == 0xFF) {
        s.transfer.leave();
      } else {
        reset(s, at, damage);
      }
      break;
    }
  }
  check(s, before, may_write);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Input in(data, size);
  const std::uint8_t options = in.u8();
  Session session(in, options);
  const Block base_before(session.base.data(), session.base.size());
  for (int n = 0; n < 24 && in.left() > 0; ++n) operate(session, in);
  CAIRN_ASSERT(base_before.size() == 0 ||
               std::memcmp(session.base.data(), base_before.data(), base_before.size()) == 0);
  if (session.transfer.status() == TransferStatus::kReady) {
    // The bytes in the bank are a good map, by another reader of them.
    const Block bank(session.bank.data(), session.bank.size());
    OrbitalMap map;
    CAIRN_ASSERT(validate(bank, UINT32_MAX, map) == MapStatus::kUsable);
    CAIRN_ASSERT(map.count() == session.transfer.result().count());
  }
  return 0;
}
