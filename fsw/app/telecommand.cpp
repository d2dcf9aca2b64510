#include "app/telecommand.hpp"

#include "app/wire.hpp"

namespace cairn::app {
namespace {

template <typename Walker, typename C>
bool walk(Walker& w, C& c) {
  switch (c.type) {
    case CommandType::kSetStart:
      w.field(c.pose);
      w.field(c.number);
      return true;
    case CommandType::kSetTrim: w.field(c.number); return true;
    case CommandType::kMotionPrior: w.field(c.pose); return true;
    case CommandType::kLoadMap: return true;
  }
  return false;
}

}  // namespace

void encode(const Command& command, Packet& out) {
  Writer<Packet> w(out, static_cast<std::uint8_t>(command.type), command.sequence);
  const bool known = walk(w, command);
  CAIRN_ASSERT(known);
  w.finish();
}

CommandStatus decode(const std::uint8_t* bytes, std::size_t size, Command& out) {
  PacketType type{};
  if (check_packet(bytes, size, type, out.sequence) != PacketStatus::kGood) return CommandStatus::kBadPacket;
  out.type = static_cast<CommandType>(type);
  Sizer sizer;
  if (!walk(sizer, out)) return CommandStatus::kUnknownType;
  if (sizer.packet_bytes() != size) return CommandStatus::kBadPacket;
  Reader reader(bytes);
  return walk(reader, out) ? CommandStatus::kAccepted : CommandStatus::kUnknownType;
}

}  // namespace cairn::app
