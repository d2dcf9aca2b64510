/// Image files for tests, through GDAL: only tests that link it (unit_tests/opencv, integration,
/// ground_tools) may call these.
#pragma once

#include <string>

#include "image/image_view.hpp"

namespace cairn::test {

/// Reads the first band of an image file into `pixels` (at least `capacity` bytes, packed rows). 16-bit
/// pictures are shifted right by `shift`. Returns the view, empty where the file cannot be read or is larger
/// than the capacity.
MutableImageU8 read_image(const std::string& path, std::uint8_t* pixels, std::size_t capacity, int shift = 0);

/// Writes an 8-bit grey (`channels` 1) or interleaved colour (`channels` 3) PNG, for looking at.
/// False on failure.
bool write_png(const std::string& path, const std::uint8_t* pixels, int width, int height, int channels);

}  // namespace cairn::test
