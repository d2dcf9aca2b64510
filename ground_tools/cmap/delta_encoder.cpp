#include "cmap/delta_encoder.hpp"

#include <algorithm>
#include <cmath>

#include "core/assert.hpp"
#include "core/big_endian.hpp"
#include "orbital_map/map_delta.hpp"

namespace cairn::ground {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr double kOnGrid = 1e-3;  // cells

MapShape shape_of(const Bytes& map) {
  MapShape shape;
  const bool whole = shape.read(map.data(), map.size());
  CAIRN_ASSERT(whole && shape.file_bytes == map.size());
  return shape;
}

void put_u16(Bytes& out, unsigned value) {
  out.push_back(static_cast<std::uint8_t>(value >> 8U));
  out.push_back(static_cast<std::uint8_t>(value));
}
void put_u32(Bytes& out, std::uint32_t value) {
  put_u16(out, value >> 16U);
  put_u16(out, value & 0xFFFFU);
}

/// Whether the payloads are the same but for their CRCs, which hold the tile's number.
bool same_content(const Bytes& a, const TilePiece& in_a, const Bytes& b, const TilePiece& in_b) {
  if (in_a.bytes != in_b.bytes) return false;
  const std::size_t coded = in_a.bytes - std::min<std::size_t>(in_a.bytes, cmap::kCrcBytes);
  return std::equal(a.data() + in_a.offset, a.data() + in_a.offset + coded, b.data() + in_b.offset);
}

/// Whole tiles between two origins; false where they are none, or too many for the delta's fields.
bool tiles_between(double from_m, double to_m, double quantum_m, std::uint32_t side, int& out) {
  const double cells = (to_m - from_m) / quantum_m;
  const double tiles = std::round(cells / side);
  out = static_cast<int>(std::clamp(tiles, -32768.0, 32767.0));
  return std::fabs(cells - tiles * side) < kOnGrid && out == tiles;
}

}  // namespace

bool find_shift(const CmapLayout& base, const CmapLayout& layout, GridShift& out) {
  if (base.quantum_um != layout.quantum_um || base.tile_side != layout.tile_side) return false;
  const double quantum_m = base.quantum_um / kMicrometresPerMetre;
  return tiles_between(base.origin_x_m, layout.origin_x_m, quantum_m, base.tile_side, out.columns) &&
         tiles_between(base.origin_y_m, layout.origin_y_m, quantum_m, base.tile_side, out.rows);
}

std::vector<TilePiece> pieces_of(const Bytes& map) {
  const MapShape shape = shape_of(map);
  std::vector<TilePiece> pieces;
  for (std::uint32_t t = 0; t <= shape.tiles(); ++t) {
    std::size_t offset = 0;
    const std::uint8_t* entry = map.data() + shape.head_bytes + std::size_t{t} * shape.entry_bytes;
    for (std::uint32_t i = 0; t < shape.tiles() && i < shape.entry_bytes; ++i)
      offset = offset << 8U | entry[i];
    const std::size_t at = t < shape.tiles() ? shape.payloads_at() + offset : map.size();
    if (t > 0) pieces.back().bytes = at - pieces.back().offset;
    if (t < shape.tiles()) pieces.push_back({t, at, 0});
  }
  return pieces;
}

MapDelta encode_delta(const Bytes& base, const Bytes& next, const GridShift& shift) {
  const MapShape old_shape = shape_of(base);
  const MapShape shape = shape_of(next);
  const std::vector<TilePiece> old_pieces = pieces_of(base);
  MapDelta made;
  Bytes& out = made.bytes;
  put_u32(out, delta::kMagic);
  out.push_back(delta::kVersion);
  out.push_back(0);
  put_u16(out, static_cast<unsigned>(shift.columns) & 0xFFFFU);
  put_u16(out, static_cast<unsigned>(shift.rows) & 0xFFFFU);
  put_u32(out, old_shape.file_bytes);
  put_u32(out, be::get_u32(base.data() + old_shape.head_bytes - cmap::kCrcBytes));
  out.insert(out.end(), next.begin(), next.begin() + shape.head_bytes);
  const std::size_t flags_at = out.size();
  out.resize(flags_at + (shape.tiles() + 7U) / 8U);
  for (const TilePiece& piece : pieces_of(next)) {
    const int column = static_cast<int>(piece.tile % shape.columns) + shift.columns;
    const int row = static_cast<int>(piece.tile / shape.columns) + shift.rows;
    const bool in_base = column >= 0 && row >= 0 && column < static_cast<int>(old_shape.columns) &&
                         row < static_cast<int>(old_shape.rows);
    TilePiece twin;
    if (in_base)
      twin = old_pieces[static_cast<std::size_t>(row) * old_shape.columns + static_cast<std::size_t>(column)];
    if (same_content(base, twin, next, piece)) {
      made.tiles_kept += piece.bytes > 0 ? 1U : 0U;
      continue;
    }
    std::uint8_t& flags = out[flags_at + piece.tile / 8U];
    flags = static_cast<std::uint8_t>(flags | 0x80U >> piece.tile % 8U);
    put_u16(out, static_cast<unsigned>(piece.bytes));
    made.pieces.push_back({piece.tile, out.size(), piece.bytes});
    const auto first = next.begin() + static_cast<std::ptrdiff_t>(piece.offset);
    out.insert(out.end(), first, first + static_cast<std::ptrdiff_t>(piece.bytes));
  }
  return made;
}

}  // namespace cairn::ground
