#include "detect/shadow_spots.hpp"

#include <algorithm>
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

/// Sums over boxes of valid pixels, and how many they are.
class BoxSums {
 public:
  BoxSums(const ImageU8& grey, const ImageU8& valid)
      : width_(grey.width), height_(grey.height), all_valid_(valid.data == nullptr) {
    const std::size_t pitch = static_cast<std::size_t>(width_) + 1;
    sum_.assign(pitch * (static_cast<std::size_t>(height_) + 1), 0);
    if (!all_valid_) count_.assign(sum_.size(), 0);
    for (int y = 0; y < height_; ++y) {
      const std::uint8_t* g = grey.row(y);
      const std::uint32_t* above = &sum_[static_cast<std::size_t>(y) * pitch];
      std::uint32_t* here = &sum_[static_cast<std::size_t>(y + 1) * pitch];
      std::uint32_t total = 0;
      if (all_valid_) {
        for (int x = 0; x < width_; ++x) {
          total += g[x];
          here[x + 1] = above[x + 1] + total;
        }
        continue;
      }
      const std::uint8_t* v = valid.row(y);
      const std::uint32_t* count_above = &count_[static_cast<std::size_t>(y) * pitch];
      std::uint32_t* count_here = &count_[static_cast<std::size_t>(y + 1) * pitch];
      std::uint32_t n = 0;
      for (int x = 0; x < width_; ++x) {
        if (v[x] != 0) {
          total += g[x];
          ++n;
        }
        here[x + 1] = above[x + 1] + total;
        count_here[x + 1] = count_above[x + 1] + n;
      }
    }
  }
  /// Box around (x, y), cut at the rim. Differences are right although sums wrap.
  void box(int x, int y, int radius, std::uint32_t& sum, std::uint32_t& count) const {
    const int x0 = std::max(0, x - radius);
    const int y0 = std::max(0, y - radius);
    const int x1 = std::min(width_, x + radius + 1);
    const int y1 = std::min(height_, y + radius + 1);
    const std::size_t pitch = static_cast<std::size_t>(width_) + 1;
    const auto at = [&](const std::vector<std::uint32_t>& s) {
      return s[y1 * pitch + x1] - s[y0 * pitch + x1] - s[y1 * pitch + x0] + s[y0 * pitch + x0];
    };
    sum = at(sum_);
    count = all_valid_ ? static_cast<std::uint32_t>((x1 - x0) * (y1 - y0)) : at(count_);
  }

 private:
  int width_;
  int height_;
  bool all_valid_;
  std::vector<std::uint32_t> sum_;
  std::vector<std::uint32_t> count_;
};

/// Darkness of spots below their surroundings in 1/16 grey levels; 0 where it is less than asked for.
std::vector<std::uint16_t> darkness(const ImageU8& grey, const ImageU8& valid, const PixelRect& where,
                                    double seed_contrast) {
  const BoxSums sums(grey, valid);
  const auto share = static_cast<std::uint32_t>(std::lround(seed_contrast * 256.0));
  std::vector<std::uint16_t> dark(static_cast<std::size_t>(where.width) * where.height, 0);
  for (int y = 0; y < where.height; ++y) {
    for (int x = 0; x < where.width; ++x) {
      std::uint32_t near = 0, near_n = 0, far = 0, far_n = 0;
      sums.box(where.x0 + x, where.y0 + y, kNearRadius, near, near_n);
      if (near_n == 0) continue;
      sums.box(where.x0 + x, where.y0 + y, kFarRadius, far, far_n);
      const std::uint32_t ground = 16 * far / far_n;
      const std::uint32_t spot = 16 * near / near_n;
      if (spot + ground * share / 256 >= ground || spot + 16 * kLeastStep_dn >= ground) continue;
      dark[static_cast<std::size_t>(y) * where.width + x] = static_cast<std::uint16_t>(ground - spot);
    }
  }
  return dark;
}

/// Maxima over 5 x 5; of equals, the first by row and column.
std::vector<Spot> maxima(const std::vector<std::uint16_t>& dark, const PixelRect& where) {
  std::vector<Spot> spots;
  for (int y = 0; y < where.height; ++y) {
    for (int x = 0; x < where.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * where.width + x;
      if (dark[i] == 0) continue;
      bool highest = true;
      for (int dy = -kMaximumRadius; highest && dy <= kMaximumRadius; ++dy) {
        for (int dx = -kMaximumRadius; highest && dx <= kMaximumRadius; ++dx) {
          if ((dx == 0 && dy == 0) || x + dx < 0 || y + dy < 0 || x + dx >= where.width ||
              y + dy >= where.height)
            continue;
          const std::uint16_t other = dark[i + static_cast<std::ptrdiff_t>(dy) * where.width + dx];
          const bool earlier = dy < 0 || (dy == 0 && dx < 0);
          highest = earlier ? other < dark[i] : other <= dark[i];
        }
      }
      if (highest) spots.push_back({where.x0 + x, where.y0 + y});
    }
  }
  return spots;
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
  return maxima(darkness(tile.grey, tile.valid, where, least_share), where);
}

}  // namespace cairn::ground
