/// A simulated drive as data: site, rocks, suns, camera, rig and traverse. Whatever the simulator draws
/// follows from a Scene alone. Defaults are the paper's set-up (METHOD section IV).
///
/// A scene is read from TOML; doc/guide/simulator.md tells each key, unit and range. Keys are
/// named as the members here, in the sections [site], [craters], [rocks], [sun], [ortho_sun], [light],
/// [camera], [ortho_camera], [rig], [traverse], [attitude]; `seed` stands before the first. Frames: map
/// (x east, y north, z up; doc/FRAMES.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/eigen.hpp"
#include "geometry/stereo_rig.hpp"

namespace cairn::ground::sim {

/// The ground: a rectangle in the map frame. The default lies as the orthoimage's pixels do, upper left
/// corner at (0, 0).
struct Site {
  double origin_x_m = 0.0;    ///< lower left corner
  double origin_y_m = -76.8;  ///< -height_m where the scene says nothing
  double width_m = 76.8;
  double height_m = 76.8;

  double relief_rms_m = 0.3;          ///< hills: standard deviation of height over the site
  double relief_wavelength_m = 30.0;  ///< of the longest hills
  double ripple_height_m = 0.012;     ///< crest to trough; 0: none
  double ripple_wavelength_m = 0.4;
  double ripple_azimuth_deg = 60.0;  ///< across the crests, clockwise from north

  double albedo = 0.27;            ///< mean of the soil
  double texture_contrast = 0.12;  ///< grain: standard deviation over mean of the albedo
  double patch_contrast = 0.15;    ///< soil and mineral patches: standard deviation over mean
  double patch_size_m = 2.0;       ///< of a typical patch
};

/// Craters: N(>D) = k D^-b a hectare, D in metres, between the smallest and the largest. How one looks:
/// craters.hpp.
struct Craters {
  double k = 0.0;  ///< 0: none
  double b = 2.0;
  double min_diameter_m = 1.0;
  double max_diameter_m = 20.0;
  double depth = 0.16;           ///< of a fresh one's floor below the ground around it, over the diameter
  double rim = 0.04;             ///< of its crest above that ground, over the diameter
  double min_degradation = 0.0;  ///< 0: fresh; uniform between these two
  double max_degradation = 1.0;  ///< 1: worn, a dell
};

/// Rocks after Golombek and Rapp (1997): share of the ground under rocks of diameter D and more is
/// k exp(-q D), q = 1.79 + 0.152/k. Pebbles continue the law below min_diameter_m.
struct Rocks {
  double k = 0.07;  ///< 0: none
  double min_diameter_m = 0.05;
  double max_diameter_m = 2.0;
  double pebble_min_diameter_m = 0.012;
  double pebbles = 1.5;            ///< number of pebbles over that of the law; 0: none
  double burial = 0.3;             ///< mean share of a rock's height below ground
  double albedo = 0.19;            ///< mean
  double albedo_spread = 0.45;     ///< rock to rock: standard deviation over mean
  bool clear_path = true;          ///< leaves out rocks that the rover would hit:
  double clear_height_m = 0.15;    ///< taller than this,
  double clear_distance_m = 0.45;  ///< with the rim nearer than this to the path
};

struct Sun {
  double elevation_deg = 45.0;
  double azimuth_deg = 135.0;  ///< direction to the sun, clockwise from north
};

/// How light falls and comes back.
struct Lighting {
  double sky = 0.095;        ///< irradiance from the whole sky, where the sun's, square on, is 0.8; 0: no air
  double backscatter = 0.0;  ///< share of Lommel and Seeliger's law (the moon's dust) in place of Lambert's
};

/// What the sensor makes of radiance (sensor.hpp). DN = 255 sqrt(radiance / white_radiance) + noise.
struct Camera {
  double white_radiance = 0.47;            ///< that becomes 255
  double noise_dn = 2.0;                   ///< standard deviation, 8-bit steps
  double blur_px = 0.4;                    ///< standard deviation of the optics' Gaussian
  double vignetting = 0.05;                ///< share of radiance lost in the corners
  double exposure_step_probability = 0.0;  ///< per frame
  double exposure_step_size = 0.1;         ///< largest change of radiance against nominal, as a share
  int dust_spots = 0;                      ///< on each camera
};

/// The orbiter's: DN = 255 (radiance / Camera::white_radiance)^gamma + noise.
struct OrthoCamera {
  double gamma = 0.5;     ///< 1: linear
  double noise_dn = 1.0;  ///< standard deviation
  double blur_px = 0.5;   ///< standard deviation of the optics' Gaussian, pixels of each product
};

/// Where the cameras sit and what they see. Both look along the rover's x axis, level in roll.
struct Rig {
  std::string name = "paper";  ///< "paper", "mast", or "custom" where any number differs from these
  int width_px = 512;
  int height_px = 384;
  double fx_px = 394.205430737;
  double fy_px = 394.205430737;
  double cx_px = 255.5;
  double cy_px = 191.5;
  double baseline_m = 0.12;
  double height_m = 0.7;  ///< stereo mid-point above the rover's origin
  double pitch_down_deg = 39.0;
};

enum class TraverseKind {
  kS,  ///< two opposite arcs, left and then right; half circles where no radius is given
  kStraight,
  kArc,        ///< to the left; a quarter of a circle where no radius is given
  kZigzag,     ///< legs of leg_m at zigzag_deg to either side of the heading, turning in place between them
  kStopAndGo,  ///< the way of kS, standing for stop_frames after every stop_every_m
  kPointTurn,  ///< half of length_m straight, turn_deg in place, the other half straight
  kWaypoints,  ///< straight from one to the next, turning in place at each
};

struct Traverse {
  TraverseKind kind = TraverseKind::kS;
  double length_m = 100.0;  ///< as commanded, before slip. Not for kWaypoints
  double step_m = 0.06;     ///< from one frame to the next
  /// Without a start the way lies centred in the site.
  std::optional<double> start_x_m;
  std::optional<double> start_y_m;
  double start_heading_deg = 0.0;  ///< counter-clockwise from east
  double margin_m = 4.0;           ///< the whole way keeps so far from the site's edge
  double radius_m = 0.0;           ///< kS, kStopAndGo, kArc; negative: the other way round; 0: see the kind
  double leg_m = 10.0;
  double zigzag_deg = 50.0;
  double stop_every_m = 5.0;
  int stop_frames = 10;
  double turn_deg = 90.0;      ///< counter-clockwise
  double turn_step_deg = 2.0;  ///< of a turn in place, at most, from one frame to the next
  double slip = 0.0;           ///< each step loses a share that is uniform in 0 .. 2 slip
  double slip_sideways = 0.0;  ///< and goes aside by a share of its length, uniform in -1 .. 1 times this
  std::vector<Vec2> waypoints_map_m;
};

/// An accelerometer's gravity and a sun sensor's heading (attitude_sensor.hpp). Standard deviations: noise is
/// each reading's own, bias one draw for the whole drive.
struct AttitudeSensor {
  double every_m = 0.0;  ///< of way, from one reading to the next; 0: none
  double gravity_noise_deg = 0.2;
  double gravity_bias_deg = 0.0;
  double heading_noise_deg = 0.2;
  double heading_bias_deg = 0.0;
};

struct Scene {
  std::uint64_t seed = 1;
  Site site;
  Craters craters;
  Rocks rocks;
  Sun sun;        ///< of the ground images
  Sun ortho_sun;  ///< of the orthoimage; as `sun` where the scene says nothing
  Lighting light;
  Camera camera;
  OrthoCamera ortho_camera;
  Rig rig;
  Traverse traverse;
  AttitudeSensor attitude;
};

/// Reads `path` (empty: defaults throughout); then each of `sets`, "section.key=value", replaces a value.
/// A value of `sets` is TOML; text may go without quotes. Throws ToolError, one line with file and line (or
/// the setting), key and mend: no such file, not TOML, an unknown key, a wrong type, a value out of its
/// range, a rig that sees no ground or shares none, a traverse that leaves the site.
Scene load_scene(const std::filesystem::path& path, const std::vector<std::string>& sets = {});

/// The whole scene as TOML that load_scene reads back to the same numbers.
std::string to_toml(const Scene& scene);

/// The rig as flight code has it, with T_rover_cam = mast_pose(...).
StereoRig stereo_rig(const Rig& rig);

/// Unit vector to the sun in the map frame.
Vec3 sun_direction(const Sun& sun);

const char* name_of(TraverseKind kind);

}  // namespace cairn::ground::sim
