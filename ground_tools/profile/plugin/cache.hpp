/// A set-associative cache: tags alone, true LRU.
#pragma once

#include <cstdint>
#include <vector>

namespace cairn::profile {

struct CacheShape {
  std::uint32_t bytes = 0;
  std::uint32_t ways = 0;
  std::uint32_t line = 0;
  std::uint32_t fill = 0;  ///< bytes that a miss fetches: a line, or a sub-block of it with its own valid bit
  /// And allocates on a store; else write-through, and a store that misses leaves it alone.
  bool write_back = false;
};

class Cache {
 public:
  enum class Found : std::uint8_t { kHit, kMiss, kMissCastOut /* and a changed line goes out */ };

  explicit Cache(const CacheShape& shape)
      : ways_(shape.ways),
        set_mask_(shape.bytes / shape.ways / shape.line - 1),
        line_shift_(log2(shape.line)),
        word_mask_(shape.line / 4 - 1),
        fill_words_(shape.fill == shape.line ? 0 : shape.fill / 4),
        write_back_(shape.write_back),
        lines_(shape.bytes / shape.line) {}

  std::uint32_t line_of(std::uint32_t address) const { return address >> line_shift_; }
  std::uint32_t line_bytes() const { return 1U << line_shift_; }

  /// Reads `words` words at `address`, which lie in one line (the rest of one that does not is left out).
  Found read(std::uint32_t address, std::uint32_t words) {
    const std::uint32_t line = address >> line_shift_;
    Line* const set = &lines_[(line & set_mask_) * ways_];
    const std::uint32_t wanted = wanted_words(address, words);
    if (set->tag == line && (set->words & wanted) == wanted)
      return Found::kHit;  // the latest of its set again
    if (find(set, line)) {
      if ((set->words & wanted) == wanted) return Found::kHit;
      set->words = (set->words | filled(wanted)) & 0x7fffffffU;
      return Found::kMiss;
    }
    return bring(set, line, filled(wanted), false);
  }

  Found write(std::uint32_t address) {
    const std::uint32_t line = address >> line_shift_;
    Line* const set = &lines_[(line & set_mask_) * ways_];
    if (set->tag == line || find(set, line)) {
      set->changed = write_back_;
      return Found::kHit;
    }
    return write_back_ ? bring(set, line, ~0U, true) : Found::kMiss;
  }

 private:
  struct Line {
    std::uint32_t tag = ~0U;
    std::uint32_t words : 31;  ///< valid ones
    std::uint32_t changed : 1;
    Line() : words(0), changed(0) {}
  };

  static std::uint32_t log2(std::uint32_t value) {
    std::uint32_t bits = 0;
    while (value >> bits > 1) ++bits;
    return bits;
  }
  std::uint32_t wanted_words(std::uint32_t address, std::uint32_t words) const {
    if (fill_words_ == 0) return 1;
    return ((1U << words) - 1) << (address >> 2 & word_mask_);
  }
  /// The words that come when those are wanted.
  std::uint32_t filled(std::uint32_t wanted) const {
    if (fill_words_ <= 1) return fill_words_ == 0 ? 0x7fffffffU : wanted;
    std::uint32_t all = 0;
    const std::uint32_t block = (1U << fill_words_) - 1;
    for (std::uint32_t at = 0; at <= word_mask_; at += fill_words_) {
      if ((wanted & block << at) != 0) all |= block << at;
    }
    return all;
  }
  /// Looks in the whole set; the line found comes to the front: sets are kept in the order of use.
  bool find(Line* set, std::uint32_t line) const {
    for (std::uint32_t way = 1; way < ways_; ++way) {
      if (set[way].tag != line) continue;
      to_front(set, way);
      return true;
    }
    return set->tag == line;
  }
  Found bring(Line* set, std::uint32_t line, std::uint32_t words, bool changed) const {
    const bool out = set[ways_ - 1].changed != 0;
    to_front(set, ways_ - 1);
    set->tag = line;
    set->words = words & 0x7fffffffU;
    set->changed = changed;
    return out ? Found::kMissCastOut : Found::kMiss;
  }
  static void to_front(Line* set, std::uint32_t way) {
    const Line moved = set[way];
    for (; way > 0; --way) set[way] = set[way - 1];
    *set = moved;
  }

  std::uint32_t ways_;
  std::uint32_t set_mask_;
  std::uint32_t line_shift_;
  std::uint32_t word_mask_;
  std::uint32_t fill_words_;
  bool write_back_;
  std::vector<Line> lines_;
};

}  // namespace cairn::profile
