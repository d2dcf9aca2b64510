/// The bits of one tile of a flight map: what fsw/orbital_map/tile_decoder.hpp reads.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "orbital_map/tile_decoder.hpp"

namespace cairn::ground {

/// How an attribute is coded: its model in the head. No classes: the map has no such attribute.
struct AttributeTable {
  unsigned attribute = 0;  ///< 0 size, 1 height, 2 confidence
  std::uint16_t smallest_mm = 1;
  std::uint8_t step = 1;
  std::vector<std::uint8_t> weights;  ///< one a class

  bool present() const { return !weights.empty(); }
  unsigned classes() const { return static_cast<unsigned>(weights.size()); }
  /// For each value (mm; confidence: 0 to 1) the class nearest to it, by ratio for sizes and heights; a
  /// height of 0 is unknown.
  std::vector<std::uint8_t> classes_of(const std::vector<double>& values) const;
  /// Whether the ladder of classes reaches all values, to half a step.
  bool reaches(const std::vector<double>& values) const;
  void put(std::vector<std::uint8_t>& bytes) const;

 private:
  std::vector<double> ladder() const;
};
using AttributeTables = std::array<AttributeTable, cmap::kAttributes>;

/// The table that suits the values of a map, or an absent one where nothing is to be told: all heights
/// unknown, all confidences 1. Classes are some 12 % apart, more where they would be too many.
AttributeTable table_for(unsigned attribute, const std::vector<double>& values);

/// Payload of tile `index` with its CRC; empty for no boulders. Boulders in any order, cells distinct.
std::vector<std::uint8_t> encode_tile(std::uint32_t index, const cmap::TileShape& shape,
                                      const AttributeTables& tables, std::vector<cmap::TileBoulder> boulders);

}  // namespace cairn::ground
