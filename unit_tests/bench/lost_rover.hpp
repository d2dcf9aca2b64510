/// A rover that is lost, on the parameters that fly: MapFix::start_lost on a map as the ground segment
/// encodes it. Boulders lie scattered.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "bench/point_sets.hpp"
#include "localizer/map_fix.hpp"

namespace cairn::bench {

struct LostCase {
  double side_m;
  int boulders;  ///< of the map
  double radius_m;
  int truths;              ///< local boulders within radius_m; 0: all are others
  int others;              ///< and at random beside them
  double size_noise;       ///< of ln(diameter) seen; 0: no diameters
  double noise_m = 0.045;  ///< of a pair, on an axis
  // Landmarks of a way, for a map of coarse pixels:
  double half_band_m = 0.0;  ///< seen either side of a way from -radius_m to radius_m; 0: a disc
  double pixel_m = 0.0;      ///< of the map; 0: a fine one, and the parameters are those of the window
  double scale = 1.0;        ///< lengths of the way as odometry has it
  double bend_per_m = 0.0;   ///< radians a metre that odometry turns too far
};

struct LostResult {
  bool accepted = false;
  double error_m = 0.0;
  double sigma_m = 0.0;
  std::uint64_t ops = 0;
};

/// The encoded bytes, validated by the flight code; ends the program where they do not hold.
class EncodedMap {
 public:
  void encode(const std::vector<MapBoulder>& boulders, const Vec2& low_m, const Vec2& high_m);
  const OrbitalMap& map() const { return map_; }

 private:
  std::vector<std::uint8_t> bytes_;
  OrbitalMap map_;
};

class LostRover {
 public:
  /// Trial `number` of a case: the same whatever came before it.
  LostResult look(const LostCase& lost, std::uint64_t seed, int number);

 private:
  static constexpr int kTrialsOfAMap = 50;
  void lay_map(const LostCase& lost, std::uint64_t seed);

  std::uint64_t laid_ = 0;  ///< seed of the map in hand
  std::vector<MapBoulder> boulders_;
  EncodedMap encoded_;
  MapFix fix_;
};

}  // namespace cairn::bench
