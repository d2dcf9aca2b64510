#include "support/plane_scene.hpp"

#include <cmath>

#include "core/trig.hpp"
#include "support/noise.hpp"

namespace cairn::test {

StereoRig small_rig() {
  StereoRig rig;
  rig.width_px = kSmallWidth;
  rig.height_px = kSmallHeight;
  rig.fx_px = rig.fy_px = 246.4;
  rig.cx_px = 159.5;
  rig.cy_px = 119.5;
  rig.baseline_m = 0.12;
  rig.T_rover_cam = mast_pose(0.7, 39.0 * kRadPerDeg, rig.baseline_m);
  return rig;
}

void PlaneScene::make(std::uint64_t seed) {
  // Noise of every scale: grids of 8, 16, ... 1024 random values, each interpolated and of like strength.
  Random random(seed);
  for (int i = 0; i < kSide * kSide; ++i) texels_[i] = 115.0F;
  static float grid[kSide * kSide];
  for (int side = 8; side <= kSide; side *= 2) {
    for (int i = 0; i < side * side; ++i) grid[i] = static_cast<float>(uniform(random, -28.0, 28.0));
    const int step = kSide / side;
    for (int y = 0; y < kSide; ++y) {
      const int j = y / step;
      const auto fy = static_cast<float>(y % step) / static_cast<float>(step);
      const float* a = grid + j * side;
      const float* b = grid + (j + 1) % side * side;
      for (int x = 0; x < kSide; ++x) {
        const int i = x / step;
        const int i1 = (i + 1) % side;
        const auto fx = static_cast<float>(x % step) / static_cast<float>(step);
        texels_[y * kSide + x] +=
            (1.0F - fy) * ((1.0F - fx) * a[i] + fx * a[i1]) + fy * ((1.0F - fx) * b[i] + fx * b[i1]);
      }
    }
  }
  offset_[0] = 0;
  for (int l = 1; l < kLevels; ++l) {
    const int side = kSide >> l;
    offset_[l] = offset_[l - 1] + static_cast<std::size_t>(4) * static_cast<std::size_t>(side) *
                                      static_cast<std::size_t>(side);
    const float* from = level(l - 1);
    float* to = texels_ + offset_[l];
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const float* p = from + 4 * y * side + 2 * x;
        to[y * side + x] = 0.25F * (p[0] + p[1] + p[2 * side] + p[2 * side + 1]);
      }
    }
  }
}

double PlaneScene::grey(double x_m, double y_m, double footprint_m) const {
  double lod = std::log2(footprint_m / kTexel);
  lod = lod < 0.0 ? 0.0 : (lod > kLevels - 1.001 ? kLevels - 1.001 : lod);
  const int first = static_cast<int>(lod);
  double sum = 0.0;
  for (int l = first; l <= first + 1; ++l) {
    const int side = kSide >> l;
    // Texel centres at halves, so that levels lie on each other.
    const double x = x_m / (kTexel * (1 << l)) - 0.5;
    const double y = y_m / (kTexel * (1 << l)) - 0.5;
    const double fx = x - std::floor(x);
    const double fy = y - std::floor(y);
    const int i0 = static_cast<int>(std::floor(x)) & (side - 1);
    const int j0 = static_cast<int>(std::floor(y)) & (side - 1);
    const int i1 = (i0 + 1) & (side - 1);
    const int j1 = (j0 + 1) & (side - 1);
    const float* t = level(l);
    const double top =
        (1.0 - fx) * static_cast<double>(t[j0 * side + i0]) + fx * static_cast<double>(t[j0 * side + i1]);
    const double low =
        (1.0 - fx) * static_cast<double>(t[j1 * side + i0]) + fx * static_cast<double>(t[j1 * side + i1]);
    sum += (l == first ? 1.0 - (lod - first) : lod - first) * ((1.0 - fy) * top + fy * low);
  }
  return sum;
}

void PlaneScene::render(const StereoRig& rig, const Pose3& T_world_cam, bool right, double noise_grey,
                        Random& random, std::uint8_t* pixels) const {
  const Vec3 eye = T_world_cam * Vec3(right ? rig.baseline_m : 0.0, 0.0, 0.0);
  const Mat3 R = T_world_cam.q.toRotationMatrix();
  for (int v = 0; v < rig.height_px; ++v) {
    for (int u = 0; u < rig.width_px; ++u) {
      double sum = 0.0;
      constexpr int kSamples = 3;  // along v, where the ground is seen at a slant
      for (int s = 0; s < kSamples; ++s) {
        const double row = v + (s + 0.5) / kSamples - 0.5;
        const Vec3 ray = R * Vec3((u - rig.cx_px) / rig.fx_px, (row - rig.cy_px) / rig.fy_px, 1.0);
        double g = 200.0;  // sky
        if (ray.z() < -0.02) {
          const double range = -eye.z() / ray.z();
          const double slant = ray.norm() / -ray.z();
          const double footprint =
              range * ray.norm() / rig.fx_px * (slant > kSamples ? slant / kSamples : 1.0);
          g = grey(eye.x() + range * ray.x(), eye.y() + range * ray.y(), footprint);
        }
        sum += g / kSamples;
      }
      const double g = sum + noise_grey * normal(random) + 0.5;
      pixels[v * rig.width_px + u] = static_cast<std::uint8_t>(g < 0.0 ? 0.0 : (g > 255.0 ? 255.0 : g));
    }
  }
}

}  // namespace cairn::test
