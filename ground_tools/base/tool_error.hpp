/// How a ground tool refuses: one line that names the file (or option) and the mend.
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>

namespace cairn::ground {

/// Bad input to a tool. `main` prints `cairn: <what>` on stderr and exits with 1.
class ToolError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
  template <typename... Args>
  explicit ToolError(fmt::format_string<Args...> format, Args&&... args)
      : std::runtime_error(fmt::format(format, std::forward<Args>(args)...)) {}
};

/// Throws ToolError where `value` is not within `least` to `most`, or is NaN.
template <typename Number>
void check_range(const std::string& option, Number value, Number least, Number most) {
  if (!(value >= least && value <= most))
    throw ToolError("{}: {} is out of range; give {} to {}", option, value, least, most);
}

}  // namespace cairn::ground
