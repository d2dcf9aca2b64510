#include "map/tile_encoder.hpp"

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

/// A tile split into blocks, and its boulders in their order.
struct Blocks {
  std::uint32_t side = 1;
  std::uint32_t columns = 1;
  std::uint32_t rows = 1;
  TileShape shape;
  std::vector<TileBoulder> boulders;
  std::vector<std::uint32_t> held;  ///< by block

  Blocks(const TileShape& tile, unsigned log2, std::vector<TileBoulder> all)
      : side((tile.side + (1U << log2) - 1U) >> log2),
        columns((tile.width - 1U) / side + 1U),
        rows((tile.height - 1U) / side + 1U),
        shape(tile),
        boulders(std::move(all)),
        held(static_cast<std::size_t>(columns) * rows) {
    const auto key = [&](const TileBoulder& b) { return std::tuple(block(b), b.y, b.x); };
    std::sort(boulders.begin(), boulders.end(),
              [&](const TileBoulder& a, const TileBoulder& b) { return key(a) < key(b); });
    for (const TileBoulder& b : boulders) ++held[block(b)];
  }
  std::uint32_t block(const TileBoulder& b) const { return b.y / side * columns + b.x / side; }

  template <typename Sink>
  void put(Sink& sink, unsigned rice) const {
    std::size_t next = 0;
    for (std::uint32_t i = 0; i < held.size() && next < boulders.size(); ++i) {
      if (i + 1U < held.size()) {
        sink.unary(held[i] >> rice);
        sink.bits(held[i] & ((1U << rice) - 1U), rice);
      }
      const std::uint32_t x0 = i % columns * side;
      const std::uint32_t y0 = i / columns * side;
      const std::uint32_t width = std::min(side, shape.width - x0);
      std::uint32_t cells = width * std::min(side, shape.height - y0);
      std::uint32_t cell = 0;
      for (std::uint32_t left = held[i]; left > 0; --left, ++next) {
        const std::uint32_t here = (boulders[next].y - y0) * width + boulders[next].x - x0;
        put_gap(sink, here - cell, cells, left);
        cells -= here + 1U - cell;
        cell = here + 1U;
      }
    }
  }
};

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
      table.smallest_mm =
          static_cast<std::uint16_t>(std::clamp(std::round(least * std::sqrt(ratio)), 1.0, 65535.0));
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
                                      const AttributeTables& tables,
                                      const std::vector<TileBoulder>& boulders) {
  if (boulders.empty()) return {};
  std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
  unsigned best_log2 = 0;
  unsigned best_rice = 0;
  for (unsigned log2 = 0; log2 <= cmap::kMaxBlocksLog2; ++log2) {
    const Blocks blocks(shape, log2, boulders);
    if (blocks.side > cmap::kMaxBlockSide) continue;
    for (unsigned rice = 0; rice < 12U; ++rice) {
      BitCounter counter;
      blocks.put(counter, rice);
      if (counter.used() < least) {
        least = counter.used();
        best_log2 = log2;
        best_rice = rice;
      }
      if (blocks.held.size() == 1U) break;
    }
  }
  const Blocks blocks(shape, best_log2, boulders);
  std::vector<std::uint8_t> bytes(cmap::kTileHeadBytes);
  be::put_u16(bytes.data() + cmap::kTileCountAt, static_cast<std::uint16_t>(boulders.size()));
  bytes[cmap::kTileModeAt] = static_cast<std::uint8_t>(best_log2 << 4U | best_rice);
  if (std::any_of(tables.begin(), tables.end(), [](const AttributeTable& t) { return t.present(); })) {
    const std::vector<std::uint8_t> stream = attribute_stream(tables, blocks.boulders);
    bytes.push_back(static_cast<std::uint8_t>(stream.size() >> 8U));
    bytes.push_back(static_cast<std::uint8_t>(stream.size()));
    bytes.insert(bytes.end(), stream.begin(), stream.end());
  }
  BitWriter positions;
  blocks.put(positions, best_rice);
  bytes.insert(bytes.end(), positions.bytes().begin(), positions.bytes().end());
  const std::uint32_t crc = crc32(bytes.data(), bytes.size(), cmap::tile_crc_start(index));
  bytes.resize(bytes.size() + cmap::kCrcBytes);
  be::put_u32(bytes.data() + bytes.size() - cmap::kCrcBytes, crc);
  return bytes;
}

}  // namespace cairn::ground
