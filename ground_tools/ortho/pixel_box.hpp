/// Rectangles of pixels in an image.
#pragma once

#include <algorithm>
#include <cstddef>

namespace cairn::ground {

/// Columns x0 to before x1, rows y0 to before y1.
struct PixelBox {
  int x0 = 0;
  int y0 = 0;
  int x1 = 0;
  int y1 = 0;

  int width() const { return x1 - x0; }
  int height() const { return y1 - y0; }
  std::size_t pixels() const {
    return static_cast<std::size_t>(width()) * static_cast<std::size_t>(height());
  }
  bool operator==(const PixelBox& b) const { return x0 == b.x0 && y0 == b.y0 && x1 == b.x1 && y1 == b.y1; }

  /// So many pixels more on each side, within the image.
  PixelBox grown(int by, const PixelBox& image) const {
    return {std::max(x0 - by, image.x0), std::max(y0 - by, image.y0), std::min(x1 + by, image.x1),
            std::min(y1 + by, image.y1)};
  }
};

}  // namespace cairn::ground
