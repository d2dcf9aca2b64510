/// How a ground tool refuses: one line that names the file (or option) and the mend.
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>

namespace cairn::ground {

/// Bad input to a tool. `main` prints `cairn: <what>` on stderr and exits with 1. It is one line, whatever
/// it quotes: control characters are blanks.
class ToolError : public std::runtime_error {
 public:
  explicit ToolError(const std::string& words) : std::runtime_error(one_line(words)) {}
  template <typename... Args>
  explicit ToolError(fmt::format_string<Args...> format, Args&&... args)
      : ToolError(fmt::format(format, std::forward<Args>(args)...)) {}

 private:
  static std::string one_line(std::string words) {
    for (char& c : words) {
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = ' ';
    }
    return words;
  }
};

/// Throws ToolError where `value` is not within `least` to `most`, or is NaN.
template <typename Number>
void check_range(const std::string& option, Number value, Number least, Number most) {
  if (!(value >= least && value <= most))
    throw ToolError("{}: {} is out of range; give {} to {}", option, value, least, most);
}

}  // namespace cairn::ground
