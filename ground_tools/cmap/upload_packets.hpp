/// An upload as ready telecommand packets (fsw/app/telecommand.hpp): begin, numbered chunks, use.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/telecommand.hpp"
#include "cmap/delta_encoder.hpp"
#include "orbital_map/map_transfer.hpp"

namespace cairn::ground {

struct Upload {
  UploadPlan plan;
  std::vector<std::uint8_t> bytes;
  std::vector<TilePiece> pieces;  ///< which of the bytes are payloads; the others are needed first
};

/// Throws ToolError: chunk size out of its range (16 to 490 bytes), too many chunks for the flight module.
Upload make_upload(UploadKind kind, std::vector<std::uint8_t> bytes, std::vector<TilePiece> pieces,
                   std::size_t chunk_bytes);

/// Bytes that the upload takes on the link: all packets, begin and use among them.
std::size_t link_bytes(const UploadPlan& plan);

/// Chunks in the order in which they are best sent: those with the head first, then by the best rank of the
/// tiles in them (`rank_of_tile`, 0 is best), then by number.
std::vector<std::uint32_t> send_order(const Upload& upload, const std::vector<std::size_t>& rank_of_tile);

/// Those of `order` that `list` names, as "3,7-9"; all where it is empty. Throws ToolError: not such a list,
/// or a chunk that there is not.
std::vector<std::uint32_t> choose_chunks(const std::vector<std::uint32_t>& order, const std::string& list);

using PacketBytes = std::vector<std::uint8_t>;
PacketBytes packet_of(const app::Command& command);
PacketBytes begin_packet(const Upload& upload, std::uint32_t sequence);
PacketBytes chunk_packet(const Upload& upload, std::uint32_t number, std::uint32_t sequence);
PacketBytes use_packet(const Upload& upload, std::uint32_t sequence);

}  // namespace cairn::ground
