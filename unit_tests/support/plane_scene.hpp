/// A textured ground plane seen by the rig: pictures whose exact motion is known.
///
/// World: plane z = 0, z up. The texture is random at every scale from 4 mm to 0.5 m and repeats after 4.1 m;
/// pictures are filtered by the footprint of each pixel, so that distant ground does not flicker.
#pragma once

#include <cstdint>

#include "core/random.hpp"
#include "geometry/stereo_rig.hpp"

namespace cairn::test {

inline constexpr int kSmallWidth = 320;
inline constexpr int kSmallHeight = 240;
/// The paper's rig with pictures of that size: quick to render and to look at.
StereoRig small_rig();

class PlaneScene {
 public:
  /// Draws the texture. Large: keep it static.
  void make(std::uint64_t seed);
  /// Grey of the ground at (x, y), filtered over `footprint_m`.
  double grey(double x_m, double y_m, double footprint_m) const;
  /// One camera's picture (width x height bytes, packed) from T_world_cam, the left camera's pose.
  void render(const StereoRig& rig, const Pose3& T_world_cam, bool right, double noise_grey, Random& random,
              std::uint8_t* pixels) const;

 private:
  static constexpr int kSide = 1024;  ///< texels
  static constexpr int kLevels = 8;
  static constexpr double kTexel = 0.004;  ///< m

  const float* level(int l) const { return texels_ + offset_[l]; }

  std::size_t offset_[kLevels] = {};
  float texels_[kSide * kSide * 4 / 3 + 16] = {};
};

}  // namespace cairn::test
