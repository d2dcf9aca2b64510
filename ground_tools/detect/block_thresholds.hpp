/// The adaptive Otsu threshold of the paper's detector: statistics of the difference image block by block,
/// from tiles that may cut the blocks anywhere, and the thresholds between the blocks' centres.
///
/// Two rounds over the image need no more than this from the first: histograms are counts, which add up to
/// the same whatever the tiles and their order. A block that is complete shrinks to two numbers.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "base/byte_stream.hpp"
#include "detect/kernels.hpp"
#include "ortho/grey_range.hpp"

namespace cairn::ground {

inline constexpr int kLevel = 128;  ///< a difference of nothing

/// Blocks of about `block_px`, evenly spread over the image.
struct BlockGrid {
  BlockGrid(int width_px, int height_px, int block_px);

  int width = 0;
  int height = 0;
  int columns = 1;
  int rows = 1;

  int column_of(int x) const { return block_of(x, columns, width); }
  int row_of(int y) const { return block_of(y, rows, height); }
  /// First pixel column of a block column; `columns` gives the width. Likewise rows.
  int first_x(int column) const { return first_of(column, columns, width); }
  int first_y(int row) const { return first_of(row, rows, height); }
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }

 private:
  static int block_of(int i, int blocks, int size) {
    return static_cast<int>(static_cast<std::int64_t>(i) * blocks / size);
  }
  static int first_of(int block, int blocks, int size) {
    return static_cast<int>((static_cast<std::int64_t>(block) * size + blocks - 1) / blocks);
  }
};

/// A tile's share of the statistics, as bytes for BlockStatistics. `radius`: of the surroundings. O(pixels).
Bytes tile_statistics(RasterReader& reader, const GreyRange& range, const RasterFacts& facts,
                      const BlockGrid& grid, int radius, const PixelBox& tile);

struct ThresholdParams {
  double threshold_scale = 0.55;
  double noise_sigmas = 1.5;
};

/// Thresholds at the blocks' centres, as darkness below the surroundings in units of 2^-12 levels.
using BlockDarkness = std::vector<std::int32_t>;

/// Adds up the tiles' shares. Memory grows with the blocks that tiles have begun and not ended.
class BlockStatistics {
 public:
  explicit BlockStatistics(const BlockGrid& grid);

  void add(const Bytes& tile);
  /// After all tiles. Throws ToolError that names the image: nothing valid in it, or one value throughout.
  BlockDarkness finish(const ThresholdParams& params, const std::string& name) const;

 private:
  struct Open {
    Histogram histogram{};
    std::uint64_t pixels = 0;  ///< missing ones, too
  };
  struct Closed {
    double darkness = 0.0;
    double sigma = 0.0;
  };

  BlockGrid grid_;
  GreyContent content_;
  Histogram whole_{};
  std::unordered_map<std::size_t, Open> open_;
  std::vector<Closed> closed_;
};

/// Rows of thresholds on the difference image, bilinear between the blocks' centres: what is below is dark.
class ThresholdRows {
 public:
  ThresholdRows(const BlockGrid& grid, const BlockDarkness& darkness, int x0, int x1);
  void row(int y, std::uint8_t* level);

 private:
  /// Pixels between the same two block columns.
  struct Span {
    int begin = 0;
    int end = 0;
    int first = 0;
    int second = 0;
  };

  const BlockGrid& grid_;
  const BlockDarkness& darkness_;
  std::vector<Span> spans_;
  std::vector<std::int16_t> share_;   ///< of the second block column, in units of 2^-10, by pixel
  std::vector<std::int32_t> across_;  ///< darkness of the row, by block column
};

}  // namespace cairn::ground
