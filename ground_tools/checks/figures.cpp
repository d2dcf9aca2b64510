// Sizes and budgets as the target's compiler has them. Nothing here runs: figures.py reads them from the
// names of these instances.
#include <utility>

#include "app/flight_app.hpp"

namespace cairn {

constexpr app::RootPart kLibrary[] = {
    {"code and constants", 0, cfg::kCodeMaxBytes},
    {"stack", 0, cfg::kStackMaxBytes},
};
constexpr const app::RootPart* kTables[] = {app::kRootParts, kLibrary};

constexpr std::size_t length(const char* text) {
  std::size_t n = 0;
  while (text[n] != '\0') ++n;
  return n;
}

template <int table, int row, std::size_t bytes, std::size_t max_bytes, char... name>
void figure() {}

template <int table, int row, std::size_t... k>
void one_row(std::index_sequence<k...>) {
  constexpr const app::RootPart& part = kTables[table][row];
  figure<table, row, part.bytes, part.max_bytes, part.name[k]...>();
}
template <int table, int... row>
void all_rows(std::integer_sequence<int, row...>) {
  (one_row<table, row>(std::make_index_sequence<length(kTables[table][row].name)>()), ...);
}
void all_tables() {
  all_rows<0>(std::make_integer_sequence<int, sizeof(app::kRootParts) / sizeof(app::RootPart)>());
  all_rows<1>(std::make_integer_sequence<int, sizeof(kLibrary) / sizeof(app::RootPart)>());
}

}  // namespace cairn
