/// Functions of an image, from the symbol table of its ELF file (32 bits, big-endian).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace cairn::profile {

struct Symbol {
  std::uint32_t start;
  std::uint32_t end;
  std::string name;  ///< as linked (mangled)
};

/// Sorted by address, no two overlap; the first stands for what lies outside all. A symbol without a size, as
/// assembly has them, reaches to the next one. Throws std::runtime_error, one line with the file
/// and the mend.
std::vector<Symbol> read_symbols(const std::string& path);

/// Index of the one that holds `address`; 0 where there is none.
int find_symbol(const std::vector<Symbol>& symbols, std::uint32_t address);

}  // namespace cairn::profile
