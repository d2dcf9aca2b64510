/// Fine texture of soil and rock: grain of the albedo and slopes of the smallest lumps, from millimetres to a
/// decimetre, as two periodic tiles that are laid over each other at different angles, so that their sum
/// does not repeat within a site. Averaged copies (mip levels) serve pixels larger than the tile's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cairn::ground::sim {

/// What the texture says of a point.
struct Grain {
  float albedo = 0.0F;   ///< deviation from the mean, in standard deviations of the whole texture
  float slope_x = 0.0F;  ///< of the smallest lumps, about 0.2 standard deviation; along the axes of (x, y)
  float slope_y = 0.0F;
};

class Texture {
 public:
  explicit Texture(std::uint64_t seed);

  /// At (x, y) metres, averaged over about `footprint_m`.
  Grain at(float x_m, float y_m, float footprint_m) const;

  static constexpr float kTexel_m = 0.001F;

 private:
  struct Texel {
    std::int8_t albedo, slope_x, slope_y, unused;
  };
  static constexpr int kSideBits = 11;
  static constexpr std::size_t kSide = 1U << kSideBits;
  static constexpr int kLevels = 7;

  using Tile = std::vector<Texel>;
  static Tile make_tile(std::uint64_t seed, std::uint64_t number);
  static Tile average(const Tile& fine, std::size_t side);
  Grain sample(int tile, int level, float u, float v) const;

  Tile tiles_[2][kLevels];
};

}  // namespace cairn::ground::sim
