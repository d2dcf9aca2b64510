/// The paper's cameras.
#pragma once

#include "geometry/stereo_rig.hpp"

namespace cairn::test {

/// Without a place on the rover.
inline StereoRig rig_of_the_paper() {
  StereoRig rig;
  rig.width_px = 512;
  rig.height_px = 384;
  rig.fx_px = 394.2;
  rig.fy_px = 394.2;
  rig.cx_px = 255.5;
  rig.cy_px = 191.5;
  rig.baseline_m = 0.12;
  return rig;
}

}  // namespace cairn::test
