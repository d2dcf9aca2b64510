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

/// The largest sample of an image of 16-bit samples; 0 for one of 8 bits. Throws ImageError.
int largest_deep_sample(const std::filesystem::path& path);

/// Reads an image (JPEG, PNG, TIFF, PGM, BMP, WebP, JPEG 2000, GIF, PDS, VICAR) as 8-bit grey. Colour
/// becomes luma, (299 R + 587 G + 114 B + 500) / 1000 in integers (Rec. 601); an alpha band is ignored. Of
/// 16-bit samples `bits` are used, 8 to 16; of bytes as many as the file says, 1 to 8: they are scaled so
/// that the largest that these can hold becomes 255, rounded; those below 0 are black. Throws ImageError. A
/// file that ends early is refused, not padded. Prints nothing.
Image load_grey(const std::filesystem::path& path, int bits = 16);

}  // namespace cairn::ground
