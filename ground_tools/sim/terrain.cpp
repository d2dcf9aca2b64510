#include "sim/terrain.hpp"

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "core/trig.hpp"
#include "sim/lattice_noise.hpp"

namespace cairn::ground::sim {
namespace {

constexpr double kHillRatio = 0.4;  ///< height of an octave over that of the one twice as long
constexpr double kShortestHill_m = 1.0;
constexpr double kLongestLump_m = 0.48;
constexpr double kShortestLump_m = 0.10;  ///< four cells of the grid
constexpr double kLumpSlope = 0.061;      ///< standard deviation, each octave: 3.5 degrees

std::size_t samples(double length_m, double spacing_m) {
  return static_cast<std::size_t>(std::lround(length_m / spacing_m)) + 1;
}

/// One field of the grid, from octaves.
class Field {
 public:
  Field(const Scene& scene, double spacing_m, std::size_t columns, std::size_t rows)
      : scene_(scene), spacing_m_(spacing_m), columns_(columns), rows_(rows), values(columns * rows, 0.0F) {}

  void add(Stream stream, double wavelength_m, double deviation) {
    add_noise({scene_.seed, stream, number_++, wavelength_m, deviation, 0}, scene_.site.origin_x_m,
              scene_.site.origin_y_m, spacing_m_, columns_, rows_, values);
  }

 private:
  const Scene& scene_;
  double spacing_m_;
  std::size_t columns_;
  std::size_t rows_;
  std::uint64_t number_ = 0;

 public:
  std::vector<float> values;
};

}  // namespace

Terrain::Terrain(const Scene& scene)
    : x0_(scene.site.origin_x_m),
      y0_(scene.site.origin_y_m),
      columns_(samples(scene.site.width_m, kSpacing_m)),
      rows_(samples(scene.site.height_m, kSpacing_m)),
      craters_(make_craters(scene)) {
  make_heights(scene);
  make_slopes();
  make_patches(scene);
}

void Terrain::make_heights(const Scene& scene) {
  const Site& site = scene.site;
  Field field(scene, kSpacing_m, columns_, rows_);
  double variance = 0.0;
  double height = 1.0;
  for (double w = site.relief_wavelength_m; w >= kShortestHill_m; w *= 0.5, height *= kHillRatio)
    variance += height * height;
  height = site.relief_rms_m / std::sqrt(std::max(variance, 1e-12));
  for (double w = site.relief_wavelength_m; w >= kShortestHill_m; w *= 0.5, height *= kHillRatio)
    field.add(Stream::kRelief, w, height);
  if (site.relief_rms_m > 0.0) {
    // A slope of s at wavelength w is a height of s w / 2 pi for a wave; the lattice's noise has that too.
    for (double w = kLongestLump_m; w >= kShortestLump_m; w *= 0.5)
      field.add(Stream::kRelief, w, kLumpSlope * w / (2.0 * kPi));
  }
  heights_ = std::move(field.values);
  add_craters();
  if (site.ripple_height_m <= 0.0) return;

  Field bend(scene, kSpacing_m, columns_, rows_);
  bend.add(Stream::kRipples, 6.0 * site.ripple_wavelength_m, 0.9);
  bend.add(Stream::kRipples, 20.0 * site.ripple_wavelength_m, 2.0);
  Field strength(scene, kSpacing_m, columns_, rows_);
  strength.add(Stream::kRipples, 12.0 * site.ripple_wavelength_m, 0.6);
  const double azimuth = site.ripple_azimuth_deg * kPi / 180.0;
  const double kx = 2.0 * kPi / site.ripple_wavelength_m * std::sin(azimuth);
  const double ky = 2.0 * kPi / site.ripple_wavelength_m * std::cos(azimuth);
  for (std::size_t j = 0; j < rows_; ++j) {
    for (std::size_t i = 0; i < columns_; ++i) {
      const std::size_t k = j * columns_ + i;
      const double phase = kx * (kSpacing_m * static_cast<double>(i)) +
                           ky * (kSpacing_m * static_cast<double>(j)) + static_cast<double>(bend.values[k]);
      const double share = std::clamp(0.5 + static_cast<double>(strength.values[k]), 0.0, 1.0);
      heights_[k] += static_cast<float>(0.5 * site.ripple_height_m * share * std::sin(phase));
    }
  }
}

void Terrain::add_craters() {
  if (craters_.empty()) return;
  constexpr std::size_t kBand = 64;
  parallel_for((rows_ + kBand - 1) / kBand, [&](std::size_t band) {
    const std::size_t end = std::min(rows_, (band + 1) * kBand);
    for (const Crater& crater : craters_) {
      const double reach = 0.5 * kCraterReach * crater.diameter_m / kSpacing_m;
      const double x = (crater.p_map_m.x() - x0_) / kSpacing_m;
      const double y = (crater.p_map_m.y() - y0_) / kSpacing_m;
      const auto from = [](double low) { return static_cast<std::size_t>(std::max(0.0, std::ceil(low))); };
      for (std::size_t j = std::max(band * kBand, from(y - reach));
           j < end && static_cast<double>(j) <= y + reach; ++j) {
        for (std::size_t i = from(x - reach); i < columns_ && static_cast<double>(i) <= x + reach; ++i) {
          const Vec2 off(static_cast<double>(i) - x, static_cast<double>(j) - y);
          heights_[j * columns_ + i] += static_cast<float>(crater_height_m(crater, kSpacing_m * off));
        }
      }
    }
  });
}

void Terrain::make_slopes() {
  slopes_.resize(2 * columns_ * rows_);
  const auto reach = [](std::size_t i, std::size_t n) {
    return std::pair{i == 0 ? i : i - 1, i + 1 == n ? i : i + 1};
  };
  for (std::size_t j = 0; j < rows_; ++j) {
    const auto [down, up] = reach(j, rows_);
    for (std::size_t i = 0; i < columns_; ++i) {
      const auto [left, right] = reach(i, columns_);
      const std::size_t k = j * columns_ + i;
      slopes_[2 * k] =
          (at(right, j) - at(left, j)) / static_cast<float>(kSpacing_m * static_cast<double>(right - left));
      slopes_[2 * k + 1] =
          (at(i, up) - at(i, down)) / static_cast<float>(kSpacing_m * static_cast<double>(up - down));
    }
  }
}

void Terrain::make_patches(const Scene& scene) {
  const Site& site = scene.site;
  const double cell = static_cast<double>(kPatchCell_m);
  patch_columns_ = samples(site.width_m, cell) + 1;
  patch_rows_ = samples(site.height_m, cell) + 1;
  Field soil(scene, cell, patch_columns_, patch_rows_);
  const double each = site.patch_contrast / std::sqrt(3.0);
  for (const double factor : {3.0, 1.0, 0.35}) soil.add(Stream::kPatches, factor * site.patch_size_m, each);
  Field grain(scene, cell, patch_columns_, patch_rows_);
  grain.add(Stream::kTexture, 1.7 * site.patch_size_m, 0.25);
  grain.add(Stream::kTexture, 0.6 * site.patch_size_m, 0.2);
  albedo_ = std::move(soil.values);
  roughness_ = std::move(grain.values);
  for (float& a : albedo_) {
    a = static_cast<float>(site.albedo) * std::clamp(1.0F + a, 0.3F, 2.0F);
  }
  for (float& r : roughness_) r = std::clamp(1.0F + r, 0.3F, 1.8F);
}

Terrain::Cell Terrain::locate(float x_m, float y_m) const {
  const float scale = static_cast<float>(1.0 / kSpacing_m);
  const float x =
      std::clamp((x_m - static_cast<float>(x0_)) * scale, 0.0F, static_cast<float>(columns_ - 1) - 1e-3F);
  const float y =
      std::clamp((y_m - static_cast<float>(y0_)) * scale, 0.0F, static_cast<float>(rows_ - 1) - 1e-3F);
  const auto i = static_cast<std::size_t>(x);
  const auto j = static_cast<std::size_t>(y);
  return {j * columns_ + i, x - static_cast<float>(i), y - static_cast<float>(j)};
}

double Terrain::height_m(double x_m, double y_m) const {
  const double x = std::clamp((x_m - x0_) / kSpacing_m, 0.0, static_cast<double>(columns_ - 1) - 1e-9);
  const double y = std::clamp((y_m - y0_) / kSpacing_m, 0.0, static_cast<double>(rows_ - 1) - 1e-9);
  const auto i = std::min(static_cast<std::size_t>(x), columns_ - 2);
  const auto j = std::min(static_cast<std::size_t>(y), rows_ - 2);
  const double u = x - static_cast<double>(i);
  const double v = y - static_cast<double>(j);
  const auto h = [&](std::size_t a, std::size_t b) { return static_cast<double>(at(i + a, j + b)); };
  return (1.0 - v) * ((1.0 - u) * h(0, 0) + u * h(1, 0)) + v * ((1.0 - u) * h(0, 1) + u * h(1, 1));
}

void Terrain::slope(float x_m, float y_m, float& dh_dx, float& dh_dy) const {
  const Cell c = locate(x_m, y_m);
  const float* low = slopes_.data() + 2 * c.index;
  const float* high = low + 2 * columns_;
  const float a = (1.0F - c.u) * (1.0F - c.v);
  const float b = c.u * (1.0F - c.v);
  const float d = (1.0F - c.u) * c.v;
  const float e = c.u * c.v;
  dh_dx = a * low[0] + b * low[2] + d * high[0] + e * high[2];
  dh_dy = a * low[1] + b * low[3] + d * high[1] + e * high[3];
}

float Terrain::patch_value(const std::vector<float>& field, float x_m, float y_m) const {
  const float x = std::clamp((x_m - static_cast<float>(x0_)) / kPatchCell_m, 0.0F,
                             static_cast<float>(patch_columns_ - 1) - 1e-3F);
  const float y = std::clamp((y_m - static_cast<float>(y0_)) / kPatchCell_m, 0.0F,
                             static_cast<float>(patch_rows_ - 1) - 1e-3F);
  const auto i = static_cast<std::size_t>(x);
  const auto j = static_cast<std::size_t>(y);
  const float u = x - static_cast<float>(i);
  const float v = y - static_cast<float>(j);
  const float* low = field.data() + j * patch_columns_ + i;
  const float* high = low + patch_columns_;
  return (1.0F - v) * ((1.0F - u) * low[0] + u * low[1]) + v * ((1.0F - u) * high[0] + u * high[1]);
}

float Terrain::albedo(float x_m, float y_m) const { return patch_value(albedo_, x_m, y_m); }
float Terrain::roughness(float x_m, float y_m) const { return patch_value(roughness_, x_m, y_m); }

}  // namespace cairn::ground::sim
