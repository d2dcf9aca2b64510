/// Ground images as the flight code sees them: 8-bit grey.
#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <utility>
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

/// Width and height, by the file's head alone. Throws ImageError.
std::pair<int, int> image_size(const std::filesystem::path& path);

/// What is in an image of 16-bit samples.
struct DeepSamples {
  int largest = 0;       ///< 0: black, or an image of 8 bits
  bool of_bytes = true;  ///< all are bytes times 257, or all are bytes times 256
};
/// Throws ImageError.
DeepSamples deep_samples(const std::filesystem::path& path);

/// Reads an image (JPEG, PNG, TIFF, PGM also in words (P2), BMP, WebP, JPEG 2000, GIF, PDS, VICAR) as 8-bit
/// grey. Colour becomes luma, (299 R + 587 G + 114 B + 500) / 1000 in integers (Rec. 601); an alpha band is
/// ignored. Of 16-bit samples `bits` are used, 8 to 16; of bytes as many as the file says, 1 to 8: they are
/// scaled so that the largest that these can hold becomes 255, rounded; those below 0 are black. Throws
/// ImageError. A file that ends early is refused, not padded. Prints nothing.
Image load_grey(const std::filesystem::path& path, int bits = 16);

}  // namespace cairn::ground
