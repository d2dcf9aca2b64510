/// A simulated site, ready to be looked at: terrain, rocks and their texture in a ray tracer (Embree).
///
/// Light.
///   radiance = albedo (sun cos(theta) lit + sky open + bounce)
/// with the sun a disc of 0.35 degrees (four places of it, one a sample), shadows cast by terrain, rocks and
/// pebbles; the sky uniform, seen through what rocks around a place leave open; and the ground's own light on
/// what faces it. Surfaces scatter evenly (Lambert), or as Lighting::backscatter has it. Units are such that
/// Camera::white_radiance fits.
///
/// Each pixel has four samples at fixed places within it, hence edges are smooth; finer texture is averaged
/// over the sample's footprint. The same pixel comes out for any thread count.
#pragma once

#include <memory>
#include <vector>

#include "sim/attitude_sensor.hpp"
#include "sim/rocks.hpp"
#include "sim/scene.hpp"
#include "sim/sensor.hpp"
#include "sim/terrain.hpp"
#include "sim/traverse.hpp"

namespace cairn::ground::sim {

/// A pinhole view. Pixel centres at integers.
struct View {
  int width_px = 0;
  int height_px = 0;
  double fx_px = 0.0;
  double fy_px = 0.0;
  double cx_px = 0.0;
  double cy_px = 0.0;
  Pose3 T_map_cam;
};

/// A piece of an orthographic view from above: pixel (u, v) is centred at (x_m + (u + 0.5) pixel_m,
/// y_m - (v + 0.5) pixel_m).
struct OrthoPart {
  int width_px = 0;
  int height_px = 0;
  double x_m = 0.0;  ///< west edge
  double y_m = 0.0;  ///< north edge
  double pixel_m = 0.0;
};

class World {
 public:
  explicit World(const Scene& scene);
  /// The scene's ground with rocks of one's own, the largest first. Throws ToolError where a rock's shape
  /// is not there.
  World(const Scene& scene, std::vector<RockShape> shapes, std::vector<Rock> rocks);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  const Scene& scene() const { return scene_; }
  const Terrain& terrain() const;
  /// Rocks and pebbles, the largest first.
  const std::vector<Rock>& rocks() const;
  /// Where the rover stands, frame by frame: T_map_rover.
  const std::vector<PathPoint>& path() const { return path_; }
  Pose3 T_map_rover(std::size_t frame) const;
  /// What the scene's attitude sensors read along it.
  std::vector<AttitudeReading> attitude_readings() const;

  /// Radiance of the view; `depth`, where wanted, gets the z of the pixel's centre in the camera's frame (0:
  /// nothing there). To be called from any thread; each call works on one.
  void render(const View& view, const Sun& sun, FloatImage& out, FloatImage* depth = nullptr) const;
  void render(const OrthoPart& part, const Sun& sun, FloatImage& out) const;

 private:
  struct Body;
  Scene scene_;
  std::vector<PathPoint> path_;
  std::unique_ptr<Body> body_;
};

/// The two views of a rig on the rover.
View left_view(const Rig& rig, const Pose3& T_map_rover);
View right_view(const Rig& rig, const Pose3& T_map_rover);

}  // namespace cairn::ground::sim
