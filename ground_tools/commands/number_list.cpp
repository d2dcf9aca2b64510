#include "commands/number_list.hpp"

#include "base/number_table.hpp"
#include "base/tool_error.hpp"

namespace cairn::ground {

std::vector<double> parse_numbers(const std::string& text, std::size_t count, const char* option,
                                  const std::string& mend) {
  const std::vector<std::string_view> parts = split(text, ',');
  if (parts.size() != count) throw ToolError("{}: {} values; {}", option, parts.size(), mend);
  std::vector<double> numbers;
  for (const std::string_view part : parts) {
    const std::optional<double> value = to_finite(part);
    if (!value) throw ToolError("{}: '{}' is not a finite number; {}", option, part, mend);
    numbers.push_back(*value);
  }
  return numbers;
}

}  // namespace cairn::ground
