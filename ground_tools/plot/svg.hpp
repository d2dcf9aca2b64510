/// SVG text under construction, and the look that all pictures share.
#pragma once

#include <fmt/format.h>

#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "core/eigen.hpp"
#include "plot/ortho_piece.hpp"

namespace cairn::ground {

// Okabe and Ito, "Color Universal Design" (2008).
inline constexpr const char* kTruth = "#000000";
inline constexpr const char* kVo = "#D55E00";
inline constexpr const char* kCorrected = "#0072B2";
inline constexpr const char* kFix = "#CC79A7";

/// A panel: a rectangle of pixels that shows a rectangle of values, y upwards.
struct Panel {
  double left = 0.0, top = 0.0, width = 0.0, height = 0.0;  // pixels
  Box box;

  double px(double x) const { return left + (x - box.low_m.x()) / box.size_m().x() * width; }
  double py(double y) const { return top + (box.high_m.y() - y) / box.size_m().y() * height; }
  double bottom() const { return top + height; }
  double right() const { return left + width; }
  bool shows(const Vec2& p) const {
    return p.x() >= box.low_m.x() && p.x() <= box.high_m.x() && p.y() >= box.low_m.y() &&
           p.y() <= box.high_m.y();
  }
};

/// Text as SVG has it: & < > " replaced.
std::string escaped(const std::string& text);

class Svg {
 public:
  /// The head: size in pixels, the classes tick, name, grid, axis, frame and plate, a white ground.
  /// Ends with `add("</svg>")`.
  void open(double width_px, double height_px);
  template <typename... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
    text_ += '\n';
  }
  void line(double x0, double y0, double x1, double y1, const char* style);
  void text(double x, double y, const char* style, const std::string& words);
  /// A line through points, with a light edge that keeps it readable on a dark picture.
  void path(const std::vector<Vec2>& pixels, const char* colour, double width, const char* dashes);
  const std::string& str() const { return text_; }

 private:
  std::string text_;
};

}  // namespace cairn::ground
