/// Options that are several numbers: `--prior 1,2,30`.
#pragma once

#include <string>
#include <vector>

namespace cairn::ground {

/// `count` finite numbers between commas. Throws ToolError that names `option`; `mend` tells what to give.
std::vector<double> parse_numbers(const std::string& text, std::size_t count, const char* option,
                                  const std::string& mend);

}  // namespace cairn::ground
