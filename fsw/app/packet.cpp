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

std::uint8_t* PacketWriter::grow(std::size_t bytes) {
  const std::size_t at = out_.size();
  out_.resize(at + bytes);
  return out_.data() + at;
}

void PacketWriter::field(std::uint8_t v) { *grow(1) = v; }
void PacketWriter::field(std::uint16_t v) { be::put_u16(grow(2), v); }
void PacketWriter::field(std::uint32_t v) { be::put_u32(grow(4), v); }
void PacketWriter::field(std::uint64_t v) { be::put_u64(grow(8), v); }
void PacketWriter::field(float v) { be::put_f32(grow(4), v); }
void PacketWriter::field(double v) { be::put_f64(grow(8), v); }

const std::uint8_t* PacketReader::take(std::size_t bytes) {
  const std::uint8_t* const field = next_;
  next_ += bytes;
  return field;
}

void PacketReader::field(std::uint8_t& v) { v = *take(1); }
void PacketReader::field(std::uint16_t& v) { v = be::get_u16(take(2)); }
void PacketReader::field(std::uint32_t& v) { v = be::get_u32(take(4)); }
void PacketReader::field(std::uint64_t& v) { v = be::get_u64(take(8)); }
void PacketReader::field(float& v) { v = be::get_f32(take(4)); }
void PacketReader::field(double& v) { v = be::get_f64(take(8)); }

}  // namespace cairn::app
