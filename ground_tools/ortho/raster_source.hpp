/// Where the pixels of an orthoimage come from, a window at a time: a file of any size through
/// GDAL, or memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "base/tool_error.hpp"
#include "ortho/pixel_box.hpp"
#include "ortho/raster.hpp"
#include "ortho/sun.hpp"

namespace cairn::ground {

/// The pixels themselves are of no use: the file ends early, nothing is valid, or all is one value.
class BadImage : public ToolError {
 public:
  using ToolError::ToolError;
};

/// Pixel values that become 0 and 255.
struct GreyRange {
  float low = 0.0F;
  float high = 255.0F;
};

/// How the values of an image come.
enum class PixelDepth : std::uint8_t {
  kEight,    ///< grey already
  kSixteen,  ///< whole numbers of 16 bits
  kReal,     ///< anything else, as float
};

struct RasterFacts {
  std::string name;
  int width = 0;
  int height = 0;
  GeoTransform geo;
  std::string reference_system;  ///< a text as in ortho/reference_system.hpp
  PixelDepth depth = PixelDepth::kEight;
  bool all_valid = true;  ///< no mask, no-data value or NaN can occur
  int block_width = 0;    ///< pixels that the file keeps together
  int block_height = 0;
  std::string identity;  ///< of the file and the bands taken, as far as size and time tell; empty for memory
  std::optional<Sun> sun;  ///< where the file's label tells it

  PixelBox box() const { return {0, 0, width, height}; }
};

/// Reads windows. One for each thread; belongs to the thread that made it.
class RasterReader {
 public:
  RasterReader() = default;
  virtual ~RasterReader() = default;
  RasterReader(const RasterReader&) = delete;
  RasterReader& operator=(const RasterReader&) = delete;

  /// Grey of the pixels in `box`, row by row, `stride` apart; `missing` gets 1 where there is no data, and
  /// grey 0 there. False: no pixel is missing, and `missing` says nothing. Throws ToolError:
  /// the file ends early.
  virtual bool read(const PixelBox& box, const GreyRange& range, std::uint8_t* grey, std::uint8_t* missing,
                    int stride) = 0;
  /// The values themselves, before the stretch to grey, packed; `missing` as above.
  virtual bool read_values(const PixelBox& box, float* values, std::uint8_t* missing) = 0;
};

class RasterSource {
 public:
  RasterSource() = default;
  virtual ~RasterSource() = default;
  RasterSource(const RasterSource&) = delete;
  RasterSource& operator=(const RasterSource&) = delete;

  virtual const RasterFacts& facts() const = 0;
  virtual std::unique_ptr<RasterReader> reader() const = 0;
};

/// An orthoimage that GDAL opens. `band` 1 to n takes that band; 0 takes the mean of red, green and blue
/// where the image has three bands or more, else band 1. 8-bit values are grey as they are; all other types
/// are stretched linearly (grey_range.hpp). No-data values, masks and alpha bands are missing pixels; so are
/// NaNs, and what lies beyond 3.4e38 on either side, as the special pixels of ISIS cubes do.
///
/// Throws ToolError: cannot be opened, no geo-reference, degrees or a unit other than the metre, band out of
/// range, complex numbers.
std::unique_ptr<RasterSource> open_orthoimage(const std::filesystem::path& path, int band = 0);

}  // namespace cairn::ground
