#include "forecast/forecast_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/trig.hpp"
#include "plot/axes.hpp"
#include "plot/svg.hpp"

namespace cairn::ground {
namespace {

constexpr double kLeft = 70.0;
constexpr double kTop = 104.0;
constexpr double kWidth = 860.0;
constexpr double kTallest = 760.0;
constexpr double kLower = 170.0;
constexpr double kBetween = 78.0;

constexpr const char* kRight = "#009E73";
constexpr const char* kBlind = kVo;

Box view_of(const std::vector<PathPoint>& drive, double margin_m) {
  Box box{Vec2::Constant(1.0e300), Vec2::Constant(-1.0e300)};
  for (const PathPoint& p : drive) {
    box.low_m = box.low_m.cwiseMin(Vec2(p.x_m, p.y_m));
    box.high_m = box.high_m.cwiseMax(Vec2(p.x_m, p.y_m));
  }
  const Vec2 middle = 0.5 * (box.low_m + box.high_m);
  Vec2 size = box.size_m() + Vec2::Constant(2.0 * margin_m);
  size = size.cwiseMax(Vec2::Constant(0.3 * size.maxCoeff()));
  return {middle - 0.5 * size, middle + 0.5 * size};
}

/// Blue where a fix is as good as sure, pale where it is not to be had.
std::string shade(double probability) {
  const auto mix = [&](int none, int sure) {
    return static_cast<int>(std::lround(none + (sure - none) * probability));
  };
  return fmt::format("#{:02x}{:02x}{:02x}", mix(0xFF, 0x00), mix(0xFF, 0x72), mix(0xFF, 0xB2));
}

std::vector<Vec2> pixels(const Panel& panel, const std::vector<PathPoint>& drive, std::size_t first,
                         std::size_t last) {
  std::vector<Vec2> out;
  for (std::size_t i = first; i <= last; ++i)
    out.emplace_back(panel.px(drive[i].x_m), panel.py(drive[i].y_m));
  return out;
}

/// How much larger than they are the ellipses are drawn: the largest about as long as fixes lie apart.
double magnification_of(const Forecast& made, const Box& view) {
  double longest = 0.0;
  for (const FixStation& s : made.stations) {
    if (s.applied > 0.0) longest = std::max(longest, 2.0 * kEllipseSigmas * s.ellipse.major_m);
  }
  double chosen = 1.0;
  for (const double factor : {2.0, 5.0, 10.0, 20.0, 50.0, 100.0}) {
    if (factor * longest <= view.size_m().maxCoeff() / 14.0) chosen = factor;
  }
  return chosen;
}

void draw_stations(Svg& svg, const Panel& panel, const Forecast& made, double magnification) {
  const double px_per_m = panel.width / panel.box.size_m().x();
  for (const FixStation& s : made.stations) {
    const double x = panel.px(s.at.x_m);
    const double y = panel.py(s.at.y_m);
    if (s.applied > 0.0) {
      const double scale = kEllipseSigmas * magnification * px_per_m;
      svg.add(
          R"svg(<ellipse cx="{0:.1f}" cy="{1:.1f}" rx="{2:.1f}" ry="{3:.1f}" transform="rotate({4:.1f} {0:.1f} {1:.1f})" fill="none" stroke="{5}" stroke-width="1.2"/>)svg",
          x, y, scale * s.ellipse.major_m, scale * s.ellipse.minor_m, -s.ellipse.azimuth_rad * kDegPerRad,
          kFix);
    }
    svg.add(
        R"(<circle cx="{:.1f}" cy="{:.1f}" r="5" fill="{}" stroke="{}" stroke-width="1.6"><title>{}</title></circle>)",
        x, y, shade(s.applied), s.blind ? kBlind : kCorrected,
        fmt::format("{:.2f} m: applied {:.3f}, right {:.3f}, {:.1f} found of {:.1f} needed", s.at.arc_m,
                    s.applied, s.right, s.found, s.needed));
  }
}

/// An arrow from the start, along the first heading.
void draw_start(Svg& svg, const Panel& panel, const PathPoint& start) {
  svg.add(
      R"svg(<g transform="translate({:.1f} {:.1f}) rotate({:.1f})"><title>start</title><path d="M0,-7 L0,7 M0,0 L24,0 M16,-5 L24,0 L16,5" fill="none" stroke="#222222" stroke-width="2"/></g>)svg",
      panel.px(start.x_m), panel.py(start.y_m), -start.yaw_rad * kDegPerRad);
}

void draw_map(Svg& svg, const Panel& panel, const Forecast& made, const std::vector<TableBoulder>& boulders,
              const std::vector<PathPoint>& drive, double magnification) {
  const double step = nice_step(panel.box.size_m().maxCoeff(), 8);
  draw_grid(svg, panel, step, step);
  const double px_per_m = panel.width / panel.box.size_m().x();
  svg.add(R"(<g fill="#999" fill-opacity="0.7">)");
  for (const TableBoulder& b : boulders) {
    if (!panel.shows(b.p_map_m)) continue;
    svg.add(R"(<circle cx="{:.1f}" cy="{:.1f}" r="{:.1f}"/>)", panel.px(b.p_map_m.x()),
            panel.py(b.p_map_m.y()), std::max(0.8, 0.5 * b.diameter_m * px_per_m));
  }
  svg.add("</g>");
  svg.path(pixels(panel, drive, 0, drive.size() - 1), "#444444", 1.6, "");
  for (const BlindStretch& b : made.blind)
    svg.path(pixels(panel, drive, b.first_frame, b.last_frame), kBlind, 5.0, R"(stroke-opacity="0.55")");
  draw_stations(svg, panel, made, magnification);
  draw_start(svg, panel, drive.front());
  draw_axes(svg, panel, step, step, "east (m)", "north (m)");
}

void draw_legend(Svg& svg, double magnification) {
  double x = 24.0;
  constexpr double y = 66.0;
  const auto entry = [&](double width, const std::string& words) {
    svg.text(x + 24.0, y + 5.0, R"(class="tick")", words);
    x += width;
  };
  const auto disc = [&](double radius, const char* fill, const char* edge) {
    svg.add(R"(<circle cx="{:.1f}" cy="{:.1f}" r="{:.1f}" fill="{}" stroke="{}" stroke-width="1.6"/>)",
            x + 10.0, y, radius, fill, edge);
  };
  disc(6.0, kCorrected, kCorrected);
  entry(118.0, "a fix, almost sure");
  x += 24.0;
  disc(6.0, "#ffffff", kBlind);
  entry(150.0, "none to be had");
  svg.path({Vec2(x, y), Vec2(x + 20.0, y)}, kBlind, 5.0, R"(stroke-opacity="0.55")");
  entry(130.0, "blind stretch");
  svg.add(R"(<ellipse cx="{:.1f}" cy="{:.1f}" rx="10" ry="6" fill="none" stroke="{}" stroke-width="1.2"/>)",
          x + 10.0, y, kFix);
  entry(320.0, magnification > 1.0
                   ? fmt::format("pose after a fix, 2 sigma, drawn {:g} times larger", magnification)
                   : std::string("pose after a fix, 2 sigma"));
  disc(4.0, "#999999", "none");
  entry(100.0, "boulder of the map");
}

void draw_over_arc(Svg& svg, const Panel& panel, const Forecast& made) {
  const double step = nice_step(panel.box.size_m().x(), 10);
  for (const BlindStretch& b : made.blind) {
    svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}" fill-opacity="0.13"/>)",
            panel.px(b.from_m), panel.top, panel.px(b.to_m) - panel.px(b.from_m), panel.height, kBlind);
  }
  draw_grid(svg, panel, step, 0.2);
  std::vector<Vec2> applied;
  std::vector<Vec2> right;
  for (const FixStation& s : made.stations) {
    applied.emplace_back(panel.px(s.at.arc_m), panel.py(s.applied));
    right.emplace_back(panel.px(s.at.arc_m), panel.py(s.right));
  }
  svg.path(applied, kCorrected, 2.0, "");
  svg.path(right, kRight, 2.0, R"(stroke-dasharray="7 4")");
  draw_axes(svg, panel, step, 0.2, "way (m)", "probability");
  svg.text(panel.left, panel.top - 8.0, R"(class="name")",
           "Of a fix that is applied (line), and right (dashes)");
}

double size_of(const PoseSigma& s) { return std::hypot(s.along_m, s.across_m); }

void draw_errors(Svg& svg, const Panel& panel, const Forecast& made) {
  const double step = nice_step(panel.box.size_m().x(), 10);
  const double step_y = nice_step(panel.box.size_m().y(), 4);
  draw_grid(svg, panel, step, step_y);
  std::vector<Vec2> before;
  std::vector<Vec2> after;
  for (const FixStation& s : made.stations) {
    before.emplace_back(panel.px(s.at.arc_m), panel.py(size_of(s.before)));
    if (s.applied > 0.0) after.emplace_back(panel.px(s.at.arc_m), panel.py(size_of(s.after)));
  }
  svg.path(before, kVo, 2.0, "");
  if (!after.empty()) svg.path(after, kCorrected, 2.0, R"(stroke-dasharray="7 4")");
  draw_axes(svg, panel, step, step_y, "way (m)", "error (m)");
  svg.text(panel.left, panel.top - 8.0, R"(class="name")",
           fmt::format("Expected error of the position, rms: that a fix finds (line), that it leaves where "
                       "it is applied (dashes)"));
}

}  // namespace

std::string plot_forecast(const Forecast& made, const ForecastModel& model,
                          const std::vector<TableBoulder>& boulders, const std::vector<PathPoint>& drive,
                          const ForecastSource& source) {
  const Sweep sweep(model.rig, model.max_range_m, model.tracks, model.window_m);
  const Box view = view_of(drive, sweep.reach_m());
  const double px_per_m = std::min(kWidth / view.size_m().x(), kTallest / view.size_m().y());
  const Panel above{kLeft, kTop, px_per_m * view.size_m().x(), px_per_m * view.size_m().y(), view};
  const double length_m = std::max(drive.back().arc_m, 1.0e-3);
  const Panel chances{
      kLeft, above.bottom() + kBetween + 8.0, kWidth, kLower, {Vec2(0.0, 0.0), Vec2(length_m, 1.0)}};
  double largest_m = 0.02;
  for (const FixStation& s : made.stations) largest_m = std::max(largest_m, size_of(s.before));
  const Panel errors{
      kLeft, chances.bottom() + kBetween, kWidth, kLower, {Vec2(0.0, 0.0), Vec2(length_m, 1.1 * largest_m)}};

  Svg svg;
  svg.open(kLeft + kWidth + 30.0, errors.bottom() + 54.0);
  double blind_m = 0.0;
  for (const BlindStretch& b : made.blind) blind_m += b.to_m - b.from_m;
  svg.text(24.0, 34.0, R"(font-size="20" font-weight="bold")",
           fmt::format("Forecast of fixes: {} on {}", std::filesystem::path(source.path).filename().string(),
                       std::filesystem::path(source.map).filename().string()));
  const double magnification = magnification_of(made, view);
  draw_legend(svg, magnification);
  svg.text(24.0, 90.0, R"(class="tick")",
           fmt::format("{} fixes on {:.1f} m; {:.1f} m blind (probability below {:g})", made.stations.size(),
                       length_m, blind_m, model.blind_below));
  draw_map(svg, above, made, boulders, drive, magnification);
  if (!made.stations.empty()) {
    draw_over_arc(svg, chances, made);
    draw_errors(svg, errors, made);
  }
  svg.add("</svg>");
  return svg.str();
}

}  // namespace cairn::ground
