/// Is this the same patch? Correlation of a few samples about two whole pixels.
///
/// For the two pictures of a pair, which are of one time and nearly one place: few keypoints of one lie where
/// a keypoint of the other may be, and these few are told apart by far less than a descriptor. Sums of 2 x 2
/// pixels of the light image, two pixels apart: keypoints of the same point lie up to a pixel off each other.
/// A gain and an offset of brightness change nothing.
#pragma once

#include <cstdint>

#include "features/feature_set.hpp"

namespace cairn {

struct SparsePatch {
  static constexpr int kSide = 7;
  static constexpr int kSamples = kSide * kSide;
  static constexpr int kReach = kSide;             ///< pixels from the middle, at most
  static constexpr std::uint32_t kUnlike = 65536;  ///< no correlation; also of what is flat
  std::int32_t value[kSamples];                    ///< less that in the middle
  float sum;
  float spread;  ///< sum of squares about the mean

  /// About pixel (iu, iv), at least kReach inside.
  void cut(const SmoothImage& image, int iu, int iv);
  /// 1 - correlation, in 1/65536: 0 to twice kUnlike.
  std::uint32_t difference(const SparsePatch& other) const;
};

}  // namespace cairn
