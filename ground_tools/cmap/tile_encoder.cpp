#include "cmap/tile_encoder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/big_endian.hpp"
#include "core/crc32.hpp"

namespace cairn::ground {
namespace {

using cmap::TileBoulder;
using cmap::TileShape;

constexpr std::uint64_t kLn2 = 0xB17217F7U;
constexpr unsigned kFinestStep = 16;  // of 128: classes some 12 % apart
constexpr double kHighestWeight = 24.0;

class BitWriter {
 public:
  void bits(std::uint32_t value, unsigned count) {
    for (unsigned i = count; i-- > 0;) bit((value >> i & 1U) != 0U);
  }
  void unary(std::uint64_t ones) {
    for (; ones > 0; --ones) bit(true);
    bit(false);
  }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  void bit(bool one) {
    if (used_ % 8U == 0U) bytes_.push_back(0);
    if (one) bytes_.back() = static_cast<std::uint8_t>(bytes_.back() | 0x80U >> used_ % 8U);
    ++used_;
  }
  std::vector<std::uint8_t> bytes_;
  std::size_t used_ = 0;
};

/// Counts what a BitWriter would write.
class BitCounter {
 public:
  void bits(std::uint32_t, unsigned count) { used_ += count; }
  void unary(std::uint64_t ones) { used_ += ones + 1U; }
  std::uint64_t used() const { return used_; }

 private:
  std::uint64_t used_ = 0;
};

template <typename Sink>
void put_truncated(Sink& sink, std::uint32_t value, std::uint32_t values) {
  unsigned log2 = 0;
  while (values >> log2 > 1U) ++log2;
  const std::uint32_t shorter = (2U << log2) - values;
  if (value < shorter) {
    sink.bits(value, log2);
  } else {
    sink.bits((value - shorter) / 2U + shorter, log2);
    sink.bits((value - shorter) & 1U, 1);
  }
}

template <typename Sink>
void put_gap(Sink& sink, std::uint32_t gap, std::uint32_t cells_left, std::uint32_t boulders_left) {
  if (boulders_left == 1) {
    put_truncated(sink, gap, cells_left);
    return;
  }
  const auto parameter =
      std::max<std::uint32_t>(1U, static_cast<std::uint32_t>(kLn2 * (cells_left / boulders_left) >> 32U));
  sink.unary(gap / parameter);
  put_truncated(sink, gap % parameter, parameter);
}

struct Block {
  std::uint32_t x = 0;
  std::uint32_t y = 0;
  std::uint32_t width = 1;
  std::uint32_t height = 1;
  unsigned depth = 0;
  std::vector<TileBoulder>::iterator first;
  std::vector<TileBoulder>::iterator end;

  std::uint32_t held() const { return static_cast<std::uint32_t>(end - first); }
};

/// The boulders of a block that is not split, which become sorted.
template <typename Sink>
void put_leaf(Sink& sink, const Block& block) {
  std::sort(block.first, block.end, [](const TileBoulder& a, const TileBoulder& b) {
    return std::tie(a.y, a.x) < std::tie(b.y, b.x);
  });
  std::uint32_t cells = block.width * block.height;
  std::uint32_t cell = 0;
  std::uint32_t left = block.held();
  for (auto b = block.first; b != block.end; ++b, --left) {
    const std::uint32_t here = (b->y - block.y) * block.width + b->x - block.x;
    put_gap(sink, here - cell, cells, left);
    cells -= here + 1U - cell;
    cell = here + 1U;
  }
}

/// A block with its halves. The boulders come into the order in which they are coded.
template <typename Sink>
void put_block(Sink& sink, const Block& block, unsigned depth) {
  const std::uint32_t held = block.held();
  if (held == 0) return;
  const bool small = block.width <= cmap::kMaxBlockSide && block.height <= cmap::kMaxBlockSide;
  if (small && (held == 1 || block.depth >= depth || (block.width == 1 && block.height == 1))) {
    put_leaf(sink, block);
    return;
  }
  Block first = block;
  Block second = block;
  ++first.depth;
  ++second.depth;
  if (block.width >= block.height) {
    first.width /= 2U;
    second.x += first.width;
    second.width -= first.width;
    first.end = std::partition(block.first, block.end, [&](const TileBoulder& b) { return b.x < second.x; });
  } else {
    first.height /= 2U;
    second.y += first.height;
    second.height -= first.height;
    first.end = std::partition(block.first, block.end, [&](const TileBoulder& b) { return b.y < second.y; });
  }
  second.first = first.end;
  const std::uint32_t middle = held / 2U;
  const std::uint32_t there = first.held();
  put_truncated(sink, there > middle ? 2U * (there - middle) - 1U : 2U * (middle - there), held + 1U);
  put_block(sink, first, depth);
  put_block(sink, second, depth);
}

/// Position bits of the tile; its boulders come into their order.
template <typename Sink>
void put_tile(Sink& sink, const TileShape& shape, unsigned depth, std::vector<TileBoulder>& boulders) {
  put_block(sink, {0, 0, shape.width, shape.height, 0, boulders.begin(), boulders.end()}, depth);
}

/// The attributes of all boulders as one rANS stream (coded from the last symbol to the first).
std::vector<std::uint8_t> attribute_stream(const AttributeTables& tables,
                                           const std::vector<TileBoulder>& boulders) {
  std::array<std::vector<std::uint16_t>, cmap::kAttributes> frequency;
  std::array<std::vector<std::uint32_t>, cmap::kAttributes> start;
  for (unsigned a = 0; a < cmap::kAttributes; ++a) {
    if (!tables[a].present()) continue;
    frequency[a].resize(tables[a].classes());
    cmap::frequencies(tables[a].weights.data(), tables[a].classes(), frequency[a].data());
    std::uint32_t sum = 0;
    for (const std::uint16_t f : frequency[a]) {
      start[a].push_back(sum);
      sum += f;
    }
  }
  std::vector<std::uint8_t> bytes;
  std::uint32_t state = 1;
  const auto shift_out = [&] {
    bytes.push_back(static_cast<std::uint8_t>(state));
    state >>= 8U;
  };
  for (std::size_t i = boulders.size(); i-- > 0;) {
    for (unsigned a = cmap::kAttributes; a-- > 0;) {
      if (!tables[a].present()) continue;
      const std::uint32_t f = frequency[a][boulders[i].attribute[a]];
      while (state >= (cmap::kStateLow >> cmap::kFrequencyBits << 8U) * f) shift_out();
      state = (state / f << cmap::kFrequencyBits) + state % f + start[a][boulders[i].attribute[a]];
    }
  }
  while (state > 0) shift_out();
  std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

std::uint32_t next_value(std::uint32_t value, std::uint32_t step) { return value + value * step / 128U; }

/// Weights of classes that come so often: half octaves below the most frequent.
std::vector<std::uint8_t> weights_of(const std::vector<double>& counts) {
  const double most = *std::max_element(counts.begin(), counts.end());
  std::vector<std::uint8_t> weights;
  for (const double count : counts) {
    const double weight = count > 0.0 ? kHighestWeight + 2.0 * std::log2(count / most) : 0.0;
    weights.push_back(static_cast<std::uint8_t>(std::max(0.0, std::round(weight))));
  }
  return weights;
}

}  // namespace

std::vector<double> AttributeTable::ladder() const {
  std::vector<double> values;
  std::uint32_t value = static_cast<std::uint32_t>(smallest_mm) << 8U;
  for (unsigned c = attribute; c < classes(); ++c) {
    values.push_back(value / 256.0);
    value = next_value(value, step);
  }
  return values;
}

std::vector<std::uint8_t> AttributeTable::classes_of(const std::vector<double>& values) const {
  const std::vector<double> steps = attribute == 2 ? std::vector<double>() : ladder();
  const auto class_of = [&](double value) {
    if (attribute == 2) return std::lround(std::clamp(value, 0.0, 1.0) * (classes() - 1U));
    if (attribute == 1 && !(value > 0.0)) return 0L;
    long best = 0;
    for (std::size_t c = 1; c < steps.size(); ++c) {
      if (value * value > steps[c - 1U] * steps[c]) best = static_cast<long>(c);
    }
    return best + static_cast<long>(attribute);
  };
  std::vector<std::uint8_t> out;
  out.reserve(values.size());
  for (const double value : values) out.push_back(static_cast<std::uint8_t>(class_of(value)));
  return out;
}

bool AttributeTable::reaches(const std::vector<double>& values) const {
  if (attribute == 2) return true;
  const std::vector<double> steps = ladder();
  const double half = std::sqrt(1.0 + step / 128.0) * 1.001;
  return std::all_of(values.begin(), values.end(), [&](double value) {
    if (attribute == 1 && !(value > 0.0)) return true;
    return !steps.empty() && value >= steps.front() / half - 0.5 && value <= steps.back() * half + 0.5;
  });
}

void AttributeTable::put(std::vector<std::uint8_t>& bytes) const {
  if (!present()) return;
  bytes.push_back(static_cast<std::uint8_t>(classes()));
  if (attribute != 2) {
    bytes.push_back(static_cast<std::uint8_t>(smallest_mm >> 8U));
    bytes.push_back(static_cast<std::uint8_t>(smallest_mm));
    bytes.push_back(step);
  }
  BitWriter bits;
  for (const std::uint8_t w : weights) bits.bits(w, cmap::kWeightBits);
  bytes.insert(bytes.end(), bits.bytes().begin(), bits.bytes().end());
}

AttributeTable table_for(unsigned attribute, const std::vector<double>& values) {
  AttributeTable table;
  table.attribute = attribute;
  if (values.empty()) return table;
  if (attribute == 2) {
    table.weights.resize(cmap::kMaxClasses[2]);
  } else {
    double least = std::numeric_limits<double>::infinity();
    double most = 0.0;
    for (const double value : values) {
      if (value > 0.0) least = std::min(least, value);
      most = std::max(most, value);
    }
    if (!(most > 0.0)) return table;
    const unsigned room = cmap::kMaxClasses[attribute] - attribute;
    for (unsigned step = kFinestStep; step < 256U; ++step) {
      const double ratio = 1.0 + step / 128.0;
      table.step = static_cast<std::uint8_t>(step);
      const double first_mm = most > least * ratio ? least * std::sqrt(ratio) : std::sqrt(least * most);
      table.smallest_mm = static_cast<std::uint16_t>(std::clamp(std::round(first_mm), 1.0, 65535.0));
      std::uint32_t value = static_cast<std::uint32_t>(table.smallest_mm) << 8U;
      unsigned classes = 1;
      for (; classes <= room && value / 256.0 * std::sqrt(ratio) < most; ++classes) {
        if (next_value(value, step) > 65535U << 8U) break;
        value = next_value(value, step);
      }
      table.weights.assign(classes + attribute, 0);
      if (classes <= room) break;
    }
  }
  std::vector<double> counts(table.classes(), 0.0);
  for (const std::uint8_t c : table.classes_of(values)) ++counts[c];
  const bool tells = attribute != 2 || counts.back() < static_cast<double>(values.size());
  table.weights = tells ? weights_of(counts) : std::vector<std::uint8_t>();
  return table;
}

std::vector<std::uint8_t> encode_tile(std::uint32_t index, const TileShape& shape,
                                      const AttributeTables& tables, std::vector<TileBoulder> boulders) {
  if (boulders.empty()) return {};
  std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
  unsigned best = 0;
  for (unsigned depth = 0; depth <= cmap::kMaxDepth; ++depth) {
    BitCounter counter;
    put_tile(counter, shape, depth, boulders);
    if (counter.used() < least) {
      least = counter.used();
      best = depth;
    }
  }
  BitWriter positions;
  put_tile(positions, shape, best, boulders);
  std::vector<std::uint8_t> bytes(cmap::kTileHeadBytes);
  be::put_u16(bytes.data() + cmap::kTileCountAt, static_cast<std::uint16_t>(boulders.size()));
  bytes[cmap::kTileDepthAt] = static_cast<std::uint8_t>(best);
  if (std::any_of(tables.begin(), tables.end(), [](const AttributeTable& t) { return t.present(); })) {
    const std::vector<std::uint8_t> stream = attribute_stream(tables, boulders);
    bytes.push_back(static_cast<std::uint8_t>(stream.size() >> 8U));
    bytes.push_back(static_cast<std::uint8_t>(stream.size()));
    bytes.insert(bytes.end(), stream.begin(), stream.end());
  }
  bytes.insert(bytes.end(), positions.bytes().begin(), positions.bytes().end());
  const std::uint32_t crc = crc32(bytes.data(), bytes.size(), cmap::tile_crc_start(index));
  bytes.resize(bytes.size() + cmap::kCrcBytes);
  be::put_u32(bytes.data() + bytes.size() - cmap::kCrcBytes, crc);
  return bytes;
}

}  // namespace cairn::ground
