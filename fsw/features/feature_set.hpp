/// What the extractor makes of one image, and what the matchers read.
#pragma once

#include <cstdint>

#include "core/fixed_vector.hpp"
#include "image/image_view.hpp"
#include "mission_cfg.hpp"

namespace cairn {

inline constexpr int kDescriptorSize = 128;  ///< 4 x 4 cells x 8 orientations

/// Upright SIFT descriptor, quantised to bytes (METHOD section A).
struct Descriptor {
  std::uint8_t bin[kDescriptorSize] = {};
};

/// An extremum of the difference of Gaussians, px.
struct Feature {
  float u = 0.0F;  ///< sub-pixel position
  float v = 0.0F;
  std::int16_t iu = 0;  ///< the pixel it was found at
  std::int16_t iv = 0;
  std::int16_t response = 0;  ///< coarse minus fine Gaussian, grey levels x 256: bright blobs are negative
  bool described = true;      ///< has a descriptor
};

/// Grey levels with 8 fraction bits.
using SmoothImage = ImageView<const std::uint16_t>;

/// Features in scan order (by iv, then iu), with the index of each row's first one.
struct FeatureSet {
  FixedVector<Feature, cfg::kMaxFeatures> features;
  FixedVector<Descriptor, cfg::kMaxFeatures> descriptors;  ///< same index as `features`
  /// Features of row v: row_begin[v] .. row_begin[v + 1] - 1.
  std::uint16_t row_begin[cfg::kImageHeight + 1] = {};
  int height = 0;

  /// First feature index at or below row `v` (clamped to the image).
  std::size_t first_of_row(int v) const { return row_begin[v < 0 ? 0 : (v > height ? height : v)]; }
};

}  // namespace cairn
