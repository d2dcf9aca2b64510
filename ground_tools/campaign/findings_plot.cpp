#include "campaign/findings_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "campaign/findings.hpp"
#include "plot/svg.hpp"

namespace cairn::ground {
namespace {

constexpr double kLeft = 76.0;
constexpr double kPanelWidth = 430.0;
constexpr double kPanelHeight = 300.0;
constexpr double kBetween = 56.0;
constexpr double kTop = 110.0;
constexpr double kBarHeight = 20.0;
constexpr double kGroupHeight = 62.0;

/// By FixVerdict. Right fixes have the colour of corrected poses, false ones that of plain VO.
constexpr const char* kVerdictColours[kFixVerdicts] = {kCorrected, "#56B4E9", "#BBBBBB", kVo};

std::vector<double> sorted(const std::vector<Trial>& trials, RunFigures Trial::*run,
                           double RunFigures::*figure) {
  std::vector<double> values;
  for (const Trial& t : trials) values.push_back(t.*run.*figure);
  std::sort(values.begin(), values.end());
  return values;
}

/// Errors on a logarithmic axis; both panels share it. Nothing below a millimetre is told apart.
constexpr double kLeast_m = 1.0e-3;
double log_of(double error_m) { return std::log10(std::max(error_m, kLeast_m)); }

/// The largest of 1, 2, 5 times a power of ten that is at most this; all as logarithms.
double labelled_below(double at) {
  const double decade = std::floor(at + 1.0e-9);
  for (const double factor : {5.0, 2.0}) {
    if (at - decade >= std::log10(factor) - 1.0e-9) return decade + std::log10(factor);
  }
  return decade;
}
double labelled_above(double at) { return -labelled_below(-at); }

Box box_of(const std::vector<Trial>& trials) {
  double low = 1.0e9;
  double high = -1.0e9;
  for (const auto run : {&Trial::as_it_is, &Trial::worse}) {
    for (const auto figure : {&RunFigures::vo_end_xy_m, &RunFigures::end_xy_m}) {
      const std::vector<double> values = sorted(trials, run, figure);
      low = std::min(low, log_of(values.front()));
      high = std::max(high, log_of(values.back()));
    }
  }
  low = labelled_below(low);
  return {Vec2(low, 0.0), Vec2(std::max(labelled_above(high), low + 1.0), 100.0)};
}

void draw_frame(Svg& svg, const Panel& panel, const char* title, bool names_y) {
  for (double decade = std::floor(panel.box.low_m.x()); decade <= panel.box.high_m.x() + 0.5; decade += 1.0) {
    for (const int factor : {1, 2, 3, 4, 5, 6, 7, 8, 9}) {
      const double at = decade + std::log10(factor);
      if (at < panel.box.low_m.x() - 1.0e-9 || at > panel.box.high_m.x() + 1.0e-9) continue;
      const bool labelled = factor == 1 || factor == 2 || factor == 5;
      const double x = panel.px(at);
      svg.line(x, panel.top, x, panel.bottom(), R"(class="grid")");
      svg.line(x, panel.bottom(), x, panel.bottom() + (labelled ? 6.0 : 3.0), R"(class="axis")");
      if (labelled)
        svg.text(x, panel.bottom() + 20.0, R"(class="tick" text-anchor="middle")",
                 fmt::format("{:g}", std::round(factor * std::pow(10.0, decade) * 1.0e6) * 1.0e-6));
    }
  }
  for (double y = 0.0; y <= 100.0; y += 25.0) {
    svg.line(panel.left, panel.py(y), panel.right(), panel.py(y), R"(class="grid")");
    svg.line(panel.left - 5.0, panel.py(y), panel.left, panel.py(y), R"(class="axis")");
    if (names_y)
      svg.text(panel.left - 9.0, panel.py(y) + 4.0, R"(class="tick" text-anchor="end")",
               fmt::format("{:g}", y));
  }
  svg.text(panel.left + 0.5 * panel.width, panel.bottom() + 40.0, R"(class="name" text-anchor="middle")",
           "error at the end, x and y (m)");
  if (names_y) {
    svg.add(
        R"svg(<text x="24" y="{0:.1f}" class="name" text-anchor="middle" transform="rotate(-90 24 {0:.1f})">drives within that error (%)</text>)svg",
        panel.top + 0.5 * panel.height);
  }
  svg.text(panel.left, panel.top - 10.0, R"(class="name" font-weight="bold")", title);
  svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" class="frame"/>)", panel.left,
          panel.top, panel.width, panel.height);
}

/// Steps up by one drive at each error.
void draw_curve(Svg& svg, const Panel& panel, const std::vector<double>& errors_m, const char* colour,
                const char* dashes) {
  std::vector<Vec2> points{Vec2(panel.px(log_of(errors_m.front())), panel.py(0.0))};
  for (std::size_t i = 0; i < errors_m.size(); ++i) {
    const double x = panel.px(log_of(errors_m[i]));
    points.emplace_back(x, points.back().y());
    points.emplace_back(x,
                        panel.py(100.0 * static_cast<double>(i + 1) / static_cast<double>(errors_m.size())));
  }
  svg.path(points, colour, 2.4, dashes);
}

void draw_curves(Svg& svg, const Panel& panel, const std::vector<Trial>& trials, RunFigures Trial::*run) {
  draw_curve(svg, panel, sorted(trials, run, &RunFigures::vo_end_xy_m), kVo, R"(stroke-dasharray="9 4")");
  draw_curve(svg, panel, sorted(trials, run, &RunFigures::end_xy_m), kCorrected, "");
}

void draw_line_key(Svg& svg, double x, double y) {
  svg.path({Vec2(x, y), Vec2(x + 34.0, y)}, kVo, 2.4, R"(stroke-dasharray="9 4")");
  svg.text(x + 42.0, y + 5.0, R"(class="name")", "VO alone");
  svg.path({Vec2(x + 130.0, y), Vec2(x + 164.0, y)}, kCorrected, 2.4, "");
  svg.text(x + 172.0, y + 5.0, R"(class="name")", "corrected");
}

void draw_verdict_key(Svg& svg, double x, double y) {
  for (int v = 0; v < kFixVerdicts; ++v) {
    svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="16" height="16" fill="{}"/>)", x, y - 8.0,
            kVerdictColours[v]);
    svg.text(x + 23.0, y + 5.0, R"(class="name")", name_of(static_cast<FixVerdict>(v)));
    x += v == 2 ? 112.0 : 88.0;
  }
}

void draw_bar(Svg& svg, double x, double y, double width, const std::string& name, const RunFindings& run) {
  svg.text(x - 8.0, y + 0.5 * kBarHeight + 4.5, R"(class="tick" text-anchor="end")", name);
  for (int v = 0; v < kFixVerdicts; ++v) {
    const Share& share = run.fixes[static_cast<std::size_t>(v)];
    if (share.hits == 0) continue;
    const double part = width * share.value();
    svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}" stroke="#fff"/>)", x, y,
            part, kBarHeight, kVerdictColours[v]);
    if (part > 8.0 * static_cast<double>(std::to_string(share.hits).size())) {
      const bool dark = v == 0 || v == 3;
      svg.add(R"(<text x="{:.1f}" y="{:.1f}" class="tick" text-anchor="middle" style="fill:{}">{}</text>)",
              x + 0.5 * part, y + 0.5 * kBarHeight + 4.5, dark ? "#fff" : "#222", share.hits);
    }
    x += part;
  }
}

void draw_bars(Svg& svg, double y, const std::vector<Findings>& maps) {
  const double x = kLeft + 150.0;
  const double width = 2.0 * kPanelWidth + kBetween - 150.0;
  for (const Findings& f : maps) {
    svg.text(kLeft - 52.0, y + kBarHeight + 6.0, R"(class="name" font-weight="bold")",
             fmt::format("{:g} mm", 1.0e3 * f.map_pixel_m));
    svg.text(kLeft - 52.0, y + kBarHeight + 22.0, R"(class="tick")",
             fmt::format("{} drive{}", f.trials, f.trials == 1 ? "" : "s"));
    draw_bar(svg, x, y, width, "VO as it is", f.as_it_is);
    draw_bar(svg, x, y + kBarHeight + 4.0, width, "made worse", f.worse);
    y += kGroupHeight;
  }
}

}  // namespace

std::string plot_findings(const std::vector<Trial>& trials) {
  const std::vector<Findings> maps = findings_by_map(trials);
  const Panel as_it_is{kLeft, kTop, kPanelWidth, kPanelHeight, box_of(trials)};
  Panel worse = as_it_is;
  worse.left = as_it_is.right() + kBetween;
  const double bars = as_it_is.bottom() + 118.0;

  Svg svg;
  svg.open(worse.right() + 30.0, bars + kGroupHeight * static_cast<double>(maps.size()) + 8.0);
  svg.text(24.0, 34.0, R"(font-size="20" font-weight="bold")",
           fmt::format("{} simulated drives, seeds {} to {}", trials.size(), trials.front().setup.seed,
                       trials.back().setup.seed));
  draw_line_key(svg, 24.0, 60.0);
  draw_frame(svg, as_it_is, "VO as it is", true);
  draw_frame(svg, worse, "VO made worse", false);
  draw_curves(svg, as_it_is, trials, &Trial::as_it_is);
  draw_curves(svg, worse, trials, &Trial::worse);
  svg.text(24.0, bars - 38.0, R"(class="name" font-weight="bold")",
           "Outcome of the fixes, by map resolution");
  draw_verdict_key(svg, 24.0, bars - 18.0);
  draw_bars(svg, bars, maps);
  svg.add("</svg>");
  return svg.str();
}

}  // namespace cairn::ground
