/// Keypoints of one image: single-scale difference-of-Gaussians extrema (METHOD section A), spread over the
/// image, and their upright SIFT descriptors, of all of them or of those that are asked for later.
///
/// One pass over the rows: smooth with two Gaussians (sigma 1.2 and 1.9 px, image/gaussian.hpp), subtract,
/// look for pixels beyond all eight neighbours and the contrast threshold, drop edges (ratio of principal
/// curvatures above 10, Lowe 2004 section 4.1), refine to sub-pixel by a quadratic in u and v, keep the
/// strongest of each 32 x 32 px cell. Then the cells hand in their features rank by rank until the cap is
/// reached, so that texture in one corner cannot starve the rest: motion is the better determined the wider
/// its features are spread. Then one descriptor a unit.
///
/// A third, lighter Gaussian (sigma 0.6 px) gives the image that descriptors and patch alignment read; it
/// stays as part of the result. Lighter is better there: on rendered and real images the motion's bias grew
/// with the smoothing (0.49, 0.52, 0.63 and 0.75 degrees after 25 m for 0.6, 0.8, 1.2 and 1.5 px), while
/// without any the interpolation suffers.
#pragma once

#include <cstdint>

#include "core/nodiscard.hpp"
#include "core/work_budget.hpp"
#include "features/feature_set.hpp"
#include "image/gaussian.hpp"

namespace cairn {

enum class CAIRN_NODISCARD ExtractStatus : std::uint8_t {
  kIdle,         ///< never started
  kRunning,      ///< call step() again
  kFeatures,     ///< result() and smooth() are valid
  kFewFeatures,  ///< valid, but fewer than kMinFeatures: black, saturated or featureless image
  kBadImage,     ///< no image, or a size that this build has no room for
};

class FeatureExtractor {
 public:
  static constexpr std::size_t kMinFeatures = 20;
  static constexpr int kLeastSide = 64;
  /// `width`: of the image, halved or not.
  static constexpr std::uint32_t row_ops(int width) { return 30U * static_cast<std::uint32_t>(width); }
  static constexpr std::uint32_t select_ops() { return 10U * kCellsX * kCellsY * kPerCell; }

  /// Starts on `image` (borrowed until done), at least kLeastSide a side and at most the mission's size.
  /// `halved`: on means of 2 x 2 pixels, whose places are then what features tell (image/gaussian.hpp).
  /// `describe`: all of them, as they are found.
  ExtractStatus start(const ImageU8& image, bool halved = false, bool describe = true);
  /// Units: one row of the image, the choice of features, one descriptor.
  Progress step(WorkBudget& budget);
  ExtractStatus status() const { return status_; }

  /// Of a feature of the result; costs kDescriptorOps.
  void describe(std::size_t i);

  const FeatureSet& result() const { return set_; }
  /// The image smoothed with sigma 0.6 px, u16 with 8 fraction bits.
  SmoothImage smooth() const { return {smooth_, width_, height_, width_}; }

 private:
  static constexpr int kCell = 32;
  static constexpr int kPerCell = 10;
  static constexpr int kCellsX = (cfg::kImageWidth + kCell - 1) / kCell;
  static constexpr int kCellsY = (cfg::kImageHeight + kCell - 1) / kCell;
  struct Cell {
    int count = 0;
    int least = 0;                     ///< strength that still enters
    std::uint8_t rank[kPerCell] = {};  ///< places of the features, strongest first: they stay where they are
    Feature feature[kPerCell];

    const Feature& at(int i) const { return feature[rank[i]]; }
  };

  void do_row(int y);
  void find_extrema(int y);
  void take(int x, int y, const std::int16_t* a, const std::int16_t* h, const std::int16_t* b);
  static void keep(const Feature& feature, Cell& cell);
  [[gnu::cold]] void select();  ///< once an image: small code will do

  ExtractStatus status_ = ExtractStatus::kIdle;
  int image_width_ = 0;
  int width_ = 0;  ///< of what features are looked for in
  int height_ = 0;
  int row_ = 0;  ///< rows read
  std::size_t described_ = 0;
  bool describe_ = true;
  bool selected_ = false;
  ScaleRows scales_;
  std::int16_t dog_[3][cfg::kImageWidth] = {};  ///< last three rows of the difference
  Cell cells_[kCellsY * kCellsX];
  std::uint16_t smooth_[cfg::kImagePixels] = {};
  FeatureSet set_;
};

}  // namespace cairn
