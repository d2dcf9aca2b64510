/// How noisy a pair of images is: noise of each pixel by itself, as a sensor makes it in the dark.
///
/// A mask that sees no plane, no edge along a row or a column and little texture,
///   [1 -2 1] in u times [1 -2 1] in v,
/// has six times the standard deviation of white noise. Texture answers, too; but the same mask over sums of
/// 2 x 2 pixels answers to white noise half as much, to texture as much or more (contrast of natural
/// surfaces is alike in all octaves, and lenses take from the finest). So, with fine and coarse the medians
/// of magnitudes, as standard deviations,
///   noise^2 = 4/3 (fine^2 - coarse^2), zero where negative
/// is little fooled by ground: zero on rendered ground and indoors, up to 1 grey level on a road, 18.4 to
/// 21.6 on ground with noise of 20. Medians on a sparse grid in integers; of the two images the mean square.
/// Left out: pixels that are black or white, which show no noise.
///
/// Source: Immerkaer 1996, "Fast noise variance estimation" (the mask). Cost, a unit: kRowOps.
#pragma once

#include <cstdint>

#include "core/work_budget.hpp"
#include "image/image_view.hpp"
#include "mission_cfg.hpp"

namespace cairn {

class NoiseJob {
 public:
  static constexpr int kStepRows = 16;
  static constexpr int kStepColumns = 16;
  /// Of a row of the grid.
  static constexpr std::uint32_t kRowOps =
      70U * (static_cast<std::uint32_t>(cfg::kImageWidth) / kStepColumns);

  /// Images are borrowed until done, of at least 8 x 8 px each.
  void start(const ImageU8& left, const ImageU8& right);
  Progress step(WorkBudget& budget);  ///< the same bits for every slicing
  /// Standard deviation, grey levels; 0 where too few pixels tell. Valid when done.
  double noise() const { return noise_; }

 private:
  static constexpr int kMost = 511;  ///< magnitudes beyond count as this
  struct Histogram {
    std::uint16_t bin[kMost + 1] = {};
    double median(int count) const;
  };

  void take_row(const ImageU8& image);
  void end_image();

  ImageU8 images_[2];
  int side_ = 2;
  int y_ = 0;
  int count_ = 0;
  Histogram fine_;
  Histogram coarse_;
  double squares_ = 0.0;  ///< of fine and coarse, their difference
  double noise_ = 0.0;
};

}  // namespace cairn
