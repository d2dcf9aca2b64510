/// What of the left picture shows the rover itself: a deck, a wheel, an arm at rest. Boxes of pixels that the
/// mission knows of; nothing seen there is ground. What it does not know of is told by not moving
/// (localizer/visual_odometry.hpp).
#pragma once

namespace cairn {

/// Pixels from (u0, v0) on to before (u1, v1); none by default.
struct PixelBox {
  int u0 = 0;
  int v0 = 0;
  int u1 = 0;
  int v1 = 0;
};

struct OwnHardware {
  static constexpr int kMaxBoxes = 4;

  PixelBox boxes[kMaxBoxes] = {};

  bool covers(double u_px, double v_px) const {
    for (const PixelBox& b : boxes) {
      if (u_px >= b.u0 && u_px < b.u1 && v_px >= b.v0 && v_px < b.v1) return true;
    }
    return false;
  }
};

}  // namespace cairn
