#include "sim/rocks.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "base/parallel.hpp"
#include "core/trig.hpp"
#include "sim/hash_random.hpp"

namespace cairn::ground::sim {
namespace {

// ---- shapes -----------------------------------------------------------------------------------------------

struct Mesh {
  std::vector<Vec3> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// A ball of 20 * 4^levels triangles.
Mesh ball(int levels) {
  const double g = 0.5 * (1.0 + std::sqrt(5.0));
  Mesh mesh;
  mesh.points = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                 {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  for (Vec3& p : mesh.points) p.normalize();
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, fresh] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.points.size()));
      if (fresh) mesh.points.push_back((mesh.points[a] + mesh.points[b]).normalized());
      return at->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& t : mesh.triangles) {
      const std::uint32_t a = middle(t[0], t[1]);
      const std::uint32_t b = middle(t[1], t[2]);
      const std::uint32_t c = middle(t[2], t[0]);
      for (const auto& f : {std::array{t[0], a, c}, {t[1], b, a}, {t[2], c, b}, {a, b, c}})
        finer.push_back(f);
    }
    mesh.triangles = std::move(finer);
  }
  return mesh;
}

/// Smooth noise over the unit ball: a few waves in drawn directions.
double bumps(const Vec3& p, const std::vector<Vec3>& waves, const std::vector<double>& phases) {
  double sum = 0.0;
  for (std::size_t i = 0; i < waves.size(); ++i)
    sum += std::sin(waves[i].dot(p) + phases[i]) / waves[i].norm();
  return sum;
}

Vec3 direction(Draw& draw) {
  const double z = draw.uniform(-1.0, 1.0);
  const double turn = draw.uniform(0.0, 2.0 * kPi);
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(turn), r * std::sin(turn), z};
}

struct Outline {
  double area = 0.0;
  Vec2 centroid = Vec2(0.0, 0.0);
};

/// The convex hull's area and centroid (monotone chain).
Outline outline_of(std::vector<Vec2> points) {
  std::sort(points.begin(), points.end(),
            [](const Vec2& a, const Vec2& b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
  const auto cross = [](const Vec2& o, const Vec2& a, const Vec2& b) {
    return (a.x() - o.x()) * (b.y() - o.y()) - (a.y() - o.y()) * (b.x() - o.x());
  };
  std::vector<Vec2> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t begin = hull.size();
    for (const Vec2& p : points) {
      while (hull.size() >= begin + 2 && cross(hull[hull.size() - 2], hull.back(), p) <= 0.0) hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  Outline outline;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Vec2& a = hull[i];
    const Vec2& b = hull[(i + 1) % hull.size()];
    const double w = a.x() * b.y() - b.x() * a.y();
    outline.area += 0.5 * w;
    outline.centroid += w / 6.0 * (a + b);
  }
  outline.centroid /= outline.area;
  return outline;
}

RockShape make_shape(const Scene& scene, std::size_t number, int levels) {
  Draw draw(scene.seed, Stream::kRocks, 1, number);
  Mesh mesh = ball(levels);
  std::vector<Vec3> waves;
  std::vector<double> phases;
  for (const double frequency : {2.0, 2.6, 3.5, 5.0, 7.0, 10.0, 14.0, 19.0, 26.0}) {
    waves.push_back(frequency * direction(draw));
    phases.push_back(draw.uniform(0.0, 2.0 * kPi));
  }
  // Cuts: planes at a drawn distance; half of the shapes stay round.
  struct Cut {
    Vec3 n;
    double d;
  };
  std::vector<Cut> cuts;
  const bool angular = draw.uniform() < 0.6;
  const int count =
      angular ? 5 + static_cast<int>(draw.uniform(0.0, 8.0)) : static_cast<int>(draw.uniform(0.0, 3.0));
  for (int i = 0; i < count; ++i) cuts.push_back({direction(draw), draw.uniform(0.62, 0.9)});
  const double roughness = draw.uniform(0.10, 0.28);
  const Vec3 stretch(1.0, draw.uniform(0.62, 1.0), draw.uniform(0.5, 0.85));
  for (Vec3& p : mesh.points) {
    const double radius = 1.0 + roughness * bumps(p, waves, phases);
    double r = radius;
    for (const Cut& cut : cuts) {
      const double across = cut.n.dot(p);
      if (across > 1e-6) r = std::min(r, cut.d / across);
    }
    // Not quite flat: a cut face keeps a little of the bumps.
    r += 0.06 * (radius - r);
    p = (r * p).cwiseProduct(stretch);
  }
  double low = mesh.points[0].z();
  double high = low;
  for (const Vec3& p : mesh.points) {
    low = std::min(low, p.z());
    high = std::max(high, p.z());
  }
  const double burial = std::clamp(scene.rocks.burial * draw.uniform(0.5, 1.5), 0.0, 0.9);
  const double ground = low + burial * (high - low);
  std::vector<Vec2> above;
  for (const Vec3& p : mesh.points) {
    if (p.z() >= ground) above.emplace_back(p.x(), p.y());
  }
  const Outline outline = outline_of(std::move(above));
  const double scale = 1.0 / (2.0 * std::sqrt(outline.area / kPi));
  RockShape shape;
  std::vector<Vec3> normals(mesh.points.size(), Vec3(0.0, 0.0, 0.0));
  for (Vec3& p : mesh.points) {
    p = scale * Vec3(p.x() - outline.centroid.x(), p.y() - outline.centroid.y(), p.z() - ground);
    shape.top = std::max(shape.top, p.z());
    shape.points.push_back(p.cast<float>());
  }
  for (const auto& t : mesh.triangles) {
    const Vec3 n = (mesh.points[t[1]] - mesh.points[t[0]]).cross(mesh.points[t[2]] - mesh.points[t[0]]);
    for (const std::uint32_t i : t) normals[i] += n;
  }
  for (const Vec3& n : normals) shape.normals.push_back(n.normalized().cast<float>());
  shape.triangles = std::move(mesh.triangles);
  return shape;
}

// ---- places -----------------------------------------------------------------------------------------------

/// Diameters of the law between two bounds, for a uniform number: by a table of the cumulated law.
class SizeLaw {
 public:
  SizeLaw(double k, double from_m, double to_m) : from_m_(from_m), ratio_(to_m / from_m) {
    for (std::size_t i = 0; i <= kSteps; ++i)
      cumulated_.push_back(rocks_per_m2(k, from_m, diameter(static_cast<double>(i))));
  }
  double operator()(double uniform) const {
    const double wanted = uniform * cumulated_.back();
    const auto above = std::upper_bound(cumulated_.begin() + 1, cumulated_.end() - 1, wanted);
    const double low = *(above - 1);
    const double within = *above > low ? (wanted - low) / (*above - low) : 0.0;
    return diameter(static_cast<double>(above - 1 - cumulated_.begin()) + within);
  }

 private:
  static constexpr std::size_t kSteps = 2000;
  double diameter(double step) const {
    return from_m_ * std::pow(ratio_, step / static_cast<double>(kSteps));
  }
  double from_m_;
  double ratio_;
  std::vector<double> cumulated_;
};

/// Rocks by place, so that the next keeps off those already there.
class Places {
 public:
  explicit Places(const Site& site) : site_(site) {
    columns_ = static_cast<std::size_t>(site.width_m / kCell_m) + 1;
    cells_.resize(columns_ * (static_cast<std::size_t>(site.height_m / kCell_m) + 1));
  }
  bool is_free(const Vec2& p, double diameter_m, const std::vector<Rock>& rocks) const {
    bool free = true;
    around(p, 0.5 * diameter_m, [&](const std::vector<std::uint32_t>& cell) {
      for (const std::uint32_t i : cell) {
        const double apart = 0.5 * (diameter_m + rocks[i].diameter_m);
        free = free && (rocks[i].p_map_m - p).norm() >= 1.05 * apart;
      }
    });
    return free;
  }
  void add(std::uint32_t index, const std::vector<Rock>& rocks) {
    const Rock& rock = rocks[index];
    around(rock.p_map_m, 0.5 * rock.diameter_m,
           [&](std::vector<std::uint32_t>& cell) { cell.push_back(index); });
  }

 private:
  static constexpr double kCell_m = 0.25;
  template <typename Visit>
  void around(const Vec2& p, double radius_m, Visit visit) const {
    const auto index = [](double x, double most) {
      return static_cast<std::size_t>(std::clamp(std::floor(x / kCell_m), 0.0, std::floor(most / kCell_m)));
    };
    const double x = p.x() - site_.origin_x_m;
    const double y = p.y() - site_.origin_y_m;
    for (std::size_t j = index(y - radius_m, site_.height_m); j <= index(y + radius_m, site_.height_m); ++j) {
      for (std::size_t i = index(x - radius_m, site_.width_m); i <= index(x + radius_m, site_.width_m); ++i)
        visit(cells_[j * columns_ + i]);
    }
  }

  const Site& site_;
  std::size_t columns_;
  mutable std::vector<std::vector<std::uint32_t>> cells_;
};

double distance_to(const std::vector<PathPoint>& path, const Vec2& p) {
  double best = 1e300;
  for (const PathPoint& q : path) best = std::min(best, (Vec2(q.x_m, q.y_m) - p).squaredNorm());
  return std::sqrt(best);
}

}  // namespace

double rocks_per_m2(double k, double from_m, double to_m) {
  const double q = 1.79 + 0.152 / k;
  // Integral of k q exp(-q D) 4 / (pi D^2), by Simpson's rule in log D.
  const int steps = 400;
  const double low = std::log(from_m);
  const double h = (std::log(to_m) - low) / steps;
  double sum = 0.0;
  for (int i = 0; i <= steps; ++i) {
    const double d = std::exp(low + h * i);
    const double weight = i == 0 || i == steps ? 1.0 : (i % 2 == 1 ? 4.0 : 2.0);
    sum += weight * std::exp(-q * d) / d;
  }
  return k * q * 4.0 / kPi * sum * h / 3.0;
}

RockShape make_ball(int levels) {
  Mesh mesh = ball(levels);
  RockShape shape;
  for (const Vec3& p : mesh.points) {
    shape.points.push_back((0.5 * p).cast<float>());
    shape.normals.push_back(p.cast<float>());
  }
  shape.triangles = std::move(mesh.triangles);
  shape.top = 0.5;
  return shape;
}

std::vector<RockShape> make_shapes(const Scene& scene) {
  std::vector<RockShape> shapes(kFineShapes + kPlainShapes + kPebbleShapes);
  parallel_for(shapes.size(), [&](std::size_t i) {
    shapes[i] = make_shape(scene, i, i < kFineShapes ? 5 : (i < kFineShapes + kPlainShapes ? 4 : 2));
  });
  return shapes;
}

std::vector<Rock> place_rocks(const Scene& scene, const Terrain& terrain,
                              const std::vector<RockShape>& shapes, const std::vector<PathPoint>& path) {
  const Site& site = scene.site;
  const Rocks& law = scene.rocks;
  const double area = site.width_m * site.height_m;
  struct Class {
    Stream stream;
    double from_m;
    double to_m;
    double share;
  };
  std::vector<Rock> rocks;
  std::vector<double> sizes;
  for (const Class& c :
       {Class{Stream::kRocks, law.min_diameter_m, law.max_diameter_m, 1.0},
        Class{Stream::kPebbles, law.pebble_min_diameter_m, law.min_diameter_m, law.pebbles}}) {
    if (!(c.to_m > c.from_m) || c.share <= 0.0 || law.k <= 0.0) continue;
    Draw draw(scene.seed, c.stream, 2);
    const SizeLaw size(law.k, c.from_m, c.to_m);
    const std::size_t count = poisson(draw, c.share * area * rocks_per_m2(law.k, c.from_m, c.to_m));
    for (std::size_t i = 0; i < count; ++i) sizes.push_back(size(draw.uniform()));
  }
  std::sort(sizes.begin(), sizes.end(), std::greater<>());

  Places places(site);
  rocks.reserve(sizes.size());
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    Draw draw(scene.seed, Stream::kRocks, 3, i);
    Rock rock;
    rock.diameter_m = sizes[i];
    // A site so full that forty trials fail takes the last: the law of sizes goes first.
    for (int trial = 0; trial < 40; ++trial) {
      rock.p_map_m = Vec2(site.origin_x_m + draw.uniform() * site.width_m,
                          site.origin_y_m + draw.uniform() * site.height_m);
      if (places.is_free(rock.p_map_m, rock.diameter_m, rocks)) break;
    }
    const std::size_t first =
        sizes[i] >= 0.25 ? 0 : (sizes[i] >= law.min_diameter_m ? kFineShapes : kFineShapes + kPlainShapes);
    const std::size_t many =
        sizes[i] >= 0.25 ? kFineShapes : (sizes[i] >= law.min_diameter_m ? kPlainShapes : kPebbleShapes);
    rock.shape = static_cast<std::uint16_t>(
        first + std::min(many - 1, static_cast<std::size_t>(draw.uniform() * static_cast<double>(many))));
    rock.yaw_rad = draw.uniform(0.0, 2.0 * kPi);
    rock.albedo =
        static_cast<float>(law.albedo * std::clamp(1.0 + law.albedo_spread * draw.normal(), 0.35, 2.2));
    rocks.push_back(rock);
    places.add(static_cast<std::uint32_t>(i), rocks);
  }
  for (Rock& rock : rocks) {
    const double x = rock.p_map_m.x();
    const double y = rock.p_map_m.y();
    const double r = 0.35 * rock.diameter_m;
    rock.z_ground_map_m = terrain.height_m(x, y);
    rock.z_foot_map_m = std::min({rock.z_ground_map_m, terrain.height_m(x + r, y), terrain.height_m(x - r, y),
                                  terrain.height_m(x, y + r), terrain.height_m(x, y - r)});
    rock.height_m = rock.diameter_m * shapes[rock.shape].top + rock.z_foot_map_m - rock.z_ground_map_m;
  }
  if (law.clear_path) {
    const auto hit = [&](const Rock& rock) {
      return rock.height_m > law.clear_height_m &&
             distance_to(path, rock.p_map_m) < law.clear_distance_m + 0.5 * rock.diameter_m;
    };
    rocks.erase(std::remove_if(rocks.begin(), rocks.end(), hit), rocks.end());
  }
  return rocks;
}

}  // namespace cairn::ground::sim
