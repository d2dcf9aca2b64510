/// What a trial of a campaign is: a scene, a map resolution and how VO is made worse, all drawn from a seed.
///
/// Seeds of campaigns begin at kFirstSeed. They are for evaluation: no parameter of Cairn was chosen on them.
///
/// Map resolution and kind of traverse go round by the seed (4 and 7 of them: 28 seeds in a row hold every
/// pair once), so that each comes as often as the others. All else is uniform in the range that setup.cpp
/// gives beside it.
#pragma once

#include <array>
#include <cstdint>

#include "localizer/localizer.hpp"
#include "sim/scene.hpp"

namespace cairn::ground {

inline constexpr std::uint64_t kFirstSeed = 1000;
inline constexpr std::array<double, 4> kMapPixels_m = {0.005, 0.010, 0.020, 0.050};

/// How many rocks there are. Sparse ones are for the forecast (campaign/reliability.hpp): k is drawn where
/// fixes begin to fail, all else as usual.
enum class Abundance : std::uint8_t {
  kUsual,   ///< k 0.03 to 0.15
  kSparse,  ///< k 0.02 to 0.032
};

struct Setup {
  std::uint64_t seed = kFirstSeed;
  sim::Scene scene;
  double map_pixel_m = kMapPixels_m[0];
  double worse_scale = 1.0;          ///< of each VO step in the second replay
  double worse_yaw_deg_per_m = 0.0;  ///< added to it

  StepTrim worse() const { return {worse_scale, worse_yaw_deg_per_m * kRadPerDeg}; }
};

/// Pure: the same seed gives the same trial. The scene is valid (load_scene takes its TOML) and lies around
/// the origin, just large enough for about 20 m of way with 4 m on each side. The rig is that of the mission;
/// throws ToolError where the simulator has none for it.
Setup draw_setup(std::uint64_t seed, Abundance abundance = Abundance::kUsual);

}  // namespace cairn::ground
