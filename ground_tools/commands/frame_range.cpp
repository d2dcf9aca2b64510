#include "commands/frame_range.hpp"

#include "base/tool_error.hpp"

namespace cairn::ground {

FrameRange parse_frames(const std::string& text) {
  const std::string mend =
      "give FIRST:END, whole numbers counted from 0, END not included; either may be omitted";
  const auto refuse = [&] { return ToolError("--frames: '{}' is not a range; {}", text, mend); };
  const auto index = [&](const std::string& part) {
    if (part.size() > 9 || part.find_first_not_of("0123456789") != std::string::npos) throw refuse();
    return static_cast<std::size_t>(std::stoul(part));
  };
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) throw refuse();
  const std::string first = text.substr(0, colon);
  const std::string end = text.substr(colon + 1);
  FrameRange range;
  if (!first.empty()) range.first = index(first);
  if (!end.empty()) range.end = index(end);
  return range;
}

}  // namespace cairn::ground
