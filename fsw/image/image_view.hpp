/// Non-owning views of images: row-major, pixel centres at integer (x right, y down).
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/assert.hpp"

namespace cairn {

template <typename T>
struct ImageView {
  T* data = nullptr;
  int width = 0;
  int height = 0;
  int stride = 0;  ///< elements from one row to the next, at least width

  T* row(int y) const {
    CAIRN_ASSERT(y >= 0 && y < height);
    return data + static_cast<std::ptrdiff_t>(y) * stride;
  }
  T& at(int x, int y) const {
    CAIRN_ASSERT(x >= 0 && x < width);
    return row(y)[x];
  }
  bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }
};

using ImageU8 = ImageView<const std::uint8_t>;
using MutableImageU8 = ImageView<std::uint8_t>;

/// Inclusive; may reach beyond an image.
struct PixelBounds {
  std::int16_t u_min = 0;
  std::int16_t u_max = 0;
  std::int16_t v_min = 0;
  std::int16_t v_max = 0;
};

/// A packed view (stride = width).
template <typename T>
constexpr ImageView<T> packed_view(T* data, int width, int height) {
  return {data, width, height, width};
}

}  // namespace cairn
