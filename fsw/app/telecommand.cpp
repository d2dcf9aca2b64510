#include "app/telecommand.hpp"

namespace cairn::app {
namespace {

constexpr std::size_t kLeastChunkBytes = chunk::kOverheadBytes + 1;

template <typename Walker, typename C>
bool walk(Walker& w, C& c) {
  switch (c.type) {
    case CommandType::kSetStart:
      w.field(c.pose);
      w.field(c.number);
      return true;
    case CommandType::kSetTrim: w.field(c.number); return true;
    case CommandType::kMotionPrior:
      w.field(c.pair);
      w.field(c.pose);
      return true;
    case CommandType::kLoadMap:
    case CommandType::kReportUpload: return true;
    case CommandType::kBeginUpload:
      w.field(c.upload.kind);
      w.field(c.upload.id);
      w.field(c.upload.bytes);
      w.field(c.upload.chunk_bytes);
      return true;
    case CommandType::kUseUpload: w.field(c.upload.id); return true;
    case CommandType::kAttitude:
      w.field(c.pair);
      w.field(c.attitude.up_rover);
      w.field(c.attitude.sigma_tilt_rad);
      w.field(c.attitude.yaw_rad);
      w.field(c.attitude.sigma_yaw_rad);
      return true;
    case CommandType::kMapChunk: break;  // of no fixed size
  }
  return false;
}

}  // namespace

void encode(const Command& command, Packet& out) {
  PacketWriter w(out, {static_cast<std::uint8_t>(command.type), command.sequence});
  if (command.type == CommandType::kMapChunk) {
    CAIRN_ASSERT(command.chunk_bytes >= kLeastChunkBytes);
    for (std::size_t i = 0; i < command.chunk_bytes; ++i) w.field(command.chunk[i]);
  } else {
    const bool known = walk(w, command);
    CAIRN_ASSERT(known);
  }
  w.finish();
}

CommandStatus decode(const std::uint8_t* bytes, std::size_t size, Command& out) {
  PacketHead head;
  if (check_packet(bytes, size, head) != PacketStatus::kGood) return CommandStatus::kBadPacket;
  out.type = static_cast<CommandType>(head.type);
  out.sequence = head.sequence;
  out.crc = be::get_u32(bytes + size - kPacketCrcBytes);
  if (out.type == CommandType::kMapChunk) {
    if (size < kPacketHeaderBytes + kLeastChunkBytes + kPacketCrcBytes) return CommandStatus::kBadPacket;
    out.chunk = bytes + kPacketHeaderBytes;
    out.chunk_bytes = size - kPacketHeaderBytes - kPacketCrcBytes;
    return CommandStatus::kAccepted;
  }
  PacketSizer sizer;
  if (!walk(sizer, out)) return CommandStatus::kUnknownType;
  if (sizer.packet_bytes() != size) return CommandStatus::kBadPacket;
  PacketReader reader(bytes);
  return walk(reader, out) ? CommandStatus::kAccepted : CommandStatus::kUnknownType;
}

}  // namespace cairn::app
