#include "plot/single_page.hpp"

#include <map>

CAIRN_EMBED(cairn_page_html, "ground_tools/plot/page.html");
CAIRN_EMBED(cairn_page_css, "ground_tools/plot/page.css");
CAIRN_EMBED(cairn_page_js, "ground_tools/plot/page.js");

namespace cairn::ground {
namespace {

using nlohmann::ordered_json;

/// JSON text that may stand inside a script element: nothing in it can end the element.
std::string script_safe(const ordered_json& json) {
  std::string out;
  for (const char c : json.dump(-1, ' ', false, ordered_json::error_handler_t::replace)) {
    if (c == '<') {
      out += "\\u003c";
    } else {
      out += c;
    }
  }
  return out;
}

/// Each {{name}} of the frame by its part. What a part holds is left as it is.
std::string filled(const std::string& frame, const std::map<std::string, std::string>& parts) {
  std::string out;
  std::size_t at = 0;
  for (std::size_t open = 0; (open = frame.find("{{", at)) != std::string::npos;) {
    const std::size_t close = frame.find("}}", open);
    out += frame.substr(at, open - at);
    out += parts.at(frame.substr(open + 2, close - open - 2));
    at = close + 2;
  }
  return out + frame.substr(at);
}

}  // namespace

std::string single_page(const PageParts& parts, const ordered_json& data) {
  return filled(cairn_page_html, {{"title", parts.title},
                                  {"style", cairn_page_css + parts.style},
                                  {"body", parts.body},
                                  {"data", script_safe(data)},
                                  {"script", cairn_page_js + parts.script}});
}

}  // namespace cairn::ground
