#include "dataset/image_names.hpp"

#include <algorithm>
#include <set>
#include <string_view>
#include <tuple>

#include "base/number_table.hpp"

namespace cairn::ground {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

/// Of a name: a number (its digits before the point, without zeros before them, and behind it) or text.
struct Part {
  bool is_text = false;
  std::size_t digits = 0;
  std::string whole;
  std::string fraction;

  bool operator<(const Part& other) const {
    return std::tie(is_text, digits, whole, fraction) <
           std::tie(other.is_text, other.digits, other.whole, other.fraction);
  }
};

std::size_t end_of_run(std::string_view name, std::size_t at, bool digits) {
  while (at < name.size() && is_digit(name[at]) == digits) ++at;
  return at;
}

/// Counters are in hexadecimal, too: 0009, 000a. Decimal ones are in the same order so.
bool is_hexadecimal(std::string_view name) {
  const auto fits = [](char c) { return is_digit(c) || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F'); };
  return std::all_of(name.begin(), name.end(), fits) && std::any_of(name.begin(), name.end(), is_digit);
}

Part number_of(std::string_view digits) {
  Part part;
  part.whole = digits;
  part.whole.erase(0, std::min(part.whole.find_first_not_of('0'), part.whole.size()));
  part.digits = part.whole.size();
  return part;
}

std::vector<Part> parts_of(std::string_view name) {
  constexpr std::size_t kSeconds = 9;
  std::vector<Part> parts;
  if (is_hexadecimal(name)) return {number_of(name)};
  for (std::size_t at = 0; at < name.size();) {
    const bool digits = is_digit(name[at]);
    std::size_t end = end_of_run(name, at, digits);
    Part part;
    if (!digits) {
      part.is_text = true;
      part.whole = name.substr(at, end - at);
    } else {
      part = number_of(name.substr(at, end - at));
      const bool point = end + 1 < name.size() && name[end] == '.' && is_digit(name[end + 1]);
      const std::size_t last = point ? end_of_run(name, end + 1, true) : end;
      if (point && (end - at >= kSeconds || (at == 0 && last == name.size()))) {
        part.fraction = name.substr(end + 1, last - end - 1);
        part.fraction.erase(part.fraction.find_last_not_of('0') + 1);
        end = last;
      }
    }
    parts.push_back(std::move(part));
    at = end;
  }
  return parts;
}

/// Between two characters of a name another word or number begins: img_0, img0, imgLeft.
bool parts_words(char a, char b) {
  const bool capital = b >= 'A' && b <= 'Z' && a >= 'a' && a <= 'z';
  return capital || !((is_letter(a) && is_letter(b)) || (is_digit(a) && is_digit(b)));
}

/// `word` is in small letters, and stands in the name in any: left, Left, LEFT.
std::size_t find_word(const std::string& name, std::string_view word) {
  std::string small = name;
  for (char& c : small) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  for (std::size_t at = small.find(word); at != std::string::npos; at = small.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    const bool begins = at == 0 || parts_words(name[at - 1], name[at]);
    if (begins && (end == name.size() || parts_words(name[end - 1], name[end]))) return at;
  }
  return std::string::npos;
}

std::size_t find_number(const std::string& name, std::string_view number, int place) {
  std::vector<std::size_t> begins;
  for (std::size_t at = 0; at < name.size(); at = end_of_run(name, at, is_digit(name[at]))) {
    if (is_digit(name[at])) begins.push_back(at);
  }
  const auto index = place == SideMark::kLast ? begins.size() - 1 : static_cast<std::size_t>(place);
  if (index >= begins.size()) return std::string::npos;
  const std::size_t at = begins[index], end = end_of_run(name, at, true);
  return std::string_view(name).substr(at, end - at) == number ? at : std::string::npos;
}

std::size_t pairs_by(const SideMark& mark, const std::vector<std::string>& left,
                     const std::vector<std::string>& right) {
  std::set<std::string> names;
  for (const std::string& name : left) {
    if (const auto bare = without_mark(name, mark, false)) names.insert(*bare);
  }
  return static_cast<std::size_t>(std::count_if(right.begin(), right.end(), [&](const std::string& name) {
    const auto bare = without_mark(name, mark, true);
    return bare && names.count(*bare) != 0;
  }));
}

/// Words first: of marks that pair as many, the surest.
std::vector<SideMark> known_marks() {
  std::vector<SideMark> marks = {{"left", "right"}, {"cam0", "cam1"}, {"l", "r"},     {"i1", "i2"},
                                 {"im0", "im1"},    {"nla", "nra"},   {"nlb", "nrb"}, {"nlf", "nrf"},
                                 {"fla", "fra"},    {"flb", "frb"},   {"flf", "frf"}};
  constexpr int kMostPlaces = 4;
  for (const auto& [a, b] :
       {std::pair("0", "1"), {"1", "2"}, {"2", "3"}, {"00", "01"}, {"01", "02"}, {"02", "03"}}) {
    marks.push_back({a, b, SideMark::kLast});
    for (int place = 0; place < kMostPlaces; ++place) marks.push_back({a, b, place});
  }
  return marks;
}

}  // namespace

bool NameLess::operator()(const std::string& a, const std::string& b) const {
  const std::vector<Part> of_a = parts_of(a), of_b = parts_of(b);
  if (of_a < of_b) return true;
  if (of_b < of_a) return false;
  return a < b;
}

std::optional<std::string> without_mark(const std::string& name, const SideMark& mark, bool right) {
  const std::string_view word = right ? mark.right : mark.left;
  const std::size_t at =
      mark.place == SideMark::kAnywhere ? find_word(name, word) : find_number(name, word, mark.place);
  if (at == std::string::npos) return std::nullopt;
  // What stood around the mark still stands apart.
  return name.substr(0, at) + "*" + name.substr(at + word.size());
}

std::optional<SideMark> find_side_mark(const std::vector<std::string>& left,
                                       const std::vector<std::string>& right) {
  const bool one_list = &left == &right;
  const std::size_t all = one_list ? left.size() : left.size() + right.size();
  std::optional<SideMark> best;
  std::size_t most = 0;
  for (const SideMark& mark : known_marks()) {
    const std::size_t pairs = pairs_by(mark, left, right);
    const bool words = mark.place == SideMark::kAnywhere;
    if (pairs <= most || (words ? 4 * pairs < all : 8 * pairs < 3 * all)) continue;
    most = pairs;
    best = mark;
  }
  return best;
}

std::vector<std::pair<std::string, std::string>> pairs_by_mark(const std::vector<std::string>& names) {
  std::vector<std::pair<std::string, std::string>> pairs;
  for (const SideMark& mark : known_marks()) {
    for (const std::string& left : names) {
      const auto bare = without_mark(left, mark, false);
      const auto right = std::find_if(names.begin(), names.end(), [&](const std::string& name) {
        return bare && without_mark(name, mark, true) == bare;
      });
      if (right != names.end()) pairs.emplace_back(left, *right);
    }
  }
  return pairs;
}

std::vector<std::string> bare_numbers(const std::vector<std::string>& names) {
  if (names.empty()) return {};
  std::string before = names[0];
  for (const std::string& name : names) {
    const auto differ = std::mismatch(before.begin(), before.end(), name.begin(), name.end()).first;
    before.erase(differ, before.end());
  }
  const auto drop_digits = [&before] { before.erase(before.find_last_not_of("0123456789") + 1); };
  drop_digits();  // they are of the number, and so are those before its point
  if (before.size() >= 2 && before.back() == '.' && is_digit(before[before.size() - 2])) {
    before.pop_back();
    drop_digits();
  }
  const auto behind = [](const std::string& name) {
    return name.substr(name.find_last_of("0123456789") + 1);
  };
  std::vector<std::string> numbers;
  std::set<std::string> known;
  for (const std::string& name : names) {
    const std::string after = behind(name);
    if (after != behind(names[0]) || name.size() <= before.size() + after.size()) return {};
    numbers.push_back(name.substr(before.size(), name.size() - before.size() - after.size()));
    if (!to_finite(numbers.back()) || !known.insert(numbers.back()).second) return {};
  }
  return numbers;
}

}  // namespace cairn::ground
