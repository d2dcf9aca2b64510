#include "segmentation/region_map.hpp"

#include "core/assert.hpp"

namespace cairn {

void RegionMap::clear(int width, int height) {
  CAIRN_ASSERT(width >= 1 && height >= 1);
  CAIRN_ASSERT(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) <= cfg::kWorkingPixels);
  width_ = width;
  height_ = height;
  numbers_ = 0;
}

bool RegionMap::connect_row(const ImageU8& grey, int y, int tolerance) {
  CAIRN_ASSERT(grey.width == width_ && grey.height == height_);
  const std::uint8_t* here = grey.row(y);
  const std::uint8_t* above = y > 0 ? grey.row(y - 1) : nullptr;
  std::uint16_t* number = &number_[y * width_];
  // |a - b| <= tolerance, in one comparison.
  const auto near = [tolerance](int a, int b) {
    return static_cast<unsigned>(a - b + tolerance) <= static_cast<unsigned>(2 * tolerance);
  };
  std::uint16_t root = kNoRegion;        // of the run of pixels under way
  std::uint16_t last_above = kNoRegion;  // a number above it, of the same root
  std::uint32_t area_px = 0;             // of the run, not yet counted
  std::uint32_t sum_grey = 0;
  const auto count_run = [&] {
    if (root == kNoRegion) return;
    area_px_[root] += area_px;
    sum_grey_[root] += sum_grey;
    area_px = sum_grey = 0;
  };
  for (int x = 0; x < width_; ++x) {
    if (x > 0 && !near(here[x], here[x - 1])) {
      count_run();
      root = last_above = kNoRegion;
    }
    if (above != nullptr && near(here[x], above[x]) && number[x - width_] != last_above) {
      last_above = number[x - width_];
      const std::uint16_t root_above = root_of(last_above);
      if (root != root_above) {
        count_run();
        root = root == kNoRegion ? root_above : link(root, root_above);
      }
    }
    if (root == kNoRegion) {
      if (numbers_ == static_cast<int>(kMaxRegionNumbers)) return false;
      root = static_cast<std::uint16_t>(numbers_++);
      node_[root].parent = root;
      area_px_[root] = 0;
      sum_grey_[root] = 0;
    }
    number[x] = root;
    ++area_px;
    sum_grey += here[x];
  }
  count_run();
  return true;
}

std::uint16_t RegionMap::merge(std::uint16_t root_a, std::uint16_t root_b) {
  CAIRN_ASSERT(root_a != root_b && is_root(root_a) && is_root(root_b));
  const std::uint16_t root = link(root_a, root_b);
  update_mean(root);
  return root;
}

void RegionMap::compress(int first, int last) {
  CAIRN_ASSERT(first >= 0 && last <= numbers_);
  // A parent is smaller than its child, so that it has been pointed at its root already.
  for (int i = first; i < last; ++i) {
    const auto number = static_cast<std::uint16_t>(i);
    node_[number].parent = node_[node_[number].parent].parent;
    if (is_root(number)) update_mean(number);
  }
}

void RegionMap::flatten_row(int y) {
  CAIRN_ASSERT(y >= 0 && y < height_);
  std::uint16_t* number = &number_[y * width_];
  for (int x = 0; x < width_; ++x) number[x] = node_[number[x]].parent;
}

const std::uint16_t* RegionMap::row(int y) const {
  CAIRN_ASSERT(y >= 0 && y < height_);
  return &number_[y * width_];
}

std::uint16_t RegionMap::root_of(std::uint16_t number) const {
  while (node_[number].parent != number) number = node_[number].parent;
  return number;
}

/// Joins two roots, which may be one and the same.
std::uint16_t RegionMap::link(std::uint16_t root_a, std::uint16_t root_b) {
  if (root_a == root_b) return root_a;
  const std::uint16_t root = root_a < root_b ? root_a : root_b;
  const std::uint16_t child = root_a < root_b ? root_b : root_a;
  node_[child].parent = root;
  area_px_[root] += area_px_[child];
  sum_grey_[root] += sum_grey_[child];
  return root;
}

// Fits 32 bits: an area is below 2^23, a sum of grey values below 2^31.
void RegionMap::update_mean(std::uint16_t root) {
  const std::uint32_t area = area_px_[root];
  const std::uint32_t whole = sum_grey_[root] / area;
  const std::uint32_t rest = sum_grey_[root] - whole * area;
  node_[root].mean_q8 = static_cast<std::uint16_t>((whole << 8) + (rest << 8) / area);
}

}  // namespace cairn
