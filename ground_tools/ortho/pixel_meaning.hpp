/// What the values of a band mean, beyond being brightness as they are.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ortho/label.hpp"

class GDALDataset;

namespace cairn::ground {

/// Of each pixel.
enum class PixelKind : std::uint8_t {
  kValue,    ///< a brightness
  kMissing,  ///< no data
  kDark,     ///< darker than the instrument or the file can tell: black
  kBright,   ///< brighter: white
};
inline constexpr auto kMissing = static_cast<std::uint8_t>(PixelKind::kMissing);  ///< as masks have it

struct PixelMeaning {
  // Values as the file has them.
  std::vector<float> missing;
  std::vector<float> dark;
  std::vector<float> bright;
  bool lists_all = false;  ///< GDAL's mask would add nothing but the dark and the bright: it is not asked

  /// GDAL's mask has the dark and the bright for missing, too, as its copies of ISIS cubes have.
  bool masked_special = false;

  /// Of an image with a palette, or of signed bytes: grey and kind of each index; empty otherwise.
  std::vector<std::uint8_t> grey;
  std::vector<PixelKind> grey_kind;
  bool signed_bytes = false;

  // value = raw * scale + offset; an image whose least value is white has a negative scale.
  float scale = 1.0F;
  float offset = 0.0F;

  /// Nothing of all that.
  bool plain() const {
    return missing.empty() && dark.empty() && bright.empty() && grey.empty() && scale == 1.0F &&
           offset == 0.0F;
  }
  PixelKind kind(float raw) const;
  /// How a value that somebody tells comes out of the file.
  float raw(double told) const;
  /// Brightness of a raw value of kind kValue.
  float value(float raw) const;
};

/// Of band `number`.
///
///   palette         the mean of red, green and blue; fully transparent entries are missing
///   min-is-white    TIFF's PhotometricInterpretation 0: inverted
///   ISIS            special pixels by meaning, 8 and 16 bits and real: Null is missing; LRS and LIS are
///                   dark, HIS and HRS bright, whatever a mask says. Of ISIS cubes, and of other files whose
///                   no-data value is ISIS's Null (-32768 of 16 bits, 0xFF7FFFFB as a real, or 0 beside the
///                   cube's label), as gdal_translate leaves them
///   signed bytes    from -128, black (PIXELTYPE=SIGNEDBYTE, or SAMPLE_TYPE of PDS3)
///   labels          CORE_NULL, MISSING_CONSTANT and the like are missing; CORE_LOW_REPR_SATURATION and the
///                   like dark; ..HIGH.. bright (PDS3, PDS4, HiRISE's label beside the image), unless the
///                   label is of pixels of more bits than the file has
///   scale, offset   of the band. One band is stretched anyway, so that only a negative scale changes it; of
///                   several, each is taken on its own scale before the mean, except of 8 bits
///                   with none negative
///
/// `several`: the band is one of those whose mean is taken. Throws ToolError: a scale of 0.
PixelMeaning pixel_meaning(GDALDataset& image, int number, const Label& label, bool several);

}  // namespace cairn::ground
