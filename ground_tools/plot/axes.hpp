/// Axes of a panel: ticks at round numbers, a grid, names.
#pragma once

#include <string>

#include "plot/svg.hpp"

namespace cairn::ground {

/// 1, 2 or 5 times a power of ten, such that about `count` steps make `span`.
double nice_step(double span, int count);
/// `value` with the decimals that `step` asks for.
std::string tick_label(double value, double step);
/// A tick at each multiple of the steps, and the frame around the panel.
void draw_axes(Svg& svg, const Panel& panel, double step_x, double step_y, const std::string& name_x,
               const std::string& name_y);
void draw_grid(Svg& svg, const Panel& panel, double step_x, double step_y);

}  // namespace cairn::ground
