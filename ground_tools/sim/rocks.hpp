/// The rocks of a simulated site: where they lie, how large they are, and what they look like.
///
/// Sizes follow Golombek and Rapp (1997): the share of the ground under rocks of diameter D and more is
///   F(D) = k exp(-q D),   q = 1.79 + 0.152/k
/// Their number per area follows from n(D) = -F'(D) / (pi D^2 / 4); positions are uniform, and rocks keep off
/// each other. Pebbles continue the law below the rocks' smallest diameter.
///
/// A shape is a ball, stretched, made bumpy and cut by planes, with its buried part below z = 0. Diameters
/// are those of the disc with the area of the outline above ground, seen from above;
/// positions are that outline's centroid.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/eigen.hpp"
#include "sim/scene.hpp"
#include "sim/terrain.hpp"
#include "sim/traverse.hpp"

namespace cairn::ground::sim {

using Vec3f = Eigen::Matrix<float, 3, 1>;

/// A rock of diameter 1 with the centroid of its outline over (0, 0) and the ground at z = 0.
struct RockShape {
  std::vector<Vec3f> points;
  std::vector<Vec3f> normals;  ///< of the points, outwards, unit length
  std::vector<std::array<std::uint32_t, 3>> triangles;
  double top = 0.0;  ///< highest point
};

struct Rock {
  Vec2 p_map_m = Vec2(0.0, 0.0);
  double z_ground_map_m = 0.0;  ///< bare ground at p_map_m
  double z_foot_map_m = 0.0;    ///< where the shape's z = 0 lies: lower on a slope
  double diameter_m = 0.0;
  double height_m = 0.0;  ///< above z_ground_map_m
  double yaw_rad = 0.0;
  float albedo = 0.0F;
  std::uint16_t shape = 0;
};

/// Density of the law, rocks per m^2 of diameter `from_m` to `to_m`.
double rocks_per_m2(double k, double from_m, double to_m);

/// The shapes of a scene, finely meshed ones first: shape i of the first `kFineShapes` is meant for large
/// rocks, the others for pebbles.
constexpr std::size_t kFineShapes = 24;
constexpr std::size_t kPlainShapes = 24;
constexpr std::size_t kPebbleShapes = 12;
std::vector<RockShape> make_shapes(const Scene& scene);

/// A ball of diameter 1 whose centre is at the ground, of 20 * 4^levels triangles.
RockShape make_ball(int levels);

/// All rocks and pebbles of the scene, the largest first; those that the rover would hit are left out where
/// the scene says so.
std::vector<Rock> place_rocks(const Scene& scene, const Terrain& terrain,
                              const std::vector<RockShape>& shapes, const std::vector<PathPoint>& path);

}  // namespace cairn::ground::sim
