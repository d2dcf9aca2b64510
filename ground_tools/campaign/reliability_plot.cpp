#include "campaign/reliability_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "plot/axes.hpp"
#include "plot/svg.hpp"

namespace cairn::ground {
namespace {

constexpr double kDiagramLeft = 70.0;
constexpr double kSide = 360.0;
constexpr double kDiagramGap = 90.0;
constexpr double kDiagramTop = 92.0;
constexpr double kCounts = 90.0;

void draw_diagram(Svg& svg, double left, const Reliability& r, const char* title) {
  const Panel panel{left, kDiagramTop, kSide, kSide, {Vec2(0.0, 0.0), Vec2(1.0, 1.0)}};
  draw_grid(svg, panel, 0.2, 0.2);
  svg.line(panel.px(0.0), panel.py(0.0), panel.px(1.0), panel.py(1.0),
           R"(stroke="#222" stroke-dasharray="6 4")");
  const double base = r.observed.value();
  svg.line(panel.px(0.0), panel.py(base), panel.px(1.0), panel.py(base),
           R"(stroke="#999" stroke-dasharray="2 4")");
  std::vector<Vec2> points;
  for (const ReliabilityBin& b : r.bins) {
    const double x = panel.px(b.forecast);
    const Interval i = b.observed.interval();
    svg.line(x, panel.py(i.low), x, panel.py(i.high), R"svg(stroke="#0072B2" stroke-width="1.4")svg");
    points.emplace_back(x, panel.py(b.observed.value()));
  }
  svg.path(points, kCorrected, 1.6, "");
  for (const Vec2& p : points)
    svg.add(R"(<circle cx="{:.1f}" cy="{:.1f}" r="5" fill="{}"/>)", p.x(), p.y(), kCorrected);
  draw_axes(svg, panel, 0.2, 0.2, "forecast probability", "observed frequency");
  svg.text(left, kDiagramTop - 12.0, R"(class="name" font-weight="bold")", title);
  const std::string skill = std::isnan(r.skill) ? std::string("no skill to be told")
                                                : fmt::format("skill {:+.2f} [{:+.2f}, {:+.2f}]", r.skill,
                                                              r.skill_interval.low, r.skill_interval.high);
  svg.text(left + 8.0, kDiagramTop + 18.0, R"(class="tick")",
           fmt::format("Brier {:.3f}, base rate {:.3f}", r.brier, r.base_brier));
  svg.text(left + 8.0, kDiagramTop + 34.0, R"(class="tick")", skill);
}

void draw_counts(Svg& svg, double left, const Reliability& r) {
  std::size_t most = 1;
  for (const ReliabilityBin& b : r.bins) most = std::max(most, b.observed.of);
  const auto high = static_cast<double>(most);
  const Panel panel{
      left, kDiagramTop + kSide + 70.0, kSide, kCounts, {Vec2(0.0, 0.0), Vec2(1.0, 1.15 * high)}};
  for (const ReliabilityBin& b : r.bins) {
    const double x = panel.px(b.low);
    const double y = panel.py(static_cast<double>(b.observed.of));
    const double width = panel.px(b.high) - x;
    svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}" stroke="#fff"/>)", x, y,
            width, panel.bottom() - y, "#56B4E9");
  }
  draw_axes(svg, panel, 0.2, nice_step(high, 3), "forecast probability", "fixes");
}

}  // namespace

std::string plot_reliability(const std::vector<TrialForecast>& trials) {
  std::vector<ForecastFix> fixes;
  for (const TrialForecast& t : trials) fixes.insert(fixes.end(), t.fixes.begin(), t.fixes.end());
  Svg svg;
  svg.open(kDiagramLeft + 2.0 * kSide + kDiagramGap + 30.0, kDiagramTop + kSide + 70.0 + kCounts + 54.0);
  svg.text(24.0, 34.0, R"(font-size="20" font-weight="bold")",
           fmt::format("Forecast against outcome: {} fixes with {} maps", fixes.size(), trials.size()));
  svg.text(24.0, 56.0, R"(class="tick")",
           "On the dashed line forecasts are calibrated; dots: overall frequency; bars: 95 % intervals");
  const char* const titles[] = {"The fix is applied", "and right: within 0.15 m of truth"};
  double left = kDiagramLeft;
  for (std::size_t i = 0; i < kFixEvents.size(); ++i) {
    const Reliability r = reliability_of(fixes, kFixEvents[i]);
    draw_diagram(svg, left, r, titles[i]);
    draw_counts(svg, left, r);
    left += kSide + kDiagramGap;
  }
  svg.add("</svg>");
  return svg.str();
}

}  // namespace cairn::ground
