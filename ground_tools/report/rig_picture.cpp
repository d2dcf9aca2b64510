#include "report/rig_picture.hpp"

#include "plot/svg.hpp"

namespace cairn::ground {
namespace {

constexpr double kMargin = 24.0;
constexpr double kTop = 40.0;
constexpr double kWidth = 420.0;  // of a panel
constexpr int kCell_px = 8;       // of the hatching
constexpr int kLines = 12;        // of the raw image's grid, across and down

struct Side {
  const char* name;
  const CameraModel* raw;
  Quat q_raw_rect;
  double share;
};

/// Rows of cells without a source, as one bar each.
void hatch(Svg& svg, const Side& side, const CameraModel& camera, double left, double scale) {
  for (int v = 0; v < camera.height_px; v += kCell_px) {
    int from = -1;
    for (int u = 0; u <= camera.width_px + kCell_px; u += kCell_px) {
      const Vec2 middle(u + 0.5 * kCell_px, v + 0.5 * kCell_px);
      const bool none = u < camera.width_px && !has_source(*side.raw, camera, side.q_raw_rect, middle);
      if (none && from < 0) from = u;
      if (none || from < 0) continue;
      svg.add(
          R"(<rect class="none" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}" fill-opacity="0.45"/>)",
          left + from * scale, kTop + v * scale, (u - from) * scale, kCell_px * scale, kVo);
      from = -1;
    }
  }
}

/// A line of the raw image, where it goes in the rectified one; outside of the panel it is left out.
void trace(Svg& svg, const Side& side, const CameraModel& camera, double left, double scale, const Vec2& from,
           const Vec2& to) {
  constexpr int kSteps = 48;
  std::vector<Vec2> line;
  const auto draw = [&] {
    std::string points;
    for (const Vec2& p : line) points += fmt::format("{:.1f},{:.1f} ", p.x(), p.y());
    if (line.size() > 1)
      svg.add(R"(<polyline points="{}" fill="none" stroke="{}" stroke-width="1"/>)", points, kCorrected);
    line.clear();
  };
  for (int i = 0; i <= kSteps; ++i) {
    const std::optional<Vec3> ray =
        direction(*side.raw, from + (to - from) * (static_cast<double>(i) / kSteps));
    const Vec3 seen = ray ? Vec3(side.q_raw_rect.conjugate() * *ray) : Vec3(0.0, 0.0, 0.0);
    const Vec2 at(camera.fx_px * seen.x() / seen.z() + camera.cx_px,
                  camera.fy_px * seen.y() / seen.z() + camera.cy_px);
    const bool inside = seen.z() > 0.0 && at.x() >= -0.5 && at.x() <= camera.width_px - 0.5 &&
                        at.y() >= -0.5 && at.y() <= camera.height_px - 0.5;
    if (inside) {
      line.emplace_back(left + at.x() * scale, kTop + at.y() * scale);
    } else {
      draw();
    }
  }
  draw();
}

void draw_side(Svg& svg, const Side& side, const CameraModel& camera, double left, double scale) {
  hatch(svg, side, camera, left, scale);
  const double right = side.raw->width_px - 1, bottom = side.raw->height_px - 1;
  for (int i = 0; i <= kLines; ++i) {
    const double share = static_cast<double>(i) / kLines;
    trace(svg, side, camera, left, scale, Vec2(share * right, 0.0), Vec2(share * right, bottom));
    trace(svg, side, camera, left, scale, Vec2(0.0, share * bottom), Vec2(right, share * bottom));
  }
  svg.add(R"(<rect class="frame" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}"/>)", left, kTop, kWidth,
          camera.height_px * scale);
  svg.text(left, kTop - 12.0, R"(class="name")",
           fmt::format("{}, rectified, {} x {} px: {:.1f} % has a source", side.name, camera.width_px,
                       camera.height_px, 100.0 * side.share));
}

}  // namespace

std::string rig_picture(const CameraPair& raw, const Rectification& rectification) {
  const CameraModel& camera = rectification.pair.left;
  const double scale = kWidth / camera.width_px;
  const RectifyingTurns turns = rectifying_turns(raw);
  const SourceArea area = source_area(raw, rectification);
  Svg svg;
  svg.open(3.0 * kMargin + 2.0 * kWidth, kTop + camera.height_px * scale + 2.0 * kMargin);
  draw_side(svg, {"left", &raw.left, turns.left, area.left}, camera, kMargin, scale);
  draw_side(svg, {"right", &raw.right, turns.right, area.right}, camera, 2.0 * kMargin + kWidth, scale);
  svg.text(
      kMargin, kTop + camera.height_px * scale + kMargin, R"(class="tick")",
      fmt::format("lines: rows and columns of the raw images, 1/{} apart; filled: no source, the border's "
                  "grey is repeated; {:.1f} % has one in both",
                  kLines, 100.0 * area.both));
  svg.add("</svg>");
  return svg.str();
}

}  // namespace cairn::ground
