#include "image/remap.hpp"

namespace cairn {
namespace {

using remap::kFractionBits;
using remap::kReach_px;
using remap::kSpacing;
using remap::kSpacingBits;

constexpr int kBits = kFractionBits + 2 * kSpacingBits;  ///< of a pixel along a row
constexpr int kWeightBits = 8;

bool is_sound(const RemapTable& table) {
  if (table.width_px < 1 || table.width_px > cfg::kImageWidth) return false;
  if (table.height_px < 1 || table.height_px > cfg::kImageHeight) return false;
  constexpr std::int32_t kReach = kReach_px << kFractionBits;
  const auto within = [](std::int32_t value) { return value >= -kReach && value <= kReach; };
  const int count =
      remap::nodes_along(table.width_px, kSpacing) * remap::nodes_along(table.height_px, kSpacing);
  for (int i = 0; i < count; ++i) {
    const RemapNode& node = table.nodes[static_cast<std::size_t>(i)];
    if (!within(node.u) || !within(node.v)) return false;
  }
  return true;
}

/// A coordinate as the pixel before it and the weight of the one behind, 0 to 256.
struct Place {
  std::int32_t pixel;
  std::uint32_t weight;
};

Place place_of(std::int32_t at, std::int32_t size_px) {
  if (at <= 0) return {0, 0};
  const std::int32_t pixel = at >> kBits;
  if (pixel >= size_px - 1) return {size_px - 2, 1U << kWeightBits};
  constexpr std::int32_t kMask = (1 << kWeightBits) - 1;
  return {pixel, static_cast<std::uint32_t>((at >> (kBits - kWeightBits)) & kMask)};
}

std::uint8_t grey_at(const ImageU8& image, const Place& u, const Place& v) {
  constexpr std::uint32_t kWhole = 1U << kWeightBits;
  const std::uint8_t* const above = image.row(v.pixel) + u.pixel;
  const std::uint8_t* const below = above + image.stride;
  const std::uint32_t upper = above[0] * (kWhole - u.weight) + above[1] * u.weight;
  const std::uint32_t lower = below[0] * (kWhole - u.weight) + below[1] * u.weight;
  constexpr std::uint32_t kHalf = 1U << (2 * kWeightBits - 1);
  return static_cast<std::uint8_t>((upper * (kWhole - v.weight) + lower * v.weight + kHalf) >>
                                   (2 * kWeightBits));
}

}  // namespace

RemapStatus RemapJob::start(const RemapTable& table, const ImageU8& source, const MutableImageU8& target) {
  table_ = &table;
  source_ = source;
  target_ = target;
  y_ = 0;
  constexpr int kMostSide_px = kReach_px + 1;
  if (!is_sound(table)) {
    status_ = RemapStatus::kBadTable;
  } else if (source.data == nullptr || target.data == nullptr || source.width < 2 || source.height < 2 ||
             source.width > kMostSide_px || source.height > kMostSide_px || target.width != table.width_px ||
             target.height != table.height_px) {
    status_ = RemapStatus::kBadImage;
  } else {
    status_ = RemapStatus::kRunning;
  }
  return status_;
}

Progress RemapJob::step(WorkBudget& budget) {
  while (status_ == RemapStatus::kRunning) {
    if (!budget.take(4U * static_cast<std::uint32_t>(target_.width))) return Progress::kMore;
    do_row();
    if (++y_ == target_.height) status_ = RemapStatus::kDone;
  }
  return Progress::kDone;
}

void RemapJob::do_row() {
  const int columns = remap::nodes_along(target_.width, kSpacing);
  const int down = y_ % kSpacing;
  const RemapNode* const upper = table_->nodes.data() + (y_ / kSpacing) * columns;
  const RemapNode* const lower = upper + columns;
  const auto u_edge = [&](int c) { return upper[c].u * (kSpacing - down) + lower[c].u * down; };
  const auto v_edge = [&](int c) { return upper[c].v * (kSpacing - down) + lower[c].v * down; };
  std::uint8_t* const out = target_.row(y_);
  int x = 0;
  for (int c = 0; c + 1 < columns; ++c) {
    std::int32_t u = u_edge(c) * kSpacing, v = v_edge(c) * kSpacing;
    const std::int32_t u_step = u_edge(c + 1) - u_edge(c), v_step = v_edge(c + 1) - v_edge(c);
    for (int i = 0; i < kSpacing && x < target_.width; ++i, ++x) {
      out[x] = grey_at(source_, place_of(u, source_.width), place_of(v, source_.height));
      u += u_step;
      v += v_step;
    }
  }
}

}  // namespace cairn
