#include "detect/block_thresholds.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/assert.hpp"

namespace cairn::ground {
namespace {

constexpr double kLeastOfGlobal = 0.5;
constexpr double kMostOfGlobal = 1.5;
constexpr double kDarknessUnit = 4096.0;
constexpr int kShareUnit = 1024;
constexpr int kRowsAtOnce = 16;  ///< of the difference image, so that a block's counts stay near

/// Median absolute difference, as the standard deviation of the Gaussian that has it.
double texture_sigma(const Histogram& histogram) {
  Histogram magnitude{};
  std::uint64_t total = 0;
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    magnitude[static_cast<std::size_t>(std::abs(static_cast<int>(i) - kLevel))] += histogram[i];
    total += histogram[i];
  }
  const double half = 0.5 * static_cast<double>(total);
  double below = 0.0;
  for (std::size_t i = 0; i < magnitude.size(); ++i) {
    const auto here = static_cast<double>(magnitude[i]);
    if (here > 0.0 && below + here >= half) {  // grey level i stands for i - 0.5 to i + 0.5
      return 1.4826 * std::max(0.0, static_cast<double>(i) - 0.5 + (half - below) / here);
    }
    below += here;
  }
  return 0.0;
}

/// Otsu's threshold as a darkness below the surroundings, in the middle between two grey levels; 1 or more.
/// What is brighter than its surroundings counts as level ground: bright rocks must not draw the split to
/// their own side.
double darkness_threshold(const Histogram& histogram) {
  Histogram folded{};
  for (std::size_t i = 0; i < histogram.size(); ++i) folded[std::min<std::size_t>(i, kLevel)] += histogram[i];
  return std::max(1.0, kLevel - otsu_threshold(folded) - 0.5);
}

/// Where a pixel lies between the centres of two blocks.
struct Between {
  int first = 0;
  int second = 0;
  int share = 0;  ///< of the second, in units of 2^-10
};

/// (i + 1/2) blocks / size - 1/2, in whole numbers, rounded down.
Between between(int i, int blocks, int size) {
  const std::int64_t twice = (2 * static_cast<std::int64_t>(i) + 1) * blocks - size;
  const std::int64_t at = std::clamp<std::int64_t>(twice * kShareUnit / (2 * static_cast<std::int64_t>(size)),
                                                   0, static_cast<std::int64_t>(blocks - 1) * kShareUnit);
  const int first = static_cast<int>(at / kShareUnit);
  return {first, std::min(first + 1, blocks - 1), static_cast<int>(at % kShareUnit)};
}

/// Counts of one block; two of each, so that equal neighbours do not wait for each other.
struct Counts {
  std::uint32_t bin[2][256] = {};
};

void count(const std::uint8_t* difference, const std::uint8_t* missing, std::size_t n, Counts& counts) {
  if (missing != nullptr) {
    for (std::size_t i = 0; i < n; ++i) counts.bin[i & 1][difference[i]] += missing[i] ^ 1U;
    return;
  }
  std::size_t i = 0;
  for (; i + 1 < n; i += 2) {
    ++counts.bin[0][difference[i]];
    ++counts.bin[1][difference[i + 1]];
  }
  if (i < n) ++counts.bin[0][difference[i]];
}

/// Rows of the difference image that wait to be counted.
class RowBatch {
 public:
  explicit RowBatch(std::size_t width)
      : width_(width), difference_(width * kRowsAtOnce), missing_(difference_) {}

  bool full() const { return rows_ == kRowsAtOnce; }
  std::uint8_t* next() { return &difference_[rows_ * width_]; }
  void added(const std::uint8_t* missing) {
    whole_[rows_] = missing == nullptr;
    if (missing != nullptr) std::copy(missing, missing + width_, &missing_[rows_ * width_]);
    ++rows_;
  }
  void count_into(const BlockGrid& grid, int x0, std::vector<Counts>& blocks) {
    const int x1 = x0 + static_cast<int>(width_);
    const int first = grid.column_of(x0);
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      const int column = first + static_cast<int>(b);
      const auto from = static_cast<std::size_t>(std::max(grid.first_x(column), x0) - x0);
      const auto to = static_cast<std::size_t>(std::min(grid.first_x(column + 1), x1) - x0);
      for (std::size_t row = 0; row < rows_; ++row) {
        const std::size_t at = row * width_ + from;
        count(&difference_[at], whole_[row] ? nullptr : &missing_[at], to - from, blocks[b]);
      }
    }
    rows_ = 0;
  }

 private:
  std::size_t width_;
  std::size_t rows_ = 0;
  std::vector<std::uint8_t> difference_;
  std::vector<std::uint8_t> missing_;
  bool whole_[kRowsAtOnce] = {};
};

void put_blocks(const BlockGrid& grid, const PixelBox& tile, int block_row, const std::vector<Counts>& blocks,
                ByteWriter& writer) {
  const int y0 = std::max(grid.first_y(block_row), tile.y0);
  const int y1 = std::min(grid.first_y(block_row + 1), tile.y1);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const int column = grid.column_of(tile.x0) + static_cast<int>(b);
    const int x0 = std::max(grid.first_x(column), tile.x0);
    const int x1 = std::min(grid.first_x(column + 1), tile.x1);
    std::array<std::uint64_t, 256> sum = {};
    for (std::size_t i = 0; i < 256; ++i)
      sum[i] = static_cast<std::uint64_t>(blocks[b].bin[0][i]) + blocks[b].bin[1][i];
    writer.put_number(grid.index(column, block_row));
    writer.put_number(static_cast<std::uint64_t>(x1 - x0) * static_cast<std::uint64_t>(y1 - y0));
    writer.put_counts(sum);
  }
}

}  // namespace

BlockGrid::BlockGrid(int width_px, int height_px, int block_px)
    : width(width_px),
      height(height_px),
      columns(static_cast<int>(
          std::max<std::int64_t>(1, (static_cast<std::int64_t>(width) + block_px / 2) / block_px))),
      rows(static_cast<int>(
          std::max<std::int64_t>(1, (static_cast<std::int64_t>(height) + block_px / 2) / block_px))) {}

Bytes tile_statistics(RasterReader& reader, const GreyRange& range, const RasterFacts& facts,
                      const BlockGrid& grid, int radius, const PixelBox& tile) {
  RowWindow window(reader, range, tile.grown(radius, facts.box()), DifferenceRows::rows_kept(radius),
                   facts.all_valid);
  DifferenceRows difference(window, tile, facts.box(), radius);
  const auto inset = static_cast<std::size_t>(tile.x0 - window.box().x0);
  const auto width = static_cast<std::size_t>(tile.width());
  GreyContent content;
  Bytes of_blocks;
  ByteWriter writer(of_blocks);
  RowBatch batch(width);
  std::vector<Counts> blocks(
      static_cast<std::size_t>(grid.column_of(tile.x1 - 1) - grid.column_of(tile.x0) + 1));
  for (int y = tile.y0; y < tile.y1; ++y) {
    difference.next(batch.next());
    const std::uint8_t* const missing = difference.missing_of_last();
    batch.added(missing);
    content.add(window.grey(y) + inset, missing, width);
    const bool ends_block = y + 1 == tile.y1 || grid.row_of(y + 1) != grid.row_of(y);
    if (ends_block || batch.full()) batch.count_into(grid, tile.x0, blocks);
    if (!ends_block) continue;
    put_blocks(grid, tile, grid.row_of(y), blocks, writer);
    std::fill(blocks.begin(), blocks.end(), Counts());
  }
  Bytes bytes;
  ByteWriter whole(bytes);
  whole.put(content);
  whole.put_bytes(of_blocks.data(), of_blocks.size());
  return bytes;
}

BlockStatistics::BlockStatistics(const BlockGrid& grid) : grid_(grid), closed_(grid.index(0, grid.rows)) {}

void BlockStatistics::add(const Bytes& tile) {
  ByteReader reader(tile);
  content_.add(reader.get<GreyContent>());
  while (reader.left() > 0) {
    const auto index = static_cast<std::size_t>(reader.get_number());
    if (index >= closed_.size())
      throw ToolError("partial state: no such block; remove the file and run again");
    Open& block = open_[index];
    block.pixels += reader.get_number();
    reader.add_counts(block.histogram);
    const int column = static_cast<int>(index % static_cast<std::size_t>(grid_.columns));
    const int row = static_cast<int>(index / static_cast<std::size_t>(grid_.columns));
    const std::uint64_t all = static_cast<std::uint64_t>(grid_.first_x(column + 1) - grid_.first_x(column)) *
                              static_cast<std::uint64_t>(grid_.first_y(row + 1) - grid_.first_y(row));
    if (block.pixels < all) continue;
    closed_[index] = {darkness_threshold(block.histogram), texture_sigma(block.histogram)};
    for (std::size_t i = 0; i < whole_.size(); ++i) whole_[i] += block.histogram[i];
    open_.erase(index);
  }
}

BlockDarkness BlockStatistics::finish(const ThresholdParams& params, const std::string& name) const {
  CAIRN_ASSERT(open_.empty());
  content_.check(name);
  const double global = darkness_threshold(whole_);
  const double whole_sigma = texture_sigma(whole_);
  BlockDarkness darkness;
  darkness.reserve(closed_.size());
  for (const Closed& block : closed_) {
    const double own = std::clamp(block.darkness, kLeastOfGlobal * global, kMostOfGlobal * global);
    const double sigma = std::min(block.sigma, whole_sigma);
    const double level = std::max({params.threshold_scale * own, params.noise_sigmas * sigma, 1.0});
    darkness.push_back(static_cast<std::int32_t>(std::lround(kDarknessUnit * std::min(level, 128.0))));
  }
  return darkness;
}

ThresholdRows::ThresholdRows(const BlockGrid& grid, const BlockDarkness& darkness, int x0, int x1)
    : grid_(grid), darkness_(darkness), across_(static_cast<std::size_t>(grid.columns)) {
  for (int x = x0; x < x1; ++x) {
    const Between u = between(x, grid.columns, grid.width);
    share_.push_back(static_cast<std::int16_t>(u.share));
    if (spans_.empty() || spans_.back().first != u.first)
      spans_.push_back({x - x0, x - x0, u.first, u.second});
    ++spans_.back().end;
  }
}

void ThresholdRows::row(int y, std::uint8_t* level) {
  const Between v = between(y, grid_.rows, grid_.height);
  for (int column = spans_.front().first; column <= spans_.back().second; ++column) {
    const std::int32_t above = darkness_[grid_.index(column, v.first)];
    const std::int32_t below = darkness_[grid_.index(column, v.second)];
    across_[static_cast<std::size_t>(column)] = above + (below - above) * v.share / kShareUnit;
  }
  for (const Span& span : spans_) {
    rows::levels(across_[static_cast<std::size_t>(span.first)],
                 across_[static_cast<std::size_t>(span.second)],
                 &share_[static_cast<std::size_t>(span.begin)], level + span.begin,
                 static_cast<std::size_t>(span.end - span.begin));
  }
}

}  // namespace cairn::ground
