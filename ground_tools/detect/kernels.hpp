/// The image kernels of the paper's orbital detector (METHOD B.1), written here and checked against OpenCV's.
///
/// Each takes the rows of a tile one after another and gives rows, so that a tile needs no more memory than
/// the rows that its windows span. What a pixel gets depends on its surroundings in the image alone: not on
/// the tile that it is computed in. Sums are integers; running sums make the cost independent
/// of the windows' sizes.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "ortho/pixel_box.hpp"
#include "ortho/raster_source.hpp"

namespace cairn::ground {

using Histogram = std::array<std::uint64_t, 256>;

/// Otsu's threshold (IEEE Trans. SMC 9(1), 1979): the value up to which, inclusive, a pixel belongs to the
/// dark class so that the variance between the classes is largest; the lowest of equally good ones. Splits
/// pixels as cv::threshold with THRESH_OTSU does. A histogram of one value gives that value. O(256).
int otsu_threshold(const Histogram& histogram);

/// The rows of a box of the image, read in order and kept while a window of `rows_kept` rows needs them.
class RowWindow {
 public:
  RowWindow(RasterReader& reader, const GreyRange& range, const PixelBox& box, int rows_kept, bool all_valid);

  const PixelBox& box() const { return box_; }
  /// Row `y` of the image, columns of the box; reads on where it was not read yet. Rows older than
  /// `rows_kept` before the newest are gone.
  const std::uint8_t* grey(int y);
  /// 1 where there is no data; null where the row is whole.
  const std::uint8_t* missing(int y);

 private:
  void read_to(int y);
  std::size_t slot(int y) const { return static_cast<std::size_t>((y - box_.y0) % rows_); }

  RasterReader& reader_;
  GreyRange range_;
  PixelBox box_;
  bool all_valid_;
  int rows_;      ///< in the ring, a multiple of what is read at once
  int next_row_;  ///< first that was not read
  std::size_t width_;
  std::vector<std::uint8_t> grey_;
  std::vector<std::uint8_t> missing_;
  std::vector<std::uint8_t> has_missing_;
};

/// The largest radius that DifferenceRows takes: its sums stay within 31 bits.
inline constexpr int kMostRadiusPx = 1400;

/// Difference of each pixel from the mean of its surroundings, plus 128, clamped to 0..255 (128 where there
/// is no data). The mean, rounded, is that of the valid pixels of the square of 2 `radius` + 1 pixels that
/// lie in the image.
class DifferenceRows {
 public:
  /// Rows and columns of `box`, first `box.y0`; `rows` covers box.grown(radius, image).
  DifferenceRows(RowWindow& rows, const PixelBox& box, const PixelBox& image, int radius);
  /// How many rows the window must keep.
  static int rows_kept(int radius) { return 2 * radius + 2; }

  /// The next row, box.width() pixels.
  void next(std::uint8_t* out);
  /// No data in that row: 1 where it is missing; null where the row is whole.
  const std::uint8_t* missing_of_last();

 private:
  void slide_to(int y);
  void full_counts(int rows);
  void means(int y);

  RowWindow& rows_;
  PixelBox box_;
  PixelBox image_;
  int radius_;
  int y_;    ///< next row
  int top_;  ///< rows in the sums: top_ to before bottom_
  int bottom_;
  int counted_ = 0;                    ///< rows that counts_ are of
  int gone_rows_ = 0;                  ///< rows in the sums that have missing pixels
  std::vector<std::uint32_t> sums_;    ///< of grey, by column
  std::vector<std::uint32_t> gone_;    ///< missing pixels, by column
  std::vector<std::uint32_t> prefix_;  ///< of sums_, ends repeated so that windows may lie outside
  std::vector<std::uint32_t> gone_prefix_;
  std::vector<std::int32_t> columns_;  ///< of the image in each pixel's window
  std::vector<double> half_;           ///< half the count, rounded down, and a half more
  std::vector<double> inverse_;        ///< one over the count
  std::vector<std::uint8_t> mean_;
};

/// Median filter of side 2 `radius` + 1, at most 15, on rows of zeros and ones; the image's border is
/// replicated, as in cv::medianBlur.
class MedianRows {
 public:
  static constexpr int kMostRadius = 7;
  /// Gives the rows of `box`; takes those of box.grown(radius, image).
  MedianRows(const PixelBox& box, const PixelBox& image, int radius);

  /// The next row, zeros and ones.
  void push(const std::uint8_t* row);
  /// True where the rows so far are enough for the next row of the result.
  bool ready() const;
  void pop(std::uint8_t* out);

 private:
  const std::uint8_t* row(int y) const;
  void change(int y, int sign);

  PixelBox box_;
  PixelBox from_;  ///< rows and columns that come in
  int radius_;
  int next_in_;
  int next_out_;
  bool filled_ = false;
  std::size_t width_;  ///< of a row with its border
  std::vector<std::uint8_t> ring_;
  std::vector<std::uint8_t> counts_;
  std::array<std::vector<std::uint8_t>, 3> partial_;  ///< sums of 2, 4 and 8 neighbours
};

// Row by row, on plain memory (row_kernels.cpp, compiled for speed).
namespace rows {

void add(std::uint32_t* sums, const std::uint8_t* row, std::size_t n);
void subtract(std::uint32_t* sums, const std::uint8_t* row, std::size_t n);
void slide(std::uint32_t* sums, const std::uint8_t* enters, const std::uint8_t* leaves, std::size_t n);
/// prefix[0] stays; prefix[i + 1] = prefix[i] + sums[i].
void prefix(const std::uint32_t* sums, std::uint32_t* prefix, std::size_t n);
/// mean[i] = (prefix[i + span] - prefix[i] + half count) / count, rounded down.
void means(const std::uint32_t* prefix, std::size_t span, const double* half, const double* inverse,
           std::uint8_t* mean, std::size_t n);
/// The same with a count for each pixel: full[i] columns times rows, less the missing.
void means_of_valid(const std::uint32_t* prefix, const std::uint32_t* gone_prefix, std::size_t span,
                    const std::int32_t* columns, std::int32_t rows, std::uint8_t* mean, std::size_t n);
void differences(const std::uint8_t* grey, const std::uint8_t* mean, std::uint8_t* out, std::size_t n);
void put_level(const std::uint8_t* missing, std::uint8_t* out, std::size_t n);
/// 1 where the difference lies below the level.
void darker(const std::uint8_t* difference, const std::uint8_t* level, std::uint8_t* out, std::size_t n);
/// Levels between two darknesses (in units of 2^-12, at most 128), shares in units of 2^-10.
void levels(std::int32_t first, std::int32_t second, const std::int16_t* share, std::uint8_t* level,
            std::size_t n);
void add_bytes(std::uint8_t* counts, const std::uint8_t* row, std::size_t n);
void subtract_bytes(std::uint8_t* counts, const std::uint8_t* row, std::size_t n);
/// 1 where the sum of `side` counts from i on is more than half of side * side.
void majority(const std::uint8_t* counts, int side, std::uint8_t* two, std::uint8_t* four,
              std::uint8_t* eight, std::uint8_t* out, std::size_t n);

}  // namespace rows

}  // namespace cairn::ground
