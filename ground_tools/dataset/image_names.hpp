/// What names of images say: their order, and which side of a pair they are of.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cairn::ground {

/// Words by words, numbers by their value: frame_9 before frame_10, 000010 after 9, 000a after 0009,
/// 1403715273.25 before 1403715273.5. A point with digits on both sides is a decimal one where the whole name
/// is a number, or has 9 digits before it (seconds since 1970); else it stands between words. Names that so
/// are equal by text.
struct NameLess {
  bool operator()(const std::string& a, const std::string& b) const;
};

/// How names tell left from right: a word in letters of any case, or a number in this place. Both stand by
/// themselves in the name.
struct SideMark {
  const char* left = "";
  const char* right = "";
  int place = kAnywhere;  ///< of a number: the how-manieth of the name's numbers, from 0; kLast: the last one

  static constexpr int kAnywhere = -1;
  static constexpr int kLast = -2;
};

/// The name without the mark of that side; nothing where it has none.
std::optional<std::string> without_mark(const std::string& name, const SideMark& mark, bool right);

/// The mark by which most names of `left` (marked left) pair with one of `right` (marked right); the two may
/// be the same list. Known are left and right, l and r, cam0 and cam1, Mars rovers' NLF and NRF, and numbers
/// 0 and 1, 1 and 2, 2 and 3 in any place, with or without a zero before them. Nothing where fewer pair than
/// half of the names of words, three quarters of numbers.
std::optional<SideMark> find_side_mark(const std::vector<std::string>& left,
                                       const std::vector<std::string>& right);

/// All pairs of names, left and right, that differ by one mark, words first.
std::vector<std::pair<std::string, std::string>> pairs_by_mark(const std::vector<std::string>& names);

/// The numbers alone, where names are such but for a text that all begin with and one that all end with, and
/// none comes twice; else empty.
std::vector<std::string> bare_numbers(const std::vector<std::string>& names);

}  // namespace cairn::ground
