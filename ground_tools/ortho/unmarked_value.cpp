#include "ortho/unmarked_value.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "ortho/pixel_meaning.hpp"

namespace cairn::ground {
namespace {

constexpr int kWindowPx = 64;
constexpr int kMostWindows = 16;      // a side
constexpr double kMostPixels = 32e6;  // of the file's blocks
constexpr double kCollarShare = 0.02;
constexpr double kUsualShare = 0.05;
constexpr double kTimesNext = 3.0;  // and so many times as many as of the value beside it
constexpr double kMostShare = 0.75;
constexpr double kOutermost = 0.001;     // of what all others span; as the stretch to grey leaves out
constexpr std::ptrdiff_t kLeastFar = 4;  // pixels; fewer are faults of a detector
constexpr int kCornerPx = 8;
constexpr std::size_t kMostGapPx = 32;
constexpr int kLeastValues = 16;  // of fewer a picture is drawn, not taken

int windows_a_side(const RasterFacts& facts) {
  const double block = std::max(1.0, static_cast<double>(facts.block_width) * facts.block_height);
  const double window =
      std::max(block, static_cast<double>(kWindowPx) * std::max(kWindowPx, facts.block_width));
  return std::clamp(static_cast<int>(std::sqrt(kMostPixels / window)), 2, kMostWindows);
}

/// Window `i` of `count` along `side` pixels; the first and the last lie at the ends.
int place(int i, int count, int side) {
  const int room = std::max(0, side - kWindowPx);
  return static_cast<int>(static_cast<std::int64_t>(room) * i / (count - 1));
}

/// Windows of kWindowPx all over the image, its corners among them; where there is room for all, all of it.
template <typename Take>
void for_each_window(RasterReader& reader, const RasterFacts& facts, const Take& take) {
  std::vector<float> values(static_cast<std::size_t>(kWindowPx) * kWindowPx);
  std::vector<std::uint8_t> kinds(values.size());
  const bool whole = facts.width <= kWindowPx * kMostWindows && facts.height <= kWindowPx * kMostWindows;
  const int across = whole ? (facts.width + kWindowPx - 1) / kWindowPx : windows_a_side(facts);
  const int down = whole ? (facts.height + kWindowPx - 1) / kWindowPx : windows_a_side(facts);
  const auto at = [&](int i, int count, int side) { return whole ? i * kWindowPx : place(i, count, side); };
  for (int j = 0; j < down; ++j) {
    for (int i = 0; i < across; ++i) {
      PixelBox box{at(i, across, facts.width), at(j, down, facts.height), 0, 0};
      box.x1 = std::min(box.x0 + kWindowPx, facts.width);
      box.y1 = std::min(box.y0 + kWindowPx, facts.height);
      if (!reader.read_values(box, values.data(), kinds.data())) std::fill(kinds.begin(), kinds.end(), 0);
      take(box, values, kinds);
    }
  }
}

struct Samples {
  std::vector<float> values;   ///< sorted
  std::vector<float> corners;  ///< each corner's value where it is the same throughout
};

Samples sample(RasterReader& reader, const RasterFacts& facts) {
  Samples samples;
  for_each_window(reader, facts, [&](const PixelBox& box, const auto& values, const auto& kinds) {
    for (std::size_t k = 0; k < box.pixels(); ++k) {
      if (kinds[k] == 0) samples.values.push_back(values[k]);
    }
  });
  std::vector<float> values(static_cast<std::size_t>(kCornerPx) * kCornerPx);
  std::vector<std::uint8_t> kinds(values.size());
  const int corner = std::min({kCornerPx, facts.width, facts.height});
  for (int i = 0; i < 4; ++i) {
    const int x = i % 2 == 0 ? 0 : facts.width - corner;
    const int y = i / 2 == 0 ? 0 : facts.height - corner;
    const PixelBox box{x, y, x + corner, y + corner};
    const bool any = reader.read_values(box, values.data(), kinds.data());
    bool same = true;
    for (std::size_t k = 0; k < box.pixels(); ++k)
      same = same && (!any || kinds[k] == 0) && values[k] == values[0];
    if (same) samples.corners.push_back(values[0]);
  }
  std::sort(samples.values.begin(), samples.values.end());
  return samples;
}

bool is_drawn(const std::vector<float>& sorted) {
  int distinct = 0;
  for (auto at = sorted.begin(); at != sorted.end() && distinct < kLeastValues; ++distinct)
    at = std::upper_bound(at, sorted.end(), *at);
  return distinct < kLeastValues;
}

/// Far from all other values. The other end may be such a value, too, and does not count.
bool is_far(const std::vector<float>& sorted, bool is_least) {
  const auto above = std::upper_bound(sorted.begin(), sorted.end(), sorted.front());
  const auto below = std::lower_bound(above, sorted.end(), sorted.back());
  const float end = is_least ? sorted.front() : sorted.back();
  const auto count = is_least ? above - sorted.begin() : sorted.end() - below;
  const auto others = below - above;
  if (count < kLeastFar || others == 0) return false;
  const auto left_out = static_cast<std::ptrdiff_t>(kOutermost * static_cast<double>(others));
  const float near = is_least ? *above : *(below - 1);
  const float far = is_least ? *(below - 1 - left_out) : *(above + left_out);
  return std::fabs(near - end) > kTimesFar * std::fabs(far - near);
}

}  // namespace

double share_in_gaps(RasterReader& reader, const RasterFacts& facts) {
  std::size_t gaps = 0;
  std::size_t there = 0;
  for_each_window(reader, facts, [&](const PixelBox& box, const auto&, const auto& kinds) {
    const auto width = static_cast<std::size_t>(box.width());
    for (std::size_t row = 0; row < box.pixels(); row += width) {
      std::size_t begin = width;  // behind the last pixel that is there; none yet
      for (std::size_t x = 0; x < width; ++x) {
        if (kinds[row + x] == kMissing) continue;
        ++there;
        if (begin < x && x - begin <= kMostGapPx) gaps += x - begin;
        begin = x + 1;
      }
    }
  });
  return gaps + there == 0 ? 0.0 : static_cast<double>(gaps) / static_cast<double>(gaps + there);
}

std::optional<UnmarkedValue> unmarked_value(RasterReader& reader, const RasterFacts& facts) {
  const Samples samples = sample(reader, facts);
  const std::vector<float>& values = samples.values;
  if (is_drawn(values)) return std::nullopt;
  const auto total = static_cast<double>(values.size());
  const float least = values.front();
  const float largest = values.back();
  const auto above = std::upper_bound(values.begin(), values.end(), least);
  const auto below = std::lower_bound(values.begin(), values.end(), largest);
  bool stands_out[] = {false, false};
  const auto judge = [&](bool is_least) {
    UnmarkedValue end;
    end.value = is_least ? least : largest;
    end.is_least = is_least;
    end.share = static_cast<double>(is_least ? above - values.begin() : values.end() - below) / total;
    const float next = is_least ? *above : *(below - 1);
    const bool apart = is_least ? next - least > largest - next : largest - next > next - least;
    const bool corner =
        std::find(samples.corners.begin(), samples.corners.end(), end.value) != samples.corners.end();
    const bool saturated = facts.depth == PixelDepth::kEight && std::fabs(end.value - 255.0F) < 1e-3F;
    const bool far = facts.depth != PixelDepth::kEight && is_far(values, is_least);
    // No brightness is below zero; a shadow without any light is zero, and may be far from sunlit ground.
    const bool beyond = far && (!is_least || end.value < 0.0F);
    end.is_no_ground =
        end.share <= kMostShare && ((corner && end.share >= kCollarShare && (apart || saturated)) || beyond);
    // Of the mean of three bands, thirds add up to a little less.
    if (facts.depth == PixelDepth::kEight) end.value = std::round(end.value);
    const auto [from, to] = std::equal_range(values.begin(), values.end(), next);
    stands_out[is_least ? 0 : 1] =
        far || (end.share >= kUsualShare && end.share * total > kTimesNext * static_cast<double>(to - from));
    return end;
  };
  const UnmarkedValue ends[] = {judge(true), judge(false)};
  for (const UnmarkedValue& end : ends) {
    if (end.is_no_ground) return end;
  }
  for (int i = 0; i < 2; ++i) {
    if (stands_out[i] && ends[i].share <= kMostShare) return ends[i];
  }
  return std::nullopt;
}

}  // namespace cairn::ground
