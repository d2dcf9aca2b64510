/// Small JPEG pictures inside other files.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace cairn::ground {

/// `bytes`: bands (1 or 3) one after the other, each width x height, row-major. A JPEG file as base64. Throws
/// ToolError where GDAL cannot make one.
std::string jpeg_base64(const std::vector<std::uint8_t>& bytes, int width, int height, int bands,
                        int quality);

}  // namespace cairn::ground
