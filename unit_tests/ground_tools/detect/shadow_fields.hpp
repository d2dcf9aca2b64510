/// Fields that the shadow detector is judged by: scenes of `cairn sim`, each from a seed alone.
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

/// 400 px of 5 cm: craters of 4 px and more or none, boulders or none, suns of 15 to 50 degrees.
inline ShadowField cratered_field(std::uint64_t seed) {
  ShadowField field;
  sim::Scene& scene = field.scene;
  field.name = fmt::format("cratered-{}", seed);
  sim::Draw draw(seed, sim::Stream::kCraters, 1000);
  scene.seed = seed;
  shorten_traverse(scene);
  scene.ortho_sun = {draw.uniform(15.0, 50.0), draw.uniform(0.0, 360.0)};
  size_site(scene, 20.0);
  field.pixels_m = {0.05};
  field.samples = 4;
  scene.rocks.min_diameter_m = 0.065;
  scene.rocks.pebbles = 0.0;
  scene.craters.max_diameter_m = 7.0;
  scene.craters.max_degradation = 0.95;
  scene.craters.k = one_of(draw, {0.0, 60.0, 150.0, 400.0, 900.0});
  scene.craters.min_diameter_m = 0.2;
  scene.rocks.k = draw.uniform() < 0.3 ? 0.0 : one_of(draw, {0.012, 0.02, 0.03, 0.05, 0.08});
  scene.site.relief_wavelength_m = 15.0;
  scene.site.relief_rms_m = draw.uniform() < 0.5 ? 0.0 : draw.uniform(0.05, 0.5);
  scene.site.ripple_wavelength_m = draw.uniform(0.3, 1.0);
  scene.site.ripple_azimuth_deg = draw.uniform(0.0, 360.0);
  scene.site.ripple_height_m =
      draw.uniform() < 0.3 ? draw.uniform(0.02, 0.08) * scene.site.ripple_wavelength_m : 0.0;
  scene.site.patch_contrast = draw.uniform() < 0.3 ? draw.uniform(0.2, 0.5) : 0.08;
  scene.site.patch_size_m = draw.uniform(0.4, 2.0);
  scene.site.texture_contrast = draw.uniform(0.03, 0.12);
  draw_light(draw, scene);
  return field;
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
