#include "plot/svg.hpp"

namespace cairn::ground {

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      default: out += c;
    }
  }
  return out;
}

void Svg::open(double width_px, double height_px) {
  add(R"(<svg xmlns="http://www.w3.org/2000/svg" width="{0:.0f}" height="{1:.0f}" viewBox="0 0 {0:.0f} {1:.0f}">)",
      width_px, height_px);
  add("<style>text{{font-family:Helvetica,Arial,sans-serif;fill:#222}} .tick{{font-size:12px}} "
      ".name{{font-size:14px}} "
      ".grid{{stroke:#555;stroke-opacity:0.16;stroke-width:1}} .axis{{stroke:#444;stroke-width:1}} "
      ".frame{{fill:none;stroke:#444;stroke-width:1.2}} .plate{{fill:#fff;fill-opacity:0.75}}</style>");
  add(R"(<rect width="100%" height="100%" fill="#ffffff"/>)");
}

void Svg::line(double x0, double y0, double x1, double y1, const char* style) {
  add(R"(<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" {}/>)", x0, y0, x1, y1, style);
}

void Svg::text(double x, double y, const char* style, const std::string& words) {
  add(R"(<text x="{:.1f}" y="{:.1f}" {}>{}</text>)", x, y, style, escaped(words));
}

void Svg::path(const std::vector<Vec2>& pixels, const char* colour, double width, const char* dashes) {
  std::string points;
  for (const Vec2& p : pixels) fmt::format_to(std::back_inserter(points), "{:.1f},{:.1f} ", p.x(), p.y());
  constexpr const char* kForm =
      R"(<polyline points="{}" fill="none" stroke="{}" stroke-width="{}" stroke-linejoin="round" {}/>)";
  add(kForm, points, "#ffffff", width + 2.0, R"(stroke-opacity="0.75")");
  add(kForm, points, colour, width, dashes);
}

}  // namespace cairn::ground
