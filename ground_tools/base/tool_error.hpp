/// How a ground tool refuses: one line that names the file (or option) and the mend.
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>

namespace cairn::ground {

/// Bad input to a tool. `main` prints `cairn: <what>` on stderr and exits with 1. It is one line, whatever
/// it quotes: control characters are blanks, and what is no UTF-8 a question mark.
class ToolError : public std::runtime_error {
 public:
  explicit ToolError(const std::string& words) : std::runtime_error(one_line(words)) {}
  template <typename... Args>
  explicit ToolError(fmt::format_string<Args...> format, Args&&... args)
      : ToolError(fmt::format(format, std::forward<Args>(args)...)) {}

 private:
  /// Every lead byte with as many behind it as it announces.
  static bool is_utf8(const std::string& words) {
    int behind = 0;
    for (const char c : words) {
      const auto byte = static_cast<unsigned char>(c);
      if ((byte & 0xC0U) == 0x80U) {
        if (behind-- == 0) return false;
      } else if (behind != 0 || byte >= 0xF8U) {
        return false;
      } else {
        behind = byte >= 0xF0U ? 3 : byte >= 0xE0U ? 2 : byte >= 0xC0U ? 1 : 0;
      }
    }
    return behind == 0;
  }
  static std::string one_line(std::string words) {
    const bool text = is_utf8(words);
    for (char& c : words) {
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = ' ';
      if (!text && static_cast<unsigned char>(c) >= 0x80) c = '?';
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
