#include "ortho/grey_range.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "base/tool_error.hpp"
#include "ortho/unmarked_value.hpp"

namespace cairn::ground {
namespace {

constexpr std::int32_t kLeastSixteen = -32768;
constexpr std::size_t kSixteenBins = 65536 + 32768;  // signed and unsigned alike
constexpr std::size_t kHalfBins = 65536;
constexpr double kLowShare = 0.001;
constexpr double kHighShare = 0.999;
constexpr std::size_t kPixelsAtOnce = std::size_t{1} << 20;

/// Orders as the numbers do.
std::uint32_t key_of(float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return (bits & 0x80000000U) != 0 ? ~bits : bits | 0x80000000U;
}
float value_of(std::uint32_t key) {
  const std::uint32_t bits = (key & 0x80000000U) != 0 ? key & 0x7FFFFFFFU : ~key;
  float value = 0.0F;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

/// Calls `take(value)` for each valid pixel, a few rows at a time.
template <typename Take>
void for_each_value(RasterReader& reader, const PixelBox& tile, const Take& take) {
  const auto width = static_cast<std::size_t>(tile.width());
  const int rows = static_cast<int>(std::max<std::size_t>(1, kPixelsAtOnce / width));
  std::vector<float> values;
  std::vector<std::uint8_t> missing;
  for (int y = tile.y0; y < tile.y1; y += rows) {
    const PixelBox part{tile.x0, y, tile.x1, std::min(y + rows, tile.y1)};
    values.resize(part.pixels());
    missing.resize(part.pixels());
    const bool any = reader.read_values(part, values.data(), missing.data());
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!any || missing[i] == 0) take(values[i]);
    }
  }
}

[[noreturn]] void refuse_void(const std::string& name) {
  throw BadImage("{}: every pixel is marked as no data; check the no-data value, mask or alpha band", name);
}
[[noreturn]] void refuse_flat(const std::string& name, double value) {
  throw BadImage(
      "{}: every valid pixel has the same value ({}), so there is nothing to detect; check the file", name,
      value);
}

}  // namespace

void GreyContent::add(const std::uint8_t* grey, const std::uint8_t* missing, std::size_t pixels) {
  std::uint8_t low = least;
  std::uint8_t high = most;
  std::size_t gone = 0;
  for (std::size_t i = 0; missing == nullptr && i < pixels; ++i) {  // a loop without branches: vectors
    low = std::min(low, grey[i]);
    high = std::max(high, grey[i]);
  }
  for (std::size_t i = 0; missing != nullptr && i < pixels; ++i) {
    if (missing[i] != 0) {
      ++gone;
      continue;
    }
    low = std::min(low, grey[i]);
    high = std::max(high, grey[i]);
  }
  least = low;
  most = high;
  valid += pixels - gone;
}

void GreyContent::add(const GreyContent& other) {
  valid += other.valid;
  least = std::min(least, other.least);
  most = std::max(most, other.most);
}

void GreyContent::check(const std::string& name) const {
  if (valid == 0) refuse_void(name);
  if (least == most) refuse_flat(name, least);
}

Bytes count_values(RasterReader& reader, PixelDepth depth, const PixelBox& tile) {
  std::vector<std::uint64_t> counts(depth == PixelDepth::kReal ? kHalfBins : kSixteenBins);
  if (depth == PixelDepth::kReal) {
    for_each_value(reader, tile, [&](float value) { ++counts[key_of(value) >> 16]; });
  } else {
    for_each_value(reader, tile, [&](float value) {
      ++counts[static_cast<std::size_t>(static_cast<std::int32_t>(value) - kLeastSixteen)];
    });
  }
  Bytes bytes;
  ByteWriter(bytes).put_counts(counts);
  return bytes;
}

Bytes count_lower_halves(RasterReader& reader, const FineBins& bins, const PixelBox& tile) {
  std::array<std::vector<std::uint64_t>, 4> counts;
  for (auto& each : counts) each.resize(kHalfBins);
  for_each_value(reader, tile, [&](float value) {
    const std::uint32_t key = key_of(value);
    for (std::size_t i = 0; i < bins.size(); ++i) {
      if (key >> 16 == bins[i]) ++counts[i][key & 0xFFFFU];
    }
  });
  Bytes bytes;
  ByteWriter writer(bytes);
  for (const auto& each : counts) writer.put_counts(each);
  return bytes;
}

GreyRangeSearch::GreyRangeSearch(PixelDepth depth)
    : depth_(depth), counts_(depth == PixelDepth::kReal ? kHalfBins : kSixteenBins) {
  for (auto& each : lower_) each.resize(depth == PixelDepth::kReal ? kHalfBins : 0);
}

void GreyRangeSearch::add_values(const Bytes& counts) { ByteReader(counts).add_counts(counts_); }

void GreyRangeSearch::add_lower_halves(const Bytes& counts) {
  ByteReader reader(counts);
  for (auto& each : lower_) reader.add_counts(each);
}

/// Its least.
double GreyRangeSearch::value_of_bin(std::size_t bin) const {
  return depth_ == PixelDepth::kReal ? static_cast<double>(value_of(static_cast<std::uint32_t>(bin) << 16))
                                     : static_cast<double>(static_cast<std::int32_t>(bin) + kLeastSixteen);
}

std::uint64_t GreyRangeSearch::total() const {
  return std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0});
}

std::size_t GreyRangeSearch::bin_of(std::uint64_t rank, std::uint64_t& below) const {
  below = 0;
  std::size_t bin = 0;
  while (below + counts_[bin] <= rank) below += counts_[bin++];
  return bin;
}

/// From the middle half outwards: what lies beyond a gap of so many times what there is up to it.
void GreyRangeSearch::leave_out_far(bool low) {
  const std::uint64_t all = total();
  std::uint64_t below = 0;
  std::size_t edge = bin_of(all / 4, below);
  std::size_t other = bin_of(all - 1 - all / 4, below);
  if (edge == other) return;
  if (!low) std::swap(edge, other);
  std::uint64_t beyond = 0;
  const auto far = [&](std::size_t bin) {
    return std::fabs(value_of_bin(bin) - value_of_bin(edge)) >
           static_cast<double>(kTimesFar) * std::fabs(value_of_bin(edge) - value_of_bin(other));
  };
  std::size_t bin = edge;
  std::size_t nearest = edge;
  while (low ? bin-- > 0 : ++bin < counts_.size()) {
    if (counts_[bin] == 0) continue;
    const bool brightness = low && value_of_bin(bin) >= 0.0;  // a shadow, however black
    if (beyond == 0 && (brightness || !far(bin))) {
      edge = bin;
      continue;
    }
    if (beyond == 0) nearest = bin;
    beyond += counts_[bin];
    counts_[bin] = 0;
  }
  if (beyond > 0)
    left_out_ += fmt::format("{}{} pixels of {:.2g}{}", left_out_.empty() ? "" : ", ", beyond,
                             value_of_bin(nearest), low ? " and less" : " and more");
}

void GreyRangeSearch::finish_values(const std::string& name) {
  if (total() == 0) refuse_void(name);
  leave_out_far(true);
  leave_out_far(false);
  const std::uint64_t count = total();
  const auto rank = [&](double share) {
    return static_cast<std::uint64_t>(share * static_cast<double>(count - 1));
  };
  const std::array<std::uint64_t, 4> ranks = {0, rank(kLowShare), rank(kHighShare), count - 1};
  for (std::size_t i = 0; i < ranks.size(); ++i) {
    std::uint64_t below = 0;
    bins_[i] = static_cast<std::uint32_t>(bin_of(ranks[i], below));
    rank_in_bin_[i] = ranks[i] - below;
  }
}

GreyRange GreyRangeSearch::finish(const std::string& name) const {
  std::array<float, 4> value = {};
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (depth_ != PixelDepth::kReal) {
      value[i] = static_cast<float>(static_cast<std::int32_t>(bins_[i]) + kLeastSixteen);
      continue;
    }
    std::uint64_t below = 0;
    std::uint32_t low = 0;
    while (below + lower_[i][low] <= rank_in_bin_[i]) below += lower_[i][low++];
    value[i] = value_of((bins_[i] << 16) | low);
  }
  if (value[0] == value[3]) refuse_flat(name, value[0]);
  return value[2] > value[1] ? GreyRange{value[1], value[2]} : GreyRange{value[0], value[3]};
}

}  // namespace cairn::ground
