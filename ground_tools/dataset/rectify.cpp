#include "dataset/rectify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace cairn::ground {
namespace {

constexpr int kSpacing = remap::kSpacing;
constexpr int kMostRaw_px = remap::kReach_px + 1;  // that RemapJob takes

/// By how many pixels the border of the target looks beyond the source; infinite where a lens sees nothing.
double beyond_px(const CameraModel& raw, const CameraModel& rectified, const Quat& q_raw_rect) {
  double most = 0.0;
  const auto look = [&](int x, int y) {
    const std::optional<Vec2> at = raw_pixel(raw, rectified, q_raw_rect, Vec2(x, y));
    if (!at) {
      most = INFINITY;
      return;
    }
    most = std::max({most, -at->x(), -at->y(), at->x() - (raw.width_px - 1), at->y() - (raw.height_px - 1)});
  };
  const int right = rectified.width_px - 1, bottom = rectified.height_px - 1;
  constexpr int kStep = 4;
  for (int x = 0; x < right; x += kStep) look(x, 0), look(right - x, bottom);
  for (int y = 0; y < bottom; y += kStep) look(right, y), look(0, bottom - y);
  return most;
}

/// Beyond what the lens sees as the two nodes before go on.
void fill(RemapTable& table, const CameraModel& raw, const CameraModel& rectified, const Quat& q_raw_rect) {
  table.width_px = rectified.width_px;
  table.height_px = rectified.height_px;
  const int columns = remap::nodes_along(table.width_px, kSpacing);
  const int rows = remap::nodes_along(table.height_px, kSpacing);
  const auto node = [&](int c, int r) -> RemapNode& {
    return table.nodes[static_cast<std::size_t>(r * columns + c)];
  };
  constexpr std::int32_t kReach = remap::kReach_px << remap::kFractionBits;
  const auto fixed = [](double px) {
    constexpr double kOne = 1 << remap::kFractionBits;
    return static_cast<std::int32_t>(
        std::clamp(std::round(px * kOne), -static_cast<double>(kReach), static_cast<double>(kReach)));
  };
  const auto onwards = [&](std::int32_t before, std::int32_t last) {
    return std::clamp(2 * last - before, -kReach, kReach);
  };
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const std::optional<Vec2> at = raw_pixel(raw, rectified, q_raw_rect, Vec2(c * kSpacing, r * kSpacing));
      if (at) {
        node(c, r) = {fixed(at->x()), fixed(at->y())};
      } else if (c >= 2) {
        node(c, r) = {onwards(node(c - 2, r).u, node(c - 1, r).u),
                      onwards(node(c - 2, r).v, node(c - 1, r).v)};
      } else if (r >= 2) {
        node(c, r) = {onwards(node(c, r - 2).u, node(c, r - 1).u),
                      onwards(node(c, r - 2).v, node(c, r - 1).v)};
      } else {
        node(c, r) = {};
      }
    }
  }
}

/// The means of both, of the size that can be flown.
CameraModel mean_camera(const CameraModel& a, const CameraModel& b) {
  CameraModel out;
  out.width_px = std::min(a.width_px, cfg::kImageWidth);
  out.height_px = std::min(a.height_px, cfg::kImageHeight);
  out.fx_px = 0.5 * (a.fx_px + b.fx_px);
  out.fy_px = 0.5 * (a.fy_px + b.fy_px);
  out.cx_px = 0.5 * (a.cx_px + b.cx_px) - (a.width_px - out.width_px) / 2;
  out.cy_px = 0.5 * (a.cy_px + b.cy_px) - (a.height_px - out.height_px) / 2;
  return out;
}

}  // namespace

std::optional<Vec2> raw_pixel(const CameraModel& raw, const CameraModel& rectified, const Quat& q_raw_rect,
                              const Vec2& pixel) {
  // CAHVORE's pupil moves by millimetres: at a kilometre nobody sees that.
  constexpr double kFar_m = 1000.0;
  const Vec3 ray((pixel.x() - rectified.cx_px) / rectified.fx_px,
                 (pixel.y() - rectified.cy_px) / rectified.fy_px, 1.0);
  return project(raw, kFar_m * (q_raw_rect * ray));
}

bool has_source(const CameraModel& raw, const CameraModel& rectified, const Quat& q_raw_rect,
                const Vec2& pixel) {
  const std::optional<Vec2> at = raw_pixel(raw, rectified, q_raw_rect, pixel);
  return at && at->x() >= 0.0 && at->y() >= 0.0 && at->x() <= raw.width_px - 1 &&
         at->y() <= raw.height_px - 1;
}

SourceArea source_area(const CameraPair& raw, const Rectification& rectification) {
  const CameraModel& camera = rectification.pair.left;
  const RectifyingTurns turns = rectifying_turns(raw);
  int all = 0, left = 0, right = 0, both = 0;
  constexpr int kStep = 2;
  for (int v = 0; v < camera.height_px; v += kStep) {
    for (int u = 0; u < camera.width_px; u += kStep) {
      const bool in_left = has_source(raw.left, camera, turns.left, Vec2(u, v));
      const bool in_right = has_source(raw.right, camera, turns.right, Vec2(u, v));
      ++all;
      left += in_left ? 1 : 0;
      right += in_right ? 1 : 0;
      both += in_left && in_right ? 1 : 0;
    }
  }
  return {static_cast<double>(left) / all, static_cast<double>(right) / all, static_cast<double>(both) / all};
}

RectifyingTurns rectifying_turns(const CameraPair& raw) {
  const Quat q_left_right = raw.T_right_left.q.conjugate();
  const Vec3 x = -(q_left_right * raw.T_right_left.t).normalized();
  const Vec3 axis = Vec3(0.0, 0.0, 1.0) + q_left_right * Vec3(0.0, 0.0, 1.0);
  const Vec3 y = axis.cross(x).normalized();
  Mat3 R_left_rect;
  R_left_rect << x, y, x.cross(y);
  const Quat q_left_rect = Quat(R_left_rect).normalized();
  return {q_left_rect, (raw.T_right_left.q * q_left_rect).normalized()};
}

std::string rectify(const CameraPair& raw, Rectification& out) {
  if (raw.left.width_px != raw.right.width_px || raw.left.height_px != raw.right.height_px)
    return "left and right images are of two sizes";
  if (std::max(raw.left.width_px, raw.left.height_px) > kMostRaw_px)
    return fmt::format(
        "raw images of {} x {} are larger than {} px a side; scale them and their calibration down",
        raw.left.width_px, raw.left.height_px, kMostRaw_px);
  if (!((raw.T_right_left.q * Vec3(0.0, 0.0, 1.0)).z() > 0.0))
    return "the cameras look more than a right angle apart";
  const RectifyingTurns turns = rectifying_turns(raw);
  CameraModel camera = mean_camera(raw.left, raw.right);
  const double fx_px = camera.fx_px, fy_px = camera.fy_px;
  constexpr double kFiner = 1.01, kMostZoom = 4.0;
  out.zoom = 1.0;
  while (std::max(beyond_px(raw.left, camera, turns.left), beyond_px(raw.right, camera, turns.right)) >
         kMostBeyond * raw.left.width_px) {
    out.zoom *= kFiner;
    if (out.zoom > kMostZoom) return "left and right images have too little in common";
    camera.fx_px = out.zoom * fx_px;
    camera.fy_px = out.zoom * fy_px;
  }
  out.T_left_rect = Pose3{turns.left, Vec3(0.0, 0.0, 0.0)};
  out.pair = raw;
  out.pair.left = out.pair.right = camera;
  out.pair.T_right_left = Pose3{Quat(1.0, 0.0, 0.0, 0.0), Vec3(-baseline_m(raw), 0.0, 0.0)};
  out.pair.T_cam0_left = raw.T_cam0_left * out.T_left_rect;
  out.pair.T_body_left = raw.T_body_left * out.T_left_rect;
  fill(out.left, raw.left, camera, turns.left);
  fill(out.right, raw.right, camera, turns.right);
  return {};
}

Image remapped(const RemapTable& table, const Image& image) {
  Image out;
  out.width = table.width_px;
  out.height = table.height_px;
  out.pixels.resize(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height));
  RemapJob job;
  const RemapStatus started =
      job.start(table, image.view(), packed_view(out.pixels.data(), out.width, out.height));
  CAIRN_ASSERT(started == RemapStatus::kRunning);
  WorkBudget all = WorkBudget::unlimited();
  const Progress progress = job.step(all);
  CAIRN_ASSERT(progress == Progress::kDone);
  return out;
}

std::string rectification_header(const CameraPair& raw, const Rectification& made,
                                 const std::string& source) {
  const StereoRig rig = rectified_rig(made.pair);
  std::string text = fmt::format(
      "/// The tables that rectify a raw rig, by `cairn rig {} --table`. To be handed to FlightApp::init as\n"
      "/// RawPairs (app/pair_rectifier.hpp), beside two buffers of kRawWidth_px * kRawHeight_px bytes.\n"
      "/// mission_values.hpp is to say: image_width_px = {}, image_height_px = {}, fx_px = {:.9f},\n"
      "/// fy_px = {:.9f}, cx_px = {:.9f}, cy_px = {:.9f}, baseline_m = {:.9f}.\n"
      "#pragma once\n\n#include \"image/remap.hpp\"\n\nnamespace cairn::cfg {{\n\n"
      "static_assert(remap::kSpacing == {}, \"the table is for a mission of another image size\");\n"
      "inline constexpr int kRawWidth_px = {};\ninline constexpr int kRawHeight_px = {};\n",
      source, rig.width_px, rig.height_px, rig.fx_px, rig.fy_px, rig.cx_px, rig.cy_px, rig.baseline_m,
      remap::kSpacing, raw.left.width_px, raw.left.height_px);
  const auto add = [&text](const char* side, const RemapTable& table) {
    text += fmt::format("inline constexpr std::uint32_t k{}TableCrc = 0x{:08X}U;\n", side, crc_of(table));
    text += fmt::format("inline constexpr RemapTable k{}Table = {{{}, {}, {{{{\n", side, table.width_px,
                        table.height_px);
    const int columns = remap::nodes_along(table.width_px, kSpacing);
    const int rows = remap::nodes_along(table.height_px, kSpacing);
    for (int i = 0; i < columns * rows; ++i) {
      const RemapNode& n = table.nodes[static_cast<std::size_t>(i)];
      text += fmt::format("{{{},{}}},{}", n.u, n.v, i % 8 == 7 || i + 1 == columns * rows ? "\n" : "");
    }
    text += "}}};\n";
  };
  add("Left", made.left);
  add("Right", made.right);
  return text + "\n}  // namespace cairn::cfg\n";
}

}  // namespace cairn::ground
