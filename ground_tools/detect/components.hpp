/// Connected components of a mask that comes in tiles: found run by run within a tile, joined across borders.
///
/// The result is that of the whole mask at once, whatever the tiles: a component is a set of sums of integers
/// in the image's coordinates, and its name is its first pixel.
#pragma once

#include <cstdint>
#include <vector>

#include "base/byte_stream.hpp"
#include "ortho/pixel_box.hpp"

namespace cairn::ground {

/// Second moments of components in images of a million pixels a side need more than 64 bits.
__extension__ using WideSum = unsigned __int128;

/// One 8-connected component of a mask, as sums from which centroid and second moments follow.
struct Component {
  std::uint64_t area_px = 0;
  std::uint64_t sum_x = 0;
  std::uint64_t sum_y = 0;
  std::uint64_t sum_value = 0;  ///< of a second image over the component
  WideSum sum_xx = 0;
  WideSum sum_xy = 0;
  WideSum sum_yy = 0;
  int min_x = 0;
  int min_y = 0;
  int max_x = 0;
  int max_y = 0;
  int first_x = 0;  ///< of the pixels in row min_y

  double mean_x() const { return static_cast<double>(sum_x) / static_cast<double>(area_px); }
  double mean_y() const { return static_cast<double>(sum_y) / static_cast<double>(area_px); }
  /// Becomes both together.
  void add(const Component& other);
};

/// By first pixel, row by row: an order that tiles have no part in.
inline bool comes_first(const Component& a, const Component& b) {
  return a.min_y != b.min_y ? a.min_y < b.min_y : a.first_x < b.first_x;
}

/// Disjoint sets of components; each root holds the sums of its set.
class ComponentForest {
 public:
  std::uint32_t add(const Component& sums = {});
  std::uint32_t root(std::uint32_t i);
  /// Gives the root of both together.
  std::uint32_t join(std::uint32_t a, std::uint32_t b);
  Component& sums(std::uint32_t i) { return sums_[root(i)]; }
  std::uint32_t size() const { return static_cast<std::uint32_t>(parent_.size()); }

 private:
  std::vector<std::uint32_t> parent_;
  std::vector<Component> sums_;
};

/// Pixels from `begin` to before `end` of a row or a column, of one component.
struct BorderRun {
  int begin = 0;
  int end = 0;
  std::uint32_t component = 0;
};

/// What a tile holds: components that end within it, and those that touch a border with another tile.
struct TileComponents {
  std::vector<Component> closed;
  std::vector<Component> open;
  std::vector<BorderRun> top;  ///< along the borders with other tiles; indices into `open`
  std::vector<BorderRun> bottom;
  std::vector<BorderRun> left;
  std::vector<BorderRun> right;
};

/// The 8-connected components of the ones in a tile's mask. Rows come in order; memory grows with the runs of
/// two rows and with the components.
class TileLabeller {
 public:
  TileLabeller(const PixelBox& tile, const PixelBox& image);

  /// The next row of the tile: zeros and ones, and the image whose values are summed.
  void push(const std::uint8_t* mask, const std::uint8_t* values);
  /// After the last row. Both lists come in the order of first pixels.
  TileComponents finish();

 private:
  void place(BorderRun& run, std::size_t& candidate);
  void note_border(const std::vector<BorderRun>& runs);

  PixelBox tile_;
  PixelBox image_;
  int y_;
  ComponentForest forest_;
  std::vector<BorderRun> above_;
  std::vector<BorderRun> here_;
  TileComponents found_;  ///< its borders, while the rows come in
};

/// Joins the tiles of an image, which come row by row, from left to right.
class TileJoiner {
 public:
  /// The next tile's open components and borders.
  void add(const TileComponents& tile, bool starts_row);
  /// After the last tile: the components that lie in more than one tile, or touch a border.
  std::vector<Component> finish();

 private:
  void join_along(const std::vector<BorderRun>& a, const std::vector<BorderRun>& b);
  void end_row();

  ComponentForest forest_;
  std::vector<BorderRun> bottom_above_;  ///< of the whole row of tiles above
  std::vector<BorderRun> top_;           ///< of this row so far
  std::vector<BorderRun> bottom_;
  std::vector<BorderRun> right_;  ///< of the tile before
};

}  // namespace cairn::ground
