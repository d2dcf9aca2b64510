#include "plot/canvas.hpp"

#include <algorithm>
#include <cmath>

namespace cairn::ground {
namespace {

struct Glyph {
  char letter;
  std::uint8_t columns[5];  ///< lowest bit on top
};

constexpr Glyph kGlyphs[] = {
    {'0', {0x3E, 0x51, 0x49, 0x45, 0x3E}}, {'1', {0x00, 0x42, 0x7F, 0x40, 0x00}},
    {'2', {0x42, 0x61, 0x51, 0x49, 0x46}}, {'3', {0x21, 0x41, 0x45, 0x4B, 0x31}},
    {'4', {0x18, 0x14, 0x12, 0x7F, 0x10}}, {'5', {0x27, 0x45, 0x45, 0x45, 0x39}},
    {'6', {0x3C, 0x4A, 0x49, 0x49, 0x30}}, {'7', {0x01, 0x71, 0x09, 0x05, 0x03}},
    {'8', {0x36, 0x49, 0x49, 0x49, 0x36}}, {'9', {0x06, 0x49, 0x49, 0x29, 0x1E}},
    {'.', {0x00, 0x60, 0x60, 0x00, 0x00}}, {'a', {0x20, 0x54, 0x54, 0x54, 0x78}},
    {'b', {0x7F, 0x48, 0x44, 0x44, 0x38}}, {'c', {0x38, 0x44, 0x44, 0x44, 0x20}},
    {'d', {0x38, 0x44, 0x44, 0x48, 0x7F}}, {'e', {0x38, 0x54, 0x54, 0x54, 0x18}},
    {'f', {0x08, 0x7E, 0x09, 0x01, 0x02}}, {'g', {0x0C, 0x52, 0x52, 0x52, 0x3E}},
    {'h', {0x7F, 0x08, 0x04, 0x04, 0x78}}, {'i', {0x00, 0x44, 0x7D, 0x40, 0x00}},
    {'j', {0x20, 0x40, 0x44, 0x3D, 0x00}}, {'k', {0x7F, 0x10, 0x28, 0x44, 0x00}},
    {'l', {0x00, 0x41, 0x7F, 0x40, 0x00}}, {'m', {0x7C, 0x04, 0x18, 0x04, 0x78}},
    {'n', {0x7C, 0x08, 0x04, 0x04, 0x78}}, {'o', {0x38, 0x44, 0x44, 0x44, 0x38}},
    {'p', {0x7C, 0x14, 0x14, 0x14, 0x08}}, {'q', {0x08, 0x14, 0x14, 0x18, 0x7C}},
    {'r', {0x7C, 0x08, 0x04, 0x04, 0x08}}, {'s', {0x48, 0x54, 0x54, 0x54, 0x20}},
    {'t', {0x04, 0x3F, 0x44, 0x40, 0x20}}, {'u', {0x3C, 0x40, 0x40, 0x20, 0x7C}},
    {'v', {0x1C, 0x20, 0x40, 0x20, 0x1C}}, {'w', {0x3C, 0x40, 0x30, 0x40, 0x3C}},
    {'x', {0x44, 0x28, 0x10, 0x28, 0x44}}, {'y', {0x0C, 0x50, 0x50, 0x50, 0x3C}},
    {'z', {0x44, 0x64, 0x54, 0x4C, 0x44}},
};

}  // namespace

GreyStretch::GreyStretch(std::vector<float> samples) {
  if (samples.empty()) return;
  std::sort(samples.begin(), samples.end());
  low_ = samples[samples.size() / 100];
  scale_ = 255.0F / std::max(samples[samples.size() - 1 - samples.size() / 100] - low_, 1e-12F);
}

Canvas::Canvas(int width, int height, Colour ground)
    : width_(width),
      height_(height),
      planes_(3U * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
  rectangle(0, 0, width, height, ground);
}

std::size_t Canvas::index(int plane, int x, int y) const {
  return (static_cast<std::size_t>(plane) * static_cast<std::size_t>(height_) + static_cast<std::size_t>(y)) *
             static_cast<std::size_t>(width_) +
         static_cast<std::size_t>(x);
}

Colour Canvas::at(int x, int y) const {
  return {planes_[index(0, x, y)], planes_[index(1, x, y)], planes_[index(2, x, y)]};
}

void Canvas::mix(int x, int y, Colour colour, double share) {
  if (x < 0 || y < 0 || x >= width_ || y >= height_ || !(share > 0.0)) return;
  const double part = std::min(share, 1.0);
  for (int plane = 0; plane < 3; ++plane) {
    std::uint8_t& value = planes_[index(plane, x, y)];
    value = static_cast<std::uint8_t>(value + part * (colour[static_cast<std::size_t>(plane)] - value) + 0.5);
  }
}

void Canvas::circle(double x_px, double y_px, double radius_px, double line_px, Colour colour) {
  const double outer = radius_px + line_px;
  const int y0 = std::max(0, static_cast<int>(std::floor(std::max(-1.0, y_px - outer - 1.0))));
  const int y1 = static_cast<int>(std::ceil(std::min(height_ - 1.0, y_px + outer + 1.0)));
  const int x0 = std::max(0, static_cast<int>(std::floor(std::max(-1.0, x_px - outer - 1.0))));
  const int x1 = static_cast<int>(std::ceil(std::min(width_ - 1.0, x_px + outer + 1.0)));
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const double r = std::hypot(x - x_px, y - y_px);
      // How much of a pixel's width the line covers, along the radius.
      const double share = std::min(outer, r + 0.5) - std::max(radius_px, r - 0.5);
      mix(x, y, colour, share);
    }
  }
}

void Canvas::rectangle(int x, int y, int width, int height, Colour colour, double share) {
  for (int v = std::max(0, y); v < std::min(height_, y + height); ++v) {
    for (int u = std::max(0, x); u < std::min(width_, x + width); ++u) mix(u, v, colour, share);
  }
}

void Canvas::text(int x, int y, std::string_view text, Colour colour, int zoom) {
  for (const char letter : text) {
    for (const Glyph& glyph : kGlyphs) {
      if (glyph.letter != letter) continue;
      for (int u = 0; u < 5; ++u) {
        for (int v = 0; v < 7; ++v) {
          if ((glyph.columns[u] >> v & 1) != 0) rectangle(x + u * zoom, y + v * zoom, zoom, zoom, colour);
        }
      }
    }
    x += 6 * zoom;
  }
}

}  // namespace cairn::ground
