#include "sim/scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/layered_toml.hpp"
#include "base/waypoints.hpp"
#include "core/trig.hpp"
#include "sim/craters.hpp"
#include "sim/traverse.hpp"

namespace cairn::ground::sim {
namespace {

constexpr double kMaxFrames = 200000;
constexpr double kMostCraters = 100000;

struct KindName {
  TraverseKind kind;
  const char* name;
};
constexpr KindName kKinds[] = {
    {TraverseKind::kS, "s"},
    {TraverseKind::kStraight, "straight"},
    {TraverseKind::kArc, "arc"},
    {TraverseKind::kZigzag, "zigzag"},
    {TraverseKind::kStopAndGo, "stop_and_go"},
    {TraverseKind::kPointTurn, "point_turn"},
    {TraverseKind::kWaypoints, "waypoints"},
};

Rig mast_rig() {
  Rig rig;
  rig.name = "mast";
  rig.width_px = 1024;
  rig.height_px = 768;
  rig.fx_px = rig.fy_px = 788.410861474;  // twice the paper's: the same 66 x 52 degrees
  rig.cx_px = 511.5;
  rig.cy_px = 383.5;
  rig.baseline_m = 0.40;
  rig.height_m = 2.0;
  rig.pitch_down_deg = 20.0;
  return rig;
}

// The keys, once for reading, writing and telling which there are. A visitor has section(name),
// number(key, value, low, high), whole(...), flag(key, value).

template <typename V>
void visit_site(V& v, Site& s) {
  v.section("site");
  v.number("width_m", s.width_m, 2.0, 2000.0);
  v.number("height_m", s.height_m, 2.0, 2000.0);
  v.number("origin_x_m", s.origin_x_m, -1.0e7, 1.0e7);
  v.number("origin_y_m", s.origin_y_m, -1.0e7, 1.0e7);
  v.number("relief_rms_m", s.relief_rms_m, 0.0, 10.0);
  v.number("relief_wavelength_m", s.relief_wavelength_m, 1.0, 1000.0);
  v.number("ripple_height_m", s.ripple_height_m, 0.0, 0.5);
  v.number("ripple_wavelength_m", s.ripple_wavelength_m, 0.05, 20.0);
  v.number("ripple_azimuth_deg", s.ripple_azimuth_deg, 0.0, 360.0);
  v.number("albedo", s.albedo, 0.02, 0.9);
  v.number("texture_contrast", s.texture_contrast, 0.0, 1.0);
  v.number("patch_contrast", s.patch_contrast, 0.0, 1.0);
  v.number("patch_size_m", s.patch_size_m, 0.05, 100.0);
}

template <typename V>
void visit_craters(V& v, Craters& c) {
  v.section("craters");
  v.number("k", c.k, 0.0, 1.0e5);
  v.number("b", c.b, 0.5, 5.0);
  v.number("min_diameter_m", c.min_diameter_m, 0.2, 500.0);
  v.number("max_diameter_m", c.max_diameter_m, 0.2, 500.0);
  v.number("depth", c.depth, 0.0, 0.4);
  v.number("rim", c.rim, 0.0, 0.1);
  v.number("min_degradation", c.min_degradation, 0.0, 1.0);
  v.number("max_degradation", c.max_degradation, 0.0, 1.0);
}

template <typename V>
void visit_rocks(V& v, Rocks& r) {
  v.section("rocks");
  v.number("k", r.k, 0.0, 0.30);
  v.number("min_diameter_m", r.min_diameter_m, 0.02, 1.0);
  v.number("max_diameter_m", r.max_diameter_m, 0.02, 10.0);
  v.number("pebble_min_diameter_m", r.pebble_min_diameter_m, 0.005, 1.0);
  v.number("pebbles", r.pebbles, 0.0, 5.0);
  v.number("burial", r.burial, 0.0, 0.9);
  v.number("albedo", r.albedo, 0.02, 0.9);
  v.number("albedo_spread", r.albedo_spread, 0.0, 1.0);
  v.flag("clear_path", r.clear_path);
  v.number("clear_height_m", r.clear_height_m, 0.0, 10.0);
  v.number("clear_distance_m", r.clear_distance_m, 0.0, 10.0);
}

template <typename V>
void visit_sun(V& v, const char* section, Sun& s) {
  v.section(section);
  v.number("elevation_deg", s.elevation_deg, 5.0, 90.0);
  v.number("azimuth_deg", s.azimuth_deg, 0.0, 360.0);
}

template <typename V>
void visit_light(V& v, Lighting& l) {
  v.section("light");
  v.number("sky", l.sky, 0.0, 1.0);
  v.number("backscatter", l.backscatter, 0.0, 1.0);
}

template <typename V>
void visit_ortho_camera(V& v, OrthoCamera& c) {
  v.section("ortho_camera");
  v.number("gamma", c.gamma, 0.2, 2.0);
  v.number("noise_dn", c.noise_dn, 0.0, 20.0);
  v.number("blur_px", c.blur_px, 0.1, 1.0);
}

template <typename V>
void visit_camera(V& v, Camera& c) {
  v.section("camera");
  v.number("white_radiance", c.white_radiance, 0.01, 10.0);
  v.number("noise_dn", c.noise_dn, 0.0, 50.0);
  v.number("blur_px", c.blur_px, 0.0, 5.0);
  v.number("vignetting", c.vignetting, 0.0, 0.9);
  v.number("exposure_step_probability", c.exposure_step_probability, 0.0, 1.0);
  v.number("exposure_step_size", c.exposure_step_size, 0.0, 0.9);
  v.whole("dust_spots", c.dust_spots, 0, 500);
}

template <typename V>
void visit_rig_numbers(V& v, Rig& r) {
  v.section("rig");
  v.whole("width_px", r.width_px, 64, 4096);
  v.whole("height_px", r.height_px, 64, 4096);
  v.number("fx_px", r.fx_px, 10.0, 1.0e5);
  v.number("fy_px", r.fy_px, 10.0, 1.0e5);
  v.number("cx_px", r.cx_px, -4096.0, 8192.0);
  v.number("cy_px", r.cy_px, -4096.0, 8192.0);
  v.number("baseline_m", r.baseline_m, 0.005, 5.0);
  v.number("height_m", r.height_m, 0.1, 20.0);
  v.number("pitch_down_deg", r.pitch_down_deg, -60.0, 90.0);
}

template <typename V>
void visit_traverse(V& v, Traverse& t) {
  v.section("traverse");
  if (t.kind != TraverseKind::kWaypoints) {
    v.number("length_m", t.length_m, 0.0, 10000.0);
    v.number("start_x_m", t.start_x_m, -1.0e7, 1.0e7);
    v.number("start_y_m", t.start_y_m, -1.0e7, 1.0e7);
    v.number("start_heading_deg", t.start_heading_deg, -360.0, 360.0);
  }
  v.number("step_m", t.step_m, 0.001, 5.0);
  v.number("margin_m", t.margin_m, 0.0, 1000.0);
  v.number("radius_m", t.radius_m, -1.0e4, 1.0e4);
  v.number("leg_m", t.leg_m, 0.1, 1.0e4);
  v.number("zigzag_deg", t.zigzag_deg, 0.0, 89.0);
  v.number("stop_every_m", t.stop_every_m, 0.01, 1.0e4);
  v.whole("stop_frames", t.stop_frames, 1, 1000);
  v.number("turn_deg", t.turn_deg, -720.0, 720.0);
  v.number("turn_step_deg", t.turn_step_deg, 0.05, 2.0);
  v.number("slip", t.slip, 0.0, 0.5);
  v.number("slip_sideways", t.slip_sideways, 0.0, 0.5);
}

template <typename V>
void visit_attitude(V& v, AttitudeSensor& a) {
  v.section("attitude");
  v.number("every_m", a.every_m, 0.0, 1.0e4);
  v.number("gravity_noise_deg", a.gravity_noise_deg, 0.01, 10.0);
  v.number("gravity_bias_deg", a.gravity_bias_deg, 0.0, 10.0);
  v.number("heading_noise_deg", a.heading_noise_deg, 0.01, 10.0);
  v.number("heading_bias_deg", a.heading_bias_deg, 0.0, 10.0);
}

void read_site(LayeredToml& reader, Site& site) {
  reader.section("site");
  double size_m = 0.0;
  const bool square = reader.number("size_m", size_m, 2.0, 2000.0);
  const int layer = reader.layer_of("size_m");
  const int sides = std::max(reader.layer_of("width_m"), reader.layer_of("height_m"));
  if (square && sides == layer)
    reader.fail("size_m", "cannot be combined with width_m or height_m; remove one of them");
  const bool has_origin = reader.layer_of("origin_y_m") >= 0;
  visit_site(reader, site);
  if (square && layer > reader.layer_of("width_m")) site.width_m = size_m;
  if (square && layer > reader.layer_of("height_m")) site.height_m = size_m;
  if (!has_origin) site.origin_y_m = -site.height_m;
}

void read_craters(LayeredToml& reader, const Site& site, Craters& craters) {
  visit_craters(reader, craters);
  if (craters.min_diameter_m >= craters.max_diameter_m) {
    reader.fail(
        "min_diameter_m",
        fmt::format("= {} is not below max_diameter_m = {}", craters.min_diameter_m, craters.max_diameter_m),
        "max_diameter_m");
  }
  if (craters.min_degradation > craters.max_degradation) {
    reader.fail(
        "min_degradation",
        fmt::format("= {} is above max_degradation = {}", craters.min_degradation, craters.max_degradation),
        "max_degradation");
  }
  const double count = craters_expected(craters, site);
  if (count > kMostCraters) {
    reader.fail("k", fmt::format("= {}: {:.0f} craters on this site, more than {:.0f}; lower it, or raise "
                                 "min_diameter_m",
                                 craters.k, count, kMostCraters));
  }
}

void read_rocks(LayeredToml& reader, Rocks& rocks) {
  visit_rocks(reader, rocks);
  if (rocks.k > 0.0 && rocks.k < 0.005)
    reader.fail("k", fmt::format("= {}: the law asks for 0.005 and more; or 0 for no rocks", rocks.k));
  if (rocks.min_diameter_m >= rocks.max_diameter_m) {
    reader.fail(
        "min_diameter_m",
        fmt::format("= {} is not below max_diameter_m = {}", rocks.min_diameter_m, rocks.max_diameter_m),
        "max_diameter_m");
  }
  if (rocks.pebbles > 0.0 && rocks.pebble_min_diameter_m > rocks.min_diameter_m) {
    reader.fail("pebble_min_diameter_m",
                fmt::format("= {} is above min_diameter_m = {}; lower it, or pebbles = 0",
                            rocks.pebble_min_diameter_m, rocks.min_diameter_m),
                "min_diameter_m");
  }
}

/// What follows from a changed size or field of view, where nothing as late says otherwise.
void derive_intrinsics(LayeredToml& reader, Rig& rig) {
  const int size = std::max(reader.layer_of("width_px"), reader.layer_of("height_px"));
  const int fov = reader.layer_of("hfov_deg");
  const int fx = reader.layer_of("fx_px");
  double hfov_deg = 0.0;
  if (reader.number("hfov_deg", hfov_deg, 5.0, 160.0)) {
    if (fov == fx) reader.fail("hfov_deg", "cannot be combined with fx_px; remove one of them");
    if (fov > fx) rig.fx_px = 0.5 * rig.width_px / std::tan(0.5 * hfov_deg * kRadPerDeg);
  }
  const int focal = std::max(fov, fx);
  if (size > focal) {
    reader.fail(
        "width_px",
        fmt::format("is given without a focal length for {} x {}; add hfov_deg or fx_px to the rig's keys",
                    rig.width_px, rig.height_px),
        "height_px");
  }
  if (focal > reader.layer_of("fy_px")) rig.fy_px = rig.fx_px;
  if (size > reader.layer_of("cx_px")) rig.cx_px = 0.5 * (rig.width_px - 1);
  if (size > reader.layer_of("cy_px")) rig.cy_px = 0.5 * (rig.height_px - 1);
}

bool same_numbers(const Rig& a, const Rig& b) {
  return a.width_px == b.width_px && a.height_px == b.height_px && a.fx_px == b.fx_px && a.fy_px == b.fy_px &&
         a.cx_px == b.cx_px && a.cy_px == b.cy_px && a.baseline_m == b.baseline_m &&
         a.height_m == b.height_m && a.pitch_down_deg == b.pitch_down_deg;
}

/// A rig that cannot work on level ground.
void refuse_impossible(LayeredToml& reader, const Rig& rig) {
  // Depth along the optical axis where the ray of row v meets level ground: height / slope(v).
  const double pitch_rad = rig.pitch_down_deg * kRadPerDeg;
  const auto slope = [&](double v) {
    return std::sin(pitch_rad) + (v - rig.cy_px) / rig.fy_px * std::cos(pitch_rad);
  };
  const auto disparity_px = [&](double v) {
    return rig.fx_px * rig.baseline_m * std::max(0.0, slope(v)) / rig.height_m;
  };
  if (slope(rig.height_px - 1) < 0.02) {
    reader.fail("pitch_down_deg",
                fmt::format("= {}: the cameras see no ground; point them down, or widen the field of view",
                            rig.pitch_down_deg),
                "name");
  }
  if (disparity_px(0.5 * rig.height_px) > 0.75 * rig.width_px) {
    reader.fail("baseline_m",
                fmt::format("= {}: the images hardly overlap, the ground in the middle lies {:.0f} px apart; "
                            "shorten it, or raise the cameras",
                            rig.baseline_m, disparity_px(0.5 * rig.height_px)),
                "name");
  }
  if (disparity_px(rig.height_px - 1) < 2.0) {
    reader.fail("baseline_m",
                fmt::format("= {}: too short for depth, the nearest ground has a disparity of {:.2f} px; "
                            "lengthen it, or lower the cameras",
                            rig.baseline_m, disparity_px(rig.height_px - 1)),
                "name");
  }
  if (rig.cx_px < 0.0 || rig.cx_px > rig.width_px - 1 || rig.cy_px < 0.0 || rig.cy_px > rig.height_px - 1) {
    reader.fail(
        "cx_px",
        fmt::format("= {}, cy_px = {}: outside of the image; pixel centres run from 0", rig.cx_px, rig.cy_px),
        "cy_px");
  }
}

void read_rig(LayeredToml& reader, Rig& rig) {
  reader.section("rig");
  std::string name = "paper";
  reader.text("name", name);
  if (name != "paper" && name != "mast" && name != "custom") {
    reader.fail(
        "name",
        fmt::format("= '{}' is not a known rig; use paper, mast, or custom with all of its numbers", name));
  }
  const int named = reader.layer_of("name");
  // A name on the command line replaces the rig of the file.
  reader.ignore_before(std::max(0, named));
  if (name == "mast") rig = mast_rig();
  const Rig preset = rig;
  if (name == "custom") {
    for (const char* key : {"width_px", "height_px", "baseline_m", "height_m", "pitch_down_deg"}) {
      if (reader.layer_of(key) < 0)
        reader.fail("name", fmt::format("= 'custom' needs every number; add {}", key));
    }
  }
  visit_rig_numbers(reader, rig);
  derive_intrinsics(reader, rig);
  rig.name = same_numbers(rig, preset) ? preset.name : "custom";
  if (same_numbers(rig, mast_rig())) rig.name = "mast";
  refuse_impossible(reader, rig);
}

/// A table's columns x and y; or [[x, y], ...] in the scene itself.
std::vector<Vec2> read_waypoints(LayeredToml& reader) {
  const LayeredToml::Found found = reader.find("waypoints");
  std::vector<Vec2> points;
  if (found.node == nullptr)
    reader.fail("waypoints", "is missing; name a CSV file with columns x, y", "kind");
  if (const toml::array* list = found.node->as_array()) {
    for (const toml::node& entry : *list) {
      const toml::array* pair = entry.as_array();
      if (pair == nullptr || pair->size() != 2 || !pair->get(0)->is_number() || !pair->get(1)->is_number()) {
        reader.fail("waypoints", "must be pairs of numbers: [[x, y], [x, y]], metres");
      }
      points.emplace_back(*pair->get(0)->value<double>(), *pair->get(1)->value<double>());
    }
  } else {
    std::string file;
    if (!found.node->is_string())
      reader.refuse_type(found, "waypoints", "a CSV file's name, or [[x, y], [x, y]]");
    reader.text("waypoints", file);
    std::filesystem::path path = file;
    const TomlLayer& layer = reader.layer(found.layer);
    if (layer.is_file) path = std::filesystem::path(layer.name).parent_path() / path;
    points = ground::read_waypoints(path);
  }
  if (points.size() < 2)
    reader.fail("waypoints", fmt::format("has {} points; it needs two or more", points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!(points[i].cwiseAbs().maxCoeff() <= 1.0e7))
      reader.fail("waypoints", fmt::format("point {} is out of range", i + 1));
    if (i > 0 && (points[i] - points[i - 1]).norm() < 1.0e-3) {
      reader.fail("waypoints", fmt::format("points {} and {} are the same; remove one", i, i + 1));
    }
  }
  return points;
}

/// Frames, roughly: to refuse what would take hours before planning it.
double count_frames(const Traverse& t) {
  double length_m = t.kind == TraverseKind::kWaypoints ? 0.0 : t.length_m;
  double turns_deg = 0.0;
  double standing = 0.0;
  for (std::size_t i = 1; i < t.waypoints_map_m.size(); ++i) {
    length_m += (t.waypoints_map_m[i] - t.waypoints_map_m[i - 1]).norm();
    turns_deg += 180.0;
  }
  if (t.kind == TraverseKind::kZigzag) turns_deg = length_m / t.leg_m * 2.0 * t.zigzag_deg;
  if (t.kind == TraverseKind::kPointTurn) turns_deg = std::fabs(t.turn_deg);
  if (t.kind == TraverseKind::kStopAndGo) standing = length_m / t.stop_every_m * t.stop_frames;
  return length_m / t.step_m + turns_deg / t.turn_step_deg + standing;
}

void refuse_off_site(LayeredToml& reader, const Scene& scene, const std::vector<PathPoint>& path) {
  const Site& site = scene.site;
  double least_m = std::numeric_limits<double>::infinity();
  std::size_t worst = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double x_m = path[i].x_m - site.origin_x_m;
    const double y_m = path[i].y_m - site.origin_y_m;
    const double inside_m = std::min({x_m, site.width_m - x_m, y_m, site.height_m - y_m});
    if (inside_m < least_m) {
      least_m = inside_m;
      worst = i;
    }
  }
  if (least_m >= scene.traverse.margin_m - 1.0e-9) return;
  const bool waypoints = scene.traverse.kind == TraverseKind::kWaypoints;
  reader.fail(
      waypoints ? "waypoints" : "length_m",
      fmt::format("leads {} the site: frame {} at ({:.2f}, {:.2f}) is {:.2f} m {} the edge, margin_m "
                  "requires {}; {}, or enlarge [site]",
                  least_m < 0.0 ? "out of" : "to the edge of", worst, path[worst].x_m, path[worst].y_m,
                  std::fabs(least_m), least_m < 0.0 ? "beyond" : "from", scene.traverse.margin_m,
                  waypoints ? "move that point" : "shorten it, choose another kind or start"),
      "kind");
}

void read_traverse(LayeredToml& reader, Scene& scene) {
  Traverse& t = scene.traverse;
  reader.section("traverse");
  std::string kind = name_of(t.kind);
  reader.text("kind", kind);
  const auto* const known =
      std::find_if(std::begin(kKinds), std::end(kKinds), [&](const KindName& k) { return kind == k.name; });
  if (known == std::end(kKinds)) {
    std::string names;
    for (const KindName& k : kKinds) names += std::string(names.empty() ? "" : ", ") + k.name;
    reader.fail("kind", fmt::format("= '{}' is not a known kind; use one of {}", kind, names));
  }
  t.kind = known->kind;
  const bool waypoints = t.kind == TraverseKind::kWaypoints;
  const int chosen = reader.layer_of("kind");  // what stood there before is no contradiction
  for (const char* key : {"length_m", "start_x_m", "start_y_m", "start_heading_deg"}) {
    if (waypoints && reader.layer_of(key) >= std::max(0, chosen))
      reader.fail(key, "is already given by the way-points; remove it");
  }
  if (waypoints) t.waypoints_map_m = read_waypoints(reader);
  if (!waypoints && reader.layer_of("waypoints") >= std::max(0, chosen)) {
    reader.fail(
        "waypoints",
        fmt::format("cannot be combined with kind = '{}'; remove it, or set kind = 'waypoints'", kind));
  }
  visit_traverse(reader, t);
  if (t.start_x_m.has_value() != t.start_y_m.has_value()) {
    reader.fail("start_x_m",
                "and start_y_m must be given together; give both, or neither for a centred "
                "path",
                "start_y_m");
  }
  if (std::fabs(t.radius_m) < 0.5 && t.radius_m != 0.0) {
    reader.fail("radius_m", fmt::format("= {} is too tight; use 0.5 m or more to either side", t.radius_m));
  }
  if (count_frames(t) > kMaxFrames) {
    reader.fail("step_m",
                fmt::format("= {}: {:.0f} frames, more than {:.0f}; lengthen the steps, or shorten the "
                            "drive",
                            t.step_m, count_frames(t), kMaxFrames),
                "length_m");
  }
  const std::vector<PathPoint> path = plan(scene);
  if (path.size() < 2) {
    reader.fail("length_m",
                fmt::format("= {} is too short for steps of {} m; a drive needs at least two frames",
                            t.length_m, t.step_m),
                "kind");
  }
  refuse_off_site(reader, scene, path);
}

TomlKeys all_keys() {
  Scene scene;
  TomlKeys keys;
  keys.section("");
  keys.add("seed");
  visit_site(keys, scene.site);
  keys.add("size_m");
  visit_craters(keys, scene.craters);
  visit_rocks(keys, scene.rocks);
  visit_sun(keys, "sun", scene.sun);
  visit_sun(keys, "ortho_sun", scene.ortho_sun);
  visit_light(keys, scene.light);
  visit_camera(keys, scene.camera);
  visit_ortho_camera(keys, scene.ortho_camera);
  visit_rig_numbers(keys, scene.rig);
  for (const char* key : {"name", "hfov_deg"}) keys.add(key);
  visit_traverse(keys, scene.traverse);
  for (const char* key : {"kind", "waypoints"}) keys.add(key);
  visit_attitude(keys, scene.attitude);
  return keys;
}

class Writer {
 public:
  void section(const char* name) { text_ += fmt::format("\n[{}]\n", name); }
  void number(const char* key, double value, double, double) {
    text_ += fmt::format("{} = {}\n", key, value);
  }
  void number(const char* key, const std::optional<double>& value, double, double) {
    if (value) text_ += fmt::format("{} = {}\n", key, *value);
  }
  void whole(const char* key, int value, int, int) { text_ += fmt::format("{} = {}\n", key, value); }
  void flag(const char* key, bool value) { text_ += fmt::format("{} = {}\n", key, value); }
  void text(const char* key, const std::string& value) { text_ += fmt::format("{} = \"{}\"\n", key, value); }
  void waypoints(const std::vector<Vec2>& points) {
    text_ += "waypoints = [";
    for (const Vec2& p : points) text_ += fmt::format("[{}, {}], ", p.x(), p.y());
    text_ += "]\n";
  }
  std::string text_;
};

}  // namespace

const char* name_of(TraverseKind kind) {
  for (const KindName& k : kKinds) {
    if (k.kind == kind) return k.name;
  }
  return "unknown";
}

Scene load_scene(const std::filesystem::path& path, const std::vector<std::string>& sets) {
  std::vector<TomlLayer> layers;
  if (!path.empty()) layers.push_back(read_toml(path));
  for (const std::string& set : sets) layers.push_back(toml_setting(set));
  const TomlKeys keys = all_keys();
  for (const TomlLayer& layer : layers) keys.refuse_others(layer);
  LayeredToml reader(std::move(layers));
  Scene scene;
  reader.section("");
  reader.whole("seed", scene.seed, 0, std::numeric_limits<std::int64_t>::max());
  read_site(reader, scene.site);
  read_craters(reader, scene.site, scene.craters);
  read_rocks(reader, scene.rocks);
  visit_sun(reader, "sun", scene.sun);
  scene.ortho_sun = scene.sun;
  visit_sun(reader, "ortho_sun", scene.ortho_sun);
  visit_light(reader, scene.light);
  visit_camera(reader, scene.camera);
  visit_ortho_camera(reader, scene.ortho_camera);
  read_rig(reader, scene.rig);
  read_traverse(reader, scene);
  visit_attitude(reader, scene.attitude);
  return scene;
}

std::string to_toml(const Scene& scene) {
  Scene s = scene;  // visitors take what a reader may change
  Writer writer;
  writer.text_ = fmt::format("seed = {}\n", s.seed);
  visit_site(writer, s.site);
  visit_craters(writer, s.craters);
  visit_rocks(writer, s.rocks);
  visit_sun(writer, "sun", s.sun);
  visit_sun(writer, "ortho_sun", s.ortho_sun);
  visit_light(writer, s.light);
  visit_camera(writer, s.camera);
  visit_ortho_camera(writer, s.ortho_camera);
  visit_rig_numbers(writer, s.rig);
  writer.text("name", s.rig.name);
  visit_traverse(writer, s.traverse);
  writer.text("kind", name_of(s.traverse.kind));
  if (s.traverse.kind == TraverseKind::kWaypoints) writer.waypoints(s.traverse.waypoints_map_m);
  visit_attitude(writer, s.attitude);
  return writer.text_;
}

StereoRig stereo_rig(const Rig& rig) {
  StereoRig out;
  out.width_px = rig.width_px;
  out.height_px = rig.height_px;
  out.fx_px = rig.fx_px;
  out.fy_px = rig.fy_px;
  out.cx_px = rig.cx_px;
  out.cy_px = rig.cy_px;
  out.baseline_m = rig.baseline_m;
  out.T_rover_cam = mast_pose(rig.height_m, rig.pitch_down_deg * kRadPerDeg, rig.baseline_m);
  return out;
}

Vec3 sun_direction(const Sun& sun) {
  const SinCos e = sin_cos(sun.elevation_deg * kRadPerDeg);
  const SinCos a = sin_cos(sun.azimuth_deg * kRadPerDeg);
  return {e.cos * a.sin, e.cos * a.cos, e.sin};
}

}  // namespace cairn::ground::sim
