/// Ground images as the flight code sees them: 8-bit grey.
#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "image/image_view.hpp"

namespace cairn::ground {

/// An image that cannot be used: absent, truncated, no image at all, or of an unknown kind. `what` is one
/// line with the file's name and the reason. The replay goes on without that image.
class ImageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;  ///< row-major, packed

  ImageU8 view() const { return packed_view(pixels.data(), width, height); }
};

/// Reads a JPEG, PNG or TIFF file as 8-bit grey. Colour becomes luma, (299 R + 587 G + 114 B + 500) / 1000 in
/// integers (Rec. 601); an alpha band is ignored. 16-bit samples are scaled by 1/257 (65535 becomes 255),
/// rounded. Throws ImageError. A file that ends early is refused, not padded. Prints nothing.
Image load_grey(const std::filesystem::path& path);

}  // namespace cairn::ground
