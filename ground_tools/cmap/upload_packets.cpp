#include "cmap/upload_packets.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <numeric>

#include "base/number_table.hpp"
#include "base/tool_error.hpp"
#include "core/big_endian.hpp"
#include "core/crc32.hpp"
#include "mission_cfg.hpp"

namespace cairn::ground {
namespace {

constexpr std::size_t kBeginBytes = 23;
constexpr std::size_t kUseBytes = 16;
constexpr std::size_t kPacketBytes = 12;  // of a packet beside its body

app::Command command_of(app::CommandType type, const Upload& upload, std::uint32_t sequence) {
  app::Command command;
  command.type = type;
  command.sequence = sequence;
  command.upload = upload.plan;
  return command;
}

}  // namespace

PacketBytes packet_of(const app::Command& command) {
  app::Packet packet;
  app::encode(command, packet);
  return {packet.begin(), packet.end()};
}

Upload make_upload(UploadKind kind, std::vector<std::uint8_t> bytes, std::vector<TilePiece> pieces,
                   std::size_t chunk_bytes) {
  check_range<std::size_t>("--chunk", chunk_bytes, chunk::kMinDataBytes, app::kMaxChunkDataBytes);
  Upload upload;
  upload.plan.kind = static_cast<std::uint8_t>(kind);
  upload.plan.id = crc32(bytes.data(), bytes.size());
  upload.plan.bytes = static_cast<std::uint32_t>(bytes.size());
  upload.plan.chunk_bytes = static_cast<std::uint16_t>(chunk_bytes);
  upload.bytes = std::move(bytes);
  upload.pieces = std::move(pieces);
  if (chunks_of(upload.plan) > cfg::kMaxMapChunks) {
    throw ToolError(
        "the upload would be {} bytes in {} chunks, more than the flight module takes ({}); give larger "
        "chunks by --chunk, a narrower corridor or a --budget",
        upload.bytes.size(), chunks_of(upload.plan), cfg::kMaxMapChunks);
  }
  return upload;
}

std::size_t link_bytes(const UploadPlan& plan) {
  return plan.bytes + chunks_of(plan) * (chunk::kOverheadBytes + kPacketBytes) + kBeginBytes + kUseBytes;
}

std::vector<std::uint32_t> send_order(const Upload& upload, const std::vector<std::size_t>& rank_of_tile) {
  const std::size_t chunk = upload.plan.chunk_bytes;
  // Whatever is no payload is needed before any of them.
  std::vector<std::size_t> rank(chunks_of(upload.plan), std::numeric_limits<std::size_t>::max());
  std::size_t head_end = upload.bytes.size();
  for (const TilePiece& piece : upload.pieces) {
    if (piece.bytes == 0) continue;
    head_end = std::min(head_end, piece.offset);
    for (std::size_t n = piece.offset / chunk; n <= (piece.offset + piece.bytes - 1) / chunk; ++n)
      rank[n] = std::min(rank[n], rank_of_tile.at(piece.tile) + 1);
  }
  for (std::size_t n = 0; n < rank.size() && n * chunk < head_end; ++n) rank[n] = 0;
  std::vector<std::uint32_t> order(rank.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return rank[a] < rank[b]; });
  return order;
}

std::vector<std::uint32_t> choose_chunks(const std::vector<std::uint32_t>& order, const std::string& list) {
  if (list.empty()) return order;
  std::vector<bool> chosen(order.size());
  for (const std::string_view range : split(list, ',')) {
    const std::vector<std::string_view> ends = split(range, '-');
    const std::optional<std::size_t> from = to_number<std::size_t>(ends.front());
    const std::optional<std::size_t> to = to_number<std::size_t>(ends.back());
    if (ends.size() > 2 || !from || !to || *from > *to || *to >= order.size()) {
      throw ToolError("--only: '{}' does not name chunks of 0 to {}; give numbers as in 3,7-9", range,
                      order.size() - 1);
    }
    for (std::size_t n = *from; n <= *to; ++n) chosen[n] = true;
  }
  std::vector<std::uint32_t> kept;
  std::copy_if(order.begin(), order.end(), std::back_inserter(kept),
               [&](std::uint32_t n) { return chosen[n]; });
  return kept;
}

PacketBytes begin_packet(const Upload& upload, std::uint32_t sequence) {
  return packet_of(command_of(app::CommandType::kBeginUpload, upload, sequence));
}

PacketBytes chunk_packet(const Upload& upload, std::uint32_t number, std::uint32_t sequence) {
  const std::size_t at = std::size_t{number} * upload.plan.chunk_bytes;
  const std::size_t data = std::min<std::size_t>(upload.plan.chunk_bytes, upload.bytes.size() - at);
  std::vector<std::uint8_t> bytes(data + chunk::kOverheadBytes);
  be::put_u32(bytes.data() + chunk::kIdAt, upload.plan.id);
  be::put_u16(bytes.data() + chunk::kNumberAt, static_cast<std::uint16_t>(number));
  std::copy_n(upload.bytes.begin() + static_cast<std::ptrdiff_t>(at), data, bytes.begin() + chunk::kDataAt);
  be::put_u32(bytes.data() + chunk::kDataAt + data, crc32(bytes.data(), chunk::kDataAt + data));
  app::Command command = command_of(app::CommandType::kMapChunk, upload, sequence);
  command.chunk = bytes.data();
  command.chunk_bytes = bytes.size();
  return packet_of(command);
}

PacketBytes use_packet(const Upload& upload, std::uint32_t sequence) {
  return packet_of(command_of(app::CommandType::kUseUpload, upload, sequence));
}

}  // namespace cairn::ground
