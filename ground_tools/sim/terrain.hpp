/// The bare ground of a simulated site: its heights, its slopes and how bright its soil is.
///
/// Heights: hills (octaves of noise from the relief's wavelength down to 1 m, each half as long with 0.4 of
/// the height), lumps (octaves below 0.5 m, 3.5 degrees of slope each), craters (craters.hpp) and ripples
/// that come and go. What is finer than the grid is shading alone (texture.hpp).
#pragma once

#include <cstddef>
#include <vector>

#include "sim/craters.hpp"
#include "sim/scene.hpp"

namespace cairn::ground::sim {

class Terrain {
 public:
  /// Cell of the grid of heights.
  static constexpr double kSpacing_m = 0.025;

  explicit Terrain(const Scene& scene);

  /// Between the grid's points: bilinear. Outside the site: that of its edge.
  double height_m(double x_m, double y_m) const;
  /// Upward normal, not normalised: (-dh/dx, -dh/dy, 1), bilinear.
  void slope(float x_m, float y_m, float& dh_dx, float& dh_dy) const;
  /// Albedo of the soil without its grain, bilinear.
  float albedo(float x_m, float y_m) const;
  /// Strength of grain and lumps, about 1, by patches.
  float roughness(float x_m, float y_m) const;

  /// The largest first.
  const std::vector<Crater>& craters() const { return craters_; }

  // The grid, frame map: sample (i, j) stands at origin + kSpacing_m * (i, j), y to the north.
  std::size_t columns() const { return columns_; }
  std::size_t rows() const { return rows_; }
  float at(std::size_t i, std::size_t j) const { return heights_[j * columns_ + i]; }
  double origin_x_m() const { return x0_; }
  double origin_y_m() const { return y0_; }

 private:
  struct Cell {
    std::size_t index;
    float u, v;
  };
  Cell locate(float x_m, float y_m) const;
  void make_heights(const Scene& scene);
  void add_craters();
  void make_slopes();
  void make_patches(const Scene& scene);

  double x0_;
  double y0_;
  std::size_t columns_;
  std::size_t rows_;
  std::vector<Crater> craters_;
  std::vector<float> heights_;
  std::vector<float> slopes_;  ///< dh/dx, dh/dy, a pair a sample

  // Patches, on a coarser grid.
  static constexpr float kPatchCell_m = 0.1F;
  std::size_t patch_columns_ = 0;
  std::size_t patch_rows_ = 0;
  std::vector<float> albedo_;
  std::vector<float> roughness_;
  float patch_value(const std::vector<float>& field, float x_m, float y_m) const;
};

}  // namespace cairn::ground::sim
