/// Where the pixels of an orthoimage come from, a window at a time: a file of any size through
/// GDAL, or memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

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
  /// What its user should know of how it was read, each one line without the file's name.
  std::vector<std::string> remarks;

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
  /// grey 0 there. False: no pixel is missing, and `missing` says nothing. What is darker or brighter than
  /// the file can tell is 0 or 255. Throws ToolError: the file ends early.
  virtual bool read(const PixelBox& box, const GreyRange& range, std::uint8_t* grey, std::uint8_t* missing,
                    int stride) = 0;
  /// The values themselves, before the stretch to grey, packed. `missing`: 0 where there is one, else the
  /// PixelKind (pixel_meaning.hpp) that takes its place. False: all are values.
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

/// What is taken for no data besides what the file marks.
struct NoDataChoice {
  std::optional<double> value;  ///< this value, of all bands where their mean is taken
  bool guess = true;            ///< a collar that nothing marks, where it cannot be anything else
};

/// An orthoimage that GDAL opens. `band` 1 to n takes that band; 0 takes the mean of red, green and blue
/// where the image has three bands or more, else band 1. What the values mean: pixel_meaning.hpp. 8-bit
/// values and palettes are grey as they are; all other types are stretched linearly (grey_range.hpp). No-data
/// values, masks and alpha bands are missing pixels; so are NaNs, and what lies beyond 3.4e38 on either side.
/// Of the bands of a mean, a no-data value of unsigned whole numbers is one only where all bands have theirs:
/// 0 is a colour's shadow, too.
///
/// A value at the end of the range that fills a corner and 2 % or more of the image is a collar that its
/// file does not mark. It is taken for no data where it is 255 of 8 bits, or farther from all other values
/// than these are from each other. So is, of more than 8 bits, what is four times as far from all others,
/// and below zero or above them: -9999 in holes of any size. Either is told among the remarks, as are zero
/// so far off, and an end of the range that fills 5 % or more (of samples all over the image).
///
/// Throws ToolError: cannot be opened, no geo-reference, degrees or a unit other than the metre, band out of
/// range, complex numbers, a scale of 0.
std::unique_ptr<RasterSource> open_orthoimage(const std::filesystem::path& path, int band = 0,
                                              const NoDataChoice& no_data = {});

}  // namespace cairn::ground
