/// What of the left picture shows the rover itself: a deck, a wheel, an arm at rest. The mission knows of it
/// (cfg::Mission::own_hardware, which `cairn mask` makes from a picture); nothing seen there is ground. What
/// it does not know of is told by not moving (localizer/visual_odometry.hpp).
///
/// A bit a cell of kCell_px x kCell_px pixels, 384 bytes for 512 x 384, whatever its shape is. A cell is
/// covered where any pixel of it is: a feature's patch reaches that far.
#pragma once

#include <cstdint>

#include "mission_cfg.hpp"

namespace cairn {

using PixelBox = cfg::PixelBox;

class OwnHardware {
 public:
  static constexpr int kCell_px = 8;
  static constexpr int kColumns = (cfg::kImageWidth + kCell_px - 1) / kCell_px;
  static constexpr int kRows = (cfg::kImageHeight + kCell_px - 1) / kCell_px;

  /// Nothing is covered.
  constexpr OwnHardware() = default;
  /// What the mission says.
  static constexpr OwnHardware of(const cfg::Mission& mission) {
    OwnHardware own;
    for (int i = 0; i < mission.own_hardware_boxes; ++i) own.cover(mission.own_hardware[i]);
    return own;
  }

  /// What of the box lies in the picture; a box without pixels is none.
  constexpr void cover(const PixelBox& box) {
    if (box.u0 >= box.u1 || box.v0 >= box.v1) return;
    const int first_row = box.v0 > 0 ? box.v0 / kCell_px : 0;
    const int first_column = box.u0 > 0 ? box.u0 / kCell_px : 0;
    for (int row = first_row; row < kRows && row * kCell_px < box.v1; ++row) {
      for (int column = first_column; column < kColumns && column * kCell_px < box.u1; ++column) {
        const int bit = row * kColumns + column;
        bits_[bit / 8] = static_cast<std::uint8_t>(bits_[bit / 8] | (1U << (bit % 8)));
      }
    }
  }

  /// Is the pixel that a point lies in covered? Nothing is outside of the picture, or where it is not finite.
  bool covers(double u_px, double v_px) const {
    const double u = u_px + 0.5;
    const double v = v_px + 0.5;
    if (!(u >= 0.0 && u < kColumns * kCell_px && v >= 0.0 && v < kRows * kCell_px)) return false;
    return covers_cell(static_cast<int>(u) / kCell_px, static_cast<int>(v) / kCell_px);
  }
  /// Of a column and a row that there are.
  constexpr bool covers_cell(int column, int row) const {
    const int bit = row * kColumns + column;
    return (bits_[bit / 8] >> (bit % 8) & 1U) != 0;
  }

 private:
  std::uint8_t bits_[(kColumns * kRows + 7) / 8] = {};  ///< row-major
};

inline constexpr OwnHardware kMissionHardware = OwnHardware::of(cfg::kMission);

}  // namespace cairn
