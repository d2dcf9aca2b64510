/// What features are found and described on, in integers, a row at a time: the image under a light Gaussian,
/// and the difference of two wider ones.
///
/// All kernels are separable and binomial, sums of neighbours and shifts, with no multiplication a pixel:
///   light      [3 10 3] / 16 in each direction: sigma 0.612 px, exact
///   fine       [1 1]^6 / 64: sigma 1.225 px, in 1/16 grey levels
///   coarse     fine under [1 0 2 0 1] / 4 (a trous): sigma 1.871 px
///   difference coarse - fine, exact from there
/// Two pixels share a 32-bit word: those half an image width apart, so that a pixel's neighbours stand in the
/// neighbouring words in both halves, and neither half carries into the other (sums are cut back to 12 bits
/// before they outgrow 16; the difference is recovered modulo 2^16). A 750 has no vector unit: this halves
/// its work and is the same on every target.
///
/// Units: u8 grey in; u16 with 8 fraction bits (65280 = grey 255) for the light image; the difference in grey
/// levels x 256, at most 79 grey levels of either sign for any image. Beyond the border the light image
/// repeats the border pixel; the difference is told for pixels at least kDifferenceMargin inside.
///
/// A noisy image may be taken halved: each pixel is the mean of 2 x 2, made as the rows pass.
///
/// Source: binomial filters Burt & Adelson 1983; a-trous cascade Holschneider et al. 1989. Cost: some 25
/// operations a pixel.
#pragma once

#include <cstdint>

#include "image/image_view.hpp"
#include "mission_cfg.hpp"

namespace cairn {

class ScaleRows {
 public:
  /// The difference of row y comes with row y + kDelay of the image.
  static constexpr int kDelay = 4;
  static constexpr int kDifferenceMargin = 6;

  /// Starts on `image` (borrowed until the last row), at least 2 * kDifferenceMargin a side, once halved.
  void start(const ImageU8& image, bool halved = false);
  /// Reads the next row y = 0, 1, ... height - 1: writes the light image's row y, and the difference's row
  /// y - kDelay where that lies kDifferenceMargin inside (else leaves it). Both have room for the width.
  void next(std::uint16_t* light, std::int16_t* difference);

 private:
  static constexpr int kPad = 5;  // words before the first and behind the last one
  static constexpr int kWords = (cfg::kImageWidth + 1) / 2 + 2 * kPad + 2;
  static constexpr int kRowRing = 3;
  static constexpr int kRing = 5;

  const std::uint8_t* grey_row(int y);
  void pack(int y);
  void smooth_columns(int y, std::uint16_t* light);
  void smooth_rows(int y);
  void subtract(int y, std::int16_t* difference) const;

  ImageU8 image_;
  bool halved_ = false;
  int width_ = 0;  // of what is smoothed
  int height_ = 0;
  int half_ = 0;  // words of a row: columns x and x + half_ share one
  int y_ = 0;
  std::uint8_t mean_[cfg::kImageWidth / 2] = {};  // a row of the halved image
  std::uint32_t packed_[kRowRing][kWords] = {};   // rows of the image
  std::uint32_t across_[kRing][kWords] = {};  // smoothed along columns by [1 2 1] and along rows by [1 1]^6
  std::uint32_t fine_[kRowRing][kWords] = {};
  std::uint32_t wide_[kRing][kWords] = {};  // fine, smoothed along rows by [1 0 2 0 1]
};

}  // namespace cairn
