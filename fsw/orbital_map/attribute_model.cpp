#include "orbital_map/attribute_model.hpp"

#include "core/big_endian.hpp"

namespace cairn::cmap {
namespace {

constexpr std::uint32_t kRootOfTwo = 46341;  // 2^15 times the root of 2
constexpr std::uint32_t kMaxValue = 65535U << 8U;
constexpr double kMillimetre = 0.001;

std::uint32_t power(std::uint8_t weight) {
  const unsigned whole = weight / 2U;
  return weight % 2U == 0U ? 1U << whole : ((kRootOfTwo << whole) + (1U << 14U)) >> 15U;
}

}  // namespace

void frequencies(const std::uint8_t* weights, unsigned classes, std::uint16_t* out) {
  std::uint32_t sum = 0;
  unsigned largest = 0;
  for (unsigned c = 0; c < classes; ++c) {
    sum += power(weights[c]);
    if (weights[c] > weights[largest]) largest = c;
  }
  std::uint32_t given = 0;
  for (unsigned c = 0; c < classes; ++c) {
    const std::uint32_t share = kFrequencyTotal * power(weights[c]) / sum;
    out[c] = static_cast<std::uint16_t>(share > 0U ? share : 1U);
    given += out[c];
  }
  // The largest has at least 4096 / 32, and at most 31 were lifted to 1.
  out[largest] = static_cast<std::uint16_t>(out[largest] + kFrequencyTotal - given);
}

bool AttributeModels::read(std::uint8_t flags, const std::uint8_t* bytes, std::size_t size) {
  *this = AttributeModels();
  confidence_percent_[0] = 100;
  Reader reader{bytes, size};
  for (unsigned a = 0; a < kAttributes; ++a) {
    if ((flags >> a & 1U) != 0U && !read_one(a, reader)) return false;
  }
  return reader.left == 0;
}

bool AttributeModels::read_one(unsigned attribute, Reader& reader) {
  if (reader.left == 0) return false;
  const std::uint8_t classes = *reader.next;
  if (classes == 0 || classes > kMaxClasses[attribute]) return false;
  ++reader.next;
  --reader.left;
  Table& table = table_[attribute];
  table.classes = classes;
  if (!read_values(attribute, reader)) return false;

  const std::size_t bytes = (kWeightBits * classes + 7U) / 8U;
  if (reader.left < bytes) return false;
  std::uint8_t weights[kMaxClasses[0]] = {};
  std::uint32_t bits = 0;
  unsigned held = 0;
  for (unsigned c = 0; c < classes; ++c) {
    if (held < kWeightBits) {
      bits = bits << 8U | *reader.next++;
      held += 8;
    }
    held -= kWeightBits;
    weights[c] = static_cast<std::uint8_t>(bits >> held & 31U);
  }
  if ((bits & ((1U << held) - 1U)) != 0U) return false;
  reader.left -= bytes;
  fill(table, weights);
  return true;
}

bool AttributeModels::read_values(unsigned attribute, Reader& reader) {
  const unsigned classes = table_[attribute].classes;
  if (attribute == 2) {
    if (classes < 2) return false;
    const unsigned last = classes - 1;
    for (unsigned c = 0; c < classes && c < kMaxClasses[2]; ++c)
      confidence_percent_[c] = static_cast<std::uint8_t>((100U * c + last / 2U) / last);
    return true;
  }
  if (reader.left < 3) return false;
  std::uint32_t value = static_cast<std::uint32_t>(be::get_u16(reader.next)) << 8U;
  const std::uint32_t step = reader.next[2];
  reader.next += 3;
  reader.left -= 3;
  if (value == 0) return false;
  for (unsigned c = attribute; c < classes && c < kMaxClasses[attribute];
       ++c) {  // a height's first class is "unknown"
    if (value > kMaxValue) return false;
    const std::uint32_t mm = (value + 128U) >> 8U;
    if (attribute == 0) {
      diameter_m_[c] = static_cast<float>(mm * kMillimetre);
    } else {
      height_mm_[c] = static_cast<std::uint16_t>(mm);
    }
    value += value * step / 128U;  // below 2^32: 65535 * 256 * 255
  }
  return true;
}

void AttributeModels::fill(Table& table, const std::uint8_t* weights) {
  std::uint16_t frequency[kMaxClasses[0]] = {};
  frequencies(weights, table.classes, frequency);
  std::uint32_t start = 0;
  unsigned next = 0;  // bucket
  for (unsigned c = 0; c < table.classes; ++c) {
    table.entry[c] = start << 16U | frequency[c];
    start += frequency[c];
    for (; next < kBuckets && next << kBucketShift < start; ++next)
      table.bucket[next] = static_cast<std::uint8_t>(c);
  }
}

}  // namespace cairn::cmap
