/// Which missions keep landmarks (localizer/landmarks.hpp), and how many: those whose rig sees ground enough
/// to match maps of coarse pixels.
#pragma once

#include <cstdint>

#include "mission_cfg.hpp"

namespace cairn::cfg {

struct LandmarkValues {
  const char* mission = "";
  double least_pixel_m = 0.0;  ///< maps of such pixels and coarser are matched by landmarks; 0: no map is
  int max_landmarks = 8;
  int relief_side = 8;         ///< cells of the relief's grid (labeling/relief.hpp): a power of two, 8 to 256
  double window_m = 60.0;      ///< of way: how long landmarks are kept
  double cell_m = 0.125;       ///< half a pixel of a map of 25 cm
  double range_m = 12.0;       ///< of points that are laid in the relief
  double min_height_m = 0.12;  ///< a boulder of 0.6 m and more stands higher, gravel does not
};

/// A row a mission; without one it keeps none, and their memory is nothing to speak of.
inline constexpr LandmarkValues kLandmarkTable[] = {
    {"mast", 0.15, 256, 256},  // 32 m, 1.5 MB
};

constexpr bool same_name(const char* a, const char* b) {
  while (*a != '\0' && *a == *b) {
    ++a;
    ++b;
  }
  return *a == *b;
}

inline constexpr LandmarkValues kLandmarkValues = [] {
  for (const LandmarkValues& row : kLandmarkTable) {
    if (same_name(row.mission, kMission.name)) return row;
  }
  return LandmarkValues{};
}();

inline constexpr bool kHaveLandmarks = kLandmarkValues.least_pixel_m > 0.0;
inline constexpr std::size_t kMaxLandmarks = kLandmarkValues.max_landmarks;
inline constexpr std::uint32_t kReliefSide = kLandmarkValues.relief_side;
inline constexpr std::size_t kReliefMaxBytes = std::size_t{24} * kReliefSide * kReliefSide + 16 * 1024;
inline constexpr std::size_t kLandmarksMaxBytes = 160 * kMaxLandmarks + 256;

static_assert(kMaxLandmarks >= 1 && kMaxLandmarks <= 1024, "landmarks: 1 to 1024");
static_assert(!kHaveLandmarks || kLandmarkValues.range_m <= kLandmarkValues.cell_m * (kReliefSide / 2.0),
              "the relief holds what is laid in it");

}  // namespace cairn::cfg
