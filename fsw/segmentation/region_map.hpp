/// A partition of an image into connected regions that can only grow: connecting, then merging.
///
/// Every pixel holds the number of a region, and a disjoint-set forest over the numbers says which of them
/// have become one. The root of a set is its smallest number, so the outcome does not depend on how the links
/// were made. A region's area and sum of grey values live at its root. The adjacency graph needs no memory of
/// its own: two regions are neighbours where two 4-neighbouring pixels differ in their roots, and a scan over
/// the pixels visits every edge.
///
/// Numbers are handed out by connect_row() in scan order; more than kMaxRegionNumbers of them means an image
/// that is mostly noise.
#pragma once

#include <cstddef>
#include <cstdint>

#include "image/image_view.hpp"
#include "mission_cfg.hpp"

namespace cairn {

/// Of 8300 pictures of five terrains most have 8000 at the paper's size, the richest 14,000; noise and
/// texture of a pixel have 20,000.
inline constexpr std::size_t kMaxRegionNumbers = cfg::kImagePixels / cfg::kMission.pixels_per_region < 65535
                                                     ? cfg::kImagePixels / cfg::kMission.pixels_per_region
                                                     : 65535;

/// Above every number.
inline constexpr std::uint16_t kNoRegion = 65535;

class RegionMap {
 public:
  /// Empties the map for an image of this size: at least 1 x 1, at most cfg::kWorkingPixels.
  void clear(int width, int height);

  /// Adds the next row, `y`, of `grey` (rows 0, 1, ... in order): a pixel joins the regions of its upper and
  /// of its left neighbour where the two grey values differ by at most `tolerance`. False: out of region
  /// numbers, and the map is of no use. After the last row, compress() comes first.
  /// Cost: about 4 operations a pixel.
  [[nodiscard]] bool connect_row(const ImageU8& grey, int y, int tolerance);

  /// Makes two different regions (roots) one; its root is the smaller of both, and its mean is up to date.
  std::uint16_t merge(std::uint16_t root_a, std::uint16_t root_b);

  /// Points the numbers in [first, last) directly at their roots and updates the means of the roots among
  /// them. To be called in ascending order over all numbers.
  void compress(int first, int last);

  /// The same for one number whose parent points at its root already, without the mean. Returns the root.
  std::uint16_t shorten(std::uint16_t number) {
    return node_[number].parent = node_[node_[number].parent].parent;
  }

  /// Replaces the numbers of the pixels of row `y` by their roots, which a whole compress() since the last
  /// merge has made known.
  void flatten_row(int y);

  int width() const { return width_; }
  int height() const { return height_; }
  /// How many numbers are in use: every region is among 0 .. numbers() - 1.
  int numbers() const { return numbers_; }
  /// Numbers of the pixels of row `y`, width() of them: roots if flatten_row() has run since the last merge.
  const std::uint16_t* row(int y) const;
  std::uint16_t root_of(std::uint16_t number) const;
  /// Its root, if it points at it directly.
  std::uint16_t parent(std::uint16_t number) const { return node_[number].parent; }
  bool is_root(std::uint16_t number) const { return node_[number].parent == number; }
  std::uint32_t area_px(std::uint16_t root) const { return area_px_[root]; }
  /// Mean grey value in 1/256 of a grey level, rounded down.
  std::uint16_t mean_q8(std::uint16_t root) const { return node_[root].mean_q8; }

 private:
  std::uint16_t link(std::uint16_t root_a, std::uint16_t root_b);
  void update_mean(std::uint16_t root);

  int width_ = 0;
  int height_ = 0;
  int numbers_ = 0;
  std::uint16_t number_[cfg::kWorkingPixels] = {};
  /// Together, as both are asked for.
  struct Node {
    std::uint16_t parent = 0;
    std::uint16_t mean_q8 = 0;
  };
  Node node_[kMaxRegionNumbers] = {};
  std::uint32_t area_px_[kMaxRegionNumbers] = {};
  std::uint32_t sum_grey_[kMaxRegionNumbers] = {};
};

}  // namespace cairn
