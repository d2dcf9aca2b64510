#include "plot/svg_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "base/tool_error.hpp"
#include "plot/axes.hpp"
#include "plot/ortho_piece.hpp"
#include "plot/svg.hpp"

namespace cairn::ground {
namespace {

constexpr double kLeft = 70.0;  // pixels: room for the y axis
constexpr double kTop = 74.0;
constexpr double kMapMaxWidth = 900.0;
constexpr double kMapMaxHeight = 820.0;
constexpr double kLegendWidth = 212.0;
constexpr double kErrorHeight = 210.0;
constexpr double kAxisRoom = 58.0;

/// The paths with a margin, made neither too flat nor too tall.
Box view_of(const ReplayPlot& plot) {
  Box box{Vec2::Constant(1.0e300), Vec2::Constant(-1.0e300)};
  for (const auto* path : {&plot.truth_map_m, &plot.vo_map_m, &plot.corrected_map_m}) {
    for (const Vec2& p : *path) {
      box.low_m = box.low_m.cwiseMin(p);
      box.high_m = box.high_m.cwiseMax(p);
    }
  }
  if (!(box.low_m.x() <= box.high_m.x())) throw ToolError("plot: no path to draw; replay at least one frame");
  const double longest = box.size_m().maxCoeff();
  const Vec2 middle = 0.5 * (box.low_m + box.high_m);
  Vec2 size = box.size_m() + Vec2::Constant(2.0 * std::max(1.0, 0.08 * longest));
  constexpr double kFlattest = 0.6;
  size = size.cwiseMax(Vec2::Constant(kFlattest * size.maxCoeff()));
  return {middle - 0.5 * size, middle + 0.5 * size};
}

void draw_boulders(Svg& svg, const Panel& panel, const std::vector<PlotBoulder>& boulders, const char* style,
                   double least_px) {
  svg.add("<g {}>", style);
  const double px_per_m = panel.width / panel.box.size_m().x();
  for (const PlotBoulder& b : boulders) {
    if (!panel.shows(b.p_map_m)) continue;
    svg.add(R"(<circle cx="{:.1f}" cy="{:.1f}" r="{:.1f}"/>)", panel.px(b.p_map_m.x()),
            panel.py(b.p_map_m.y()), std::max(least_px, 0.5 * b.diameter_m * px_per_m));
  }
  svg.add("</g>");
}

std::vector<Vec2> in_pixels(const Panel& panel, const std::vector<Vec2>& points) {
  std::vector<Vec2> out;
  for (const Vec2& p : points) out.emplace_back(panel.px(p.x()), panel.py(p.y()));
  return out;
}

std::vector<Vec2> in_pixels(const Panel& panel, const std::vector<ErrorSample>& samples) {
  std::vector<Vec2> out;
  for (const ErrorSample& s : samples) out.emplace_back(panel.px(s.distance_m), panel.py(s.xy_m));
  return out;
}

/// How much longer than true corrections are drawn: the longest at most a twelfth of the view.
double fix_magnification(const ReplayPlot& plot, const Box& view) {
  double longest = 0.0;
  for (const PlotFix& fix : plot.fixes) longest = std::max(longest, fix.correction_m.norm());
  double magnification = 1.0;
  for (const double factor : {2.0, 5.0, 10.0, 20.0, 50.0}) {
    if (factor * longest <= view.size_m().maxCoeff() / 12.0) magnification = factor;
  }
  return magnification;
}

void draw_diamond(Svg& svg, double x, double y, bool used) {
  svg.add(R"(<path d="M{:.1f} {:.1f} l6 6 l-6 6 l-6 -6 z" fill="{}" stroke="{}" stroke-width="1.6"/>)", x,
          y - 6.0, used ? kFix : "#ffffff", used ? "#ffffff" : kFix);
}

void draw_fixes(Svg& svg, const Panel& panel, const ReplayPlot& plot, double magnification) {
  for (const PlotFix& fix : plot.fixes) {
    if (!panel.shows(fix.p_map_m)) continue;
    const Vec2 tip = fix.p_map_m + magnification * fix.correction_m;
    const double x = panel.px(fix.p_map_m.x());
    const double y = panel.py(fix.p_map_m.y());
    if (fix.used) {
      for (const char* style :
           {R"(stroke="#ffffff" stroke-width="4")", R"(stroke="#8F3F6B" stroke-width="2")"}) {
        svg.line(x, y, panel.px(tip.x()), panel.py(tip.y()), style);
      }
    }
    draw_diamond(svg, x, y, fix.used);
  }
}

void draw_scale_and_north(Svg& svg, const Panel& panel) {
  const double metres = nice_step(panel.box.size_m().x(), 7);
  const double length = metres / panel.box.size_m().x() * panel.width;
  const double x = panel.left + 16.0;
  const double y = panel.bottom() - 16.0;
  svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="36" class="plate"/>)", x - 8.0, y - 26.0,
          length + 16.0);
  svg.add(R"(<path d="M{0:.1f} {1:.1f} v6 h{2:.1f} v-6" fill="none" stroke="#000" stroke-width="2"/>)", x,
          y - 4.0, length);
  svg.text(x + length / 2.0, y - 9.0, R"(class="tick" text-anchor="middle")",
           tick_label(metres, metres) + " m");
  const double nx = panel.right() - 26.0;
  const double ny = panel.top + 14.0;
  svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="32" height="50" class="plate"/>)", nx - 16.0, ny - 6.0);
  svg.add(R"(<path d="M{:.1f} {:.1f} l7 22 l-7 -5 l-7 5 z" fill="#000"/>)", nx, ny);
  svg.text(nx, ny + 38.0, R"(class="name" text-anchor="middle")", "N");
}

void draw_map(Svg& svg, const Panel& panel, const ReplayPlot& plot, double magnification) {
  const double step = nice_step(panel.box.size_m().maxCoeff(), 8);
  svg.add(R"(<clipPath id="map"><rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}"/></clipPath>)",
          panel.left, panel.top, panel.width, panel.height);
  svg.add(R"svg(<g clip-path="url(#map)">)svg");
  // Grey where no orthoimage is: the boulders' yellow and the lines' light edges need it.
  svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="#b4b4b4"/>)", panel.left,
          panel.top, panel.width, panel.height);
  if (!plot.orthoimage.empty()) {
    Box asked = panel.box;
    asked.low_m += plot.p_proj_map_m;
    asked.high_m += plot.p_proj_map_m;
    const OrthoPiece piece = read_ortho_piece(plot.orthoimage, asked, 1200);
    const Vec2 low = piece.box.low_m - plot.p_proj_map_m;
    const Vec2 high = piece.box.high_m - plot.p_proj_map_m;
    if (!piece.base64.empty()) {
      svg.add(
          R"(<image x="{:.2f}" y="{:.2f}" width="{:.2f}" height="{:.2f}" preserveAspectRatio="none" opacity="0.72" )"
          R"(href="data:image/jpeg;base64,{}"/>)",
          panel.px(low.x()), panel.py(high.y()), panel.px(high.x()) - panel.px(low.x()),
          panel.py(low.y()) - panel.py(high.y()), piece.base64);
    }
  }
  draw_grid(svg, panel, step, step);
  draw_boulders(svg, panel, plot.orbital, R"(fill="none" stroke="#F0E442" stroke-width="1.6")", 3.0);
  draw_boulders(svg, panel, plot.ground,
                R"(fill="#56B4E9" fill-opacity="0.6" stroke="#ffffff" stroke-width="1")", 2.6);
  svg.path(in_pixels(panel, plot.truth_map_m), kTruth, 4.0, "");
  svg.path(in_pixels(panel, plot.vo_map_m), kVo, 2.4, R"(stroke-dasharray="9 4")");
  svg.path(in_pixels(panel, plot.corrected_map_m), kCorrected, 2.4, "");
  draw_fixes(svg, panel, plot, magnification);
  draw_scale_and_north(svg, panel);
  svg.add("</g>");
  draw_axes(svg, panel, step, step, "x, east (m)", "y, north (m)");
}

/// Colours of trust, from good to bad.
const char* colour_of_trust(const std::string& state) {
  if (state == "confirmed") return "#009E73";
  if (state == "claimed") return "#999999";
  if (state == "coasting") return "#56B4E9";
  return state == "lost" ? "#B00020" : "#E69F00";
}

/// Entries of what is there, from (x, y) downwards.
void draw_legend(Svg& svg, double x, double y, const ReplayPlot& plot, double magnification) {
  const auto entry = [&](bool there, const std::string& words, const std::function<void(double)>& draw) {
    if (!there) return;
    draw(y);
    svg.text(x + 40.0, y + 4.5, R"(class="name")", words);
    y += 26.0;
  };
  const auto line = [&](const char* colour, double width, const char* dashes) {
    return [&svg, x, colour, width, dashes](double at) {
      svg.path({Vec2(x, at), Vec2(x + 30.0, at)}, colour, width, dashes);
    };
  };
  const auto circle = [&](const char* style) {
    return [&svg, x, style](double at) {
      svg.add(R"(<circle cx="{:.1f}" cy="{:.1f}" r="5.5" {}/>)", x + 15.0, at, style);
    };
  };
  const auto diamond = [&](bool used) {
    return [&svg, x, used](double at) { draw_diamond(svg, x + 15.0, at, used); };
  };
  const auto any = [&](bool used) {
    return std::any_of(plot.fixes.begin(), plot.fixes.end(),
                       [used](const PlotFix& f) { return f.used == used; });
  };
  entry(!plot.truth_map_m.empty(), "true path", line(kTruth, 4.0, ""));
  entry(!plot.vo_map_m.empty(), "VO alone", line(kVo, 2.4, R"(stroke-dasharray="9 4")"));
  entry(!plot.corrected_map_m.empty(), "corrected", line(kCorrected, 2.4, ""));
  // On white, yellow alone is faint: the key stands on the grey that it has in the picture.
  if (!plot.orbital.empty())
    svg.add(R"(<circle cx="{:.1f}" cy="{:.1f}" r="10" fill="#8a8a8a"/>)", x + 15.0, y);
  entry(!plot.orbital.empty(), "orbital boulder", circle(R"(fill="none" stroke="#F0E442" stroke-width="2")"));
  entry(!plot.ground.empty(), "ground boulder", circle(R"(fill="#56B4E9" stroke="#ffffff")"));
  entry(any(true), "fix, and its correction", diamond(true));
  if (any(true) && magnification > 1.0) {
    svg.text(x + 40.0, y - 5.0, R"(class="tick")", fmt::format("(drawn {:.0f} times longer)", magnification));
    y += 14.0;
  }
  const auto bar = [&](const char* colour, double opacity, double height) {
    return [&svg, x, colour, opacity, height](double at) {
      svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="30" height="{}" fill="{}" fill-opacity="{}"/>)", x,
              at - 0.5 * height, height, colour, opacity);
    };
  };
  entry(!plot.three_sigma.empty(), "3 sigma, as claimed", bar(kCorrected, 0.15, 14.0));
  std::set<std::string> states;
  for (const PlotTrust& t : plot.trust) states.insert(t.state);
  for (const std::string& state : states) entry(true, "pose " + state, bar(colour_of_trust(state), 1.0, 6.0));
  entry(any(false), "fix not used:", diamond(false));
  std::map<std::string, int> refused;
  for (const PlotFix& fix : plot.fixes) refused[fix.verdict] += fix.used ? 0 : 1;
  for (const auto& [verdict, times] : refused) {
    if (times == 0 || verdict.empty()) continue;
    svg.text(x + 40.0, y - 5.0, R"(class="tick")", fmt::format("{} {}", times, verdict));
    y += 16.0;
  }
}

/// The claim, behind the curves; what is above the panel is cut off.
void draw_band(Svg& svg, const Panel& panel, const std::vector<ErrorSample>& three_sigma) {
  if (three_sigma.empty()) return;
  std::string points = fmt::format("{:.1f},{:.1f}", panel.px(three_sigma.front().distance_m), panel.bottom());
  for (const ErrorSample& s : three_sigma) {
    points += fmt::format(" {:.1f},{:.1f}", panel.px(s.distance_m),
                          panel.py(std::min(s.xy_m, panel.box.high_m.y())));
  }
  points += fmt::format(" {:.1f},{:.1f}", panel.px(three_sigma.back().distance_m), panel.bottom());
  svg.add(R"(<polygon class="band" points="{}" fill="{}" fill-opacity="0.15"/>)", points, kCorrected);
}

void draw_trust(Svg& svg, const Panel& panel, const std::vector<PlotTrust>& trust) {
  for (const PlotTrust& t : trust) {
    const double from = panel.px(t.from_m);
    svg.add(R"(<rect class="trust" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="6" fill="{}"/>)", from,
            panel.bottom() - 6.0, std::max(1.0, panel.px(t.to_m) - from), colour_of_trust(t.state));
  }
}

void draw_curve_end(Svg& svg, const Panel& panel, const ErrorSample& end, const char* colour, double y) {
  svg.add(R"(<text x="{:.1f}" y="{:.1f}" class="name" style="fill:{}">{:.3f} m at the end</text>)",
          panel.right() + 10.0, y, colour, end.xy_m);
}

void draw_errors(Svg& svg, Panel panel, const ReplayPlot& plot) {
  double far = 1.0e-3;
  double most = 1.0e-3;
  for (const auto* curve : {&plot.vo_error, &plot.corrected_error}) {
    for (const ErrorSample& s : *curve) {
      far = std::max(far, s.distance_m);
      most = std::max(most, s.xy_m);
    }
  }
  double claimed = 0.0;
  for (const ErrorSample& s : plot.three_sigma) claimed = std::max(claimed, s.xy_m);
  most = std::max(most, std::min(claimed, 2.5 * most));  // the band's edge, where there is room for it
  const double step_x = nice_step(far, 10);
  const double step_y = nice_step(1.05 * most, 5);
  panel.box = {Vec2(0.0, 0.0), Vec2(far, step_y * std::ceil(1.05 * most / step_y))};
  draw_band(svg, panel, plot.three_sigma);
  draw_grid(svg, panel, step_x, step_y);
  for (const PlotFix& fix : plot.fixes) {
    if (!fix.used || fix.distance_m > far) continue;
    svg.line(panel.px(fix.distance_m), panel.top, panel.px(fix.distance_m), panel.bottom(),
             R"(stroke="#CC79A7" stroke-width="1.2" stroke-dasharray="2 4")");
  }
  svg.path(in_pixels(panel, plot.vo_error), kVo, 2.4, R"(stroke-dasharray="9 4")");
  svg.path(in_pixels(panel, plot.corrected_error), kCorrected, 2.4, "");
  draw_trust(svg, panel, plot.trust);
  draw_axes(svg, panel, step_x, step_y, "distance along the true path (m)", "error in x, y (m)");

  // Each curve's last value stands beside its end; two that are close are pushed apart.
  const bool both = !plot.vo_error.empty() && !plot.corrected_error.empty();
  double vo_y = plot.vo_error.empty() ? 0.0 : panel.py(plot.vo_error.back().xy_m) + 5.0;
  double corrected_y = plot.corrected_error.empty() ? 0.0 : panel.py(plot.corrected_error.back().xy_m) + 5.0;
  if (both && std::fabs(vo_y - corrected_y) < 18.0) {
    const double middle = 0.5 * (vo_y + corrected_y);
    const double side = vo_y <= corrected_y ? 9.0 : -9.0;
    vo_y = middle - side;
    corrected_y = middle + side;
  }
  if (!plot.vo_error.empty()) draw_curve_end(svg, panel, plot.vo_error.back(), kVo, vo_y);
  if (!plot.corrected_error.empty())
    draw_curve_end(svg, panel, plot.corrected_error.back(), kCorrected, corrected_y);
}

}  // namespace

std::string render_svg(const ReplayPlot& plot) {
  Panel map;
  map.box = view_of(plot);
  const double px_per_m = std::min(kMapMaxWidth / map.box.size_m().x(), kMapMaxHeight / map.box.size_m().y());
  map.left = kLeft;
  map.top = kTop;
  map.width = px_per_m * map.box.size_m().x();
  map.height = px_per_m * map.box.size_m().y();
  const bool has_errors = !plot.vo_error.empty() || !plot.corrected_error.empty();
  const Panel errors{map.left, map.bottom() + kAxisRoom + 12.0, map.width, kErrorHeight, {}};
  const double width = map.right() + kLegendWidth;
  const double height = (has_errors ? errors.bottom() : map.bottom()) + kAxisRoom;
  const double magnification = fix_magnification(plot, map.box);

  Svg svg;
  svg.open(width, height);
  svg.text(map.left, 32.0, R"(font-size="20" font-weight="bold")", plot.title);
  svg.text(map.left, 55.0, R"(font-size="14")", plot.subtitle);
  draw_map(svg, map, plot, magnification);
  draw_legend(svg, map.right() + 22.0, map.top + 14.0, plot, magnification);
  if (has_errors) draw_errors(svg, errors, plot);
  svg.add("</svg>");
  return svg.str();
}

}  // namespace cairn::ground
