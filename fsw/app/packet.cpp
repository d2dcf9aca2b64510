#include "app/packet.hpp"

#include "core/crc32.hpp"

namespace cairn::app {
namespace {

constexpr std::size_t kSizeAt = 2;
constexpr std::size_t kSequenceAt = 4;

}  // namespace

PacketStatus check_packet(const std::uint8_t* bytes, std::size_t size, PacketHead& head) {
  if (bytes == nullptr || size < kPacketHeaderBytes + kPacketCrcBytes) return PacketStatus::kTooShort;
  if (be::get_u16(bytes + kSizeAt) != size) return PacketStatus::kBadSize;
  const std::size_t crc_at = size - kPacketCrcBytes;
  if (crc32(bytes, crc_at) != be::get_u32(bytes + crc_at)) return PacketStatus::kBadCrc;
  if (bytes[1] != kPacketVersion) return PacketStatus::kBadVersion;
  head = {bytes[0], be::get_u32(bytes + kSequenceAt)};
  return PacketStatus::kGood;
}

PacketWriter::PacketWriter(Packet& out, const PacketHead& head) : out_(out) {
  out_.clear();
  field(head.type);
  field(kPacketVersion);
  field(std::uint16_t{0});  // size, known at the end
  field(head.sequence);
}

void PacketWriter::finish() {
  be::put_u16(&out_[kSizeAt], static_cast<std::uint16_t>(out_.size() + kPacketCrcBytes));
  field(crc32(out_.data(), out_.size()));
}

}  // namespace cairn::app
