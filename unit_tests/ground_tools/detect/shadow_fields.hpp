/// Fields that the shadow detector is fitted to and judged by: scenes of `cairn sim`, each from a seed alone.
/// A record scene.toml lies beside each image: `cairn sim scene.toml` makes the same.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "base/output_file.hpp"
#include "core/trig.hpp"
#include "ground_tools/raster_in_memory.hpp"
#include "sim/data_set.hpp"
#include "sim/hash_random.hpp"
#include "sim/orthoimage.hpp"
#include "sim/simulated_drive.hpp"

namespace cairn::test {

using namespace cairn::ground;

struct ShadowField {
  std::string name;
  sim::Scene scene;
  std::vector<double> pixels_m;
  int samples = sim::kOrthoSamples;  ///< as --ortho-samples
};

/// What a rover does there does not matter.
inline void shorten_traverse(sim::Scene& scene) {
  scene.traverse.kind = sim::TraverseKind::kStraight;
  scene.traverse.length_m = 1.0;
  scene.traverse.margin_m = 1.0;
  scene.rocks.clear_path = false;
}

inline void size_site(sim::Scene& scene, double side_m) {
  scene.site.width_m = scene.site.height_m = side_m;
  scene.site.origin_y_m = -side_m;
}

template <std::size_t kCount>
double one_of(sim::Draw& draw, const double (&values)[kCount]) {
  return values[std::min(kCount - 1, static_cast<std::size_t>(draw.uniform() * kCount))];
}

/// Light, air, camera and albedos: Mars, the moon, and between.
inline void draw_light(sim::Draw& draw, sim::Scene& scene) {
  scene.light.sky = draw.uniform(0.005, 0.1);
  scene.light.backscatter = draw.uniform();
  scene.rocks.albedo = draw.uniform(0.18, 0.4);
  scene.rocks.albedo_spread = draw.uniform(0.1, 0.4);
  scene.rocks.burial = draw.uniform(0.1, 0.5);
  scene.ortho_camera.gamma = draw.uniform() < 0.5 ? 0.5 : 1.0;
  scene.ortho_camera.noise_dn = draw.uniform(0.6, 3.0);
  scene.ortho_camera.blur_px = draw.uniform(0.3, 0.75);
  // Level soil comes to 60 to 130 DN.
  const double in = sin_cos(scene.ortho_sun.elevation_deg * kRadPerDeg).sin;
  const double lit = 0.8 * ((1.0 - scene.light.backscatter) * in + scene.light.backscatter * in / (1.0 + in));
  const double level = std::pow(draw.uniform(60.0, 130.0) / 255.0, 1.0 / scene.ortho_camera.gamma);
  scene.camera.white_radiance = scene.site.albedo * (lit + scene.light.sky) / level;
}

enum class FieldKind {
  kCratered,   ///< 5 cm a pixel: craters or none, boulders or none
  kCoarse,     ///< the same at 15 cm, up to the densest boulders
  kSaturated,  ///< 15 cm, crater beside crater, a low sun, few boulders
  kNear,       ///< 10 m at 5, 10 and 20 mm
  kFar,        ///< 25 cm, boulders alone
  kFresh,      ///< 10 cm, sharp bowls on smoother ground, boulders or none
  kEmpty,      ///< 30 cm, a hectare of craters without a boulder
  kGullied,    ///< 25 cm, gullies and scarps without a boulder (drawn_gullies.hpp)
};
inline constexpr const char* kFieldKinds[] = {"cratered", "coarse", "saturated", "near",
                                              "far",      "fresh",  "empty",     "gullied"};
constexpr double kFieldSide_px = 400.0;  ///< of those with craters

/// Relief, ripples and patches at the scale of `pixel_m`.
inline void draw_ground(sim::Draw& draw, double pixel_m, sim::Site& site) {
  const double scale = pixel_m / 0.05;
  site.relief_wavelength_m = 15.0 * scale;
  site.relief_rms_m = draw.uniform() < 0.5 ? 0.0 : draw.uniform(0.05, 0.5) * scale;
  site.ripple_wavelength_m = draw.uniform(0.3, 1.0) * scale;
  site.ripple_azimuth_deg = draw.uniform(0.0, 360.0);
  site.ripple_height_m = draw.uniform() < 0.3 ? draw.uniform(0.02, 0.08) * site.ripple_wavelength_m : 0.0;
  site.patch_contrast = draw.uniform() < 0.3 ? draw.uniform(0.2, 0.5) : 0.08;
  site.patch_size_m = draw.uniform(0.4, 2.0) * scale;
  site.texture_contrast = draw.uniform(0.03, 0.12);
}

inline void smooth_ground(sim::Site& site) {
  site.relief_rms_m = site.ripple_height_m = 0.0;
  site.patch_contrast = 0.02;
  site.texture_contrast = 0.02;
}

inline void draw_bodies(sim::Draw& draw, FieldKind kind, sim::Scene& scene) {
  sim::Craters& craters = scene.craters;
  sim::Rocks& rocks = scene.rocks;
  rocks.pebbles = 0.0;
  craters.max_degradation = 0.95;
  switch (kind) {
    case FieldKind::kCratered:
      craters.k = one_of(draw, {0.0, 60.0, 150.0, 400.0, 900.0});
      craters.min_diameter_m = 0.2;
      craters.max_diameter_m = 7.0;
      rocks.k = draw.uniform() < 0.3 ? 0.0 : one_of(draw, {0.012, 0.02, 0.03, 0.05, 0.08});
      rocks.min_diameter_m = 0.065;
      break;
    case FieldKind::kCoarse:
      craters.k = one_of(draw, {0.0, 60.0, 150.0, 400.0, 900.0});
      craters.min_diameter_m = 0.6;
      craters.max_diameter_m = 21.0;
      rocks.k = draw.uniform() < 0.2 ? 0.0 : one_of(draw, {0.01, 0.03, 0.07, 0.15, 0.3});
      rocks.min_diameter_m = 0.2;
      rocks.max_diameter_m = 8.0;
      break;
    case FieldKind::kSaturated:
      scene.ortho_sun.elevation_deg = draw.uniform(14.0, 32.0);
      craters.b = draw.uniform(2.0, 3.0);
      craters.min_diameter_m = 0.35;
      craters.max_diameter_m = 21.0;
      craters.k = one_of(draw, {1500.0, 4000.0, 8000.0}) / 0.36 * std::pow(0.35, craters.b);
      rocks.k = one_of(draw, {0.0, 0.01, 0.02, 0.04});
      rocks.min_diameter_m = 0.2;
      rocks.max_diameter_m = 8.0;
      break;
    case FieldKind::kFresh:
      craters.b = draw.uniform(1.2, 2.2);
      craters.min_diameter_m = draw.uniform(0.4, 0.7);
      craters.max_diameter_m = 5.0;
      craters.k = draw.uniform(30.0, 250.0) / 0.16 * std::pow(craters.min_diameter_m, craters.b);
      craters.depth = draw.uniform(0.12, 0.26);
      craters.rim = draw.uniform(0.0, 0.05);
      craters.max_degradation = draw.uniform(0.0, 0.4);
      rocks.k = draw.uniform() < 0.4 ? 0.0 : one_of(draw, {0.01, 0.02, 0.04});
      rocks.min_diameter_m = 0.13;
      rocks.max_diameter_m = 5.0;
      break;
    case FieldKind::kNear:
      rocks.k = one_of(draw, {0.03, 0.07, 0.15});
      rocks.pebbles = 1.5;
      break;
    case FieldKind::kFar:
      rocks.k = one_of(draw, {0.07, 0.15, 0.3});
      rocks.min_diameter_m = 0.3;
      rocks.max_diameter_m = 8.0;
      break;
    case FieldKind::kEmpty:
    case FieldKind::kGullied: break;
  }
}

inline ShadowField empty_field(std::uint64_t seed) {
  ShadowField field;
  sim::Scene& scene = field.scene;
  field.name = fmt::format("empty-{}", seed);
  sim::Draw draw(seed, sim::Stream::kCraters, 1100);
  scene.seed = seed;
  shorten_traverse(scene);
  size_site(scene, 100.0);
  field.pixels_m = {0.3};
  field.samples = 4;
  scene.rocks.k = 0.0;
  scene.ortho_sun = {draw.uniform(15.0, 50.0), draw.uniform(0.0, 360.0)};
  scene.craters.k = draw.uniform(100.0, 600.0);
  scene.craters.max_diameter_m = 40.0;
  scene.site.relief_rms_m = draw.uniform(0.2, 1.0);
  draw_light(draw, scene);
  return field;
}

inline ShadowField shadow_field(FieldKind kind, std::uint64_t seed) {
  if (kind == FieldKind::kEmpty) return empty_field(seed);
  ShadowField field;
  sim::Scene& scene = field.scene;
  field.name = fmt::format("{}-{}", kFieldKinds[static_cast<int>(kind)], seed);
  sim::Draw draw(seed, sim::Stream::kCraters, 1000 + static_cast<std::uint64_t>(kind));
  scene.seed = seed;
  shorten_traverse(scene);
  const bool bare = kind == FieldKind::kNear || kind == FieldKind::kFar;
  scene.ortho_sun = {bare ? draw.uniform(20.0, 60.0) : draw.uniform(15.0, 50.0), draw.uniform(0.0, 360.0)};
  constexpr double kPixels_m[] = {0.05, 0.15, 0.15, 0.0, 0.25, 0.1};
  const double pixel_m = kPixels_m[static_cast<int>(kind)];
  if (kind == FieldKind::kNear) {
    field.pixels_m = {0.005, 0.01, 0.02};
    size_site(scene, 10.0);
  } else {
    field.pixels_m = {pixel_m};
    field.samples = 4;
    size_site(scene, kind == FieldKind::kFar ? 60.0 : kFieldSide_px * pixel_m);
  }
  draw_bodies(draw, kind, scene);
  // Half of the bare ones are the simulator's usual Mars.
  if (bare && draw.uniform() < 0.5) return field;
  if (kind != FieldKind::kNear) draw_ground(draw, pixel_m, scene.site);
  if (kind == FieldKind::kFresh && draw.uniform() < 0.5) smooth_ground(scene.site);
  draw_light(draw, scene);
  return field;
}

/// Whether a map's entry there is this boulder: within 2 px or half its diameter.
inline bool is_at(const Vec2& p_map_m, const TableBoulder& rock, double pixel_m) {
  return (p_map_m - rock.p_map_m).norm() <= std::max(2.0 * pixel_m, 0.5 * rock.diameter_m);
}
/// Or any of 2 px and more that is not much smaller than the entry.
inline bool is_boulder(const Vec2& p_map_m, double diameter_m, double pixel_m,
                       const std::vector<TableBoulder>& rocks) {
  const double least_m = std::max(2.0 * pixel_m, 0.6 * diameter_m);
  return std::any_of(rocks.begin(), rocks.end(), [&](const TableBoulder& rock) {
    return rock.diameter_m >= least_m && is_at(p_map_m, rock, pixel_m);
  });
}

struct RenderedField {
  std::vector<Raster> images;
  std::vector<Sun> suns;
  std::vector<TableBoulder> rocks;
};

/// Renders below `folder` what is not there yet, and reads it.
inline RenderedField render(const ShadowField& field, const std::filesystem::path& folder) {
  const std::filesystem::path at = folder / field.name;
  const std::filesystem::path done = at / "rendered";
  if (!std::filesystem::exists(done) ||
      sim::to_toml(sim::load_scene(at / "scene.toml")) != sim::to_toml(field.scene)) {
    std::filesystem::remove_all(at);
    make_folder(at);
    const sim::World world(field.scene);
    sim::write_truth(world, at);
    std::vector<sim::OrthoProduct> products;
    for (const double pixel_m : field.pixels_m) products.push_back({at / sim::ortho_name(pixel_m), pixel_m});
    sim::write_orthoimages(world, products, {}, field.samples);
    write_file(done, "");
  }
  RenderedField rendered;
  if (field.scene.rocks.k > 0.0) rendered.rocks = read_csv(at / "truth_rocks.csv");
  for (const double pixel_m : field.pixels_m) {
    const std::filesystem::path path = at / sim::ortho_name(pixel_m);
    rendered.images.push_back(read_orthoimage(path));
    rendered.suns.push_back(open_orthoimage(path)->facts().sun.value());
  }
  return rendered;
}

}  // namespace cairn::test
