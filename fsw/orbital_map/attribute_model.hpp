/// The attributes of a map's boulders as classes: what each class means, and how often it comes.
///
/// A model in the head (orbital_map/cmap_format.hpp): u8 classes K, 1 to the attribute's most; for size and
/// height u16 `smallest` (mm, at least 1) and u8 `step`; K weights of 5 bits; zero bits up to a byte.
///   size        class c stands for v(c)
///   height      class 0: unknown; class c > 0 stands for v(c - 1)
///   confidence  class c stands for floor((100 c + floor((K - 1) / 2)) / (K - 1)) per cent; K at least 2
/// v, in 1/256 mm: v(0) = 256 smallest, v(c + 1) = v(c) + floor(v(c) step / 128); in mm
/// floor((v + 128) / 256), at most 65535. So classes grow by a constant ratio, and all of it is integers.
///
/// Frequencies out of 4096, for rANS (J. Duda, arXiv:1311.2540), from the weights w: with W(w) = 2^(w/2),
/// rounded, f = max(1, floor(4096 W(w) / sum of W)); the class of the largest weight (the first of them) gets
/// what is missing to 4096. Half-octave steps cost less than 0.01 bit a symbol and let the tables stay short;
/// no class has a frequency of 0, so that a later revision of the map can be coded with the same tables.
#pragma once

#include <cstddef>
#include <cstdint>

#include "orbital_map/cmap_format.hpp"

namespace cairn::cmap {

/// The frequencies of `classes` (1 to 32) weights, each 0 to 31.
void frequencies(const std::uint8_t* weights, unsigned classes, std::uint16_t* out);

/// The models of a map, ready for decoding: some 500 bytes.
class AttributeModels {
 public:
  /// Reads the models of the attributes in `flags` from [bytes, bytes + size), which they fill. False where
  /// they do not, or a field is out of its range.
  [[nodiscard]] bool read(std::uint8_t flags, const std::uint8_t* bytes, std::size_t size);

  bool has(unsigned attribute) const { return table_[attribute].classes > 0; }
  bool any() const { return has(0) || has(1) || has(2); }
  float diameter_m(unsigned size_class) const { return diameter_m_[size_class]; }
  std::uint16_t height_mm(unsigned height_class) const { return height_mm_[height_class]; }
  std::uint8_t confidence_percent(unsigned confidence_class) const {
    return confidence_percent_[confidence_class];
  }

  /// Takes one symbol off a rANS state: its class. 0 for an attribute that the map does not have.
  [[gnu::always_inline]] std::uint8_t take(unsigned attribute, std::uint32_t& state) const {
    const Table& t = table_[attribute];
    const std::uint32_t slot = state & (kFrequencyTotal - 1U);
    std::uint32_t c = t.bucket[slot >> kBucketShift];
    std::uint32_t entry = t.entry[c];
    while (slot - (entry >> 16U) >= (entry & 0xFFFFU)) entry = t.entry[++c];
    state = (entry & 0xFFFFU) * (state >> kFrequencyBits) + (slot - (entry >> 16U));
    return static_cast<std::uint8_t>(c);
  }

 private:
  static constexpr unsigned kBuckets = 64;
  static constexpr unsigned kBucketShift = kFrequencyBits - 6;
  struct Table {
    /// Of each class: frequencies of those before it, and in the lower half its own.
    std::uint32_t entry[kMaxClasses[0]] = {kFrequencyTotal};
    std::uint8_t bucket[kBuckets] = {};  ///< class at slot 64 i: the search begins there
    std::uint8_t classes = 0;
  };
  struct Reader {
    const std::uint8_t* next;
    std::size_t left;
  };

  bool read_one(unsigned attribute, Reader& reader);
  bool read_values(unsigned attribute, Reader& reader);
  static void fill(Table& table, const std::uint8_t* weights);

  Table table_[kAttributes];
  float diameter_m_[kMaxClasses[0]] = {};
  std::uint16_t height_mm_[kMaxClasses[1]] = {};
  std::uint8_t confidence_percent_[kMaxClasses[2]] = {};
};

}  // namespace cairn::cmap
