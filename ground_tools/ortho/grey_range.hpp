/// The stretch of 16-bit and real images to 8 bits: linear, the 0.1 and 99.9 percentiles of the valid pixels
/// becoming 0 and 255 (the least and the largest value where these two are one). What lies beyond a gap four
/// times as wide as the values up to it, where no brightness is, below zero or above all others, counts in
/// none of these: -9999 in holes that nothing marks would take all of the range, however few they are.
///
/// The percentiles are exact, of images of any size, whatever the tiles: each tile counts its values in bins,
/// counts add up, and the wanted values are looked up by rank. 16-bit values have a bin each. Reals go twice
/// over the image: bins of the upper half of their bits, ordered as the numbers are, then the lower half
/// within the bins that hold the wanted ranks.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/byte_stream.hpp"
#include "ortho/raster_source.hpp"

namespace cairn::ground {

/// The bins whose lower halves are counted in the second round: of the least value, the two percentiles
/// and the largest.
using FineBins = std::array<std::uint32_t, 4>;

/// A tile's counts, as bytes for GreyRangeSearch. O(pixels).
Bytes count_values(RasterReader& reader, PixelDepth depth, const PixelBox& tile);
Bytes count_lower_halves(RasterReader& reader, const FineBins& bins, const PixelBox& tile);

/// What there is in an image of greys; adds up over tiles.
struct GreyContent {
  std::uint64_t valid = 0;
  std::uint8_t least = 255;
  std::uint8_t most = 0;

  /// `missing` null: every pixel counts.
  void add(const std::uint8_t* grey, const std::uint8_t* missing, std::size_t pixels);
  void add(const GreyContent& other);
  /// Throws ToolError that names the image: every pixel is missing, or all are equal.
  void check(const std::string& name) const;
};

class GreyRangeSearch {
 public:
  explicit GreyRangeSearch(PixelDepth depth);

  void add_values(const Bytes& counts);
  /// After all tiles' values. Throws ToolError that names the image: every pixel is missing,
  /// or all are equal.
  void finish_values(const std::string& name);
  bool needs_lower_halves() const { return depth_ == PixelDepth::kReal; }
  const FineBins& bins() const { return bins_; }
  /// What the stretch leaves out, in words for the user; empty: nothing.
  const std::string& left_out() const { return left_out_; }
  void add_lower_halves(const Bytes& counts);
  /// After all of the above.
  GreyRange finish(const std::string& name) const;

 private:
  double value_of_bin(std::size_t bin) const;
  std::uint64_t total() const;
  std::size_t bin_of(std::uint64_t rank, std::uint64_t& below) const;
  void leave_out_far(bool low);

  PixelDepth depth_;
  std::vector<std::uint64_t> counts_;
  std::string left_out_;
  std::array<std::vector<std::uint64_t>, 4> lower_;
  FineBins bins_ = {};
  std::array<std::uint64_t, 4> rank_in_bin_ = {};
};

}  // namespace cairn::ground
