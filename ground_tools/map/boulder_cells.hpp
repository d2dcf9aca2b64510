/// Boulders by square cells of the ground, so that a search by distance looks at few of them.
#pragma once

#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include "base/boulder_table.hpp"

namespace cairn::ground {

class BoulderCells {
 public:
  /// `boulders`, which must outlive it, with `shift_map_m` taken off their places. Cells are `side_m` wide,
  /// best as wide as the distances that are looked for.
  BoulderCells(const std::vector<TableBoulder>& boulders, const Vec2& shift_map_m, double side_m)
      : boulders_(boulders), shift_map_m_(shift_map_m), side_m_(side_m) {
    for (std::size_t i = 0; i < boulders.size(); ++i) cells_[cell_of(place(i))].push_back(i);
  }

  /// Calls `visit(index, distance)` for each boulder within `distance_m`, that included.
  template <typename Visit>
  void within(const Vec2& p_map_m, double distance_m, const Visit& visit) const {
    const Vec2 reach_m = Vec2::Constant(distance_m);
    const Cell low = cell_of(p_map_m - reach_m);
    const Cell high = cell_of(p_map_m + reach_m);
    for (std::int64_t y = low.second; y <= high.second; ++y) {
      for (std::int64_t x = low.first; x <= high.first; ++x) {
        const auto cell = cells_.find({x, y});
        if (cell == cells_.end()) continue;
        for (const std::size_t i : cell->second) {
          const double apart_m = (place(i) - p_map_m).norm();
          if (apart_m <= distance_m) visit(i, apart_m);
        }
      }
    }
  }

 private:
  using Cell = std::pair<std::int64_t, std::int64_t>;
  struct Hash {
    std::size_t operator()(const Cell& c) const {
      return static_cast<std::size_t>(static_cast<std::uint64_t>(c.first) * 0x9E3779B97F4A7C15ULL +
                                      static_cast<std::uint64_t>(c.second) * 0xC2B2AE3D27D4EB4FULL);
    }
  };

  Vec2 place(std::size_t i) const { return boulders_[i].p_map_m - shift_map_m_; }
  Cell cell_of(const Vec2& p_map_m) const {
    return {static_cast<std::int64_t>(std::floor(p_map_m.x() / side_m_)),
            static_cast<std::int64_t>(std::floor(p_map_m.y() / side_m_))};
  }

  const std::vector<TableBoulder>& boulders_;
  Vec2 shift_map_m_;
  double side_m_;
  std::unordered_map<Cell, std::vector<std::size_t>, Hash> cells_;
};

}  // namespace cairn::ground
