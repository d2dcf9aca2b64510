#include "sim/texture.hpp"

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "core/trig.hpp"
#include "sim/lattice_noise.hpp"

namespace cairn::ground::sim {
namespace {

constexpr double kLongest_m = 0.128;
constexpr double kShortest_m = 0.004;
constexpr int kOctaves = 6;
/// Slope of each octave's lumps, standard deviation. A tile has kOctaves of them.
constexpr double kOctaveSlope = 0.20;
constexpr float kAlbedoRange = 4.0F;  ///< standard deviations that fill a byte
constexpr float kSlopeRange = 1.0F;
/// How each tile lies: turned, and a little stretched.
struct Lay {
  float c, s, scale;
};
constexpr Lay kLays[2] = {{0.9563F, 0.2924F, 1.0F}, {0.6018F, -0.7986F, 1.37F}};

std::int8_t to_byte(float value, float range) {
  return static_cast<std::int8_t>(std::clamp(std::lround(value / range * 127.0F), -127L, 127L));
}

}  // namespace

Texture::Tile Texture::make_tile(std::uint64_t seed, std::uint64_t number) {
  const double texel = static_cast<double>(kTexel_m);
  std::vector<float> heights(kSide * kSide, 0.0F);
  std::vector<float> albedo(kSide * kSide, 0.0F);
  int octave = 0;
  for (double w = kLongest_m; w >= 0.99 * kShortest_m; w *= 0.5, ++octave) {
    const auto period =
        static_cast<std::uint64_t>(std::lround(static_cast<double>(kSide) * texel / (0.5 * w)));
    const std::uint64_t n = 100 * number + static_cast<std::uint64_t>(octave);
    add_noise({seed, Stream::kTexture, 1000 + n, w, kOctaveSlope * w / (2.0 * kPi), period}, 0.0, 0.0, texel,
              kSide, kSide, heights);
    add_noise({seed, Stream::kTexture, 2000 + n, w, 1.0 / std::sqrt(static_cast<double>(kOctaves)), period},
              0.0, 0.0, texel, kSide, kSide, albedo);
  }
  Tile tile(kSide * kSide);
  for (std::size_t j = 0; j < kSide; ++j) {
    for (std::size_t i = 0; i < kSide; ++i) {
      const auto h = [&](std::size_t a, std::size_t b) { return heights[(b % kSide) * kSide + a % kSide]; };
      const float half = 0.5F / kTexel_m;
      tile[j * kSide + i] = {to_byte(albedo[j * kSide + i], kAlbedoRange),
                             to_byte((h(i + 1, j) - h(i + kSide - 1, j)) * half, kSlopeRange),
                             to_byte((h(i, j + 1) - h(i, j + kSide - 1)) * half, kSlopeRange), 0};
    }
  }
  return tile;
}

Texture::Tile Texture::average(const Tile& fine, std::size_t side) {
  Tile coarse(side * side);
  for (std::size_t j = 0; j < side; ++j) {
    for (std::size_t i = 0; i < side; ++i) {
      int a = 0;
      int x = 0;
      int y = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        const Texel& t = fine[(2 * j + k / 2) * 2 * side + 2 * i + k % 2];
        a += t.albedo;
        x += t.slope_x;
        y += t.slope_y;
      }
      coarse[j * side + i] = {static_cast<std::int8_t>(a / 4), static_cast<std::int8_t>(x / 4),
                              static_cast<std::int8_t>(y / 4), 0};
    }
  }
  return coarse;
}

Texture::Texture(std::uint64_t seed) {
  parallel_for(2, [&](std::size_t i) {
    tiles_[i][0] = make_tile(seed, i);
    for (int level = 1; level < kLevels; ++level)
      tiles_[i][level] = average(tiles_[i][level - 1], kSide >> level);
  });
}

Grain Texture::sample(int tile, int level, float u, float v) const {
  const float fu = std::floor(u);
  const float fv = std::floor(v);
  const float du = u - fu;
  const float dv = v - fv;
  const int bits = kSideBits - level;
  const auto mask = static_cast<std::uint32_t>((1U << bits) - 1U);
  const std::uint32_t i = static_cast<std::uint32_t>(static_cast<std::int32_t>(fu)) & mask;
  const std::uint32_t j = static_cast<std::uint32_t>(static_cast<std::int32_t>(fv)) & mask;
  const std::uint32_t i1 = (i + 1U) & mask;
  const std::uint32_t j1 = (j + 1U) & mask;
  const Texel* texels = tiles_[tile][level].data();
  const Texel& a = texels[(j << bits) + i];
  const Texel& b = texels[(j << bits) + i1];
  const Texel& c = texels[(j1 << bits) + i];
  const Texel& d = texels[(j1 << bits) + i1];
  const float wa = (1.0F - du) * (1.0F - dv);
  const float wb = du * (1.0F - dv);
  const float wc = (1.0F - du) * dv;
  const float wd = du * dv;
  const auto blend = [&](std::int8_t Texel::*m) {
    return wa * static_cast<float>(a.*m) + wb * static_cast<float>(b.*m) + wc * static_cast<float>(c.*m) +
           wd * static_cast<float>(d.*m);
  };
  return {blend(&Texel::albedo), blend(&Texel::slope_x), blend(&Texel::slope_y)};
}

Grain Texture::at(float x_m, float y_m, float footprint_m) const {
  int level = 0;
  for (float texel = 1.5F * kTexel_m; texel < footprint_m && level + 1 < kLevels; texel *= 2.0F) ++level;
  const float per_texel = 1.0F / (kTexel_m * static_cast<float>(1 << level));
  const float centre = 0.5F - 0.5F / static_cast<float>(1 << level);  // of a coarse texel, in fine ones
  Grain sum;
  for (int i = 0; i < 2; ++i) {
    const Lay& lay = kLays[i];
    const float u = (lay.c * x_m + lay.s * y_m) * lay.scale * per_texel - centre;
    const float v = (-lay.s * x_m + lay.c * y_m) * lay.scale * per_texel - centre;
    const Grain g = sample(i, level, u, v);
    sum.albedo += g.albedo;
    sum.slope_x += lay.c * g.slope_x - lay.s * g.slope_y;
    sum.slope_y += lay.s * g.slope_x + lay.c * g.slope_y;
  }
  constexpr float kAlbedo = kAlbedoRange / 127.0F * 0.70710678F;
  constexpr float kSlope = kSlopeRange / 127.0F;
  return {kAlbedo * sum.albedo, kSlope * sum.slope_x, kSlope * sum.slope_y};
}

}  // namespace cairn::ground::sim
