#include "plot/single_page.hpp"

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

}  // namespace

std::string single_page(const std::string& title, const std::string& style, const std::string& body,
                        const ordered_json& data, const std::string& script) {
  std::string page;
  page +=
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
      "style-src 'unsafe-inline'; script-src 'unsafe-inline'\">\n<title>";
  page += title;
  page += "</title>\n<style>\n";
  page += style;
  page += "</style>\n</head>\n<body>\n";
  page += body;
  page += "<script type=\"application/json\" id=\"data\">";
  page += script_safe(data);
  page += "</script>\n<script>\n";
  page += script;
  page += "</script>\n</body>\n</html>\n";
  return page;
}

}  // namespace cairn::ground
