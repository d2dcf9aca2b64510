#include "detect/shadow_spots.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace cairn::ground {
namespace {

constexpr int kNearRadius = 1;  ///< of the mean that is a spot
constexpr int kFarRadius = 8;   ///< of the mean around it
constexpr int kMaximumRadius = 2;
constexpr int kLeastStep_dn = 3;
static_assert(kSpotReach_px == kFarRadius + kMaximumRadius);

int half_up(int x) { return (x + 1) >> 1; }

/// Two rows of the level before, from the first pixel that has all of its block.
struct RowPair {
  const std::uint8_t* a;
  const std::uint8_t* b;
};

void mean_row(const RowPair& grey, int width, std::uint8_t* out) {
  const std::uint8_t* a = grey.a;
  const std::uint8_t* b = grey.b;
  for (int x = 0; x < width; ++x)
    out[x] = static_cast<std::uint8_t>((a[2 * x] + a[2 * x + 1] + b[2 * x] + b[2 * x + 1] + 2) >> 2);
}

void mean_row_of_valid(const RowPair& grey, const RowPair& valid, int width, std::uint8_t* out,
                       std::uint8_t* valid_out) {
  for (int x = 0; x < width; ++x) {
    int n = 0;
    int sum = 0;
    const auto add = [&](int g, int v) {
      if (v == 0) return;
      ++n;
      sum += g;
    };
    add(grey.a[2 * x], valid.a[2 * x]);
    add(grey.a[2 * x + 1], valid.a[2 * x + 1]);
    add(grey.b[2 * x], valid.b[2 * x]);
    add(grey.b[2 * x + 1], valid.b[2 * x + 1]);
    valid_out[x] = n > 0 ? 255 : 0;
    out[x] = static_cast<std::uint8_t>(n > 0 ? (sum + n / 2) / n : 0);
  }
}

/// Sums over columns of valid pixels, and how many those are, kRadius up and down from a row: from one row
/// after the other.
template <int kRadius>
class ColumnSums {
 public:
  static constexpr std::uint32_t kWhole = (2 * kRadius + 1) * (2 * kRadius + 1);

  ColumnSums(const GreyTile& tile, int first_row)
      : grey_(tile.grey), valid_(tile.valid), row_(first_row - 1) {
    sum_.resize(static_cast<std::size_t>(grey_.width));
    count_.resize(sum_.size());
    for (int y = std::max(0, row_ - kRadius); y <= std::min(grey_.height - 1, row_ + kRadius); ++y)
      add(y, 1U);
  }
  /// False: all counts are as they were.
  bool next_row() {
    ++row_;
    const bool loses = row_ - kRadius > 0;
    const bool gains = row_ + kRadius < grey_.height;
    if (loses) add(row_ - kRadius - 1, ~0U);
    if (gains) add(row_ + kRadius, 1U);
    return loses != gains || valid_.data != nullptr;
  }
  /// Mean in 1/16 levels of the box around column x of the row, which may lack pixels; false: it has none.
  bool mean16(int x, std::uint32_t& mean) const {
    std::uint32_t sum = 0;
    std::uint32_t count = 0;
    for (int u = std::max(0, x - kRadius); u <= std::min(grey_.width - 1, x + kRadius); ++u) {
      sum += sum_[static_cast<std::size_t>(u)];
      count += count_[static_cast<std::size_t>(u)];
    }
    if (count != 0) mean = 16 * sum / count;
    return count != 0;
  }
  /// Of the columns from x on.
  const std::uint32_t* sums(int x) const { return &sum_[static_cast<std::size_t>(x)]; }

 protected:
  using Row = std::vector<std::uint32_t>;
  Row sum_, count_;

 private:
  void add(int y, std::uint32_t times) {
    const std::uint8_t* const g = grey_.row(y);
    std::uint32_t* const sum = sum_.data();
    std::uint32_t* const count = count_.data();
    const std::size_t n = sum_.size();
    if (valid_.data == nullptr) {
      for (std::size_t x = 0; x < n; ++x) sum[x] += times * g[x];
      for (std::size_t x = 0; x < n; ++x) count[x] += times;
      return;
    }
    const std::uint8_t* const v = valid_.row(y);
    for (std::size_t x = 0; x < n; ++x) {
      const std::uint32_t m = v[x] != 0 ? times : 0U;
      sum[x] += m * g[x];
      count[x] += m;
    }
  }

  ImageU8 grey_, valid_;
  int row_;
};

using NearSums = ColumnSums<kNearRadius>;

/// And over what precedes along the row, so that a box costs one difference however wide it is.
class FarSums : public ColumnSums<kFarRadius> {
 public:
  using ColumnSums::ColumnSums;

  void next_row() {
    const bool counts_change = ColumnSums::next_row();
    add_along(sum_, sums_);
    if (counts_.empty() || counts_change) count_boxes();
  }
  /// Of boxes kFarRadius and more from the image's sides.
  bool all_whole() const { return all_whole_; }
  bool is_whole(int x) const {
    const auto from = static_cast<std::size_t>(x - kFarRadius);
    return counts_[from + kSide] - counts_[from] == kWhole;
  }
  /// Before the boxes of the columns from x on; their ends are kSide farther.
  const std::uint32_t* before(int x) const { return &sums_[static_cast<std::size_t>(x - kFarRadius)]; }
  static constexpr std::size_t kSide = 2 * kFarRadius + 1;

 private:
  static void add_along(const Row& column, Row& along) {
    along.resize(column.size() + 1);
    std::uint32_t total = 0;
    for (std::size_t x = 0; x < column.size(); ++x) {
      along[x] = total;
      total += column[x];
    }
    along.back() = total;
  }
  void count_boxes() {
    add_along(count_, counts_);
    std::uint32_t missing = 0;
    for (std::size_t x = kSide; x < counts_.size(); ++x)
      missing |= (counts_[x] - counts_[x - kSide]) ^ kWhole;
    all_whole_ = missing == 0;
  }

  bool all_whole_ = false;
  Row sums_, counts_;  ///< along the row, exclusive
};

/// Darkness of spots below their surroundings in 1/16 grey levels, row by row; 0 where it is less than asked
/// for. Of the rows the last five are there.
class DarkRows {
 public:
  static constexpr int kKept = 2 * kMaximumRadius + 1;

  DarkRows(const GreyTile& tile, const PixelRect& where, double least_share)
      : near_(tile, where.y0),
        far_(tile, where.y0),
        x0_(where.x0),
        width_(tile.grey.width),
        share_(static_cast<std::uint32_t>(std::lround(least_share * 256.0))) {
    for (auto& row : rows_) row.resize(static_cast<std::size_t>(where.width));
  }
  /// As if all boxes were whole, by vectors; then again where one is not.
  void next_row() {
    near_.next_row();
    far_.next_row();
    std::vector<std::uint16_t>& dark = rows_[static_cast<std::size_t>(++y_ % kKept)];
    const int end = x0_ + static_cast<int>(dark.size());
    const int first = std::min(std::max(x0_, kFarRadius), end);
    const int last = std::max(first, std::min(end, width_ - kFarRadius));
    for (int x = x0_; x < first; ++x) dark[static_cast<std::size_t>(x - x0_)] = of_part(x);
    if (first < last) {
      of_whole(first, static_cast<std::size_t>(last - first), &dark[static_cast<std::size_t>(first - x0_)]);
      if (!far_.all_whole())
        for (int x = first; x < last; ++x)
          if (!far_.is_whole(x)) dark[static_cast<std::size_t>(x - x0_)] = of_part(x);
    }
    for (int x = last; x < end; ++x) dark[static_cast<std::size_t>(x - x0_)] = of_part(x);
  }
  const std::uint16_t* row(int y) const { return rows_[static_cast<std::size_t>(y % kKept)].data(); }

 private:
  static std::uint16_t darkness(std::uint32_t spot, std::uint32_t ground, std::uint32_t share) {
    const bool dark = spot + ground * share / 256 < ground && spot + 16 * kLeastStep_dn < ground;
    return static_cast<std::uint16_t>(dark ? ground - spot : 0U);
  }
  std::uint16_t of_part(int x) const {
    std::uint32_t spot, ground;
    return near_.mean16(x, spot) && far_.mean16(x, ground) ? darkness(spot, ground, share_) : 0;
  }
  void of_whole(int x, std::size_t count, std::uint16_t* dark) const {
    static_assert(kNearRadius == 1);
    const std::uint32_t* const near = near_.sums(x - 1);
    const std::uint32_t* const far = far_.before(x);
    const std::uint32_t share = share_;
    for (std::size_t i = 0; i < count; ++i)
      dark[i] = darkness(16 * (near[i] + near[i + 1] + near[i + 2]) / NearSums::kWhole,
                         16 * (far[i + FarSums::kSide] - far[i]) / FarSums::kWhole, share);
  }

  NearSums near_;
  FarSums far_;
  int x0_;
  int width_;
  std::uint32_t share_;
  int y_ = -1;
  std::array<std::vector<std::uint16_t>, kKept> rows_;
};

/// Maximum over 5 x 5; of equals, the first by row and column.
bool is_maximum(const DarkRows& dark, const PixelRect& where, int x, int y) {
  const std::uint16_t here = dark.row(y)[x];
  for (int v = std::max(0, y - kMaximumRadius); v <= std::min(where.height - 1, y + kMaximumRadius); ++v) {
    const std::uint16_t* const row = dark.row(v);
    for (int u = std::max(0, x - kMaximumRadius); u <= std::min(where.width - 1, x + kMaximumRadius); ++u) {
      const std::uint16_t other = row[u];
      const bool earlier = v < y || (v == y && u < x);
      if (other > here || (earlier && other == here)) return false;
    }
  }
  return true;
}

}  // namespace

PyramidLevel halved(const PyramidLevel& level) {
  const ImageU8& grey = level.tile.grey;
  const ImageU8& valid = level.tile.valid;
  const PixelRect& from = level.tile.rect;
  PyramidLevel to;
  to.shift = level.shift + 1;
  PixelRect& rect = to.tile.rect;
  rect.x0 = half_up(from.x0);
  rect.y0 = half_up(from.y0);
  rect.width = std::max(0, ((from.x0 + from.width) >> 1) - rect.x0);
  rect.height = std::max(0, ((from.y0 + from.height) >> 1) - rect.y0);
  const auto size = static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height);
  to.grey.resize(size);
  if (valid.data != nullptr) to.valid.resize(size);
  for (int y = 0; y < rect.height; ++y) {
    const int x2 = 2 * rect.x0 - from.x0;
    const int y2 = 2 * (rect.y0 + y) - from.y0;
    const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(rect.width);
    if (valid.data == nullptr) {
      mean_row({grey.row(y2) + x2, grey.row(y2 + 1) + x2}, rect.width, to.grey.data() + at);
    } else {
      mean_row_of_valid({grey.row(y2) + x2, grey.row(y2 + 1) + x2},
                        {valid.row(y2) + x2, valid.row(y2 + 1) + x2}, rect.width, to.grey.data() + at,
                        to.valid.data() + at);
    }
  }
  const auto view = [&rect](const std::vector<std::uint8_t>& pixels) {
    return packed_view(pixels.data(), rect.width, rect.height);
  };
  to.tile.grey = view(to.grey);
  if (valid.data != nullptr) to.tile.valid = view(to.valid);
  return to;
}

std::vector<Spot> dark_spots(const GreyTile& tile, const PixelRect& where, double least_share) {
  DarkRows dark(tile, where, least_share);
  std::vector<Spot> spots;
  for (int below = 0; below < where.height + kMaximumRadius; ++below) {
    if (below < where.height) dark.next_row();
    const int y = below - kMaximumRadius;
    if (y < 0) continue;
    const std::uint16_t* const row = dark.row(y);
    for (int x = 0; x < where.width; ++x)
      if (row[x] != 0 && is_maximum(dark, where, x, y)) spots.push_back({where.x0 + x, where.y0 + y});
  }
  return spots;
}

}  // namespace cairn::ground
