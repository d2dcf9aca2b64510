/// Random ground for trials of registration: maps of boulders, and what a rover sees of them.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "geometry/boulder.hpp"
#include "geometry/pose2.hpp"

namespace cairn::bench {

/// How boulders lie.
enum class Pattern { kScattered, kLattice, kRows, kClusters };

struct GroundKind {
  Pattern pattern = Pattern::kScattered;
  double per_m2 = 1.0;
  double jitter_m = 0.0;  ///< of a lattice's or row's places, on an axis
  int per_cluster = 8;
  double spread_m = 0.15;  ///< of a cluster, on an axis
};

struct View {
  int boulders = 20;        ///< local ones, true and clutter
  double clutter = 0.3;     ///< share of them
  int truths = 0;           ///< 0: boulders less clutter
  double noise_m = 0.045;   ///< of a pair, on an axis
  double radius_m = 0.0;    ///< of what is seen; 0: as it takes to see four fifths, at least 4 m
  double size_noise = 0.0;  ///< of ln(diameter); 0: no diameters
};

/// What the rover has: a map about where it thinks it is, and boulders in a frame of its own.
struct Trial {
  MapBoulders map;
  LocalMap local;
  double window_m = 0.0;
  Vec2 pivot_site_m = Vec2(0.0, 0.0);
  Pose2 T_map_site;  ///< truth
  Pose2 T_map_site_prior;
  Mat3 covariance = Mat3::Identity();
  int truths = 0;
  bool cut = false;  ///< more map boulders than a window holds
};

using Rng = std::mt19937_64;
double uniform(Rng& rng, double low, double high);
double gauss(Rng& rng);

/// Boulders in a square of `side_m` about the origin; a lattice or rows along `angle_rad`, phase at random.
std::vector<MapBoulder> strew(Rng& rng, const GroundKind& kind, double angle_rad, double side_m);

/// Where the map given to the rover is from.
enum class Site { kRight, kElsewhere, kMirrored, kShifted, kClutter };

struct Start {
  double sigma_xy_m = 0.1;
  double sigma_yaw_rad = 0.02;
  double error_low_m = -1.0;  ///< -1: drawn from sigma; else uniform in a ring of error_low .. error_high
  double error_high_m = 0.0;
  double yaw_limit_rad = 0.0;  ///< 0: drawn from sigma; else uniform within it
  double ring_spacings = 3.0;  ///< of the window beyond what the search needs
};

void make_trial(Rng& rng, const GroundKind& kind, const View& view, const Start& start, Site site,
                Trial& out);

}  // namespace cairn::bench
