#include "detect/components.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace cairn::ground {
namespace {

/// Sums of the pixels begin to before end of row y: with b the first column and n pixels, the squares of
/// b .. b + n - 1 add up to n b^2 + b n (n - 1) + (n - 1) n (2n - 1) / 6.
Component sums_of_run(int begin, int end, int y, const std::uint8_t* values) {
  Component c;
  c.min_x = c.first_x = begin;
  c.max_x = end - 1;
  c.min_y = c.max_y = y;
  const auto b = static_cast<std::uint64_t>(begin);
  const auto n = static_cast<std::uint64_t>(end - begin);
  const auto row = static_cast<std::uint64_t>(y);
  c.area_px = n;
  c.sum_x = n * b + n * (n - 1) / 2;
  c.sum_y = n * row;
  c.sum_xx = static_cast<WideSum>(n * b) * b + static_cast<WideSum>(b) * (n * (n - 1)) +
             (n - 1) * n * (2 * n - 1) / 6;
  c.sum_xy = static_cast<WideSum>(row) * c.sum_x;
  c.sum_yy = static_cast<WideSum>(c.sum_y) * row;
  for (std::uint64_t i = 0; i < n; ++i) c.sum_value += values[i];
  return c;
}

/// Pairs of runs on two neighbouring lines that touch, at corners too. Both lists are sorted.
template <typename Touch>
void for_each_touching(const std::vector<BorderRun>& a, const std::vector<BorderRun>& b, const Touch& touch) {
  std::size_t first = 0;
  for (const BorderRun& run : b) {
    while (first < a.size() && a[first].end < run.begin) ++first;
    for (std::size_t i = first; i < a.size() && a[i].begin <= run.end; ++i) touch(a[i], run);
  }
}

}  // namespace

void Component::add(const Component& other) {
  if (other.area_px == 0) return;
  if (area_px == 0) {
    *this = other;
    return;
  }
  if (comes_first(other, *this)) first_x = other.first_x;
  area_px += other.area_px;
  sum_x += other.sum_x;
  sum_y += other.sum_y;
  sum_value += other.sum_value;
  sum_xx += other.sum_xx;
  sum_xy += other.sum_xy;
  sum_yy += other.sum_yy;
  min_x = std::min(min_x, other.min_x);
  min_y = std::min(min_y, other.min_y);
  max_x = std::max(max_x, other.max_x);
  max_y = std::max(max_y, other.max_y);
}

std::uint32_t ComponentForest::add(const Component& sums) {
  parent_.push_back(size());
  sums_.push_back(sums);
  return size() - 1;
}

std::uint32_t ComponentForest::root(std::uint32_t i) {
  while (parent_[i] != i) {
    parent_[i] = parent_[parent_[i]];  // path halving
    i = parent_[i];
  }
  return i;
}

std::uint32_t ComponentForest::join(std::uint32_t a, std::uint32_t b) {
  a = root(a);
  b = root(b);
  if (a == b) return a;
  if (b < a) std::swap(a, b);
  parent_[b] = a;
  sums_[a].add(sums_[b]);
  return a;
}

TileLabeller::TileLabeller(const PixelBox& tile, const PixelBox& image)
    : tile_(tile), image_(image), y_(tile.y0) {}

/// Joins a run to those above it that it touches. Runs come from left to right, so that those above that end
/// before it are passed for good.
void TileLabeller::place(BorderRun& run, std::size_t& candidate) {
  while (candidate < above_.size() && above_[candidate].end < run.begin) ++candidate;
  bool placed = false;
  for (std::size_t i = candidate; i < above_.size() && above_[i].begin <= run.end; ++i) {
    run.component =
        placed ? forest_.join(run.component, above_[i].component) : forest_.root(above_[i].component);
    placed = true;
  }
  if (!placed) run.component = forest_.add();
}

void TileLabeller::push(const std::uint8_t* mask, const std::uint8_t* values) {
  const auto width = static_cast<std::size_t>(tile_.width());
  here_.clear();
  std::size_t candidate = 0;
  for (std::size_t x = 0; x < width;) {
    const auto* const begin = static_cast<const std::uint8_t*>(std::memchr(mask + x, 1, width - x));
    if (begin == nullptr) break;
    const auto from = static_cast<std::size_t>(begin - mask);
    const auto* const end = static_cast<const std::uint8_t*>(std::memchr(begin, 0, width - from));
    x = end == nullptr ? width : static_cast<std::size_t>(end - mask);
    BorderRun run{tile_.x0 + static_cast<int>(from), tile_.x0 + static_cast<int>(x), 0};
    place(run, candidate);
    forest_.sums(run.component).add(sums_of_run(run.begin, run.end, y_, values + from));
    here_.push_back(run);
  }
  note_border(here_);
  above_.swap(here_);
  ++y_;
}

void TileLabeller::note_border(const std::vector<BorderRun>& runs) {
  if (y_ == tile_.y0 && tile_.y0 > image_.y0) found_.top = runs;
  if (y_ == tile_.y1 - 1 && tile_.y1 < image_.y1) found_.bottom = runs;
  if (runs.empty()) return;
  const auto grow = [this](std::vector<BorderRun>& side, std::uint32_t component) {
    if (!side.empty() && side.back().end == y_) {
      forest_.join(side.back().component, component);  // vertical neighbours: the same component anyway
      ++side.back().end;
    } else {
      side.push_back({y_, y_ + 1, component});
    }
  };
  if (tile_.x0 > image_.x0 && runs.front().begin == tile_.x0) grow(found_.left, runs.front().component);
  if (tile_.x1 < image_.x1 && runs.back().end == tile_.x1) grow(found_.right, runs.back().component);
}

TileComponents TileLabeller::finish() {
  constexpr std::uint32_t kClosed = ~0U;
  constexpr std::uint32_t kOpen = ~0U - 1;
  std::vector<std::uint32_t> name(forest_.size(), kClosed);
  const auto sides = {&found_.top, &found_.bottom, &found_.left, &found_.right};
  for (std::vector<BorderRun>* side : sides) {
    for (BorderRun& run : *side) {
      run.component = forest_.root(run.component);
      name[run.component] = kOpen;
    }
  }
  std::vector<std::uint32_t> roots;
  for (std::uint32_t i = 0; i < forest_.size(); ++i) {
    if (forest_.root(i) == i) roots.push_back(i);
  }
  std::sort(roots.begin(), roots.end(), [this](std::uint32_t a, std::uint32_t b) {
    return comes_first(forest_.sums(a), forest_.sums(b));
  });
  for (const std::uint32_t i : roots) {
    if (name[i] == kClosed) {
      found_.closed.push_back(forest_.sums(i));
    } else {
      name[i] = static_cast<std::uint32_t>(found_.open.size());
      found_.open.push_back(forest_.sums(i));
    }
  }
  for (std::vector<BorderRun>* side : sides) {
    for (BorderRun& run : *side) run.component = name[run.component];
  }
  return std::move(found_);
}

void TileJoiner::join_along(const std::vector<BorderRun>& a, const std::vector<BorderRun>& b) {
  for_each_touching(
      a, b, [this](const BorderRun& p, const BorderRun& q) { forest_.join(p.component, q.component); });
}

/// Rows of tiles meet along whole rows of the image, so that tiles that share but a corner meet, too.
void TileJoiner::end_row() {
  join_along(bottom_above_, top_);
  bottom_above_.swap(bottom_);
  bottom_.clear();
  top_.clear();
  right_.clear();
}

void TileJoiner::add(const TileComponents& tile, bool starts_row) {
  if (starts_row) end_row();
  const std::uint32_t base = forest_.size();
  for (const Component& c : tile.open) forest_.add(c);
  const auto renamed = [base](std::vector<BorderRun> runs) {
    for (BorderRun& run : runs) run.component += base;
    return runs;
  };
  join_along(right_, renamed(tile.left));
  right_ = renamed(tile.right);
  for (const BorderRun& run : renamed(tile.top)) top_.push_back(run);
  for (const BorderRun& run : renamed(tile.bottom)) bottom_.push_back(run);
}

std::vector<Component> TileJoiner::finish() {
  end_row();
  std::vector<Component> joined;
  for (std::uint32_t i = 0; i < forest_.size(); ++i) {
    if (forest_.root(i) == i) joined.push_back(forest_.sums(i));
  }
  return joined;
}

}  // namespace cairn::ground
