#include "sim/craters.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/trig.hpp"
#include "sim/hash_random.hpp"

namespace cairn::ground::sim {
namespace {

constexpr double kTwoWaves = 0.04;
constexpr double kThreeWaves = 0.03;
constexpr double kMostWave = 0.1;

Vec2 wave(Draw& draw, double deviation) {
  const double size = std::clamp(deviation * draw.normal(), -kMostWave, kMostWave);
  const double turn = draw.uniform(0.0, 2.0 * kPi);
  return {size * std::cos(turn), size * std::sin(turn)};
}

Crater make_crater(const Scene& scene, double diameter_m, std::uint64_t number) {
  const Craters& law = scene.craters;
  const Site& site = scene.site;
  Draw draw(scene.seed, Stream::kCraters, 2, number);
  Crater c;
  c.diameter_m = diameter_m;
  c.p_map_m =
      Vec2(site.origin_x_m + draw.uniform() * site.width_m, site.origin_y_m + draw.uniform() * site.height_m);
  c.degradation = draw.uniform(law.min_degradation, law.max_degradation);
  c.power = draw.uniform(2.0, 3.0);
  c.two = wave(draw, kTwoWaves);
  c.three = wave(draw, kThreeWaves);
  const double left = 1.0 - 0.85 * c.degradation;
  c.depth_m = left * law.depth * diameter_m;
  c.crest_m = left * law.rim * diameter_m;
  c.round_m = (0.04 + 0.3 * c.degradation) * (c.power * (c.depth_m + c.crest_m) + 3.0 * c.crest_m);
  c.rim_m = c.crest_m - 0.25 * c.round_m;
  return c;
}

}  // namespace

double craters_expected(const Craters& law, const Site& site) {
  constexpr double kHectare_m2 = 1.0e4;
  return law.k * (std::pow(law.min_diameter_m, -law.b) - std::pow(law.max_diameter_m, -law.b)) *
         site.width_m * site.height_m / kHectare_m2;
}

std::vector<Crater> make_craters(const Scene& scene) {
  const Craters& law = scene.craters;
  Draw draw(scene.seed, Stream::kCraters, 1);
  const std::size_t count = poisson(draw, craters_expected(law, scene.site));
  const double many = std::pow(law.min_diameter_m, -law.b);
  const double few = std::pow(law.max_diameter_m, -law.b);
  std::vector<double> sizes(count);
  for (double& size : sizes) size = std::pow(few + (many - few) * draw.uniform(), -1.0 / law.b);
  std::sort(sizes.begin(), sizes.end(), std::greater<>());
  std::vector<Crater> craters;
  for (std::size_t i = 0; i < count; ++i) craters.push_back(make_crater(scene, sizes[i], i));
  return craters;
}

double crater_height_m(const Crater& c, const Vec2& off_m) {
  const double away = off_m.norm();
  const Vec2 to = away > 0.0 ? Vec2(off_m / away) : Vec2(1.0, 0.0);
  const Vec2 twice(to.x() * to.x() - to.y() * to.y(), 2.0 * to.x() * to.y());
  const Vec2 thrice(to.x() * twice.x() - to.y() * twice.y(), to.y() * twice.x() + to.x() * twice.y());
  const double r = away / (0.5 * c.diameter_m * (1.0 + c.two.dot(twice) + c.three.dot(thrice)));
  if (r >= 3.0) return 0.0;
  const double bowl = -c.depth_m + (c.depth_m + c.crest_m) * std::pow(r, c.power);
  const double held = std::max(r, 0.5);
  const double rim = c.crest_m / (held * held * held) * std::min(1.0, 3.0 - r);
  if (c.round_m <= 0.0) return std::min(bowl, rim);
  const double t = std::clamp(0.5 + 0.5 * (bowl - rim) / c.round_m, 0.0, 1.0);
  return bowl + t * (rim - bowl) - c.round_m * t * (1.0 - t);
}

}  // namespace cairn::ground::sim
