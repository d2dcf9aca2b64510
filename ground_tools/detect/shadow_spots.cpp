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

/// Sums over boxes of valid pixels, and how many those are, about one row after the other.
class BoxSums {
 public:
  BoxSums(const GreyTile& tile, int radius, int first_row)
      : grey_(tile.grey), valid_(tile.valid), radius_(radius), row_(first_row - 1) {
    column_.assign(static_cast<std::size_t>(grey_.width), {0, 0});
    sum_.resize(column_.size() + 1);
    for (int y = std::max(0, row_ - radius); y <= std::min(grey_.height - 1, row_ + radius); ++y) add(y, 1U);
  }
  void next_row() {
    ++row_;
    if (row_ - radius_ > 0) add(row_ - radius_ - 1, ~0U);
    if (row_ + radius_ < grey_.height) add(row_ + radius_, 1U);
    Box total{0, 0};
    for (std::size_t x = 0; x < column_.size(); ++x) {
      sum_[x] = total;
      total.sum += column_[x].sum;
      total.count += column_[x].count;
    }
    sum_.back() = total;
  }
  struct Box {
    std::uint32_t sum, count;

    std::uint32_t mean16() const { return count == kWhole ? 16 * sum / kWhole : 16 * sum / count; }
  };
  /// Around column x of the row.
  Box box(int x) const {
    const Box& from = sum_[static_cast<std::size_t>(std::max(0, x - radius_))];
    const Box& to = sum_[static_cast<std::size_t>(std::min(grey_.width, x + radius_ + 1))];
    return {to.sum - from.sum, to.count - from.count};
  }

 private:
  static constexpr std::uint32_t kWhole = (2 * kFarRadius + 1) * (2 * kFarRadius + 1);

  void add(int y, std::uint32_t times) {
    const std::uint8_t* const g = grey_.row(y);
    const std::uint8_t* const v = valid_.data == nullptr ? nullptr : valid_.row(y);
    for (std::size_t x = 0; x < column_.size(); ++x) {
      const std::uint32_t n = v == nullptr || v[x] != 0 ? times : 0U;
      column_[x].sum += n * g[x];
      column_[x].count += n;
    }
  }

  ImageU8 grey_, valid_;
  int radius_;
  int row_;
  std::vector<Box> column_;
  std::vector<Box> sum_;  ///< along the row, exclusive
};

/// Darkness of spots below their surroundings in 1/16 grey levels, row by row; 0 where it is less than asked
/// for. Of the rows the last five are there.
class DarkRows {
 public:
  static constexpr int kKept = 2 * kMaximumRadius + 1;

  DarkRows(const GreyTile& tile, const PixelRect& where, double least_share)
      : near_(tile, kNearRadius, where.y0),
        far_(tile, kFarRadius, where.y0),
        x0_(where.x0),
        share_(static_cast<std::uint32_t>(std::lround(least_share * 256.0))) {
    for (auto& row : rows_) row.resize(static_cast<std::size_t>(where.width));
  }
  void next_row() {
    near_.next_row();
    far_.next_row();
    std::vector<std::uint16_t>& dark = rows_[static_cast<std::size_t>(++y_ % kKept)];
    for (std::size_t x = 0; x < dark.size(); ++x) {
      const int u = x0_ + static_cast<int>(x);
      const BoxSums::Box near = near_.box(u);
      dark[x] = 0;
      if (near.count == 0) continue;
      const std::uint32_t ground = far_.box(u).mean16();
      const std::uint32_t spot = near.mean16();
      if (spot + ground * share_ / 256 >= ground || spot + 16 * kLeastStep_dn >= ground) continue;
      dark[x] = static_cast<std::uint16_t>(ground - spot);
    }
  }
  const std::vector<std::uint16_t>& row(int y) const { return rows_[static_cast<std::size_t>(y % kKept)]; }

 private:
  BoxSums near_, far_;
  int x0_;
  std::uint32_t share_;
  int y_ = -1;
  std::array<std::vector<std::uint16_t>, kKept> rows_;
};

/// Maximum over 5 x 5; of equals, the first by row and column.
bool is_maximum(const DarkRows& dark, const PixelRect& where, int x, int y) {
  const std::uint16_t here = dark.row(y)[static_cast<std::size_t>(x)];
  if (here == 0) return false;
  for (int v = std::max(0, y - kMaximumRadius); v <= std::min(where.height - 1, y + kMaximumRadius); ++v) {
    const std::vector<std::uint16_t>& row = dark.row(v);
    for (int u = std::max(0, x - kMaximumRadius); u <= std::min(where.width - 1, x + kMaximumRadius); ++u) {
      const std::uint16_t other = row[static_cast<std::size_t>(u)];
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
    for (int x = 0; x < where.width; ++x)
      if (is_maximum(dark, where, x, y)) spots.push_back({where.x0 + x, where.y0 + y});
  }
  return spots;
}

}  // namespace cairn::ground
