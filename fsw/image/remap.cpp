#include "image/remap.hpp"

#include "core/assert.hpp"
#include "core/big_endian.hpp"
#include "core/crc32.hpp"

namespace cairn {
namespace {

using remap::kFractionBits;
using remap::kReach_px;
using remap::kSpacing;
using remap::kSpacingBits;

constexpr int kBits = kFractionBits + 2 * kSpacingBits;  ///< of a pixel along a row
constexpr int kWeightBits = 8;

int nodes_in(const RemapTable& table) {
  return remap::nodes_along(table.width_px, kSpacing) * remap::nodes_along(table.height_px, kSpacing);
}

/// A coordinate as the pixel before it and the weight of the one behind, 0 to 256.
struct Place {
  std::int32_t pixel;
  std::uint32_t weight;
};

/// Of what lies behind a pixel.
std::uint32_t weight_of(std::int32_t at) {
  constexpr std::int32_t kMask = (1 << kWeightBits) - 1;
  return static_cast<std::uint32_t>((at >> (kBits - kWeightBits)) & kMask);
}

Place place_of(std::int32_t at, std::int32_t size_px) {
  if (at <= 0) return {0, 0};
  if ((at >> kBits) >= size_px - 1) return {size_px - 2, 1U << kWeightBits};
  return {at >> kBits, weight_of(at)};
}

/// All that lies between two that are.
bool is_inner(std::int32_t at, std::int32_t size_px) { return at >= 0 && (at >> kBits) < size_px - 1; }

/// Both rows in one word, 16 bits each, so that a pixel takes two multiplications; neither half carries into
/// the other, as a weighted mean of bytes stays below 2^16.
std::uint8_t grey_at(const std::uint8_t* above, int stride, std::uint32_t u_weight, std::uint32_t v_weight) {
  const std::uint8_t* const below = above + stride;
  const std::uint32_t left = above[0] | (std::uint32_t{below[0]} << 16);
  const std::uint32_t right = above[1] | (std::uint32_t{below[1]} << 16);
  const std::uint32_t means = (left << kWeightBits) + (right - left) * u_weight;
  const std::uint32_t upper = means & 0xFFFFU, lower = means >> 16;
  constexpr std::uint32_t kHalf = 1U << (2 * kWeightBits - 1);
  return static_cast<std::uint8_t>(((upper << kWeightBits) + (lower - upper) * v_weight + kHalf) >>
                                   (2 * kWeightBits));
}

std::uint8_t grey_beyond(const ImageU8& image, const Place& u, const Place& v) {
  return grey_at(image.data + v.pixel * image.stride + u.pixel, image.stride, u.weight, v.weight);
}

}  // namespace

bool is_sound(const RemapTable& table) {
  if (table.width_px < 1 || table.width_px > cfg::kImageWidth) return false;
  if (table.height_px < 1 || table.height_px > cfg::kImageHeight) return false;
  constexpr std::int32_t kReach = kReach_px << kFractionBits;
  const auto within = [](std::int32_t value) { return value >= -kReach && value <= kReach; };
  for (int i = 0; i < nodes_in(table); ++i) {
    const RemapNode& node = table.nodes[static_cast<std::size_t>(i)];
    if (!within(node.u) || !within(node.v)) return false;
  }
  return true;
}

std::uint32_t crc_of(const RemapTable& table) {
  const bool sound = is_sound(table);
  CAIRN_ASSERT(sound);
  std::uint8_t words[8];
  const auto go_on = [&words](std::int32_t a, std::int32_t b, std::uint32_t crc) {
    be::put_u32(words, static_cast<std::uint32_t>(a));
    be::put_u32(words + 4, static_cast<std::uint32_t>(b));
    return crc32(words, sizeof words, crc);
  };
  std::uint32_t crc = go_on(table.width_px, table.height_px, 0);
  for (int i = 0; i < nodes_in(table); ++i) {
    const RemapNode& node = table.nodes[static_cast<std::size_t>(i)];
    crc = go_on(node.u, node.v, crc);
  }
  return crc;
}

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
  const ImageU8 source = source_;
  std::uint8_t* out = target_.row(y_);
  for (int c = 0; c + 1 < columns; ++c) {
    std::int32_t u = u_edge(c) * kSpacing, v = v_edge(c) * kSpacing;
    const std::int32_t u_end = u_edge(c + 1) * kSpacing, v_end = v_edge(c + 1) * kSpacing;
    const std::int32_t u_step = (u_end - u) / kSpacing, v_step = (v_end - v) / kSpacing;
    const bool inner = is_inner(u, source.width) && is_inner(u_end, source.width) &&
                       is_inner(v, source.height) && is_inner(v_end, source.height);
    const int left = target_.width - c * kSpacing;
    std::uint8_t* const end = out + (left < kSpacing ? left : kSpacing);
    if (inner) {
      std::int32_t row = v >> kBits;
      const std::uint8_t* above = source.data + row * source.stride;
      for (; out != end; ++out, u += u_step, v += v_step) {
        if ((v >> kBits) != row) {
          row = v >> kBits;
          above = source.data + row * source.stride;
        }
        *out = grey_at(above + (u >> kBits), source.stride, weight_of(u), weight_of(v));
      }
    } else {
      for (; out != end; ++out, u += u_step, v += v_step)
        *out = grey_beyond(source, place_of(u, source.width), place_of(v, source.height));
    }
  }
}

}  // namespace cairn
