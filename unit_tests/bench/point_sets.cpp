#include "bench/point_sets.hpp"

#include <algorithm>

namespace cairn::bench {

double uniform(Rng& rng, double low, double high) {
  return low + (high - low) * (static_cast<double>(rng() >> 11U) * 0x1p-53);
}
double gauss(Rng& rng) {
  const double u = uniform(rng, 1e-300, 1.0);
  return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * kPi * uniform(rng, 0.0, 1.0));
}

namespace {

int poisson(Rng& rng, double mean) { return std::poisson_distribution<int>(mean)(rng); }

/// Power law of sizes, 0.1 m up, as counts of rocks have it.
float diameter(Rng& rng) {
  return static_cast<float>(0.1 * std::min(20.0, std::pow(uniform(rng, 1e-9, 1.0), -0.5)));
}

}  // namespace

std::vector<MapBoulder> strew(Rng& rng, const GroundKind& kind, double angle_rad, double side_m) {
  std::vector<MapBoulder> out;
  const auto add = [&](double x, double y) {
    if (std::fabs(x) > 0.5 * side_m || std::fabs(y) > 0.5 * side_m) return;
    MapBoulder b;
    b.p_map_m = Vec2(x, y);
    b.diameter_m = diameter(rng);
    out.push_back(b);
  };
  const double half = 0.5 * side_m;
  if (kind.pattern == Pattern::kScattered) {
    const int n = poisson(rng, kind.per_m2 * side_m * side_m);
    for (int i = 0; i < n; ++i) add(uniform(rng, -half, half), uniform(rng, -half, half));
  } else if (kind.pattern == Pattern::kClusters) {
    const double wide = side_m + 8.0 * kind.spread_m;
    const int n = poisson(rng, kind.per_m2 / kind.per_cluster * wide * wide);
    for (int i = 0; i < n; ++i) {
      const double x = uniform(rng, -0.5 * wide, 0.5 * wide);
      const double y = uniform(rng, -0.5 * wide, 0.5 * wide);
      for (int k = 0; k < kind.per_cluster; ++k)
        add(x + kind.spread_m * gauss(rng), y + kind.spread_m * gauss(rng));
    }
  } else {
    // A lattice of squares, or rows twice as far apart as the boulders in them, each row at a phase
    // of its own.
    const SinCos r = sin_cos(angle_rad);
    const bool rows = kind.pattern == Pattern::kRows;
    const double along = std::sqrt(1.0 / kind.per_m2 / (rows ? 2.0 : 1.0));
    const double across = rows ? 2.0 * along : along;
    const int n = static_cast<int>(side_m / along) + 2;
    const double u0 = uniform(rng, 0.0, along);
    const double v0 = uniform(rng, 0.0, across);
    for (int j = -n; j <= n; ++j) {
      const double phase = rows ? uniform(rng, 0.0, along) : u0;
      for (int i = -n; i <= n; ++i) {
        const double u = i * along + phase + kind.jitter_m * gauss(rng);
        const double v = j * across + v0 + kind.jitter_m * gauss(rng);
        add(r.cos * u - r.sin * v, r.sin * u + r.cos * v);
      }
    }
  }
  return out;
}

void make_trial(Rng& rng, const GroundKind& kind, const View& view, const Start& start, Site site,
                Trial& out) {
  const int truths =
      view.truths > 0 ? view.truths : static_cast<int>(std::lround(view.boulders * (1.0 - view.clutter)));
  const double seen =
      view.radius_m > 0.0 ? view.radius_m : std::max(4.0, std::sqrt(truths / (0.8 * kPi * kind.per_m2)));
  const double spacing = 1.0 / std::sqrt(kind.per_m2);
  const double far = 2.0 * seen;  // of a local boulder from the pivot, at most, or nearly
  const double reach = std::max(5.0 * start.sigma_xy_m + start.ring_spacings * spacing, 1.6 * spacing);
  out.window_m = far + reach;
  const double error_most = std::max(start.error_high_m, 6.0 * start.sigma_xy_m);
  const double side = 2.0 * (out.window_m + error_most + seen) + (site == Site::kShifted ? 16.0 : 0.0);
  const double angle = uniform(rng, 0.0, 2.0 * kPi);  // another place's lattice lies as this one does
  std::vector<MapBoulder> map = strew(rng, kind, angle, side);

  // The truth, in a frame of its own.
  out.T_map_site = {uniform(rng, -5.0, 5.0), uniform(rng, -5.0, 5.0), uniform(rng, -kPi, kPi)};
  const Vec2 centre(0.0, 0.0);  // of what is seen, in map
  const double phi = uniform(rng, 0.0, 2.0 * kPi);
  const Vec2 pivot_map = centre + uniform(rng, 0.0, 0.5) * seen * Vec2(std::cos(phi), std::sin(phi));
  const Pose2 T_site_map = out.T_map_site.inverse();
  out.pivot_site_m = T_site_map * pivot_map;

  std::vector<MapBoulder> ground = site == Site::kElsewhere ? strew(rng, kind, angle, 6.0 * seen) : map;
  // The nearest that there are, a fifth of them unseen.
  std::vector<MapBoulder> near = ground;
  std::sort(near.begin(), near.end(), [&](const MapBoulder& a, const MapBoulder& b) {
    return (a.p_map_m - centre).squaredNorm() < (b.p_map_m - centre).squaredNorm();
  });
  std::size_t inside = 0;
  while (inside < near.size() && (inside < static_cast<std::size_t>(1.25 * truths) ||
                                  (near[inside].p_map_m - centre).norm() <= seen)) {
    ++inside;
  }
  near.resize(inside);
  std::shuffle(near.begin(), near.end(), rng);
  out.local.clear();
  out.truths = 0;
  const auto see = [&](const Vec2& p_map, double d) {
    LocalBoulder b;
    b.p_site_m = T_site_map * p_map;
    b.diameter_m =
        view.size_noise > 0.0 ? static_cast<float>(d * std::exp(view.size_noise * gauss(rng))) : 0.0F;
    b.id = static_cast<std::uint32_t>(out.local.size());
    b.sightings = 5;
    (void)out.local.push_back(b);
  };
  for (int i = 0; i < truths && i < static_cast<int>(near.size()) && site != Site::kClutter; ++i) {
    see(near[i].p_map_m + view.noise_m * Vec2(gauss(rng), gauss(rng)),
        static_cast<double>(near[i].diameter_m));
    ++out.truths;
  }
  const int others = site == Site::kClutter ? view.boulders : std::max(0, view.boulders - truths);
  for (int i = 0; i < others; ++i) {
    const double a = uniform(rng, 0.0, 2.0 * kPi);
    const double r = seen * std::sqrt(uniform(rng, 0.0, 1.0));
    see(centre + r * Vec2(std::cos(a), std::sin(a)), static_cast<double>(diameter(rng)));
  }
  std::shuffle(out.local.begin(), out.local.end(), rng);

  // The start.
  Vec2 off(start.sigma_xy_m * gauss(rng), start.sigma_xy_m * gauss(rng));
  if (start.error_low_m >= 0.0) {
    const double a = uniform(rng, 0.0, 2.0 * kPi);
    off = uniform(rng, start.error_low_m, start.error_high_m) * Vec2(std::cos(a), std::sin(a));
  }
  const double turn = start.yaw_limit_rad > 0.0 ? uniform(rng, -start.yaw_limit_rad, start.yaw_limit_rad)
                                                : start.sigma_yaw_rad * gauss(rng);
  Pose2 prior{0.0, 0.0, wrap_angle(out.T_map_site.yaw_rad + turn)};
  const Vec2 t = pivot_map + off - prior * out.pivot_site_m;
  prior.x_m = t.x();
  prior.y_m = t.y();
  out.T_map_site_prior = prior;
  const double xy = start.sigma_xy_m * start.sigma_xy_m;
  out.covariance = Vec3(xy, xy, start.sigma_yaw_rad * start.sigma_yaw_rad).asDiagonal();

  const Vec2 middle = pivot_map + off;
  out.map.clear();
  out.cut = false;
  for (MapBoulder b : map) {
    if (site == Site::kMirrored) b.p_map_m.x() = -b.p_map_m.x();
    if (site == Site::kShifted) b.p_map_m.x() += 7.0;
    if ((b.p_map_m - middle).norm() > out.window_m) continue;
    if (view.size_noise == 0.0) b.diameter_m = 0.0F;
    out.cut = !out.map.push_back(b) || out.cut;
  }
}

}  // namespace cairn::bench
