#include "profile/plugin/symbols.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace cairn::profile {
namespace {

constexpr std::uint32_t kSymbolTable = 2;  // SHT_SYMTAB
constexpr int kFunction = 2;               // STT_FUNC
constexpr int kNoType = 0;                 // STT_NOTYPE: labels in assembly
constexpr std::uint32_t kExecutable = 4;   // SHF_EXECINSTR

class Image {
 public:
  explicit Image(const std::string& path) : path_(path) {
    std::ifstream in(path, std::ios::binary);
    if (!in) throw std::runtime_error(path + ": cannot be read; build the image first");
    bytes_.assign(std::istreambuf_iterator<char>(in), {});
    const bool big = bytes_.size() >= 52 && bytes_[4] == 1 && bytes_[5] == 2;
    wide = bytes_.size() >= 64 && bytes_[4] == 2 && bytes_[5] == 1;
    if (bytes_.compare(0, 4, "\177ELF") != 0 || !(big || wide))
      throw std::runtime_error(path +
                               ": is neither a 32-bit big-endian nor a 64-bit little-endian ELF file; "
                               "give the image that runs");
  }
  /// Of a wide address, offset or size the lower half: the boards' memory ends below 4 GiB.
  std::uint32_t u32(std::size_t at) const { return number(at, 4); }
  std::uint32_t u16(std::size_t at) const { return number(at, 2); }
  std::uint8_t u8(std::size_t at) const {
    need(at + 1);
    return static_cast<std::uint8_t>(bytes_[at]);
  }
  std::string text(std::size_t at) const {
    need(at + 1);
    return bytes_.c_str() + at;
  }
  [[noreturn]] void fail(const char* why) const { throw std::runtime_error(path_ + ": " + why); }

  bool wide;  ///< 64 bits, little-endian; else 32, big-endian

 private:
  std::uint32_t number(std::size_t at, std::size_t size) const {
    need(at + size);
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i)
      value = value << 8 | static_cast<unsigned char>(bytes_[wide ? at + size - 1 - i : at + i]);
    return value;
  }
  void need(std::size_t end) const {
    if (end > bytes_.size()) fail("is cut off; build the image again");
  }
  std::string path_;
  std::string bytes_;
};

struct Section {
  std::uint32_t type, flags, address, offset, size, link;
};

std::vector<Section> sections_of(const Image& image) {
  std::vector<Section> out;
  const std::size_t table = image.u32(image.wide ? 40 : 32);
  const std::size_t entry = image.u16(image.wide ? 58 : 46);
  const std::size_t count = image.u16(image.wide ? 60 : 48);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = table + i * entry;
    out.push_back(image.wide ? Section{image.u32(at + 4), image.u32(at + 8), image.u32(at + 16),
                                       image.u32(at + 24), image.u32(at + 32), image.u32(at + 40)}
                             : Section{image.u32(at + 4), image.u32(at + 8), image.u32(at + 12),
                                       image.u32(at + 16), image.u32(at + 20), image.u32(at + 24)});
  }
  return out;
}

/// Ends each where the next begins, or with its section; of several at one address the one with a size stays.
void close_gaps(std::vector<Symbol>& symbols, const std::vector<Section>& sections) {
  std::stable_sort(symbols.begin(), symbols.end(), [](const Symbol& a, const Symbol& b) {
    return a.start != b.start ? a.start < b.start : a.end > b.end;
  });
  symbols.erase(std::unique(symbols.begin(), symbols.end(),
                            [](const Symbol& a, const Symbol& b) { return a.start == b.start; }),
                symbols.end());
  for (std::size_t i = 0; i < symbols.size(); ++i) {
    std::uint32_t limit = i + 1 < symbols.size() ? symbols[i + 1].start : UINT32_MAX;
    for (const Section& s : sections) {
      if ((s.flags & kExecutable) != 0 && symbols[i].start >= s.address &&
          symbols[i].start < s.address + s.size)
        limit = std::min(limit, s.address + s.size);
    }
    if (symbols[i].end == symbols[i].start || symbols[i].end > limit) symbols[i].end = limit;
  }
}

}  // namespace

std::vector<Symbol> read_symbols(const std::string& path) {
  const Image image(path);
  const std::vector<Section> sections = sections_of(image);
  std::vector<Symbol> out;
  for (const Section& table : sections) {
    if (table.type != kSymbolTable) continue;
    if (table.link >= sections.size()) image.fail("has a broken symbol table; build the image again");
    const std::size_t names = sections[table.link].offset;
    const std::size_t entry = image.wide ? 24 : 16;
    for (std::size_t at = table.offset; at + entry <= std::size_t{table.offset} + table.size; at += entry) {
      const int type = image.u8(at + (image.wide ? 4 : 12)) & 15;
      const std::uint32_t section = image.u16(at + (image.wide ? 6 : 14));
      const std::uint32_t start = image.u32(at + (image.wide ? 8 : 4));
      if ((type != kFunction && type != kNoType) || section == 0 || section >= sections.size() ||
          (sections[section].flags & kExecutable) == 0) {
        continue;
      }
      const std::string name = image.text(names + image.u32(at));
      if (type == kNoType && (name.empty() || name[0] == '.' || name[0] == '$')) continue;
      out.push_back({start, start + image.u32(at + (image.wide ? 16 : 8)), name});
    }
  }
  if (out.empty()) image.fail("has no symbols of functions; link it without stripping");
  close_gaps(out, sections);
  out.insert(out.begin(), Symbol{0, 0, "(elsewhere)"});
  return out;
}

int find_symbol(const std::vector<Symbol>& symbols, std::uint32_t address) {
  const auto after = std::upper_bound(symbols.begin() + 1, symbols.end(), address,
                                      [](std::uint32_t a, const Symbol& s) { return a < s.start; });
  const auto at = after - 1;
  return at != symbols.begin() && address < at->end ? static_cast<int>(at - symbols.begin()) : 0;
}

}  // namespace cairn::profile
