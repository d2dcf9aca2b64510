/// A colour picture to draw on: circles, bars, small text, edges smoothed.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

namespace cairn::ground {

/// Samples as grey levels, stretched so that a hundredth of them is black and one is white.
class GreyStretch {
 public:
  explicit GreyStretch(std::vector<float> samples);
  std::uint8_t level(float sample) const {
    return static_cast<std::uint8_t>(std::clamp((sample - low_) * scale_, 0.0F, 255.0F));
  }

 private:
  float low_ = 0.0F;
  float scale_ = 255.0F;
};

using Colour = std::array<std::uint8_t, 3>;

class Canvas {
 public:
  Canvas(int width, int height, Colour ground = {0, 0, 0});

  int width() const { return width_; }
  int height() const { return height_; }
  Colour at(int x, int y) const;
  /// Mixes a pixel with `colour`, 0 (nothing) to 1 (all of it); outside of the picture nothing happens.
  void mix(int x, int y, Colour colour, double share);

  /// Places: pixel centres at integers. The line is `line_px` wide, its inner edge at `radius_px`: what the
  /// circle surrounds stays free.
  void circle(double x_px, double y_px, double radius_px, double line_px, Colour colour);
  void rectangle(int x, int y, int width, int height, Colour colour, double share = 1.0);
  /// Lower-case letters, digits and full stop, `zoom` pixels a dot, 7 dots high; (x, y) is the upper left
  /// corner. Other characters are blank.
  void text(int x, int y, std::string_view text, Colour colour, int zoom = 2);
  static int text_width(std::string_view text, int zoom = 2) {
    return 6 * zoom * static_cast<int>(text.size());
  }

  /// Red, green and blue one plane after the other, as GDAL writes them.
  const std::vector<std::uint8_t>& planes() const { return planes_; }

 private:
  std::size_t index(int plane, int x, int y) const;

  int width_;
  int height_;
  std::vector<std::uint8_t> planes_;
};

}  // namespace cairn::ground
