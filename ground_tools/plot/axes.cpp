#include "plot/axes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace cairn::ground {
namespace {

/// Calls `at(value)` for each multiple of `step` in [low, high].
void for_each_tick(double low, double high, double step, const std::function<void(double)>& at) {
  const double slack = 1.0e-6;  // a tick on the edge counts, whatever its rounding
  for (double i = std::ceil(low / step - slack); i <= high / step + slack; i += 1.0) at(i * step);
}

}  // namespace

double nice_step(double span, int count) {
  const double raw = span / count;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (raw <= factor * power) return factor * power;
  }
  return 10.0 * power;
}

std::string tick_label(double value, double step) {
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1.0e-9)), 0, 6);
  return fmt::format("{:.{}f}", std::fabs(value) < 1.0e-9 * step ? 0.0 : value, decimals);
}

void draw_axes(Svg& svg, const Panel& panel, double step_x, double step_y, const std::string& name_x,
               const std::string& name_y) {
  const Box& box = panel.box;
  for_each_tick(box.low_m.x(), box.high_m.x(), step_x, [&](double x) {
    svg.line(panel.px(x), panel.bottom(), panel.px(x), panel.bottom() + 5.0, R"(class="axis")");
    svg.text(panel.px(x), panel.bottom() + 19.0, R"(class="tick" text-anchor="middle")",
             tick_label(x, step_x));
  });
  for_each_tick(box.low_m.y(), box.high_m.y(), step_y, [&](double y) {
    svg.line(panel.left - 5.0, panel.py(y), panel.left, panel.py(y), R"(class="axis")");
    svg.text(panel.left - 9.0, panel.py(y) + 4.0, R"(class="tick" text-anchor="end")", tick_label(y, step_y));
  });
  svg.text(panel.left + panel.width / 2.0, panel.bottom() + 38.0, R"(class="name" text-anchor="middle")",
           name_x);
  const double middle = panel.top + panel.height / 2.0;
  svg.add(
      R"svg(<text x="18" y="{0:.1f}" class="name" text-anchor="middle" transform="rotate(-90 18 {0:.1f})">{1}</text>)svg",
      middle, escaped(name_y));
  svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" class="frame"/>)", panel.left,
          panel.top, panel.width, panel.height);
}

void draw_grid(Svg& svg, const Panel& panel, double step_x, double step_y) {
  for_each_tick(panel.box.low_m.x(), panel.box.high_m.x(), step_x, [&](double x) {
    svg.line(panel.px(x), panel.top, panel.px(x), panel.bottom(), R"(class="grid")");
  });
  for_each_tick(panel.box.low_m.y(), panel.box.high_m.y(), step_y, [&](double y) {
    svg.line(panel.left, panel.py(y), panel.right(), panel.py(y), R"(class="grid")");
  });
}

}  // namespace cairn::ground
